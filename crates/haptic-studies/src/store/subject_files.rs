//! The files of a subject: rows, and recordings.

use super::super::plan::Task;
use super::super::subject::Subject;
use super::super::trial::{self, Trial, VoidedTrial};
use super::DATA;
use super::disk::{append, at, create_folder, replace, sync_folder, whole_lines};
use super::error::StoreError;
use haptic_ipc::{Event, Sample, SamplesEvent};
use haptic_recording::{CreateError, Mark, Metadata};
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};

/// Folder of a subject's session.
fn session(folder: &Path, subject: &Subject) -> PathBuf {
    folder
        .join(DATA)
        .join(format!("subject-{}", subject.code))
        .join(format!("session-{:02}", subject.session))
}

fn table(folder: &Path, subject: &Subject, task: Task, ending: &str) -> PathBuf {
    let Subject {
        code, session: number, ..
    } = subject;
    session(folder, subject).join(format!(
        "subject-{code}_session-{number:02}_task-{}_{ending}.csv",
        task.name()
    ))
}

/// The file of a subject's rows, of practice or of the trials that count.
fn rows_file(folder: &Path, subject: &Subject, task: Task, is_practice: bool) -> PathBuf {
    table(folder, subject, task, if is_practice { "practice" } else { "data" })
}

/// The file of what is known about a subject's trials.
pub(super) fn sidecar(folder: &Path, subject: &Subject, task: Task) -> PathBuf {
    rows_file(folder, subject, task, false).with_extension("json")
}

/// The whole rows of a subject, of practice or of the trials that count.
pub(super) fn trials<T: Trial>(
    folder: &Path,
    subject: &Subject,
    task: Task,
    is_practice: bool,
) -> Result<Vec<T>, StoreError> {
    rows(&rows_file(folder, subject, task, is_practice)).map(|rows| rows.trials)
}

/// What a file of rows holds.
struct Rows<T> {
    trials: Vec<T>,
    /// Length of the whole rows, bytes.
    whole: usize,
    /// Length of the file, bytes.
    all: usize,
    /// Its columns.
    heading: Vec<String>,
}

/// Reads the whole rows of a file, of which the last may be under way; none where there is no file.
fn rows<T: Trial>(path: &Path) -> Result<Rows<T>, StoreError> {
    let bytes = match fs::read(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Vec::new(),
        read => read.map_err(at(path))?,
    };
    let whole = whole_lines(&bytes);
    let trials = if whole == 0 {
        Vec::new()
    } else {
        trial::read(&bytes[..whole]).map_err(|source| StoreError::Trials {
            path: path.to_owned(),
            source,
        })?
    };
    let all = bytes.len();
    let heading = trial::heading(&bytes[..whole]);
    Ok(Rows {
        trials,
        whole,
        all,
        heading,
    })
}

/// Rows in a file.
#[derive(Debug)]
struct Table<T> {
    path: PathBuf,
    trials: Vec<T>,
    /// Length of the whole rows, bytes.
    length: u64,
}

impl<T: Trial> Table<T> {
    /// Reads the rows, and takes away one that was cut off. Rows of an earlier version get the columns of this one.
    fn open(path: PathBuf) -> Result<Self, StoreError> {
        let Rows {
            trials,
            whole,
            all,
            heading,
        } = rows::<T>(&path)?;
        let mut length = whole as u64;
        if whole > 0 && heading != T::COLUMNS {
            if let Some(column) = heading.iter().find(|column| !T::COLUMNS.contains(&column.as_str())) {
                let column = column.clone();
                return Err(StoreError::Column { path, column });
            }
            replace(&path, &path, |file| {
                trial::write(&trials, &*file).map_err(io::Error::other)?;
                length = file.metadata()?.len();
                Ok(())
            })?;
        } else if whole < all {
            let file = File::options().write(true).open(&path).map_err(at(&path))?;
            file.set_len(length).and_then(|()| file.sync_all()).map_err(at(&path))?;
        }
        Ok(Self { path, trials, length })
    }

    /// Adds a row; it is on the disk when this returns.
    fn append(&mut self, trial: T) -> Result<(), StoreError> {
        let line = trial::line(&trial, self.length == 0).map_err(|source| StoreError::Trials {
            path: self.path.clone(),
            source,
        })?;
        append(&self.path, &line, self.length)?;
        self.length += line.len() as u64;
        self.trials.push(trial);
        Ok(())
    }
}

