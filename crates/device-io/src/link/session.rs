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
use crate::kinematics::within_limits;
use crate::protocol::DEVICE_SILENCE_NS;
use crate::protocol::message::{
    DeviceHello, DeviceSample, ErrorCode, ErrorReport, FromDevice, FromHost, MessageError, is_newer,
};
use std::mem::replace;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;

/// Longest time from an enable to the first sample that confirms it, ns.
const ENABLE_TIMEOUT_NS: u64 = 100_000_000;

/// Longest time without a sample, ns: after that the device may have forgotten us, as after a power
/// failure behind a converter, and must be greeted again.
const SILENCE_NS: u64 = 500_000_000;

/// Time between two sendings of the same zero force while no other command may be sent, ns.
const SEND_AGAIN_NS: u64 = 10_000_000;

/// Shortest time without a confirmation under force that counts as none, ns: the 16 ms for which an FTDI collects
/// samples, and some more. A device's watchdog may be shorter.
const MIN_IGNORED_NS: u64 = 25_000_000;

/// The same time for a device without a watchdog, or with one beyond what is allowed without an option, ns.
const MAX_IGNORED_NS: u64 = 200_000_000;

/// Samples over which the mean time between them is taken.
const PERIODS: u64 = 64;

/// Why incoming bytes are not a message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum RejectedInput {
    Frame,
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
    /// Of both motors, mN or uN m; of a device with one the second is 0.
    efforts: [i32; 2],
    enabled: bool,
}

/// A motor and its encoder, as the hello describes them.
#[derive(Clone, Copy, Debug)]
struct Axis {
    /// Distance between two counts, m or rad.
    count: f64,
    /// Units of the message, mN or uN m, in a N or N m.
    units: f64,
    /// Largest effort, in such units.
    limit: i32,
}

