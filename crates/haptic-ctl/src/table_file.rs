//! A table that is written as CSV.

use crate::failure::Failure;
use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::Path;

/// A file of CSV, by its name.
pub(crate) struct TableFile<'a> {
    path: &'a Path,
    file: BufWriter<File>,
}

/// Refuses a name that ends in no `.csv`, or that is taken where nothing may be replaced. A pipe or a
/// device may have any name.
pub(crate) fn check(path: &Path, replace: bool) -> Result<(), Failure> {
    if path.metadata().is_ok_and(|found| !found.is_file() && !found.is_dir()) {
        return Ok(());
    }
    if path
        .extension()
        .is_none_or(|ending| !ending.eq_ignore_ascii_case("csv"))
    {
        return Err(Failure::Usage(format!(
            "{}: what is written is CSV: the name of its file ends in .csv",
            path.display()
        )));
    }
    if !replace && path.exists() {
        return Err(Failure::exists(path));
    }
    Ok(())
}

/// Refuses an output that would take the place of one of these files, existing or not.
pub(crate) fn refuse_overwriting<'a>(out: &Path, mut others: impl Iterator<Item = &'a Path>) -> Result<(), Failure> {
    let same = |a: &Path, b: &Path| match (a.canonicalize(), b.canonicalize()) {
        (Ok(a), Ok(b)) => a == b,
        _ => a == b,
    };
    let (shown, other) = (out.display(), others.find(|other| same(out, other)));
    other.map_or(Ok(()), |other| {
        let other = other.display();
        Err(Failure::Usage(format!(
            "{shown} would be written over {other}: name another file"
        )))
    })
}

impl<'a> TableFile<'a> {
    pub(crate) fn create(path: &'a Path, replace: bool) -> Result<Self, Failure> {
        check(path, replace)?;
        let is_new = !replace && !path.exists();
        let created = OpenOptions::new()
            .write(true)
            .create(true)
            .create_new(is_new)
            .truncate(true)
            .open(path);
        let file = created.map_err(|error| Failure::not_created(path, &error))?;
        Ok(Self {
            path,
            file: BufWriter::new(file),
        })
    }

    pub(crate) fn write(&mut self, write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> Result<(), Failure> {
        write(&mut self.file).map_err(|error| Failure::File(format!("{}: {error}", self.path.display())))
    }

    pub(crate) fn line(&mut self, line: std::fmt::Arguments<'_>) -> Result<(), Failure> {
        self.write(|file| writeln!(file, "{line}"))
    }

    /// Has all of it written.
    pub(crate) fn finish(mut self) -> Result<(), Failure> {
        self.write(Write::flush)
    }
}
