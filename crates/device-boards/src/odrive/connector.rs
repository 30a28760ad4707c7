//! Finding and greeting an ODrive: its firmware, its limits, and a motor that is off.

use super::connection::TextConnection;
use super::conversation::{Conversation, Scale};
use super::dialect::{ODriveDialect, WATCHDOG_MS};
use super::generation::Generation;
use super::greeting::{ATTEMPTS, Greeting};
use super::options::ODriveOptions;
use super::text::{Text, number};
use super::words::{self, Answer};
use device_io::link::{
    ConnectError, Connector, DeviceInfo, GreetedDevice, LinkCounters, LoopTiming, RigIdentity, folder_of,
};
use device_io::now_ns;
use std::ffi::OsStr;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

/// The answer to a question for a property.
enum Property {
    Number(f64),
    /// Text that is not a finite number, as `inf`.
    Other,
    Refused,
}

/// Sends a command.
fn send(greeting: &mut Greeting, command: fmt::Arguments<'_>) -> Result<(), ConnectError> {
    let mut text = Text::default();
    words::write(&mut text, command);
    greeting.send(text.as_bytes())
}

/// Reads a property; nothing without an answer.
fn property(greeting: &mut Greeting, name: &str) -> Result<Option<Property>, ConnectError> {
    send(greeting, format_args!("r {name}"))?;
    greeting.receive(|line| match words::read(line) {
        Ok(Answer::Value(value)) => Some(number(value).map_or(Property::Other, Property::Number)),
        Ok(Answer::Refused) => Some(Property::Refused),
        _ => None,
    })
}

/// Reads a property that must be a number.
fn required(greeting: &mut Greeting, name: &str) -> Result<f64, ConnectError> {
    match property(greeting, name)? {
        Some(Property::Number(value)) => Ok(value),
        Some(Property::Refused) => Err(greeting.protocol(format!("this ODrive has no property {name}"))),
        Some(Property::Other) => Err(greeting.protocol(format!("its {name} is not a number"))),
        None => Err(greeting.protocol(format!("no answer to the question after {name}"))),
    }
}

impl ODriveOptions {
    /// Major, minor and revision of the firmware.
    fn firmware(&self, greeting: &mut Greeting) -> Result<[f64; 3], ConnectError> {
        greeting.wake(
            |greeting| {
                // The half of a command that the board has received before ends here.
                greeting.send(b"\n")?;
                let Some(Property::Number(major)) = property(greeting, "fw_version_major")? else {
                    return Ok(None);
                };
                let minor = required(greeting, "fw_version_minor")?;
                let revision = required(greeting, "fw_version_revision")?;
                Ok(Some([major, minor, revision]))
            },
            |received_bytes| match received_bytes {
                0 => "nothing answers; is it an ODrive, and does this port of it speak the ASCII protocol?".to_owned(),
                bytes => format!(
                    "{bytes} bytes came and no answer with a checksum; is it an ODrive, does this port speak the \
                     ASCII protocol, and is {} baud its rate?",
                    self.baud
                ),
            },
        )
    }

    /// Switches the axis off, which another program may have used, and then its watchdog.
    fn switch_off(&self, greeting: &mut Greeting) -> Result<(), ConnectError> {
        let axis = self.axis;
        for _ in 0..ATTEMPTS {
            send(greeting, format_args!("c {axis} 0"))?;
            send(greeting, format_args!("w axis{axis}.requested_state 1"))?;
            if required(greeting, &format!("axis{axis}.current_state"))? <= 1.0 {
                return send(greeting, format_args!("w axis{axis}.config.enable_watchdog 0"));
            }
        }
        Err(greeting.refused(
            &format!("axis {axis} does not become idle"),
            "is something else controlling it?",
        ))
    }

    /// Makes the board itself cut torque at our limit, or takes over a lower limit of its own;
    /// returns the largest torque, Nm. A damaged command may lose its checksum on its way, and
    /// without one an ODrive believes it. The limit is not saved: after a power cycle the board has
    /// its own again.
    fn limit_torque(&self, greeting: &mut Greeting, generation: &'static Generation) -> Result<f64, ConnectError> {
        let mut limit = self.torque_limit_nm;
        for (name, _) in generation.torque_limits {
            let name = format!("axis{}.{name}", self.axis);
            if let Some(Property::Number(board)) = property(greeting, &name)? {
                limit = limit.min(board.abs());
            }
        }
        for (name, sign) in generation.torque_limits {
            let name = format!("axis{}.{name}", self.axis);
            send(greeting, format_args!("w {name} {:.5}", sign * limit))?;
            let limited = required(greeting, &name)?;
            if limited.abs() > limit + 2e-5 {
                return Err(greeting.refused(
                    &format!("its {name} stays at {limited} Nm"),
                    &format!("set it to {limit} Nm or less with odrivetool"),
                ));
            }
        }
        Ok(limit)
    }

