//! Every address of a rig: those of `device-io`, and those of the boards here.

use crate::odrive::{ODriveConnector, ODriveOptions};
use device_io::address::{FORMS, KINDS, place_and_options, unknown_kind};
use device_io::link::Connector;
use std::fmt;
use std::path::Path;
use std::str::FromStr;
use thiserror::Error;

/// The kinds of address that are boards here.
const BOARDS: &[&str] = &["odrive"];

/// Where a rig is, and which protocol it speaks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Address {
    /// The simulated rig in this process, or a rig that speaks the link protocol.
    Native(device_io::Address),
    /// An ODrive by its ASCII protocol. Never tried on a real one.
    ODrive(ODriveOptions),
}

/// A text that names no rig.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "`{address}` names no device: {why}; write {} or \
     odrive:/dev/ttyACM0?radius_mm=5&torque_limit_nm=0.1[&axis=0][&direction=-1][&baud=115200]",
    FORMS
)]
pub struct AddressError {
    address: String,
    why: String,
}

impl FromStr for Address {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        let kind = text.split_once(':').map_or(text, |(kind, _)| kind);
        match text.split_once(':') {
            Some(("odrive", rest)) => place_and_options(rest)
                .and_then(|(place, options)| ODriveOptions::parse(place, options))
                .map(Self::ODrive),
            _ if !KINDS.contains(&kind) => Err(unknown_kind(kind, &[KINDS, BOARDS].concat())),
            _ => text.parse().map(Self::Native),
        }
        .map_err(|why| AddressError {
            address: text.to_owned(),
            why,
        })
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Native(address) => address.fmt(f),
            Self::ODrive(options) => options.fmt(f),
        }
    }
}

impl Address {
    /// The simulated rig in this process.
    pub const FAKE: Self = Self::Native(device_io::Address::Fake);

    /// The node of a serial line.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::Native(address) => address.path(),
            Self::ODrive(options) => Some(&options.path),
        }
    }

    /// Checks that the line carries the commands of a loop at a rate, Hz. A controller that is asked for each position
    /// gets no more than it answers.
    ///
    /// # Errors
    /// It carries less; the error has the figures.
    pub fn check_rate(&self, rate_hz: f64) -> Result<(), String> {
        match self {
            Self::Native(address) => address.check_rate(rate_hz),
            Self::ODrive(_) => Ok(()),
        }
    }

    /// The connector of the rig; nothing for the rig in this process.
    #[must_use]
    pub fn connector(&self) -> Option<Box<dyn Connector>> {
        match self {
            Self::Native(address) => address.connector(),
            Self::ODrive(options) => Some(Box::new(ODriveConnector(options.clone()))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn device_address_parses_every_kind_and_error_lists_them() {
        for text in ["fake", "serial:/dev/ttyACM0?baud=500000", "hid:1209:000a:17"] {
            let address: Address = text.parse().expect(text);
            assert_eq!(Ok(&address), text.parse().map(Address::Native).as_ref());
            assert_eq!(address.to_string(), text);
        }
        assert_eq!("fake".parse(), Ok(Address::FAKE));
        for text in [
            "odrive:/dev/ttyACM0?radius_mm=5&torque_limit_nm=0.5",
            "odrive:/dev/ttyACM0?axis=1&torque_limit_nm=0.5&radius_mm=4.7625&direction=-1&baud=921600",
        ] {
            let address: Address = text.parse().expect(text);
            assert_eq!(address.to_string().parse(), Ok(address));
        }
        for (text, why) in [
            ("usb:1", "there is no kind `usb`"),
            (
                "odrve:/dev/ttyACM0",
                "there is no kind `odrve` (did you mean `odrive`?)",
            ),
            ("odrive:", "nothing follows its kind"),
            ("odrive", "nothing follows its kind `odrive`"),
            ("odrive:/dev/x?radius_mm=5", "odrive needs torque_limit_nm"),
        ] {
            let error = text.parse::<Address>().expect_err(text).to_string();
            let begin = format!("`{text}` names no device: {why}");
            let forms = ["; write fake, serial:", "hid:VID:PID[:SERIAL] or odrive:/dev/"];
            let has_forms = forms.iter().all(|form| error.contains(form));
            assert!(error.starts_with(&begin) && has_forms, "{error}");
        }
    }
}
