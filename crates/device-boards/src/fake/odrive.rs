//! A fake ODrive: one axis, the part of the ASCII protocol that is used here, and its answers to
//! the rest. Written from ODrive's documentation of firmware 0.5.6; it contains no line of theirs.

use device_io::fake::{FakeRig, Hand, Misbehaviour, RigProperties};
use std::f64::consts::TAU;

/// Longest line; a longer line is not read.
const MAX_LINE: usize = 256;

/// Longest text of a property.
const MAX_VALUE: usize = 9;

/// Time from a request to the change of state, ns.
const STATE_PERIOD_NS: u64 = 1_000_000;

/// Bits of `axis.error`.
const INVALID_STATE: u32 = 0x1;
const WATCHDOG_TIMER_EXPIRED: u32 = 0x800;

const IDLE: u32 = 1;
const CLOSED_LOOP: u32 = 8;

/// Properties of a fake ODrive.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ODriveProperties {
    /// Major, minor and revision of its firmware.
    pub firmware: [u32; 3],
    /// Radius of the pulley on its shaft, m.
    pub radius_m: f64,
    /// `motor.config.torque_lim`, Nm.
    pub torque_limit_nm: f64,
    /// Whether it has been calibrated. Without that it closes no loop.
    pub calibrated: bool,
}

impl Default for ODriveProperties {
    fn default() -> Self {
        Self {
            firmware: [0, 5, 6],
            radius_m: 5e-3,
            torque_limit_nm: f64::INFINITY,
            calibrated: true,
        }
    }
}

/// A fake ODrive on the fake rig. It has no clock of its own: its caller passes the time.
#[derive(Debug)]
pub struct ODriveBoard {
    /// The carriage behind the pulley.
    rig: FakeRig,
    /// Torque of the shaft, Nm, and the largest of it.
    shaft_nm: f64,
    largest_nm: f64,
    /// Added to the angle of the shaft, rad.
    offset_rad: f64,
    properties: ODriveProperties,
    line: Vec<u8>,
    too_long: bool,
    state: u32,
    requested: u32,
    requested_at_ns: u64,
    error: u32,
    /// Of the board as a whole.
    board_error: u32,
    tripped: bool,
    torque_nm: f64,
    control_mode: f64,
    input_mode: f64,
    watchdog_on: bool,
    watchdog_timeout_s: f64,
    fed_at_ns: u64,
    misbehaviour: Option<Misbehaviour>,
}

impl ODriveBoard {
    /// A board that was just switched on, with its factory settings.
    #[must_use]
    pub fn new(rig: RigProperties, hand: Hand, properties: ODriveProperties) -> Self {
        Self {
            rig: FakeRig::new(rig, hand),
            shaft_nm: 0.0,
            largest_nm: 0.0,
            offset_rad: 0.0,
            properties,
            line: Vec::new(),
            too_long: false,
            state: IDLE,
            requested: 0,
            requested_at_ns: 0,
            error: 0,
            board_error: 0,
            tripped: false,
            torque_nm: 0.0,
            control_mode: 3.0,
            input_mode: 1.0,
            watchdog_on: false,
            watchdog_timeout_s: 0.0,
            fed_at_ns: 0,
            misbehaviour: None,
        }
    }

    /// The axis's error, as the bits of the documentation.
    #[must_use]
    pub fn error(&self) -> u32 {
        self.error
    }

    /// The axis's state, as the number of the documentation.
    #[must_use]
    pub fn state(&self) -> u32 {
        self.state
    }

    /// Time without a command after which the axis watchdog bites, s; nothing while it is off.
    #[must_use]
    pub fn watchdog(&self) -> Option<f64> {
        self.watchdog_on.then_some(self.watchdog_timeout_s)
    }

    /// Something fails: the axis is disarmed with these bits in its error.
    pub fn fail(&mut self, bits: u32) {
        self.error |= bits;
        self.disarm();
    }

    /// Something other than the axis fails, as the supply: every axis is disarmed, with these bits
    /// in the board's own error.
    pub fn fail_as_a_whole(&mut self, bits: u32) {
        self.board_error |= bits;
        self.disarm();
    }

    fn disarm(&mut self) {
        if self.misbehaviour == Some(Misbehaviour::StayEnabled) {
            return;
        }
        self.state = IDLE;
        self.requested = 0;
        self.apply();
    }

