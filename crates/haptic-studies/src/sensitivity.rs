//! Which constants of the simulated operator turn its result: each is halved and doubled, and the study done again.

use super::operator::{self, Constants, OperatorError};
use super::plan::Plan;
use super::session::{FinishedTrial, Row, Task};
use super::subject::Subject;
use super::trial::Operator;
use std::collections::BTreeMap;

/// A number that a study has as its result.
#[derive(Clone, Debug, PartialEq)]
pub struct Measure {
    /// Resistance or case.
    pub of: String,
    /// What it is, with its unit.
    pub what: &'static str,
    /// The number.
    pub value: f64,
}

/// The result with one constant changed.
#[derive(Clone, Debug, PartialEq)]
pub struct Variation {
    /// The constant.
    pub name: &'static str,
    /// Its value.
    pub value: f64,
    /// The result; none where the operator does not finish the study so.
    pub measures: Option<Vec<Measure>>,
}

/// Half and double of each constant, within its range.
pub fn variations() -> impl Iterator<Item = (&'static str, f64)> {
    Constants::ALL.iter().flat_map(|constant| {
        let values = [0.5, 2.0].map(|factor| (factor * constant.usual).clamp(constant.low, constant.high));
        values.map(|value| (constant.name, value))
    })
}

/// The result of a study with one constant changed.
///
/// # Errors
/// A surface cannot be rendered.
pub fn vary(plan: &Plan, name: &'static str, value: f64, seed: u64, subjects: u32) -> Result<Variation, OperatorError> {
    let mut constants = Constants::default();
    let set = constants.set(name, value);
    let measures = match set.map(|()| measure(plan, &constants, seed, subjects)) {
        Ok(Ok(measures)) => Some(measures),
        Ok(Err(OperatorError::Scene(error))) => return Err(error.into()),
        Ok(Err(OperatorError::NoHit { .. })) | Err(_) => None,
    };
    Ok(Variation { name, value, measures })
}

/// The result of a study, without a file.
///
/// # Errors
/// A surface cannot be rendered, or a target is not hit.
pub fn measure(plan: &Plan, constants: &Constants, seed: u64, subjects: u32) -> Result<Vec<Measure>, OperatorError> {
    let mut sums = Sums::default();
    for subject in (1..=subjects).map(Subject::numbered) {
        let person = operator::person(constants, seed, &subject);
        let task = Task::new(plan, seed, &subject, Operator::Simulated, operator::PERIOD_S);
        let mut session = operator::session(task, &subject);
        while !session.is_done() {
            operator::run_next(&mut session, &person, seed, &subject, |finished| {
                add(&mut sums, finished);
                true
            })?;
        }
    }
    let means = sums.0.into_iter().map(|((of, what), (sum, count))| Measure {
        of,
        what,
        value: sum / count,
    });
    Ok(means.collect())
}

/// Sums and counts.
#[derive(Default)]
struct Sums(BTreeMap<(String, &'static str), (f64, f64)>);

impl Sums {
    fn add(&mut self, of: String, what: &'static str, value: f64) {
        let (sum, count) = self.0.entry((of, what)).or_default();
        (*sum, *count) = (*sum + value, *count + 1.0);
    }
}

/// Adds what became of a trial.
fn add(sums: &mut Sums, finished: FinishedTrial) {
    match finished.row {
        _ if finished.is_practice => {}
        Row::Fitts(trial) => {
            sums.add(trial.resistance.clone(), "movement_time_s", trial.movement_time_s);
            sums.add(trial.resistance, "errors", f64::from(trial.errors));
        }
        Row::Perception(trial) => {
            let case = format!("case {:?}", trial.case);
            sums.add(case.clone(), "correct", f64::from(u8::from(trial.correct)));
            sums.add(case, "level_N", trial.level_n);
        }
    }
}
