use super::*;
use crate::recording::{self, Mark};
use haptic_core::limiter::Limits;
use haptic_core::passivity::RigLosses;
use haptic_core::sample::{DeviceError, ErrorCode, Measurement};
use haptic_core::servo::{Command, CompiledScene, Event, Events, InputWord, Inputs, Servo, Settings};
use haptic_core::velocity::Method;
use haptic_core::{Renderer, Scene, Scheme};
use haptic_ipc::{RigState, Sample, SceneArrival, SceneRamp, ServoSetup};
use proptest::prelude::*;
use std::time::{Duration, Instant};

const PERIOD_NS: u64 = 1_000_000;

fn setup() -> ServoSetup {
    ServoSetup {
        settings: Settings {
            period_s: 1e-3,
            ramp_s: 0.05,
            limits: Limits {
                force_n: 12.0,
                slew_n_per_s: 5000.0,
                speed_mps: 3.0,
                acceleration_mps2: 2000.0,
            },
            losses: RigLosses {
                damping: 0.1,
                friction: 0.05,
            },
            passivity_control_n: 1.0,
            compensation: None,
            velocity: Method::AlphaBetaGamma,
            stale_ns: 20_000_000,
            stop_button: None,
            enable_button: None,
        },
        scheme: Scheme::Exact,
        device_resolution_m: 1e-5,
        device_force_limit_n: Some(10.0),
    }
}

fn metadata() -> Metadata {
    Metadata {
        server: "hapticd 0.0.9".into(),
        device: "fake rig".into(),
        loop_rate_hz: 1000.0,
        rate_hz: 1000.0,
        started_unix_s: 0.0,
        revision: 1,
        scene: Scene::paper(),
        servo: Some(setup()),
        notes: None,
        configuration: None,
    }
}

/// What happens in a tick of a session, beside the motion.
#[derive(Clone, Debug, Default)]
struct Happening {
    events: Events,
    command: Option<Command>,
    error: Option<DeviceError>,
    is_silent: bool,
    write_failed: bool,
    scene: Option<(Scene, f64)>,
}

/// A rig as the daemon runs it, and what a recording of it holds.
struct Session {
    servo: Servo,
    scene: Scene,
    revision: u64,
    tick: u64,
    sequence: u32,
    entries: Vec<Entry>,
}

impl Session {
    fn new() -> Self {
        let ServoSetup { settings, scheme, .. } = setup();
        let renderer = Renderer::new(&Scene::paper(), scheme, settings.period_s).expect("it is rendered");
        Self {
            servo: Servo::new(settings, Box::new(CompiledScene::at_once(renderer, 1))),
            scene: Scene::paper(),
            revision: 1,
            tick: 0,
            sequence: 0,
            entries: Vec::new(),
        }
    }

    fn run(&mut self, ticks: u64) -> &mut Self {
        for _ in 0..ticks {
            self.tick(Happening::default());
        }
        self
    }

    fn command(&mut self, command: Command) -> &mut Self {
        self.tick(Happening {
            command: Some(command),
            ..Happening::default()
        })
    }

