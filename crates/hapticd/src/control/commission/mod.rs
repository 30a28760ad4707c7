//! `commission.*`: one client has the rig to itself and moves the handle by small pulses, to find
//! the direction of its motor.
//!
//! A pulse is handled like a scene: compiled here, posted to the mailbox, and rendered by the loop
//! within all its limits, between an engagement and a release of its own. The motion of the handle
//! is read from the records of the ticks. Whatever ends a commissioning ends its pulse at once, and
//! restores the scene.

mod operations;
mod pulse;
pub(in crate::control) mod record;
pub(in crate::control) mod state;
mod watch;

pub(in crate::control) use operations::{begin, closed, end, pulse, status, store};
pub(in crate::control) use watch::{by, keep_out};
