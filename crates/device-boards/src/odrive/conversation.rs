//! The conversation with a controller, tick by tick: it asks for positions, switches the motor on and off, and watches
//! that the motor stays so.

use super::dialect::{ASK_ON_NS, ODriveDialect, Question};
use super::feedback::{Feedback, target};
use super::text::{Text, TooLong};
use device_io::link::{LinkCounters, add};
use device_io::{DeviceError, Measurement, Motor as ReportedMotor};
use std::sync::Arc;

/// Longest time from the first command to a motor that is on, ns.
const ARMING_NS: u64 = 300_000_000;

/// Progress of a command's force, or of the switching off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum CommandState {
    /// Not sent: the controller is slow, or not ready for forces.
    NotSent,
    /// In the text that is sent now.
    InThisText,
    /// Sent before. Only the switching off is not sent again in every tick.
    SentBefore,
    /// The controller has answered that its motor is off.
    Confirmed,
}

/// The controller's units, and its limits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Scale {
    /// First position of the shaft, in the controller's unit of angle.
    pub(crate) first_angle: f64,
    /// Way of the handle to one unit of angle, m, with its sign.
    pub(crate) metres_per_angle: f64,
    /// Distance between two positions that the controller can distinguish, m.
    pub(crate) resolution_m: f64,
    /// Force on the handle to one unit of the target, N, with its sign.
    pub(crate) newtons_per_target: f64,
    /// Largest target, in its unit.
    pub(crate) target_limit: f64,
}

impl Scale {
    /// Largest force on the handle, N.
    pub(crate) fn force_limit_n(&self) -> f64 {
        self.target_limit * self.newtons_per_target.abs()
    }
}

/// Shortest time between two sets of commands to a controller that does not obey, ns.
const SEND_AGAIN_NS: u64 = 10_000_000;

/// State of the motor, as far as both sides know.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Motor {
    /// To be off since a time of ours, ns; the newest command for that was sent at `sent_at_ns`.
    Off {
        since_ns: u64,
        sent_at_ns: Option<u64>,
        /// The controller has answered a later question: it is.
        confirmed: bool,
    },
    /// Commanded to be on since a time of ours, ns; the newest command for that was sent at
    /// `sent_at_ns`.
    Arming { since_ns: u64, sent_at_ns: Option<u64> },
    /// On.
    On,
    /// Off though force is wanted. This lasts until no force is wanted.
    Failed(DeviceError),
}

/// Whether it is time to send a command once more, after it was sent at `sent_at_ns`.
pub(crate) fn is_due(sent_at_ns: Option<u64>, now_ns: u64) -> bool {
    sent_at_ns.is_none_or(|at_ns| now_ns.saturating_sub(at_ns) >= SEND_AGAIN_NS)
}

/// One motor, and the positions of its shaft.
#[derive(Debug)]
pub(crate) struct Axis {
    pub(crate) feedback: Feedback,
    pub(crate) motor: Motor,
    /// No question about the motor is due before this time, ns.
    pub(crate) ask_after_ns: u64,
}

impl Axis {
    /// An axis whose motor has got no command yet.
    pub(crate) fn new(feedback: Feedback) -> Self {
        Self {
            feedback,
            motor: Motor::Off {
                since_ns: 0,
                sent_at_ns: None,
                confirmed: false,
            },
            ask_after_ns: 0,
        }
    }

    /// The motor, as far as the controller has reported: one that is not known to be off counts as enabled.
    pub(crate) fn reported(&self) -> ReportedMotor {
        match self.motor {
            Motor::Off { confirmed: true, .. } => ReportedMotor::Off,
            _ => ReportedMotor::Enabled,
        }
    }

    /// The counters of the link.
    pub(crate) fn counters(&self) -> &LinkCounters {
        self.feedback.counters()
    }
}

/// A conversation with one motor of a controller. It knows nothing of serial lines, and waits for
/// nothing.
#[derive(Debug)]
pub(crate) struct Conversation {
    dialect: ODriveDialect,
    axis: Axis,
    scale: Scale,
}

impl Conversation {
    /// Begins at the first position, at a time of ours, ns, for a host with such a period, ns.
    pub(crate) fn new(
        dialect: ODriveDialect,
        scale: Scale,
        period_ns: u64,
        now_ns: u64,
        counters: Arc<LinkCounters>,
    ) -> Self {
        let feedback = Feedback::new(scale.first_angle, scale.metres_per_angle, period_ns, now_ns, counters);
        Self {
            dialect,
            axis: Axis::new(feedback),
            scale,
        }
    }