    fn tick(&mut self, happening: Happening) -> &mut Self {
        let ServoSetup {
            settings,
            scheme,
            device_resolution_m,
            device_force_limit_n,
        } = setup();
        self.tick += 1;
        if !happening.is_silent {
            self.sequence += 1;
        }
        // The hand turns at 2 Hz, and our clock is not exact.
        let t_s = f64::from(self.sequence) * 1e-3;
        let position_m = (0.03 * (12.6 * t_s).sin() / 1e-5).round() * 1e-5;
        let sample = Measurement::new(self.sequence, u64::from(self.sequence) * PERIOD_NS, position_m);
        let inputs = Inputs {
            elapsed_ns: PERIOD_NS + self.tick % 7 * 1000,
            sample: happening.error.map_or(Ok(sample), Err),
            device_resolution_m,
            device_force_limit_n: device_force_limit_n.expect("it names one"),
            events: happening.events,
            command: happening.command,
        };
        let arriving = happening.scene.map(|(scene, ramp_s)| {
            self.revision += 1;
            let from = std::mem::replace(&mut self.scene, scene.clone());
            let compiled = CompiledScene::ramped(&from, &scene, self.revision, scheme, settings.period_s, ramp_s);
            let ramp = (ramp_s > 0.0).then_some(SceneRamp { from, over_s: ramp_s });
            self.entries.push(Entry::Mark(Mark::Scene {
                tick: self.tick,
                revision: self.revision,
                name: scene.name.clone(),
                law: scene.friction.law().to_owned(),
                params: haptic_ipc::params_of(&scene),
                arrival: Some(Box::new(SceneArrival { scene, ramp })),
            }));
            Box::new(compiled.expect("it is rendered"))
        });
        let mut word = InputWord::new(&inputs, arriving.is_some());
        let outputs = self.servo.step(&inputs, arriving);
        while self.servo.take_retired().is_some() {}
        if happening.write_failed {
            self.servo.disconnect();
            word = word.with_write_failed();
        }
        let sample = inputs.sample.unwrap_or(Measurement::new(0, 0, 0.0));
        self.entries.push(Entry::Row(Sample {
            tick: self.tick,
            t_s: self.tick as f64 * 1e-3,
            state: self.servo.state(),
            contact: outputs.contact,
            device_position_m: outputs.device_position_m,
            device_velocity_mps: outputs.device_velocity_mps,
            block_position_m: outputs.block_position_m,
            block_velocity_mps: outputs.block_velocity_mps,
            coupling_force_n: outputs.coupling_force_n,
            command_force_n: outputs.force_n,
            revision: self.servo.scene().revision,
            elapsed_ns: inputs.elapsed_ns,
            device_sequence: sample.sequence,
            device_time_ns: sample.time_ns,
            sample_position_m: sample.position_m,
            input_flags: word.flags,
            error_detail: word.detail,
            ..Sample::default()
        }));
        self
    }

    /// Leaves the first entries out, as a recording does that began later.
    fn without_first(&self, rows: usize) -> Vec<Entry> {
        self.entries[rows..].to_vec()
    }
}

fn compared(entries: &[Entry]) -> Report {
    replay(&metadata(), entries.iter().cloned().map(Ok)).expect("it is replayed")
}

fn reasons(report: &Report) -> Vec<NotCompared> {
    report.uncompared.iter().map(|one| one.reason).collect()
}

/// A scene of another law.
fn drag() -> Scene {
    let text = r#"{"name":"drag","friction":{"law":"viscous","viscous":20.0}}"#;
    serde_json::from_str(text).expect("a scene")
}

/// Everything that can happen to a rig.
fn eventful() -> Session {
    let mut session = Session::new();
    let happening = Happening::default;
    let stickier = Scene::paper()
        .with(&[("Fs".parse().expect("a key"), 8.0), ("Fd".parse().expect("a key"), 5.0)])
        .expect("a scene");
    session.run(300).command(Command::Engage).run(200);
    session
        .tick(Happening {
            scene: Some((stickier, 0.2)),
            ..happening()
        })
        .run(100);
    session
        .tick(Happening {
            scene: Some((Scene::paper(), 0.1)),
            ..happening()
        })
        .run(200);
    session
        .tick(Happening {
            scene: Some((drag(), 0.1)),
            ..happening()
        })
        .run(200);
    session
        .tick(Happening {
            events: Event::Stop.into(),
            ..happening()
        })
        .run(150);
    session.command(Command::Reset).command(Command::Engage).run(200);
    let failed = DeviceError::Failed(ErrorCode::Sensor.into());
    session
        .tick(Happening {
            error: Some(failed),
            ..happening()
        })
        .run(20);
    session.command(Command::Reset).command(Command::Engage).run(100);
    session
        .tick(Happening {
            write_failed: true,
            ..happening()
        })
        .run(50);
    session
        .tick(Happening {
            error: Some(DeviceError::Disconnected),
            ..happening()
        })
        .run(50);
    session.tick(Happening {
        scene: Some((Scene::paper(), 0.1)),
        ..happening()
    });
    session.command(Command::Engage).run(200);
    session
        .tick(Happening {
            events: Event::LeaseLapsed.into(),
            ..happening()
        })
        .run(100);
    session
        .command(Command::Engage)
        .run(100)
        .command(Command::Release)
        .run(100);
    session
}

#[test]
fn a_session_with_ramps_stops_faults_and_failed_writes_is_the_same_to_the_last_bit() {
    let session = eventful();
    // Wherever in its rest it began.
    for begun in [0, 1, 50, 100, 150, 180] {
        let entries = session.without_first(begun);
        let report = compared(&entries);
        assert_eq!((report.differing, &report.first_differing), (0, &None), "{begun}");
        assert_eq!(reasons(&report), [NotCompared::Settling]);
        assert!(report.not_compared < 150 && report.with_force > 900, "{report:?}");
        assert!(report.is_exact());
    }
}

