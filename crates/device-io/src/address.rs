//! How a rig is named: `fake`, `serial:/dev/ttyACM0?baud=1000000`, `hid:1209:0001:SERIAL`.

use crate::link::{Connector, HidConnector, HidId, SerialConnector, serial};
use crate::protocol::view::Axes;
use haptic_core::nearest::nearest;
use std::fmt;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Where a rig is, for a rig that speaks the link protocol or runs in this process.
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
    /// A rig that speaks the link protocol on USB HID.
    Hid(HidId),
}

/// The rate of a line by default, baud. A pseudo-terminal and a board with native USB have none, and carry more.
pub const DEFAULT_BAUD: u32 = 1_000_000;

/// Slowest line, baud: a command of zero force behind the 20 that may be under way is at the device in 50 ms.
pub const SLOWEST_BAUD: u32 = 100_000;

/// The forms of an address, for an error's text.
pub const FORMS: &str = "fake, serial:/dev/ttyACM0[?baud=1000000], hid:VID:PID[:SERIAL]";

/// The kinds of address.
pub const KINDS: &[&str] = &["fake", "serial", "hid"];

/// Why a text names no rig: its kind is none of those that are known, or it is a kind alone.
#[must_use]
pub fn unknown_kind(kind: &str, known: &[&str]) -> String {
    match nearest(kind, known) {
        Some(meant) if meant == kind => format!("nothing follows its kind `{kind}`"),
        Some(meant) => format!("there is no kind `{kind}` (did you mean `{meant}`?)"),
        None => format!("there is no kind `{kind}`"),
    }
}

impl FromStr for Address {
    /// Why the text names no rig.
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "fake" {
            return Ok(Self::Fake);
        }
        let (kind, rest) = text.split_once(':').ok_or_else(|| unknown_kind(text, KINDS))?;
        if kind == "hid" {
            return hid(rest).map(Self::Hid);
        }
        let (place, options) = place_and_options(rest)?;
        if kind != "serial" {
            return Err(unknown_kind(kind, KINDS));
        }
        let mut baud = DEFAULT_BAUD;
        for option in options.iter().flat_map(|options| options.split('&')) {
            let value = option
                .strip_prefix("baud=")
                .ok_or_else(|| format!("a serial line has no option `{option}`"))?;
            baud = value
                .parse()
                .ok()
                .filter(|baud| (SLOWEST_BAUD..=12_000_000).contains(baud))
                .ok_or_else(|| {
                    format!(
                        "baud = {value} is out of range: it must be from {SLOWEST_BAUD} to 12000000 baud, as a stop is \
                         late on a line of less than 10 kB/s"
                    )
                })?;
        }
        Ok(Self::Serial {
            path: place.into(),
            baud,
        })
    }
}

/// Splits the part of an address behind its kind: the node's path, and the options after a question
/// mark.
///
/// # Errors
/// There is no path.
pub fn place_and_options(text: &str) -> Result<(&str, Option<&str>), String> {
    let (place, options) = text
        .split_once('?')
        .map_or((text, None), |(place, options)| (place, Some(options)));
    if place.is_empty() {
        return Err("nothing follows its kind".to_owned());
    }
    Ok((place, options))
}

/// What follows `hid:`. A serial number may hold anything, colons too.
fn hid(text: &str) -> Result<HidId, String> {
    let mut parts = text.splitn(3, ':');
    let mut number = |what: &str| {
        let digits = parts.next().unwrap_or_default();
        if digits.len() == 4 && digits.bytes().all(|digit| digit.is_ascii_hexdigit()) {
            u16::from_str_radix(digits, 16).map_err(|error| error.to_string())
        } else {
            Err(format!(
                "its {what} `{digits}` is not of four hexadecimal digits, as lsusb shows them"
            ))
        }
    };
    let (vendor, product) = (number("vendor")?, number("product")?);
    let serial = parts.next().map(str::to_owned);
    if serial.as_deref() == Some("") {
        return Err("nothing follows the colon after its product".to_owned());
    }
    Ok(HidId {
        vendor,
        product,
        serial,
    })
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Fake => f.write_str("fake"),
            Self::Serial { path, baud } => write!(f, "serial:{}?baud={baud}", path.display()),
            Self::Hid(id) => write!(f, "hid:{id}"),
        }
    }
}

