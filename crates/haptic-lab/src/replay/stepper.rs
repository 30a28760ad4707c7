//! A servo that is stepped through a recording's rows, wherever its state is known.

use super::error::ReplayError;
use super::scenes::{Alternative, Arriving, Scenes};
use super::tracker::TrackerSearch;
use crate::recording::{Mark, Metadata};
use haptic_core::sample::DeviceError;
use haptic_core::servo::{Command, Event, Events, InputWord, Inputs, Servo, Settings};
use haptic_ipc::{RigState, Sample, ServoSetup};
use serde::Serialize;

/// Ticks in a row with the recorded numbers after which a servo that began without force is known to
/// be in the recorded one's state.
pub const SETTLED_TICKS: u32 = 32;

/// Samples that no estimate of velocity remembers: after these a servo that began without force is in
/// the recorded one's state, or is another servo.
pub const LONGEST_MEMORY_SAMPLES: u32 = 1000;

/// Periods without a new sample after which the force may depend on the exact sampling period (the
/// servo's own limit is 3), which a servo that began later knows only to a few per cent.
const SILENT_PERIODS: f64 = 2.7;

/// Share by which the rate of the rows may lie below the loop's before ticks are missing.
const RATE_TOLERANCE: f64 = 1e-6;

/// Why a row is not compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum NotCompared {
    /// The servo has just begun: its estimate of velocity still depends on what came before.
    Settling,
    /// Force flowed when the recording began.
    BeganWithForce,
    /// Rows were lost before, and force has flowed since.
    RowsLost,
    /// Force began to flow before the servo had settled.
    ForceTooSoon,
    /// The recording does not hold the scene: a pulse, an excitation, or a scene from before it began.
    UnknownScene,
    /// The device fell silent. The force then depends on its period over a time before the recording.
    DeviceSilent,
}

impl std::fmt::Display for NotCompared {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Settling => "the estimate of velocity still remembered what came before",
            Self::BeganWithForce => "the recording began while force flowed",
            Self::RowsLost => "rows were lost before, and the force had not been zero since",
            Self::ForceTooSoon => "force began to flow before the estimate of velocity had settled",
            Self::UnknownScene => {
                "the scene is not in the recording (a pulse or an excitation, or one from before it began)"
            }
            Self::DeviceSilent => "the device fell silent, and its exact period was set before the recording began",
        })
    }
}

/// What became of a row.
#[derive(Clone, Copy, Debug)]
pub(super) enum Stepped {
    /// The row with the outputs that were computed.
    Computed(Sample),
    /// No outputs follow.
    Unknown(NotCompared),
}

#[derive(Debug)]
enum Phase {
    /// Until the rig is without force.
    Waiting(NotCompared),
    /// The servo runs along, and does not count yet.
    Settling {
        /// Ticks in a row with the recorded numbers.
        same: u32,
        /// New samples.
        samples: u32,
    },
    Settled,
}

/// The samples of the device since the servo began.
#[derive(Clone, Copy, Debug, Default)]
struct Device {
    sequence: Option<u32>,
    /// Whether the newest row has a new sample.
    is_fresh: bool,
    samples: u32,
    elapsed_ns: u64,
    /// Time since the newest sample, ns.
    silent_ns: u64,
    /// Whether all that the servo knows of the device's clock came after the servo began.
    clock_known: bool,
}

/// A servo, stepped through rows.
#[derive(Debug)]
pub(super) struct Stepper {
    setup: ServoSetup,
    scenes: Scenes,
    servo: Option<Servo>,
    phase: Phase,
    device: Device,
    tracker: Option<TrackerSearch>,
    last_tick: Option<u64>,
    /// A what-if has no recorded force to be exact about.
    is_exact: bool,
}

impl Stepper {
    /// One that gives what was recorded.
    ///
    /// # Errors
    /// The recording cannot be replayed.
    pub(super) fn exact(metadata: &Metadata) -> Result<Self, ReplayError> {
        Self::new(metadata, None)
    }

    /// One that renders something else.
    ///
    /// # Errors
    /// The recording cannot be replayed.
    pub(super) fn otherwise(metadata: &Metadata, alternative: Alternative) -> Result<Self, ReplayError> {
        Self::new(metadata, Some(alternative))
    }

    fn new(metadata: &Metadata, alternative: Option<Alternative>) -> Result<Self, ReplayError> {
        let Metadata {
            rate_hz, loop_rate_hz, ..
        } = *metadata;
        if rate_hz < loop_rate_hz * (1.0 - RATE_TOLERANCE) {
            return Err(ReplayError::Thinned { rate_hz, loop_rate_hz });
        }
        let setup = metadata.servo.clone().ok_or_else(|| ReplayError::NoServo {
            server: metadata.server.clone(),
        })?;
        Ok(Self {
            is_exact: alternative.is_none(),
            scenes: Scenes::new(metadata, &setup, alternative),
            setup,
            servo: None,
            phase: Phase::Waiting(NotCompared::BeganWithForce),
            device: Device::default(),
            tracker: None,
            last_tick: None,
        })
    }

