//! The words to a SimpleFOC board, tick by tick. While its motor is on, every tick sends the target
//! and `MMG6` (the question for the position), and from time to time `ME` (the question whether the
//! motor is enabled). While the motor is off, only the questions are sent.

use super::words::{self, Answer, LONGEST_COMMAND};
use crate::axis::{Axis, Motor, is_due};
use crate::dialect::Dialect;
use crate::text::Text;
use device_io::DeviceError;
use device_io::link::add;
use std::fmt::{self, Write as _};

/// Time between two questions whether the motor is enabled, while it should be and while it should
/// not be, ns.
const ASK_ON_NS: u64 = 16_000_000;
const ASK_OFF_NS: u64 = 50_000_000;

/// The protocol of one motor.
#[derive(Debug)]
pub(crate) struct SimpleFocDialect {
    letter: u8,
    /// Largest target, A or V.
    target_limit: f64,
    /// Since the last arming the motor has said that it controls torque, and nothing else.
    controls_torque: bool,
    /// Time of the newest question without an answer whether it is enabled, ns.
    asked_at_ns: Option<u64>,
}

impl SimpleFocDialect {
    pub(super) fn new(letter: u8, target_limit: f64) -> Self {
        Self {
            letter,
            target_limit,
            controls_torque: false,
            asked_at_ns: None,
        }
    }

    /// Writes a command to the motor, whole or not at all.
    fn send(&self, out: &mut Text, command: fmt::Arguments<'_>) -> bool {
        let letter = char::from(self.letter);
        out.whole(|out| {
            let before = out.as_bytes().len();
            writeln!(out, "{letter}{command}")?;
            if out.since(before).len() > LONGEST_COMMAND {
                return Err(fmt::Error);
            }
            Ok(())
        })
    }

    /// Asks from time to time whether the motor is enabled.
    fn watch(&mut self, every_ns: u64, axis: &mut Axis, now_ns: u64, out: &mut Text) {
        if now_ns >= axis.ask_after_ns && self.send(out, format_args!("E")) {
            axis.ask_after_ns = now_ns + every_ns;
            self.asked_at_ns = Some(now_ns);
        }
    }

    fn take_enabled(&mut self, enabled: bool, axis: &mut Axis) {
        if let Some(asked_at_ns) = self.asked_at_ns.take() {
            axis.feedback.answered_until(asked_at_ns);
        }
        match (&mut axis.motor, enabled) {
            (Motor::Arming { .. }, true) if self.controls_torque => axis.motor = Motor::On,
            (Motor::On, false) => axis.motor = Motor::Failed(DeviceError::MotorOff { watchdog: false }),
            (Motor::Off { confirmed, told_at_ns }, enabled) => *confirmed = !enabled && told_at_ns.is_some(),
            _ => {}
        }
    }
}

impl Dialect for SimpleFocDialect {
    const ASK_OVERDUE_NS: u64 = 2_000_000;

    fn receive(&mut self, line: &[u8], axis: &mut Axis, now_ns: u64) {
        match words::read(line, self.letter) {
            Some(Answer::Angle(rad)) => axis.feedback.take(rad, now_ns),
            Some(Answer::Target(target)) => {
                // It has understood another number than ours; the next tick corrects it.
                if target.abs() > self.target_limit * 1.000_001 + 1e-5 {
                    add(&axis.counters().malformed, 1);
                }
            }
            Some(Answer::Enabled(enabled)) => self.take_enabled(enabled, axis),
            Some(Answer::Control(kind)) => self.controls_torque = kind == b"torque",
            Some(Answer::Refused) => add(&axis.counters().device_errors, 1),
            Some(Answer::Torque(_) | Answer::VoltageLimit(_) | Answer::Resistance(_)) => {}
            None => add(&axis.counters().malformed, 1),
        }
    }

    fn ask_position(&self, out: &mut Text) -> bool {
        self.send(out, format_args!("MG6"))
    }

    fn drive(&self, target: f64, out: &mut Text) {
        self.send(out, format_args!("{target:.5}"));
    }

    fn watch_on(&mut self, axis: &mut Axis, now_ns: u64, out: &mut Text) {
        self.watch(ASK_ON_NS, axis, now_ns, out);
    }

    fn switch_off(&self, out: &mut Text) {
        self.send(out, format_args!("0"));
        self.send(out, format_args!("E0"));
    }

    fn watch_off(&mut self, axis: &mut Axis, now_ns: u64, out: &mut Text) {
        self.watch(ASK_OFF_NS, axis, now_ns, out);
    }

    fn begin_arming(&mut self) {
        self.controls_torque = false;
    }

    fn arm(&mut self, axis: &mut Axis, now_ns: u64, out: &mut Text) {
        if let Motor::Arming { told_at_ns, .. } = &mut axis.motor
            && is_due(*told_at_ns, now_ns)
        {
            *told_at_ns = Some(now_ns);
            // A target means an angle or a speed until the motor controls torque.
            self.send(out, format_args!("C0"));
            self.send(out, format_args!("0"));
            self.send(out, format_args!("E1"));
        }
    }
}