#[test]
fn every_bit_of_every_output_is_compared() {
    let session = eventful();
    let at = 450;
    let Entry::Row(row) = session.entries[at] else {
        panic!("a row")
    };
    let mut changed = [row; 8];
    let nudge = |number: &mut f64| *number = f64::from_bits(number.to_bits() ^ 1);
    nudge(&mut changed[0].device_position_m);
    nudge(&mut changed[1].device_velocity_mps);
    nudge(&mut changed[2].block_position_m);
    nudge(&mut changed[3].block_velocity_mps);
    nudge(&mut changed[4].coupling_force_n);
    nudge(&mut changed[5].command_force_n);
    changed[6].contact = -2;
    changed[7].state = RigState::Faulted;
    let mut columns = Vec::new();
    for changed in changed {
        let mut entries = session.entries.clone();
        entries[at] = Entry::Row(changed);
        let report = compared(&entries);
        assert_eq!(report.differing, 1, "{report:?}");
        let first = report.first_differing.expect("one differs");
        assert_eq!((first.tick, first.t_s), (row.tick, row.t_s));
        assert_ne!(first.recorded, first.computed);
        assert!(first.likely.contains("hapticd 0.0.9"), "{}", first.likely);
        columns.push(first.column);
    }
    let all = [
        "device_position_m",
        "device_velocity_mps",
        "block_position_m",
        "block_velocity_mps",
        "coupling_force_N",
        "command_force_N",
        "contact",
        "state",
    ];
    assert_eq!(columns, all);
}

#[test]
fn after_a_gap_nothing_is_compared_until_the_rig_is_without_force_and_that_is_counted() {
    let session = eventful();
    for with_mark in [true, false] {
        let mut entries = session.entries.clone();
        // Ten rows within the first stretch of force: about 410 to 420, with two scenes and a stop to come.
        entries.drain(410..420);
        if with_mark {
            entries.insert(410, Entry::Mark(Mark::Lost { rows: 10 }));
        }
        let report = compared(&entries);
        assert_eq!(report.differing, 0, "{report:?}");
        assert_eq!(reasons(&report), [NotCompared::Settling, NotCompared::RowsLost]);
        let lost = report.uncompared[1];
        let stopped = session.entries.iter().find_map(|entry| match entry {
            Entry::Row(row) if row.state == RigState::Stopped => Some(row.tick),
            _ => None,
        });
        assert_eq!(
            Some(lost.first_tick + lost.ticks),
            stopped,
            "it goes on where the rig stopped: {report:?}"
        );
        // The rest begins with too short a time without force, and is compared from the next one on.
        assert!(report.with_force > 100, "{report:?}");
        assert!(report.is_exact());
    }
}

#[test]
fn a_recording_that_began_with_force_says_so_and_goes_on_once_it_is_gone() {
    let mut session = eventful();
    let whole = compared(&session.without_first(400));
    assert_eq!(
        reasons(&whole)[..2],
        [NotCompared::Settling, NotCompared::BeganWithForce]
    );
    assert!(whole.is_exact(), "{whole:?}");
    session.entries.truncate(500);
    let report = compared(&session.without_first(400));
    assert_eq!((report.compared(), report.differing), (0, 0));
    assert_eq!(reasons(&report), [NotCompared::BeganWithForce]);
    assert!(!report.is_exact(), "nothing was compared");
}

#[test]
fn force_that_comes_before_the_servo_has_settled_is_not_compared() {
    let report = compared(&eventful().without_first(280));
    assert!(reasons(&report).contains(&NotCompared::ForceTooSoon), "{report:?}");
    assert_eq!(report.differing, 0);
}

#[test]
fn the_ticks_of_a_scene_that_is_not_in_the_recording_are_not_compared() {
    let session = eventful();
    let mut entries = session.entries.clone();
    let place = entries
        .iter()
        .position(|entry| matches!(entry, Entry::Mark(Mark::Scene { .. })));
    entries.remove(place.expect("a scene arrived"));
    let report = compared(&entries);
    assert_eq!(reasons(&report), [NotCompared::Settling, NotCompared::UnknownScene]);
    assert!(report.differing == 0 && report.with_force > 300, "{report:?}");
}

