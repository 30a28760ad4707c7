//! One client has the rig to itself and moves the handle by motions of its own: by pulses, with
//! which a rig is commissioned, or along courses, from which it is identified.
//!
//! A motion is handled like a scene: compiled here, sent like one, and rendered by the loop
//! within all its limits, between an engagement and a release of its own. The motion of the handle
//! is read from the records of the ticks. Whatever ends the exclusive use ends its motion at once, and
//! restores the scene.

mod begin;
pub(in crate::control) mod motion;
pub(in crate::control) mod state;
mod watch;

pub(in crate::control) use begin::{begin, begin_motion, closed, end, largest_force_n, resting_device};
pub(in crate::control) use watch::{by, end_if_over, refuse_others};
