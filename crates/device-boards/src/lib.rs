//! Motor controllers of other makers: ODrive.
//!
//! They speak the text protocol that their maker publishes, not the link protocol, so something is
//! lost against our own firmware:
//!
//! - No controller stamps or numbers its samples. A sample's time is the time of its question, and
//!   the answers are counted here.
//! - The answer to a tick's question is read in the next tick, or later: the position is a tick
//!   old, and the force is later by as much.
//! - The number of questions without an answer is limited, so that a slow line fills no buffer with
//!   old forces.
//!
//! None of this has been tried on a real board; the fakes in [`fake`] speak the published
//! protocols. docs/how-to/firmware.md says how to set a board up.
//!
//! A board is a folder. [`Address`] lists the boards.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

mod address;
pub mod fake;
mod odrive;

pub use address::{Address, AddressError};
pub use odrive::ODriveOptions;
