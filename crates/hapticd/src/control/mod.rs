//! The control plane: the socket, its clients, and one file for each operation.

pub(crate) mod admission;
mod advise;
mod answer_timer;
mod change;
pub(crate) mod commission;
pub(crate) mod compile;
mod connected_device;
mod devices;
mod facts;
pub(crate) mod history;
mod identify;
mod journal;
mod judge;
pub(crate) mod lease;
mod leases;
mod library;
mod link_log;
mod peer;
mod places;
mod presence;
mod reads;
pub(crate) mod reload;
mod rig;
mod rig_files;
mod schedule;
pub(crate) mod server;
mod session;
pub(crate) mod socket;
mod status;
mod subscribe;
mod trial;
pub(crate) mod whole_file;
pub(crate) mod worker_pool;

pub(crate) use facts::Facts;
pub(crate) use rig::{RigHandle, exclusive_use, rig_friction};
