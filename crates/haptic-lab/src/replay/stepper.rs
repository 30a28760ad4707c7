//! A servo that is stepped through a recording's rows, wherever its state is known.

use super::columns::{is_same, is_same_velocity};
use super::error::{ReplayError, SkipReason};
use super::scenes::{Alternative, IncomingScene, Scenes};
use super::without_snapshot::after_row;
use crate::row::{RecordedRow, with_outputs};
use haptic_core::Vector;
use haptic_core::planar::Plane;
use haptic_core::sample::Motor;
use haptic_core::servo::{CompiledScene, Inputs, Servo, VERSION};
use haptic_core::velocity::Method;
use haptic_ipc::{Sample, ServoSetup, ServoSnapshot, SnapshotScene};
use haptic_recording::{Mark, Metadata};
use std::fmt::Debug;

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
    Computed(RecordedRow),
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

/// A servo on a line or in the plane, stepped through rows.
pub(super) trait Stepping: Debug + Send {
    /// The scenes so far.
    fn scenes(&self) -> &Scenes;

    /// One that knows what holds here, and not the servo's state.
    fn begin_anew(&self) -> Box<dyn Stepping>;

    /// Takes a mark.
    ///
    /// # Errors
    /// A scene cannot be rendered, or no servo goes on from a snapshot.
    fn mark(&mut self, mark: &Mark) -> Result<(), ReplayError>;

    /// Takes what a mark says of scenes and settings.
    fn follow(&mut self, mark: &Mark);

    /// Steps through a row.
    ///
    /// # Errors
    /// A scene cannot be rendered.
    fn row(&mut self, row: &RecordedRow) -> Result<StepResult, ReplayError>;

    /// The servo's state before a tick, where it is known.
    fn snapshot(&mut self, tick: u64) -> Option<Mark>;
}

/// A stepper for a recording, that gives what was recorded, or renders something else.
///
/// # Errors
/// The recording cannot be replayed.
pub(super) fn stepper(metadata: &Metadata, alternative: Option<Alternative>) -> Result<Box<dyn Stepping>, ReplayError> {
    Ok(match metadata.axes {
        2 => Box::new(Stepper::<Plane>::new(metadata, alternative)?),
        _ => Box::new(Stepper::<f64>::new(metadata, alternative)?),
    })
}

/// A servo of one of the two.
#[derive(Debug)]
struct Stepper<V: Vector> {
    setup: ServoSetup,
    scenes: Scenes,
    servo: Option<Servo<V>>,
    phase: Phase,
    /// Whether the servo goes on from a snapshot, and knows all that the recorded one knew.
    is_certain: bool,
    /// A scene that takes the place of the recorded one in the next step.
    next_scene: Option<Box<CompiledScene<V>>>,
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

impl<V: Vector> Stepping for Stepper<V> {
    fn scenes(&self) -> &Scenes {
        &self.scenes
    }

    fn begin_anew(&self) -> Box<dyn Stepping> {
        Box::new(Self {
            setup: self.setup.clone(),
            scenes: self.scenes.clone(),
            servo: None,
            next_scene: None,
            phase: Phase::Waiting(SkipReason::BeganWithForce),
            is_certain: false,
            ..*self
        })
    }

