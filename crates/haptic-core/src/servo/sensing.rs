//! From what a device reports to where the hand is: which samples are new, when they were taken,
//! and whether a hand can have made them.

use super::clock_doubt::ClockDoubt;
use super::state::Fault;
use crate::limiter::SafetyLimiter;
use crate::position_guard::{PositionGuard, PriorMotion, Verdict};
use crate::sample::{DeviceError, Measurement, Motor};
use crate::sample_clock::{ClockError, SampleClock, Stamp, seconds};
use crate::snapshot::Archive;
use crate::vector::Vector;
use crate::velocity::{Estimator, Method};

/// Periods without a new sample after which the force decays.
pub const SILENT_PERIODS: f64 = 3.0;

/// Time from then until the force has decayed, s.
pub const DECAY_S: f64 = 0.02;

/// Time in which it comes back, s: the hand has moved on meanwhile, and the surface grips it again.
const RETURN_S: f64 = 0.05;

/// What a tick makes of a reading.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Sensed {
    /// The hand is at a new place, this long after the last one, s.
    Moved { elapsed_s: f64 },
    /// No new sample to render: no time passes for the block.
    Unchanged,
    /// The device is there, and what it sends cannot be right.
    Faulty(Fault),
    /// The device is not there, or repeats itself.
    Gone,
    /// The device has been repeating itself for too long.
    Stale,
}

/// The newest sample of the device.
#[derive(Clone, Copy, Debug, Default)]
struct Newest {
    sequence: u32,
    /// When it was first read, on our clock, ns.
    read_ns: u64,
}

/// What is known of the hand.
#[derive(Clone, Debug)]
pub(super) struct Sensing<V: Vector> {
    /// How long a device may repeat its last sample before it counts as stale, ns. Until then no
    /// time passes for the block.
    stale_ns: u64,
    newest: Option<Newest>,
    clock: SampleClock,
    clock_doubt: ClockDoubt,
    guard: PositionGuard<V>,
    method: Method,
    /// Nominal time between two steps, s.
    step_s: f64,
    /// One for each axis; on a line the second rests.
    estimators: [Estimator; 2],
    /// Of the hand.
    pub(super) position_m: V,
    pub(super) velocity_mps: V,
    /// Time over which that was seen, s.
    seen_over_s: f64,
    /// What the device says of its motor.
    pub(super) motor: Motor,
    buttons: u8,
    /// Share of the force that is left while no new sample comes, or the hand is outside the workspace, 0 to 1.
    share: f64,
    /// Time for which the hand has been outside, s.
    outside_s: f64,
}

impl<V: Vector> Sensing<V> {
    pub(super) fn new(method: Method, step_s: f64, stale_ns: u64) -> Self {
        Self {
            stale_ns,
            newest: None,
            clock: SampleClock::new(stale_ns),
            clock_doubt: ClockDoubt::default(),
            guard: PositionGuard::default(),
            method,
            step_s,
            // With its first sample every device gets an estimator of its own.
            estimators: [Estimator::new(method, step_s, 0.0); 2],
            position_m: V::ZERO,
            velocity_mps: V::ZERO,
            seen_over_s: 0.0,
            motor: Motor::Unreported,
            buttons: 0,
            share: 1.0,
            outside_s: 0.0,
        }
    }

