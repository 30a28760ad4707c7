use super::columns::columns;
use super::*;
use haptic_core::Scene;
use haptic_ipc::{Event, RigState, Sample, SampleY, SamplesEvent, StateEvent};
use std::path::Path;

mod copies;
mod csv;
mod every_format;
mod mcap;
mod parquet;
mod plane;
mod random;
mod recorder;

fn scene() -> Scene {
    Scene::paper()
}

pub(crate) fn metadata() -> Metadata {
    Metadata {
        server: "hapticd 0.1.0".into(),
        device: "fake rig, \"of glass\"".into(),
        axes: 1,
        loop_rate_hz: 1000.0,
        rate_hz: 1000.0,
        recorded_by: Some("haptic-ctl 0.1.0, \"ada\"".into()),
        started_unix_s: 1.763_748_187_123e9,
        revision: 7,
        scene: scene(),
        servo: None,
        notes: None,
        configuration: None,
    }
}

pub(crate) fn sample(tick: u64) -> Sample {
    Sample {
        tick,
        t_s: 1e-3 * f64::from(u32::try_from(tick).expect("small")),
        state: RigState::Engaged,
        contact: -1,
        device_position_m: 0.1,
        device_velocity_mps: -0.2,
        block_position_m: 1.0 / 3.0,
        block_velocity_mps: 0.0,
        coupling_force_n: 5.5,
        command_force_n: -5.5,
        revision: 7,
        wake_latency_ns: 100,
        tick_ns: 200,
        device_round_trip_ns: 0,
        ..Sample::default()
    }
}

pub(crate) fn state(tick: u64, state: RigState, revision: u64) -> Event {
    Event::State(StateEvent {
        state,
        fault: None,
        tick,
        revision,
        scene: "another".into(),
        law: "karnopp".into(),
        params: haptic_ipc::params_of(&scene()),
        undo_depth: 0,
        redo_depth: 0,
        arrival: None,
    })
}

pub(crate) fn samples(ticks: std::ops::Range<u64>, dropped: u64) -> Event {
    Event::Samples(SamplesEvent {
        seq: 0,
        dropped,
        rows: ticks.map(sample).collect(),
        ..SamplesEvent::default()
    })
}

/// A directory where there is no disk to wait for.
fn in_memory() -> tempfile::TempDir {
    let directory = tempfile::tempdir_in("/dev/shm").or_else(|_| tempfile::tempdir());
    directory.expect("a directory")
}

/// Writes a recording; returns its bytes and totals.
fn written(format: Format, metadata: &Metadata, entries: &[Entry]) -> (Vec<u8>, Totals) {
    let directory = in_memory();
    let path = directory.path().join("r").with_extension(format.ending());
    let mut writer = Writer::create(&path, metadata, false).expect("begun");
    for entry in entries {
        writer.entry(entry).expect("written");
    }
    let totals = writer.finish().expect("written");
    (std::fs::read(&path).expect("it is there"), totals)
}

fn entries(rows: &[Sample]) -> Vec<Entry> {
    rows.iter().map(|row| Entry::Row(*row, None)).collect()
}

/// Every bit of a row.
fn bits(row: &Sample, y: Option<&SampleY>) -> Vec<u64> {
    let axes = if y.is_some() { 2 } else { 1 };
    columns(axes).iter().map(|column| column.bits(row, y)).collect()
}

pub(crate) fn read_bytes(bytes: &[u8]) -> Result<Recording, RecordingError> {
    Reader::from_bytes(bytes.to_vec())?.into_recording()
}
