//! A servo that is stepped through a recording's rows, wherever its state is known.

use super::error::{ReplayError, SkipReason};
use super::scenes::{Alternative, IncomingScene, Scenes};
use crate::row::with_outputs;
use haptic_core::sample::{DeviceError, Motor};
use haptic_core::servo::{Command, CompiledScene, Event, Events, InputWord, Inputs, Servo, VERSION};
use haptic_core::velocity::Method;
use haptic_ipc::{RigState, Sample, ServoSetup, ServoSnapshot, SnapshotScene};
use haptic_recording::{Mark, Metadata, RecordingError};

/// Ticks in a row with the recorded numbers after which a servo that began without force is known to
/// be in the recorded one's state.
pub const SETTLED_TICKS: u32 = 32;

/// Samples that no estimate of velocity remembers: after these a servo that began without force is in
/// the recorded one's state, or is another servo.
pub const MAX_MEMORY_SAMPLES: u32 = 1000;

/// Time for which the force may depend on how long the device was silent, and so on its exact period, ns: it comes
/// back within 50 ms.
const DOUBT_NS: u64 = 60_000_000;

/// Share by which the rate of the rows may lie below the loop's before ticks are missing.
const RATE_TOLERANCE: f64 = 1e-6;

/// What a step through a row gives.
#[derive(Clone, Copy, Debug)]
pub(super) enum StepResult {
    /// The row with the outputs that were computed.
    Computed(Sample),
    /// No outputs follow.
    Unknown(SkipReason),
}

#[derive(Debug)]
enum Phase {
    /// Until the rig is without force.
    Waiting(SkipReason),
    /// The servo runs along, and does not count yet.
    Settling {
        /// Ticks in a row with the recorded numbers.
        same: u32,
        /// New samples.
        samples: u32,
    },
    Settled,
}

