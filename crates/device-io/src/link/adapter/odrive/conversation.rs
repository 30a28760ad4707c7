//! What is said to an ODrive, tick by tick.
//!
//! Enabled, every tick says `c` (the torque, which also feeds the axis watchdog) and `f` (where are you?). One more question at a time asks for the axis's state, its error or the board's. Arming
//! writes the settings that forces rely on and reads each of them back before the axis may close its loop: no torque without the watchdog. Not enabled, only `f` is said, and the axis
//! is asked now and then whether it really is off.

use super::super::super::health::{LinkCounters, LinkError, add};
use super::super::feedback::{Feedback, drive};
use super::super::options::ODriveOptions;
use super::super::text::{Text, TooLong, number};
use super::super::{ARMING_NS, Conversation, TELL_AGAIN_NS, Telling};
use super::words::{self, Answer, Damage};
use crate::device::{DeviceError, Measurement};
use crate::protocol::message::{ErrorCode, ErrorReport};
use std::sync::Arc;

/// Axis states of the documentation.
const IDLE: f64 = 1.0;
const CLOSED_LOOP: f64 = 8.0;

/// The axis disarms its motor after so long without a command, ms.
pub(super) const WATCHDOG_MS: u32 = 50;

/// What forces rely on: torque control, torque as it is told and not ramped or filtered, and the watchdog, s.
const SETTINGS: [(&str, f64); 4] = [
    ("controller.config.control_mode", 1.0),
    ("controller.config.input_mode", 1.0),
    ("config.watchdog_timeout", WATCHDOG_MS as f64 * 1e-3),
    ("config.enable_watchdog", 1.0),
];

/// Between two questions after state and error while the motor is on, and while it is off, ns.
const ASK_ON_NS: u64 = 16_000_000;
const ASK_OFF_NS: u64 = 50_000_000;

/// For an answer to one of those, ns. Answers have no names: after a lost one nothing is asked for as long, so that a late one is not taken for another.
const ANSWER_NS: u64 = 40_000_000;

/// Firmware that says the same in different words.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Generation {
    /// ODrive 3.x with firmware 0.5.4 to 0.5.6.
    Half,
    /// ODrive S1, Pro and later with firmware 0.6.
    Six,
}

impl Generation {
    /// The property that says what is wrong now, and the one that says what has switched the motor off.
    pub(super) fn errors(self) -> (&'static str, &'static str) {
        match self {
            Self::Half => ("error", "error"),
            Self::Six => ("active_errors", "disarm_reason"),
        }
    }

    /// Where it limits torque, and with which sign.
    pub(super) fn torque_limits(self) -> &'static [(&'static str, f64)] {
        match self {
            Self::Half => &[("motor.config.torque_lim", 1.0)],
            Self::Six => &[("config.torque_soft_max", 1.0), ("config.torque_soft_min", -1.0)],
        }
    }

    /// The property that says what is wrong with the board as a whole, where that is not in the axis's error.
    pub(super) fn board_error(self) -> Option<&'static str> {
        match self {
            Self::Half => Some("error"),
            Self::Six => None,
        }
    }

    /// The bits of the watchdog and of the encoder.
    fn bits(self) -> (u32, u32) {
        match self {
            Self::Half => (0x800, 0x100),
            Self::Six => (0x0100_0000, 0x8),
        }
    }
}

