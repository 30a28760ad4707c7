//! The words to an ODrive, tick by tick.
//!
//! While its motor is on, every tick sends `c` (the torque, which also feeds the axis watchdog) and
//! `f` (the question for the position). One more question at a time asks for the axis's state, its
//! errors or the board's. Arming writes the settings on which forces rely, and reads each of them
//! back before the axis may close its loop: no torque without the watchdog. While the motor is off,
//! only `f` is sent, and from time to time a question whether the axis is really off.

use super::conversation::{Axis, Motor, is_due};
use super::generation::Generation;
use super::text::{Text, number};
use super::words::{self, Answer, Damage};
use device_io::DeviceError;
use device_io::link::{LinkError, add};
use device_io::protocol::message::{ErrorCode, ErrorReport};

/// Axis states of the documentation.
const IDLE: f64 = 1.0;
const CLOSED_LOOP: f64 = 8.0;

/// Time without a command after which the axis disarms its motor, ms.
pub(super) const WATCHDOG_MS: u32 = 50;

/// The settings on which forces rely: torque control, torque without a ramp or a filter, and the
/// watchdog, s.
const SETTINGS: [(&str, f64); 4] = [
    ("controller.config.control_mode", 1.0),
    ("controller.config.input_mode", 1.0),
    ("config.watchdog_timeout", WATCHDOG_MS as f64 * 1e-3),
    ("config.enable_watchdog", 1.0),
];

/// Time between two questions for state and errors, while the motor is on and while it is off, ns.
pub(super) const ASK_ON_NS: u64 = 16_000_000;
const ASK_OFF_NS: u64 = 50_000_000;

