//! The state of a commissioning.

use crate::control::connected_device::ConnectedDevice;
use haptic_ipc::{Peer, PulseReport};

/// A commissioning; it is kept until the next one begins.
#[derive(Debug)]
pub(in crate::control) struct Commissioning {
    pub(super) session: u64,
    pub(super) by: Peer,
    pub(super) device: ConnectedDevice,
    /// The count of stops when it began: a further stop ends it.
    pub(super) stops: u64,
    pub(super) pulsing: bool,
    pub(super) ended: Option<String>,
    pub(super) pulses: u64,
    pub(super) last: Option<PulseReport>,
    pub(super) positive_confirmed: bool,
    pub(super) negative_confirmed: bool,
    pub(super) path: Option<String>,
}

impl Commissioning {
    /// Whether it keeps all other clients out.
    pub(super) fn is_active(&self) -> bool {
        self.ended.is_none() || self.pulsing
    }

    pub(super) fn end(&mut self, why: &str) {
        self.ended.get_or_insert_with(|| why.to_owned());
    }
}
