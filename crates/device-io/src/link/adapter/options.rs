//! What a builder says of a controller and of the mechanism on it: `?radius_mm=5&torque_limit_nm=0.5`.

use std::f64::consts::TAU;
use std::fmt;
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// What a line runs at where nothing is said, baud: both makers' default. A USB controller has no rate and ignores it.
const DEFAULT_BAUD: u32 = 115_200;

/// Time-outs that a firmware may have been given, ms.
const TIMEOUT_MS: RangeInclusive<u32> = 1..=1000;

/// A controller on a serial line, and the pulley or capstan on its shaft. Every number is finite.
#[derive(Clone, Debug, PartialEq)]
pub struct MotorOptions {
    /// The line's node, or a symbolic link to it.
    pub path: PathBuf,
    /// Its rate, baud.
    pub baud: u32,
    /// Effective radius of the pulley: the handle goes a turn's worth of its circumference, mm.
    pub radius_mm: f64,
    /// Largest torque of the shaft, Nm.
    pub torque_limit_nm: f64,
    /// Whether the shaft's positive direction is the handle's negative one.
    pub reversed: bool,
}

impl MotorOptions {
    /// Metres of the handle to a turn of the shaft, with its sign.
    #[must_use]
    pub fn metres_per_turn(&self) -> f64 {
        TAU * self.radius_m()
    }

    /// Force on the handle to a torque of the shaft, N/Nm, with its sign.
    #[must_use]
    pub fn newtons_per_nm(&self) -> f64 {
        1.0 / self.radius_m()
    }

    /// Largest force on the handle, N.
    #[must_use]
    pub fn force_limit_n(&self) -> f64 {
        (self.torque_limit_nm * self.newtons_per_nm()).abs()
    }

    fn radius_m(&self) -> f64 {
        let radius_m = self.radius_mm * 1e-3;
        if self.reversed { -radius_m } else { radius_m }
    }
}

/// An ODrive by its ASCII protocol.
#[derive(Clone, Debug, PartialEq)]
pub struct ODriveOptions {
    /// Its line and mechanism.
    pub motor: MotorOptions,
    /// Which of its axes, 0 or 1.
    pub axis: u8,
}

/// A board with SimpleFOC's Commander.
#[derive(Clone, Debug, PartialEq)]
pub struct SimpleFocOptions {
    /// Its line and mechanism.
    pub motor: MotorOptions,
    /// The letter by which its firmware knows the motor.
    pub letter: char,
    /// Torque of the shaft to one unit of its target, which is a volt or an ampere, Nm.
    pub nm_per_unit: f64,
    /// The time-out that was written into its firmware, as docs/adapters.md has it, ms; the Commander has none of its own, and this cannot be asked for.
    pub timeout_ms: Option<u32>,
}

// Every number in them is finite.
impl Eq for ODriveOptions {}
impl Eq for SimpleFocOptions {}

/// Options as they are read, each at most once.
struct Reader<'a> {
    kind: &'a str,
    options: Vec<(&'a str, &'a str)>,
}

impl<'a> Reader<'a> {
    fn new(kind: &'a str, known: &[&str], text: Option<&'a str>) -> Result<Self, String> {
        let mut options: Vec<(&str, &str)> = Vec::new();
        for option in text.iter().flat_map(|text| text.split('&')) {
            let (name, value) = option
                .split_once('=')
                .filter(|(name, _)| known.contains(name))
                .ok_or_else(|| format!("{kind} has no option `{option}`; there are {}", known.join(", ")))?;
            if options.iter().any(|(earlier, _)| *earlier == name) {
                return Err(format!("{name} is said twice"));
            }
            options.push((name, value));
        }
        Ok(Self { kind, options })
    }

    fn get(&self, name: &str) -> Option<&'a str> {
        self.options
            .iter()
            .find_map(|(known, value)| (*known == name).then_some(*value))
    }

    /// A number that must be said, in a unit.
    fn number(&self, name: &str, unit: &str, range: RangeInclusive<f64>, example: &str) -> Result<f64, String> {
        let (least, most) = (range.start(), range.end());
        let Some(text) = self.get(name) else {
            return Err(format!(
                "{} needs {name}, from {least} to {most} {unit}, as in {name}={example}",
                self.kind
            ));
        };
        text.parse()
            .ok()
            .filter(|value| range.contains(value))
            .ok_or_else(|| format!("{name} = {text} is out of range: it must be from {least} to {most} {unit}"))
    }

    fn motor(&self, place: &str) -> Result<MotorOptions, String> {
        let baud = self.get("baud").map_or(Ok(DEFAULT_BAUD), |text| {
            text.parse()
                .ok()
                .filter(|baud| (115_200..=12_000_000).contains(baud))
                .ok_or_else(|| format!("baud = {text} is out of range: it must be from 115200 to 12000000 baud"))
        })?;
        let reversed = match self.get("direction") {
            None | Some("1") => false,
            Some("-1") => true,
            Some(other) => return Err(format!("direction = {other}: it must be 1 or -1")),
        };
        Ok(MotorOptions {
            path: place.into(),
            baud,
            radius_mm: self.number("radius_mm", "mm", 0.5..=500.0, "5")?,
            torque_limit_nm: self.number("torque_limit_nm", "Nm", 0.001..=50.0, "0.1")?,
            reversed,
        })
    }
}

