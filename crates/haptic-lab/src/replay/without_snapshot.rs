//! A servo that begins after a row without a snapshot of the recorded one.

use crate::row::RecordedRow;
use haptic_core::Vector;
use haptic_core::sample::DeviceError;
use haptic_core::servo::{Command, CompiledScene, Event, Events, Inputs, Servo, Settings};
use haptic_ipc::RigState;

/// A servo whose rig has the state that a row has, with the inputs of that row.
pub(super) fn after_row<V: Vector>(
    settings: Settings,
    scene: Box<CompiledScene<V>>,
    row: &RecordedRow,
    inputs: Inputs<V>,
) -> Servo<V> {
    let mut servo = Servo::new(settings, scene);
    // What happened and what was asked for has had its effect in the row's state.
    let quiet = Inputs {
        events: Events::default(),
        command: None,
        ..inputs
    };
    let state = row.sample.state;
    match state {
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
    if row.sample.input_word().write_failed() || state == RigState::Disconnected {
        servo.disconnect();
    }
    servo
}

/// Lets force flow in a servo that has just begun, along a straight motion that leads to the row's
/// sample: the nearest that there is to a force whose beginning was not recorded.
fn engage<V: Vector>(servo: &mut Servo<V>, inputs: &Inputs<V>, row: &RecordedRow) {
    let Ok(there) = inputs.sample else { return };
    let settings = *servo.settings();
    let step_s = settings.period_s;
    #[expect(clippy::cast_sign_loss, reason = "a ramp of seconds, in ticks")]
    let (steps, step_ns) = ((settings.ramp_s / step_s).ceil() as u32 + 2, (step_s * 1e9) as u64);
    for left in (0..steps).rev() {
        let mut sample = there;
        sample.sequence = there.sequence.wrapping_sub(left);
        // The clock counts up from wherever it begins.
        sample.time_ns = there.time_ns.wrapping_sub(u64::from(left) * step_ns);
        sample.position_m = row.device_position::<V>() - row.device_velocity::<V>() * (f64::from(left) * step_s);
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
    if row.sample.state == RigState::Releasing {
        let command = Some(Command::Release);
        servo.step(&Inputs { command, ..*inputs }, None);
    }
}
