//! The options of any controller, and of the mechanism on it: `?radius_mm=5&torque_limit_nm=0.5`.

use std::f64::consts::TAU;
use std::fmt;
use std::ops::RangeInclusive;
use std::path::PathBuf;

/// Default rate of a line, baud, as both makers have it. A USB controller has no rate and ignores
/// it.
const DEFAULT_BAUD: u32 = 115_200;

/// A controller on a serial line, and the pulley or capstan on its shaft. Every number is finite.
#[derive(Clone, Debug, PartialEq)]
pub struct MotorOptions {
    /// The line's node, or a symbolic link to it.
    pub path: PathBuf,
    /// Its rate, baud.
    pub baud: u32,
    /// Effective radius of the pulley, mm: a turn moves the handle by the circumference.
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

/// The options behind the question mark of an address, each at most once.
pub(crate) struct OptionReader<'a> {
    kind: &'a str,
    options: Vec<(&'a str, &'a str)>,
}

impl<'a> OptionReader<'a> {
    /// Splits a text into options, of which all must be known.
    pub(crate) fn new(kind: &'a str, known: &[&str], text: Option<&'a str>) -> Result<Self, String> {
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

    /// The text of an option, where it is given.
    pub(crate) fn get(&self, name: &str) -> Option<&'a str> {
        self.options
            .iter()
            .find_map(|(known, value)| (*known == name).then_some(*value))
    }

    /// A number that must be given, in a unit.
    pub(crate) fn number(
        &self,
        name: &str,
        unit: &str,
        range: RangeInclusive<f64>,
        example: &str,
    ) -> Result<f64, String> {
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

    /// The line and the mechanism.
    pub(crate) fn motor(&self, place: &str) -> Result<MotorOptions, String> {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn force_and_position_go_over_the_pulley_and_turn_together() {
        let options = OptionReader::new(
            "odrive",
            &["radius_mm", "torque_limit_nm", "direction"],
            Some("radius_mm=5&torque_limit_nm=0.1&direction=-1"),
        )
        .expect("known options");
        let motor = options.motor("x").expect("in range");
        assert!((motor.metres_per_turn() + TAU * 5e-3).abs() < 1e-15);
        assert!((motor.newtons_per_nm() + 200.0).abs() < 1e-9);
        assert!((motor.force_limit_n() - 20.0).abs() < 1e-9);
    }
}