    /// The scenes so far.
    pub(super) fn scenes(&self) -> &Scenes {
        &self.scenes
    }

    /// Takes a mark.
    pub(super) fn mark(&mut self, mark: &Mark) {
        match mark {
            Mark::Scene {
                revision,
                arrival: Some(arrival),
                ..
            } => self.scenes.add(*revision, arrival),
            Mark::Lost { .. } => self.wait(NotCompared::RowsLost),
            _ => {}
        }
    }

    /// Steps through a row.
    ///
    /// # Errors
    /// A scene cannot be rendered.
    pub(super) fn row(&mut self, row: &Sample) -> Result<Stepped, ReplayError> {
        if self.last_tick.is_some_and(|last| row.tick != last.wrapping_add(1)) {
            self.wait(NotCompared::RowsLost);
        }
        self.last_tick = Some(row.tick);
        if word(row).is_motion() {
            self.wait(NotCompared::UnknownScene);
            return Ok(Stepped::Unknown(NotCompared::UnknownScene));
        }
        if let Phase::Waiting(why) = self.phase {
            return self.begin(row, why);
        }
        let Some(computed) = self.step(row)? else {
            return self.begin(row, NotCompared::UnknownScene);
        };
        let Phase::Settling { same, samples } = &mut self.phase else {
            if self.is_exact && row.state.is_live() && self.is_period_unknown() {
                self.wait(NotCompared::DeviceSilent);
                return Ok(Stepped::Unknown(NotCompared::DeviceSilent));
            }
            return Ok(Stepped::Computed(computed));
        };
        *samples += u32::from(self.device.is_fresh);
        *same = if is_same(row, &computed) { *same + 1 } else { 0 };
        let samples = *samples;
        if *same >= SETTLED_TICKS || samples >= LONGEST_MEMORY_SAMPLES {
            self.phase = Phase::Settled;
        } else if row.state.is_live() {
            self.wait(NotCompared::ForceTooSoon);
            return Ok(Stepped::Unknown(NotCompared::ForceTooSoon));
        } else if computed.state != row.state {
            self.begin(row, NotCompared::Settling)?;
            self.phase = Phase::Settling { same: 0, samples };
        }
        Ok(Stepped::Unknown(NotCompared::Settling))
    }

    /// Goes on only once the rig is without force.
    fn wait(&mut self, why: NotCompared) {
        self.servo = None;
        self.phase = Phase::Waiting(why);
    }

    /// Begins after a row, if the rig is without force there; a what-if begins with force, too.
    fn begin(&mut self, row: &Sample, why: NotCompared) -> Result<Stepped, ReplayError> {
        self.wait(why);
        if row.state.is_live() && self.is_exact {
            return Ok(Stepped::Unknown(why));
        }
        let Some(scene) = self.scenes.active(row.revision)? else {
            return Ok(Stepped::Unknown(NotCompared::UnknownScene));
        };
        let mut servo = Servo::new(self.setup.settings, scene);
        self.device = Device::default();
        let word = word(row);
        // What happened and what was asked for has had its effect in the row's state.
        let quiet = Inputs {
            events: Events::default(),
            command: None,
            ..self.inputs(row)
        };
        match row.state {
            RigState::Engaging | RigState::Engaged | RigState::Releasing => engage(&mut servo, &quiet, row),
            RigState::Stopped => drop(servo.step(
                &Inputs {
                    events: Event::Stop.into(),
                    ..quiet
                },
                None,
            )),
            RigState::Faulted => {
                let sample = Err(DeviceError::MotorOff { watchdog: false });
                servo.step(&Inputs { sample, ..quiet }, None);
                servo.step(&quiet, None);
            }
            RigState::Disconnected | RigState::Idle => drop(servo.step(&quiet, None)),
        }
        if word.write_failed() || row.state == RigState::Disconnected {
            servo.disconnect();
        }
        self.device.take(row, quiet.sample.is_err());
        self.tracker = servo.estimator_mut().tracker_mut().map(|_| {
            let Settings { period_s, stale_ns, .. } = self.setup.settings;
            let mut search = TrackerSearch::new(period_s, stale_ns);
            search.before(row, quiet.sample.is_err());
            search
        });
        self.servo = Some(servo);
        self.phase = if self.is_exact {
            Phase::Settling { same: 0, samples: 0 }
        } else {
            Phase::Settled
        };
        Ok(Stepped::Unknown(NotCompared::Settling))
    }

    fn inputs(&self, row: &Sample) -> Inputs {
        let word = word(row);
        Inputs {
            elapsed_ns: row.elapsed_ns,
            sample: word.sample(row.device_sequence, row.device_time_ns, row.sample_position_m),
            device_resolution_m: self.setup.device_resolution_m,
            device_force_limit_n: self.setup.device_force_limit_n.unwrap_or(f64::INFINITY),
            events: word.events(),
            command: word.command(),
        }
    }

