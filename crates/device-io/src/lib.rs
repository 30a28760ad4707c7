//! The link between hapticd and a rig.
//!
//! A [`Device`] measures the position of the handle and pulls it with a force; the real-time loop
//! reads it, computes and writes it in the same tick. [`fake::FakeRig`] is a device without
//! hardware: a carriage with mass and friction, an encoder, and a hand.
//!
//! Positive position, velocity and force point the same way; the force is the one that the device
//! applies to the hand.
//!
//! [`link`] talks to real rigs in the words of [`protocol`], over a serial line or HID;
//! [`discovery`] finds them. Both are the feature `links`, on by default.

#[cfg(feature = "links")]
pub mod address;
mod device;
#[cfg(feature = "links")]
pub mod discovery;
pub mod fake;
pub mod kinematics;
#[cfg(feature = "links")]
pub mod link;
pub mod protocol;
pub mod usb_boards;

#[cfg(feature = "links")]
pub use address::Address;
pub use device::{Device, DeviceBounds, DeviceError, Measurement, Motor, Written, now_ns};
