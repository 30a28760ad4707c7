//! What is said to a SimpleFOC board, tick by tick: enabled, the target and `MMG6` (where are you?), and now and then `ME` (are you enabled?); otherwise only the questions.

use super::super::super::health::add;
use super::super::feedback::{Feedback, drive};
use super::super::options::SimpleFocOptions;
use super::super::text::{Text, TooLong};
use super::super::{ARMING_NS, Conversation, TELL_AGAIN_NS, Telling};
use super::words::{self, Answer, LONGEST_COMMAND};
use crate::device::{DeviceError, Measurement};
use crate::link::health::LinkCounters;
use std::f64::consts::TAU;
use std::fmt::{self, Write as _};
use std::sync::Arc;

/// Between two questions whether the motor is enabled, while it should be and while it should not, ns.
const ASK_ON_NS: u64 = 16_000_000;
const ASK_OFF_NS: u64 = 50_000_000;
/// And while answers are overdue, ns.
const ASK_OVERDUE_NS: u64 = 2_000_000;

#[derive(Clone, Copy, Debug, PartialEq)]
enum Motor {
    /// Told to be off at a time of ours, ns, and whether it is.
    Off {
        told_at_ns: Option<u64>,
        settled: bool,
    },
    /// Since a time, ns, and when it was last told.
    Arming {
        since_ns: u64,
        told_at_ns: Option<u64>,
        /// It controls torque, and nothing else.
        torque: bool,
    },
    On,
    /// Off though it should be on, until it is no longer wanted.
    Failed(DeviceError),
}

/// A conversation with one motor.
#[derive(Debug)]
pub(super) struct SimpleFocConversation {
    feedback: Feedback,
    letter: u8,
    resolution_m: f64,
    newtons_per_unit: f64,
    limit_units: f64,
    motor: Motor,
    ask_after_ns: u64,
    /// When it was last asked whether it is enabled, while there is no answer, ns.
    asked_at_ns: Option<u64>,
}

impl SimpleFocConversation {
    /// Begins at a first angle, rad, with such a limit of the target, A or V.
    pub(super) fn new(
        options: &SimpleFocOptions,
        limit_units: f64,
        first_rad: f64,
        period_ns: u64,
        now_ns: u64,
        counters: Arc<LinkCounters>,
    ) -> Self {
        let metres_per_rad = options.motor.metres_per_turn() / TAU;
        Self {
            feedback: Feedback::new(first_rad, metres_per_rad, period_ns, now_ns, counters),
            letter: u8::try_from(options.letter).unwrap_or(b'M'),
            // The answer has six decimals.
            resolution_m: metres_per_rad.abs() * 1e-6,
            newtons_per_unit: options.nm_per_unit * options.motor.newtons_per_nm(),
            limit_units,
            motor: Motor::Off {
                told_at_ns: None,
                settled: false,
            },
            ask_after_ns: 0,
            asked_at_ns: None,
        }
    }

    fn counters(&self) -> &LinkCounters {
        self.feedback.counters()
    }

