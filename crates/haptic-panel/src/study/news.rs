//! What the experimenter asks of a study, and what the thread that runs it reports.

use haptic_studies::plan::Task;
use std::path::PathBuf;

/// Where a plan comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StudyPlan {
    /// The one that every program has for a task.
    BuiltIn(Task),
    /// A file of TOML.
    File(PathBuf),
}

/// What the experimenter asks.
#[derive(Clone, Debug, PartialEq)]
pub enum StudyCommand {
    /// Make a study for people, and open it.
    Create {
        /// The folder, which is not there yet, or empty.
        folder: PathBuf,
        /// The plan.
        plan: StudyPlan,
        /// Codes of the subjects.
        subjects: Vec<String>,
        /// Seed of every random order.
        seed: u64,
    },
    /// Open a study to continue it.
    Open {
        /// Its folder.
        folder: PathBuf,
    },
    /// Close it. What is done is on the disk.
    Close,
    /// Turn to a subject, by its place in the list.
    Choose(usize),
    /// Begin, or continue after a pause, a fault or a stop: the experimenter's consent.
    GoOn,
    /// Break the trial under way off; it is done again.
    Pause,
    /// Take a note.
    Note(String),
}

/// A subject of the list.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SubjectState {
    /// Its code.
    pub code: String,
    /// Trials done, and trials in all, practice included, of the one that is chosen; a staircase may have no such
    /// number.
    pub progress: Option<(usize, Option<usize>)>,
    /// Time that the trials left will take, in words, once some are done.
    pub time_left: Option<String>,
    /// Nothing is left to be done.
    pub is_finished: bool,
}

/// Where a study is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Stage {
    /// It waits for the experimenter, for this reason.
    Held {
        /// The reason.
        why: String,
        /// Whether something went wrong.
        is_trouble: bool,
    },
    /// It waits for the rig.
    Waiting {
        /// What it waits for.
        what: String,
    },
    /// It waits for the subject, or the subject is at work.
    Running {
        /// What the subject does.
        what: String,
    },
    /// The subject has done everything.
    Finished,
}

/// What the experimenter sees of a study.
#[derive(Clone, Debug, PartialEq)]
pub struct StudyState {
    /// Its folder.
    pub folder: PathBuf,
    /// The task.
    pub task: Task,
    /// What people call the plan.
    pub plan: String,
    /// The subjects.
    pub subjects: Vec<SubjectState>,
    /// The one that is chosen, by its place.
    pub subject: usize,
    /// Where the study is.
    pub stage: Stage,
    /// What is done now or next, as names and values. Not for the subject.
    pub now: Vec<(&'static str, String)>,
    /// Edges of the active target on the axis of the handle, m.
    pub target_m: Option<[f64; 2]>,
    /// Names of the columns of a row.
    pub columns: &'static [&'static str],
}

impl StudyState {
    /// Whether the chosen subject has done a trial, in whatever session.
    pub(super) fn has_begun(&self) -> bool {
        let subject = self.subjects.get(self.subject);
        let progress = subject.and_then(|subject| subject.progress);
        progress.is_some_and(|(done, _)| done > 0)
    }
}

/// A row of the table of trials.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StudyRow {
    /// Its cells, by the columns of [`StudyState`].
    pub cells: Vec<String>,
    /// Why it does not count, if so.
    pub void: Option<String>,
}

/// News of a study.
#[derive(Clone, Debug, PartialEq)]
pub enum StudyNews {
    /// Another subject was turned to: these are the rows so far.
    Subject(Vec<StudyRow>),
    /// What the experimenter sees has changed.
    State(Box<StudyState>),
    /// A trial is on the disk.
    Row(StudyRow),
    /// What became of a note.
    Noted {
        /// The note.
        text: String,
        /// Where it is on the disk, or why not.
        outcome: Result<String, String>,
    },
    /// A study cannot be made, opened or gone on with.
    Failed(String),
    /// It is closed.
    Closed,
}