#[test]
fn a_silent_device_is_not_compared_where_its_period_was_set_before_the_recording() {
    let mut session = Session::new();
    session.run(350).command(Command::Engage).run(200);
    for _ in 0..6 {
        session.tick(Happening {
            is_silent: true,
            ..Happening::default()
        });
    }
    session
        .run(100)
        .command(Command::Release)
        .run(200)
        .command(Command::Engage)
        .run(100);
    let report = compared(&session.without_first(137));
    assert_eq!(report.differing, 0, "{report:?}");
    assert!(reasons(&report).contains(&NotCompared::DeviceSilent), "{report:?}");
    assert!(report.with_force > 250, "{report:?}");
}

#[test]
fn what_follows_from_no_recording_is_refused() {
    let mut thinned = metadata();
    thinned.rate_hz = 100.0;
    let error = Comparison::new(&thinned).expect_err("thinned").to_string();
    assert!(error.contains("100 of 1000 ticks a second"), "{error}");
    let mut early = metadata();
    early.servo = None;
    let error = Comparison::new(&early).expect_err("without settings").to_string();
    assert!(error.contains("hapticd 0.0.9 did not tell"), "{error}");
}

fn felt(entries: &[Entry], alternative: Alternative) -> (Vec<Felt>, Summary) {
    let mut what_if = WhatIf::new(&metadata(), alternative).expect("it can be rendered");
    let felt = entries
        .iter()
        .filter_map(|entry| what_if.entry(entry).expect("it is rendered"));
    let felt = felt.collect();
    (felt, what_if.summary())
}

#[test]
fn the_same_scene_is_felt_the_same_and_another_otherwise() {
    let session = eventful();
    let (rows, same) = felt(&session.entries, Alternative::default());
    assert_eq!(same.largest_difference, None, "{same:?}");
    assert_eq!(same.recorded, same.what_if);
    assert!(same.recorded.breakaways >= 3 && same.recorded.stops >= 3, "{same:?}");
    assert!(same.recorded.energy_j > 0.0 && same.recorded.stuck_s > 0.02, "{same:?}");
    assert_eq!(rows.len() as u64, same.ticks);
    let (rows, other) = felt(
        &session.entries,
        Alternative {
            scene: Some(drag()),
            ..Alternative::default()
        },
    );
    assert_eq!(other.recorded, same.recorded);
    assert_eq!((other.what_if.stops, other.what_if.ticks), (0, other.recorded.ticks));
    let most = other.largest_difference.expect("they differ");
    let size = |row: &Felt| {
        row.what_if.map_or(0.0, |other| {
            (other.command_force_n - row.recorded.command_force_n).abs()
        })
    };
    let largest = rows.iter().map(size).fold(0.0, f64::max);
    assert_eq!((most.what_if_n - most.recorded_n).abs(), largest);
    // A viscous drag of 20 N s/m on the device: where it is fully let in, the force is the velocity's.
    let steady = rows
        .iter()
        .filter_map(|row| row.what_if.filter(|row| row.state == RigState::Engaged));
    let off = steady
        .map(|row| row.command_force_n + 20.0 * row.device_velocity_mps)
        .filter(|off| off.abs() > 0.5);
    assert!(off.count() < 100);
}

#[test]
fn a_parameter_is_changed_in_every_scene_or_the_scene_that_lacks_it_is_named() {
    let session = eventful();
    let alternative = Alternative {
        changes: vec![("Fs".parse().expect("a key"), 9.0)],
        ..Alternative::default()
    };
    // The fourth scene is viscous.
    let mut what_if = WhatIf::new(&metadata(), alternative.clone()).expect("the first scene has it");
    let error = session.entries.iter().find_map(|entry| what_if.entry(entry).err());
    assert!(error.expect("refused").to_string().starts_with("revision 4: "));
    let (_, stickier) = felt(&session.entries[..700], alternative);
    assert!(stickier.what_if.stuck_s > stickier.recorded.stuck_s, "{stickier:?}");
}