    fn watchdog_ns(&self) -> u64 {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "it saturates, as there"
        )]
        let timeout_ns = (self.watchdog_timeout_s * 1e9) as u64;
        timeout_ns
    }

    fn apply(&mut self) {
        let limit = self.properties.torque_limit_nm;
        #[expect(clippy::float_cmp, reason = "modes are small whole numbers")]
        let driven = self.state == CLOSED_LOOP && self.control_mode == 1.0 && self.input_mode == 1.0;
        self.shaft_nm = if driven {
            self.torque_nm.clamp(-limit, limit)
        } else {
            0.0
        };
        self.largest_nm = self.largest_nm.max(self.shaft_nm.abs());
        self.rig.drive(self.force_n());
    }

    /// Counts of the encoder in a turn; nothing for a perfect one.
    fn counts(&self) -> Option<f64> {
        let resolution_m = self.rig.properties().resolution_m;
        (resolution_m > 0.0).then(|| (TAU * self.properties.radius_m / resolution_m).round())
    }

    /// Counts of the encoder in a turn, as the board says them.
    fn counts_per_turn(&self) -> f64 {
        self.counts().unwrap_or(8192.0)
    }

    /// Angle of the shaft as its encoder counts it, turns, and its true speed, turns/s.
    fn turns(&self) -> (f64, f64) {
        let plant = self.rig.plant();
        let turns = (self.offset_rad + plant.position_m() / self.properties.radius_m) / TAU;
        let counted = self.counts().map_or(turns, |counts| (turns * counts).round() / counts);
        (counted, plant.velocity_mps() / self.properties.radius_m / TAU)
    }

    /// A line without its end: the answer, if there is one.
    fn hear_line(&mut self, line: &[u8], now_ns: u64) -> Option<Vec<u8>> {
        let line = line.split(|byte| *byte == b';').next().unwrap_or_default();
        let star = line.iter().position(|byte| *byte == b'*');
        let (command, checked) = match star {
            Some(at) if at + 1 < line.len() => {
                let sum = line[..at].iter().fold(0_u8, |sum, byte| sum ^ byte);
                let digits: String = line[at + 1..]
                    .iter()
                    .map(|byte| char::from(*byte))
                    .skip_while(char::is_ascii_whitespace)
                    .take_while(char::is_ascii_digit)
                    .collect();
                if digits.parse() != Ok(u32::from(sum)) {
                    return None;
                }
                (&line[..at], true)
            }
            _ => (line, false),
        };
        let command = String::from_utf8_lossy(command).into_owned();
        let is_lost = match self.misbehaviour {
            Some(Misbehaviour::IgnoreOff | Misbehaviour::StayEnabled) => {
                // Whatever torque is commanded, it feeds the watchdog.
                if command.starts_with("c ") {
                    self.fed_at_ns = now_ns;
                }
                command.starts_with("c ") || command.contains("requested_state 1")
            }
            Some(Misbehaviour::NoEcho) => command.starts_with("r "),
            _ => false,
        };
        if is_lost {
            return None;
        }
        let answer = self.obey(&command, now_ns)?;
        let sum = answer.bytes().fold(0_u8, |sum, byte| sum ^ byte);
        Some(
            if checked {
                format!("{answer}*{sum}\r\n")
            } else {
                format!("{answer}\r\n")
            }
            .into_bytes(),
        )
    }

    fn obey(&mut self, command: &str, now_ns: u64) -> Option<String> {
        let words: Vec<&str> = command.split_whitespace().collect();
        let first = command.chars().next();
        if matches!(first, Some('c' | 'f' | 'u'))
            && let Err(why) = check_axis(&words)
        {
            return Some(why);
        }
        match first {
            Some('c') => self.obey_torque(&words, now_ns).err(),
            Some('f') => {
                let (turns, speed) = self.turns();
                Some(format!("{turns:.6} {speed:.6}"))
            }
            Some('u') => {
                self.fed_at_ns = now_ns;
                None
            }
            Some('s') => {
                if command.starts_with("sc") {
                    self.error = 0;
                    self.board_error = 0;
                }
                None
            }
            Some('r') => Some(match words.get(1) {
                None => "invalid command format".to_owned(),
                Some(name) => self
                    .property(name)
                    .map(|value| value.chars().take(MAX_VALUE).collect())
                    .unwrap_or_else(|| "invalid property".to_owned()),
            }),
            Some('w') => match words.get(1) {
                None => Some("invalid command format".to_owned()),
                Some(name) => self.write(name, words.get(2).copied().unwrap_or_default(), now_ns),
            },
            _ => Some("unknown command".to_owned()),
        }
    }

    /// `c`: the torque, which feeds the watchdog.
    fn obey_torque(&mut self, words: &[&str], now_ns: u64) -> Result<(), String> {
        let torque_nm: f64 = words
            .get(2)
            .and_then(|word| word.parse().ok())
            .ok_or("invalid command format")?;
        // As there, no check that it is finite: a real motor is driven with it.
        self.torque_nm = if torque_nm.is_nan() { 0.0 } else { torque_nm };
        self.control_mode = 1.0;
        self.fed_at_ns = now_ns;
        self.apply();
        Ok(())
    }

    fn property(&self, name: &str) -> Option<String> {
        let [major, minor, revision] = self.properties.firmware;
        let old = (major, minor) == (0, 5);
        Some(match name {
            "fw_version_major" => major.to_string(),
            "fw_version_minor" => minor.to_string(),
            "fw_version_revision" => revision.to_string(),
            "vbus_voltage" => "24.087744".to_owned(),
            "error" if old => self.board_error.to_string(),
            "axis0.error" if old => self.error.to_string(),
            "axis0.active_errors" | "axis0.disarm_reason" if !old => self.error_of_6().to_string(),
            "axis0.current_state" => self.state.to_string(),
            "axis0.requested_state" => self.requested.to_string(),
            "axis0.config.watchdog_timeout" => format!("{:.6}", self.watchdog_timeout_s),
            "axis0.config.enable_watchdog" => u8::from(self.watchdog_on).to_string(),
            "axis0.controller.config.control_mode" => self.control_mode.to_string(),
            "axis0.controller.config.input_mode" => self.input_mode.to_string(),
            "axis0.controller.input_torque" => format!("{:.6}", self.torque_nm),
            "axis0.motor.config.torque_lim" if old => format!("{:.6}", self.properties.torque_limit_nm),
            "axis0.config.torque_soft_max" if !old => format!("{:.6}", self.properties.torque_limit_nm),
            "axis0.config.torque_soft_min" if !old => format!("{:.6}", -self.properties.torque_limit_nm),
            "axis0.encoder.config.cpr" if old => format!("{:.0}", self.counts_per_turn()),
            _ => return None,
        })
    }

    /// The same in the bits of firmware 0.6.
    fn error_of_6(&self) -> u32 {
        if self.error & WATCHDOG_TIMER_EXPIRED == 0 {
            self.error
        } else {
            0x0100_0000
        }
    }

    fn write(&mut self, name: &str, value: &str, now_ns: u64) -> Option<String> {
        let failed = || Some("not implemented".to_owned());
        let whole: Option<u32> = value.parse().ok();
        let number: Option<f64> = value.parse().ok();
        match (name, whole, number) {
            ("axis0.requested_state", Some(state), _) => {
                self.requested = state;
                self.requested_at_ns = now_ns;
            }
            ("axis0.config.watchdog_timeout", _, Some(timeout_s)) => self.watchdog_timeout_s = timeout_s,
            ("axis0.config.enable_watchdog", Some(on), _) => self.watchdog_on = on != 0,
            ("axis0.controller.config.control_mode", Some(mode), _) => self.control_mode = f64::from(mode),
            ("axis0.controller.config.input_mode", Some(mode), _) => self.input_mode = f64::from(mode),
            ("axis0.motor.config.torque_lim" | "axis0.config.torque_soft_max", _, Some(limit_nm))
                if self.property(name).is_some() =>
            {
                self.properties.torque_limit_nm = limit_nm;
            }
            // The same limit the other way.
            ("axis0.config.torque_soft_min", _, Some(_)) if self.property(name).is_some() => {}
            (name, ..) if self.property(name).is_some() => return failed(),
            _ => return Some("invalid property".to_owned()),
        }
        self.apply();
        None
    }
}

