//! An ODrive, by its ASCII protocol: firmware 0.5.4 and later on ODrive 3.x, and 0.6 on S1 and Pro. Tried against a fake, never on a real board.
//!
//! Source: ODrive's documentation, "ASCII Protocol" and "API reference" (docs.odriverobotics.com, firmware 0.5.6 and 0.6).

mod conversation;
mod words;

use super::super::health::LinkCounters;
use super::super::identity::RigIdentity;
use super::super::keeper::{ConnectError, Connector, Greeted};
use super::super::nodes::folder_of;
use super::greeting::{ATTEMPTS, Greeting};
use super::options::ODriveOptions;
use super::text::{Text, number};
use super::{TextConnection, clock};
use conversation::{Generation, ODriveConversation, WATCHDOG_MS};
use std::ffi::OsStr;
use std::path::PathBuf;
use std::sync::Arc;
use words::Answer;

/// Finds and greets an ODrive.
#[derive(Debug)]
pub struct ODriveConnector {
    options: ODriveOptions,
}

/// What a property is, or that there is none.
enum Property {
    Number(f64),
    /// Text that is no finite number, as `inf`.
    Other,
    Refused,
}

impl ODriveConnector {
    /// An axis of an ODrive on a line.
    #[must_use]
    pub fn new(options: ODriveOptions) -> Self {
        Self { options }
    }

    /// Reads a property; nothing where no answer comes.
    fn property(greeting: &mut Greeting, name: &str) -> Result<Option<Property>, ConnectError> {
        let mut text = Text::default();
        words::write(&mut text, format_args!("r {name}"));
        greeting.say(text.as_bytes())?;
        greeting.hear(|line| match words::read(line) {
            Ok(Answer::Value(value)) => Some(number(value).map_or(Property::Other, Property::Number)),
            Ok(Answer::Refused) => Some(Property::Refused),
            _ => None,
        })
    }

    /// A property that there must be.
    fn number(greeting: &mut Greeting, name: &str) -> Result<f64, ConnectError> {
        match Self::property(greeting, name)? {
            Some(Property::Number(value)) => Ok(value),
            Some(Property::Refused) => Err(greeting.protocol(format!("this ODrive has no property {name}"))),
            Some(Property::Other) => Err(greeting.protocol(format!("its {name} is no number"))),
            None => Err(greeting.protocol(format!("no answer to the question after {name}"))),
        }
    }

    /// Major, minor and revision, from whoever answers at last.
    fn firmware(&self, greeting: &mut Greeting) -> Result<[f64; 3], ConnectError> {
        for _ in 0..ATTEMPTS {
            // What a board has half received before ends here.
            greeting.say(b"\n")?;
            if let Some(Property::Number(major)) = Self::property(greeting, "fw_version_major")? {
                let minor = Self::number(greeting, "fw_version_minor")?;
                let revision = Self::number(greeting, "fw_version_revision")?;
                return Ok([major, minor, revision]);
            }
        }
        let heard = match greeting.heard_bytes() {
            0 => "nothing answers; is it an ODrive, and does this port of it speak the ASCII protocol?".to_owned(),
            bytes => format!(
                "{bytes} bytes came and no answer with a checksum; is it an ODrive, does this port speak the ASCII protocol, and is {} baud its rate?",
                self.options.motor.baud
            ),
        };
        Err(greeting.protocol(heard))
    }

    /// Leaves the axis off, whoever had it before, and then its watchdog.
    fn switch_off(&self, greeting: &mut Greeting) -> Result<(), ConnectError> {
        let axis = self.options.axis;
        let off = || {
            let mut text = Text::default();
            words::write(&mut text, format_args!("c {axis} 0"));
            words::write(&mut text, format_args!("w axis{axis}.requested_state 1"));
            text
        };
        for _ in 0..ATTEMPTS {
            greeting.say(off().as_bytes())?;
            if Self::number(greeting, &format!("axis{axis}.current_state"))? <= 1.0 {
                let mut text = Text::default();
                words::write(&mut text, format_args!("w axis{axis}.config.enable_watchdog 0"));
                return greeting.say(text.as_bytes());
            }
        }
        Err(greeting.refused(
            &format!("axis {axis} does not become idle"),
            "is something else controlling it?",
        ))
    }