#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "32 bits; what is none saturates, which is an error, too"
)]
fn bits_of(value: f64) -> u32 {
    value as u32
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Question {
    State,
    Error,
    /// What is wrong with the board rather than the axis: supply and brake resistor. Firmware 0.6 has no such thing apart.
    BoardError,
    Setting,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Motor {
    /// Told to be off at a time of ours, ns, and whether it is.
    Off { told_at_ns: Option<u64>, settled: bool },
    /// Since a time, ns: which step, and when that was last told.
    Arming {
        since_ns: u64,
        step: usize,
        told_at_ns: Option<u64>,
    },
    /// On; where its state says otherwise since a time, ns, it is asked why.
    On { doubted_at_ns: Option<u64> },
    /// Off though it should be on, until it is no longer wanted.
    Failed(DeviceError),
}

/// A conversation with one axis.
#[derive(Debug)]
pub(super) struct ODriveConversation {
    feedback: Feedback,
    axis: u8,
    generation: Generation,
    resolution_m: f64,
    newtons_per_nm: f64,
    torque_limit_nm: f64,
    motor: Motor,
    asked: Option<(Question, u64)>,
    /// Nothing needs to be asked before, ns.
    ask_after_ns: u64,
    /// Nothing may be asked before, ns: an answer may still be under way.
    quiet_until_ns: u64,
    next_question: Question,
    /// The axis has said that nothing is wrong with it since its state was doubted.
    axis_is_well: bool,
    encoder_failed: bool,
    /// The motor is off, and its watchdog is to be switched off as well.
    watchdog_is_over: bool,
    /// What its error was when it was last asked for.
    error_bits: u32,
    board_error_bits: u32,
}

impl ODriveConversation {
    /// Begins at a first position, turns, with so many counts to a turn where they are known and a largest torque, Nm.
    #[expect(
        clippy::too_many_arguments,
        reason = "each is of another kind, and it is called once"
    )]
    pub(super) fn new(
        options: &ODriveOptions,
        generation: Generation,
        counts_per_turn: Option<f64>,
        torque_limit_nm: f64,
        first_turns: f64,
        period_ns: u64,
        now_ns: u64,
        counters: Arc<LinkCounters>,
    ) -> Self {
        let metres_per_turn = options.motor.metres_per_turn();
        Self {
            feedback: Feedback::new(first_turns, metres_per_turn, period_ns, now_ns, counters),
            axis: options.axis,
            generation,
            // The answer has six decimals.
            resolution_m: metres_per_turn.abs() * counts_per_turn.map_or(1e-6, |counts| 1.0 / counts),
            newtons_per_nm: options.motor.newtons_per_nm(),
            torque_limit_nm,
            motor: Motor::Off {
                told_at_ns: None,
                settled: false,
            },
            asked: None,
            ask_after_ns: 0,
            quiet_until_ns: 0,
            next_question: Question::State,
            axis_is_well: false,
            encoder_failed: false,
            watchdog_is_over: false,
            error_bits: 0,
            board_error_bits: 0,
        }
    }

    fn counters(&self) -> &LinkCounters {
        self.feedback.counters()
    }

    fn take_value(&mut self, value: &[u8], now_ns: u64) {
        let Some((question, asked_at_ns)) = self.asked.take() else {
            add(&self.counters().out_of_sequence, 1);
            return;
        };
        self.feedback.answered_until(asked_at_ns);
        let truth = value.eq_ignore_ascii_case(b"true").then_some(1.0);
        match (question, number(value).or(truth)) {
            (Question::State, Some(state)) => self.take_state(state, now_ns),
            (Question::Error, Some(bits)) => self.take_error(bits, now_ns),
            (Question::BoardError, Some(bits)) => self.take_board_error(bits, now_ns),
            (Question::Setting, value) => {
                if let Motor::Arming { step, told_at_ns, .. } = &mut self.motor
                    && let Some((_, wanted)) = step.checked_sub(1).and_then(|index| SETTINGS.get(index))
                    && value.is_some_and(|value| (value - wanted).abs() < 1e-4)
                {
                    *step += 1;
                    *told_at_ns = None;
                }
            }
            (_, None) => add(&self.counters().malformed, 1),
        }
    }

    fn take_state(&mut self, state: f64, now_ns: u64) {
        match &mut self.motor {
            // A person may calibrate it; nobody but us closes its loop.
            Motor::Off { settled, .. } => {
                let is_off = state != CLOSED_LOOP;
                self.watchdog_is_over |= is_off && !*settled;
                *settled = is_off;
            }
            Motor::Arming { step, .. } if *step > SETTINGS.len() && state == CLOSED_LOOP => {
                self.motor = Motor::On { doubted_at_ns: None };
            }
            Motor::On { doubted_at_ns } if state != CLOSED_LOOP => {
                if doubted_at_ns.is_none() {
                    *doubted_at_ns = Some(now_ns);
                    self.axis_is_well = false;
                }
                self.next_question = Question::Error;
                self.ask_after_ns = 0;
            }
            _ => {}
        }
    }

    fn take_error(&mut self, bits: f64, now_ns: u64) {
        let bits = bits_of(bits);
        let (watchdog, encoder) = self.generation.bits();
        let report = ErrorReport {
            code: if bits & encoder == 0 {
                ErrorCode::Motor
            } else {
                ErrorCode::Sensor
            },
            detail: bits,
        };
        if bits != 0 && bits != self.error_bits {
            self.note(report, now_ns);
        }
        self.error_bits = bits;
        self.encoder_failed = bits & encoder != 0;
        let failed = match bits {
            0 => DeviceError::MotorOff { watchdog: false },
            bits if bits & watchdog != 0 => DeviceError::MotorOff { watchdog: true },
            _ => DeviceError::Failed(report),
        };
        match self.motor {
            // The board may know more.
            Motor::On { doubted_at_ns: Some(_) } if bits == 0 && self.generation.board_error().is_some() => {
                self.axis_is_well = true;
                self.next_question = Question::BoardError;
                self.ask_after_ns = 0;
            }
            Motor::On { doubted_at_ns } if bits != 0 || doubted_at_ns.is_some() => self.motor = Motor::Failed(failed),
            Motor::Arming { step, .. } if bits != 0 && step > SETTINGS.len() => self.motor = Motor::Failed(failed),
            _ => {}
        }
    }

    fn take_board_error(&mut self, bits: f64, now_ns: u64) {
        let bits = bits_of(bits);
        let report = ErrorReport {
            code: ErrorCode::Other,
            detail: bits,
        };
        if bits != 0 && bits != self.board_error_bits {
            self.note(report, now_ns);
        }
        self.board_error_bits = bits;
        match self.motor {
            Motor::On { .. } if bits != 0 => self.motor = Motor::Failed(DeviceError::Failed(report)),
            Motor::On { doubted_at_ns: Some(_) } if self.axis_is_well => {
                self.motor = Motor::Failed(DeviceError::MotorOff { watchdog: false });
            }
            Motor::On { doubted_at_ns: Some(_) } => {
                self.next_question = Question::Error;
                self.ask_after_ns = 0;
            }
            Motor::Arming { step, .. } if bits != 0 && step > SETTINGS.len() => {
                self.motor = Motor::Failed(DeviceError::Failed(report));
            }
            _ => {}
        }
    }

    fn note(&self, report: ErrorReport, now_ns: u64) {
        add(&self.counters().device_errors, 1);
        self.counters().note_error(LinkError::Device(report), now_ns);
    }

    /// Asks one question more, if none is under way.
    fn ask(&mut self, question: Question, now_ns: u64, out: &mut Text) {
        if let Some((_, at_ns)) = self.asked {
            if now_ns.saturating_sub(at_ns) <= ANSWER_NS {
                return;
            }
            add(&self.feedback.counters().lost, 1);
            self.asked = None;
            self.quiet_until_ns = now_ns + ANSWER_NS;
        }
        if now_ns < self.ask_after_ns.max(self.quiet_until_ns) {
            return;
        }
        let axis = self.axis;
        let (now_wrong, switched_off) = self.generation.errors();
        let asked = match (question, self.motor) {
            (Question::State, _) => words::write(out, format_args!("r axis{axis}.current_state")),
            (Question::Error, Motor::Off { .. }) => words::write(out, format_args!("r axis{axis}.{now_wrong}")),
            (Question::Error, _) => words::write(out, format_args!("r axis{axis}.{switched_off}")),
            (Question::BoardError, _) => self
                .generation
                .board_error()
                .is_some_and(|property| words::write(out, format_args!("r {property}"))),
            (Question::Setting, Motor::Arming { step, .. }) => step
                .checked_sub(1)
                .and_then(|index| SETTINGS.get(index))
                .is_some_and(|(property, _)| words::write(out, format_args!("r axis{axis}.{property}"))),
            (Question::Setting, _) => false,
        };
        if asked {
            self.asked = Some((question, now_ns));
        }
    }

    /// Asks after state and errors in turn.
    fn look_after(&mut self, every_ns: u64, now_ns: u64, out: &mut Text) {
        let free = self.asked.is_none();
        let question = self.next_question;
        self.ask(question, now_ns, out);
        if free && self.asked.is_some() {
            self.next_question = match question {
                Question::State => Question::Error,
                Question::Error if self.generation.board_error().is_some() => Question::BoardError,
                _ => Question::State,
            };
            self.ask_after_ns = now_ns + every_ns;
        }
    }

    fn switch_off(&self, out: &mut Text) {
        let axis = self.axis;
        words::write(out, format_args!("c {axis} 0"));
        words::write(out, format_args!("w axis{axis}.requested_state {IDLE}"));
    }

    fn stay_off(&mut self, now_ns: u64, out: &mut Text) -> Telling {
        let Motor::Off { told_at_ns, settled } = &mut self.motor else {
            self.motor = Motor::Off {
                told_at_ns: Some(now_ns),
                settled: false,
            };
            self.ask_after_ns = 0;
            self.next_question = Question::State;
            self.switch_off(out);
            return Telling::Now;
        };
        if *settled {
            if self.watchdog_is_over {
                // It is not fed any more, and would leave an error behind. Not before the motor is known to be off.
                let axis = self.axis;
                self.watchdog_is_over = !words::write(out, format_args!("w axis{axis}.config.enable_watchdog 0"));
            }
            self.look_after(ASK_OFF_NS, now_ns, out);
            return Telling::Answered;
        }
        let tell = told_at_ns.is_none_or(|at_ns| now_ns.saturating_sub(at_ns) >= TELL_AGAIN_NS);
        if tell {
            *told_at_ns = Some(now_ns);
            self.switch_off(out);
        }
        self.ask(Question::State, now_ns, out);
        if tell { Telling::Now } else { Telling::Before }
    }

    /// One step of arming; zero torque feeds the watchdog meanwhile.
    fn arm(&mut self, now_ns: u64, out: &mut Text) {
        let Motor::Arming {
            since_ns,
            step,
            told_at_ns,
        } = &mut self.motor
        else {
            return;
        };
        if now_ns.saturating_sub(*since_ns) > ARMING_NS {
            self.motor = Motor::Failed(DeviceError::MotorOff { watchdog: false });
            self.switch_off(out);
            return;
        }
        let axis = self.axis;
        if *step == 0 {
            // What was wrong before is history: a person has asked for force.
            words::write(out, format_args!("sc"));
            *step = 1;
            self.ask_after_ns = 0;
            return;
        }
        let tell = told_at_ns.is_none_or(|at_ns| now_ns.saturating_sub(at_ns) >= TELL_AGAIN_NS);
        if let Some((property, value)) = SETTINGS.get(*step - 1) {
            if tell && self.asked.is_none() {
                *told_at_ns = Some(now_ns);
                words::write(out, format_args!("w axis{axis}.{property} {value}"));
            }
            self.ask(Question::Setting, now_ns, out);
        } else {
            if told_at_ns.is_none() {
                *told_at_ns = Some(now_ns);
                words::write(out, format_args!("w axis{axis}.requested_state {CLOSED_LOOP}"));
            }
            self.look_after(0, now_ns, out);
        }
    }
}