/// Whether a command names one of the two axes.
fn check_axis(words: &[&str]) -> Result<(), String> {
    let number: u32 = words
        .get(1)
        .and_then(|word| word.parse().ok())
        .ok_or("invalid command format")?;
    if number < 2 {
        Ok(())
    } else {
        Err(format!("invalid motor {number}"))
    }
}

impl ODriveBoard {
    /// Takes in bytes at a time, ns; returns the lines of its answers, with their ends.
    pub fn receive(&mut self, bytes: &[u8], now_ns: u64) -> Vec<Vec<u8>> {
        self.live_until(now_ns);
        let mut answers = Vec::new();
        for &byte in bytes {
            if matches!(byte, b'\r' | b'\n' | b'!') {
                let line = std::mem::take(&mut self.line);
                if !std::mem::take(&mut self.too_long) {
                    answers.extend(self.hear_line(&line, now_ns));
                }
            } else if self.line.len() >= MAX_LINE {
                self.line.clear();
                self.too_long = true;
            } else if !self.too_long {
                self.line.push(byte);
            }
        }
        answers
    }

    /// Lives until a time, ns, and its watchdog with it.
    pub fn live_until(&mut self, now_ns: u64) {
        if self.requested != 0 && now_ns >= self.requested_at_ns + STATE_PERIOD_NS {
            let requested = std::mem::take(&mut self.requested);
            self.rig.live_until(self.requested_at_ns + STATE_PERIOD_NS);
            if requested == CLOSED_LOOP && (self.error != 0 || self.board_error != 0 || !self.properties.calibrated) {
                self.error |= INVALID_STATE;
                self.state = IDLE;
            } else {
                self.state = if requested == CLOSED_LOOP { CLOSED_LOOP } else { IDLE };
                if self.state == CLOSED_LOOP {
                    self.tripped = false;
                }
            }
            self.apply();
        }
        // In every state, as there.
        let bites_at_ns = self.fed_at_ns + self.watchdog_ns();
        if self.watchdog_on && now_ns >= bites_at_ns && self.error & WATCHDOG_TIMER_EXPIRED == 0 {
            self.rig.live_until(bites_at_ns);
            self.tripped = true;
            self.fail(WATCHDOG_TIMER_EXPIRED);
        }
        self.rig.live_until(now_ns);
    }

