//! A trial of the perception tests.

use super::row::{Column, Operator, OutOfRange, Trial, check, first_session, named, not_negative};
use serde::{Deserialize, Serialize};

/// What a perception test changes of the base surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Case {
    /// Static and dynamic friction are higher.
    A,
    /// Static friction alone is higher.
    B,
    /// Static and dynamic friction are lower.
    C,
}

/// How a perception test chooses its levels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Every level of a list equally often, in random order.
    Constant,
    /// The level follows the answers.
    Staircase,
}

impl Method {
    /// Its name in rows.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Constant => "constant",
            Self::Staircase => "staircase",
        }
    }
}

/// A two-interval choice between the base surface and a comparison.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PerceptionTrial {
    /// Who did it; a file from elsewhere need not say so.
    pub operator: Option<Operator>,
    /// Code of the subject.
    pub subject: String,
    /// Session of the subject, from 1.
    #[serde(default = "first_session")]
    pub session: u32,
    /// What the comparison changes.
    pub case: Case,
    /// How the level was chosen.
    pub method: Method,
    /// Trial of the subject's case, from 1.
    pub trial: u32,
    /// Static friction of the base, N (>= 0).
    #[serde(rename = "base_static_N")]
    pub base_static_n: f64,
    /// Dynamic friction of the base, N (>= 0).
    #[serde(rename = "base_dynamic_N")]
    pub base_dynamic_n: f64,
    /// Static friction of the comparison, N (>= 0).
    #[serde(rename = "comparison_static_N")]
    pub comparison_static_n: f64,
    /// Dynamic friction of the comparison, N (>= 0).
    #[serde(rename = "comparison_dynamic_N")]
    pub comparison_dynamic_n: f64,
    /// Size of the change, N (>= 0), whichever way it goes.
    #[serde(rename = "level_N")]
    pub level_n: f64,
    /// Whether the first interval had the comparison.
    pub comparison_first: bool,
    /// The interval, 1 or 2, that had more friction, by the answer.
    pub answer: u8,
    /// Whether it had.
    pub correct: bool,
    /// From the end of the second interval to the answer, s (>= 0).
    pub response_time_s: Option<f64>,
    /// Whether the staircase turned after this answer.
    #[serde(default)]
    pub reversal: bool,
    /// First tick of the first interval.
    pub start_tick: Option<u64>,
    /// Tick of the answer.
    pub end_tick: Option<u64>,
    /// Attempts at this trial that were voided before it.
    #[serde(default)]
    pub voided: u32,
    /// Recording of the trial, a path from the study's folder.
    pub recording: Option<String>,
}

impl Trial for PerceptionTrial {
    const COLUMNS: &'static [Column] = &[
        Column::optional("operator"),
        Column::required("subject"),
        Column::optional("session"),
        Column::required("case"),
        Column::required("method"),
        Column::required("trial"),
        Column::required("base_static_N"),
        Column::required("base_dynamic_N"),
        Column::required("comparison_static_N"),
        Column::required("comparison_dynamic_N"),
        Column::required("level_N"),
        Column::required("comparison_first").of_truth(),
        Column::required("answer"),
        Column::required("correct").of_truth(),
        Column::optional("response_time_s"),
        Column::optional("reversal").of_truth(),
        Column::optional("start_tick"),
        Column::optional("end_tick"),
        Column::optional("voided"),
        Column::optional("recording"),
    ];

    fn check(&self) -> Result<(), OutOfRange> {
        named("subject", &self.subject)?;
        not_negative("base_static_N", self.base_static_n, " N")?;
        not_negative("base_dynamic_N", self.base_dynamic_n, " N")?;
        not_negative("comparison_static_N", self.comparison_static_n, " N")?;
        not_negative("comparison_dynamic_N", self.comparison_dynamic_n, " N")?;
        not_negative("level_N", self.level_n, " N")?;
        let is_answer = matches!(self.answer, 1 | 2);
        check(is_answer, "answer", self.answer, "", "it must be 1 or 2")?;
        self.response_time_s
            .map_or(Ok(()), |time| not_negative("response_time_s", time, " s"))
    }
}
