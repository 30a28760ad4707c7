//! The host's side of the link protocol after the device's hello: the samples that count, the
//! position of the handle, the state of the motor, and the messages to send. It knows nothing of
//! serial lines and reports, and waits for nothing.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

use super::connector::LoopTiming;
use super::device_clock::DeviceClock;
use super::health::{LinkCounters, LinkError, UNKNOWN_DRIFT, add};
use super::sent_messages::SentMessages;
use crate::device::{DeviceError, Measurement, Motor as ReportedMotor};
use crate::protocol::frame::FrameError;
use crate::protocol::message::{
    DeviceHello, DeviceSample, ErrorCode, ErrorReport, FromDevice, FromHost, MessageError, is_newer,
};
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;

/// Longest time from an enable to the first sample that confirms it, ns.
const ENABLE_TIMEOUT_NS: u64 = 100_000_000;

/// Longest time without a sample, ns: after that the device may have forgotten us, as after a power
/// failure behind a converter, and must be greeted again.
const SILENCE_NS: u64 = 500_000_000;

/// Time between two sendings of the same zero force while no other command may be sent, ns.
const SEND_AGAIN_NS: u64 = 10_000_000;

/// Shortest time without a confirmation under force that counts as none, ns: the 16 ms for which an FTDI collects samples,
/// and some more. A device's watchdog may be shorter.
const MIN_IGNORED_NS: u64 = 25_000_000;

/// The same time for a device without a watchdog, or with one beyond what is allowed without an option, ns.
const MAX_IGNORED_NS: u64 = 200_000_000;

/// Why incoming bytes are not a message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum RejectedInput {
    Frame(FrameError),
    Message(MessageError),
}

/// Whether the motor is enabled, as far as both sides know.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Motor {
    Off {
        /// Sequence of the first command that orders it off, since the hello or since force last flowed.
        since: Option<u32>,
    },
    /// Asked for at a time of ours, ns, by a message with a sequence, and not confirmed yet.
    Asked {
        at_ns: u64,
        sequence: u32,
    },
    On,
}

/// What is commanded, as it stands in a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Order {
    force_mn: i32,
    enabled: bool,
}

/// What becomes of a tick's command.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Outgoing {
    /// It is sent, behind an enable where the motor was off and must be on.
    Sent {
        enable: Option<FromHost>,
        command: FromHost,
    },
    /// It waits, as too much is unconfirmed; the next tick has a newer one.
    Withheld {
        /// It is the same as the newest that was sent.
        repeats: bool,
    },
}

impl Outgoing {
    /// The messages to send, in their order.
    pub(crate) fn messages(self) -> std::iter::Flatten<std::array::IntoIter<Option<FromHost>, 2>> {
        let messages = match self {
            Self::Sent { enable, command } => [enable, Some(command)],
            Self::Withheld { .. } => [None, None],
        };
        messages.into_iter().flatten()
    }
}

/// A conversation with a device.
#[derive(Debug)]
pub(crate) struct Session {
    counters: Arc<LinkCounters>,
    clock: DeviceClock,
    metres_per_count: f64,
    force_limit_mn: i32,
    /// Age from which an incoming sample is late, ns.
    late_after_ns: u64,
    newest: Option<DeviceSample>,
    /// Sequence of the sample that was last passed on.
    used: Option<u32>,
    /// Time of the last new sample on our clock, ns.
    heard_at_ns: u64,
    device_ns: u64,
    /// Counts since the first sample, which is the origin.
    counts: i64,
    motor: Motor,
    sent: SentMessages,
    /// The newest that was sent.
    order: Option<Order>,
    /// Where force is wanted, what the device does with its commands.
    force: Option<Result<(), DeviceError>>,
    /// Longest round trip under force, and longest time without a confirmation, ns.
    late_round_trip_ns: u64,
    ignored_after_ns: u64,
    error: Option<ErrorReport>,
}

