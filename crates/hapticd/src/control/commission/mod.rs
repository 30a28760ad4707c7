//! `commission.*`: one client has the rig to itself and moves the handle by small pulses, to find
//! the direction of its motor.

#[cfg(test)]
mod hand_tests;
mod operations;
mod pulse;

pub(in crate::control) use operations::{begin, confirm, end, pulse, status, store};
