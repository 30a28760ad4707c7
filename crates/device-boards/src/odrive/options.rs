//! The options of an ODrive.

use crate::motor_options::{MotorOptions, OptionReader};
use std::fmt;

/// An ODrive by its ASCII protocol.
#[derive(Clone, Debug, PartialEq)]
pub struct ODriveOptions {
    /// Its line and mechanism.
    pub motor: MotorOptions,
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
    pub fn parse(place: &str, options: Option<&str>) -> Result<Self, String> {
        let known = ["radius_mm", "torque_limit_nm", "axis", "direction", "baud"];
        let reader = OptionReader::new("odrive", &known, options)?;
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

impl fmt::Display for ODriveOptions {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "odrive:{}&axis={}", self.motor, self.axis)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
    }
}
