//! The link protocol, version 1: what a rig's firmware and hapticd say to each other. `docs/device-protocol.md` specifies it.
//!
//! [`message`] holds the values, [`view`] the bytes that they are on the link, [`frame`] how a byte stream is cut into them. A HID report carries the
//! bytes as they are.

pub mod frame;
pub mod message;
pub mod view;

/// The version that this crate speaks.
pub const VERSION: u8 = 1;
