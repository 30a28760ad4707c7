//! The lines of ODrive's ASCII protocol by its documentation: `command *checksum`, and an answer
//! with a checksum to a command with one.

use super::text::{Text, number};
use std::fmt::{self, Write as _};

/// An answer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Answer<'a> {
    /// To `f`: where the shaft is, turns, and how fast it turns, turns/s.
    Feedback(f64, f64),
    /// To `r`: a property, as text.
    Value(&'a [u8]),
    /// To a command that the ODrive does not know or cannot carry out.
    Refused,
}

/// Why a line is not an answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Damage {
    /// Its checksum is wrong, or missing though every command of ours has one.
    Checksum,
    /// Its words are not those of an ODrive.
    Words,
}

/// All bytes of it by exclusive or.
fn checksum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum, byte| sum ^ byte)
}

/// Writes a command with its checksum; whether there was room for it.
pub(super) fn write(text: &mut Text, command: fmt::Arguments<'_>) -> bool {
    text.whole(|text| {
        let before = text.as_bytes().len();
        write!(text, "{command} ")?;
        let sum = checksum(text.since(before));
        writeln!(text, "*{sum}")
    })
}

/// The part before a correct checksum.
fn checked(line: &[u8]) -> Option<&[u8]> {
    let at = line.iter().rposition(|byte| *byte == b'*')?;
    let (body, sum) = (line.get(..at)?, line.get(at + 1..)?);
    let plain = (1..=3).contains(&sum.len()) && sum.iter().all(u8::is_ascii_digit);
    let sum: u8 = plain.then(|| std::str::from_utf8(sum).ok()?.parse().ok()).flatten()?;
    (sum == checksum(body)).then_some(body)
}

/// Reads a line.
pub(super) fn read(line: &[u8]) -> Result<Answer<'_>, Damage> {
    let body = checked(line).ok_or(Damage::Checksum)?;
    let refusals: [&[u8]; 4] = [b"unknown command", b"invalid ", b"not implemented", b"error"];
    if refusals.iter().any(|refusal| body.starts_with(refusal)) {
        return Ok(Answer::Refused);
    }
    if let Some(space) = body.iter().position(|byte| *byte == b' ') {
        let (turns, speed) = (body.get(..space), body.get(space + 1..));
        return match (turns.and_then(number), speed.and_then(number)) {
            (Some(turns), Some(speed)) => Ok(Answer::Feedback(turns, speed)),
            _ => Err(Damage::Words),
        };
    }
    if body.is_empty() || !body.iter().all(u8::is_ascii_graphic) {
        return Err(Damage::Words);
    }
    Ok(Answer::Value(body))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A line with the checksum of what it says.
    fn line(body: &str) -> String {
        format!("{body}*{}", checksum(body.as_bytes()))
    }

    #[test]
    fn a_command_carries_the_checksum_of_the_documentation() {
        let mut text = Text::default();
        assert!(write(&mut text, format_args!("r vbus_voltage")));
        // The documentation's example.
        assert_eq!(text.as_bytes(), b"r vbus_voltage *93\n");
    }

    #[test]
    fn answers_are_distinguished() {
        for (body, answer) in [
            ("1.500000 -0.250000", Answer::Feedback(1.5, -0.25)),
            ("8", Answer::Value(b"8")),
            ("0.050000", Answer::Value(b"0.050000")),
            ("invalid property", Answer::Refused),
            ("unknown command", Answer::Refused),
            ("not implemented", Answer::Refused),
        ] {
            assert_eq!(read(line(body).as_bytes()), Ok(answer), "{body}");
        }
        for (wrong, damage) in [
            ("1.500000 -0.250000".to_owned(), Damage::Checksum),
            ("1.500000 -0.250000*1".to_owned(), Damage::Checksum),
            ("1.500000 -0.250000*".to_owned(), Damage::Checksum),
            ("8*0056".to_owned(), Damage::Checksum),
            ("8*+56".to_owned(), Damage::Checksum),
            (line("nan 0.0"), Damage::Words),
            (line("inf 0.0"), Damage::Words),
            (line("1.0 2.0 3.0"), Damage::Words),
            (line(""), Damage::Words),
        ] {
            assert_eq!(read(wrong.as_bytes()), Err(damage), "{wrong}");
        }
        assert_eq!(read(b"8*56"), Ok(Answer::Value(b"8")));
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn any_bytes_are_read_and_numbers_are_finite(body in prop::collection::vec(any::<u8>(), 0..100), sum in any::<u8>()) {
            let mut with_sum = body.clone();
            with_sum.extend(format!("*{sum}").bytes());
            let mut with_right_sum = body.clone();
            with_right_sum.extend(format!("*{}", checksum(&body)).bytes());
            for bytes in [&body, &with_sum, &with_right_sum] {
                if let Ok(Answer::Feedback(turns, speed)) = read(bytes) {
                    prop_assert!(turns.is_finite() && speed.is_finite());
                }
            }
            if sum != checksum(&body) {
                prop_assert_eq!(read(&with_sum), Err(Damage::Checksum));
            }
        }

        #[test]
        fn feedback_with_one_byte_changed_is_not_taken(turns in -1e4_f64..1e4, speed in -1e3_f64..1e3, at in any::<prop::sample::Index>(), turned in 1..=255_u8) {
            let good = line(&format!("{turns:.6} {speed:.6}")).into_bytes();
            prop_assert!(matches!(read(&good), Ok(Answer::Feedback(..))));
            let mut bad = good.clone();
            let at = at.index(good.len());
            bad[at] ^= turned;
            // The same numbers again, only where the damage is in how the checksum is written.
            prop_assert!(read(&bad).is_err() || read(&bad) == read(&good), "{}", String::from_utf8_lossy(&bad));
        }
    }
}
