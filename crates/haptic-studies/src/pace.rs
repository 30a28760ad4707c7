//! How long what is left of a study takes, by what is done.

/// Trials below which the pace is not known.
const MIN_TRIALS: usize = 3;

/// Time that so many trials will take, in words, where `trials` took `took_s` seconds; none where too few are done, or
/// nothing is left.
#[must_use]
pub fn time_left(trials: usize, took_s: f64, left: usize) -> Option<String> {
    if trials < MIN_TRIALS || left == 0 {
        return None;
    }
    let left_min = took_s / trials as f64 * left as f64 / 60.0;
    Some(if left_min < 1.0 {
        "less than 1 min left".to_owned()
    } else if left_min < 90.0 {
        format!("about {left_min:.0} min left")
    } else {
        format!("about {:.1} h left", left_min / 60.0)
    })
}

/// The ticks that trials took, without interruptions.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pace {
    trials: usize,
    ticks: u64,
    /// Tick at which the trial before was done, if nothing has interrupted since.
    last: Option<u64>,
}

impl Pace {
    /// Takes a trial that was done at a tick.
    pub fn done(&mut self, tick: u64) {
        if let Some(last) = self.last.replace(tick) {
            self.trials += 1;
            self.ticks += tick.saturating_sub(last);
        }
    }

    /// Leaves out the time until the next trial.
    pub fn interrupt(&mut self) {
        self.last = None;
    }

    /// Time that so many trials will take, in words, where a tick takes `period_s` seconds.
    #[must_use]
    pub fn time_left(&self, left: usize, period_s: f64) -> Option<String> {
        time_left(self.trials, self.ticks as f64 * period_s, left)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_takes_as_long_as_what_was_done() {
        let words = |trials, took_s, left| time_left(trials, took_s, left).unwrap_or_default();
        assert_eq!(words(10, 20.0, 20), "less than 1 min left");
        assert_eq!(words(10, 20.0, 440), "about 15 min left");
        assert_eq!(words(10, 200.0, 432), "about 2.4 h left");
        assert_eq!(words(2, 20.0, 440) + &words(10, 20.0, 0), "");
    }

    #[test]
    fn an_interruption_takes_no_time_of_the_trials() {
        let mut pace = Pace::default();
        for tick in [1000, 3000, 5000] {
            pace.done(tick);
        }
        pace.interrupt();
        for tick in [1_000_000, 1_002_000] {
            pace.done(tick);
        }
        // Three trials of 2 s.
        assert_eq!(pace.time_left(60, 1e-3).as_deref(), Some("about 2 min left"));
    }
}
