//! What becomes of a loop that is late: said, or a fault.

/// Over this the missed periods are counted, ns.
const WINDOW_NS: u64 = 1_000_000_000;

/// What to do about missed periods.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LatePolicy {
    /// Count them, and say so.
    Warn,
    /// Take the force away when so many are missed within a second.
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
            Some(most_in_a_second @ 1..) => Ok(Self::Fault { most_in_a_second }),
            _ => Err(format!(
                "there is no policy `{text}`; there are warn, and fault:N with N missed periods in a second, from 1"
            )),
        }
    }
}

/// Counts missed periods by the second.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Lateness {
    policy: LatePolicy,
    window_began_ns: u64,
    missed_before: u64,
}

impl Lateness {
    pub(crate) fn new(policy: LatePolicy) -> Self {
        Self {
            policy,
            window_began_ns: 0,
            missed_before: 0,
        }
    }

    /// Whether the loop is too late, at a time and with so many periods missed in all.
    pub(crate) fn is_too_late(&mut self, now_ns: u64, missed_periods: u64) -> bool {
        if now_ns.saturating_sub(self.window_began_ns) >= WINDOW_NS {
            // What the tick that opens a window has just missed belongs to the window.
            if self.window_began_ns == 0 {
                self.missed_before = missed_periods;
            }
            self.window_began_ns = now_ns;
            let late = self.exceeds(missed_periods);
            self.missed_before = missed_periods;
            return late;
        }
        self.exceeds(missed_periods)
    }

    fn exceeds(&self, missed_periods: u64) -> bool {
        match self.policy {
            LatePolicy::Warn => false,
            LatePolicy::Fault { most_in_a_second } => {
                missed_periods - self.missed_before >= u64::from(most_in_a_second)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_policy_counts_within_a_second() {
        let mut lateness = Lateness::new("fault:3".parse().expect("a policy"));
        assert!(
            !lateness.is_too_late(5_000_000_000, 7),
            "what was missed before the first tick is not counted"
        );
        assert!(!lateness.is_too_late(5_500_000_000, 9));
        assert!(
            !lateness.is_too_late(6_100_000_000, 9),
            "a second later they are forgotten"
        );
        assert!(!lateness.is_too_late(6_200_000_000, 11));
        assert!(lateness.is_too_late(6_300_000_000, 12));
        let mut stalled = Lateness::new("fault:3".parse().expect("a policy"));
        assert!(!stalled.is_too_late(5_000_000_000, 0));
        assert!(
            stalled.is_too_late(9_000_000_000, 4000),
            "a stall of seconds is late as well"
        );
        let mut warning = Lateness::new(LatePolicy::Warn);
        assert!(!warning.is_too_late(5_000_000_000, 0) && !warning.is_too_late(5_100_000_000, 99));
        for wrong in ["fault", "fault:0", "fault:-1", "stop"] {
            assert!(wrong.parse::<LatePolicy>().is_err(), "{wrong}");
        }
    }
}
