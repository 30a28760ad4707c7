//! A recording holds all that its forces were computed from: a servo that is built from its metadata and
//! stepped through its rows gives every one of them again, to the last bit.

use haptic_core::Renderer;
use haptic_core::servo::{CompiledScene, InputWord, Inputs, Servo, Settings};
use haptic_ipc::{RigState, Sample, SceneArrival, ServoSetup};
use haptic_lab::recording::{self, Ending, Mark, Metadata, Recording};
use rustix::process::{Pid, Signal, kill_process};
use std::collections::BTreeMap;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::Instant;
use system_tests::{Daemon, PATIENCE, binary};

/// What a tick has computed, to the last bit.
type Computed = ([u64; 6], RigState, i8);

fn computed(row: &Sample) -> Computed {
    let numbers = [
        row.command_force_n,
        row.coupling_force_n,
        row.device_position_m,
        row.device_velocity_mps,
        row.block_position_m,
        row.block_velocity_mps,
    ];
    (numbers.map(f64::to_bits), row.state, row.contact)
}

/// The scenes that came in, by revision.
fn arrivals(recording: &Recording) -> BTreeMap<u64, &SceneArrival> {
    let arrival = |mark| match mark {
        &Mark::Scene {
            revision,
            arrival: Some(ref arrival),
            ..
        } => Some((revision, &**arrival)),
        _ => None,
    };
    recording.marks.iter().filter_map(|(_, mark)| arrival(mark)).collect()
}

/// Computes every row anew with such settings.
fn replay(recording: &Recording, settings: Settings) -> Vec<Computed> {
    let Metadata {
        servo:
            Some(ServoSetup {
                scheme,
                device_resolution_m,
                device_force_limit_n,
                ..
            }),
        ref scene,
        revision,
        ..
    } = recording.metadata
    else {
        panic!("the metadata say nothing of the servo: {:?}", recording.metadata);
    };
    let arrivals = arrivals(recording);
    let renderer = Renderer::new(scene, scheme, settings.period_s).expect("it was rendered");
    let mut servo = Servo::new(settings, Box::new(CompiledScene::at_once(renderer, revision)));
    let arrived = |revision: u64| {
        let SceneArrival { scene, ramp } = arrivals[&revision];
        let (from, ramp_s) = ramp.as_ref().map_or((scene, 0.0), |ramp| (&ramp.from, ramp.over_s));
        CompiledScene::ramped(from, scene, revision, scheme, settings.period_s, ramp_s).expect("it was rendered")
    };
    let step = |row: &Sample| {
        let word = InputWord {
            flags: row.input_flags,
            detail: row.error_detail,
        };
        let inputs = Inputs {
            elapsed_ns: row.elapsed_ns,
            sample: word.sample(row.device_sequence, row.device_time_ns, row.sample_position_m),
            device_resolution_m,
            device_force_limit_n: device_force_limit_n.unwrap_or(f64::INFINITY),
            events: word.events(),
            command: word.command(),
        };
        let outputs = servo.step(&inputs, word.new_scene().then(|| Box::new(arrived(row.revision))));
        while servo.take_retired().is_some() {}
        if word.write_failed() {
            servo.disconnect();
        }
        computed(&Sample {
            state: servo.state(),
            contact: outputs.contact,
            device_position_m: outputs.device_position_m,
            device_velocity_mps: outputs.device_velocity_mps,
            block_position_m: outputs.block_position_m,
            block_velocity_mps: outputs.block_velocity_mps,
            coupling_force_n: outputs.coupling_force_n,
            command_force_n: outputs.force_n,
            ..*row
        })
    };
    recording.rows.iter().map(step).collect()
}

/// Rows on the disk.
fn rows(file: &Path) -> usize {
    recording::read(file).map_or(0, |found| found.rows.len())
}

/// Waits until more rows are on the disk.
fn wait_for_rows(file: &Path, more: usize) {
    let (began, so_far) = (Instant::now(), rows(file));
    while rows(file) < so_far + more {
        assert!(began.elapsed() < PATIENCE, "waited in vain for {more} rows");
        std::thread::yield_now();
    }
}

