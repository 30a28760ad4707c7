//! The greeting of a SimpleFOC board: its mode for machines, its kind of torque control, and a
//! motor that is off.

use super::dialect::SimpleFocDialect;
use super::options::SimpleFocOptions;
use super::target_unit::TargetUnit;
use super::words::{self, Answer};
use crate::connector::{Controller, Introduction};
use crate::conversation::Scale;
use crate::greeting::Greeting;
use crate::motor_options::MotorOptions;
use device_io::link::ConnectError;
use std::f64::consts::TAU;

impl SimpleFocOptions {
    /// The letter of the motor as a byte; options accept letters of ASCII alone.
    fn letter_byte(&self) -> u8 {
        u8::try_from(self.letter).unwrap_or(b'M')
    }

    /// Sends a command to the motor, and waits for its answer.
    fn ask<T>(
        &self,
        greeting: &mut Greeting,
        command: &str,
        wanted: impl Fn(Answer<'_>) -> Option<T>,
    ) -> Result<T, ConnectError> {
        let letter = self.letter;
        greeting.send(format!("{letter}{command}\n").as_bytes())?;
        greeting
            .receive(|line| words::read(line, self.letter_byte()).and_then(&wanted))?
            .ok_or_else(|| {
                greeting.protocol(format!(
                    "no answer to {letter}{command}; is {letter} the letter of commander.add?"
                ))
            })
    }

    /// Waits until the board answers in the mode for machines.
    fn wake(&self, greeting: &mut Greeting) -> Result<(), ConnectError> {
        greeting.wake(
            |greeting| {
                // The half of a command that the board has received before ends here.
                greeting.send(b"\n@3\n")?;
                if greeting.receive(|line| (line == b"@machine").then_some(()))?.is_none() {
                    return Ok(None);
                }
                greeting.send(b"#6\n")?;
                greeting.receive(|line| (line == b"#6").then_some(()))
            },
            |heard_bytes| match heard_bytes {
                0 => "nothing answers; does its firmware call commander.run()?".to_owned(),
                bytes => format!(
                    "{bytes} bytes came and no answer in the mode for machines, which SimpleFOC 2.3 has; is {} baud \
                     its rate?",
                    self.motor.baud
                ),
            },
        )
    }

    /// Leaves the motor off, and controlling torque.
    fn switch_off(&self, greeting: &mut Greeting) -> Result<(), ConnectError> {
        // Off before anything else: until it controls torque, a target of zero may be a place to go
        // to.
        let off = |answer: Answer<'_>| (answer == Answer::Enabled(false)).then_some(());
        self.ask(greeting, "E0", off)?;
        let controls_torque = self.ask(greeting, "C0", |answer| match answer {
            Answer::Control(kind) => Some(kind == b"torque"),
            _ => None,
        })?;
        if controls_torque {
            Ok(())
        } else {
            Err(greeting.refused("it does not change to torque control", "does its firmware allow it?"))
        }
    }

    /// The kind of torque control, as the board names it, the unit of its target, and the largest
    /// target.
    fn target(&self, greeting: &mut Greeting) -> Result<(String, TargetUnit, f64), ConnectError> {
        let kind = self.ask(greeting, "T", |answer| match answer {
            Answer::Torque(kind) => Some(String::from_utf8_lossy(kind).into_owned()),
            _ => None,
        })?;
        let resistance_ohm = self.ask(greeting, "R", |answer| match answer {
            Answer::Resistance(ohm) => Some(ohm),
            _ => None,
        })?;
        let unit = TargetUnit::of(&kind, resistance_ohm, self.target)
            .map_err(|(why, remedy)| greeting.refused(&why, &remedy))?;
        let mut limit = self.motor.torque_limit_nm / self.nm_per_unit;
        if unit == TargetUnit::Volt {
            let limit_v = self.ask(greeting, "LU", |answer| match answer {
                Answer::VoltageLimit(volts) => Some(volts),
                _ => None,
            })?;
            limit = limit.min(limit_v.abs());
        }
        Ok((kind, unit, limit))
    }

    /// The scale for a first angle, rad, and a largest target, A or V.
    pub(super) fn scale(&self, first_rad: f64, target_limit: f64) -> Scale {
        let metres_per_rad = self.motor.metres_per_turn() / TAU;
        Scale {
            first_angle: first_rad,
            metres_per_angle: metres_per_rad,
            // The answer has six decimals.
            resolution_m: metres_per_rad.abs() * 1e-6,
            newtons_per_target: self.nm_per_unit * self.motor.newtons_per_nm(),
            target_limit,
        }
    }

    /// The dialect for a largest target, A or V.
    pub(super) fn dialect(&self, target_limit: f64) -> SimpleFocDialect {
        SimpleFocDialect::new(self.letter_byte(), target_limit)
    }
}

impl Controller for SimpleFocOptions {
    type Dialect = SimpleFocDialect;

    const KIND: &'static str = "simplefoc";

    fn motor(&self) -> &MotorOptions {
        &self.motor
    }

    fn name(&self) -> String {
        format!("motor {} of the SimpleFOC board", self.letter)
    }

    fn part(&self) -> String {
        format!("motor{}", self.letter)
    }

    fn greet(&self, greeting: &mut Greeting) -> Result<Introduction<SimpleFocDialect>, ConnectError> {
        self.wake(greeting)?;
        self.switch_off(greeting)?;
        let (kind, unit, target_limit) = self.target(greeting)?;
        let angle_rad = self.ask(greeting, "MG6", |answer| match answer {
            Answer::Angle(rad) => Some(rad),
            _ => None,
        })?;
        let watchdog = match self.host_timeout_ms {
            Some(ms) => format!("its sketch disables the motor after {ms} ms, as its address says"),
            None => "WARNING: it has no watchdog of its own, see docs/adapters.md".to_owned(),
        };
        Ok(Introduction {
            dialect: self.dialect(target_limit),
            scale: self.scale(angle_rad, target_limit),
            firmware: format!("SimpleFOC Commander ({kind}, target in {unit}); {watchdog}"),
            watchdog_ms: self.host_timeout_ms,
        })
    }
}
