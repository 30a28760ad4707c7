//! The advice on the active scene, by parameter.

use crate::intent::Target;
use haptic_core::Direction;
use haptic_ipc::{Advice, AdviceReply, ChangeReply, ErrorCode, Finding, ParameterDescription, WireError};

/// The newest advice.
#[derive(Debug, Default)]
pub(crate) struct Advised {
    /// Revision of the scene that was checked.
    revision: u64,
    /// Whether it includes the checks that pass. The answer to a change does not.
    is_whole: bool,
    advice: Vec<Advice>,
    /// Why there is no advice.
    failure: Option<String>,
}

/// A remark on a parameter, or a broken bound.
#[derive(Debug, PartialEq)]
pub(crate) struct Warning<'a> {
    pub(crate) message: &'a str,
    pub(crate) finding: Option<&'a Finding>,
    pub(crate) fix: Option<Fix>,
}

/// A change that fixes a broken bound.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Fix {
    pub(crate) target: Target,
    pub(crate) value: f64,
}

impl Advised {
    /// Takes the answer to a request for advice. `active` is the newest known revision.
    pub(crate) fn take(&mut self, result: Result<AdviceReply, WireError>, active: Option<u64>) {
        match result {
            Ok(reply) if reply.revision >= self.revision && active.is_none_or(|known| reply.revision >= known) => {
                *self = Self {
                    revision: reply.revision,
                    is_whole: true,
                    advice: reply.advice,
                    failure: None,
                };
            }
            Ok(_) => {}
            // An older daemon, which gives advice with the answer to a change alone.
            Err(error) if error.code == ErrorCode::UnknownOp => {}
            // Advice on an earlier scene would be taken for advice on this one.
            Err(error) => {
                *self = Self {
                    failure: Some(error.message),
                    ..Self::default()
                }
            }
        }
    }

    /// Takes the remarks in the answer to a change, unless there is better advice.
    pub(crate) fn take_remarks(&mut self, reply: &ChangeReply) {
        if !self.is_whole && reply.revision >= self.revision {
            self.revision = reply.revision;
            self.advice.clone_from(&reply.advice);
        }
    }

    /// The scene has changed. Whole advice stays until the next one, so that the rows do not jump; remarks
    /// are dropped, because none follow.
    pub(crate) fn overtaken(&mut self, revision: u64) {
        if !self.is_whole && self.revision < revision {
            self.advice.clear();
        }
    }

    /// Why there is no advice.
    pub(crate) fn failure(&self) -> Option<&str> {
        self.failure.as_deref()
    }

    /// Every check with its message; none if only remarks are known.
    pub(crate) fn checks(&self) -> impl Iterator<Item = (&Finding, &str)> {
        let whole = self.advice.iter().filter(|_| self.is_whole);
        whole.filter_map(|advice| Some((advice.finding.as_ref()?, advice.message.as_str())))
    }

    /// The warnings on a parameter, the strictest fix first.
    pub(crate) fn warnings(&self, about: &ParameterDescription) -> Vec<Warning<'_>> {
        let mut warnings: Vec<_> = self
            .advice
            .iter()
            .filter(|advice| advice.finding.as_ref().is_none_or(|finding| !finding.passes))
            .filter_map(|advice| {
                let direction = match advice.param.strip_prefix(about.name.as_str())? {
                    "" => None,
                    "+" => Some(Direction::Positive),
                    "-" => Some(Direction::Negative),
                    _ => return None,
                };
                let finding = advice.finding.as_ref();
                let exact = finding.and_then(|finding| finding.mending);
                let fix = exact.and_then(|value| Fix::new(about, direction, value));
                let message = advice.message.as_str();
                Some(Warning { message, finding, fix })
            })
            .collect();
        // The farther from the active value, the stricter; then broken bounds, the worst first; then remarks.
        let distance = |warning: &Warning<'_>| {
            let fix = warning.fix.as_ref();
            fix.map_or(-1.0, |fix| {
                (fix.value - active_value(about, fix.target.direction)).abs()
            })
        };
        let margin = |warning: &Warning<'_>| {
            let finding = warning.finding;
            finding.map_or(f64::INFINITY, |finding| finding.margin.unwrap_or(0.0))
        };
        warnings.sort_by(|a, b| {
            let stricter = distance(b).total_cmp(&distance(a));
            stricter.then(margin(a).total_cmp(&margin(b)))
        });
        warnings
    }
}

impl Fix {
    /// Rounds to four digits, away from the active value, so that the bound is kept. `None` if nothing would
    /// change.
    fn new(about: &ParameterDescription, direction: Option<Direction>, exact: f64) -> Option<Self> {
        let active = active_value(about, direction);
        let value = if exact < active {
            -four_digits_at_least(-exact)
        } else {
            four_digits_at_least(exact)
        };
        let name = about.name.clone();
        let target = Target { name, direction };
        (value.is_finite() && value != active).then_some(Self { target, value })
    }
}

/// The active value of both directions or of one.
pub(crate) fn active_value(about: &ParameterDescription, direction: Option<Direction>) -> f64 {
    about.value.get(direction.unwrap_or(Direction::Positive))
}