/// Longest wait for an answer to one of those, ns. Answers have no names: after a lost answer
/// nothing is asked for as long, so that a late answer is not taken for another.
const ANSWER_NS: u64 = 40_000_000;

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "32 bits; a value beyond them saturates, which is an error, too"
)]
fn bits_of(value: f64) -> u32 {
    value as u32
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Question {
    State,
    AxisError,
    /// The error of the board rather than the axis: supply and brake resistor.
    BoardError,
    Setting,
}

/// The protocol of one axis.
#[derive(Debug)]
pub(crate) struct ODriveDialect {
    /// Number of the axis.
    axis: u8,
    generation: &'static Generation,
    /// Steps of arming that are done: the errors are cleared, then each of the settings is written.
    armed_steps: usize,
    /// Since then the axis's state says that a motor that should be on is off, and the axis is
    /// asked why, ns.
    doubted_at_ns: Option<u64>,
    /// The axis has reported no error since its state was doubted.
    axis_is_well: bool,
    asked: Option<(Question, u64)>,
    next_question: Question,
    /// Nothing may be asked before, ns: an answer may still be under way.
    quiet_until_ns: u64,
    /// The motor is off, so its watchdog must be switched off as well.
    watchdog_is_over: bool,
    /// The newest errors.
    axis_errors: u32,
    board_errors: u32,
}

impl ODriveDialect {
    pub(super) fn new(axis: u8, generation: &'static Generation) -> Self {
        Self {
            axis,
            generation,
            armed_steps: 0,
            doubted_at_ns: None,
            axis_is_well: false,
            asked: None,
            next_question: Question::State,
            quiet_until_ns: 0,
            watchdog_is_over: false,
            axis_errors: 0,
            board_errors: 0,
        }
    }

    /// The setting that is being written.
    fn setting(&self) -> Option<&'static (&'static str, f64)> {
        SETTINGS.get(self.armed_steps.checked_sub(1)?)
    }

    /// Whether all settings are written, so that the axis may close its loop.
    fn is_set_up(&self) -> bool {
        self.armed_steps > SETTINGS.len()
    }

    fn take_value(&mut self, value: &[u8], axis: &mut Axis, now_ns: u64) {
        let Some((question, asked_at_ns)) = self.asked.take() else {
            add(&axis.counters().out_of_sequence, 1);
            return;
        };
        axis.feedback.answered_until(asked_at_ns);
        let truth = value.eq_ignore_ascii_case(b"true").then_some(1.0);
        match (question, number(value).or(truth)) {
            (Question::State, Some(state)) => self.take_state(state, asked_at_ns, axis, now_ns),
            (Question::AxisError, Some(bits)) => self.take_axis_errors(bits_of(bits), axis, now_ns),
            (Question::BoardError, Some(bits)) => self.take_board_errors(bits_of(bits), axis, now_ns),
            (Question::Setting, value) => {
                if let Motor::Arming { sent_at_ns, .. } = &mut axis.motor
                    && let Some((_, wanted)) = self.setting()
                    && value.is_some_and(|value| (value - wanted).abs() < 1e-4)
                {
                    self.armed_steps += 1;
                    *sent_at_ns = None;
                }
            }
            (_, None) => add(&axis.counters().malformed, 1),
        }
    }

    fn take_state(&mut self, state: f64, asked_at_ns: u64, axis: &mut Axis, now_ns: u64) {
        match &mut axis.motor {
            // A person may calibrate it; nobody but us closes its loop.
            Motor::Off {
                since_ns, confirmed, ..
            } => {
                // A question from before the command says nothing of what came of it.
                let is_off = state != CLOSED_LOOP && asked_at_ns >= *since_ns;
                self.watchdog_is_over |= is_off && !*confirmed;
                *confirmed = is_off;
            }
            Motor::Arming { .. } if self.is_set_up() && state == CLOSED_LOOP => axis.motor = Motor::On,
            Motor::On if state != CLOSED_LOOP => {
                if self.doubted_at_ns.is_none() {
                    self.doubted_at_ns = Some(now_ns);
                    self.axis_is_well = false;
                }
                self.ask_next(Question::AxisError, axis);
            }
            _ => {}
        }
    }

    fn take_axis_errors(&mut self, bits: u32, axis: &mut Axis, now_ns: u64) {
        let is_sensor = bits & self.generation.encoder_bit != 0;
        let report = ErrorReport {
            code: if is_sensor { ErrorCode::Sensor } else { ErrorCode::Motor },
            detail: bits,
        };
        if bits != 0 && bits != self.axis_errors {
            note(report, axis, now_ns);
        }
        self.axis_errors = bits;
        let error = match bits {
            0 => DeviceError::MotorOff { watchdog: false },
            bits if bits & self.generation.watchdog_bit != 0 => DeviceError::MotorOff { watchdog: true },
            _ => DeviceError::Failed(report),
        };
        let is_doubted = self.doubted_at_ns.is_some();
        match axis.motor {
            // The board may know more.
            Motor::On if is_doubted && bits == 0 && self.generation.board_errors.is_some() => {
                self.axis_is_well = true;
                self.ask_next(Question::BoardError, axis);
            }
            Motor::On if is_doubted || bits != 0 => axis.motor = Motor::Failed(error),
            Motor::Arming { .. } if bits != 0 && self.is_set_up() => axis.motor = Motor::Failed(error),
            _ => {}
        }
    }

    fn take_board_errors(&mut self, bits: u32, axis: &mut Axis, now_ns: u64) {
        let report = ErrorReport {
            code: ErrorCode::Other,
            detail: bits,
        };
        if bits != 0 && bits != self.board_errors {
            note(report, axis, now_ns);
        }
        self.board_errors = bits;
        let error = DeviceError::Failed(report);
        match axis.motor {
            Motor::On if bits != 0 => axis.motor = Motor::Failed(error),
            Motor::On if self.doubted_at_ns.is_some() && self.axis_is_well => {
                axis.motor = Motor::Failed(DeviceError::MotorOff { watchdog: false });
            }
            Motor::On if self.doubted_at_ns.is_some() => self.ask_next(Question::AxisError, axis),
            Motor::Arming { .. } if bits != 0 && self.is_set_up() => axis.motor = Motor::Failed(error),
            _ => {}
        }
    }

    /// Asks this as soon as it may.
    pub(super) fn ask_next(&mut self, question: Question, axis: &mut Axis) {
        self.next_question = question;
        axis.ask_after_ns = 0;
    }

    /// Asks one more question, where no other is under way.
    pub(super) fn ask(&mut self, question: Question, axis: &Axis, now_ns: u64, out: &mut Text) {
        if let Some((_, at_ns)) = self.asked {
            if now_ns.saturating_sub(at_ns) <= ANSWER_NS {
                return;
            }
            add(&axis.counters().lost, 1);
            self.asked = None;
            self.quiet_until_ns = now_ns + ANSWER_NS;
        }
        if now_ns < axis.ask_after_ns.max(self.quiet_until_ns) {
            return;
        }
        let number = self.axis;
        let property = match question {
            Question::State => Some("current_state"),
            Question::AxisError if matches!(axis.motor, Motor::Off { .. }) => Some(self.generation.present_errors),
            Question::AxisError => Some(self.generation.disarming_errors),
            Question::BoardError => None,
            Question::Setting => self.setting().map(|(property, _)| *property),
        };
        let asked = match (property, self.generation.board_errors) {
            (Some(property), _) => words::write(out, format_args!("r axis{number}.{property}")),
            (None, Some(property)) if question == Question::BoardError => {
                words::write(out, format_args!("r {property}"))
            }
            (None, _) => false,
        };
        if asked {
            self.asked = Some((question, now_ns));
        }
    }

    /// Asks for state and errors in turn.
    pub(super) fn watch(&mut self, every_ns: u64, axis: &mut Axis, now_ns: u64, out: &mut Text) {
        let was_free = self.asked.is_none();
        let question = self.next_question;
        self.ask(question, axis, now_ns, out);
        if was_free && self.asked.is_some() {
            self.next_question = match question {
                Question::State => Question::AxisError,
                Question::AxisError if self.generation.board_errors.is_some() => Question::BoardError,
                _ => Question::State,
            };
            axis.ask_after_ns = now_ns + every_ns;
        }
    }
}

