//! `timing`: how well the loop keeps time.

use crate::failure::Failure;
use crate::{Daemon, output};
use haptic_ipc::{Percentiles, Request, Timing, TimingWindow};

pub(crate) async fn run(daemon: &mut Daemon, json: bool) -> Result<(), Failure> {
    let timing: Timing = daemon.ask(Request::Timing {}).await?;
    if json {
        return output::json(&timing);
    }
    let blocks = [("since start", &timing.since_start), ("last 10 s", &timing.last_10_s)];
    let texts: Vec<String> = blocks.into_iter().map(|(name, window)| block(name, window)).collect();
    output::line(&format!("{:.3} Hz\n\n{}", timing.rate_hz, texts.join("\n\n")))
}

fn block(name: &str, window: &TimingWindow) -> String {
    let mut rows = vec![[name, "p50", "p99", "p99.9", "max"].map(str::to_owned).to_vec()];
    for (what, percentiles) in [
        ("wake-up latency", &window.wake_latency_ns),
        ("tick", &window.tick_ns),
        ("device round trip", &window.device_round_trip_ns),
        ("period", &window.period_ns),
    ] {
        let Percentiles { p50, p99, p999, max } = *percentiles;
        let mut row = vec![what.to_owned()];
        row.extend([p50, p99, p999, max].map(microseconds));
        rows.push(row);
    }
    format!(
        "{}\nticks {}, overruns {}, missed periods {}, samples dropped {}",
        output::table(&rows),
        window.ticks,
        window.overruns,
        window.missed_periods,
        window.telemetry_dropped
    )
}

#[expect(clippy::cast_precision_loss, reason = "durations below 2^53 ns")]
fn microseconds(ns: u64) -> String {
    format!("{:.2} us", ns as f64 * 1e-3)
}
