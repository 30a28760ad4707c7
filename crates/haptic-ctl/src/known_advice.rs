//! Which advice is worth showing: what is new, and what is about a parameter that was changed.

use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::output;
use haptic_ipc::{Advice, AdviceReply, Request};

/// The advice on the scene before a change.
pub(crate) struct KnownAdvice(Vec<Advice>);

impl KnownAdvice {
    /// Asks for it, where advice will be printed.
    pub(crate) async fn before_change(daemon: &mut Daemon, json: bool) -> Result<Self, Failure> {
        if json || output::is_quiet() {
            return Ok(Self(Vec::new()));
        }
        let mut reply: AdviceReply = daemon.ask(Request::Advise {}).await?;
        reply.advice.retain(|advice| !is_kept(advice));
        Ok(Self(reply.advice))
    }

    /// Prints what of the advice is new, or about one of the parameters.
    pub(crate) fn print_news(&self, advice: &[Advice], changed: &[&str]) -> Result<(), Failure> {
        let worth_telling = |advice: &&Advice| {
            changed
                .iter()
                .any(|name| without_direction(name) == without_direction(&advice.param))
                || !self.has(advice)
        };
        advice
            .iter()
            .filter(worth_telling)
            .try_for_each(|advice| output::unless_quiet(&format!("note: {}", advice.message)))
    }

    /// Whether it was so before. The figures of a broken bound change with every parameter.
    fn has(&self, advice: &Advice) -> bool {
        self.0.iter().any(|known| match (&known.finding, &advice.finding) {
            (Some(known), Some(found)) => known.check == found.check,
            (None, None) => known.message == advice.message,
            _ => false,
        })
    }
}

/// Whether the advice is that a bound is kept.
fn is_kept(advice: &Advice) -> bool {
    advice.finding.as_ref().is_some_and(|finding| finding.passes)
}

fn without_direction(parameter: &str) -> &str {
    parameter.trim_end_matches(['+', '-'])
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_ipc::Finding;

    fn bound(check: &str, param: &str) -> Advice {
        Advice {
            param: param.to_owned(),
            message: format!("{check} is broken"),
            finding: Some(Finding {
                check: check.to_owned(),
                passes: false,
                value: None,
                bound: None,
                unit: "N".to_owned(),
                margin: None,
                mending: None,
            }),
        }
    }

    #[test]
    fn a_bound_that_was_broken_before_is_known_whatever_its_figures() {
        let known = KnownAdvice(vec![bound("passivity", "damping")]);
        let other_figures = Advice {
            message: "passivity is broken by more".to_owned(),
            ..bound("passivity", "damping")
        };
        assert!(known.has(&other_figures));
        assert!(!known.has(&bound("chatter", "damping")));
        let note = Advice {
            finding: None,
            ..bound("passivity", "damping")
        };
        assert!(!known.has(&note), "a remark is not a bound");
    }
}
