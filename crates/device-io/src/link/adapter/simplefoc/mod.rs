//! A board with SimpleFOC's Commander, version 2.3 and 2.4. Tried against a fake, never on a real board.
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
use super::options::{SimpleFocOptions, TargetUnit};
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

/// What the target of a kind of torque control is, for a phase resistance in ohm, 0 where it is not set, and what the builder says.
///
/// Up to SimpleFOC 2.3 `voltage` took amperes once the phase resistance was known, and volts otherwise. From 2.4 on it takes volts always, and what took amperes is a kind of its own,
/// `estimated_current`. No command tells the one library from the other, and between the two a force differs by the resistance: so somebody has to say it.
///
/// # Errors
/// Why it is not known or contradicts what was said, and what to do.
fn target_unit(kind: &str, resistance_ohm: f64, said: Option<TargetUnit>) -> Result<TargetUnit, (String, String)> {
    let known = match kind {
        "volt" if resistance_ohm > 0.0 => None,
        "volt" => Some(TargetUnit::Volt),
        _ => Some(TargetUnit::Ampere),
    };
    match (known, said) {
        (Some(known), Some(said)) if known != said => Err((
            format!("its torque control is `{kind}`, which takes its target in {known}, and its address says target={said}"),
            format!("say target={known}, or change motor.torque_controller in its sketch"),
        )),
        (Some(unit), _) | (None, Some(unit)) => Ok(unit),
        (None, None) => Err((
            format!(
                "its torque control is `voltage` with a phase resistance of {resistance_ohm} ohm: SimpleFOC up to 2.3 takes the target in A, from 2.4 on in V, and does not say which it is"
            ),
            "say target=A or target=V in its address and give nm_per_unit for that; or, with 2.4, set motor.torque_controller = TorqueControlType::estimated_current".to_owned(),
        )),
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
        let _asking = counters.ask(clock::now_ns());
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
        let unit = target_unit(&kind, resistance, self.options.target)
            .map_err(|(why, remedy)| greeting.refused(&why, &remedy))?;
        if unit == TargetUnit::Volt {
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
        let watchdog = match self.options.host_timeout_ms {
            Some(ms) => format!("its sketch disables the motor after {ms} ms, as its address says"),
            None => "WARNING: it has no watchdog of its own, see docs/adapters.md".to_owned(),
        };
        Ok(Greeted {
            firmware: format!("SimpleFOC Commander ({kind}, target in {unit}); {watchdog}"),
            force_limit_n: limit_units * self.options.nm_per_unit * motor.newtons_per_nm().abs(),
            sample_rate_hz,
            watchdog_ms: self.options.host_timeout_ms,
            rig: RigIdentity::of_line("simplefoc", &motor.path)
                .with_part(&format!("motor{}", self.options.letter))
                .turned_round(motor.reversed),
            connection: Box::new(TextConnection::new(greeting.line, conversation, Arc::clone(counters))),
        })
    }
}

#[cfg(test)]
mod tests;
