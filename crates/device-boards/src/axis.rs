//! One motor and its shaft, as the conversation with any controller keeps them.

use crate::feedback::Feedback;
use device_io::link::LinkCounters;
use device_io::{DeviceError, Motor as ReportedMotor};

/// Shortest time between two sets of commands to a controller that does not obey, ns.
const TELL_AGAIN_NS: u64 = 10_000_000;

/// State of the motor, as far as both sides know.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Motor {
    /// To be off since a time of ours, ns; the newest command for that was sent at `told_at_ns`.
    Off {
        since_ns: u64,
        told_at_ns: Option<u64>,
        /// The controller has answered a later question: it is.
        confirmed: bool,
    },
    /// Told to be on since a time of ours, ns; the newest command for that was sent at
    /// `told_at_ns`.
    Arming { since_ns: u64, told_at_ns: Option<u64> },
    /// On.
    On,
    /// Off though force is wanted. This lasts until no force is wanted.
    Failed(DeviceError),
}

/// Whether it is time to send a command once more, after it was sent at `told_at_ns`.
pub(crate) fn is_due(told_at_ns: Option<u64>, now_ns: u64) -> bool {
    told_at_ns.is_none_or(|at_ns| now_ns.saturating_sub(at_ns) >= TELL_AGAIN_NS)
}

/// One motor, and the positions of its shaft.
#[derive(Debug)]
pub(crate) struct Axis {
    pub(crate) feedback: Feedback,
    pub(crate) motor: Motor,
    /// No question about the motor is due before this time, ns.
    pub(crate) ask_after_ns: u64,
}

impl Axis {
    /// An axis whose motor has got no command yet.
    pub(crate) fn new(feedback: Feedback) -> Self {
        Self {
            feedback,
            motor: Motor::Off {
                since_ns: 0,
                told_at_ns: None,
                confirmed: false,
            },
            ask_after_ns: 0,
        }
    }

    /// The motor, as far as the controller has said: one that is not known to be off counts as enabled.
    pub(crate) fn reported(&self) -> ReportedMotor {
        match self.motor {
            Motor::Off { confirmed: true, .. } => ReportedMotor::Off,
            _ => ReportedMotor::Enabled,
        }
    }

    /// The counters of the link.
    pub(crate) fn counters(&self) -> &LinkCounters {
        self.feedback.counters()
    }
}
