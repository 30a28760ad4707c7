//! How the real-time thread is to run.

/// How the real-time thread is to run.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ThreadSettings {
    pub(crate) period_ns: u64,
    /// Time from the multiples of the period to the deadlines, ns.
    pub(crate) phase_ns: u64,
    pub(crate) cpu: Option<usize>,
    pub(crate) policy: Policy,
    /// Time before a deadline at which it wakes up to spin, ns. By default it is what waking up
    /// usually takes, if spinning keeps nobody else waiting.
    pub(crate) spin_ns: Option<u64>,
}

/// How the loop is scheduled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Policy {
    /// SCHED_FIFO at a priority.
    Fifo { priority: u8 },
    /// SCHED_DEADLINE: half of every period is guaranteed. It cannot be pinned.
    Deadline,
}

/// Nearly all wake-ups are shorter than this, ns: on the machines that it was measured on half of
/// them take 13 to 40 us, and one in a hundred more than 20 to 70 us, by the hour.
const DEFAULT_SPIN_NS: u64 = 100_000;

impl ThreadSettings {
    /// Time before a deadline that is spun away, ns.
    pub(crate) fn spin_ns(&self, has_core_and_priority: bool) -> u64 {
        // A loop without a priority or a core of its own would spin away what others need, and
        // gain nothing.
        let usual = if has_core_and_priority { DEFAULT_SPIN_NS } else { 0 };
        // At least half of every period is left to the rest of the system.
        self.spin_ns.unwrap_or(usual).min(self.period_ns / 2)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // hazard: P11
    #[test]
    fn the_loop_never_spins_for_more_than_half_a_period() {
        let with = |spin_ns, period_ns, alone: bool| {
            let settings = ThreadSettings {
                period_ns,
                phase_ns: period_ns / 2,
                cpu: Some(1),
                policy: Policy::Fifo { priority: 50 },
                spin_ns,
            };
            settings.spin_ns(alone)
        };
        for period_ns in [50_000, 100_000, 150_000, 1_000_000, 10_000_000] {
            for wanted_ns in [None, Some(0), Some(30_000), Some(period_ns), Some(u64::MAX)] {
                for alone in [false, true] {
                    let spins_ns = with(wanted_ns, period_ns, alone);
                    assert!(
                        spins_ns <= period_ns / 2,
                        "{spins_ns} ns of {period_ns} ns, asked for {wanted_ns:?}"
                    );
                }
            }
        }
        // At 1 kHz there is room for the usual time, and for what was asked for.
        assert_eq!(with(None, 1_000_000, true), DEFAULT_SPIN_NS);
        assert_eq!(with(Some(30_000), 1_000_000, true), 30_000);
        // Without a priority and a processor of its own it keeps nobody waiting, unless the options say so.
        assert_eq!(with(None, 1_000_000, false), 0);
        assert_eq!(with(Some(30_000), 1_000_000, false), 30_000);
    }
}