    /// The row as the servo computes it; `None` where the scene is not known.
    fn step(&mut self, row: &Sample) -> Result<Option<Sample>, ReplayError> {
        let word = word(row);
        let scene = if word.new_scene() {
            match self.scenes.arriving(row.revision)? {
                Arriving::Scene(scene) => Some(scene),
                Arriving::Stays => None,
                Arriving::Unknown => return Ok(None),
            }
        } else {
            None
        };
        let inputs = self.inputs(row);
        let Some(servo) = &mut self.servo else {
            return Ok(None);
        };
        let tracker = self.tracker.as_mut();
        if let Some(state) = tracker.and_then(|search| search.before(row, inputs.sample.is_err()))
            && let Some(tracker) = servo.estimator_mut().tracker_mut()
        {
            tracker.set_state(state);
        }
        let outputs = servo.step(&inputs, scene);
        while servo.take_retired().is_some() {}
        if word.write_failed() {
            servo.disconnect();
        }
        self.device.take(row, inputs.sample.is_err());
        Ok(Some(Sample {
            state: servo.state(),
            contact: outputs.contact,
            device_position_m: outputs.device_position_m,
            device_velocity_mps: outputs.device_velocity_mps,
            block_position_m: outputs.block_position_m,
            block_velocity_mps: outputs.block_velocity_mps,
            coupling_force_n: outputs.coupling_force_n,
            command_force_n: outputs.force_n,
            ..*row
        }))
    }

    /// Whether the force may depend on a sampling period that the servo does not know to the last bit.
    fn is_period_unknown(&self) -> bool {
        let Device {
            samples,
            elapsed_ns,
            silent_ns,
            clock_known,
            ..
        } = self.device;
        if clock_known || silent_ns == 0 {
            return false;
        }
        #[expect(clippy::cast_precision_loss, reason = "nanoseconds of a session")]
        let (elapsed_s, silent_s) = (elapsed_ns as f64 * 1e-9, silent_ns as f64 * 1e-9);
        let period_s = (elapsed_s / f64::from(samples.max(1))).max(self.setup.settings.period_s);
        silent_s > SILENT_PERIODS * period_s
    }
}

impl Device {
    fn take(&mut self, row: &Sample, is_error: bool) {
        if is_error {
            // The servo forgets the device, and learns its clock anew.
            *self = Self {
                clock_known: true,
                ..Self::default()
            };
            return;
        }
        self.elapsed_ns = self.elapsed_ns.saturating_add(row.elapsed_ns);
        self.is_fresh = self.sequence.replace(row.device_sequence) != Some(row.device_sequence);
        if self.is_fresh {
            self.silent_ns = 0;
            self.samples = self.samples.saturating_add(1);
        } else {
            self.silent_ns = self.silent_ns.saturating_add(row.elapsed_ns);
        }
    }
}

/// The inputs of a row that are not measured numbers.
pub(super) fn word(row: &Sample) -> InputWord {
    InputWord {
        flags: row.input_flags,
        detail: row.error_detail,
    }
}

/// Lets force flow in a servo that has just begun, along a straight motion that leads to the row's
/// sample: the nearest that there is to a force whose beginning was not recorded.
fn engage(servo: &mut Servo, inputs: &Inputs, row: &Sample) {
    let Ok(there) = inputs.sample else { return };
    let settings = *servo.settings();
    let step_s = settings.period_s;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a ramp of seconds, in ticks"
    )]
    let (steps, step_ns) = ((settings.ramp_s / step_s).ceil() as u32 + 2, (step_s * 1e9) as u64);
    for left in (0..steps).rev() {
        let mut sample = there;
        sample.sequence = there.sequence.wrapping_sub(left);
        // The clock counts up from wherever it begins.
        sample.time_ns = there.time_ns.wrapping_sub(u64::from(left) * step_ns);
        sample.position_m = row.device_position_m - f64::from(left) * step_s * row.device_velocity_mps;
        servo.step(
            &Inputs {
                elapsed_ns: step_ns,
                sample: Ok(sample),
                command: (left == steps - 2).then_some(Command::Engage),
                ..*inputs
            },
            None,
        );
    }
    if row.state == RigState::Releasing {
        let command = Some(Command::Release);
        servo.step(&Inputs { command, ..*inputs }, None);
    }
}

/// Whether two rows hold the same outputs, to the last bit.
pub(super) fn is_same(one: &Sample, other: &Sample) -> bool {
    let numbers = |row: &Sample| {
        [
            row.device_position_m,
            row.device_velocity_mps,
            row.block_position_m,
            row.block_velocity_mps,
            row.coupling_force_n,
            row.command_force_n,
        ]
        .map(f64::to_bits)
    };
    one.state == other.state && one.contact == other.contact && numbers(one) == numbers(other)
}
