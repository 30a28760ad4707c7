//! Conditions on what the daemon reports: `state=engaged and device_position_m>0.01`.
//!
//! A condition is one or more comparisons joined by `and`; it holds when all of them hold at once.
//! A comparison is a field, one of `= != < <= > >=`, and a number or a word; a word with spaces is
//! quoted. Fields are those of a sample, the state of rig and scene, the parameters of the scene by
//! name or symbol, and the counts of the loop.

mod comparison;
mod field;
mod known;

pub(crate) use comparison::Condition;
pub(crate) use field::{contact, fields, words};
pub(crate) use known::Observations;
