//! A row of a recording from a servo's step, as the daemon would have written it.

use haptic_core::sample::Measurement;
use haptic_core::servo::{InputWord, Inputs, Outputs, Servo};
use haptic_ipc::Sample;

/// The row with what the step gave.
pub(crate) fn with_outputs(row: Sample, servo: &Servo, outputs: &Outputs) -> Sample {
    Sample {
        state: servo.state(),
        contact: outputs.contact,
        device_position_m: outputs.device_position_m,
        device_velocity_mps: outputs.device_velocity_mps,
        block_position_m: outputs.block_position_m,
        block_velocity_mps: outputs.block_velocity_mps,
        coupling_force_n: outputs.coupling_force_n,
        command_force_n: outputs.force_n,
        ..row
    }
}

/// The row of a step, with what it was computed from. The tick's own times are left out: nothing was timed.
pub fn of_step(tick: u64, t_s: f64, inputs: &Inputs, word: InputWord, servo: &Servo, outputs: &Outputs) -> Sample {
    let sample = inputs.sample.unwrap_or(Measurement::new(0, 0, 0.0));
    let row = Sample {
        tick,
        t_s,
        revision: servo.scene().revision,
        elapsed_ns: inputs.elapsed_ns,
        device_sequence: sample.sequence,
        device_time_ns: sample.time_ns,
        sample_position_m: sample.position_m,
        input_flags: word.flags,
        error_detail: word.detail,
        ..Sample::default()
    };
    with_outputs(row, servo, outputs)
}
