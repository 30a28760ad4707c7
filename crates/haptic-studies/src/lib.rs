//! The studies: the targeting task after Fitts, and the tests of how well friction is perceived.
//!
//! A study is a [plan] (data), a state machine for each subject ([fitts], [perception]) that is fed with ticks, and
//! rows, one a [trial]. The state machines know no daemon, no file and no screen, so that hits and times go by the
//! daemon's ticks. A subject's [session] has what is around the trials: instructions, breaks, scenes, void attempts. A
//! simulated [operator] and a [person] in front of a screen do a study through the same session; [store] keeps it on
//! the disk, and [run] runs one of simulated operators.
#![forbid(unsafe_code)]

pub mod analysis;
pub mod fitts;
pub mod operator;
pub mod order;
pub mod pace;
pub mod perception;
pub mod person;
pub mod plan;
pub mod random;
pub mod run;
pub mod screen;
pub mod session;
#[cfg(test)]
mod small_plans;
pub mod store;
pub mod subject;
pub mod subject_table;
pub mod trial;

pub use subject::StudyMismatch;
