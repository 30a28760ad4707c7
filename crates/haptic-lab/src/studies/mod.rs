//! The studies: the targeting task after Fitts, and the tests of how well friction is perceived.
//!
//! A study is a plan (data), a state machine fed with samples, and rows, one a [trial]. The state machines
//! know no daemon, no file and no screen, so that hits and times go by the daemon's ticks.

pub mod analysis;
pub mod trial;
