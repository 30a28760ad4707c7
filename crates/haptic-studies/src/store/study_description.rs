//! What a study is beside its plan.

use super::super::plan::{Plan, Task};
use super::super::subject::Subject;
use super::super::subject_table::SubjectTable;
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
    /// Each subject's own order of resistances or tests; none where the plan decides for all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub orders: Vec<Vec<String>>,
    /// Who takes part.
    pub operator: Operator,
    /// Whether the ticks of each trial are kept.
    pub recordings: bool,
    /// CRC-32 of the plan.
    pub plan_crc32: u32,
}

impl StudyDescription {
    /// A study by people, with the subjects of a table, and their orders.
    #[must_use]
    pub fn people(plan: &Plan, plan_text: &str, seed: u64, subjects: &SubjectTable) -> Self {
        let empty = Self {
            version: 1,
            program: concat!("hapticd ", env!("CARGO_PKG_VERSION")).to_owned(),
            task: plan.task(),
            seed,
            subjects: Vec::new(),
            orders: Vec::new(),
            operator: Operator::Human,
            recordings: true,
            plan_crc32: crc32fast::hash(plan_text.as_bytes()),
        };
        empty.with(subjects)
    }

    /// The same, with more subjects after those that it has.
    #[must_use]
    pub(super) fn with(mut self, more: &SubjectTable) -> Self {
        if !self.orders.is_empty() || more.rows.iter().any(|row| !row.order.is_empty()) {
            // An earlier version would do them in another order.
            self.version = VERSION;
            self.orders.resize(self.subjects.len(), Vec::new());
            self.orders.extend(more.rows.iter().map(|row| row.order.clone()));
        }
        self.subjects.extend(more.codes());
        self
    }

    /// A study by simulated operators.
    #[must_use]
    pub fn simulated(plan: &Plan, plan_text: &str, seed: u64, subjects: &SubjectTable, recordings: bool) -> Self {
        Self {
            operator: Operator::Simulated,
            recordings,
            ..Self::people(plan, plan_text, seed, subjects)
        }
    }

    /// The subjects.
    pub fn all_subjects(&self) -> impl Iterator<Item = Subject> {
        let orders = self.orders.iter().cloned().chain(std::iter::repeat(Vec::new()));
        let subjects = (1..).zip(&self.subjects).zip(orders);
        subjects.map(|((number, code), order)| Subject {
            order,
            ..Subject::new(number, code)
        })
    }
}
