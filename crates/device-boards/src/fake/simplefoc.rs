//! A fake SimpleFOC board: the Commander of version 2.3 with one motor, and its answers to other
//! commands. Written from SimpleFOC's documentation; it contains no line of theirs.

use super::board::FakeBoard;
use super::pulley::Pulley;
use device_io::fake::{Hand, RigProperties};
use std::f64::consts::TAU;

/// Room for a command with its end, bytes; a command of that length is thrown away.
const COMMAND_ROOM: usize = 20;

/// Properties of a fake SimpleFOC board.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SimpleFocProperties {
    /// The letter that its firmware gives to the motor.
    pub letter: char,
    /// Radius of the pulley on its shaft, m.
    pub radius_m: f64,
    /// Torque to an ampere or a volt of the target, Nm.
    pub nm_per_unit: f64,
    /// The largest target that has an effect: the voltage limit.
    pub voltage_limit: f64,
    /// Time without a command after which the motor is disabled, ns, where the builder has added
    /// that; the library has nothing like it.
    pub host_timeout_ns: Option<u64>,
    /// How it makes torque, as the Commander calls it: `volt`, `dc curr`, `foc curr`, and from 2.4
    /// on `est. curr`.
    pub torque: &'static str,
    /// Resistance of a phase, ohm; 0 where it is not set.
    pub phase_resistance_ohm: f64,
    /// Its firmware keeps controlling an angle, whatever it is told.
    pub keeps_angle: bool,
}

impl Default for SimpleFocProperties {
    fn default() -> Self {
        Self {
            letter: 'M',
            radius_m: 5e-3,
            nm_per_unit: 0.05,
            voltage_limit: 12.0,
            host_timeout_ns: None,
            torque: "foc curr",
            phase_resistance_ohm: 0.0,
            keeps_angle: false,
        }
    }
}

/// A fake SimpleFOC board.
#[derive(Debug)]
pub struct SimpleFocBoard {
    pulley: Pulley,
    properties: SimpleFocProperties,
    line: Vec<u8>,
    /// Its modes: 0 says nothing, 2 is for people, 3 for machines.
    verbose: u8,
    decimals: usize,
    enabled: bool,
    control: u8,
    target: f64,
    tripped: bool,
    heard_at_ns: u64,
}

impl SimpleFocBoard {
    /// A board after its set-up, in which the library enables the motor.
    #[must_use]
    pub fn new(rig: RigProperties, hand: Hand, properties: SimpleFocProperties) -> Self {
        Self {
            pulley: Pulley::new(rig, hand, properties.radius_m),
            properties,
            line: Vec::new(),
            verbose: 2,
            decimals: 3,
            enabled: true,
            control: 2,
            target: 0.0,
            tripped: false,
            heard_at_ns: 0,
        }
    }

    /// Another program disables the motor.
    pub fn disable(&mut self) {
        self.enabled = false;
        self.apply();
    }

    fn apply(&mut self) {
        let limit = self.properties.voltage_limit;
        self.pulley.drive(if self.enabled && self.control == 0 {
            self.target.clamp(-limit, limit) * self.properties.nm_per_unit
        } else {
            0.0
        });
    }

    /// With a name for people, and letters for machines.
    fn said(&self, letters: &str, name: &str, value: &str) -> Option<String> {
        match self.verbose {
            0 => None,
            2 => Some(format!("{name}{value}\r\n")),
            3 => Some(format!("{letters}{value}\r\n")),
            _ => Some(format!("{value}\r\n")),
        }
    }

    fn float(&self, value: f64) -> String {
        format!("{value:.*}", self.decimals)
    }

    fn obey(&mut self, command: &str) -> Option<String> {
        let mut letters = command.chars();
        let id = letters.next()?;
        let rest = letters.as_str();
        match id {
            '?' => self.said(
                &format!("?{}:", self.properties.letter),
                &format!("{}:", self.properties.letter),
                "motor",
            ),
            '@' => {
                if let Some(verbose) = rest.parse().ok().filter(|verbose| *verbose <= 3) {
                    self.verbose = verbose;
                }
                match self.verbose {
                    2 => self.said("", "Verb:", "on!"),
                    _ => self.said("@", "", if self.verbose == 3 { "machine" } else { "on!" }),
                }
            }
            '#' => {
                if !rest.is_empty() {
                    self.decimals = rest.parse().unwrap_or(0);
                }
                let decimals = self.decimals.to_string();
                self.said("#", "Decimal:", &decimals)
            }
            id if id == self.properties.letter => self.obey_motor(rest),
            // A letter that nobody was given.
            _ => None,
        }
    }

