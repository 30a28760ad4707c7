//! The tidy rows of both studies, one a trial, and their CSV.
//!
//! A file may come from another program: columns that are not required may be missing, columns that are not
//! known are passed over, and the order is free. Lengths in m, times in s, forces in N.

mod fitts;
mod perception;
mod row;
mod table;

pub use fitts::FittsTrial;
pub use perception::{Case, Method, PerceptionTrial};
pub use row::{Column, Operator, OutOfRange, Trial, VoidedTrial};
pub use table::{TrialError, line, read, write};
pub(crate) use table::{cells, heading};

#[cfg(test)]
mod tests;
