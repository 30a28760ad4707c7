//! The state of an exclusive use.

use crate::control::connected_device::ConnectedDevice;
use crate::control::rig::both_motors::DrivenAlone;
use haptic_core::scene::Coupling;
use haptic_ipc::{ExcitationReport, Peer, PulseReport};

/// Largest share of the rig's force limit that a motion may have.
pub(in crate::control) const MAX_SHARE: f64 = 0.5;

/// A client's use of the rig; it is kept until the next one begins.
#[derive(Debug)]
pub(in crate::control) struct ExclusiveUse {
    pub(in crate::control) session: u64,
    pub(in crate::control) by: Peer,
    pub(in crate::control) device: ConnectedDevice,
    /// The count of stops when it began: a further stop ends it.
    pub(in crate::control) stops: u64,
    pub(in crate::control) moving: bool,
    pub(in crate::control) ended: Option<String>,
    pub(in crate::control) work: Work,
}

/// What a client uses the rig for.
#[derive(Debug)]
pub(in crate::control) enum Work {
    Commissioning(Commissioning),
    Identification(Identification),
}

/// What a commissioning has found.
#[derive(Debug, Default)]
pub(in crate::control) struct Commissioning {
    /// Of a rig of two axes the motor, counted from 0.
    pub(in crate::control) motor: Option<usize>,
    /// What the newest confirmed pulse has shown of such a motor.
    pub(in crate::control) alone: Option<DrivenAlone>,
    pub(in crate::control) pulses: u64,
    pub(in crate::control) last: Option<PulseReport>,
    /// How many positive and how many negative pulses have moved the handle their way.
    pub(in crate::control) confirmed: [u32; 2],
    pub(in crate::control) path: Option<String>,
    pub(in crate::control) coupling: Option<Coupling>,
}

/// What an identification may do, and what it has done.
#[derive(Debug)]
pub(in crate::control) struct Identification {
    /// Travel of the handle between its ends, m.
    pub(in crate::control) range_m: f64,
    /// Place of the handle when it began, m.
    pub(in crate::control) middle_m: f64,
    pub(in crate::control) friction_n: Option<f64>,
    pub(in crate::control) excitations: u64,
    pub(in crate::control) last: Option<ExcitationReport>,
    pub(in crate::control) path: Option<String>,
}

impl Work {
    /// What its client does to the rig, as in "cannot commission".
    pub(in crate::control) fn verb(&self) -> &'static str {
        match self {
            Self::Commissioning(_) => "commission",
            Self::Identification(_) => "identify",
        }
    }

    /// The same as in "is commissioning".
    pub(in crate::control) fn participle(&self) -> &'static str {
        match self {
            Self::Commissioning(_) => "commissioning",
            Self::Identification(_) => "identifying",
        }
    }

    /// Its name, as in "the commissioning has ended".
    pub(in crate::control) fn name(&self) -> &'static str {
        match self {
            Self::Commissioning(_) => "commissioning",
            Self::Identification(_) => "identification",
        }
    }
}

impl ExclusiveUse {
    /// Whether it keeps all other clients out.
    pub(in crate::control) fn is_active(&self) -> bool {
        self.ended.is_none() || self.moving
    }

    pub(in crate::control) fn end(&mut self, why: &str) {
        self.ended.get_or_insert_with(|| why.to_owned());
    }

    /// The commissioning of a client, if this is one.
    pub(in crate::control) fn commissioning_of(&self, session: u64) -> Option<&Commissioning> {
        match &self.work {
            Work::Commissioning(found) if self.session == session => Some(found),
            _ => None,
        }
    }

    /// The identification of a client, if this is one.
    pub(in crate::control) fn identification_of(&self, session: u64) -> Option<&Identification> {
        match &self.work {
            Work::Identification(found) if self.session == session => Some(found),
            _ => None,
        }
    }
}