impl Session {
    /// Begins with a device's hello, at a time of ours, ns.
    pub(crate) fn new(hello: &DeviceHello, timing: LoopTiming, now_ns: u64, counters: Arc<LinkCounters>) -> Self {
        counters.begin_conversation();
        let sample_period_ns = 1_000_000_000 / u64::from(hello.sample_rate_hz.max(1));
        let watchdog_ns = hello.watchdog().map_or(MAX_IGNORED_NS, |ms| u64::from(ms) * 1_000_000);
        Self {
            counters,
            clock: DeviceClock::default(),
            metres_per_count: 1.0 / f64::from(hello.counts_per_metre),
            force_limit_mn: i32::try_from(hello.force_limit_mn).unwrap_or(i32::MAX),
            // A sample may wait a period of ours to be read, and one of its own to be sent.
            late_after_ns: timing.period_ns + sample_period_ns,
            newest: None,
            used: None,
            heard_at_ns: now_ns,
            device_ns: 0,
            counts: 0,
            motor: Motor::Off { since: None },
            sent: SentMessages::new(sample_period_ns),
            order: None,
            force: None,
            late_round_trip_ns: timing.stale_ns + sample_period_ns,
            ignored_after_ns: watchdog_ns.clamp(MIN_IGNORED_NS, MAX_IGNORED_NS) + sample_period_ns,
            error: None,
        }
    }

    /// Takes in a message, or the error in its place, at a time of ours, ns.
    pub(crate) fn take(&mut self, came: Result<FromDevice, RejectedInput>, now_ns: u64) {
        match came {
            Ok(FromDevice::Sample(sample)) => self.take_sample(sample, now_ns),
            // The samples show what the device did.
            Ok(FromDevice::Acknowledge { done: true, .. }) => {}
            // The device's own error says more.
            Ok(FromDevice::Acknowledge { done: false, .. }) => {
                self.error.get_or_insert(ErrorCode::Motor.into());
            }
            Ok(FromDevice::Error { code, detail }) => {
                let report = ErrorReport { code, detail };
                add(&self.counters.device_errors, 1);
                self.counters.note_error(LinkError::Device(report), now_ns);
                // A message that was damaged on its way to the device is not an error of the
                // device.
                if code != ErrorCode::BadMessage {
                    self.error = Some(report);
                }
            }
            // An answer to a repeated question, or a device that has restarted behind our back: its
            // samples then say that its motor is off.
            Ok(FromDevice::Hello(_)) => {}
            Err(RejectedInput::Frame(_)) => add(&self.counters.bad_crc, 1),
            Err(RejectedInput::Message(_)) => add(&self.counters.malformed, 1),
        }
    }

    fn take_sample(&mut self, sample: DeviceSample, now_ns: u64) {
        if let Some(newest) = self.newest {
            if !is_newer(sample.sequence, newest.sequence) {
                add(&self.counters.out_of_sequence, 1);
                return;
            }
            self.counters
                .note_gap(sample.sequence.wrapping_sub(newest.sequence) - 1);
            self.counts += i64::from(sample.count.wrapping_sub(newest.count));
        }
        add(&self.counters.samples, 1);
        self.device_ns = self.clock.stamp(sample.time_us, now_ns);
        let age_ns = self.clock.age_ns(self.device_ns, now_ns);
        if age_ns > self.late_after_ns {
            add(&self.counters.late, 1);
        }
        if let Some(round_trip_ns) = self.sent.round_trip_ns(sample.command, now_ns) {
            self.counters.note_round_trip(round_trip_ns);
            let is_late = round_trip_ns > self.late_round_trip_ns;
            self.counters.note_lateness(is_late);
            if is_late {
                self.force = self.force.and(Some(Err(DeviceError::CommandsLate)));
            }
        }
        // By the time of the sample, which may have lain on its way up while commands went down.
        let sampled_ns = now_ns.saturating_sub(age_ns);
        let is_ignoring = self.sent.waiting_ns(sampled_ns) > self.ignored_after_ns;
        self.counters.note_ignoring(is_ignoring);
        if is_ignoring {
            self.force = self.force.and(Some(Err(DeviceError::CommandsIgnored)));
        }
        self.counters.buttons.store(sample.buttons.into(), Relaxed);
        self.motor = match (self.motor, sample.enabled) {
            // A sample from before the enable says nothing.
            (Motor::Asked { sequence, .. }, true) if !is_newer(sequence, sample.command) => Motor::On,
            (motor, _) => motor,
        };
        self.newest = Some(sample);
    }

    /// Whether a new sample came since the last [`Self::measurement`].
    pub(crate) fn has_news(&self) -> bool {
        self.newest.map(|sample| sample.sequence) != self.used
    }

