//! Log lines about missed periods: the first at once, then at most one every ten seconds, with all
//! since the previous line.

use crate::control::LoopChannel;
use crate::telemetry::timing::Counted;
use crate::timers::every;
use haptic_ipc::socket_path;
use std::path::Path;
use std::time::Duration;
use tokio::time::Instant;

/// Period at which the counters are checked.
const CHECK_PERIOD: Duration = Duration::from_millis(500);

/// Least time between two lines.
const PAUSE: Duration = Duration::from_secs(10);

/// Logs missed periods, for ever. A hint is for the rig of `socket`.
pub(crate) async fn watch(channel: &LoopChannel, socket: &Path) {
    let mut checks = every(CHECK_PERIOD);
    let mut log = LateLog {
        ctl_options: socket_path::options_to(socket).map_or_else(String::new, |options| format!("{options} ")),
        ..LateLog::default()
    };
    loop {
        // The time of a check that came late is not that for which it was due.
        checks.tick().await;
        let now = Instant::now();
        let counted = channel.feed().timing.counted();
        if let Some(line) = log.line(now, counted) {
            crate::say(&line);
        }
    }
}

#[derive(Debug, Default)]
struct LateLog {
    /// The options with which haptic-ctl finds the daemon, and a space; or nothing.
    ctl_options: String,
    logged: Counted,
    logged_at: Option<Instant>,
}

impl LateLog {
    /// The line to log now, if any.
    fn line(&mut self, now: Instant, counted: Counted) -> Option<String> {
        let missed = counted.missed_periods - self.logged.missed_periods;
        let overruns = counted.overruns - self.logged.overruns;
        if missed == 0 || self.logged_at.is_some_and(|logged_at| now < logged_at + PAUSE) {
            return None;
        }
        let since = self.logged_at.map_or_else(
            || "so far".to_owned(),
            |logged_at| format!("in {:.0} s", (now - logged_at).as_secs_f64()),
        );
        (self.logged, self.logged_at) = (counted, Some(now));
        Some(format!(
            "late: {missed} missed periods and {overruns} overruns {since}; see `haptic-ctl {}timing`",
            self.ctl_options
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_is_logged_at_once_and_the_others_together() {
        let began = Instant::now();
        let after = |seconds| began + Duration::from_secs(seconds);
        let counted = |missed_periods, overruns| Counted {
            missed_periods,
            overruns,
        };
        let mut log = LateLog {
            ctl_options: "--rig left ".to_owned(),
            ..LateLog::default()
        };
        assert_eq!(log.line(after(0), counted(0, 0)), None);
        let first = log.line(after(1), counted(2, 1)).expect("logged");
        assert!(
            first.starts_with("late: 2 missed periods and 1 overruns so far"),
            "{first}"
        );
        assert_eq!(log.line(after(5), counted(7, 1)), None);
        assert!(first.ends_with("see `haptic-ctl --rig left timing`"), "{first}");
        let second = log.line(after(11), counted(9, 4)).expect("logged");
        assert!(
            second.starts_with("late: 7 missed periods and 3 overruns in 10 s"),
            "{second}"
        );
        assert_eq!(log.line(after(60), counted(9, 4)), None, "nothing new");
    }
}
