//! Fakes of the boards: each is the carriage of the fake rig behind a pulley, with a controller
//! that speaks its maker's published protocol.

mod odrive;

pub use odrive::{ODriveBoard, ODriveProperties};
