//! A board with SimpleFOC's Commander, version 2.3 and later. Tried against a fake, never on a real board.
//!
//! Source: SimpleFOC's documentation, "Commander interface" and "Motor commands" (docs.simplefoc.com).
//!
//! Its Commander has no watchdog: where the host dies, the motor goes on with the last torque. docs/adapters.md has a few lines for the firmware that mend this.

mod conversation;
mod words;

use super::super::health::LinkCounters;
use super::super::identity::RigIdentity;
use super::super::keeper::{ConnectError, Connector, Greeted};
use super::super::nodes::folder_of;
use super::greeting::{ATTEMPTS, Greeting};
use super::options::SimpleFocOptions;
use super::{TextConnection, clock};
use conversation::SimpleFocConversation;
use std::ffi::OsStr;
use std::path::PathBuf;
use std::sync::Arc;
use words::Answer;

/// Finds and greets a SimpleFOC board.
#[derive(Debug)]
pub struct SimpleFocConnector {
    options: SimpleFocOptions,
}

impl SimpleFocConnector {
    /// A motor of a board on a line.
    #[must_use]
    pub fn new(options: SimpleFocOptions) -> Self {
        Self { options }
    }

    /// Sends a command to the motor, and waits for its answer.
    fn ask<T>(
        &self,
        greeting: &mut Greeting,
        command: &str,
        wanted: impl Fn(Answer<'_>) -> Option<T>,
    ) -> Result<T, ConnectError> {
        let letter = self.options.letter;
        greeting.say(format!("{letter}{command}\n").as_bytes())?;
        let letter_byte = u8::try_from(letter).unwrap_or(b'M');
        greeting
            .hear(|line| words::read(line, letter_byte).and_then(&wanted))?
            .ok_or_else(|| {
                greeting.protocol(format!(
                    "no answer to {letter}{command}; is {letter} the letter of commander.add?"
                ))
            })
    }

    /// Waits until somebody answers, in the mode for machines.
    fn wake(&self, greeting: &mut Greeting) -> Result<(), ConnectError> {
        for _ in 0..ATTEMPTS {
            // What a board has half received before ends here.
            greeting.say(b"\n@3\n")?;
            if greeting.hear(|line| (line == b"@machine").then_some(()))?.is_some() {
                greeting.say(b"#6\n")?;
                if greeting.hear(|line| (line == b"#6").then_some(()))?.is_some() {
                    return Ok(());
                }
            }
        }
        let heard = match greeting.heard_bytes() {
            0 => "nothing answers; does its firmware call commander.run()?".to_owned(),
            bytes => format!(
                "{bytes} bytes came and no answer in the mode for machines, which SimpleFOC 2.3 has; is {} baud its rate?",
                self.options.motor.baud
            ),
        };
        Err(greeting.protocol(heard))
    }
}

impl Connector for SimpleFocConnector {
    fn address(&self) -> String {
        format!(
            "motor {} of the SimpleFOC board on {}",
            self.options.letter,
            self.options.motor.path.display()
        )
    }

    fn folder(&self) -> PathBuf {
        folder_of(&self.options.motor.path)
    }

    fn concerns(&self, node: &OsStr) -> bool {
        self.options.motor.path.file_name() == Some(node)
    }

    fn connect(&mut self, period_ns: u64, counters: &Arc<LinkCounters>) -> Result<Greeted, ConnectError> {
        let motor = &self.options.motor;
        let mut greeting = Greeting::begin(&motor.path, motor.baud)?;
        self.wake(&mut greeting)?;
        // Off before anything else: until it controls torque, a target of zero may be a place to go to.
        let off = |answer: Answer<'_>| (answer == Answer::Enabled(false)).then_some(());
        self.ask(&mut greeting, "E0", off)?;
        let control = self.ask(&mut greeting, "C0", |answer| match answer {
            Answer::Control(kind) => Some(kind == b"torque"),
            _ => None,
        })?;
        if !control {
            return Err(greeting.refused("it does not change to torque control", "does its firmware allow it?"));
        }
        let kind = self.ask(&mut greeting, "T", |answer| match answer {
            Answer::Torque(kind) => Some(String::from_utf8_lossy(kind).into_owned()),
            _ => None,
        })?;
        let mut limit_units = motor.torque_limit_nm / self.options.nm_per_unit;
        let resistance = self.ask(&mut greeting, "R", |answer| match answer {
            Answer::Resistance(ohm) => Some(ohm),
            _ => None,
        })?;
        let in_volts = kind == "volt" && resistance <= 0.0;
        if in_volts {
            let limit = self.ask(&mut greeting, "LU", |answer| match answer {
                Answer::VoltageLimit(volts) => Some(volts),
                _ => None,
            })?;
            limit_units = limit_units.min(limit.abs());
        }
        let angle = self.ask(&mut greeting, "MG6", |answer| match answer {
            Answer::Angle(rad) => Some(rad),
            _ => None,
        })?;
        #[expect(clippy::cast_precision_loss, reason = "a period of milliseconds")]
        let sample_rate_hz = 1e9 / period_ns as f64;
        let conversation = SimpleFocConversation::new(
            &self.options,
            limit_units,
            angle,
            period_ns,
            clock::now_ns(),
            Arc::clone(counters),
        );
        let unit = if in_volts { "V" } else { "A" };
        Ok(Greeted {
            firmware: format!(
                "SimpleFOC Commander ({kind}, target in {unit}); WARNING: it has no watchdog of its own, see docs/adapters.md"
            ),
            force_limit_n: limit_units * self.options.nm_per_unit * motor.newtons_per_nm().abs(),
            sample_rate_hz,
            watchdog_ms: self.options.timeout_ms,
            rig: RigIdentity::of_line("simplefoc", &motor.path)
                .with_part(&format!("motor{}", self.options.letter))
                .turned_round(motor.reversed),
            connection: Box::new(TextConnection::new(greeting.line, conversation, Arc::clone(counters))),
        })
    }
}

#[cfg(test)]
mod tests;