/// Counts an error of the device, and keeps it for people.
fn note(report: ErrorReport, axis: &Axis, now_ns: u64) {
    add(&axis.counters().device_errors, 1);
    axis.counters().note_error(LinkError::Device(report), now_ns);
}

/// What a conversation asks of it.
impl ODriveDialect {
    /// Interprets a line of the controller, without its end.
    pub(super) fn receive(&mut self, line: &[u8], axis: &mut Axis, now_ns: u64) {
        match words::read(line) {
            Ok(Answer::Feedback(turns, _)) => axis.feedback.take(turns, now_ns),
            Ok(Answer::Value(value)) => self.take_value(value, axis, now_ns),
            Ok(Answer::Refused) => {
                add(&axis.counters().device_errors, 1);
                self.asked = None;
            }
            Err(Damage::Checksum) => add(&axis.counters().bad_crc, 1),
            Err(Damage::Words) => add(&axis.counters().malformed, 1),
        }
    }

    /// An error of the position sensor, whatever the motor does.
    pub(super) fn sensor_error(&self) -> Option<DeviceError> {
        (self.axis_errors & self.generation.encoder_bit != 0).then_some(DeviceError::Failed(ErrorReport {
            code: ErrorCode::Sensor,
            detail: self.axis_errors,
        }))
    }

    /// Whether the controller has contradicted for too long that its motor is on.
    pub(super) fn is_contradicted(&self, now_ns: u64) -> bool {
        self.doubted_at_ns
            .is_some_and(|since_ns| now_ns.saturating_sub(since_ns) > ANSWER_NS)
    }

    /// Writes the question for the position; whether there was room for it.
    pub(super) fn ask_position(&self, out: &mut Text) -> bool {
        words::write(out, format_args!("f {}", self.axis))
    }

    /// Writes a torque, Nm.
    pub(super) fn drive(&self, target: f64, out: &mut Text) {
        let torque_nm = if self.doubted_at_ns.is_some() { 0.0 } else { target };
        words::write(out, format_args!("c {} {torque_nm:.5}", self.axis));
    }

    /// Writes the commands that switch the motor off.
    pub(super) fn switch_off(&self, out: &mut Text) {
        let axis = self.axis;
        words::write(out, format_args!("c {axis} 0"));
        words::write(out, format_args!("w axis{axis}.requested_state {IDLE}"));
    }

    /// Asks from time to time whether the motor is still off.
    pub(super) fn watch_off(&mut self, axis: &mut Axis, now_ns: u64, out: &mut Text) {
        if self.watchdog_is_over {
            // Nobody feeds it any more, and it would leave an error behind. Not before the motor is
            // known to be off.
            let command = format_args!("w axis{}.config.enable_watchdog 0", self.axis);
            self.watchdog_is_over = !words::write(out, command);
        }
        self.watch(ASK_OFF_NS, axis, now_ns, out);
    }

    /// Force is wanted, for the first time since the motor was off.
    pub(super) fn begin_arming(&mut self) {
        self.armed_steps = 0;
        self.doubted_at_ns = None;
    }

    /// One step towards a motor that is on.
    pub(super) fn arm(&mut self, axis: &mut Axis, now_ns: u64, out: &mut Text) {
        let Motor::Arming { since_ns, sent_at_ns } = axis.motor else {
            return;
        };
        let sent_now = Motor::Arming {
            since_ns,
            sent_at_ns: Some(now_ns),
        };
        let number = self.axis;
        // Zero torque feeds the watchdog meanwhile.
        words::write(out, format_args!("c {number} 0"));
        if self.armed_steps == 0 {
            // Errors from before no longer count: a person has asked for force.
            words::write(out, format_args!("sc"));
            self.armed_steps = 1;
            axis.ask_after_ns = 0;
        } else if let Some((property, value)) = self.setting() {
            if is_due(sent_at_ns, now_ns) && self.asked.is_none() {
                axis.motor = sent_now;
                words::write(out, format_args!("w axis{number}.{property} {value}"));
            }
            self.ask(Question::Setting, axis, now_ns, out);
        } else {
            if sent_at_ns.is_none() {
                axis.motor = sent_now;
                words::write(out, format_args!("w axis{number}.requested_state {CLOSED_LOOP}"));
            }
            self.watch(0, axis, now_ns, out);
        }
    }
}
