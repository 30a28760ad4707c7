//! The control plane: the socket, its clients, and one file for each operation.

mod advise;
mod describe;
mod devices;
mod drive;
mod get;
mod peer;
mod rig;
pub(crate) mod server;
mod session;
mod set;
pub(crate) mod socket;
mod status;
mod subscribe;
mod timing;

pub(crate) use rig::{Facts, RigHandle};
