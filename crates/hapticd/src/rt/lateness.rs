//! What becomes of a loop that is late: a report, or a fault.

use haptic_core::nearest::meant_or_semicolon;
use std::collections::VecDeque;

/// Over this the missed periods are counted, ns.
const WINDOW_NS: u64 = 1_000_000_000;

/// The largest number of missed periods that a policy may name: each of them may have to be
/// remembered, and forgotten again within one tick.
const MAX_IN_A_SECOND: u32 = 1000;

/// What to do about missed periods.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LatePolicy {
    /// Count them, and say so.
    Warn,
    /// Take the force away when this many are missed within a second.
    Fault { most_in_a_second: u32 },
}

impl std::str::FromStr for LatePolicy {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let count = match text {
            "warn" => return Ok(Self::Warn),
            _ => text.strip_prefix("fault:").and_then(|count| count.parse().ok()),
        };
        match count {
            Some(most_in_a_second @ 1..=MAX_IN_A_SECOND) => Ok(Self::Fault { most_in_a_second }),
            _ => Err(format!(
                "there is no policy `{text}`{} there are warn, and fault:N with N missed periods in a second, from 1 to \
                 {MAX_IN_A_SECOND}",
                meant_or_semicolon(text, if text.contains(':') { &[] } else { &["warn", "fault:N"] })
            )),
        }
    }
}

/// Counts the periods missed within the last second, while force flows.
#[derive(Clone, Debug)]
pub(crate) struct Lateness {
    policy: LatePolicy,
    /// Those of the last second, the oldest first. Fewer than the policy's number are ever in it,
    /// so there is room for each of them.
    recent: VecDeque<Missed>,
    /// How many `recent` has in all.
    recent_periods: u64,
    /// Missed so far, as it was last seen.
    seen: u64,
}

/// Periods of which one tick has found that they were missed.
#[derive(Clone, Copy, Debug)]
struct Missed {
    at_ns: u64,
    periods: u64,
}

impl Lateness {
    pub(crate) fn new(policy: LatePolicy) -> Self {
        let most = match policy {
            LatePolicy::Warn => 0,
            LatePolicy::Fault { most_in_a_second } => most_in_a_second as usize,
        };
        Self {
            policy,
            recent: VecDeque::with_capacity(most),
            recent_periods: 0,
            seen: 0,
        }
    }

    /// Without force nobody is harmed: what was missed until now (`missed_periods` in all)
    /// does not count.
    pub(crate) fn rest(&mut self, missed_periods: u64) {
        self.recent.clear();
        self.recent_periods = 0;
        self.seen = missed_periods;
    }

    /// Whether the loop is too late, at a time and with a number of periods missed in all.
    #[inline]
    pub(crate) fn is_too_late(&mut self, now_ns: u64, missed_periods: u64) -> bool {
        match self.policy {
            LatePolicy::Warn => false,
            LatePolicy::Fault { most_in_a_second } => self.misses_reach(most_in_a_second, now_ns, missed_periods),
        }
    }

    fn misses_reach(&mut self, most_in_a_second: u32, now_ns: u64, missed_periods: u64) -> bool {
        let periods = missed_periods.saturating_sub(self.seen);
        self.seen = missed_periods;
        while let Some(oldest) = self.recent.front().copied()
            && now_ns.saturating_sub(oldest.at_ns) >= WINDOW_NS
        {
            self.recent.pop_front();
            self.recent_periods -= oldest.periods;
        }
        if self.recent_periods + periods >= u64::from(most_in_a_second) {
            return true;
        }
        if periods > 0 {
            // Never more entries than periods, and never as many periods as there is room for:
            // nothing is allocated.
            self.recent.push_back(Missed { at_ns: now_ns, periods });
            self.recent_periods += periods;
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    const MS: u64 = 1_000_000;

    fn of(policy: &str) -> Lateness {
        Lateness::new(policy.parse().expect("a policy"))
    }

    #[test]
    fn a_policy_that_warns_finds_nothing_too_late_and_a_wrong_one_is_refused() {
        let mut warning = of("warn");
        assert!(!warning.is_too_late(5000 * MS, 0) && !warning.is_too_late(5100 * MS, 99));
        for wrong in [
            "fault",
            "fault:0",
            "fault:-1",
            "fault:1001",
            "fault:99999999999",
            "stop",
        ] {
            assert!(wrong.parse::<LatePolicy>().is_err(), "{wrong}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        /// As if all were remembered, and without ever asking for memory.
        #[test]
        fn any_second_with_so_many_is_too_late_and_no_other(
            most in 1..40_u64,
            ticks in prop::collection::vec((1..300 * MS, prop_oneof![4 => Just(0_u64), 1 => 0..8_u64]), 1..200),
        ) {
            let mut lateness = of(&format!("fault:{most}"));
            lateness.rest(0);
            let room = lateness.recent.capacity();
            let (mut now_ns, mut missed, mut all) = (0, 0, Vec::new());
            for (after_ns, periods) in ticks {
                now_ns += after_ns;
                missed += periods;
                all.push((now_ns, periods));
                let within: u64 = all
                    .iter()
                    .filter(|(at_ns, _)| now_ns - at_ns < WINDOW_NS)
                    .map(|(_, periods)| periods)
                    .sum();
                prop_assert_eq!(lateness.is_too_late(now_ns, missed), within >= most);
                prop_assert_eq!(lateness.recent.capacity(), room);
                if within >= most {
                    // A fault: no force, until somebody engages again.
                    all.clear();
                    lateness.rest(missed);
                }
            }
        }
    }
}