impl ODriveOptions {
    /// Reads a place and what follows the question mark.
    ///
    /// # Errors
    /// Which option is wrong, with its value, limits and unit.
    pub fn parse(place: &str, options: Option<&str>) -> Result<Self, String> {
        let known = ["radius_mm", "torque_limit_nm", "axis", "direction", "baud"];
        let reader = Reader::new("odrive", &known, options)?;
        let axis = match reader.get("axis") {
            None | Some("0") => 0,
            Some("1") => 1,
            Some(other) => return Err(format!("axis = {other}: it must be 0 or 1")),
        };
        Ok(Self {
            motor: reader.motor(place)?,
            axis,
        })
    }
}

impl SimpleFocOptions {
    /// Reads a place and what follows the question mark.
    ///
    /// # Errors
    /// Which option is wrong, with its value, limits and unit.
    pub fn parse(place: &str, options: Option<&str>) -> Result<Self, String> {
        let known = [
            "radius_mm",
            "torque_limit_nm",
            "nm_per_unit",
            "timeout_ms",
            "motor",
            "direction",
            "baud",
        ];
        let reader = Reader::new("simplefoc", &known, options)?;
        let letter = match reader.get("motor").unwrap_or("M").as_bytes() {
            [letter] if letter.is_ascii_alphabetic() => char::from(*letter),
            other => {
                return Err(format!(
                    "motor = {}: it must be the one letter that the firmware gives to commander.add",
                    String::from_utf8_lossy(other)
                ));
            }
        };
        let timeout_ms = reader.get("timeout_ms").map(|text| {
            text.parse().ok().filter(|ms| TIMEOUT_MS.contains(ms)).ok_or_else(|| {
                let (least, most) = (TIMEOUT_MS.start(), TIMEOUT_MS.end());
                format!("timeout_ms = {text} ms is out of range: it must be from {least} to {most} ms")
            })
        });
        Ok(Self {
            timeout_ms: timeout_ms.transpose()?,
            motor: reader.motor(place)?,
            letter,
            nm_per_unit: reader.number(
                "nm_per_unit",
                "Nm per volt or ampere of the target",
                1e-4..=100.0,
                "0.05",
            )?,
        })
    }
}

impl fmt::Display for MotorOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{}?radius_mm={}&torque_limit_nm={}&direction={}&baud={}",
            self.path.display(),
            self.radius_mm,
            self.torque_limit_nm,
            if self.reversed { -1 } else { 1 },
            self.baud
        )
    }
}

impl fmt::Display for ODriveOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "odrive:{}&axis={}", self.motor, self.axis)
    }
}

impl fmt::Display for SimpleFocOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "simplefoc:{}&nm_per_unit={}&motor={}",
            self.motor, self.nm_per_unit, self.letter
        )?;
        match self.timeout_ms {
            Some(timeout_ms) => write!(f, "&timeout_ms={timeout_ms}"),
            None => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn force_and_position_go_over_the_pulley_and_turn_together() {
        let options = ODriveOptions::parse("x", Some("radius_mm=5&torque_limit_nm=0.1&direction=-1")).expect("right");
        assert!((options.motor.metres_per_turn() + TAU * 5e-3).abs() < 1e-15);
        assert!((options.motor.newtons_per_nm() + 200.0).abs() < 1e-9);
        assert!((options.motor.force_limit_n() - 20.0).abs() < 1e-9);
    }

    #[test]
    fn every_option_is_checked_and_the_error_names_it() {
        for (options, why) in [
            (None, "odrive needs radius_mm, from 0.5 to 500 mm, as in radius_mm=5"),
            (Some("radius_mm=5"), "odrive needs torque_limit_nm, from 0.001 to 50 Nm"),
            (
                Some("radius_mm=0&torque_limit_nm=1"),
                "radius_mm = 0 is out of range: it must be from 0.5 to 500 mm",
            ),
            (
                Some("radius_mm=nan&torque_limit_nm=1"),
                "radius_mm = nan is out of range",
            ),
            (
                Some("radius_mm=5&torque_limit_nm=-1"),
                "torque_limit_nm = -1 is out of range: it must be from 0.001 to 50 Nm",
            ),
            (Some("radius_mm=5&torque_limit_nm=inf"), "torque_limit_nm = inf"),
            (
                Some("radius_mm=5&torque_limit_nm=1&axis=2"),
                "axis = 2: it must be 0 or 1",
            ),
            (
                Some("radius_mm=5&torque_limit_nm=1&direction=0"),
                "direction = 0: it must be 1 or -1",
            ),
            (
                Some("radius_mm=5&torque_limit_nm=1&baud=9600"),
                "baud = 9600 is out of range: it must be from 115200 to 12000000 baud",
            ),
            (
                Some("radius_mm=5&radius_mm=6&torque_limit_nm=1"),
                "radius_mm is said twice",
            ),
            (
                Some("radius=5"),
                "no option `radius=5`; there are radius_mm, torque_limit_nm",
            ),
            (Some("radius_mm"), "no option `radius_mm`"),
            (Some(""), "no option ``"),
        ] {
            let error = ODriveOptions::parse("x", options).expect_err(why);
            assert!(error.contains(why), "{error}");
        }
        for (options, why) in [
            ("", "simplefoc needs nm_per_unit"),
            ("&nm_per_unit=0", "nm_per_unit = 0 is out of range"),
            ("&nm_per_unit=1&motor=MM", "motor = MM"),
            ("&nm_per_unit=1&motor=3", "motor = 3"),
            (
                "&nm_per_unit=1&timeout_ms=0",
                "timeout_ms = 0 ms is out of range: it must be from 1 to 1000 ms",
            ),
            ("&nm_per_unit=1&motor=", "motor = "),
        ] {
            let options = format!("radius_mm=5&torque_limit_nm=1{options}");
            let error = SimpleFocOptions::parse("x", Some(&options)).expect_err(why);
            assert!(error.contains(why), "{error}");
        }
    }
}
