//! A row of a recording from a servo's step, as the daemon would have written it.

use haptic_core::Vector;
use haptic_core::sample::Measurement;
use haptic_core::servo::{InputWord, Inputs, Outputs, Servo};
use haptic_ipc::{Sample, SampleY};

/// A row of a rig of one axis or of two.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct RecordedRow {
    /// The row, whose vectors have their parts along the first axis here.
    pub sample: Sample,
    /// The parts along the second axis; `None` of a rig of one.
    pub y: Option<SampleY>,
}

impl RecordedRow {
    /// Position as the device reported it, m.
    pub(crate) fn sample_position<V: Vector>(&self) -> V {
        self.vector(|x| x.sample_position_m, |y| y.sample_position_m)
    }

    /// Position of the device, m.
    pub(crate) fn device_position<V: Vector>(&self) -> V {
        self.vector(|x| x.device_position_m, |y| y.device_position_m)
    }

    /// Velocity of the device, m/s.
    pub(crate) fn device_velocity<V: Vector>(&self) -> V {
        self.vector(|x| x.device_velocity_mps, |y| y.device_velocity_mps)
    }

    /// Force on the hand, N.
    pub(crate) fn command_force<V: Vector>(&self) -> V {
        self.vector(|x| x.command_force_n, |y| y.command_force_n)
    }

    fn vector<V: Vector>(&self, x: impl Fn(&Sample) -> f64, y: impl Fn(&SampleY) -> f64) -> V {
        V::of_axes(x(&self.sample), self.y.as_ref().map_or(0.0, y))
    }
}

/// The row of a sample, whose device reported this position (m), with what the step gave.
pub(crate) fn with_outputs<V: Vector>(
    sample: Sample,
    sample_position: V,
    servo: &Servo<V>,
    outputs: &Outputs<V>,
) -> RecordedRow {
    RecordedRow {
        sample: Sample {
            state: servo.state(),
            contact: outputs.contact,
            device_position_m: outputs.device_position_m.first(),
            device_velocity_mps: outputs.device_velocity_mps.first(),
            block_position_m: outputs.block_position_m.first(),
            block_velocity_mps: outputs.block_velocity_mps.first(),
            coupling_force_n: outputs.coupling_force_n.first(),
            command_force_n: outputs.force_n.first(),
            ..sample
        },
        y: SampleY::of_step(outputs, sample_position),
    }
}

/// The row of a step, with what it was computed from. The tick's own times are left out: nothing was timed.
pub fn of_step<V: Vector>(
    tick: u64,
    t_s: f64,
    inputs: &Inputs<V>,
    word: InputWord,
    servo: &Servo<V>,
    outputs: &Outputs<V>,
) -> RecordedRow {
    let measured = inputs.sample.unwrap_or(Measurement::new(0, 0, V::ZERO));
    let sample = Sample {
        tick,
        t_s,
        revision: servo.scene().revision,
        elapsed_ns: inputs.elapsed_ns,
        device_sequence: measured.sequence,
        device_time_ns: measured.time_ns,
        sample_position_m: measured.position_m.first(),
        input_flags: word.flags,
        error_detail: word.detail,
        ..Sample::default()
    };
    with_outputs(sample, measured.position_m, servo, outputs)
}