    /// Position of the shaft, turns.
    fn turns(&self, greeting: &mut Greeting) -> Result<f64, ConnectError> {
        send(greeting, format_args!("f {}", self.axis))?;
        let turns = greeting.receive(|line| match words::read(line) {
            Ok(Answer::Feedback(turns, _)) => Some(Some(turns)),
            Ok(Answer::Refused) => Some(None),
            _ => None,
        })?;
        turns
            .flatten()
            .ok_or_else(|| greeting.protocol(format!("axis {} does not say where it is", self.axis)))
    }

    /// The scale for a first position, turns, a largest torque, Nm, and the counts of a turn where
    /// they are known.
    pub(super) fn scale(&self, first_turns: f64, torque_limit_nm: f64, counts_per_turn: Option<f64>) -> Scale {
        let metres_per_turn = self.metres_per_turn();
        Scale {
            first_angle: first_turns,
            metres_per_angle: metres_per_turn,
            // The answer has six decimals.
            resolution_m: metres_per_turn.abs() * counts_per_turn.map_or(1e-6, |counts| 1.0 / counts),
            newtons_per_target: self.newtons_per_nm(),
            target_limit: torque_limit_nm,
        }
    }
}

/// Finds and greets an ODrive.
#[derive(Debug)]
pub(crate) struct ODriveConnector(pub(crate) ODriveOptions);

impl Connector for ODriveConnector {
    fn address(&self) -> String {
        format!("axis {} of the ODrive on {}", self.0.axis, self.0.path.display())
    }

    fn folder(&self) -> PathBuf {
        folder_of(&self.0.path)
    }

    fn concerns(&self, node: &OsStr) -> bool {
        self.0.path.file_name() == Some(node)
    }

    fn connect(&mut self, timing: LoopTiming, counters: &Arc<LinkCounters>) -> Result<GreetedDevice, ConnectError> {
        let Self(options) = self;
        let axis = options.axis;
        let mut greeting = Greeting::begin(&options.path, options.baud)?;
        let _asking = counters.ask(now_ns());
        let version = options.firmware(&mut greeting)?;
        let [major, minor, revision] = version;
        let generation = Generation::of(version).ok_or_else(|| {
            greeting.refused(
                &format!("its firmware {major}.{minor}.{revision} is too old"),
                "firmware 0.5.4 is the first whose states can be written by the ASCII protocol: `odrivetool dfu`",
            )
        })?;
        options.switch_off(&mut greeting)?;
        required(&mut greeting, &format!("axis{axis}.{}", generation.present_errors))?;
        let counts_per_turn = match property(&mut greeting, &format!("axis{axis}.encoder.config.cpr"))? {
            Some(Property::Number(counts)) if counts >= 1.0 => Some(counts),
            _ => None,
        };
        let torque_limit_nm = options.limit_torque(&mut greeting, generation)?;
        let turns = options.turns(&mut greeting)?;
        let scale = options.scale(turns, torque_limit_nm, counts_per_turn);
        #[expect(clippy::cast_precision_loss, reason = "a period of milliseconds")]
        let sample_rate_hz = 1e9 / timing.period_ns as f64;
        let line = RigIdentity::of_line("odrive", &options.path);
        let dialect = ODriveDialect::new(axis, generation);
        let conversation = Conversation::new(dialect, scale, timing.period_ns, now_ns(), Arc::clone(counters));
        Ok(GreetedDevice {
            device: DeviceInfo {
                connection: 0,
                firmware: format!("ODrive {major}.{minor}.{revision}"),
                force_limit_n: scale.force_limit_n(),
                sample_rate_hz,
                resolution_m: scale.resolution_m,
                // Switched on before every enabling, and read back.
                watchdog_ms: Some(WATCHDOG_MS),
                buttons: 0,
                motors: None,
                rig: RigIdentity {
                    reversed: options.reversed,
                    ..line.with_part(&format!("axis{axis}"))
                },
            },
            connection: Box::new(TextConnection::new(greeting.line, conversation, Arc::clone(counters))),
        })
    }
}
