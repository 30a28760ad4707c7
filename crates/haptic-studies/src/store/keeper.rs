//! Keeps what becomes final in a subject's session: each trial with its recording.

use super::super::session::{FinishedTrial, News, Row, Session, Settings, Task, Ticks};
use super::super::subject::Subject;
use super::super::trial::{FittsTrial, Operator, PerceptionTrial, Trial};
use super::Study;
use super::error::StoreError;
use super::subject_files::SubjectFiles;
use haptic_ipc::ServoSetup;
use haptic_recording::Metadata;
use serde_json::Value;
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

/// The files of a subject, by the study's task.
#[derive(Debug)]
enum Files {
    Fitts(SubjectFiles<FittsTrial>),
    Perception(SubjectFiles<PerceptionTrial>),
}

/// Keeps what becomes final in a subject's session.
#[derive(Debug)]
pub struct Keeper {
    files: Files,
    rig: RigDescription,
    operator: Operator,
    has_recordings: bool,
    recorded_by: String,
}

impl Keeper {
    /// Opens a subject's files, and the session that continues where they end.
    ///
    /// # Errors
    /// They cannot be read, or are not those of the plan.
    pub fn open(study: &Study, subject: &Subject, rig: RigDescription) -> Result<(Self, Session), StoreError> {
        let about = study.about();
        let (seed, operator, period_s) = (about.seed, about.operator, rig.loop_rate_hz.recip());
        let mut task = Task::new(study.plan(), seed, subject, operator, period_s);
        let files = match &mut task {
            Task::Fitts(task) => {
                let files = study.subject::<FittsTrial>(subject)?;
                task.resume(files.practice(), files.trials())?;
                Files::Fitts(files)
            }
            Task::Perception(task) => {
                let files = study.subject::<PerceptionTrial>(subject)?;
                task.resume(files.practice(), files.trials())?;
                Files::Perception(files)
            }
        };
        let voided = match &files {
            Files::Fitts(files) => files.voided(task.is_practice()),
            Files::Perception(files) => files.voided(task.is_practice()),
        };
        let settings = Settings {
            operator,
            period_s,
            click_buttons: rig.click_buttons,
            servo: rig.servo.clone(),
            voided,
        };
        let keeper = Self {
            files,
            rig,
            operator,
            has_recordings: about.recordings,
            recorded_by: about.program.clone(),
        };
        Ok((keeper, Session::new(task, subject, settings)))
    }

    /// The rows of the targeting task, of practice or of the others; none of the perception tests.
    #[must_use]
    pub fn fitts_rows(&self, is_practice: bool) -> &[FittsTrial] {
        match &self.files {
            Files::Fitts(files) if is_practice => files.practice(),
            Files::Fitts(files) => files.trials(),
            Files::Perception(_) => &[],
        }
    }

    /// Keeps what became final: it is on the disk when this returns. Returns the row of a trial as it stands there.
    ///
    /// # Errors
    /// It cannot be written. The session must not continue then; another one continues at this trial.
    pub fn keep(&mut self, news: News) -> Result<Option<Row>, StoreError> {
        match news {
            News::Voided(voided) => {
                match &mut self.files {
                    Files::Fitts(files) => files.append_voided(voided)?,
                    Files::Perception(files) => files.append_voided(voided)?,
                }
                Ok(None)
            }
            News::Finished(finished) => self.keep_trial(*finished).map(Some),
        }
    }

    fn keep_trial(&mut self, finished: FinishedTrial) -> Result<Row, StoreError> {
        let FinishedTrial {
            mut row,
            is_practice,
            ticks,
        } = finished;
        let ticks = ticks.filter(|_| self.has_recordings);
        let recording = ticks.map(|ticks| (self.metadata(&ticks), ticks));
        match (&mut row, &mut self.files) {
            (Row::Fitts(trial), Files::Fitts(files)) => {
                trial.recording = record(files, is_practice, recording)?;
                files.append((**trial).clone(), is_practice)?;
            }
            (Row::Perception(trial), Files::Perception(files)) => {
                trial.recording = record(files, is_practice, recording)?;
                files.append((**trial).clone(), is_practice)?;
            }
            (Row::Fitts(_), Files::Perception(_)) | (Row::Perception(_), Files::Fitts(_)) => {
                return Err(StoreError::OtherTask);
            }
        }
        Ok(row)
    }

    #[expect(clippy::cast_precision_loss, reason = "minutes of ticks")]
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

/// Writes a trial's recording, where it has one; returns the file's path from the study's folder.
fn record<T: Trial>(
    files: &mut SubjectFiles<T>,
    is_practice: bool,
    recording: Option<(Metadata, Ticks)>,
) -> Result<Option<String>, StoreError> {
    let Some((metadata, ticks)) = recording else {
        return Ok(None);
    };
    files.record(is_practice, &metadata, ticks.rows, ticks.marks).map(Some)
}
