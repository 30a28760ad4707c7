//! A study with a person: what the subject sees, what the experimenter sees, and the thread that runs it.

mod conductor;
mod latency;
mod link;
mod news;
mod rig_facts;
mod scene_before;
mod session_thread;
mod subject_screen;
mod table;

pub(crate) use link::StudyLink;
pub use news::{Stage, StudyCommand, StudyNews, StudyPlan, StudyRow, StudyState, SubjectState};
pub use subject_screen::SubjectAction;
#[cfg(test)]
pub(crate) use subject_screen::TaskScale;
pub(crate) use subject_screen::{SubjectFrame, SubjectScreen};

/// The subject's window.
pub(crate) fn subject_window_id() -> egui::ViewportId {
    egui::ViewportId::from_hash_of("subject's screen")
}

#[cfg(test)]
mod tests;
