//! `recording collect`: recordings of many rigs as one Parquet set, partitioned by rig and date.

use super::{not_copied, unreadable};
use crate::failure::Failure;
use crate::{output, progress};
use clap::ValueHint;
use haptic_recording::Totals;
use jiff::tz::TimeZone;
use std::collections::HashSet;
use std::fs;
use std::path::{Path, PathBuf};

pub(super) const HELP: &str = "\
Each recording becomes a file rig=NAME/date=YYYY-MM-DD/HHMMSS-FILE.parquet of the set, by its beginning (UTC). If one \
of the files exists, none is written.

Example:
  haptic-ctl recording collect set --as left monday.mcap tuesday.mcap";

/// Longest name of a rig, letters.
const MAX_NAME: usize = 64;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Directory of the set
    #[arg(value_hint = ValueHint::DirPath)]
    set: PathBuf,

    /// Recordings to read
    #[arg(required = true, value_hint = ValueHint::FilePath)]
    files: Vec<PathBuf>,

    /// Name of their rig [default: the device as each recording has it]
    #[arg(long = "as", value_name = "NAME", value_parser = haptic_ipc::socket_path::rig_name)]
    rig: Option<String>,
}

/// A recording and its place in the set.
struct Placement<'a> {
    from: &'a Path,
    to: PathBuf,
}

pub(super) fn run(arguments: &Arguments, json: bool) -> Result<(), Failure> {
    let placed = arguments.files.iter().map(|from| place(arguments, from));
    let placed: Vec<Placement<'_>> = placed.collect::<Result<_, _>>()?;
    let mut places = HashSet::new();
    for Placement { from, to } in &placed {
        if to.exists() {
            return Err(Failure::Usage(format!(
                "{}: {} exists, and nothing of a set is replaced",
                from.display(),
                to.display()
            )));
        }
        if !places.insert(to) {
            return Err(Failure::Usage(format!(
                "{}: another of these recordings has the same name and the same beginning",
                from.display()
            )));
        }
    }
    let bar = progress::busy("collecting");
    let mut collected: Vec<(&Path, Totals)> = Vec::new();
    for Placement { from, to } in &placed {
        let directory = to.parent().unwrap_or(Path::new("."));
        fs::create_dir_all(directory).map_err(|error| Failure::not_created(directory, &error))?;
        let totals = haptic_recording::collect(from, to).map_err(|error| not_copied(&error))?;
        collected.push((to, totals));
    }
    bar.finish_and_clear();
    if json {
        let each = collected.iter().map(|(to, totals)| super::as_json(to, totals));
        return output::json(&each.collect::<Vec<_>>());
    }
    for (to, totals) in &collected {
        output::text(&format!("{}: {}", to.display(), super::as_text(totals)))?;
    }
    Ok(())
}

/// The place of a recording in the set.
fn place<'a>(arguments: &Arguments, from: &'a Path) -> Result<Placement<'a>, Failure> {
    let reader = haptic_recording::open_any(from).map_err(|error| unreadable(from, &error))?;
    let metadata = reader.metadata();
    let rig = arguments.rig.clone().unwrap_or_else(|| plain(&metadata.device));
    let begun = output::moment(metadata.started_unix_s, &TimeZone::UTC).ok_or_else(|| {
        let begun = metadata.started_unix_s;
        Failure::BadRecording(format!("{}: {begun} s after 1970 is not a valid date", from.display()))
    })?;
    let stem = from.file_stem().unwrap_or_default().to_string_lossy();
    let to = arguments
        .set
        .join(format!("rig={rig}"))
        .join(begun.strftime("date=%Y-%m-%d").to_string())
        .join(format!("{}-{}.parquet", begun.strftime("%H%M%S"), plain(&stem)));
    Ok(Placement { from, to })
}

/// A text as part of a path that every program reads alike: letters, digits, `_`, `.` and `-`.
fn plain(text: &str) -> String {
    let words = text.split(|letter: char| !letter.is_ascii_alphanumeric() && !"_.".contains(letter));
    let words: Vec<&str> = words.filter(|word| !word.is_empty()).collect();
    let mut plain = words.join("-");
    plain.truncate(MAX_NAME);
    if plain.is_empty() { "unnamed".to_owned() } else { plain }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_as_part_of_a_path_is_plain() {
        for (device, name) in [
            ("serial:/dev/ttyACM0", "serial-dev-ttyACM0"),
            ("fake rig: 1.4 kg, a = b", "fake-rig-1.4-kg-a-b"),
            ("../..", "..-.."),
            ("ä", "unnamed"),
        ] {
            assert_eq!(plain(device), name);
        }
        assert_eq!(plain(&"x".repeat(100)).len(), MAX_NAME);
    }
}
