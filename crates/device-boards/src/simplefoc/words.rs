//! The lines of SimpleFOC's Commander in its mode for machines (`@3`): an answer repeats the
//! letters of its command.

use crate::text::number;

/// Longest command of SimpleFOC 2.3's Commander with its end, bytes; it throws longer ones away.
pub(super) const LONGEST_COMMAND: usize = 20;

/// An answer of the motor with our letter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Answer<'a> {
    /// To `MMG6`: the angle of the shaft, rad.
    Angle(f64),
    /// To a target: what it is now, A or V.
    Target(f64),
    /// To `ME`: whether the motor is enabled.
    Enabled(bool),
    /// To `MC` or `MT`: the kind of control, in its words.
    Control(&'a [u8]),
    /// To `MT`: how it makes torque, in its words.
    Torque(&'a [u8]),
    /// To `MLU`: the voltage limit, V.
    VoltageLimit(f64),
    /// To `MR`: the resistance of a phase, ohm; 0 where it is not set.
    Resistance(f64),
    /// It does not know the command.
    Refused,
}

/// Reads a line; nothing for a line that is not such an answer.
pub(super) fn read(line: &[u8], letter: u8) -> Option<Answer<'_>> {
    let said = line.strip_prefix(&[letter])?;
    if said.ends_with(b"err") {
        return Some(Answer::Refused);
    }
    if let Some(target) = number(said) {
        return Some(Answer::Target(target));
    }
    let (kind, value) = said.split_first()?;
    match kind {
        b'M' => number(value.strip_prefix(b"G")?).map(Answer::Angle),
        b'E' => match value {
            b"0" => Some(Answer::Enabled(false)),
            b"1" => Some(Answer::Enabled(true)),
            _ => None,
        },
        b'C' => Some(Answer::Control(value)),
        b'T' => Some(Answer::Torque(value)),
        b'L' => number(value.strip_prefix(b"U")?).map(Answer::VoltageLimit),
        b'R' => number(value).map(Answer::Resistance),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn answers_say_what_they_answer() {
        for (line, answer) in [
            ("MMG-3.250000", Some(Answer::Angle(-3.25))),
            ("M0.250000", Some(Answer::Target(0.25))),
            ("ME1", Some(Answer::Enabled(true))),
            ("ME0", Some(Answer::Enabled(false))),
            ("MCtorque", Some(Answer::Control(b"torque"))),
            ("MTfoc curr", Some(Answer::Torque(b"foc curr"))),
            ("MLU12.000000", Some(Answer::VoltageLimit(12.0))),
            ("MR0", Some(Answer::Resistance(0.0))),
            ("MXerr", Some(Answer::Refused)),
            ("ME2", None),
            ("MMGnan", None),
            ("MMGinf", None),
            ("MMGovf", None),
            ("MMG", None),
            ("M", None),
            // Another motor, what motor.monitor() prints, and the mode for people.
            ("NMG1.000000", None),
            ("0.0000\t1.2500\t0.0100", None),
            ("angle: 1.250", None),
        ] {
            assert_eq!(read(line.as_bytes(), b'M'), answer, "{line}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn any_bytes_are_read_and_numbers_are_finite(bytes in prop::collection::vec(any::<u8>(), 0..60)) {
            let mut named = b"MMG".to_vec();
            named.extend(&bytes);
            for line in [&bytes, &named] {
                if let Some(Answer::Angle(value) | Answer::Target(value) | Answer::VoltageLimit(value) | Answer::Resistance(value)) = read(line, b'M') {
                    prop_assert!(value.is_finite());
                }
            }
        }
    }
}