    fn mark(&mut self, mark: &Mark) -> Result<(), ReplayError> {
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

    fn follow(&mut self, mark: &Mark) {
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

    fn row(&mut self, row: &RecordedRow) -> Result<StepResult, ReplayError> {
        let Sample { tick, elapsed_ns, .. } = row.sample;
        if self.last_tick.is_some_and(|last| tick != last.wrapping_add(1)) {
            self.wait(SkipReason::RowsLost);
        }
        self.last_tick = Some(tick);
        let inputs = self.inputs(row);
        let sequence = inputs.sample.as_ref().ok().map(|sample| sample.sequence);
        self.is_fresh = sequence.is_some() && self.sequence != sequence;
        self.sequence = sequence;
        self.doubt_ns = if self.is_fresh {
            self.doubt_ns.saturating_sub(elapsed_ns)
        } else {
            DOUBT_NS
        };
        if row.sample.input_word().is_motion() {
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
        let is_in_doubt = self.doubt_ns > 0 || !is_same_velocity(row, &computed);
        if self.is_exact && !self.is_certain && !is_same(row, &computed) && is_in_doubt {
            self.wait(SkipReason::NoSnapshot);
            return Ok(StepResult::Unknown(SkipReason::NoSnapshot));
        }
        Ok(StepResult::Computed(computed))
    }

    fn snapshot(&mut self, tick: u64) -> Option<Mark> {
        let snapshot = self.servo.as_mut()?.snapshot()?;
        let snapshot = ServoSnapshot::of(&snapshot, |revision| self.scenes.arrival(revision).cloned())?;
        let snapshot = Box::new(snapshot);
        Some(Mark::Snapshot { tick, snapshot })
    }
}

impl<V: Vector> Stepper<V> {
    fn new(metadata: &Metadata, alternative: Option<Alternative>) -> Result<Self, ReplayError> {
        let Metadata {
            rate_hz, loop_rate_hz, ..
        } = *metadata;
        if rate_hz < loop_rate_hz * (1.0 - RATE_TOLERANCE) {
            return Err(ReplayError::Refused(format!(
                "the recording holds {rate_hz} of {loop_rate_hz} ticks a second: a force follows from every tick before it, \
                 so only a recording of every tick can be replayed (record without --rate)"
            )));
        }
        let setup = metadata.servo.clone().ok_or_else(|| {
            ReplayError::Refused(format!(
                "the recording does not hold the servo's settings ({} did not record them), so its forces cannot be \
                 recomputed",
                metadata.server
            ))
        })?;
        if alternative.is_none() && setup.version != VERSION {
            return Err(ReplayError::Refused(format!(
                "the recording was made by version {} of the servo, and this is version {VERSION}: the rules of its limits \
                 and of doubtful positions are others, so its forces cannot be given again to the last bit; they can be \
                 rendered with --scene, --set or --scheme",
                setup.version
            )));
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

    /// Goes on from a snapshot.
    fn restore(&mut self, tick: u64, snapshot: &ServoSnapshot) -> Result<(), ReplayError> {
        if !snapshot.is_of_this_version() {
            return Ok(());
        }
        let compiled = |scene: &SnapshotScene| self.scenes.recorded(scene.revision, &scene.arrival);
        let fading = snapshot.fading.as_ref().map(compiled).transpose()?;
        let find = |name: &str| snapshot.fields.get(name).copied();
        let servo = Servo::<V>::restored(self.setup.settings, compiled(&snapshot.scene)?, fading, &find);
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

    /// Goes on with other settings.
    fn set_up(&mut self, servo: &ServoSetup) {
        self.setup = servo.clone();
        let settings = &self.setup.settings;
        if let Some(servo) = &mut self.servo {
            servo.set_rig(settings.losses, settings.compensation);
            servo.set_limits(settings.limits);
        }
    }

    /// Counts a row towards the end of settling.
    fn settle(
        &mut self,
        row: &RecordedRow,
        inputs: &Inputs<V>,
        computed: &RecordedRow,
    ) -> Result<StepResult, ReplayError> {
        let state = row.sample.state;
        let Phase::Settling { same, samples } = &mut self.phase else {
            return Ok(StepResult::Computed(*computed));
        };
        *samples += u32::from(self.is_fresh);
        // A device that repeats a sample, or a motor that must be off, may bring a fault by a time that
        // began before the servo did.
        let is_conclusive = match inputs.sample {
            Ok(sample) => *samples > 0 && (sample.motor != Motor::Enabled || state.is_live()),
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
        } else if state.is_live() {
            self.wait(SkipReason::ForceTooSoon);
            return Ok(StepResult::Unknown(SkipReason::ForceTooSoon));
        } else if computed.sample.state != state {
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
    fn begin(&mut self, row: &RecordedRow, why: SkipReason) -> Result<StepResult, ReplayError> {
        self.wait(why);
        if row.sample.state.is_live() && self.is_exact {
            return Ok(StepResult::Unknown(why));
        }
        let Some(scene) = self.scenes.active(row.sample.revision)? else {
            return Ok(StepResult::Unknown(SkipReason::UnknownScene));
        };
        self.servo = Some(after_row(self.setup.settings, scene, row, self.inputs(row)));
        self.phase = if self.is_exact {
            Phase::Settling { same: 0, samples: 0 }
        } else {
            Phase::Settled
        };
        Ok(StepResult::Unknown(SkipReason::Settling))
    }

    fn inputs(&self, row: &RecordedRow) -> Inputs<V> {
        let (word, sample) = (row.sample.input_word(), &row.sample);
        Inputs {
            elapsed_ns: sample.elapsed_ns,
            sample: word.sample(sample.device_sequence, sample.device_time_ns, row.sample_position()),
            device_resolution_m: self.setup.device_resolution_m,
            device_force_limit_n: self.setup.device_force_limit_n.unwrap_or(f64::INFINITY),
            events: word.events(),
            command: word.command(),
        }
    }

    /// The row as the servo computes it; `None` where the scene is not known.
    fn step(&mut self, row: &RecordedRow, inputs: &Inputs<V>) -> Result<Option<RecordedRow>, ReplayError> {
        let word = row.sample.input_word();
        let scene = if word.new_scene() {
            match self.scenes.incoming(row.sample.revision)? {
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
        Ok(Some(with_outputs(row.sample, row.sample_position(), servo, &outputs)))
    }
}
