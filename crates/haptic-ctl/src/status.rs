//! `status`: how the rig and the daemon are.

use crate::failure::Failure;
use crate::{Daemon, output};
use haptic_ipc::{Request, Status};

pub(crate) async fn run(daemon: &mut Daemon, json: bool) -> Result<(), Failure> {
    let status: Status = daemon.ask(Request::Status {}).await?;
    if json {
        return output::json(&status);
    }
    let real_time = &status.real_time;
    let mut rows = vec![("state", status.state.to_string())];
    rows.extend(status.fault.clone().map(|fault| ("fault", fault)));
    rows.extend([
        (
            "force",
            format!(
                "{:.3} N on the hand, limit {} N",
                status.command_force_n, status.device.force_limit_n
            ),
        ),
        ("position", format!("{:.3} mm", status.device_position_m * 1e3)),
        (
            "scene",
            format!(
                "{} (revision {}, {} scheme, {} velocity)",
                status.scene, status.revision, status.scheme, status.velocity_estimator
            ),
        ),
        ("device", status.device.description.clone()),
        (
            "loop",
            format!(
                "{:.0} Hz, tick {}, up {:.1} s",
                status.rate_hz, status.tick, status.uptime_s
            ),
        ),
        (
            "thread",
            format!(
                "{}, {}, {}",
                real_time.fifo_priority.map_or_else(
                    || "ordinary priority".to_owned(),
                    |priority| format!("SCHED_FIFO {priority}")
                ),
                real_time
                    .cpu
                    .map_or_else(|| "not pinned".to_owned(), |cpu| format!("processor {cpu}")),
                if real_time.memory_locked {
                    "memory locked"
                } else {
                    "memory not locked"
                },
            ),
        ),
        ("clients", status.clients.to_string()),
        ("server", status.server.clone()),
    ]);
    for problem in &real_time.problems {
        rows.push(("problem", problem.what.clone()));
        rows.push(("", format!("to mend it: {}", problem.remedy)));
    }
    let rows: Vec<Vec<String>> = rows
        .into_iter()
        .map(|(name, value)| vec![name.to_owned(), value])
        .collect();
    output::line(&output::table(&rows))
}