impl Address {
    /// The node of a serial line.
    #[must_use]
    pub fn path(&self) -> Option<&Path> {
        match self {
            Self::Serial { path, .. } => Some(path),
            Self::Fake | Self::Hid(_) => None,
        }
    }

    /// Checks that the line carries the commands of a loop at a rate, Hz. A line at the default rate is checked when it
    /// is opened, as it may have no rate.
    ///
    /// # Errors
    /// It carries less; the error has the figures.
    pub fn check_rate(&self, rate_hz: f64) -> Result<(), String> {
        match self {
            Self::Serial { baud, .. } if *baud < DEFAULT_BAUD => serial::check_commands(*baud, rate_hz, Axes::One),
            _ => Ok(()),
        }
    }

    /// The connector of the rig; nothing for the rig in this process.
    #[must_use]
    pub fn connector(&self) -> Option<Box<dyn Connector>> {
        match self {
            Self::Fake => None,
            Self::Serial { path, baud } => Some(Box::new(SerialConnector {
                path: path.clone(),
                baud: *baud,
            })),
            Self::Hid(id) => Some(Box::new(HidConnector { id: id.clone() })),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // hazard: H23
    #[test]
    fn a_line_that_cannot_carry_the_loop_is_refused_with_figures() {
        let check = |address: &str, rate_hz| address.parse::<Address>().expect("right").check_rate(rate_hz);
        let refused = check("serial:x?baud=115200", 1000.0).expect_err("18 kB/s on 11.52 kB/s");
        for part in ["115200 baud", "11520", "18000", "rate = 1000 Hz", "640", "180000"] {
            assert!(refused.contains(part), "{refused} lacks {part}");
        }
        for (address, rate_hz, carries) in [
            ("serial:x?baud=115200", 640.0, true),
            ("serial:x?baud=115200", 641.0, false),
            ("serial:x?baud=500000", 2000.0, true),
            ("serial:x?baud=500000", 4000.0, false),
            ("serial:x", 20_000.0, true),
            ("fake", 20_000.0, true),
        ] {
            assert_eq!(check(address, rate_hz).is_ok(), carries, "{address} at {rate_hz} Hz");
        }
    }

    #[test]
    fn an_address_names_a_rig_or_says_why_it_does_not() {
        let serial = |path: &str, baud| Address::Serial {
            path: path.into(),
            baud,
        };
        let hid = |vendor, product, serial: Option<&str>| {
            Address::Hid(HidId {
                vendor,
                product,
                serial: serial.map(str::to_owned),
            })
        };
        for (text, address) in [
            ("fake", Address::Fake),
            ("serial:/dev/ttyACM0", serial("/dev/ttyACM0", 1_000_000)),
            ("serial:/dev/ttyUSB0?baud=500000", serial("/dev/ttyUSB0", 500_000)),
            ("serial:rig", serial("rig", 1_000_000)),
            ("hid:1209:000a", hid(0x1209, 0x000A, None)),
            ("hid:1209:ABCD:17", hid(0x1209, 0xABCD, Some("17"))),
            ("hid:0000:ffff:a:b?c d", hid(0, 0xFFFF, Some("a:b?c d"))),
        ] {
            assert_eq!(text.parse(), Ok(address.clone()));
            assert_eq!(address.to_string().parse(), Ok(address));
        }
        for (text, why) in [
            ("", "no kind"),
            ("fakes", "no kind"),
            ("usb:1", "`usb`"),
            ("serial:", "nothing follows"),
            ("serial:/dev/x?baud=9", "from 100000"),
            ("serial:/dev/x?baud=57600", "10 kB/s"),
            ("serial:/dev/x?speed=9600", "`speed=9600`"),
            ("hid:", "its vendor ``"),
            ("hid:1209", "its product ``"),
            ("hid:129:0001", "its vendor `129`"),
            ("hid:1209:+001", "its product `+001`"),
            ("hid:0x1209:0001", "its vendor `0x1209`"),
            ("hid:1209:0001:", "nothing follows"),
            ("hid:/dev/hidraw0", "`/dev/hidraw0` is not of four"),
        ] {
            let error = text.parse::<Address>().expect_err(text);
            assert!(error.contains(why), "{error}");
        }
    }
}
