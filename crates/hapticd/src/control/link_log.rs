//! Which lines the log gets about a link that fails again and again: each reason once, then counts at growing
//! intervals.

use device_io::link::{ConnectError, LinkState};
use std::time::{Duration, Instant};

/// Time for which a reason must last: a node that appears has its rights a moment later.
const SETTLED: Duration = Duration::from_millis(200);

/// Time for which a connection must last before the next failure is a new one.
const STEADY: Duration = Duration::from_secs(10);

/// Intervals between two counts of the same; the last one stays.
const INTERVALS: [Duration; 3] = [
    Duration::from_secs(10),
    Duration::from_secs(100),
    Duration::from_secs(1000),
];

/// Most lines about changes before they are only counted, until there was none for [`QUIET`].
const MAX_CHANGES: u32 = 12;
const QUIET: Duration = Duration::from_secs(60);

/// When the next count is due.
#[derive(Debug, Default)]
struct Intervals {
    next: usize,
    due: Option<Instant>,
}

impl Intervals {
    /// Whether a count is due; the next one is later than this one was.
    fn is_due(&mut self, now: Instant) -> bool {
        let due = *self.due.get_or_insert(now + INTERVALS[self.next]);
        if now < due {
            return false;
        }
        self.next = (self.next + 1).min(INTERVALS.len() - 1);
        self.due = Some(now + INTERVALS[self.next]);
        true
    }
}

/// The lines about a link.
#[derive(Debug, Default)]
pub(super) struct LinkLog {
    /// The newest reason, since when, and whether it was logged.
    reason: Option<(ConnectError, Instant, bool)>,
    /// Failed attempts when the reason was last logged.
    attempts: u64,
    repeats: Intervals,
    connected_since: Option<Instant>,
    changes: u32,
    changed_at: Option<Instant>,
    /// Changes that were not logged.
    withheld: u64,
    counts: Intervals,
}

impl LinkLog {
    /// Whether a change of the link is logged now. It is counted otherwise.
    pub(super) fn admits(&mut self, now: Instant) -> bool {
        if self.changed_at.is_none_or(|changed_at| now >= changed_at + QUIET) {
            (self.changes, self.counts) = (0, Intervals::default());
        }
        self.changed_at = Some(now);
        self.changes = self.changes.saturating_add(1);
        let is_logged = self.changes <= MAX_CHANGES;
        self.withheld += u64::from(!is_logged);
        is_logged
    }

    /// The lines that are due, for the state of the link and the attempts that have failed so far.
    pub(super) fn lines(&mut self, now: Instant, state: &LinkState, attempts: u64) -> Vec<String> {
        let mut lines: Vec<String> = self.of_reason(now, state, attempts).into_iter().collect();
        if self.withheld > 0 && self.counts.is_due(now) {
            let is = match state {
                LinkState::Connected(_) => "connected",
                LinkState::Looking | LinkState::Waiting(_) => "not connected",
            };
            lines.push(format!(
                "the link has changed {} times more; it is {is} now",
                self.withheld
            ));
            self.withheld = 0;
        }
        lines
    }

    fn of_reason(&mut self, now: Instant, state: &LinkState, attempts: u64) -> Option<String> {
        let why = match state {
            LinkState::Looking => return None,
            LinkState::Connected(_) => {
                if now >= *self.connected_since.get_or_insert(now) + STEADY {
                    self.reason = None;
                }
                return None;
            }
            LinkState::Waiting(why) => why,
        };
        self.connected_since = None;
        let (since, is_logged) = match &self.reason {
            Some((known, since, is_logged)) if known == why => (*since, *is_logged),
            _ => (now, false),
        };
        let tells = !is_logged && now >= since + SETTLED;
        self.reason = Some((why.clone(), since, is_logged || tells));
        if tells {
            self.attempts = attempts;
            self.repeats = Intervals {
                due: Some(now + INTERVALS[0]),
                ..Intervals::default()
            };
            return self
                .admits(now)
                .then(|| format!("the device is not connected: {}", why.with_remedy()));
        }
        let failed = attempts - self.attempts;
        if !is_logged || failed == 0 || !self.repeats.is_due(now) {
            return None;
        }
        self.attempts = attempts;
        Some(format!(
            "the device is still not connected after {failed} more attempts: {why}"
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::presence::tests::connected;

    fn refused(why: &str) -> LinkState {
        LinkState::Waiting(ConnectError::Refused {
            what: "/dev/ttyACM0".to_owned(),
            why: why.to_owned(),
            remedy: "the remedy".to_owned(),
        })
    }

    /// The lines of a link that is looked at ten times a second, with what its state and its attempts are then.
    fn lines(tenths: u64, at: impl Fn(u64) -> (LinkState, u64)) -> Vec<(u64, String)> {
        let began = Instant::now();
        let mut log = LinkLog::default();
        let mut logged = Vec::new();
        for tenth in 0..tenths {
            let (state, attempts) = at(tenth);
            let now = began + Duration::from_millis(100 * tenth);
            logged.extend(log.lines(now, &state, attempts).into_iter().map(|line| (tenth, line)));
        }
        logged
    }

    #[test]
    fn a_port_that_cannot_be_opened_is_logged_once_then_counted() {
        // Ten hours of an attempt each 4 s.
        let logged = lines(360_000, |tenth| (refused("in use"), 1 + tenth / 40));
        assert!(logged.len() < 45, "{} lines", logged.len());
        let (at, first) = &logged[0];
        assert_eq!(*at, 2, "at once");
        assert_eq!(first, "the device is not connected: /dev/ttyACM0: in use; the remedy");
        let (at, second) = &logged[1];
        assert!((100..=110).contains(at), "after {at} tenths");
        assert!(second.contains("still not connected after 2 more attempts"), "{second}");
        let counted = logged[2].0 - logged[1].0;
        assert!((1000..=1010).contains(&counted), "the next after {counted} tenths");
    }

    #[test]
    fn another_reason_is_logged_anew_and_a_passing_one_is_not() {
        let logged = lines(100, |tenth| match tenth {
            // As a node appears, before it has its rights.
            0 => (refused("no right"), 1),
            1..50 => (refused("in use"), 2),
            _ => (LinkState::Waiting(ConnectError::Absent { what: "it".to_owned() }), 3),
        });
        let logged: Vec<&str> = logged.iter().map(|(_, line)| &**line).collect();
        assert_eq!(logged.len(), 2, "{logged:?}");
        assert!(logged[0].contains("in use; the remedy"), "{logged:?}");
        assert!(logged[1].contains("it is not there; plug it in"), "{logged:?}");
    }

    #[test]
    fn a_device_that_only_greets_does_not_fill_the_log() {
        let connected = connected();
        let began = Instant::now();
        let mut log = LinkLog::default();
        let (mut logged, mut withheld) = (0, Vec::new());
        // An hour in which it is connected for half of each second.
        for half in 0..7200 {
            let now = began + Duration::from_millis(500 * half);
            let state = if half % 2 == 0 {
                connected.clone()
            } else {
                refused("no samples")
            };
            logged += u32::from(log.admits(now));
            let due = log.lines(now, &state, half / 2);
            logged += u32::try_from(due.len()).expect("few");
            withheld.extend(due.into_iter().filter(|line| line.contains("has changed")));
        }
        assert!(logged < 25, "{logged} lines in an hour");
        assert!(withheld.len() > 2, "{withheld:?}");
        // Well for a while, and lost once more.
        let later = began + Duration::from_secs(3600);
        log.lines(later, &connected, 3600);
        log.lines(later + QUIET, &connected, 3600);
        assert!(log.admits(later + QUIET), "this is news");
    }
}
