//! The unit of a SimpleFOC board's target while it controls torque.

use std::fmt;

/// The unit of a target.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TargetUnit {
    /// A current.
    Ampere,
    /// A voltage.
    Volt,
}

impl fmt::Display for TargetUnit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Ampere => "A",
            Self::Volt => "V",
        })
    }
}

impl TargetUnit {
    /// The unit for a kind of torque control, a phase resistance in ohm (0 where it is not set),
    /// and the unit in the address.
    ///
    /// Up to SimpleFOC 2.3 `voltage` took amperes once the phase resistance was known, and volts
    /// otherwise. From 2.4 on it always takes volts, and a kind of its own, `estimated_current`,
    /// takes amperes. No command distinguishes the two libraries, and their forces differ by the
    /// factor of the resistance: so the address has to say it.
    ///
    /// # Errors
    /// Why the unit is not known or contradicts the address, and the remedy.
    pub(super) fn of(kind: &str, resistance_ohm: f64, said: Option<Self>) -> Result<Self, (String, String)> {
        let known = match kind {
            "volt" if resistance_ohm > 0.0 => None,
            "volt" => Some(Self::Volt),
            _ => Some(Self::Ampere),
        };
        match (known, said) {
            (Some(known), Some(said)) if known != said => Err((
                format!(
                    "its torque control is `{kind}`, which takes its target in {known}, and its address says \
                     target={said}"
                ),
                format!("say target={known}, or change motor.torque_controller in its sketch"),
            )),
            (Some(unit), _) | (None, Some(unit)) => Ok(unit),
            (None, None) => Err((
                format!(
                    "its torque control is `voltage` with a phase resistance of {resistance_ohm} ohm: SimpleFOC up to \
                     2.3 takes the target in A, from 2.4 on in V, and does not say which it is"
                ),
                "say target=A or target=V in its address and give nm_per_unit for that; or, with 2.4, set \
                 motor.torque_controller = TorqueControlType::estimated_current"
                    .to_owned(),
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_unit_follows_from_the_board_or_must_be_said() {
        use TargetUnit::{Ampere, Volt};
        for (kind, ohm, said, unit) in [
            ("foc curr", 0.0, None, Ampere),
            ("dc curr", 2.5, None, Ampere),
            ("est. curr", 2.5, None, Ampere),
            ("volt", 0.0, None, Volt),
            ("volt", 0.0, Some(Volt), Volt),
            // SimpleFOC up to 2.3, and from 2.4 on.
            ("volt", 2.5, Some(Ampere), Ampere),
            ("volt", 2.5, Some(Volt), Volt),
        ] {
            assert_eq!(TargetUnit::of(kind, ohm, said), Ok(unit), "{kind} {ohm} {said:?}");
        }
        let (why, remedy) = TargetUnit::of("volt", 2.5, None).expect_err("nobody knows");
        assert!(why.contains("2.5 ohm") && why.contains("does not say which"), "{why}");
        assert!(remedy.contains("target=A or target=V"), "{remedy}");
        let (why, remedy) = TargetUnit::of("foc curr", 0.0, Some(Volt)).expect_err("it is not");
        assert!(
            why.contains("takes its target in A") && remedy.contains("target=A"),
            "{why}: {remedy}"
        );
    }
}
