//! `recording info`: what a recording holds.

use super::summary::{Disorder, Event, EventKind, Summary, is_upset};
use super::unreadable;
use crate::failure::Failure;
use crate::output::count;
use crate::{output, progress};
use clap::ValueHint;
use haptic_core::passivity::RigLosses;
use haptic_ipc::{RigState, ServoSetup};
use haptic_recording::Ending;
use jiff::tz::TimeZone;
use serde_json::json;
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Recording
    #[arg(value_hint = ValueHint::FilePath)]
    file: PathBuf,
}

pub(super) fn run(arguments: &Arguments, json: bool) -> Result<(), Failure> {
    let bar = progress::busy("reading");
    let summary = Summary::read(&arguments.file).map_err(|error| unreadable(&arguments.file, &error))?;
    bar.finish_and_clear();
    if json {
        return output::json(&as_json(arguments, &summary));
    }
    output::text(&as_text(arguments, &summary))
}

fn as_json(arguments: &Arguments, summary: &Summary) -> serde_json::Value {
    let metadata = &summary.metadata;
    json!({
        "file": arguments.file,
        "format": summary.format.ending(),
        "bytes": summary.bytes,
        "server": metadata.server,
        "device": metadata.device,
        "axes": metadata.axes,
        "recorded_by": metadata.recorded_by,
        "started_unix_s": metadata.started_unix_s,
        "loop_rate_hz": metadata.loop_rate_hz,
        "rate_hz": metadata.rate_hz,
        "scene": metadata.scene.name,
        "law": metadata.scene.friction.law(),
        "revision": metadata.revision,
        "rows": summary.rows,
        "ticks": summary.ticks,
        "length_s": summary.length_s(),
        "lost": summary.lost,
        "gaps": summary.gaps,
        "lost_changes": summary.lost_changes,
        "tick_disorder": summary.disorder,
        "missed": summary.missed,
        "with_force": summary.with_force,
        "peak_force_N": summary.peak_force_n,
        "events": summary.events,
        "notes": metadata.notes,
        "configuration": metadata.configuration,
        "complete": summary.ending == Ending::Complete,
        "ending": summary.ending.to_string(),
    })
}

fn as_text(arguments: &Arguments, summary: &Summary) -> String {
    let metadata = &summary.metadata;
    let scene = &metadata.scene;
    #[expect(clippy::cast_precision_loss, reason = "a size in megabytes")]
    let megabytes = summary.bytes as f64 * 1e-6;
    let mut rows = vec![
        (
            "recording",
            format!("{}: {}, {megabytes:.2} MB", arguments.file.display(), summary.format),
        ),
        ("begun", when(metadata.started_unix_s, &TimeZone::system())),
        (
            "by",
            match &metadata.recorded_by {
                Some(program) => format!("{program}, of {}", metadata.server),
                None => metadata.server.clone(),
            },
        ),
        ("device", metadata.device.clone()),
        (
            "rate",
            if metadata.rate_hz == metadata.loop_rate_hz {
                format!("{} Hz, every tick", output::figure(metadata.rate_hz))
            } else {
                let (rate, ticks) = (output::figure(metadata.rate_hz), output::figure(metadata.loop_rate_hz));
                format!("{rate} Hz, of {ticks} Hz ticks")
            },
        ),
        (
            "scene",
            format!(
                "{} ({}), revision {}",
                scene.name,
                scene.friction.law(),
                metadata.revision
            ),
        ),
        (
            "length",
            format!("{:.3} s, {}", summary.length_s(), count(summary.rows, "row")),
        ),
        (
            "ticks",
            summary
                .ticks
                .map_or_else(|| "none".to_owned(), |[first, last]| format!("{first} to {last}")),
        ),
        ("order", order(summary)),
        ("force", force(summary)),
        ("faults", faults(summary)),
        ("lost", lost(summary)),
        ("missed", count(summary.missed, "period")),
        ("ending", summary.ending.to_string()),
    ];
    if metadata.axes != 1 {
        let after_device = rows.iter().take_while(|(name, _)| *name != "rate").count();
        rows.insert(after_device, ("axes", metadata.axes.to_string()));
    }
    if let Some(notes) = &metadata.notes {
        rows.extend(notes.lines().enumerate().map(|(index, line)| {
            let name = if index == 0 { "notes" } else { "" };
            (name, line.to_owned())
        }));
    }
    let mut text = output::named(rows);
    if !summary.events.is_empty() {
        text.push_str("\n\n");
        text.push_str(&output::table(
            &summary.events.iter().map(event_row).collect::<Vec<_>>(),
        ));
    }
    text
}

