//! The options of a SimpleFOC board.

use super::target_unit::TargetUnit;
use crate::motor_options::{MotorOptions, OptionReader};
use std::fmt;

/// A board with SimpleFOC's Commander.
#[derive(Clone, Debug, PartialEq)]
pub struct SimpleFocOptions {
    /// Its line and mechanism.
    pub motor: MotorOptions,
    /// The letter by which its firmware knows the motor.
    pub letter: char,
    /// Torque of the shaft to one unit of its target, which is a volt or an ampere, Nm.
    pub nm_per_unit: f64,
    /// The unit of a target, where the board's answers do not say it.
    pub target: Option<TargetUnit>,
    /// Time without a command after which the sketch disables the motor, ms, as the builder says;
    /// the library has nothing like it.
    pub host_timeout_ms: Option<u32>,
}

// Every number in it is finite.
impl Eq for SimpleFocOptions {}

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
            "motor",
            "target",
            "host_timeout_ms",
            "direction",
            "baud",
        ];
        let reader = OptionReader::new("simplefoc", &known, options)?;
        let letter = match reader.get("motor").unwrap_or("M").as_bytes() {
            [letter] if letter.is_ascii_alphabetic() => char::from(*letter),
            other => {
                return Err(format!(
                    "motor = {}: it must be the one letter that the firmware gives to commander.add",
                    String::from_utf8_lossy(other)
                ));
            }
        };
        Ok(Self {
            motor: reader.motor(place)?,
            letter,
            target: match reader.get("target") {
                None => None,
                Some("A") => Some(TargetUnit::Ampere),
                Some("V") => Some(TargetUnit::Volt),
                Some(other) => return Err(format!("target = {other}: it must be A or V")),
            },
            host_timeout_ms: reader
                .get("host_timeout_ms")
                .map(|text| {
                    text.parse()
                        .ok()
                        .filter(|ms| (1..=200).contains(ms))
                        .ok_or_else(|| format!("host_timeout_ms = {text} is out of range: it must be from 1 to 200 ms"))
                })
                .transpose()?,
            nm_per_unit: reader.number(
                "nm_per_unit",
                "Nm per volt or ampere of the target",
                1e-4..=100.0,
                "0.05",
            )?,
        })
    }
}

impl fmt::Display for SimpleFocOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "simplefoc:{}&nm_per_unit={}&motor={}",
            self.motor, self.nm_per_unit, self.letter
        )?;
        if let Some(target) = self.target {
            write!(f, "&target={target}")?;
        }
        if let Some(ms) = self.host_timeout_ms {
            write!(f, "&host_timeout_ms={ms}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_option_is_checked_and_the_error_names_it() {
        for (options, why) in [
            ("", "simplefoc needs nm_per_unit"),
            ("&nm_per_unit=0", "nm_per_unit = 0 is out of range"),
            ("&nm_per_unit=1&motor=MM", "motor = MM"),
            ("&nm_per_unit=1&motor=3", "motor = 3"),
            ("&nm_per_unit=1&motor=", "motor = "),
            ("&nm_per_unit=1&target=Nm", "target = Nm: it must be A or V"),
            (
                "&nm_per_unit=1&host_timeout_ms=0",
                "host_timeout_ms = 0 is out of range: it must be from 1 to 200 ms",
            ),
        ] {
            let options = format!("radius_mm=5&torque_limit_nm=1{options}");
            let error = SimpleFocOptions::parse("x", Some(&options)).expect_err(why);
            assert!(error.contains(why), "{error}");
        }
    }
}
