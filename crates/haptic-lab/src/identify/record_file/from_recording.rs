//! A recording of hapticd as a record to identify from.

use super::{Loaded, MovingMass, RecordFileError, Source};
use crate::identify::options::Record;
use haptic_ipc::{RigState, Sample};
use haptic_recording::{Mark, Recording, RecordingError};

/// Reads a file.
pub(super) fn read(source: &Source) -> Result<Loaded, RecordFileError> {
    let path = source.path.clone();
    let recording = haptic_recording::read(&source.path).map_err(|error| match error {
        RecordingError::OtherProgram { .. } => RecordFileError::OtherMcap { path },
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
        .ok_or_else(|| RecordFileError::Empty {
            path: source.path.clone(),
            reason: if is_block {
                "the rig was never engaged, so that no block was rendered: --moving device reads the rig's own motion"
            } else {
                "the recording has no rows"
            }
            .to_owned(),
        })?;
    let mut record = record(stretch, is_block);
    if is_block && let Some(stiffness) = coupling_stiffness(recording, stretch[0].revision) {
        add_bend(&mut record, stiffness);
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

/// Stiffness of the coupling of a scene, N/m, if the recording holds it.
fn coupling_stiffness(recording: &Recording, revision: u64) -> Option<f64> {
    let arrived = recording.marks.iter().find_map(|(_, mark)| match mark {
        Mark::Scene {
            revision: of,
            arrival: Some(arrival),
            ..
        } if *of == revision => Some(&arrival.scene),
        _ => None,
    });
    let first = (recording.metadata.revision == revision).then_some(&recording.metadata.scene);
    arrived.or(first)?.coupling.map(|coupling| coupling.stiffness)
}

/// Adds to each force what the coupling's force bends by between two samples, `K/12` times the second
/// difference of the block's position: its mean is less than that of the samples, and would take
/// `K T^2/12` from the mass.
fn add_bend(record: &mut Record, stiffness: f64) {
    for (force, x) in record.force_n.iter_mut().skip(1).zip(record.position_m.windows(3)) {
        *force += stiffness / 12.0 * (x[0] - 2.0 * x[1] + x[2]);
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

    /// What the servo records of a block that a hand moves by its coupling.
    fn rendered(scene: &Scene) -> Record {
        let truth = Truth {
            mass_kg: 0.5,
            friction: scene.friction,
            offset_n: 0.0,
        };
        let motion = Experiment::thorough(truth).hand();
        let run = simulate(scene, Scheme::Exact, &motion, Start::default()).expect("a valid scene");
        Record {
            t_s: motion.iter().map(|sample| sample.t_s).collect(),
            position_m: run.rows.iter().map(|row| row.block_position_m).collect(),
            force_n: run.rows.iter().map(|row| row.coupling_force_n).collect(),
            ..Record::default()
        }
    }

    #[test]
    fn a_rendered_block_has_its_own_mass_and_friction() {
        let scene = Scene {
            block: Some(Block { mass: 0.5 }),
            friction: Friction::Karnopp(Karnopp {
                viscous: Directional::both(5.0),
                ..Karnopp::new(4.0, 3.5)
            }),
            ..Scene::paper()
        };
        let mut record = rendered(&scene);
        add_bend(&mut record, scene.coupling.expect("a coupling").stiffness);
        let options = Options {
            offset_n: Some(0.0),
            clocks: Clocks::One,
            ..Options::new(ModelKind::Karnopp)
        };
        let found = identify(&record, &options).expect("a record");
        let near = |name: &str, value: f64, truth: f64, share: f64| {
            let [low, high] = found.intervals[name];
            println!("{name} = {value} in {low} to {high}");
            assert!((value - truth).abs() < share * truth, "{name} = {value} for {truth}");
            assert!(
                (low..=high).contains(&truth),
                "{name}: {truth} is not in {low} to {high}"
            );
        };
        near("mass_kg", found.mass_kg.expect("a mass"), 0.5, 0.002);
        let limits = found.static_force_n.expect("static friction");
        near("static_force_N.positive", limits.positive, 4.0, 0.02);
        near("static_force_N.negative", limits.negative, 4.0, 0.02);
    }
}