/// Some thousand ticks with force, of which nothing has its usual value: two ramps, of which the second
/// interrupts the first, another law, a stop, and force again.
fn session(file: &Path) -> Recording {
    let daemon = Daemon::start(&[
        "--ramp-ms=70",
        "--slew-limit-n-per-s=900",
        "--force-limit-n=6",
        "--passivity-control-n=1.5",
        "--rig-friction-n=0.05",
        "--rig-damping-ns-per-m=0.1",
        "--velocity=low-pass",
        "--scheme=literal:2",
        "--hand=arm",
        "--hand-frequency-hz=2",
    ]);
    let recorder = Command::new(binary("haptic-ctl"))
        .arg("record")
        .arg(file)
        .arg("--socket")
        .arg(daemon.socket())
        .stdout(Stdio::null())
        .spawn()
        .expect("haptic-ctl starts");
    wait_for_rows(file, 300);
    daemon.ctl_ok(&["engage", "--wait"]);
    wait_for_rows(file, 200);
    daemon.ctl_ok(&["set", "Fs=8", "Fd=5", "K=9000", "--ramp=400ms"]);
    daemon.ctl_ok(&["set", "M=1.5", "Fs+=6", "--ramp=300ms"]);
    wait_for_rows(file, 600);
    daemon.ctl_ok(&["scene", "load", "viscous-drag", "--ramp=200ms"]);
    wait_for_rows(file, 400);
    daemon.ctl_ok(&["undo"]);
    wait_for_rows(file, 200);
    daemon.ctl_ok(&["stop"]);
    wait_for_rows(file, 100);
    daemon.ctl_ok(&["reset"]);
    daemon.ctl_ok(&["engage", "--wait"]);
    wait_for_rows(file, 300);
    daemon.ctl_ok(&["release", "--wait"]);
    wait_for_rows(file, 100);
    kill_process(Pid::from_child(&recorder), Signal::INT).expect("it runs");
    let ended = recorder.wait_with_output().expect("it ends");
    assert!(ended.status.success());
    recording::read(file).expect("a recording")
}

#[test]
fn a_recording_gives_its_forces_again_to_the_last_bit() {
    let directory = tempfile::tempdir().expect("a directory");
    let lost = |recording: &Recording| {
        let lost = |(_, mark): &(usize, Mark)| matches!(mark, Mark::Lost { .. });
        recording.marks.iter().any(lost)
    };
    // On a busy machine rows are lost, which the recording says.
    let recording = (0..5)
        .map(|attempt| session(&directory.path().join(format!("{attempt}.csv"))))
        .find(|recording| !lost(recording))
        .expect("a recording with every row");
    assert_eq!(recording.ending, Ending::Complete);
    // What came before its first row it does not hold. Without force only the estimator remembers that,
    // and for a few ticks.
    let first_live = recording.rows.iter().position(|row| row.state.is_live());
    let (before, after) = recording.rows.split_at(first_live.expect("force flowed"));
    assert!(before.len() > 200, "{} rows before", before.len());
    let live = after.iter().filter(|row| row.command_force_n != 0.0).count();
    assert!(live > 1500, "force flowed in {live} of {} ticks", after.len());
    let ramps = arrivals(&recording)
        .values()
        .filter(|arrival| arrival.ramp.is_some())
        .count();
    assert_eq!((ramps, arrivals(&recording).len()), (3, 4));
    assert!(after.iter().any(|row| row.state == RigState::Stopped));
    let setup = recording.metadata.servo.as_ref().expect("the setup of the servo");
    let settings = setup.settings;
    let again = replay(&recording, settings);
    for (row, again) in after.iter().zip(&again[before.len()..]) {
        assert_eq!(computed(row), *again, "{row:?}");
    }
    // Each of them is needed.
    let mut changed = [settings; 6];
    changed[0].ramp_s *= 1.01;
    changed[1].limits.slew_n_per_s *= 0.9;
    changed[2].limits.force_n *= 0.99;
    changed[3].velocity = haptic_core::velocity::Method::AlphaBetaGamma;
    changed[4].losses.friction = 1.0;
    changed[5].passivity_control_n = 0.0;
    for changed in changed {
        let otherwise = replay(&recording, changed);
        assert!(
            otherwise[before.len()..] != again[before.len()..],
            "it makes no difference: {changed:?}"
        );
    }
    println!("{} ticks, {live} of them with force, are the same", after.len());
}
