//! What a study is beside its plan.

use super::super::plan::{Plan, Task};
use super::super::subject::{Subject, numbered_codes};
use super::super::trial::Operator;
use super::VERSION;
use serde::{Deserialize, Serialize};

/// What a study is beside its plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StudyDescription {
    /// Version of the layout.
    pub version: u32,
    /// Program that began it.
    pub program: String,
    /// The task.
    pub task: Task,
    /// Seed of every random order.
    pub seed: u64,
    /// The subjects' codes; a subject's number, which decides on its random orders, is its place here.
    pub subjects: Vec<String>,
    /// Who takes part.
    pub operator: Operator,
    /// Whether the ticks of each trial are kept.
    pub recordings: bool,
    /// CRC-32 of the plan.
    pub plan_crc32: u32,
}

impl StudyDescription {
    /// A study by people.
    #[must_use]
    pub fn people(plan: &Plan, plan_text: &str, seed: u64, subjects: Vec<String>) -> Self {
        Self {
            version: VERSION,
            program: concat!("hapticd ", env!("CARGO_PKG_VERSION")).to_owned(),
            task: plan.task(),
            seed,
            subjects,
            operator: Operator::Human,
            recordings: true,
            plan_crc32: crc32fast::hash(plan_text.as_bytes()),
        }
    }

    /// A study by simulated operators.
    #[must_use]
    pub fn simulated(plan: &Plan, plan_text: &str, seed: u64, subjects: u32, recordings: bool) -> Self {
        Self {
            operator: Operator::Simulated,
            recordings,
            ..Self::people(plan, plan_text, seed, numbered_codes(subjects))
        }
    }

    /// The subjects.
    pub fn all_subjects(&self) -> impl Iterator<Item = Subject> {
        (1..)
            .zip(&self.subjects)
            .map(|(number, code)| Subject::new(number, code))
    }
}
