//! The live status line of `--demo`.

use crate::control::RigHandle;
use crate::timers::every;
use haptic_ipc::RigState;
use std::io::IsTerminal;
use std::rc::Rc;
use std::time::Duration;

/// Shows state, rate, duration of a tick and overruns until it is dropped: in place on a terminal,
/// a line a second elsewhere.
pub(crate) async fn show_status(rig: Rc<RigHandle>) {
    let in_place = std::io::stdout().is_terminal();
    let mut pause = every(Duration::from_millis(if in_place { 200 } else { 1000 }));
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
    let (wake, tick) = feed.timing.recent();
    let (state, force, ticks, missed, dropped) = feed.newest().map_or((RigState::Idle, 0.0, 0, 0, 0), |last| {
        (
            last.state,
            last.command_force,
            last.tick,
            last.missed_periods,
            last.dropped,
        )
    });
    #[expect(clippy::cast_precision_loss, reason = "times below 2^53 ns")]
    let us = |ns: u64| ns as f64 * 1e-3;
    format!(
        "{state:<9} {:.0} Hz  tick {:.1} us (p99 {:.1})  wake-up +{:.0} us (p99 {:.0})  ticks {ticks}  overruns {}  \
         missed {missed}  dropped {dropped}  force {force:+.2} N",
        1.0 / rig.facts.period_s(),
        us(tick.p50),
        us(tick.p99),
        us(wake.p50),
        us(wake.p99),
        feed.timing.counted().overruns,
    )
}