    /// Makes the board itself cut torque at our limit, or takes over a lower one of its own; the largest torque, Nm. A damaged command may lose its checksum on its way, and
    /// without one an ODrive believes it. Not saved: switched off and on, the board has its own limit again.
    fn limit_torque(&self, greeting: &mut Greeting, generation: Generation) -> Result<f64, ConnectError> {
        let ours = self.options.motor.torque_limit_nm;
        let mut limit = ours;
        for (property, _) in generation.torque_limits() {
            let name = format!("axis{}.{property}", self.options.axis);
            if let Some(Property::Number(board)) = Self::property(greeting, &name)? {
                limit = limit.min(board.abs());
            }
        }
        for (property, sign) in generation.torque_limits() {
            let name = format!("axis{}.{property}", self.options.axis);
            let mut text = Text::default();
            words::write(&mut text, format_args!("w {name} {:.5}", sign * limit));
            greeting.say(text.as_bytes())?;
            let limited = Self::number(greeting, &name)?;
            if limited.abs() > limit + 2e-5 {
                return Err(greeting.refused(
                    &format!("its {name} stays at {limited} Nm"),
                    &format!("set it to {limit} Nm or less with odrivetool"),
                ));
            }
        }
        Ok(limit)
    }

    /// Where the shaft is, turns.
    fn turns(&self, greeting: &mut Greeting) -> Result<f64, ConnectError> {
        let mut text = Text::default();
        words::write(&mut text, format_args!("f {}", self.options.axis));
        greeting.say(text.as_bytes())?;
        let turns = greeting.hear(|line| match words::read(line) {
            Ok(Answer::Feedback(turns, _)) => Some(Some(turns)),
            Ok(Answer::Refused) => Some(None),
            _ => None,
        })?;
        turns
            .flatten()
            .ok_or_else(|| greeting.protocol(format!("axis {} does not say where it is", self.options.axis)))
    }
}

/// Which words a firmware uses; nothing where it is older than those that can be armed by this protocol.
fn generation([major, minor, revision]: [f64; 3]) -> Option<Generation> {
    if major > 0.0 || minor >= 6.0 {
        Some(Generation::Six)
    } else if minor >= 5.0 && revision >= 4.0 {
        Some(Generation::Half)
    } else {
        None
    }
}

impl Connector for ODriveConnector {
    fn address(&self) -> String {
        format!(
            "axis {} of the ODrive on {}",
            self.options.axis,
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
        let axis = self.options.axis;
        let mut greeting = Greeting::begin(&motor.path, motor.baud)?;
        let _asking = counters.ask(clock::now_ns());
        let version = self.firmware(&mut greeting)?;
        let [major, minor, revision] = version;
        let name = format!("ODrive {major}.{minor}.{revision}");
        let generation = generation(version).ok_or_else(|| {
            greeting.refused(
                &format!("its firmware {major}.{minor}.{revision} is too old"),
                "firmware 0.5.4 is the first whose states can be written by the ASCII protocol: `odrivetool dfu`",
            )
        })?;
        self.switch_off(&mut greeting)?;
        Self::number(&mut greeting, &format!("axis{axis}.{}", generation.errors().0))?;
        let counts = match Self::property(&mut greeting, &format!("axis{axis}.encoder.config.cpr"))? {
            Some(Property::Number(counts)) if counts >= 1.0 => Some(counts),
            _ => None,
        };
        let torque_limit_nm = self.limit_torque(&mut greeting, generation)?;
        let turns = self.turns(&mut greeting)?;
        #[expect(clippy::cast_precision_loss, reason = "a period of milliseconds")]
        let sample_rate_hz = 1e9 / period_ns as f64;
        let conversation = ODriveConversation::new(
            &self.options,
            generation,
            counts,
            torque_limit_nm,
            turns,
            period_ns,
            clock::now_ns(),
            Arc::clone(counters),
        );
        Ok(Greeted {
            firmware: name,
            force_limit_n: torque_limit_nm * motor.newtons_per_nm().abs(),
            sample_rate_hz,
            // Switched on before every enabling, and read back.
            watchdog_ms: Some(WATCHDOG_MS),
            rig: RigIdentity::of_line("odrive", &motor.path)
                .with_part(&format!("axis{axis}"))
                .turned_round(motor.reversed),
            connection: Box::new(TextConnection::new(greeting.line, conversation, Arc::clone(counters))),
        })
    }
}

#[cfg(test)]
mod tests;
