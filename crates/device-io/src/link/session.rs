//! The host's side of the link protocol after the device's hello: the samples that count, the
//! position of the handle, the state of the motor, and the messages to send. It knows nothing of
//! serial lines and reports, and waits for nothing.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

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

/// Why incoming bytes are not a message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum RejectedInput {
    Frame(FrameError),
    Message(MessageError),
}

/// Whether the motor is enabled, as far as both sides know.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Motor {
    Off,
    /// Asked for at a time of ours, ns, by a message with a sequence, and not confirmed yet.
    Asked {
        at_ns: u64,
        sequence: u32,
    },
    On,
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
    /// Sequence of the first command since the hello, or since force last flowed, that orders the
    /// motor off.
    off_since: Option<u32>,
    sent: SentMessages,
    error: Option<ErrorReport>,
}

impl Session {
    /// Begins with a device's hello, at a time of ours, ns, for a host with a period, ns.
    pub(crate) fn new(hello: &DeviceHello, period_ns: u64, now_ns: u64, counters: Arc<LinkCounters>) -> Self {
        counters.begin_conversation();
        Self {
            counters,
            clock: DeviceClock::new(),
            metres_per_count: 1.0 / f64::from(hello.counts_per_metre),
            force_limit_mn: i32::try_from(hello.force_limit_mn).unwrap_or(i32::MAX),
            // A sample may wait a period of ours to be read, and one of its own to be sent.
            late_after_ns: period_ns + 1_000_000_000 / u64::from(hello.sample_rate_hz.max(1)),
            newest: None,
            used: None,
            heard_at_ns: now_ns,
            device_ns: 0,
            counts: 0,
            motor: Motor::Off,
            off_since: None,
            sent: SentMessages::new(),
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
        if self.clock.age_ns(self.device_ns, now_ns) > self.late_after_ns {
            add(&self.counters.late, 1);
        }
        if let Some(round_trip_ns) = self.sent.round_trip_ns(sample.command, now_ns) {
            self.counters.note_round_trip(round_trip_ns);
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
    /// The motor is not enabled though it should be, the device has reported an error, or was
    /// silent for too long and must be greeted again.
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
            Motor::Off => false,
            Motor::Asked { at_ns, .. } => now_ns.saturating_sub(at_ns) > ENABLE_TIMEOUT_NS,
            Motor::On => !newest.enabled,
        };
        if off {
            return Err(DeviceError::MotorOff {
                watchdog: newest.watchdog,
            });
        }
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
        let heard = self
            .off_since
            .is_some_and(|sequence| !is_newer(sequence, sample.command));
        match (sample.enabled, heard) {
            (true, _) => ReportedMotor::Enabled,
            (false, true) => ReportedMotor::Off,
            (false, false) => ReportedMotor::Unconfirmed,
        }
    }

    /// The messages for a force on the hand, N, at a time of ours, ns: an enable first, if the
    /// motor was off and must be on.
    pub(crate) fn command(&mut self, force_n: f64, enabled: bool, now_ns: u64) -> (Option<FromHost>, FromHost) {
        let enable = (enabled && self.motor == Motor::Off).then(|| {
            let sequence = self.sent.next(now_ns);
            self.motor = Motor::Asked {
                at_ns: now_ns,
                sequence,
            };
            FromHost::Enable { sequence, enabled }
        });
        let sequence = self.sent.next(now_ns);
        if enabled {
            self.off_since = None;
        } else {
            self.motor = Motor::Off;
            self.off_since.get_or_insert(sequence);
        }
        let command = FromHost::Command {
            sequence,
            force_mn: if enabled { self.force_mn(force_n) } else { 0 },
            enabled,
        };
        (enable, command)
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
mod tests;