/// A servo, stepped through rows.
#[derive(Debug)]
pub(super) struct Stepper {
    setup: ServoSetup,
    scenes: Scenes,
    servo: Option<Servo>,
    phase: Phase,
    /// Whether the servo goes on from a snapshot, and knows all that the recorded one knew.
    is_certain: bool,
    /// A scene that takes the place of the recorded one in the next step.
    next_scene: Option<Box<CompiledScene>>,
    /// Number of the device's newest sample.
    sequence: Option<u32>,
    /// Whether the newest row has a new sample.
    is_fresh: bool,
    /// For how long yet the device's exact period may matter, ns.
    doubt_ns: u64,
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
        if metadata.axes != 1 {
            return Err(RecordingError::TwoAxes.into());
        }
        let Metadata {
            rate_hz, loop_rate_hz, ..
        } = *metadata;
        if rate_hz < loop_rate_hz * (1.0 - RATE_TOLERANCE) {
            return Err(ReplayError::Thinned { rate_hz, loop_rate_hz });
        }
        let setup = metadata.servo.clone().ok_or_else(|| ReplayError::NoServo {
            server: metadata.server.clone(),
        })?;
        if alternative.is_none() && setup.version != VERSION {
            return Err(ReplayError::OtherVersion {
                recorded: setup.version,
            });
        }
        Ok(Self {
            is_exact: alternative.is_none(),
            scenes: Scenes::new(metadata, &setup, alternative),
            setup,
            servo: None,
            phase: Phase::Waiting(SkipReason::BeganWithForce),
            is_certain: false,
            next_scene: None,
            sequence: None,
            is_fresh: false,
            doubt_ns: 0,
            last_tick: None,
        })
    }

    /// The scenes so far.
    pub(super) fn scenes(&self) -> &Scenes {
        &self.scenes
    }

    /// One that knows what holds here, and not the servo's state.
    pub(super) fn begin_anew(&self) -> Self {
        Self {
            setup: self.setup.clone(),
            scenes: self.scenes.clone(),
            servo: None,
            next_scene: None,
            phase: Phase::Waiting(SkipReason::BeganWithForce),
            is_certain: false,
            ..*self
        }
    }

    /// Takes a mark.
    ///
    /// # Errors
    /// A scene cannot be rendered, or no servo goes on from a snapshot.
    pub(super) fn mark(&mut self, mark: &Mark) -> Result<(), ReplayError> {
        self.follow(mark);
        match mark {
            Mark::Lost { .. } | Mark::LostChanges { .. } => self.wait(SkipReason::RowsLost),
            Mark::Snapshot { tick, snapshot } if self.is_exact || self.servo.is_none() => {
                self.restore(*tick, snapshot)?;
            }
            _ => {}
        }
        Ok(())
    }

    /// Takes what a mark says of scenes and settings.
    pub(super) fn follow(&mut self, mark: &Mark) {
        match mark {
            Mark::Scene {
                revision,
                arrival: Some(arrival),
                ..
            } => self.scenes.add(*revision, arrival),
            Mark::Servo { servo, .. } => self.set_up(servo),
            Mark::Snapshot { snapshot, .. } => self.scenes.add(snapshot.scene.revision, &snapshot.scene.arrival),
            _ => {}
        }
    }

    /// Goes on from a snapshot.
    fn restore(&mut self, tick: u64, snapshot: &ServoSnapshot) -> Result<(), ReplayError> {
        if !snapshot.is_of_this_version() {
            return Ok(());
        }
        let compiled = |scene: &SnapshotScene| self.scenes.recorded(scene.revision, &scene.arrival);
        let fading = snapshot.fading.as_ref().map(compiled).transpose()?;
        let find = |name: &str| snapshot.fields.get(name).copied();
        let servo = Servo::restored(self.setup.settings, compiled(&snapshot.scene)?, fading, &find);
        let mut servo = servo.map_err(|error| ReplayError::Snapshot { tick, error })?;
        // Without force it has the settings of the next engagement, and not yet those of the recording.
        servo.set_rig(self.setup.settings.losses, self.setup.settings.compensation);
        if self
            .scenes
            .is_otherwise(snapshot.scene.revision, &snapshot.scene.arrival.scene)?
        {
            self.next_scene = self.scenes.active(snapshot.scene.revision)?;
        }
        self.servo = Some(servo);
        self.phase = Phase::Settled;
        self.is_certain = true;
        self.last_tick = Some(tick.wrapping_sub(1));
        Ok(())
    }

    /// The servo's state before a tick, where it is known.
    pub(super) fn snapshot(&mut self, tick: u64) -> Option<Mark> {
        let snapshot = self.servo.as_mut()?.snapshot()?;
        let snapshot = ServoSnapshot::of(&snapshot, |revision| self.scenes.arrival(revision).cloned())?;
        let snapshot = Box::new(snapshot);
        Some(Mark::Snapshot { tick, snapshot })
    }

    /// Goes on with other settings.
    fn set_up(&mut self, servo: &ServoSetup) {
        self.setup = servo.clone();
        let settings = &self.setup.settings;
        if let Some(servo) = &mut self.servo {
            servo.set_rig(settings.losses, settings.compensation);
            servo.set_limits(settings.limits);
        }
    }

    /// Steps through a row.
    ///
    /// # Errors
    /// A scene cannot be rendered.
    pub(super) fn row(&mut self, row: &Sample) -> Result<StepResult, ReplayError> {
        if self.last_tick.is_some_and(|last| row.tick != last.wrapping_add(1)) {
            self.wait(SkipReason::RowsLost);
        }
        self.last_tick = Some(row.tick);
        let inputs = self.inputs(row);
        let sequence = inputs.sample.as_ref().ok().map(|sample| sample.sequence);
        self.is_fresh = sequence.is_some() && self.sequence != sequence;
        self.sequence = sequence;
        self.doubt_ns = if self.is_fresh {
            self.doubt_ns.saturating_sub(row.elapsed_ns)
        } else {
            DOUBT_NS
        };
        if word(row).is_motion() {
            self.wait(SkipReason::UnknownScene);
            return Ok(StepResult::Unknown(SkipReason::UnknownScene));
        }
        if let Phase::Waiting(why) = self.phase {
            return self.begin(row, why);
        }
        let Some(computed) = self.step(row, &inputs)? else {
            return self.begin(row, SkipReason::UnknownScene);
        };
        if !matches!(self.phase, Phase::Settled) {
            return self.settle(row, &inputs, &computed);
        }
        // Without a snapshot the clock of the device is known from the recording's first row on only.
        let is_timed_otherwise = row.device_velocity_mps.to_bits() != computed.device_velocity_mps.to_bits();
        if self.is_exact && !self.is_certain && !is_same(row, &computed) && (is_timed_otherwise || self.doubt_ns > 0) {
            self.wait(SkipReason::NoSnapshot);
            return Ok(StepResult::Unknown(SkipReason::NoSnapshot));
        }
        Ok(StepResult::Computed(computed))
    }

    /// Counts a row towards the end of settling.
    fn settle(&mut self, row: &Sample, inputs: &Inputs, computed: &Sample) -> Result<StepResult, ReplayError> {
        let Phase::Settling { same, samples } = &mut self.phase else {
            return Ok(StepResult::Computed(*computed));
        };
        *samples += u32::from(self.is_fresh);
        // A device that repeats a sample, or a motor that must be off, may bring a fault by a time that
        // began before the servo did.
        let is_conclusive = match inputs.sample {
            Ok(sample) => *samples > 0 && (sample.motor != Motor::Enabled || row.state.is_live()),
            Err(_) => true,
        };
        *same = if is_conclusive && is_same(row, computed) {
            *same + 1
        } else {
            0
        };
        let samples = *samples;
        // A tracker forgets where it began, but not to the last bit.
        let forgets = self.setup.settings.velocity != Method::AlphaBetaGamma;
        if *same >= SETTLED_TICKS || (forgets && samples >= MAX_MEMORY_SAMPLES) {
            self.phase = Phase::Settled;
        } else if row.state.is_live() {
            self.wait(SkipReason::ForceTooSoon);
            return Ok(StepResult::Unknown(SkipReason::ForceTooSoon));
        } else if computed.state != row.state {
            self.begin(row, SkipReason::Settling)?;
            self.phase = Phase::Settling { same: 0, samples };
        }
        Ok(StepResult::Unknown(SkipReason::Settling))
    }

    /// Goes on only once the rig is without force.
    fn wait(&mut self, why: SkipReason) {
        self.servo = None;
        self.is_certain = false;
        self.next_scene = None;
        self.phase = Phase::Waiting(why);
    }

    /// Begins after a row, if the rig is without force there; a what-if begins with force, too.
    fn begin(&mut self, row: &Sample, why: SkipReason) -> Result<StepResult, ReplayError> {
        self.wait(why);
        if row.state.is_live() && self.is_exact {
            return Ok(StepResult::Unknown(why));
        }
        let Some(scene) = self.scenes.active(row.revision)? else {
            return Ok(StepResult::Unknown(SkipReason::UnknownScene));
        };
        let mut servo = Servo::new(self.setup.settings, scene);
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
        self.servo = Some(servo);
        self.phase = if self.is_exact {
            Phase::Settling { same: 0, samples: 0 }
        } else {
            Phase::Settled
        };
        Ok(StepResult::Unknown(SkipReason::Settling))
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
    fn step(&mut self, row: &Sample, inputs: &Inputs) -> Result<Option<Sample>, ReplayError> {
        let word = word(row);
        let scene = if word.new_scene() {
            match self.scenes.incoming(row.revision)? {
                IncomingScene::Compiled(scene) => Some(scene),
                IncomingScene::Unchanged => None,
                IncomingScene::Unknown => return Ok(None),
            }
        } else {
            self.next_scene.take()
        };
        let Some(servo) = &mut self.servo else {
            return Ok(None);
        };
        let outputs = servo.step(inputs, scene);
        while servo.take_retired().is_some() {}
        if word.write_failed() {
            servo.disconnect();
        }
        Ok(Some(with_outputs(*row, servo, &outputs)))
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