    /// Saves or loads what is known of the hand.
    pub(super) fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.option("has_device", &mut self.newest, Newest::default(), |archive, newest| {
            archive.count_u32("sequence", &mut newest.sequence);
            archive.count("read_ns", &mut newest.read_ns, u64::MAX);
        });
        self.clock.archive(archive);
        self.clock_doubt.archive(archive);
        self.guard.archive(archive);
        for (part, estimator) in ["velocity", "velocity_y"]
            .into_iter()
            .zip(&mut self.estimators)
            .take(V::AXES)
        {
            archive.part(part, |archive| estimator.archive(archive));
        }
        archive.vector("position_m", &mut self.position_m);
        archive.vector("velocity_mps", &mut self.velocity_mps);
        archive.number("seen_over_s", &mut self.seen_over_s);
        archive.choice("motor", &mut self.motor, &Motor::ALL);
        let mut buttons = self.buttons.into();
        archive.count("buttons", &mut buttons, u8::MAX.into());
        self.buttons = u8::try_from(buttons).unwrap_or_default();
        archive.number("share", &mut self.share);
        if V::AXES > 1 {
            archive.number("outside_s", &mut self.outside_s);
        }
    }

    /// Whether a button is pressed.
    pub(super) fn is_pressed(&self, button: u8) -> bool {
        self.buttons & 1_u8.checked_shl(button.into()).unwrap_or(0) != 0 && self.newest.is_some()
    }

    /// Samples that no hand can have made, and that were not rendered.
    pub(super) fn forgotten(&self) -> u64 {
        self.guard.forgotten()
    }

    /// Time between two samples, or two ticks, whichever is longer, s.
    pub(super) fn period_s(&self) -> f64 {
        self.step_s.max(self.clock.period_s())
    }

    /// What is wrong with the device's clock: it drifts or stands still, or jumps while no force flows.
    pub(super) fn clock_error(&self, now_ns: u64) -> Option<ClockError> {
        self.clock_doubt.error(now_ns)
    }

    /// Whether the next sample is the first of its device.
    pub(super) fn is_new_device(&self) -> bool {
        self.newest.is_none()
    }

    /// Forgets the device: another may come.
    pub(super) fn forget(&mut self) {
        self.newest = None;
        self.clock.reset();
        self.guard.rest();
        self.reset_velocity();
    }

    fn reset_velocity(&mut self) {
        self.estimators.iter_mut().for_each(Estimator::reset);
    }

    /// Takes in a reading at a time of ours, of a device with a resolution (m). A failed or stale
    /// reading is never rendered as a position. While force flows (`live`) a sample that no hand
    /// can have made is not rendered either, by the force (N/m) that the surface gives for a place at once; without,
    /// the block goes wherever the device says.
    #[inline(always)]
    pub(super) fn sense(
        &mut self,
        measured: &Result<Measurement<V>, DeviceError>,
        now_ns: u64,
        resolution_m: f64,
        live: bool,
        stiffness: f64,
        limits: &SafetyLimiter<V>,
    ) -> Sensed {
        let sample = match measured {
            Ok(sample) => sample,
            Err(error) => return self.fail(*error),
        };
        self.motor = sample.motor;
        self.buttons = sample.buttons;
        if let Some(newest) = self.newest.filter(|newest| newest.sequence == sample.sequence) {
            return self.hear_again(newest, now_ns);
        }
        if !sample.position_m.is_finite() {
            return Sensed::Faulty(Fault::NonFinitePosition);
        }
        let first = self.newest.is_none();
        if first {
            self.begin(resolution_m);
        }
        self.newest = Some(Newest {
            sequence: sample.sequence,
            read_ns: now_ns,
        });
        let stamp = Stamp {
            sequence: sample.sequence,
            device_ns: sample.time_ns,
            host_ns: now_ns,
        };
        // A sample that only came late says nothing of the device's clock.
        let is_in_doubt = !live && !self.clock.is_borne_out(stamp);
        let elapsed = self.clock.elapsed_s(stamp);
        let elapsed_s = match elapsed {
            Ok(elapsed_s) => elapsed_s,
            Err(error) => {
                if is_in_doubt || error != ClockError::Jumped {
                    self.clock_doubt.add(error, now_ns);
                }
                if live {
                    return Sensed::Faulty(Fault::DeviceClock(error));
                }
                self.disregard_time()
            }
        };
        let elapsed_s = if live && !first {
            let before = PriorMotion {
                position: self.position_m,
                velocity: self.velocity_mps,
                seen_over_s: self.seen_over_s,
                resolution: resolution_m,
                felt: limits.step_n(self.step_s) / stiffness,
            };
            match self.guard.judge(before, sample.position_m, elapsed_s, limits) {
                Verdict::Believed { elapsed_s } => elapsed_s,
                Verdict::Held => return Sensed::Unchanged,
                Verdict::Jumped => return Sensed::Faulty(Fault::Jump),
            }
        } else {
            self.guard.rest();
            elapsed_s
        };
        self.position_m = sample.position_m;
        self.velocity_mps = self.estimate(elapsed_s, sample.position_m);
        self.seen_over_s = elapsed_s;
        Sensed::Moved { elapsed_s }
    }

    #[inline(always)]
    fn estimate(&mut self, elapsed_s: f64, position: V) -> V {
        let [first, second] = &mut self.estimators;
        let along_first = first.update(elapsed_s, position.first());
        let along_second = if V::AXES > 1 {
            second.update(elapsed_s, position.second())
        } else {
            0.0
        };
        V::of_axes(along_first, along_second)
    }

    /// The newest sample once more.
    #[inline(never)]
    fn hear_again(&mut self, newest: Newest, now_ns: u64) -> Sensed {
        if now_ns.saturating_sub(newest.read_ns) > self.stale_ns {
            self.reset_velocity();
            return Sensed::Stale;
        }
        Sensed::Unchanged
    }

    /// The first sample, of what may be another device than the last one.
    #[cold]
    fn begin(&mut self, resolution_m: f64) {
        self.clock.reset();
        self.clock_doubt = ClockDoubt::default();
        self.estimators = [Estimator::new(self.method, self.step_s, resolution_m); 2];
    }

    /// Without force nothing is made of a wrong time, s; with the next sample it begins again.
    #[cold]
    fn disregard_time(&mut self) -> f64 {
        self.reset_velocity();
        0.0
    }

    /// The device could not be read.
    #[cold]
    fn fail(&mut self, error: DeviceError) -> Sensed {
        self.forget();
        match error {
            DeviceError::MotorOff { watchdog } => {
                self.motor = Motor::Off;
                Sensed::Faulty(Fault::MotorOff { watchdog })
            }
            DeviceError::CommandsIgnored => Sensed::Faulty(Fault::CommandsIgnored),
            DeviceError::CommandsLate => Sensed::Faulty(Fault::CommandsLate),
            DeviceError::Failed(code) => Sensed::Faulty(Fault::Device(code)),
            DeviceError::Disconnected => {
                self.motor = Motor::Unreported;
                self.buttons = 0;
                Sensed::Gone
            }
        }
    }

    /// Whether a sample has come at this time of ours, and none was missed of late: all of the force
    /// may flow.
    pub(super) fn is_steady(&self, now_ns: u64) -> bool {
        self.newest.is_some_and(|newest| newest.read_ns == now_ns) && self.share == 1.0
    }

    /// Share of the force that may flow at a time of ours, `tick_s` after the tick before, s: it
    /// decays while no new sample comes or the hand is outside the workspace, and comes back more slowly.
    pub(super) fn share(&mut self, now_ns: u64, tick_s: f64, is_outside: bool) -> f64 {
        let silent_ns = self.newest.map_or(0, |newest| now_ns.saturating_sub(newest.read_ns));
        self.outside_s = if is_outside { self.outside_s + tick_s } else { 0.0 };
        let absent_s = (seconds(silent_ns) - SILENT_PERIODS * self.period_s()).max(self.outside_s);
        let allowed = (1.0 - absent_s / DECAY_S).clamp(0.0, 1.0);
        self.share = allowed.min(self.share + tick_s / RETURN_S);
        self.share
    }

    /// Whether no new sample has come, or the hand has been outside, until all force has decayed.
    pub(super) fn is_silent(&self) -> bool {
        self.share == 0.0
    }

    /// No force flows: it begins again as a whole, or outside the workspace with nothing.
    pub(super) fn rest(&mut self, is_outside: bool) {
        self.share = if is_outside { 0.0 } else { 1.0 };
        self.outside_s = if is_outside { DECAY_S } else { 0.0 };
    }
}
