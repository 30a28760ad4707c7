//! Keeps what becomes final in a subject's session: each trial with its recording is on the disk when a call returns.

use super::super::plan::Task as Kind;
use super::super::session::{FinishedTrial, News, Session, Settings, Ticks, TrialRow};
use super::super::subject::Subject;
use super::super::trial::{self, FittsTrial, Operator, PerceptionTrial, Trial, VoidedTrial};
use super::disk::{append, at, create_folder, replace, sync_folder, wrong};
use super::error::StoreError;
use super::subject_files::{self, Rows};
use super::{Study, reader};
use haptic_ipc::ServoSetup;
use haptic_recording::{CreateError, Metadata};
use serde_json::Value;
use std::fs::{self, File};
use std::io;
use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

/// The rig of a session.
#[derive(Clone, Debug)]
pub struct RigDescription {
    /// Name and version of the daemon.
    pub server: String,
    /// What the rig is.
    pub device: String,
    /// Rate of the daemon's loop, Hz.
    pub loop_rate_hz: f64,
    /// The servo's settings, where they are known.
    pub servo: Option<ServoSetup>,
    /// The daemon's whole answer to `status`.
    pub configuration: Option<Value>,
    /// The rig's buttons that click, a bit each.
    pub click_buttons: u8,
}

/// A file of rows.
#[derive(Debug)]
struct Table {
    path: PathBuf,
    rows: usize,
    /// Length of the whole rows, bytes.
    length: u64,
}

