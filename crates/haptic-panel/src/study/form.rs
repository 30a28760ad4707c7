//! The experimenter's side of a study: what is typed, and what the study's thread has reported.

use crate::notice::Notice;
use crate::study::{StudyCommand, StudyNews, StudyPlan, StudyRow, StudyState, SubjectScreen};
use haptic_studies::plan::Task;
use haptic_studies::subject::{check_codes, numbered_codes};
use std::path::PathBuf;
use std::sync::Arc;

const MAX_SUBJECTS: u32 = 999;

/// What is typed to make or open a study.
#[derive(Debug)]
pub(crate) struct StudyForm {
    pub(crate) folder: String,
    /// File of a plan; the built-in plan of the page where it is empty.
    pub(crate) plan: String,
    pub(crate) subjects: String,
    pub(crate) seed: String,
}

impl Default for StudyForm {
    fn default() -> Self {
        Self {
            folder: String::new(),
            plan: String::new(),
            subjects: "1".to_owned(),
            seed: "1".to_owned(),
        }
    }
}

impl StudyForm {
    /// The command that makes a study of a task.
    ///
    /// # Errors
    /// A field that cannot be used, and why.
    pub(crate) fn create(&self, task: Task) -> Result<StudyCommand, String> {
        let plan = self.plan.trim();
        Ok(StudyCommand::Create {
            folder: self.folder()?,
            plan: if plan.is_empty() {
                StudyPlan::BuiltIn(task)
            } else {
                StudyPlan::File(PathBuf::from(plan))
            },
            subjects: self.subjects()?,
            seed: self
                .seed
                .trim()
                .parse()
                .map_err(|_| format!("Seed: `{}` is not a whole number", self.seed.trim()))?,
        })
    }

    /// The command that opens a study.
    ///
    /// # Errors
    /// There is no folder.
    pub(crate) fn open(&self) -> Result<StudyCommand, String> {
        Ok(StudyCommand::Open { folder: self.folder()? })
    }

    fn folder(&self) -> Result<PathBuf, String> {
        let folder = self.folder.trim();
        if folder.is_empty() {
            return Err("Name the study's folder".to_owned());
        }
        Ok(PathBuf::from(folder))
    }

    /// A number of subjects, or their codes with commas between them.
    fn subjects(&self) -> Result<Vec<String>, String> {
        let text = self.subjects.trim();
        let codes = match text.parse::<u32>() {
            Ok(number) => numbered_codes(number.min(MAX_SUBJECTS + 1)),
            Err(_) => text.split(',').map(|code| code.trim().to_owned()).collect(),
        };
        check_codes(&codes).map_err(|error| format!("Subjects: {error}"))?;
        Ok(codes)
    }
}

/// The experimenter's side of a study.
#[derive(Debug, Default)]
pub(crate) struct StudyView {
    pub(crate) form: StudyForm,
    /// A study is being made or opened.
    pub(super) is_asked: bool,
    state: Option<StudyState>,
    /// The trials of the chosen subject.
    pub(super) rows: Vec<StudyRow>,
    /// A note, as it is typed.
    pub(crate) note: String,
    pub(crate) report: Option<Notice>,
    /// What the subject's window shows.
    pub(crate) screen: Arc<SubjectScreen>,
}

impl StudyView {
    /// What the study's thread has reported last.
    pub(crate) fn state(&self) -> Option<&StudyState> {
        self.state.as_ref()
    }

    pub(crate) fn note_sent(&mut self, command: &StudyCommand) {
        if matches!(command, StudyCommand::Create { .. } | StudyCommand::Open { .. }) {
            (self.is_asked, self.report) = (true, None);
        }
    }

    /// Takes news of the study's thread. Returns the task of a study that was just opened.
    pub(crate) fn take(&mut self, news: StudyNews) -> Option<Task> {
        let was_open = self.state.is_some();
        match news {
            StudyNews::State(state) => {
                if !was_open {
                    self.form.folder = state.folder.display().to_string();
                }
                (self.state, self.is_asked) = (Some(*state), false);
            }
            StudyNews::Subject(rows) => self.rows = rows,
            StudyNews::Row(row) => self.rows.push(row),
            StudyNews::Noted { text, outcome } => {
                if outcome.is_err() {
                    // It goes back to its field, before what was typed since.
                    self.note = format!("{text} {}", self.note).trim().to_owned();
                }
                self.report = Some(Notice::new(outcome));
            }
            StudyNews::Failed(why) => (self.report, self.is_asked) = (Some(Notice::new(Err(why))), false),
            StudyNews::Closed => {
                (self.state, self.is_asked) = (None, false);
                self.rows.clear();
            }
        }
        self.state.as_ref().map(|state| state.task).filter(|_| !was_open)
    }
}
