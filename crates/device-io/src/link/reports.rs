//! The lengths of a HID device's reports, from its report descriptor (USB HID 1.11, section 6.2.2).

use crate::protocol::view::{Axes, Kind};

/// Lengths of a device's reports, bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Reports {
    /// From the device.
    pub(crate) input: usize,
    /// To the device.
    pub(crate) output: usize,
}

/// The refusal of a descriptor that ends within an item.
const BROKEN_OFF: &str = "its report descriptor breaks off";

/// Longest report of the link protocol, bytes.
pub(crate) const MAX_REPORT: usize = 64;

/// Longest messages from and to a device of one axis, bytes. A device of two says so only in its hello: that does not
/// fit up, and the connector looks whether its commands do down.
const MIN_UP: usize = Kind::DeviceHello.length(Axes::One);
const MIN_DOWN: usize = Kind::Command.length(Axes::One);

impl Reports {
    /// Reads a descriptor of a device that can carry the link protocol.
    ///
    /// # Errors
    /// Its reports begin with a number, are too short for a hello or a command, or too long; or it breaks off.
    pub(crate) fn of(descriptor: &[u8]) -> Result<Self, String> {
        /// The values that Push and Pop save, as far as they matter here.
        #[derive(Clone, Copy, Default)]
        struct Globals {
            size_bits: u64,
            count: u64,
        }
        let (mut globals, mut pushed) = (Globals::default(), Vec::new());
        let (mut input_bits, mut output_bits) = (0_u64, 0_u64);
        let mut rest = descriptor;
        while let [prefix, after @ ..] = rest {
            if *prefix == 0xFE {
                // A long item: its length, its tag, its bytes. None is defined.
                let [length, _, after @ ..] = after else {
                    return Err(BROKEN_OFF.to_owned());
                };
                rest = after.get(usize::from(*length)..).ok_or(BROKEN_OFF)?;
                continue;
            }
            let length = match prefix & 3 {
                3 => 4,
                length => usize::from(length),
            };
            let (value, after) = after.split_at_checked(length).ok_or(BROKEN_OFF)?;
            let value = value.iter().rev().fold(0, |value, byte| value << 8 | u64::from(*byte));
            match prefix & 0xFC {
                0x74 => globals.size_bits = value,
                0x94 => globals.count = value,
                0x84 => return Err("its reports have numbers, and those of the link protocol have none".to_owned()),
                0xA4 => pushed.push(globals),
                0xB4 => globals = pushed.pop().unwrap_or_default(),
                0x80 => input_bits = input_bits.saturating_add(globals.size_bits * globals.count),
                0x90 => output_bits = output_bits.saturating_add(globals.size_bits * globals.count),
                _ => {}
            }
            rest = after;
        }
        let bytes = |bits: u64| usize::try_from(bits.div_ceil(8)).unwrap_or(usize::MAX);
        let reports = Self {
            input: bytes(input_bits),
            output: bytes(output_bits),
        };
        if (MIN_UP..=MAX_REPORT).contains(&reports.input) && (MIN_DOWN..=MAX_REPORT).contains(&reports.output) {
            Ok(reports)
        } else {
            Err(format!(
                "its reports carry {} bytes up and {} down, and the link protocol needs {MIN_UP} and {MIN_DOWN}, at most \
                 {MAX_REPORT}",
                reports.input, reports.output
            ))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A vendor's own collection with reports of a number of bytes each way.
    fn descriptor(input: u8, output: u8) -> Vec<u8> {
        let mut descriptor = vec![
            0x06, 0x00, 0xFF, 0x09, 0x01, 0xA1, 0x01, 0x15, 0x00, 0x26, 0xFF, 0x00, 0x75, 0x08,
        ];
        descriptor.extend([0x95, input, 0x09, 0x01, 0x81, 0x02]);
        descriptor.extend([0x95, output, 0x09, 0x01, 0x91, 0x02, 0xC0]);
        descriptor
    }

    #[test]
    fn lengths_are_read_from_the_descriptor() {
        let fits = |input, output| Reports::of(&descriptor(input, output));
        assert_eq!(fits(64, 64), Ok(Reports { input: 64, output: 64 }));
        assert_eq!(fits(48, 12), Ok(Reports { input: 48, output: 12 }));
        for (input, output) in [(47, 12), (48, 11), (65, 64), (64, 65), (64, 0)] {
            let unfit = format!(
                "its reports carry {input} bytes up and {output} down, and the link protocol needs 48 and 12, at most 64"
            );
            assert_eq!(fits(input, output), Err(unfit));
        }
        // A long item in between, and lengths that Push and Pop keep apart.
        let mut odd = vec![
            0xFE, 2, 0, 0x95, 0x01, 0x75, 0x20, 0x95, 16, 0xA4, 0x95, 1, 0xB4, 0x81, 0x02,
        ];
        odd.extend([0x91, 0x02]);
        assert_eq!(Reports::of(&odd), Ok(Reports { input: 64, output: 64 }));
    }

    #[test]
    fn the_documents_descriptor_fits() {
        let document = include_str!("../../../../docs/device-protocol.md");
        let (_, after) = document.split_once("The report descriptor says").expect("it is there");
        let text = after.split("```").nth(1).expect("a block").trim_start_matches("text");
        let bytes: Vec<u8> = text
            .split_whitespace()
            .map(|byte| u8::from_str_radix(byte, 16).expect("hexadecimal"))
            .collect();
        assert_eq!(bytes, descriptor(64, 64));
        assert_eq!(Reports::of(&bytes), Ok(Reports { input: 64, output: 64 }));
    }

    #[test]
    fn a_keyboard_is_no_rig() {
        // The boot keyboard of the HID specification, appendix B.1.
        let keyboard = [
            0x05, 0x01, 0x09, 0x06, 0xA1, 0x01, 0x05, 0x07, 0x19, 0xE0, 0x29, 0xE7, 0x15, 0x00, 0x25, 0x01, 0x75, 0x01,
            0x95, 0x08, 0x81, 0x02, 0x95, 0x01, 0x75, 0x08, 0x81, 0x01, 0x95, 0x05, 0x75, 0x01, 0x05, 0x08, 0x19, 0x01,
            0x29, 0x05, 0x91, 0x02, 0x95, 0x01, 0x75, 0x03, 0x91, 0x01, 0x95, 0x06, 0x75, 0x08, 0x15, 0x00, 0x25, 0x65,
            0x05, 0x07, 0x19, 0x00, 0x29, 0x65, 0x81, 0x00, 0xC0,
        ];
        let unfit = Reports::of(&keyboard).expect_err("too short");
        assert!(unfit.starts_with("its reports carry 8 bytes up and 1 down"), "{unfit}");
        let mut numbered = descriptor(64, 64);
        numbered.splice(14..14, [0x85, 1]);
        let unfit = Reports::of(&numbered).expect_err("numbered");
        assert!(unfit.starts_with("its reports have numbers"), "{unfit}");
        for length in 0..keyboard.len() {
            // Wherever it breaks off, it is refused and nothing panics.
            assert!(Reports::of(&keyboard[..length]).is_err());
        }
        let huge = [
            0x77, 255, 255, 255, 255, 0x97, 255, 255, 255, 255, 0x81, 0x02, 0x81, 0x02,
        ];
        assert!(Reports::of(&huge).is_err());
    }
}
