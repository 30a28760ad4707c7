//! How a rig is named: `fake`, `serial:/dev/ttyACM0?baud=1000000`.

use crate::link::{Connector, SerialConnector};
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;
use thiserror::Error;

/// Where a rig is, and what it speaks.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Address {
    /// The simulated rig in this process.
    Fake,
    /// A rig that speaks the link protocol on a serial line.
    Serial {
        /// The line's node, or a symbolic link to it.
        path: PathBuf,
        /// Its rate, baud.
        baud: u32,
    },
}

/// What a line runs at where nothing is said, baud.
pub const DEFAULT_BAUD: u32 = 1_000_000;

/// A name that names no rig.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error("`{address}` names no device: {why}; write fake or serial:/dev/ttyACM0[?baud=1000000]")]
pub struct AddressError {
    address: String,
    why: String,
}

impl FromStr for Address {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        let wrong = |why: String| AddressError {
            address: text.to_owned(),
            why,
        };
        if text == "fake" {
            return Ok(Self::Fake);
        }
        let (kind, rest) = text
            .split_once(':')
            .ok_or_else(|| wrong("it has no kind before a colon".to_owned()))?;
        let (place, options) = rest
            .split_once('?')
            .map_or((rest, None), |(place, options)| (place, Some(options)));
        if place.is_empty() {
            return Err(wrong("nothing follows its kind".to_owned()));
        }
        match kind {
            "serial" => {
                let mut baud = DEFAULT_BAUD;
                for option in options.iter().flat_map(|options| options.split('&')) {
                    let value = option
                        .strip_prefix("baud=")
                        .ok_or_else(|| wrong(format!("a serial line has no option `{option}`")))?;
                    baud = value
                        .parse()
                        .ok()
                        .filter(|baud| (1200..=12_000_000).contains(baud))
                        .ok_or_else(|| {
                            wrong(format!(
                                "baud = {value} is out of range: it must be from 1200 to 12000000"
                            ))
                        })?;
                }
                Ok(Self::Serial {
                    path: place.into(),
                    baud,
                })
            }
            _ => Err(wrong(format!("there is no kind `{kind}`"))),
        }
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fake => f.write_str("fake"),
            Self::Serial { path, baud } => write!(f, "serial:{}?baud={baud}", path.display()),
        }
    }
}

impl Address {
    /// What connects to the rig; nothing for the one in this process.
    #[must_use]
    pub fn connector(&self) -> Option<Box<dyn Connector>> {
        match self {
            Self::Fake => None,
            Self::Serial { path, baud } => Some(Box::new(SerialConnector::new(path.clone(), *baud))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_names_a_rig_or_says_why_it_does_not() {
        let serial = |path: &str, baud| Address::Serial {
            path: path.into(),
            baud,
        };
        for (text, address) in [
            ("fake", Address::Fake),
            ("serial:/dev/ttyACM0", serial("/dev/ttyACM0", 1_000_000)),
            ("serial:/dev/ttyUSB0?baud=500000", serial("/dev/ttyUSB0", 500_000)),
            ("serial:rig", serial("rig", 1_000_000)),
        ] {
            assert_eq!(text.parse(), Ok(address.clone()));
            assert_eq!(address.to_string().parse(), Ok(address));
        }
        for (text, why) in [
            ("", "no kind"),
            ("fakes", "no kind"),
            ("usb:1", "`usb`"),
            ("serial:", "nothing follows"),
            ("serial:/dev/x?baud=9", "from 1200"),
            ("serial:/dev/x?speed=9600", "`speed=9600`"),
        ] {
            let error = text.parse::<Address>().expect_err(text).to_string();
            assert!(error.contains(why) && error.contains("serial:/dev/ttyACM0"), "{error}");
        }
    }
}
