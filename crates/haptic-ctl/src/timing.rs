//! `timing`: how well the loop keeps time.

use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::output;
use haptic_ipc::{Bucket, Percentiles, Request, StopTimes, Timing, TimingHistogram, TimingWindow};

pub(crate) async fn run(daemon: &mut Daemon, json: bool) -> Result<(), Failure> {
    let timing: Timing = daemon.ask(Request::Timing {}).await?;
    if json {
        return output::json(&timing);
    }
    let blocks = [("since start", &timing.since_start), ("last 10 s", &timing.last_10_s)];
    let texts: Vec<String> = blocks.into_iter().map(|(name, window)| block(name, window)).collect();
    output::line(&format!("{:.3} Hz\n\n{}", timing.rate_hz, texts.join("\n\n")))?;
    if let Some(stops) = stops(&timing.stops) {
        output::line(&stops)?;
    }
    let TimingHistogram {
        wake_latency_ns,
        tick_ns,
    } = &timing.last_10_s.histogram;
    for (what, buckets) in [("wake-up latency", wake_latency_ns), ("tick", tick_ns)] {
        if !buckets.is_empty() {
            output::line(&format!("\n{what}, last 10 s\n{}", histogram(buckets, 40.0)))?;
        }
    }
    Ok(())
}

/// A bar for each bucket, as long as the logarithm of its count: the rare ones are those to be
/// seen. The longest is as long as `width`.
pub(crate) fn histogram(buckets: &[Bucket], width: f64) -> String {
    #[expect(clippy::cast_precision_loss, reason = "counts of ticks")]
    let size = |count: u64| (1.0 + count as f64).log10();
    let most = buckets.iter().map(|bucket| size(bucket.count)).fold(1e-9, f64::max);
    let rows: Vec<Vec<String>> = buckets
        .iter()
        .skip_while(|bucket| bucket.count == 0)
        .map(|bucket| {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "from 0 to the width"
            )]
            let bar = (width * size(bucket.count) / most).round() as usize;
            vec![
                format!("up to {}", microseconds(bucket.up_to)),
                bucket.count.to_string(),
                "#".repeat(bar),
            ]
        })
        .collect();
    output::table(&rows)
}

fn block(name: &str, window: &TimingWindow) -> String {
    let mut rows = vec![output::row([name, "p50", "p99", "p99.9", "max"])];
    for (what, percentiles) in [
        ("wake-up latency", &window.wake_latency_ns),
        ("tick", &window.tick_ns),
        ("device read/write", &window.device_round_trip_ns),
        ("period", &window.period_ns),
    ] {
        rows.push(row(what, percentiles));
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

fn row(what: &str, percentiles: &Percentiles) -> Vec<String> {
    let Percentiles { p50, p99, p999, max } = *percentiles;
    let mut row = vec![what.to_owned()];
    row.extend([p50, p99, p999, max].map(microseconds));
    row
}

/// How long stops took, where there were any.
fn stops(stops: &StopTimes) -> Option<String> {
    let StopTimes {
        confirmed,
        unconfirmed,
        without_device,
        ..
    } = *stops;
    if confirmed + unconfirmed + without_device == 0 {
        return None;
    }
    let rows = [
        output::row(["stops", "p50", "p99", "p99.9", "max"]),
        row("to zero force written", &stops.to_written_ns),
        row("to motor off confirmed", &stops.to_confirmed_ns),
    ];
    Some(format!(
        "\n{}\nconfirmed {confirmed}, unconfirmed {unconfirmed}, without a device {without_device}",
        output::table(&rows)
    ))
}

#[expect(clippy::cast_precision_loss, reason = "durations below 2^53 ns")]
fn microseconds(ns: u64) -> String {
    format!("{:.2} us", ns as f64 * 1e-3)
}