    fn say(&self, out: &mut Text, command: fmt::Arguments<'_>) -> bool {
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

    fn switch_off(&self, out: &mut Text) {
        self.say(out, format_args!("0"));
        self.say(out, format_args!("E0"));
    }

    fn ask_enabled(&mut self, every_ns: u64, now_ns: u64, out: &mut Text) {
        if now_ns >= self.ask_after_ns && self.say(out, format_args!("E")) {
            self.ask_after_ns = now_ns + every_ns;
            self.asked_at_ns = Some(now_ns);
        }
    }

    fn stay_off(&mut self, now_ns: u64, out: &mut Text) -> Telling {
        let (told_at_ns, settled) = match self.motor {
            Motor::Off { told_at_ns, settled } => (told_at_ns, settled),
            _ => (None, false),
        };
        let tell = !settled && told_at_ns.is_none_or(|at_ns| now_ns.saturating_sub(at_ns) >= TELL_AGAIN_NS);
        self.motor = Motor::Off {
            told_at_ns: if tell { Some(now_ns) } else { told_at_ns },
            settled,
        };
        if tell {
            self.switch_off(out);
            return Telling::Now;
        }
        if !settled {
            return Telling::Before;
        }
        self.ask_enabled(ASK_OFF_NS, now_ns, out);
        Telling::Answered
    }

    fn arm(&mut self, now_ns: u64, out: &mut Text) {
        let Motor::Arming {
            since_ns, told_at_ns, ..
        } = &mut self.motor
        else {
            return;
        };
        if now_ns.saturating_sub(*since_ns) > ARMING_NS {
            self.motor = Motor::Failed(DeviceError::MotorOff { watchdog: false });
            self.switch_off(out);
        } else if told_at_ns.is_none_or(|at_ns| now_ns.saturating_sub(at_ns) >= TELL_AGAIN_NS) {
            *told_at_ns = Some(now_ns);
            // A target means an angle or a speed until it controls torque.
            self.say(out, format_args!("C0"));
            self.say(out, format_args!("0"));
            self.say(out, format_args!("E1"));
        }
    }
}

impl Conversation for SimpleFocConversation {
    fn take(&mut self, line: Result<&[u8], TooLong>, now_ns: u64) {
        let answer = line.ok().and_then(|line| words::read(line, self.letter));
        if matches!(answer, Some(Answer::Enabled(_)))
            && let Some(asked_at_ns) = self.asked_at_ns.take()
        {
            self.feedback.answered_until(asked_at_ns);
        }
        match (answer, &mut self.motor) {
            (Some(Answer::Angle(rad)), _) => self.feedback.take(rad, now_ns),
            (Some(Answer::Target(target)), _) => {
                // It has understood another number than ours; the next tick mends it.
                if target.abs() > self.limit_units * 1.000_001 + 1e-5 {
                    add(&self.counters().malformed, 1);
                }
            }
            (Some(Answer::Control(kind)), Motor::Arming { torque, .. }) => *torque = kind == b"torque",
            (Some(Answer::Enabled(true)), Motor::Arming { torque: true, .. }) => self.motor = Motor::On,
            (Some(Answer::Enabled(false)), Motor::On) => {
                self.motor = Motor::Failed(DeviceError::MotorOff { watchdog: false });
            }
            (Some(Answer::Enabled(enabled)), Motor::Off { settled, told_at_ns }) => {
                *settled = !enabled && told_at_ns.is_some();
            }
            (Some(Answer::Refused), _) => add(&self.counters().device_errors, 1),
            (Some(_), _) => {}
            (None, _) => add(&self.counters().malformed, 1),
        }
    }

    fn measurement(&mut self, now_ns: u64) -> Result<Option<Measurement>, DeviceError> {
        let sample = self.feedback.measurement(now_ns)?;
        match self.motor {
            Motor::Failed(error) => Err(error),
            _ => Ok(Some(sample)),
        }
    }

    fn command(&mut self, force_n: f64, enabled: bool, now_ns: u64, out: &mut Text) -> Telling {
        let mut telling = Telling::NotYet;
        if !enabled {
            telling = self.stay_off(now_ns, out);
        } else if let Motor::Off { .. } = self.motor {
            self.motor = Motor::Arming {
                since_ns: now_ns,
                told_at_ns: None,
                torque: false,
            };
        }
        let room = self.feedback.may_ask(now_ns);
        if !room && enabled {
            add(&self.counters().not_sent, 1);
        }
        if self.feedback.is_overdue(now_ns) {
            self.ask_after_ns = self.ask_after_ns.min(now_ns + ASK_OVERDUE_NS);
        }
        match self.motor {
            Motor::On => {
                if room {
                    telling = Telling::Now;
                    let target = drive(force_n, self.newtons_per_unit, self.limit_units, self.counters());
                    self.say(out, format_args!("{target:.5}"));
                }
                self.ask_enabled(ASK_ON_NS, now_ns, out);
            }
            Motor::Arming { .. } if room => self.arm(now_ns, out),
            _ => {}
        }
        if room && self.say(out, format_args!("MG6")) {
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
