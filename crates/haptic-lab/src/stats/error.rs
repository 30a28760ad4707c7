//! Why a statistic cannot be computed.

use thiserror::Error;

/// Why a statistic cannot be computed. [`advice`](Self::advice) is what to do about it.
#[derive(Clone, Debug, PartialEq, Error)]
#[non_exhaustive]
pub enum StatsError {
    /// There are too few values.
    #[error("{what}: {count}; at least {least} are needed")]
    TooFew {
        /// What there is too little of, in the plural.
        what: &'static str,
        /// How many there are.
        count: usize,
        /// How many are needed.
        least: usize,
    },
    /// A value is not a number, or is infinite.
    #[error("{what} {place} is {value}, which is not a finite number")]
    NotFinite {
        /// Which quantity, in the singular.
        what: &'static str,
        /// Its place, from 1.
        place: usize,
        /// Its value.
        value: f64,
    },
    /// A value must be above zero.
    #[error("the {what} is {value} {unit}; it must be above 0 {unit}")]
    NotPositive {
        /// Which quantity.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Its unit.
        unit: &'static str,
    },
    /// All values are the same, where only their differences say something.
    #[error("every {what} is {value} {unit}: {consequence}")]
    NoSpread {
        /// Which quantity, in the singular.
        what: &'static str,
        /// The one value.
        value: f64,
        /// Its unit.
        unit: &'static str,
        /// What follows from that.
        consequence: &'static str,
    },
    /// The cursor does not fit into the target.
    #[error("the cursor, {cursor_diameter_m} m, does not fit into the target, {width_m} m wide")]
    CursorTooWide {
        /// Width of the target, m.
        width_m: f64,
        /// Diameter of the cursor, m.
        cursor_diameter_m: f64,
    },
    /// More answers are correct than there are.
    #[error("{correct} of {trials} answers are correct at level {level}")]
    ImpossibleCount {
        /// The level.
        level: f64,
        /// Trials at the level.
        trials: u32,
        /// Correct answers.
        correct: u32,
    },
    /// Every answer is correct.
    #[error("all {trials} answers are correct: the threshold is below every level")]
    AllCorrect {
        /// How many answers there are.
        trials: u32,
    },
    /// Every answer is wrong.
    #[error("all {trials} answers are wrong, where guessing gets half of them right")]
    AllWrong {
        /// How many answers there are.
        trials: u32,
    },
    /// Larger differences are not answered better.
    #[error("answers do not get better with the level, so there is no threshold")]
    NoRise,
    /// The threshold is at the lowest level, or below.
    #[error("the threshold is at the lowest tested level, {lowest}, or below it")]
    AtLowestLevel {
        /// The lowest level.
        lowest: f64,
    },
    /// The threshold is at the highest level, or above.
    #[error("the threshold is at the highest tested level, {highest}, or above it")]
    AtHighestLevel {
        /// The highest level.
        highest: f64,
    },
    /// Answers jump from chance to the ceiling between two levels.
    #[error("answers jump from about chance to the ceiling between the tested levels {below} and {above}")]
    Jump {
        /// The level below the threshold.
        below: f64,
        /// The level above it.
        above: f64,
    },
}

impl StatsError {
    /// What to do about it, in the imperative; absent where the reason says all.
    #[must_use]
    pub const fn advice(&self) -> Option<&'static str> {
        match self {
            Self::AllCorrect { .. } => Some("test smaller differences"),
            Self::AllWrong { .. } => Some("check which answer counts as correct"),
            Self::AtLowestLevel { .. } => Some("test lower levels"),
            Self::AtHighestLevel { .. } => Some("test higher levels"),
            Self::Jump { .. } => Some("test levels between them"),
            _ => None,
        }
    }
}

/// Refuses values that are not finite.
pub(super) fn check_finite(what: &'static str, values: impl IntoIterator<Item = f64>) -> Result<(), StatsError> {
    match (1..).zip(values).find(|(_, value)| !value.is_finite()) {
        Some((place, value)) => Err(StatsError::NotFinite { what, place, value }),
        None => Ok(()),
    }
}

/// Refuses fewer values than are needed.
pub(super) fn check_count(what: &'static str, count: usize, least: usize) -> Result<(), StatsError> {
    if count < least {
        return Err(StatsError::TooFew { what, count, least });
    }
    Ok(())
}

/// Refuses a quantity that is not above zero.
pub(super) fn check_positive(what: &'static str, value: f64, unit: &'static str) -> Result<(), StatsError> {
    if value > 0.0 {
        return Ok(());
    }
    Err(StatsError::NotPositive { what, value, unit })
}
