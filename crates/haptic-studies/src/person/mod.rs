//! A person's session at a study on the disk, for a program with a screen.
//!
//! ```text
//! events, clicks, answers --> Session --finished trial--> keep --fsync--> study's folder
//! ```
//!
//! [`keep`](PersonSession::keep) alone waits for the disk: call it on a thread that may wait, after what the subject
//! shall see at once is shown. Clicks, answers and ticks carry their ticks, so that a wait changes no time.

use super::session::{News, Session, TrialRow};
use super::store::{Keeper, RigDescription, StoreError, Study};
use super::trial::{Operator, VoidedTrial};
use haptic_ipc::Event;
use haptic_recording::StateMarks;
use std::ops::{Deref, DerefMut};
use std::path::Path;

/// Why a person's session cannot continue.
#[derive(Debug, thiserror::Error)]
pub enum PersonError {
    /// The study cannot be read or written.
    #[error(transparent)]
    Store(#[from] StoreError),
    /// Simulated operators do this study.
    #[error("simulated operators do this study, and no people: continue with `haptic-ctl study resume`")]
    Simulated,
}

/// What happened in a person's session.
#[derive(Clone, Debug, PartialEq)]
pub enum SessionEvent {
    /// A trial is on the disk, with this row.
    Kept(TrialRow),
    /// A trial under way is void, and done again.
    Voided(VoidedTrial),
    /// All trials of this subject are done, and the study's trials are in one file.
    Finished,
}

/// A [`Session`] of a person, and the study that keeps it. It holds the study's lock while it is there, so that no other
/// program continues the study.
#[derive(Debug)]
pub struct PersonSession {
    session: Session,
    study: Study,
    keeper: Keeper,
    state_marks: StateMarks,
    /// The study's trials are in one file, since all of this subject's are done.
    is_collected: bool,
}

impl Deref for PersonSession {
    type Target = Session;

    fn deref(&self) -> &Session {
        &self.session
    }
}

impl DerefMut for PersonSession {
    fn deref_mut(&mut self) -> &mut Session {
        &mut self.session
    }
}

impl PersonSession {
    /// Opens a study to continue with a subject at the trial where the subject stopped, be that days ago.
    ///
    /// # Errors
    /// It is not a study for people, another program has it open, there is no such subject, or its rows are not those
    /// of the plan.
    pub fn open(folder: &Path, code: &str, rig: RigDescription) -> Result<Self, PersonError> {
        let study = Study::open(folder)?;
        if study.about().operator == Operator::Simulated {
            return Err(PersonError::Simulated);
        }
        let subject = study.subject_of(code)?;
        let (keeper, session) = Keeper::open(&study, &subject, rig)?;
        Ok(Self {
            session,
            study,
            keeper,
            state_marks: StateMarks::default(),
            is_collected: false,
        })
    }

    /// Takes an event of the subscription to the topics `state` and `samples`, at the loop's whole rate.
    pub fn event(&mut self, event: &Event) {
        match event {
            Event::State(state) => {
                for mark in self.state_marks.of(state) {
                    self.session.mark(mark);
                }
            }
            Event::Servo(event) => self.session.mark((**event).clone().into()),
            Event::Samples(samples) => samples.rows.iter().for_each(|row| self.session.row(row)),
            _ => {}
        }
    }

    /// As of [`Session::new_link`]; the daemon reports its state anew.
    pub fn new_link(&mut self) {
        self.state_marks = StateMarks::default();
        self.session.new_link();
    }

    /// Has what became final on the disk, and adds what happened, also before an error. Call it after each batch of ticks, also once more at
    /// the end: the program may have been killed after the last row.
    ///
    /// # Errors
    /// A row cannot be written. The session is at its end: drop it; one that is opened again continues at that trial.
    pub fn keep(&mut self, happened: &mut Vec<SessionEvent>) -> Result<(), StoreError> {
        while let Some(news) = self.session.take_news() {
            if let News::Voided(voided) = &news {
                happened.push(SessionEvent::Voided(voided.clone()));
            }
            happened.extend(self.keeper.keep(news)?.map(SessionEvent::Kept));
        }
        if self.session.is_done() && !self.is_collected {
            self.is_collected = true;
            self.study.collect()?;
            happened.push(SessionEvent::Finished);
        }
        Ok(())
    }

    /// Ends it: what became final is on the disk, and another program may continue the study, when this returns.
    ///
    /// # Errors
    /// A row cannot be written.
    pub fn close(mut self) -> Result<(), StoreError> {
        self.session.close_reason();
        self.keep(&mut Vec::new())
    }
}

#[cfg(test)]
mod tests;