    /// The newest sample, at a time of ours, ns; nothing before the first.
    ///
    /// # Errors
    /// The motor is not enabled though it should be, the device has reported an error, confirms commands under force too
    /// late or not at all, or was silent for too long and must be greeted again.
    pub(crate) fn measurement(&mut self, now_ns: u64) -> Result<Option<Measurement>, DeviceError> {
        if self.has_news() {
            self.heard_at_ns = now_ns;
        } else if now_ns.saturating_sub(self.heard_at_ns) > SILENCE_NS {
            self.counters.note_error(LinkError::Silent, now_ns);
            return Err(DeviceError::Disconnected);
        }
        let Some(newest) = self.newest else {
            return Ok(None);
        };
        self.used = Some(newest.sequence);
        let age_ns = self.clock.age_ns(self.device_ns, now_ns);
        self.counters.note_age(age_ns, age_ns);
        self.counters
            .drift_ppb
            .store(self.clock.drift_ppb().unwrap_or(UNKNOWN_DRIFT), Relaxed);
        if let Some(report) = self.error.take() {
            return Err(DeviceError::Failed(report));
        }
        let off = match self.motor {
            Motor::Off { .. } => false,
            Motor::Asked { at_ns, .. } => now_ns.saturating_sub(at_ns) > ENABLE_TIMEOUT_NS,
            Motor::On => !newest.enabled,
        };
        if off {
            return Err(DeviceError::MotorOff {
                watchdog: newest.watchdog,
            });
        }
        self.force.unwrap_or(Ok(()))?;
        #[expect(clippy::cast_precision_loss, reason = "no handle goes 2^53 counts")]
        let position_m = self.counts as f64 * self.metres_per_count;
        Ok(Some(Measurement {
            motor: self.reported(&newest),
            buttons: newest.buttons,
            ..Measurement::new(newest.sequence, self.device_ns, position_m)
        }))
    }

    /// The motor's state by a sample. A motor that is off counts as an answer only from a device
    /// that has heard the order.
    fn reported(&self, sample: &DeviceSample) -> ReportedMotor {
        match self.motor {
            _ if sample.enabled => ReportedMotor::Enabled,
            Motor::Off { since: Some(sequence) } if !is_newer(sequence, sample.command) => ReportedMotor::Off,
            _ => ReportedMotor::Unconfirmed,
        }
    }

    /// What becomes of the command of a force on the hand, N, at a time of ours, ns. Zero force and a motor that is to be
    /// off are sent at once, and then again and again until they are confirmed; other commands only while there is room.
    pub(crate) fn command(&mut self, force_n: f64, enabled: bool, now_ns: u64) -> Outgoing {
        let order = Order {
            force_mn: if enabled { self.force_mn(force_n) } else { 0 },
            enabled,
        };
        if self.force.is_some() != enabled {
            self.force = enabled.then_some(Ok(()));
        }
        let enables = enabled && matches!(self.motor, Motor::Off { .. });
        let repeats = self.order == Some(order) && !enables;
        let pulls = order.force_mn != 0 || enables;
        let must_go = !pulls && (!repeats || now_ns.saturating_sub(self.sent.newest_at_ns()) >= SEND_AGAIN_NS);
        if !must_go && !self.sent.has_room(now_ns) {
            if !repeats {
                add(&self.counters.not_sent, 1);
            }
            return Outgoing::Withheld { repeats };
        }
        let enable = enables.then(|| {
            let sequence = self.sent.next(now_ns);
            self.motor = Motor::Asked {
                at_ns: now_ns,
                sequence,
            };
            FromHost::Enable { sequence, enabled }
        });
        let sequence = self.sent.next(now_ns);
        self.order = Some(order);
        if !enabled {
            let since = match self.motor {
                Motor::Off { since } => since,
                Motor::Asked { .. } | Motor::On => None,
            };
            self.motor = Motor::Off {
                since: since.or(Some(sequence)),
            };
        }
        let Order { force_mn, enabled } = order;
        let command = FromHost::Command {
            sequence,
            force_mn,
            enabled,
        };
        Outgoing::Sent { enable, command }
    }

    /// The newest messages could not be sent: the next command is another one.
    pub(crate) fn forget_order(&mut self) {
        self.order = None;
    }

    fn force_mn(&self, force_n: f64) -> i32 {
        let limit = f64::from(self.force_limit_mn);
        let wanted = (force_n * 1000.0).round();
        if wanted.abs() > limit {
            add(&self.counters.clipped, 1);
        }
        // A force that is not a number becomes zero.
        #[expect(
            clippy::cast_possible_truncation,
            reason = "within the limit, a whole number of 32 bits"
        )]
        let force_mn = wanted.max(-limit).min(limit) as i32;
        if wanted.is_nan() { 0 } else { force_mn }
    }
}

#[cfg(test)]
pub(super) mod tests;