/// For how long force flowed, and how large it was.
fn force(summary: &Summary) -> String {
    if summary.with_force == 0 {
        return "none".to_owned();
    }
    #[expect(clippy::cast_precision_loss, reason = "rows of a session")]
    let with_force_s = summary.with_force as f64 / summary.metadata.rate_hz;
    format!("{with_force_s:.1} s, at most {:.2} N", summary.peak_force_n)
}

/// Ticks that do not follow one another, where no mark says why.
fn order(summary: &Summary) -> String {
    let Disorder { jumped, repeated, back } = summary.disorder;
    let parts = [
        (jumped, "missing without a mark"),
        (repeated, "with the tick of the row before"),
        (back, "with an earlier tick"),
    ];
    let reported: Vec<String> = parts
        .iter()
        .filter(|(rows, _)| *rows > 0)
        .map(|(rows, what)| format!("{} {what}", count(*rows, "row")))
        .collect();
    match reported.is_empty() {
        true => "each tick after the one before".to_owned(),
        false => reported.join(", "),
    }
}

/// What is missing.
fn lost(summary: &Summary) -> String {
    let rows = || format!("{} in {}", count(summary.lost, "row"), count(summary.gaps, "gap"));
    let changes = || count(summary.lost_changes, "change");
    match (summary.gaps, summary.lost_changes) {
        (0, 0) if summary.disorder == Disorder::default() => "nothing".to_owned(),
        (0, 0) => "nothing that a mark tells of".to_owned(),
        (_, 0) => rows(),
        (0, _) => changes(),
        (..) => format!("{}; {}", rows(), changes()),
    }
}

/// How often the rig was stopped, faulted and lost.
fn faults(summary: &Summary) -> String {
    let states: Vec<RigState> = summary
        .events
        .iter()
        .filter_map(|event| match &event.what {
            EventKind::State { state, .. } => Some(*state),
            _ => None,
        })
        .collect();
    // The first is that in which the recording began.
    let times = |wanted: RigState| {
        let upsets = states
            .windows(2)
            .filter(|pair| pair[1] == wanted && is_upset(pair[0], pair[1]));
        upsets.count() as u64
    };
    let stops_and_faults = match (times(RigState::Stopped), times(RigState::Faulted)) {
        (0, 0) => "none".to_owned(),
        (stops, faults) => format!("{}, {}", count(stops, "stop"), count(faults, "fault")),
    };
    match times(RigState::Disconnected) {
        0 => stops_and_faults,
        times => format!("{stops_and_faults}, {}", count(times, "disconnection")),
    }
}

/// Time, kind and text of an event.
fn event_row(event: &Event) -> Vec<String> {
    let (kind, text) = match &event.what {
        EventKind::Scene { name, law, revision } => ("scene", format!("{name} ({law}), revision {revision}")),
        EventKind::State { state, fault: None } => ("state", state.to_string()),
        EventKind::State {
            state,
            fault: Some(fault),
        } => ("state", format!("{state}: {fault}")),
        EventKind::Servo { servo } => ("servo", settings(servo)),
        EventKind::Marker { text } => ("marker", text.clone()),
        EventKind::Link { text } => ("link", text.clone()),
    };
    vec![
        format!("{:10.3} s", event.t_s),
        format!("tick {}", event.tick),
        kind.to_owned(),
        text,
    ]
}

/// What of the servo's settings may change.
fn settings(servo: &ServoSetup) -> String {
    let RigLosses { damping, friction } = servo.settings.losses;
    let limit = servo.device_force_limit_n.map_or_else(
        || "no force limit".to_owned(),
        |limit_n| format!("at most {} N", output::figure(limit_n)),
    );
    let force_n = output::figure(servo.settings.limits.force_n);
    let share = servo.settings.compensation.map_or_else(String::new, |compensation| {
        format!(", {} of it compensated", output::figure(compensation.share))
    });
    format!(
        "a force limit of {force_n} N; a device with steps of {} m and {limit}; the rig takes up {} N and {} N s/m{share}",
        output::figure(servo.device_resolution_m),
        output::figure(friction),
        output::figure(damping)
    )
}

/// A time for people, in their time zone.
fn when(unix_s: f64, zone: &TimeZone) -> String {
    output::moment(unix_s, zone).map_or_else(
        || format!("{unix_s} s after 1970"),
        |time| time.strftime("%Y-%m-%d %H:%M:%S %Z").to_string(),
    )
}
