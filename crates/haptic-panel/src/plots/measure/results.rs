//! What is measured beside the plots, and the last results: a running plot is measured four times a second.

use super::difference::Difference;
use super::spectrum::{Scaling, Spectrum};
use super::statistics::Statistics;
use crate::tape::plane::Component;
use crate::tape::signal::Signal;

/// Time after which a running plot is measured again, s: quicker numbers cannot be read.
const AGAIN_AFTER_S: f64 = 0.25;

/// The settings of the measurements, and their last results.
#[derive(Debug)]
pub(crate) struct Measuring {
    /// The signal of the spectrum.
    pub(crate) signal: Signal,
    pub(crate) scaling: Scaling,
    pub(crate) table: Kept<Vec<StatisticsRow>>,
    pub(crate) spectrum: Kept<Result<Vec<(Component, Spectrum)>, String>>,
}

impl Default for Measuring {
    fn default() -> Self {
        Self {
            signal: Signal::COMMAND_FORCE,
            scaling: Scaling::default(),
            table: Kept::default(),
            spectrum: Kept::default(),
        }
    }
}

/// The statistics of a signal, and its difference to the reference.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StatisticsRow {
    pub(crate) signal: Signal,
    pub(crate) component: Component,
    /// `None` without a sample.
    pub(crate) statistics: Option<Statistics>,
    /// `None` without a reference, or where both have no time in common.
    pub(crate) difference: Option<Difference>,
}

/// A result that is kept while what it was made of stays the same.
#[derive(Debug)]
pub(crate) struct Kept<T> {
    /// The result, what it was asked of, which samples it was made of, and when, s.
    last: Option<(T, String, String, f64)>,
}

impl<T> Default for Kept<T> {
    fn default() -> Self {
        Self { last: None }
    }
}

impl<T> Kept<T> {
    pub(crate) fn last(&self) -> Option<&T> {
        self.last.as_ref().map(|(last, ..)| last)
    }

    /// The result for a question about some samples, made again if the question is another one, or if the
    /// samples are others and a moment has passed at `now_s`. Comes with the time until it is due again, s.
    pub(crate) fn get(
        &mut self,
        asked: &str,
        samples: &str,
        now_s: f64,
        make: impl FnOnce() -> T,
    ) -> (&T, Option<f64>) {
        let wait_s = match &self.last {
            Some((_, asked_before, samples_before, at_s)) if asked_before == asked => {
                let is_same = samples_before == samples;
                let age_s = now_s - at_s;
                if is_same {
                    Some(None)
                } else {
                    (0.0..AGAIN_AFTER_S)
                        .contains(&age_s)
                        .then_some(Some(AGAIN_AFTER_S - age_s))
                }
            }
            _ => None,
        };
        let is_due = wait_s.is_none();
        if is_due {
            self.last = None;
        }
        let last = self
            .last
            .get_or_insert_with(|| (make(), asked.to_owned(), samples.to_owned(), now_s));
        (&last.0, wait_s.flatten())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn new_question_renews_result_at_once_new_samples_soon() {
        let mut kept = Kept::default();
        let mut made = 0;
        let mut ask = |asked: &str, samples: &str, now_s: f64| {
            let (number, wait_s) = kept.get(asked, samples, now_s, || {
                made += 1;
                made
            });
            (*number, wait_s)
        };
        assert_eq!(ask("force", "1", 10.0), (1, None));
        assert_eq!(ask("force", "1", 99.0), (1, None), "nothing is new");
        assert_eq!(ask("force", "2", 99.0), (2, None), "long ago");
        assert_eq!(ask("force", "3", 99.125), (2, Some(0.125)), "a moment ago");
        assert_eq!(ask("force", "3", 99.25), (3, None));
        assert_eq!(ask("velocity", "3", 99.25), (4, None));
    }
}