/// The files of a subject.
#[derive(Debug)]
pub struct SubjectFiles<T> {
    folder: PathBuf,
    recordings: PathBuf,
    practice: Table<T>,
    data: Table<T>,
    voided: Table<VoidedTrial>,
}

impl<T: Trial> SubjectFiles<T> {
    pub(super) fn open(folder: &Path, subject: &Subject, task: Task) -> Result<Self, StoreError> {
        let session = session(folder, subject);
        create_folder(&session)?;
        let files = Self {
            folder: folder.to_owned(),
            recordings: session.join("recordings"),
            practice: Table::open(rows_file(folder, subject, task, true))?,
            data: Table::open(rows_file(folder, subject, task, false))?,
            voided: Table::open(table(folder, subject, task, "voided"))?,
        };
        files.set_unscored_aside()?;
        Ok(files)
    }

    /// Rows of practice.
    #[must_use]
    pub fn practice(&self) -> &[T] {
        &self.practice.trials
    }

    /// Rows of trials.
    #[must_use]
    pub fn trials(&self) -> &[T] {
        &self.data.trials
    }

    fn table(&mut self, is_practice: bool) -> &mut Table<T> {
        if is_practice {
            &mut self.practice
        } else {
            &mut self.data
        }
    }

    /// The recording of a trial by its number among the rows, from 1.
    fn recording(&self, is_practice: bool, number: usize) -> PathBuf {
        let kind = if is_practice { "practice" } else { "trial" };
        self.recordings.join(format!("{kind}-{number:04}.mcap"))
    }

    /// Adds a trial; it is on the disk when this returns.
    ///
    /// # Errors
    /// It cannot be written; then it is not there.
    pub fn append(&mut self, trial: T, is_practice: bool) -> Result<(), StoreError> {
        self.table(is_practice).append(trial)
    }

    /// Attempts at the trial whose row comes next that were voided.
    #[must_use]
    pub fn voided(&self, is_practice: bool) -> u32 {
        let next = self.rows(is_practice).len() + 1;
        let voided = self.voided.trials.iter();
        let of_next = voided.filter(|voided| voided.practice == is_practice && voided.row as usize == next);
        u32::try_from(of_next.count()).unwrap_or(u32::MAX)
    }

    /// Adds an attempt that does not count; it is on the disk when this returns.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn append_voided(&mut self, voided: VoidedTrial) -> Result<(), StoreError> {
        self.voided.append(voided)
    }

    fn rows(&self, is_practice: bool) -> &[T] {
        if is_practice { self.practice() } else { self.trials() }
    }

    /// Writes the ticks of the trial whose row comes next; returns the file's path from the study's folder.
    ///
    /// # Errors
    /// It cannot be written.
    pub fn record(
        &mut self,
        is_practice: bool,
        metadata: &Metadata,
        rows: Vec<Sample>,
        marks: Vec<Mark>,
    ) -> Result<String, StoreError> {
        create_folder(&self.recordings)?;
        let number = self.table(is_practice).trials.len() + 1;
        let path = self.recording(is_practice, number);
        // Under another name until it is whole.
        let part = path.with_extension("part.mcap");
        let mut recorder = haptic_recording::create(&part, metadata, false).map_err(|error| match error {
            CreateError::File { source, .. } => at(&part)(source),
            other => at(&part)(io::Error::other(other)),
        })?;
        marks.into_iter().for_each(|mark| recorder.mark(mark));
        let (seq, dropped) = (0, 0);
        let written = recorder.event(&Event::Samples(SamplesEvent { seq, dropped, rows }));
        written.and_then(|()| recorder.finish()).map_err(at(&part))?;
        fs::rename(&part, &path).map_err(at(&path))?;
        sync_folder(&self.recordings)?;
        let from_folder = path.strip_prefix(&self.folder).unwrap_or(&path);
        Ok(from_folder.to_string_lossy().into_owned())
    }

    /// Gives recordings without a row another name: the trial is done again.
    fn set_unscored_aside(&self) -> Result<(), StoreError> {
        for (is_practice, done) in [(true, self.practice.trials.len()), (false, self.data.trials.len())] {
            let path = self.recording(is_practice, done + 1);
            for path in [path.with_extension("part.mcap"), path] {
                if path.exists() {
                    let free = (1..)
                        .map(|number| path.with_extension(format!("unscored-{number}.mcap")))
                        .find(|other| !other.exists());
                    let free = free.unwrap_or_else(|| path.clone());
                    fs::rename(&path, &free).map_err(at(&path))?;
                    sync_folder(&self.recordings)?;
                }
            }
        }
        Ok(())
    }
}
