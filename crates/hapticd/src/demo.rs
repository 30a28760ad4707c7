//! The live status line of `--demo`.

use crate::control::RigHandle;
use std::io::IsTerminal;
use std::rc::Rc;
use std::time::Duration;

/// Shows state, rate, duration of a tick and overruns until it is dropped: in place on a terminal,
/// a line a second elsewhere.
pub(crate) async fn show_status(rig: Rc<RigHandle>) {
    let in_place = std::io::stdout().is_terminal();
    let mut pause = tokio::time::interval(Duration::from_millis(if in_place { 200 } else { 1000 }));
    loop {
        pause.tick().await;
        let line = status_line(&rig);
        crate::log::show(if in_place {
            format!("\r\x1b[2K{line}")
        } else {
            format!("{line}\n")
        });
    }
}

/// One line on the state of the loop.
pub(crate) fn status_line(rig: &RigHandle) -> String {
    let feed = rig.feed();
    let timing = feed.timing().report();
    let recent = &timing.last_10_s;
    let (state, force) = feed.newest().map_or((haptic_ipc::RigState::Idle, 0.0), |record| {
        (record.state, record.command_force)
    });
    #[expect(clippy::cast_precision_loss, reason = "times below 2^53 ns")]
    let us = |ns: u64| ns as f64 * 1e-3;
    format!(
        "{state:<9} {:.0} Hz  tick {:.1} us (p99 {:.1})  wake-up +{:.0} us (p99 {:.0})  ticks {}  overruns {}  \
         missed {}  dropped {}  force {force:+.2} N",
        timing.rate_hz,
        us(recent.tick_ns.p50),
        us(recent.tick_ns.p99),
        us(recent.wake_latency_ns.p50),
        us(recent.wake_latency_ns.p99),
        timing.since_start.ticks,
        timing.since_start.overruns,
        timing.since_start.missed_periods,
        timing.since_start.telemetry_dropped,
    )
}
