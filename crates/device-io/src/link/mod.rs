//! Links to real rigs: who finds and greets a device, and who talks to it.
//!
//! ```text
//!  keeper thread                         real-time thread
//!  looks, opens, greets ── connection ──► LinkDevice: reads and writes, never waits
//!        ▲                                     │
//!        └──────────── connection, when ───────┘
//!                      it has failed
//! ```
//!
//! The keeper does everything that waits, allocates or asks the system for a file, at an ordinary
//! priority. A connection goes to the real-time thread and back through two rings of one producer
//! and one consumer each (rtrb), wait-free on both ends.
//!
//! The keeper takes its [`Connector`] from its caller. This crate has one for serial lines and one
//! for HID, both in the words of [`protocol`](crate::protocol). A crate with other boards writes
//! its own: [`SerialLine`] opens the serial line, [`LinkCounters`] counts, [`RigIdentity`] names the rig,
//! and a [`Connection`] reads and writes.

mod connector;
mod device_clock;
mod direct_rig;
mod health;
mod hid;
pub(crate) mod hid_node;
#[cfg(test)]
mod hid_tests;
mod identity;
mod keeper;
mod line;
mod link_device;
mod mailbox;
mod nodes;
mod planar_link;
#[cfg(test)]
mod planar_tests;
#[cfg(test)]
mod quality_tests;
#[cfg(test)]
mod queue_tests;
pub(crate) mod remedy;
mod reports;
mod sent_messages;
pub(crate) mod serial;
mod session;
mod wire;
mod writer;

pub use connector::{ConnectError, Connection, Connector, DeviceInfo, GreetedDevice, LoopTiming};
pub use direct_rig::DirectRig;
pub use health::{AskGuard, Delivery, LinkCounters, LinkError, UNKNOWN_DRIFT, add};
pub(crate) use hid::HidConnector;
pub use hid_node::HidId;
pub use identity::RigIdentity;
pub use keeper::{Keeper, LinkMonitor, LinkState, RunningKeeper};
pub use line::{MAX_AT_ONCE, SendOutcome, SerialLine};
pub use link_device::LinkDevice;
pub use nodes::folder_of;
pub use planar_link::{Homing, PlanarLink};
pub use serial::SerialConnector;
