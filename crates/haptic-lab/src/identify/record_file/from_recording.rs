//! A recording of hapticd as a record to identify from.

use super::{Loaded, MovingMass, RecordFileError, Source};
use crate::identify::options::{Clocks, Record};
use haptic_core::scene::Coupling;
use haptic_ipc::{RigState, Sample};
use haptic_recording::{Mark, Recording, RecordingError};
use std::time::Duration;

/// Reads a file.
pub(super) fn read(source: &Source) -> Result<Loaded, RecordFileError> {
    let path = source.path.clone();
    let recording = haptic_recording::read(&source.path).map_err(|error| match error {
        RecordingError::OtherProgram { .. } => RecordFileError::Unusable(format!(
            "{}: hapticd did not write this MCAP file; tables of other programs are read from CSV and Parquet",
            path.display()
        )),
        source => RecordFileError::Recording { path, source },
    })?;
    take(&recording, source)
}

/// Takes the longest stretch under one scene.
pub(super) fn take(recording: &Recording, source: &Source) -> Result<Loaded, RecordFileError> {
    if recording.metadata.axes != 1 {
        return Err(RecordFileError::Recording {
            path: source.path.clone(),
            source: RecordingError::TwoAxes,
        });
    }
    let (rows, is_block) = rows(recording, source.moving);
    let stretch = rows
        .chunk_by(|a, b| !is_block || a.revision == b.revision)
        .max_by_key(|stretch| stretch.len())
        .ok_or_else(|| {
            let reason = if is_block {
                "the rig was never engaged, so that no block was rendered: --moving device reads the rig's own motion"
            } else {
                "the recording has no rows"
            };
            RecordFileError::Unusable(format!("{}: {reason}", source.path.display()))
        })?;
    let mut record = if is_block {
        let mut record = of_block(stretch);
        if let Some(coupling) = coupling(recording, stretch[0].revision) {
            add_bend(&mut record, coupling);
        }
        record
    } else {
        let servo = recording.metadata.servo.as_ref();
        of_device(
            stretch.iter().copied(),
            servo.map_or(0.0, |servo| servo.device_resolution_m),
        )
    };
    let position_gain = source.table.position_gain.unwrap_or(1.0);
    record.resolution_m = record.resolution_m.map(|step_m| step_m * position_gain.abs());
    let velocities = record.velocity_mps.iter_mut().flatten();
    for length in record.position_m.iter_mut().chain(velocities) {
        *length *= position_gain;
    }
    for force in &mut record.force_n {
        *force *= source.table.force_gain.unwrap_or(1.0);
    }
    let what = if is_block {
        "the block: block_position_m, driven by coupling_force_N"
    } else {
        "the device: sample_position_m, driven by command_force_N"
    };
    let mut notes = vec![format!("{what}; its offset is 0, since the force is computed")];
    if stretch.len() < rows.len() {
        notes.push(format!(
            "the scene changed meanwhile: {} of {} rows are read, those of revision {}",
            stretch.len(),
            rows.len(),
            stretch[0].revision
        ));
    }
    Ok(Loaded {
        record,
        offset_n: Some(0.0),
        clocks: Some(if is_block {
            Clocks::One
        } else {
            Clocks::Commanded(longest_delay_s(recording, stretch))
        }),
        notes,
    })
}

/// Without a setting of the daemon, the longest time for which a sample may be old, s: its default.
const DEFAULT_STALE_S: f64 = 0.02;

/// From a command to its force, s, at most; none of a rig in the daemon. A device that took longer would be a fault.
fn longest_delay_s(recording: &Recording, rows: &[&Sample]) -> f64 {
    if rows.iter().all(|row| row.device_round_trip_ns == 0) {
        return 0.0;
    }
    let stale_s = recording.metadata.servo.as_ref().map_or(DEFAULT_STALE_S, |servo| {
        Duration::from_nanos(servo.settings.stale_ns).as_secs_f64()
    });
    stale_s + 1.0 / recording.metadata.loop_rate_hz
}

/// The rows of what moves, and whether that is the block.
fn rows(recording: &Recording, moving: MovingMass) -> (Vec<&Sample>, bool) {
    let of = |is: fn(&Sample) -> bool| -> Vec<&Sample> { recording.rows.iter().filter(|row| is(row)).collect() };
    let engaged = of(|row| row.state == RigState::Engaged);
    // What the rig's motor did by itself, where it was moved to be identified.
    let excited = of(|row| row.input_word().is_motion());
    let is_block = match moving {
        MovingMass::Block => true,
        MovingMass::Device => false,
        MovingMass::Auto => !recording.metadata.scene.is_on_device() && !engaged.is_empty() && excited.is_empty(),
    };
    let rows = match (is_block, excited.is_empty()) {
        (true, _) => engaged,
        (false, false) => excited,
        (false, true) => recording.rows.iter().collect(),
    };
    (rows, is_block)
}