#[test]
fn what_if_also_goes_along_where_force_flowed_from_the_beginning() {
    let session = eventful();
    let (_, whole) = felt(&session.entries, Alternative::default());
    let (rows, begun) = felt(&session.entries[420..], Alternative::default());
    assert!(begun.not_computed < 5, "{begun:?}");
    assert!(begun.recorded.ticks + 200 > whole.recorded.ticks, "{begun:?}");
    // The block began elsewhere, and has come to the same place soon.
    let off = |row: &Felt| {
        row.what_if.map_or(0.0, |other| {
            (other.command_force_n - row.recorded.command_force_n).abs()
        })
    };
    let late = rows[300..500].iter().map(off).fold(0.0, f64::max);
    assert!(late < 0.2, "{late} N");
}

#[test]
fn a_replay_of_what_a_recorder_wrote_needs_no_more_than_the_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("session.csv");
    let mut recorder = recording::create(&path, &metadata(), false).expect("begun");
    let mut session = Session::new();
    session.run(300).command(Command::Engage).run(300);
    let rows = session.entries.iter().map(|entry| match entry {
        Entry::Row(row) => *row,
        Entry::Mark(mark) => panic!("{mark:?}"),
    });
    let samples = haptic_ipc::SamplesEvent {
        seq: 0,
        dropped: 0,
        rows: rows.collect(),
    };
    recorder.event(&haptic_ipc::Event::Samples(samples)).expect("written");
    recorder.finish().expect("written");
    let reader = recording::open(&path).expect("reads");
    let metadata = reader.metadata().clone();
    let report = replay(&metadata, reader).expect("it is replayed");
    assert!(report.is_exact() && report.with_force > 200, "{report:?}");
}

/// Prints how long the steps of an hour take, with a ramp every five seconds.
#[test]
fn the_steps_of_an_hour_take_seconds() {
    let wanted = test_run::extent(60_000, 3_600_000);
    let stickier = Scene::paper()
        .with(&[("Fs".parse().expect("a key"), 8.0)])
        .expect("a scene");
    let mut session = Session::new();
    session.run(200).command(Command::Engage);
    let mut comparison = Comparison::new(&metadata()).expect("it is replayed");
    let mut took = Duration::ZERO;
    let mut scene = Scene::paper();
    while session.tick < wanted {
        scene = if scene == stickier {
            Scene::paper()
        } else {
            stickier.clone()
        };
        session.tick(Happening {
            scene: Some((scene.clone(), 0.1)),
            ..Happening::default()
        });
        session.run(5000);
        let entries = std::mem::take(&mut session.entries);
        let began = Instant::now();
        for entry in &entries {
            comparison.entry(entry).expect("it is rendered");
        }
        took += began.elapsed();
    }
    let report = comparison.report();
    assert!(report.is_exact(), "{report:?}");
    let hour_s = took.as_secs_f64() / report.ticks as f64 * 3.6e6;
    println!(
        "{} ticks in {took:.2?}: an hour at 1 kHz in {hour_s:.1} s",
        report.ticks
    );
}

/// A hand that moves leaves the tracker's last bits to be found, wherever the recording began.
#[test]
fn the_velocity_is_found_to_the_last_bit_under_a_hand_that_moves() {
    let mut session = Session::new();
    session.run(700).command(Command::Engage).run(150);
    let mut longest = 0;
    for begun in 0..550 {
        let report = compared(&session.without_first(begun));
        assert!(report.is_exact() && report.with_force > 100, "{begun}: {report:?}");
        longest = longest.max(report.not_compared);
    }
    println!("compared after {longest} ticks at most");
    assert!(longest < 150);
}

proptest! {
    /// No row, however damaged, panics a replay, and none makes it differ from itself.
    #[test]
    fn no_damage_panics_a_replay(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u64>(), 0..6_usize), 1..6),
    ) {
        let mut session = Session::new();
        session.run(100).command(Command::Engage).run(100).command(Command::Release).run(100);
        for (place, bits, field) in changes {
            let place = place.index(session.entries.len());
            if let Entry::Row(row) = &mut session.entries[place] {
                match field {
                    0 => row.tick = bits,
                    1 => row.sample_position_m = f64::from_bits(bits),
                    2 => row.input_flags = bits as u32,
                    3 => row.elapsed_ns = bits,
                    4 => row.device_time_ns = bits,
                    _ => row.revision = bits,
                }
            }
        }
        compared(&session.entries);
        let (_, summary) = felt(&session.entries, Alternative { scene: Some(drag()), ..Alternative::default() });
        prop_assert!(summary.ticks == 302);
    }
}
