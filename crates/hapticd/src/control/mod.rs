//! The control plane: the socket, its clients, and one file for each operation.

pub(crate) mod admission;
mod advise;
mod answer_timer;
mod change;
pub(crate) mod commission;
pub(crate) mod compile;
mod connected_device;
mod describe;
mod devices;
mod diff;
mod drive;
mod facts;
mod get;
pub(crate) mod history;
mod journal;
pub(crate) mod lease;
mod leases;
mod library;
mod log;
mod peer;
mod presence;
mod requester;
mod rig;
mod rig_files;
pub(crate) mod rig_friction;
pub(crate) mod server;
mod session;
pub(crate) mod socket;
mod status;
mod subscribe;
mod timing;
mod whole_file;
mod worker_pool;

pub(crate) use facts::{EngageRules, Facts};
pub(crate) use rig::RigHandle;