    fn obey_motor(&mut self, command: &str) -> Option<String> {
        let id = self.properties.letter;
        if command.is_empty() || command.starts_with(|first: char| first.is_ascii_digit() || "+-".contains(first)) {
            if !command.is_empty() {
                self.target = leading_number(command);
                self.apply();
            }
            return self.said(&id.to_string(), "Target: ", &self.float(self.target));
        }
        let mut letters = command.chars();
        let kind = letters.next()?;
        let sub = letters.next().filter(char::is_ascii_uppercase);
        let value = if sub.is_some() {
            letters.as_str()
        } else {
            &command[kind.len_utf8()..]
        };
        let said = |name: &str, value: &str| {
            let letters: String = [Some(id), Some(kind), sub].into_iter().flatten().collect();
            self.said(&letters, name, value)
        };
        match (kind, sub) {
            ('E', None) => {
                if !value.is_empty() {
                    self.enabled = leading_number(value) != 0.0;
                    self.tripped = self.tripped && !self.enabled;
                    self.apply();
                }
                let value = u8::from(self.enabled).to_string();
                self.said(&format!("{id}E"), "Status: ", &value)
            }
            ('C', None) => {
                if let Ok(control @ 0..=4) = value.parse()
                    && !self.properties.keeps_angle
                {
                    self.control = control;
                    self.apply();
                }
                let names = ["torque", "vel", "angle", "vel open", "angle open"];
                self.said(&format!("{id}C"), "Motion:", names[usize::from(self.control)])
            }
            ('T', None) => said("Torque: ", self.properties.torque),
            ('R', None) if self.properties.phase_resistance_ohm > 0.0 => {
                said("R phase: ", &self.float(self.properties.phase_resistance_ohm))
            }
            ('R', None) => said("R phase: ", "0"),
            ('L', Some('U')) => said("Limits| volt: ", &self.float(self.properties.voltage_limit)),
            ('M', Some('G')) => match value {
                "0" => said("Monitor | target: ", &self.float(self.target)),
                "5" => said("Monitor | vel: ", &self.float(self.pulley.speed_rad_per_s())),
                "6" => said("Monitor | angle: ", &self.float(self.pulley.turns() * TAU)),
                _ => said("Monitor | ", "err"),
            },
            _ => said("unknown cmd ", "err"),
        }
    }
}

/// The number that a text begins with, as C reads one; 0 where it begins with none.
fn leading_number(text: &str) -> f64 {
    let end = text
        .char_indices()
        .find(|(at, byte)| !(byte.is_ascii_digit() || *byte == '.' || *at == 0 && "+-".contains(*byte)))
        .map_or(text.len(), |(at, _)| at);
    text[..end].parse().unwrap_or(0.0)
}

impl FakeBoard for SimpleFocBoard {
    fn receive(&mut self, bytes: &[u8], now_ns: u64) -> Vec<Vec<u8>> {
        self.live_until(now_ns);
        let mut answers = Vec::new();
        for &byte in bytes {
            self.line.push(byte);
            if matches!(byte, b'\n' | b'\r') {
                self.line.pop();
                let command = String::from_utf8_lossy(&std::mem::take(&mut self.line)).into_owned();
                if command.starts_with(self.properties.letter) {
                    self.heard_at_ns = now_ns;
                }
                answers.extend(self.obey(&command).map(String::into_bytes));
            } else if self.line.len() >= COMMAND_ROOM {
                self.line.clear();
            }
        }
        answers
    }

    fn live_until(&mut self, now_ns: u64) {
        if let Some(timeout_ns) = self.properties.host_timeout_ns {
            let bites_at_ns = self.heard_at_ns + timeout_ns;
            if self.enabled && now_ns >= bites_at_ns {
                self.pulley.live_until(bites_at_ns);
                self.tripped = true;
                self.disable();
            }
        }
        self.pulley.live_until(now_ns);
    }

    fn is_on(&self) -> bool {
        self.enabled
    }

    fn watchdog_has_tripped(&self) -> bool {
        self.tripped
    }

    fn pulley(&self) -> &Pulley {
        &self.pulley
    }

    fn pulley_mut(&mut self) -> &mut Pulley {
        &mut self.pulley
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_answers_people_and_machines_as_the_documentation_says() {
        let mut board = SimpleFocBoard::new(RigProperties::default(), Hand::Free, SimpleFocProperties::default());
        for (line, answer) in [
            ("MMG6\n", "Monitor | angle: 0.000\r\n"),
            ("ME\n", "Status: 1\r\n"),
            ("@3\n", "@machine\r\n"),
            ("#6\n", "#6\r\n"),
            ("ME0\n", "ME0\r\n"),
            ("MC\n", "MCangle\r\n"),
            ("MC0\n", "MCtorque\r\n"),
            ("M0.5\n", "M0.500000\r\n"),
            ("M-0.25\n", "M-0.250000\r\n"),
            ("M\n", "M-0.250000\r\n"),
            ("MMG6\n", "MMG0.000000\r\n"),
            ("MT\n", "MTfoc curr\r\n"),
            ("MX1\n", "MXerr\r\n"),
            ("M.5\n", "M.err\r\n"),
            ("N1\n", ""),
            ("\n", ""),
            // Too long: the first twenty are thrown away.
            ("M0.12345678901234567890\n", ""),
            ("@0\n", ""),
            ("MMG6\n", ""),
        ] {
            let said = String::from_utf8(board.receive(line.as_bytes(), 1000).concat()).expect("text");
            assert_eq!(said, answer, "{line}");
        }
    }

    #[test]
    fn a_target_is_a_torque_while_it_is_enabled_and_for_ever() {
        let mut board = SimpleFocBoard::new(RigProperties::default(), Hand::Free, SimpleFocProperties::default());
        board.receive(b"M1\n", 0);
        assert_eq!(board.force_n(), 0.0, "it means an angle");
        board.receive(b"MC0\nM1\n", 0);
        assert_eq!(board.force_n(), 10.0);
        board.live_until(3_600_000_000_000);
        assert_eq!(board.force_n(), 10.0, "nothing ends it");
        board.receive(b"ME0\n", 3_600_000_000_000);
        assert_eq!(board.force_n(), 0.0);
    }

    #[test]
    fn a_builders_time_out_ends_it() {
        let properties = SimpleFocProperties {
            host_timeout_ns: Some(50_000_000),
            ..SimpleFocProperties::default()
        };
        let mut board = SimpleFocBoard::new(RigProperties::default(), Hand::Free, properties);
        board.receive(b"MC0\nME1\nM1\n", 0);
        board.live_until(49_000_000);
        assert_eq!(board.force_n(), 10.0);
        board.live_until(50_000_000);
        assert_eq!((board.force_n(), board.watchdog_has_tripped()), (0.0, true));
    }
}