    /// Whether the motor is on.
    #[must_use]
    pub fn is_on(&self) -> bool {
        self.state == CLOSED_LOOP
    }

    /// Whether the watchdog has switched the motor off since it was last on.
    #[must_use]
    pub fn watchdog_has_tripped(&self) -> bool {
        self.tripped
    }

    /// From now on the board itself does something wrong; what it has not, it does not.
    pub fn misbehave(&mut self, misbehaviour: Misbehaviour) {
        self.misbehaviour = Some(misbehaviour);
    }

    /// Force of the motor on the handle, N.
    #[must_use]
    pub fn force_n(&self) -> f64 {
        self.shaft_nm / self.properties.radius_m
    }

    /// Largest force of the motor since the last call, N.
    pub fn take_largest_force_n(&mut self) -> f64 {
        std::mem::replace(&mut self.largest_nm, self.shaft_nm.abs()) / self.properties.radius_m
    }

    /// Makes the encoder jump by a number of counts, as from a magnetic disturbance.
    pub fn jump(&mut self, counts: i32) {
        self.offset_rad += f64::from(counts) / self.counts_per_turn() * TAU;
    }

    /// The rig behind the pulley.
    #[must_use]
    pub fn rig(&self) -> &FakeRig {
        &self.rig
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn answered(board: &mut ODriveBoard, line: &str, now_ns: u64) -> String {
        String::from_utf8(board.receive(line.as_bytes(), now_ns).concat()).expect("text")
    }

    #[test]
    fn it_answers_as_the_documentation_says() {
        let mut board = ODriveBoard::new(RigProperties::default(), Hand::Free, ODriveProperties::default());
        for (line, answer) in [
            ("r vbus_voltage *93\n", "24.087744*32\r\n"),
            ("r vbus_voltage *94\n", ""),
            ("r vbus_voltage ; a comment\n", "24.087744\r\n"),
            ("f 0\n", "0.000000 0.000000\r\n"),
            ("f 2\n", "invalid motor 2\r\n"),
            ("f\n", "invalid command format\r\n"),
            ("c 0\n", "invalid command format\r\n"),
            ("c 0 0.1\n", ""),
            ("x\n", "unknown command\r\n"),
            ("r axis0.nothing\n", "invalid property\r\n"),
            ("w axis0.nothing 1\n", "invalid property\r\n"),
            ("w axis0.current_state 1\n", "not implemented\r\n"),
            ("r axis0.config.watchdog_timeout\n", "0.000000\r\n"),
        ] {
            assert_eq!(answered(&mut board, line, MS), answer, "{line}");
        }
    }
}
