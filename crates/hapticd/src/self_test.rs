//! `--self-test`: what the machine can do, and what hapticd adds to it. The loop and a bare one that only waits take turns on the same processor at the
//! same priority, so that the machine's moods are shared; what they saw stands side by side.

use crate::rt::clock::{Grid, Waiting, now_ns};
use crate::rt::tick::Tick;
use device_io::Device;
use std::fmt::Write;

/// How long each takes its turn, s.
const TURN_S: u64 = 2;
/// Turns of each.
const TURNS: usize = 5;

/// What one of the two loops saw.
#[derive(Clone, Debug, Default)]
pub(crate) struct Seen {
    /// How long after its deadline each tick began, ns.
    wake_latency_ns: Vec<u64>,
    /// How long each tick took, ns.
    tick_ns: Vec<u64>,
    missed_periods: u64,
}

impl Seen {
    /// Room for everything, so that nothing is allocated while it runs.
    fn with_room(ticks: usize) -> Self {
        Self {
            wake_latency_ns: Vec::with_capacity(ticks),
            tick_ns: Vec::with_capacity(ticks),
            missed_periods: 0,
        }
    }
}

/// What both loops saw.
#[derive(Clone, Debug, Default)]
pub(crate) struct Comparison {
    bare: Seen,
    hapticd: Seen,
}

/// Runs both loops, turn by turn, on the calling thread, which is prepared already.
pub(crate) fn compare(tick: &mut Tick<dyn Device>, period_ns: u64, waiting: Waiting) -> Comparison {
    let ticks_a_turn = usize::try_from(TURN_S * 1_000_000_000 / period_ns).unwrap_or(usize::MAX);
    let room = (ticks_a_turn + 1) * TURNS;
    let mut comparison = Comparison {
        bare: Seen::with_room(room),
        hapticd: Seen::with_room(room),
    };
    for _ in 0..TURNS {
        turn(&mut comparison.bare, ticks_a_turn, period_ns, waiting, |_, _| now_ns());
        turn(
            &mut comparison.hapticd,
            ticks_a_turn,
            period_ns,
            waiting,
            |wake, missed| tick.run(wake, missed),
        );
    }
    comparison
}

fn turn(
    seen: &mut Seen,
    ticks: usize,
    period_ns: u64,
    waiting: Waiting,
    mut work: impl FnMut(crate::rt::clock::Wake, u64) -> u64,
) {
    let mut grid = Grid::new(period_ns, now_ns());
    for _ in 0..ticks {
        let wake = grid.wait(waiting);
        let ended_ns = work(wake, grid.missed());
        grid.advance(ended_ns);
        seen.wake_latency_ns
            .push(wake.began_ns.saturating_sub(wake.deadline_ns));
        seen.tick_ns.push(ended_ns.saturating_sub(wake.began_ns));
    }
    seen.missed_periods += grid.missed();
}

fn quantile(sorted: &[u64], share: f64) -> f64 {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        clippy::cast_precision_loss,
        reason = "an index, and nanoseconds below 2^53"
    )]
    let at = |index: f64| sorted.get(index as usize).map_or(0.0, |ns| *ns as f64 * 1e-3);
    #[expect(clippy::cast_precision_loss, reason = "a few hundred thousand ticks")]
    let last = sorted.len().saturating_sub(1) as f64;
    at((last * share).round())
}

impl Comparison {
    /// The two side by side, as people read them.
    pub(crate) fn report(mut self, period_ns: u64, waiting: Waiting) -> String {
        for durations in [
            &mut self.bare.wake_latency_ns,
            &mut self.hapticd.wake_latency_ns,
            &mut self.hapticd.tick_ns,
        ] {
            durations.sort_unstable();
        }
        let mut text = format!(
            "{TURNS} turns of {TURN_S} s each, every {} us, spinning for the last {} us of each wait\n\n{:24}{:>12}{:>12}\n",
            period_ns / 1000,
            waiting.spin_ns / 1000,
            "wake-up latency, us",
            "bare loop",
            "hapticd"
        );
        let (bare, ours) = (&self.bare.wake_latency_ns, &self.hapticd.wake_latency_ns);
        let mut row = |name: &str, bare: String, ours: String| {
            // A string takes whatever is written to it.
            writeln!(text, "{name:24}{bare:>12}{ours:>12}").unwrap_or(());
        };
        for (name, share) in [("  p50", 0.5), ("  p99", 0.99), ("  p99.9", 0.999), ("  max", 1.0)] {
            row(
                name,
                format!("{:.2}", quantile(bare, share)),
                format!("{:.2}", quantile(ours, share)),
            );
        }
        row(
            "periods missed",
            self.bare.missed_periods.to_string(),
            self.hapticd.missed_periods.to_string(),
        );
        row("ticks", bare.len().to_string(), ours.len().to_string());
        let ticks = &self.hapticd.tick_ns;
        writeln!(
            text,
            "\nwhole tick, fake rig included: p50 {:.2} us, p99 {:.2} us, p99.9 {:.2} us, max {:.2} us",
            quantile(ticks, 0.5),
            quantile(ticks, 0.99),
            quantile(ticks, 0.999),
            quantile(ticks, 1.0)
        )
        .unwrap_or(());
        text
    }
}
