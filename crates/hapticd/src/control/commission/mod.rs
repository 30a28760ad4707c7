//! `commission.*`: one client has the rig to itself and moves the handle by small pulses, to find
//! out which way its motor pulls.
//!
//! A pulse goes the way of every scene: compiled here, left in the mailbox, rendered by the loop
//! within all its limits, between an engagement and a release of its own. The motion of the handle
//! is read from the records of the ticks. Whatever ends a commissioning ends its pulse at once, and
//! the scene comes back as it was.

mod operations;
mod pulse;
pub(in crate::control) mod record;
pub(in crate::control) mod state;
mod watch;

pub(in crate::control) use operations::{begin, closed, end, pulse, status, store};
pub(in crate::control) use watch::{by, keep_out};