impl Table {
    /// Reads the rows, and takes away one that was cut off. Rows of an earlier version get the columns of this one.
    fn open<T: Trial>(path: PathBuf) -> Result<(Self, Vec<T>), StoreError> {
        let Rows {
            trials,
            whole,
            all,
            heading,
        } = subject_files::rows::<T>(&path)?;
        let mut length = whole as u64;
        if whole > 0 && !T::names().eq(heading.iter()) {
            if let Some(column) = heading.iter().find(|column| !T::names().any(|name| name == *column)) {
                let why = format!(
                    "the column `{column}` is none of this program's, and would be lost: keep it in another file, or \
                     finish the study with the version that began it"
                );
                return Err(StoreError::of(&path, &why));
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
        let rows = trials.len();
        Ok((Self { path, rows, length }, trials))
    }

    /// Adds a row.
    fn append<T: Trial>(&mut self, trial: &T) -> Result<(), StoreError> {
        let line = trial::line(trial, self.length == 0).map_err(wrong(&self.path))?;
        append(&self.path, &line, self.length)?;
        self.length += line.len() as u64;
        self.rows += 1;
        Ok(())
    }
}

/// The files of a subject, to which each trial is added.
#[derive(Debug)]
pub struct Keeper {
    folder: PathBuf,
    recordings: PathBuf,
    practice: Table,
    data: Table,
    voided: Table,
    rig: RigDescription,
    operator: Operator,
    has_recordings: bool,
    recorded_by: String,
}

impl Keeper {
    /// Opens a subject's files, and the session that continues where they end.
    ///
    /// # Errors
    /// They cannot be read, or repaired where the program was killed, or are not those of the plan.
    pub fn open(study: &Study, subject: &Subject, rig: RigDescription) -> Result<(Self, Session), StoreError> {
        let (folder, about) = (study.folder(), study.about());
        let (operator, period_s) = (about.operator, rig.loop_rate_hz.recip());
        let session = subject_files::session(folder, subject);
        create_folder(&session)?;
        let kind = about.task;
        let open = |is_practice| {
            let path = subject_files::rows_file(folder, subject, kind, is_practice);
            match kind {
                Kind::Fitts => Table::open::<FittsTrial>(path).map(|(table, _)| table),
                Kind::Perception => Table::open::<PerceptionTrial>(path).map(|(table, _)| table),
            }
        };
        let (practice, data) = (open(true)?, open(false)?);
        let task = reader::task(folder, study.plan(), about, subject, period_s)?;
        let voided = subject_files::table(folder, subject, kind, "voided");
        let (voided, attempts) = Table::open::<VoidedTrial>(voided)?;
        let keeper = Self {
            folder: folder.to_owned(),
            recordings: session.join("recordings"),
            practice,
            data,
            voided,
            rig,
            operator,
            has_recordings: about.recordings,
            recorded_by: about.program.clone(),
        };
        keeper.set_unscored_aside()?;
        let is_practice = task.is_practice();
        let next = keeper.rows(is_practice) + 1;
        let is_of_next = |voided: &&VoidedTrial| voided.practice == is_practice && voided.row as usize == next;
        let settings = Settings {
            operator,
            period_s,
            click_buttons: keeper.rig.click_buttons,
            servo: keeper.rig.servo.clone(),
            voided: u32::try_from(attempts.iter().filter(is_of_next).count()).unwrap_or(u32::MAX),
        };
        Ok((keeper, Session::new(task, subject, settings)))
    }

    /// Keeps what became final. Returns the row of a trial as it stands on the disk.
    ///
    /// # Errors
    /// It cannot be written. The session must not continue then; another one continues at this trial.
    pub fn keep(&mut self, news: News) -> Result<Option<TrialRow>, StoreError> {
        let FinishedTrial {
            mut row,
            is_practice,
            ticks,
        } = match news {
            News::Voided(voided) => return self.voided.append(&voided).map(|()| None),
            News::Finished(finished) => *finished,
        };
        let ticks = ticks.filter(|_| self.has_recordings);
        let recording = ticks.map(|ticks| self.record(is_practice, ticks)).transpose()?;
        let table = if is_practice {
            &mut self.practice
        } else {
            &mut self.data
        };
        match &mut row {
            TrialRow::Fitts(trial) => {
                trial.recording = recording;
                table.append(&**trial)?;
            }
            TrialRow::Perception(trial) => {
                trial.recording = recording;
                table.append(&**trial)?;
            }
        }
        Ok(Some(row))
    }

    /// Rows of practice, or of the trials that count.
    fn rows(&self, is_practice: bool) -> usize {
        if is_practice {
            self.practice.rows
        } else {
            self.data.rows
        }
    }

    /// The recording of a trial by its number among the rows, from 1.
    fn recording(&self, is_practice: bool, number: usize) -> PathBuf {
        let kind = if is_practice { "practice" } else { "trial" };
        self.recordings.join(format!("{kind}-{number:04}.mcap"))
    }

    /// Writes the ticks of the trial whose row comes next; returns the file's path from the study's folder.
    fn record(&self, is_practice: bool, ticks: Ticks) -> Result<String, StoreError> {
        create_folder(&self.recordings)?;
        let path = self.recording(is_practice, self.rows(is_practice) + 1);
        // Under another name until it is whole.
        let part = path.with_extension("part.mcap");
        let recorder = haptic_recording::create(&part, &self.metadata(&ticks), false);
        let mut recorder = recorder.map_err(|error| match error {
            CreateError::File { source, .. } => at(&part)(source),
            other => at(&part)(io::Error::other(other)),
        })?;
        ticks.marks.into_iter().for_each(|mark| recorder.mark(mark));
        let written = recorder.rows(&ticks.rows, &[]);
        written.and_then(|()| recorder.finish()).map_err(at(&part))?;
        fs::rename(&part, &path).map_err(at(&path))?;
        sync_folder(&self.recordings)?;
        let from_folder = path.strip_prefix(&self.folder).unwrap_or(&path);
        Ok(from_folder.to_string_lossy().into_owned())
    }

    /// Gives recordings without a row another name: the trial is done again.
    fn set_unscored_aside(&self) -> Result<(), StoreError> {
        for is_practice in [true, false] {
            let whole = self.recording(is_practice, self.rows(is_practice) + 1);
            for path in [whole.with_extension("part.mcap"), whole.clone()] {
                if path.exists() {
                    let free = (1..)
                        .map(|number| whole.with_extension(format!("unscored-{number}.mcap")))
                        .find(|other| !other.exists());
                    let free = free.unwrap_or_else(|| path.clone());
                    fs::rename(&path, &free).map_err(at(&path))?;
                    sync_folder(&self.recordings)?;
                }
            }
        }
        Ok(())
    }

    fn metadata(&self, ticks: &Ticks) -> Metadata {
        let duration_s = ticks.rows.len() as f64 / self.rig.loop_rate_hz;
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        let (started_unix_s, notes) = match self.operator {
            Operator::Human => (now.as_secs_f64() - duration_s, None),
            // Simulated time has no date.
            Operator::Simulated => (0.0, Some("operator: simulated".to_owned())),
        };
        Metadata {
            server: self.rig.server.clone(),
            device: self.rig.device.clone(),
            axes: 1,
            loop_rate_hz: self.rig.loop_rate_hz,
            rate_hz: self.rig.loop_rate_hz,
            recorded_by: Some(self.recorded_by.clone()),
            started_unix_s,
            revision: ticks.revision,
            scene: ticks.scene.clone(),
            servo: ticks.servo.clone(),
            notes,
            configuration: self.rig.configuration.clone(),
        }
    }
}