/// The motion of the block and the force on it; rows whose time does not grow are left out.
fn of_block(rows: &[&Sample]) -> Record {
    let (mut record, mut velocities) = (Record::default(), Vec::with_capacity(rows.len()));
    for row in rows {
        if record.t_s.last().is_some_and(|last| row.t_s <= *last) {
            continue;
        }
        record.t_s.push(row.t_s);
        record.position_m.push(row.block_position_m);
        velocities.push(row.block_velocity_mps);
        record.force_n.push(row.coupling_force_n);
    }
    record.velocity_mps = Some(velocities);
    record
}

/// A device's clock that differs from the daemon's by more in one step has begun anew, s.
const ANEW_S: f64 = 0.1;

/// The motion of the device, in encoder steps of `resolution_m` (m; 0: unknown), and its motor's force: positions at
/// the times of the device's clock, from the daemon's at the first one, each with the mean of the forces before and
/// after it. Repeated samples count once; samples that the servo held back are left out. Where the device's clock begins
/// anew, the daemon's gives the time that has passed.
#[must_use]
pub fn of_device<'a>(rows: impl IntoIterator<Item = &'a Sample>, resolution_m: f64) -> Record {
    let mut record = Record {
        resolution_m: (resolution_m > 0.0).then_some(resolution_m),
        ..Record::default()
    };
    #[expect(clippy::cast_precision_loss, reason = "nanoseconds of a run")]
    let device_s = |row: &Sample| row.device_time_ns as f64 * 1e-9;
    let (mut before, mut last): (Option<&Sample>, Option<&Sample>) = (None, None);
    let mut ahead_s = 0.0;
    for row in rows {
        let sample = row
            .input_word()
            .sample(row.device_sequence, row.device_time_ns, row.sample_position_m);
        // The force of a tick acts until the next one.
        let before_n = before
            .filter(|before| before.tick + 1 == row.tick)
            .map_or(row.command_force_n, |before| before.command_force_n);
        before = Some(row);
        let is_old = last.is_some_and(|last| last.device_sequence == row.device_sequence);
        if is_old || sample.is_err() || row.sample_position_m != row.device_position_m {
            continue;
        }
        let (step_s, host_step_s) = match last {
            Some(last) => (device_s(row) - device_s(last), row.t_s - last.t_s),
            None => (f64::INFINITY, 0.0),
        };
        if (step_s - host_step_s).abs() > ANEW_S {
            ahead_s = record.t_s.last().map_or(row.t_s, |last_s| last_s + host_step_s) - device_s(row);
        }
        let t_s = device_s(row) + ahead_s;
        if record.t_s.last().is_some_and(|last_s| t_s <= *last_s) {
            continue;
        }
        record.t_s.push(t_s);
        record.position_m.push(row.sample_position_m);
        record.force_n.push(0.5 * (before_n + row.command_force_n));
        last = Some(row);
    }
    record
}

/// The coupling of a scene, if the recording holds it.
fn coupling(recording: &Recording, revision: u64) -> Option<Coupling> {
    let arrived = recording.marks.iter().find_map(|(_, mark)| match mark {
        Mark::Scene {
            revision: of,
            arrival: Some(arrival),
            ..
        } if *of == revision => Some(&arrival.scene),
        _ => None,
    });
    let first = (recording.metadata.revision == revision).then_some(&recording.metadata.scene);
    arrived.or(first)?.coupling
}

