//! The control plane: the socket, its clients, and one file for each operation.

pub(crate) mod admission;
mod advise;
mod change;
pub(crate) mod commission;
mod devices;
mod facts;
mod hand;
pub(crate) mod history;
mod home;
mod identify;
mod journal;
mod judge;
pub(crate) mod lease;
mod library;
mod link_log;
mod peer;
mod places;
mod presence;
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

pub(crate) use facts::Facts;
pub(crate) use hand::PointerHand;
pub(crate) use rig::loop_channel::LoopChannel;
pub(crate) use rig::{RigHandle, exclusive_use, known_rig};
