//! `status`: the state of the rig and of the daemon.

use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::{console, output};
use haptic_ipc::{ForceLimitBy, LinkStatus, Request, RigFrictionStatus, RigState, ScheduleStatus, Status, socket_path};
use std::path::Path;

pub(crate) async fn run(daemon: &mut Daemon, socket: Option<&Path>, json: bool) -> Result<(), Failure> {
    let status: Status = daemon.ask(Request::Status {}).await?;
    if json {
        return output::json(&status);
    }
    let mut rows: Vec<_> = name_row(&socket_path::for_client(socket)).into_iter().collect();
    rows.extend(rig_rows(&status));
    if let Some(link) = &status.device.link {
        rows.extend(link_rows(link));
    }
    for problem in &status.device.engage_refused {
        rows.push(("will not engage", problem.what.clone()));
        rows.push(("", problem.remedy.clone()));
    }
    rows.extend(loop_rows(&status));
    output::line(&output::named(rows))
}

/// Which rig this is, if it has a name: nobody may have named it, where it is the only one in reach.
fn name_row(socket: &Path) -> Option<(&'static str, String)> {
    Some(("rig", socket_path::name_of(socket)?.to_owned()))
}

/// The force on the hand; in the plane its length and its parts.
fn force(status: &Status) -> String {
    let parts = status
        .command_force_y_n
        .map(|y_n| format!(" (x {:.3}, y {y_n:.3})", status.command_force_n));
    format!("{:.3} N{}", status.force_on_hand_n(), parts.unwrap_or_default())
}

fn rig_rows(status: &Status) -> Vec<(&'static str, String)> {
    let mut rows = vec![("state", state(status.state))];
    rows.extend(status.fault.clone().map(|fault| ("fault", fault)));
    rows.extend(
        status
            .commissioning
            .as_ref()
            .map(|by| ("commissioning", by.to_string())),
    );
    rows.extend([
        (
            "force",
            format!(
                "{} on the hand, limits {} N{}, {} N/s, {} m/s, {} m/s^2",
                force(status),
                output::figure(status.device.force_limit_n),
                match status.device.force_limit_by {
                    ForceLimitBy::Device => " (the device's)",
                    _ => "",
                },
                output::figure(status.device.slew_limit_n_per_s),
                output::figure(status.device.speed_limit_mps),
                output::figure(status.device.acceleration_limit_mps2)
            ),
        ),
        (
            "energy",
            format!(
                "{:.4} mJ created by sampling beyond the rig's own losses",
                status.energy_excess_j * 1e3
            ),
        ),
        (
            "position",
            match status.device_position_y_m {
                None => format!("{:.3} mm", status.device_position_m * 1e3),
                Some(y_m) => format!("x {:.3} mm, y {:.3} mm", status.device_position_m * 1e3, y_m * 1e3),
            },
        ),
        (
            "scene",
            format!(
                "{} ({}revision {}, {} scheme, {} velocity)",
                status.scene,
                library_scene(status),
                status.revision,
                status.scheme,
                status.velocity_estimator
            ),
        ),
        ("device", status.device.description.clone()),
    ]);
    rows.extend(broken_bounds(status).map(|text| ("advice", text)));
    rows.extend(status.scheduled.as_ref().map(|scheduled| {
        let ScheduleStatus {
            by,
            names,
            waiting,
            next_tick,
            last_tick,
        } = scheduled;
        let named = if names.is_empty() {
            String::new()
        } else {
            format!(" ({})", names.join(", "))
        };
        let text = format!(
            "{}{named} from tick {next_tick} to {last_tick}, by {by}",
            output::count(*waiting as u64, "change")
        );
        ("scheduled", text)
    }));
    rows.extend(
        status
            .device
            .rig_friction
            .iter()
            .filter(|_| status.has_device())
            .map(|friction| ("rig friction", rig_friction(friction))),
    );
    rows
}

/// The bounds of the adviser that the scene breaks.
fn broken_bounds(status: &Status) -> Option<String> {
    let bounds = &status.broken_bounds;
    (!bounds.is_empty()).then(|| format!("broken: {}; see `haptic-ctl advise`", bounds.join(", ")))
}