impl Conversation for ODriveConversation {
    fn take(&mut self, line: Result<&[u8], TooLong>, now_ns: u64) {
        let Ok(line) = line else {
            add(&self.counters().malformed, 1);
            return;
        };
        match words::read(line) {
            Ok(Answer::Feedback(turns, _)) => self.feedback.take(turns, now_ns),
            Ok(Answer::Value(value)) => self.take_value(value, now_ns),
            Ok(Answer::Refused) => {
                add(&self.counters().device_errors, 1);
                self.asked = None;
            }
            Err(Damage::Checksum) => add(&self.counters().bad_crc, 1),
            Err(Damage::Words) => add(&self.counters().malformed, 1),
        }
    }

    fn measurement(&mut self, now_ns: u64) -> Result<Option<Measurement>, DeviceError> {
        let sample = self.feedback.measurement(now_ns)?;
        match self.motor {
            Motor::Failed(error) => Err(error),
            _ if self.encoder_failed => Err(DeviceError::Failed(ErrorReport {
                code: ErrorCode::Sensor,
                detail: self.error_bits,
            })),
            _ => Ok(Some(sample)),
        }
    }

    fn command(&mut self, force_n: f64, enabled: bool, now_ns: u64, out: &mut Text) -> Telling {
        let axis = self.axis;
        let mut telling = Telling::NotYet;
        if !enabled {
            telling = self.stay_off(now_ns, out);
        } else if let Motor::Off { .. } = self.motor {
            self.motor = Motor::Arming {
                since_ns: now_ns,
                step: 0,
                told_at_ns: None,
            };
        }
        if let Motor::On {
            doubted_at_ns: Some(since_ns),
        } = self.motor
            && now_ns.saturating_sub(since_ns) > ANSWER_NS
        {
            self.motor = Motor::Failed(DeviceError::MotorOff { watchdog: false });
            self.switch_off(out);
        }
        let room = self.feedback.may_ask(now_ns);
        if !room && enabled {
            add(&self.counters().not_sent, 1);
        }
        if self.feedback.is_overdue(now_ns) {
            self.ask_after_ns = 0;
        }
        match self.motor {
            Motor::On { doubted_at_ns } => {
                if room {
                    telling = Telling::Now;
                    let counters = self.feedback.counters();
                    let torque_nm = drive(force_n, self.newtons_per_nm, self.torque_limit_nm, counters);
                    let torque_nm = if doubted_at_ns.is_some() { 0.0 } else { torque_nm };
                    words::write(out, format_args!("c {axis} {torque_nm:.5}"));
                }
                self.look_after(ASK_ON_NS, now_ns, out);
            }
            Motor::Arming { .. } if room => {
                words::write(out, format_args!("c {axis} 0"));
                self.arm(now_ns, out);
            }
            Motor::Arming { .. } | Motor::Off { .. } | Motor::Failed(_) => {}
        }
        if room && words::write(out, format_args!("f {axis}")) {
            self.feedback.ask(now_ns);
        }
        telling
    }

    fn farewell(&self, out: &mut Text) {
        self.switch_off(out);
    }

    fn resolution_m(&self) -> f64 {
        self.resolution_m
    }
}