/// Adds to each force by what its mean around a sample differs from it. The renderer takes what the hand gives, `K p +
/// B v`, as linear between two samples, and the block's motion is smooth: a twelfth of the second difference of `K p +
/// B v`, which is `F + K x + B w`. Left out it would take `K T^2/12` from the mass, and at 30 Hz give it half a percent.
fn add_bend(record: &mut Record, Coupling { stiffness, damping, .. }: Coupling) {
    let velocity = record.velocity_mps.as_deref().unwrap_or_default();
    let block = record.position_m.iter().zip(velocity);
    let from_hand_n: Vec<f64> = record
        .force_n
        .iter()
        .zip(block)
        .map(|(force, (x, w))| force + stiffness * x + damping * w)
        .collect();
    for (force, load) in record.force_n.iter_mut().skip(1).zip(from_hand_n.windows(3)) {
        *force += (load[0] - 2.0 * load[1] + load[2]) / 12.0;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::study::{Experiment, Truth};
    use crate::identify::{Clocks, ModelKind, Options, identify};
    use crate::simulate::{Start, simulate};
    use haptic_core::friction::{Friction, Karnopp};
    use haptic_core::scene::Block;
    use haptic_core::{Directional, Scene, Scheme};

    #[test]
    fn a_record_has_each_sample_once_with_the_force_around_it() {
        let row = |tick: u64, sequence: u32, device_ms: u64, force: f64| Sample {
            tick,
            t_s: tick as f64 * 1e-3,
            device_position_m: f64::from(sequence) * 1e-3,
            device_sequence: sequence,
            device_time_ns: device_ms * 1_000_000,
            sample_position_m: f64::from(sequence) * 1e-3,
            command_force_n: force,
            ..Sample::default()
        };
        let held = Sample {
            device_position_m: 0.003,
            ..row(11, 4, 312, 3.0)
        };
        let rows = [
            row(7, 1, 309, 0.0),
            row(8, 2, 310, 1.0),
            row(9, 2, 310, 2.0),
            row(10, 3, 311, 3.0),
            held,
            // After ticks without rows, by a clock that began anew.
            row(20, 4, 1, 4.0),
        ];
        let record = of_device(&rows, 1e-5);
        let t_ms: Vec<f64> = record.t_s.iter().map(|t_s| (1e3 * t_s).round()).collect();
        assert_eq!(t_ms, [7.0, 8.0, 9.0, 19.0]);
        assert_eq!(record.position_m, [0.001, 0.002, 0.003, 0.004]);
        assert_eq!(record.force_n, [0.0, 0.5, 2.5, 4.0]);
        assert_eq!(record.resolution_m, Some(1e-5));
    }

    const TREMOR_PER_S: f64 = 30.0 * std::f64::consts::TAU;

    /// What the servo records of a block that a hand moves by its coupling; the hand trembles by so much, m, at 30 Hz.
    fn rendered(scene: &Scene, tremor_m: f64) -> Record {
        let truth = Truth {
            mass_kg: 0.5,
            friction: scene.friction,
            offset_n: 0.0,
        };
        let mut motion = Experiment::thorough(truth).hand();
        for sample in &mut motion {
            let (sin, cos) = (TREMOR_PER_S * sample.t_s).sin_cos();
            sample.position_m += tremor_m * sin;
            sample.velocity_mps += tremor_m * TREMOR_PER_S * cos;
        }
        let run = simulate(scene, Scheme::Exact, &motion, Start::default()).expect("a valid scene");
        Record {
            t_s: motion.iter().map(|sample| sample.t_s).collect(),
            position_m: run.rows.iter().map(|row| row.block_position_m).collect(),
            velocity_mps: Some(run.rows.iter().map(|row| row.block_velocity_mps).collect()),
            force_n: run.rows.iter().map(|row| row.coupling_force_n).collect(),
            ..Record::default()
        }
    }

    #[test]
    fn a_rendered_block_has_its_own_mass_and_friction() {
        for (viscous, tremor_m) in [(5.0, 0.0), (5.0, 300e-6), (0.0, 300e-6)] {
            let scene = Scene {
                block: Some(Block { mass: 0.5 }),
                friction: Friction::Karnopp(Karnopp {
                    viscous: Directional::both(viscous),
                    ..Karnopp::new(4.0, 3.5)
                }),
                ..Scene::paper()
            };
            let mut record = rendered(&scene, tremor_m);
            add_bend(&mut record, scene.coupling.expect("a coupling"));
            let options = Options {
                offset_n: Some(0.0),
                clocks: Clocks::One,
                ..Options::new(ModelKind::Karnopp)
            };
            let found = identify(&record, &options).expect("a record");
            let held = |name: &str, value: f64, truth: f64, off: f64| {
                let [low, high] = found.intervals[name];
                println!("{tremor_m} m: {name} = {value} in {low} to {high}");
                assert!(
                    (value - truth).abs() < off,
                    "{tremor_m} m: {name} = {value} for {truth}"
                );
                assert!(
                    (low..=high).contains(&truth),
                    "{tremor_m} m, {name}: {truth} in {low} to {high}"
                );
            };
            held("mass_kg", found.mass_kg.expect("a mass"), 0.5, 0.0005);
            let sides = |name: &str, value: Option<Directional>, truth: f64, off: f64| {
                let value = value.expect("it is found");
                held(&format!("{name}.positive"), value.positive, truth, off);
                held(&format!("{name}.negative"), value.negative, truth, off);
            };
            sides("dynamic_force_N", found.dynamic_force_n, 3.5, 0.0035);
            sides("viscous_Ns_per_m", found.viscous_ns_per_m, viscous, 0.01);
            // A hand that trembles has no slow load.
            if tremor_m == 0.0 {
                sides("static_force_N", found.static_force_n, 4.0, 0.08);
            }
        }
    }
}