/// The value in four significant digits, to the nearest.
pub(crate) fn four_digits(value: f64) -> f64 {
    format!("{value:.3e}").parse().unwrap_or(value)
}

/// The smallest number of four significant digits that is not below the value.
fn four_digits_at_least(value: f64) -> f64 {
    let nearest = four_digits(value);
    if nearest >= value {
        return nearest;
    }
    // A rounded value is not zero.
    let digit = 10_f64.powf(value.abs().log10().floor() - 3.0);
    four_digits(nearest + digit)
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_core::Scene;

    /// The paper's stiffness: 25000 N/m.
    fn stiffness() -> ParameterDescription {
        let mut rows = ParameterDescription::all_of(&Scene::paper()).into_iter();
        rows.find(|row| row.name == "stiffness").expect("a parameter")
    }

    fn broken(mending: Option<f64>, margin: f64) -> Advice {
        let finding = Finding {
            check: "friction".into(),
            passes: false,
            value: Some(1.0),
            bound: Some(margin),
            unit: "N/m".into(),
            margin: Some(margin),
            mending,
        };
        Advice {
            param: "stiffness".into(),
            message: format!("broken to {margin}"),
            finding: Some(finding),
        }
    }

    fn of_revision(revision: u64, advice: Vec<Advice>) -> Result<AdviceReply, WireError> {
        Ok(AdviceReply {
            revision,
            advice,
            basis: None,
        })
    }

    #[test]
    fn the_strictest_fix_comes_first_and_remarks_last() {
        let remark = Advice {
            finding: None,
            message: "a remark".into(),
            ..broken(None, 0.0)
        };
        let advice = vec![
            remark,
            broken(None, 0.1),
            broken(Some(20_000.0), 0.8),
            broken(Some(16_000.0), 0.6),
        ];
        let mut advised = Advised::default();
        advised.take(of_revision(1, advice), None);
        let messages = advised
            .warnings(&stiffness())
            .into_iter()
            .map(|warning| warning.message);
        assert!(messages.eq(["broken to 0.6", "broken to 0.8", "broken to 0.1", "a remark"]));
    }

    #[test]
    fn a_fix_is_rounded_away_from_the_active_value() {
        let about = stiffness();
        for (exact, value) in [
            (16_000.0, Some(16_000.0)),
            (6_666.666_666, Some(6_666.0)),
            (6_667.000_001, Some(6_667.0)),
            (1e-12 / 3.0, Some(3.333e-13)),
            (25_000.000_1, Some(25_010.0)),
            (99_999.9, Some(100_000.0)),
            (25_000.0, None),
        ] {
            let fix = Fix::new(&about, None, exact);
            assert_eq!(fix.map(|fix| fix.value), value, "{exact}");
        }
    }

    #[test]
    fn advice_names_its_parameter_not_a_shared_prefix() {
        let mut advised = Advised::default();
        let advice = ["stiffness_of_the_contact", "stiffness-", "stiff"].map(|param| Advice {
            param: param.to_owned(),
            ..broken(None, 0.5)
        });
        advised.take(of_revision(1, advice.into()), None);
        assert_eq!(advised.warnings(&stiffness()).len(), 1);
    }

    #[test]
    fn remarks_on_a_change_stand_in_for_advice() {
        let remarks = |revision, margin| ChangeReply {
            revision,
            changed: true,
            tick: Some(1),
            advice: vec![broken(None, margin)],
            ..ChangeReply::default()
        };
        let about = stiffness();
        let mut advised = Advised::default();
        advised.take(Err(WireError::new(ErrorCode::UnknownOp, "no such operation")), Some(1));
        assert_eq!(advised.failure(), None);
        advised.take_remarks(&remarks(2, 0.5));
        advised.overtaken(2);
        assert_eq!(advised.warnings(&about).len(), 1);
        assert_eq!(advised.checks().count(), 0, "the others are not known");
        advised.overtaken(3);
        assert_eq!(advised.warnings(&about), []);

        advised.take(of_revision(4, vec![broken(None, 0.25)]), Some(4));
        advised.take_remarks(&remarks(5, 0.5));
        advised.overtaken(5);
        let warnings = advised.warnings(&about);
        assert!(matches!(warnings.as_slice(), [warning] if warning.message == "broken to 0.25"));
    }

    #[test]
    fn advice_on_an_older_scene_is_ignored_and_a_refusal_drops_it() {
        let mut advised = Advised::default();
        for (revision, kept) in [(2, 0), (3, 1), (2, 1)] {
            let margin = f64::from(u8::try_from(revision).expect("a small one"));
            advised.take(of_revision(revision, vec![broken(None, margin)]), Some(3));
            assert_eq!(advised.checks().count(), kept);
            assert!(advised.checks().all(|(finding, _)| finding.margin == Some(3.0)));
        }
        advised.take(Err(WireError::new(ErrorCode::Unknown, "later")), Some(2));
        assert_eq!(advised.failure(), Some("later"));
        assert_eq!(advised.warnings(&stiffness()), []);
    }
}
