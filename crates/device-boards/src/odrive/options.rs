//! The options of an ODrive, and of the mechanism on it: `?radius_mm=5&torque_limit_nm=0.5`.

use std::f64::consts::TAU;
use std::fmt;
use std::path::PathBuf;

/// Rate of a line by default, baud. Its USB port has no rate and ignores it.
const DEFAULT_BAUD: u32 = 115_200;

const KNOWN: [&str; 5] = ["radius_mm", "torque_limit_nm", "axis", "direction", "baud"];

/// An ODrive by its ASCII protocol, on a serial line, and the pulley or capstan on its shaft.
#[derive(Clone, Debug, PartialEq)]
pub struct ODriveOptions {
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
    /// Which of its axes, 0 or 1.
    pub axis: u8,
}

// Every number in it is finite.
impl Eq for ODriveOptions {}

impl ODriveOptions {
    /// Reads a place and what follows the question mark.
    ///
    /// # Errors
    /// Which option is wrong, with its value, limits and unit.
    pub fn parse(place: &str, text: Option<&str>) -> Result<Self, String> {
        let mut options: Vec<(&str, &str)> = Vec::new();
        for option in text.iter().flat_map(|text| text.split('&')) {
            let (name, value) = option
                .split_once('=')
                .filter(|(name, _)| KNOWN.contains(name))
                .ok_or_else(|| format!("odrive has no option `{option}`; there are {}", KNOWN.join(", ")))?;
            if options.iter().any(|(earlier, _)| *earlier == name) {
                return Err(format!("{name} is given twice"));
            }
            options.push((name, value));
        }
        let get = |name: &str| {
            options
                .iter()
                .find(|(known, _)| *known == name)
                .map(|(_, value)| *value)
        };
        let number = |name: &str, unit: &str, (least, most): (f64, f64), example: &str| {
            let range = format!("from {least} to {most} {unit}");
            let value = get(name).ok_or_else(|| format!("odrive needs {name}, {range}, as in {name}={example}"))?;
            let number = value
                .parse()
                .ok()
                .filter(|number: &f64| (least..=most).contains(number));
            number.ok_or_else(|| format!("{name} = {value} is out of range: it must be {range}"))
        };
        let baud = get("baud").map_or(Ok(DEFAULT_BAUD), |text| {
            let baud = text
                .parse()
                .ok()
                .filter(|baud: &u32| (115_200..=12_000_000).contains(baud));
            baud.ok_or_else(|| format!("baud = {text} is out of range: it must be from 115200 to 12000000 baud"))
        })?;
        Ok(Self {
            path: place.into(),
            axis: match get("axis") {
                None | Some("0") => 0,
                Some("1") => 1,
                Some(other) => return Err(format!("axis = {other}: it must be 0 or 1")),
            },
            reversed: match get("direction") {
                None | Some("1") => false,
                Some("-1") => true,
                Some(other) => return Err(format!("direction = {other}: it must be 1 or -1")),
            },
            baud,
            radius_mm: number("radius_mm", "mm", (0.5, 500.0), "5")?,
            torque_limit_nm: number("torque_limit_nm", "Nm", (0.001, 50.0), "0.1")?,
        })
    }

    /// Metres of the handle to a turn of the shaft, with its sign.
    pub(super) fn metres_per_turn(&self) -> f64 {
        TAU * self.radius_m()
    }

    /// Force on the handle to a torque of the shaft, N/Nm, with its sign.
    pub(super) fn newtons_per_nm(&self) -> f64 {
        1.0 / self.radius_m()
    }

    fn radius_m(&self) -> f64 {
        let radius_m = self.radius_mm * 1e-3;
        if self.reversed { -radius_m } else { radius_m }
    }
}

impl fmt::Display for ODriveOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "odrive:{}?radius_mm={}&torque_limit_nm={}&direction={}&baud={}&axis={}",
            self.path.display(),
            self.radius_mm,
            self.torque_limit_nm,
            if self.reversed { -1 } else { 1 },
            self.baud,
            self.axis
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_option_is_checked_and_the_error_names_it() {
        for (options, why) in [
            ("radius_mm=5", "odrive needs torque_limit_nm, from 0.001 to 50 Nm"),
            (
                "radius_mm=0",
                "radius_mm = 0 is out of range: it must be from 0.5 to 500 mm",
            ),
            ("radius_mm=nan", "radius_mm = nan is out of range"),
            (
                "torque_limit_nm=-1&radius_mm=5",
                "torque_limit_nm = -1 is out of range: it must be from 0.001 to 50 Nm",
            ),
            ("torque_limit_nm=inf&radius_mm=5", "torque_limit_nm = inf"),
            ("axis=2", "axis = 2: it must be 0 or 1"),
            ("direction=0", "direction = 0: it must be 1 or -1"),
            (
                "baud=9600",
                "baud = 9600 is out of range: it must be from 115200 to 12000000 baud",
            ),
            ("radius_mm=5&radius_mm=6", "radius_mm is given twice"),
            ("radius=5", "no option `radius=5`; there are radius_mm, torque_limit_nm"),
            ("radius_mm", "no option `radius_mm`"),
            ("", "no option ``"),
        ] {
            let error = ODriveOptions::parse("x", Some(options)).expect_err(why);
            assert!(error.contains(why), "{error}");
        }
        let error = ODriveOptions::parse("x", None).expect_err("nothing");
        assert_eq!(error, "odrive needs radius_mm, from 0.5 to 500 mm, as in radius_mm=5");
    }
}
