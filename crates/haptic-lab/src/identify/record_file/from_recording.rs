//! A recording of hapticd as a record to identify from.

use super::{Loaded, MovingMass, RecordFileError, Source};
use crate::identify::options::Record;
use haptic_core::scene::Coupling;
use haptic_ipc::{RigState, Sample};
use haptic_recording::{Mark, Recording, RecordingError};

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
    let mut record = record(stretch, is_block);
    if is_block && let Some(coupling) = coupling(recording, stretch[0].revision) {
        add_bend(&mut record, coupling);
    }
    let velocities = record.velocity_mps.iter_mut().flatten();
    for length in record.position_m.iter_mut().chain(velocities) {
        *length *= source.table.position_gain.unwrap_or(1.0);
    }
    for force in &mut record.force_n {
        *force *= source.table.force_gain.unwrap_or(1.0);
    }
    let what = if is_block {
        "the block: block_position_m, driven by coupling_force_N; its offset is 0, since the force is computed"
    } else {
        "the device: device_position_m, driven by command_force_N"
    };
    let mut notes = vec![what.to_owned()];
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
        offset_n: is_block.then_some(0.0),
        has_one_clock: true,
        notes,
    })
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

/// The motion and the force of the block or of the device; rows whose time does not grow are left out.
fn record(rows: &[&Sample], is_block: bool) -> Record {
    let (mut record, mut velocities) = (Record::default(), Vec::with_capacity(rows.len()));
    for row in rows {
        if record.t_s.last().is_some_and(|last| row.t_s <= *last) {
            continue;
        }
        let (position, velocity, force) = if is_block {
            (row.block_position_m, row.block_velocity_mps, row.coupling_force_n)
        } else {
            (row.device_position_m, row.device_velocity_mps, row.command_force_n)
        };
        record.t_s.push(row.t_s);
        record.position_m.push(position);
        velocities.push(velocity);
        record.force_n.push(force);
    }
    record.velocity_mps = Some(velocities);
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
