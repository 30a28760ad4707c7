//! How late, and how often, the subject's screen showed the cursor, over the trials of a study.

use super::trial::FittsTrial;
use haptic_motion::median::median;
use serde::Serialize;

/// How it is measured, for the metadata of a study.
pub const HOW_MEASURED: &str = "by the program that draws the subject's screen: from the sample on the device to the \
                                beginning of the frame after the one that shows its position; the display's own delay comes on top";

/// What the rows say of the subject's screen.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ScreenSummary {
    /// Trials with values.
    pub trials: usize,
    /// Median of the trials' median latencies, s.
    pub cursor_latency_s: f64,
    /// Median of the trials' 95th percentiles, s.
    pub cursor_latency_p95_s: f64,
    /// The largest of the trials' 95th percentiles, s.
    pub worst_trial_p95_s: f64,
    /// Median of the trials' frame rates, Hz; absent where no row has one.
    pub frame_rate_hz: Option<f64>,
}

impl ScreenSummary {
    /// That of some trials; none where nothing was measured.
    #[must_use]
    pub fn of(trials: &[FittsTrial]) -> Option<Self> {
        let all = |column: fn(&FittsTrial) -> Option<f64>| trials.iter().filter_map(column).collect::<Vec<_>>();
        let mut medians_s = all(|trial| trial.cursor_latency_s);
        let mut p95s_s = all(|trial| trial.cursor_latency_p95_s);
        Some(Self {
            trials: medians_s.len(),
            cursor_latency_s: median(&mut medians_s)?,
            worst_trial_p95_s: p95s_s.iter().copied().fold(0.0, f64::max),
            cursor_latency_p95_s: median(&mut p95s_s)?,
            frame_rate_hz: median(&mut all(|trial| trial.frame_rate_hz)),
        })
    }
}

impl std::fmt::Display for ScreenSummary {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [median_ms, p95_ms, worst_ms] =
            [self.cursor_latency_s, self.cursor_latency_p95_s, self.worst_trial_p95_s].map(|time_s| 1e3 * time_s);
        write!(
            formatter,
            "the cursor was shown {median_ms:.1} ms late, 95 % of the frames within {p95_ms:.1} ms (medians of {} trials; \
             {worst_ms:.1} ms in the worst trial)",
            self.trials
        )?;
        if let Some(rate_hz) = self.frame_rate_hz {
            write!(formatter, ", at {rate_hz:.0} frames a second")?;
        }
        write!(formatter, "; measured {HOW_MEASURED}")
    }
}
