//! Which tick it is now, though the rows come later.

use haptic_ipc::Sample;
use std::time::Instant;

/// Follows the daemon's clock by the rows that came soonest after their ticks.
pub(super) struct TickClock {
    began: Instant,
    loop_rate_hz: f64,
    /// Our time less the daemon's, s: the least that was seen, which has the least delay in it.
    offset_s: f64,
    newest: Option<(u64, f64)>,
}

impl TickClock {
    pub(super) fn new(loop_rate_hz: f64) -> Self {
        Self {
            began: Instant::now(),
            loop_rate_hz,
            offset_s: f64::INFINITY,
            newest: None,
        }
    }

    /// Takes the newest row, which has just come.
    pub(super) fn take(&mut self, row: &Sample) {
        self.take_at(row, self.began.elapsed().as_secs_f64());
    }

    /// The tick that comes next; none before the first row.
    pub(super) fn next_tick(&self) -> Option<u64> {
        self.next_tick_at(self.began.elapsed().as_secs_f64())
    }

    fn take_at(&mut self, row: &Sample, now_s: f64) {
        self.offset_s = self.offset_s.min(now_s - row.t_s);
        self.newest = Some((row.tick, row.t_s));
    }

    fn next_tick_at(&self, now_s: f64) -> Option<u64> {
        let (tick, t_s) = self.newest?;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "not negative; the cast saturates"
        )]
        let since = ((now_s - self.offset_s - t_s) * self.loop_rate_hz).max(0.0) as u64;
        Some(tick.saturating_add(since).saturating_add(1))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_that_come_late_do_not_set_the_clock_back() {
        let row = |tick: u64, t_s: f64| Sample {
            tick,
            t_s,
            ..Sample::default()
        };
        let mut clock = TickClock::new(1000.0);
        assert_eq!(clock.next_tick_at(0.0), None);
        clock.take_at(&row(5000, 5.0), 0.101);
        assert_eq!(clock.next_tick_at(0.101), Some(5001));
        clock.take_at(&row(5020, 5.02), 0.1205);
        assert_eq!(clock.next_tick_at(0.1205 + 0.0101), Some(5031));
        // Two seconds late.
        clock.take_at(&row(5040, 5.04), 2.1405);
        assert_eq!(clock.next_tick_at(2.1406), Some(7041));
    }
}
