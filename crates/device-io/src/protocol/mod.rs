//! The link protocol, version 1, between a rig's firmware and hapticd. `docs/device-protocol.md`
//! specifies it.
//!
//! [`message`] has the values, [`view`] their bytes, and [`frame`] cuts a byte stream into
//! messages. A HID report carries the bytes unchanged.

pub mod frame;
pub mod message;
pub mod view;

/// The version that this crate speaks.
pub const VERSION: u8 = 1;

/// Time without a valid message after which a device falls silent until it is greeted again, ns.
pub(crate) const DEVICE_SILENCE_NS: u64 = 1_000_000_000;