    /// Takes in a line, without its end, that came at a time of ours, ns.
    pub(crate) fn take(&mut self, line: Result<&[u8], TooLong>, now_ns: u64) {
        match line {
            Ok(line) => self.dialect.receive(line, &mut self.axis, now_ns),
            Err(TooLong) => add(&self.axis.counters().malformed, 1),
        }
    }

    /// The newest sample.
    ///
    /// # Errors
    /// The controller is silent, its motor is off though force is wanted, or its sensor fails.
    pub(crate) fn measurement(&mut self, now_ns: u64) -> Result<Measurement, DeviceError> {
        let sample = Measurement {
            motor: self.axis.reported(),
            ..self.axis.feedback.measurement(now_ns)?
        };
        if let Motor::Failed(error) = self.axis.motor {
            return Err(error);
        }
        self.dialect.sensor_error().map_or(Ok(sample), Err)
    }

    /// Writes the commands for a force on the hand, N.
    pub(crate) fn command(&mut self, force_n: f64, enabled: bool, now_ns: u64, out: &mut Text) -> CommandState {
        let mut state = CommandState::NotSent;
        if !enabled {
            state = self.stay_off(now_ns, out);
        } else if let Motor::Off { .. } = self.axis.motor {
            self.axis.motor = Motor::Arming {
                since_ns: now_ns,
                sent_at_ns: None,
            };
            self.dialect.begin_arming();
        }
        if self.axis.motor == Motor::On && self.dialect.is_contradicted(now_ns) {
            self.fail(out);
        }
        let room = self.axis.feedback.may_ask(now_ns);
        if !room && enabled {
            add(&self.axis.counters().not_sent, 1);
        }
        if self.axis.feedback.is_overdue(now_ns) {
            // The answer to the next question about the motor shows which of the others are lost.
            self.axis.ask_after_ns = self.axis.ask_after_ns.min(now_ns);
        }
        match self.axis.motor {
            Motor::On => {
                if room {
                    state = CommandState::InThisText;
                    let Scale {
                        newtons_per_target,
                        target_limit,
                        ..
                    } = self.scale;
                    let target = target(force_n, newtons_per_target, target_limit, self.axis.counters());
                    self.dialect.drive(target, out);
                }
                self.dialect.watch(ASK_ON_NS, &mut self.axis, now_ns, out);
            }
            Motor::Arming { since_ns, .. } if room => {
                if now_ns.saturating_sub(since_ns) > ARMING_NS {
                    self.fail(out);
                } else {
                    self.dialect.arm(&mut self.axis, now_ns, out);
                }
            }
            Motor::Arming { .. } | Motor::Off { .. } | Motor::Failed(_) => {}
        }
        if room && self.dialect.ask_position(out) {
            self.axis.feedback.ask(now_ns);
        }
        state
    }

    /// Writes the last words, which leave the motor off.
    pub(crate) fn farewell(&self, out: &mut Text) {
        self.dialect.switch_off(out);
    }

    fn fail(&mut self, out: &mut Text) {
        self.axis.motor = Motor::Failed(DeviceError::MotorOff { watchdog: false });
        self.dialect.switch_off(out);
    }

    /// Switches the motor off until the controller confirms it, and watches it from then on.
    fn stay_off(&mut self, now_ns: u64, out: &mut Text) -> CommandState {
        let sent_now = |since_ns| Motor::Off {
            since_ns,
            sent_at_ns: Some(now_ns),
            confirmed: false,
        };
        let Motor::Off {
            since_ns,
            sent_at_ns,
            confirmed,
        } = self.axis.motor
        else {
            self.axis.motor = sent_now(now_ns);
            self.dialect.ask_next(Question::State, &mut self.axis);
            self.dialect.switch_off(out);
            return CommandState::InThisText;
        };
        if confirmed {
            self.dialect.watch_off(&mut self.axis, now_ns, out);
            return CommandState::Confirmed;
        }
        let tell = is_due(sent_at_ns, now_ns);
        if tell {
            self.axis.motor = sent_now(since_ns);
            self.dialect.switch_off(out);
        }
        self.dialect.ask(Question::State, &self.axis, now_ns, out);
        if tell {
            CommandState::InThisText
        } else {
            CommandState::SentBefore
        }
    }
}