/// The axes of a device: one or two.
fn axes(hello: &DeviceHello) -> [Option<Axis>; 2] {
    let is_rotary = hello.two_axes.is_some_and(|two| two.are_rotary);
    let axis = |counts: f32, limit: u32| Axis {
        count: 1.0 / f64::from(counts),
        units: if is_rotary { 1e6 } else { 1e3 },
        limit: i32::try_from(limit).unwrap_or(i32::MAX),
    };
    let second = hello.two_axes.map(|two| axis(two.second_counts, two.second_limit));
    [Some(axis(hello.counts_per_metre, hello.force_limit_mn)), second]
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
pub(crate) struct LinkSession {
    counters: Arc<LinkCounters>,
    clock: DeviceClock,
    axes: [Option<Axis>; 2],
    /// Whether count 0 is a place of the rig, and not where it happened to be at the first sample.
    is_absolute: bool,
    /// Age from which an incoming sample is late, ns.
    late_after_ns: u64,
    newest: Option<DeviceSample>,
    /// Sequence of the sample that was last passed on.
    used: Option<u32>,
    /// Time of the last new sample on our clock, ns.
    received_at_ns: u64,
    /// Time of the last measurement, and of the end of our last standstill by which the device may have lost us, ns.
    measured_at_ns: u64,
    standstill_until_ns: Option<u64>,
    device_ns: u64,
    /// Samples since the mean time between them was taken, and when that was, ns.
    periods: u64,
    periods_began_ns: u64,
    /// Counts of both encoders since the first sample, which is the origin unless they are absolute.
    counts: [i64; 2],
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

impl LinkSession {
    /// Begins with a device's hello, at a time of ours, ns.
    pub(crate) fn new(hello: &DeviceHello, timing: LoopTiming, now_ns: u64, counters: Arc<LinkCounters>) -> Self {
        counters.begin_conversation();
        let sample_period_ns = 1_000_000_000 / u64::from(hello.sample_rate_hz.max(1));
        let watchdog_ns = hello.watchdog().map_or(MAX_IGNORED_NS, |ms| u64::from(ms) * 1_000_000);
        Self {
            counters,
            clock: DeviceClock::default(),
            axes: axes(hello),
            is_absolute: hello.two_axes.is_some_and(|two| two.are_absolute),
            // A sample may wait a period of ours to be read, and one of its own to be sent.
            late_after_ns: timing.period_ns + sample_period_ns,
            newest: None,
            used: None,
            received_at_ns: now_ns,
            measured_at_ns: now_ns,
            standstill_until_ns: None,
            device_ns: 0,
            // The first sample ends no period.
            periods: PERIODS - 1,
            periods_began_ns: 0,
            counts: [0; 2],
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
            Err(RejectedInput::Frame) => add(&self.counters.bad_crc, 1),
            Err(RejectedInput::Message(_)) => add(&self.counters.malformed, 1),
        }
    }

    fn take_sample(&mut self, sample: DeviceSample, now_ns: u64) {
        // Half a position is none.
        if sample.second_count.is_some() != self.axes[1].is_some() {
            add(&self.counters.malformed, 1);
            return;
        }
        if let Some(newest) = self.newest {
            if !is_newer(sample.sequence, newest.sequence) {
                add(&self.counters.out_of_sequence, 1);
                return;
            }
            self.counters
                .note_gap(sample.sequence.wrapping_sub(newest.sequence) - 1);
            let (now, before) = (counts_of(&sample), counts_of(&newest));
            self.counts = [0, 1].map(|axis| self.counts[axis] + i64::from(now[axis].wrapping_sub(before[axis])));
        } else if self.is_absolute {
            self.counts = counts_of(&sample).map(i64::from);
        }
        add(&self.counters.samples, 1);
        self.device_ns = self.clock.stamp(sample.time_us, now_ns);
        self.periods += 1;
        if self.periods == PERIODS {
            self.periods = 0;
            let began_ns = replace(&mut self.periods_began_ns, self.device_ns);
            self.counters
                .period_ns
                .store((self.device_ns - began_ns) / PERIODS, Relaxed);
        }
        let age_ns = self.clock.age_ns(self.device_ns, now_ns);
        if age_ns > self.late_after_ns {
            add(&self.counters.late, 1);
        }
        if let Some(round_trip_ns) = self.sent.round_trip_ns(sample.command, now_ns) {
            self.counters.note_round_trip(round_trip_ns);
            let is_late = round_trip_ns > self.late_round_trip_ns;
            self.counters.note_lateness(round_trip_ns, is_late);
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

    /// The newest sample, at a time of ours, ns, with the positions of both motors, m or rad; nothing before the first.
    ///
    /// # Errors
    /// The motor is not enabled though it should be, the device has reported an error, confirms commands under force
    /// too late or not at all, or was silent for too long and must be greeted again.
    pub(crate) fn measurement(&mut self, now_ns: u64) -> Result<Option<Measurement<[f64; 2]>>, DeviceError> {
        let since_ns = now_ns.saturating_sub(replace(&mut self.measured_at_ns, now_ns));
        if since_ns >= DEVICE_SILENCE_NS {
            self.standstill_until_ns = Some(now_ns);
            self.counters.note_error(LinkError::standstill(since_ns), now_ns);
        }
        if self.has_news() {
            self.received_at_ns = now_ns;
        } else if now_ns.saturating_sub(self.received_at_ns) > SILENCE_NS {
            // What came during a standstill is read soon after it, and then the device is silent because we were.
            if self
                .standstill_until_ns
                .is_none_or(|end_ns| now_ns - end_ns > 2 * SILENCE_NS)
            {
                self.counters.note_error(LinkError::Silent, now_ns);
            }
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
        let positions = [0, 1].map(|at| self.counts[at] as f64 * self.axes[at].map_or(0.0, |axis| axis.count));
        Ok(Some(Measurement {
            motor: self.reported(&newest),
            buttons: newest.buttons,
            ..Measurement::new(newest.sequence, self.device_ns, positions)
        }))
    }

    /// The motor's state by a sample. A motor that is off counts as an answer only from a device
    /// that has received the order.
    fn reported(&self, sample: &DeviceSample) -> ReportedMotor {
        match self.motor {
            _ if sample.enabled => ReportedMotor::Enabled,
            Motor::Off { since: Some(sequence) } if !is_newer(sequence, sample.command) => ReportedMotor::Off,
            _ => ReportedMotor::Unconfirmed,
        }
    }

    /// What becomes of the command of both motors' efforts, N or N m, at a time of ours, ns. Zero force and a motor
    /// that is to be off are sent at once, and then again and again until they are confirmed; other commands only while
    /// there is room.
    pub(crate) fn command(&mut self, efforts: [f64; 2], enabled: bool, now_ns: u64) -> Outgoing {
        let order = Order {
            efforts: if enabled { self.in_units(efforts) } else { [0; 2] },
            enabled,
        };
        if self.force.is_some() != enabled {
            self.force = enabled.then_some(Ok(()));
        }
        let enables = enabled && matches!(self.motor, Motor::Off { .. });
        let repeats = self.order == Some(order) && !enables;
        let pulls = order.efforts != [0; 2] || enables;
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
        let Order {
            efforts: [force_mn, second],
            enabled,
        } = order;
        let command = FromHost::Command {
            sequence,
            force_mn,
            second_mn: self.axes[1].map(|_| second),
            enabled,
        };
        Outgoing::Sent { enable, command }
    }

    /// The newest messages could not be sent: the next command is another one.
    pub(crate) fn forget_order(&mut self) {
        self.order = None;
    }

    /// Efforts of both motors as they stand in a message. Where one is beyond its motor's limit both shrink by one
    /// factor, so that the force on a hand keeps its direction.
    fn in_units(&self, efforts: [f64; 2]) -> [i32; 2] {
        // Finite, so that what is cut to a limit has a direction.
        let in_units = |axis: Axis, effort: f64| (effort * axis.units).round().clamp(f64::MIN, f64::MAX);
        let wanted = [0, 1].map(|at| self.axes[at].map_or(0.0, |axis| in_units(axis, efforts[at])));
        let limits = self.axes.map(|axis| axis.map_or(0.0, |axis| f64::from(axis.limit)));
        // An effort that is not a number leaves none.
        if wanted.iter().any(|effort| effort.is_nan()) {
            return [0; 2];
        }
        let (within, are_clipped) = within_limits(wanted, limits);
        if are_clipped {
            add(&self.counters.clipped, 1);
        }
        #[expect(
            clippy::cast_possible_truncation,
            reason = "within the limits, whole numbers of 32 bits"
        )]
        [0, 1].map(|at| within[at].round().max(-limits[at]).min(limits[at]) as i32)
    }
}

/// The counts of both encoders; of a device with one the second is 0.
fn counts_of(sample: &DeviceSample) -> [i32; 2] {
    [sample.count, sample.second_count.unwrap_or_default()]
}

#[cfg(test)]
pub(super) mod tests;