/// The scene of the library that the active one comes from.
fn library_scene(status: &Status) -> String {
    match &status.library_scene {
        Some(scene) if scene.changed => format!("from {} of the library, changed since; ", scene.name),
        Some(scene) => format!("{} of the library; ", scene.name),
        None => String::new(),
    }
}

/// The rig's own friction, and what is done with it.
pub(crate) fn rig_friction(known: &RigFrictionStatus) -> String {
    let mut text = format!(
        "{:.3} N ({}), {:.3} N s/m ({})",
        known.friction_n, known.friction_from, known.damping_ns_per_m, known.damping_from
    );
    if let Some(share) = known.compensated_share {
        text.push_str(&format!(", {share} of it compensated below the scene"));
    }
    if let Some(problem) = &known.problem {
        text.push_str(&format!("; not used: {problem}"));
    }
    text
}

fn loop_rows(status: &Status) -> Vec<(&'static str, String)> {
    let real_time = &status.real_time;
    let mut rows = vec![
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
                "{}, {}, {}, {}, spinning for {} us{}",
                real_time.scheduling(),
                real_time.place(),
                real_time.memory(),
                if real_time.cpus_kept_awake {
                    "processors kept awake"
                } else {
                    "processors may sleep"
                },
                real_time.spin_us,
                if real_time.denormals_flushed {
                    ", denormals flushed"
                } else {
                    ""
                },
            ),
        ),
        ("clients", status.clients.to_string()),
        ("server", status.server.clone()),
    ];
    for problem in &real_time.problems {
        rows.push(("problem", problem.what.clone()));
        rows.push(("", format!("fix: {}", problem.remedy)));
    }
    rows
}

fn state(state: RigState) -> String {
    let style = match state {
        RigState::Stopped | RigState::Faulted => console::BAD,
        _ if state.is_live() => console::GOOD,
        _ => return state.to_string(),
    };
    console::paint(&state.to_string(), style)
}

fn link_rows(link: &LinkStatus) -> Vec<(&'static str, String)> {
    let mut rows = Vec::new();
    if let Some(device) = &link.device {
        rows.push((
            "firmware",
            format!(
                "{}, {:.0} samples/s, {:.3} um a count, up to {} N",
                device.firmware,
                device.sample_rate_hz,
                device.resolution_m * 1e6,
                output::figure(device.force_limit_n)
            ),
        ));
    }
    rows.extend(link.waiting.clone().map(|why| ("waiting", why)));
    let drift = link
        .clock_drift_ppm
        .map_or_else(|| "not known yet".to_owned(), |ppm| format!("{ppm:+.1} ppm"));
    // Without a device these are of the one that is gone.
    if link.device.is_some() {
        rows.push((
            "link",
            format!(
                "round trip {:.0} us (longest {:.0}), newest sample {:.0} us old, device clock {drift}",
                link.round_trip_us, link.round_trip_max_us, link.age_us
            ),
        ));
    }
    let counts = &link.counts;
    rows.push((
        "samples",
        format!(
            "{}, lost {}, jumps of the sequence {}, bad CRC {}, malformed {}, out of sequence {}, late {}",
            counts.samples,
            counts.lost,
            counts.sequence_jumps,
            counts.bad_crc,
            counts.malformed,
            counts.out_of_sequence,
            counts.late
        ),
    ));
    rows.push((
        "commands",
        format!(
            "not sent {}, cut to the device's limit {}; errors of the device {}; connections {}",
            counts.not_sent, counts.clipped, counts.device_errors, counts.connections
        ),
    ));
    if let Some(error) = &link.last_error {
        rows.push(("last error", format!("{}, {:.1} s ago", error.message, error.age_s)));
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rig_with_a_name_is_named_first() {
        let row = |socket: &str| name_row(Path::new(socket));
        assert_eq!(row("/run/hapticd@left/control.sock"), Some(("rig", "left".to_owned())));
        assert_eq!(row("/run/hapticd/control.sock"), None);
        assert_eq!(row("/srv/x.sock"), None);
    }
}
