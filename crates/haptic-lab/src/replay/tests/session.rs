//! A rig without a daemon, and what a recording of it holds.

use crate::replay::{Report, SkipReason, replay};
use crate::row::of_step;
use haptic_core::compensation::Compensation;
use haptic_core::limiter::Limits;
use haptic_core::passivity::RigLosses;
use haptic_core::rig_friction::RigFriction;
use haptic_core::sample::{DeviceError, ErrorCode, Measurement};
use haptic_core::servo::{Command, CompiledScene, Event, Events, InputWord, Inputs, Servo, Settings};
use haptic_core::velocity::Method;
use haptic_core::{Directional, Scene, Scheme, Vector};
use haptic_ipc::{RigState, SceneArrival, SceneRamp, ServoSetup, ServoSnapshot};
use haptic_recording::{Entry, Mark, Metadata};
use std::collections::BTreeMap;

const PERIOD_NS: u64 = 1_000_000;

pub(super) fn setup() -> ServoSetup {
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
            compensation: Some(Compensation {
                share: 0.5,
                friction: RigFriction {
                    mass: 0.5,
                    dynamic_force: Directional {
                        positive: 0.8,
                        negative: 0.6,
                    },
                    viscous: Directional::both(0.3),
                    cogging: None,
                    uncertainty: None,
                },
            }),
            velocity: Method::AlphaBetaGamma,
            stale_ns: 20_000_000,
            stop_button: None,
            enable_button: None,
            workspace: None,
        },
        scheme: Scheme::Exact,
        device_resolution_m: 1e-5,
        device_force_limit_n: Some(10.0),
        version: haptic_core::servo::VERSION,
    }
}

pub(super) fn metadata() -> Metadata {
    metadata_of(1, setup(), Scene::paper())
}

/// That of the rig whose rows these are.
pub(super) fn metadata_with(entries: &[Entry]) -> Metadata {
    let is_plane = entries.iter().any(|entry| matches!(entry, Entry::Row(_, Some(_))));
    let axes = if is_plane { 2 } else { 1 };
    Metadata { axes, ..metadata() }
}

fn metadata_of(axes: u8, setup: ServoSetup, scene: Scene) -> Metadata {
    Metadata {
        server: "hapticd 0.0.9".into(),
        device: "fake rig".into(),
        axes,
        loop_rate_hz: 1000.0,
        rate_hz: 1000.0,
        recorded_by: None,
        started_unix_s: 0.0,
        revision: 1,
        scene,
        servo: Some(setup),
        notes: None,
        configuration: None,
    }
}

/// What happens in a tick of a session, beside the motion.
#[derive(Clone, Debug, Default)]
pub(super) struct TickInput<V = f64> {
    pub(super) events: Events,
    pub(super) command: Option<Command>,
    pub(super) error: Option<DeviceError>,
    pub(super) write_failed: bool,
    pub(super) scene: Option<(Scene, f64)>,
    /// The time since the tick before, ns, and the sample, where they are not the usual ones.
    pub(super) measured: Option<(u64, Measurement<V>)>,
}

/// A rig as the daemon runs it, and what a recording of it holds.
pub(super) struct ReplayedSession<V: Vector = f64> {
    setup: ServoSetup,
    first: Scene,
    servo: Servo<V>,
    scene: Scene,
    revision: u64,
    pub(super) tick: u64,
    sequence: u32,
    pub(super) entries: Vec<Entry>,
    /// The servo's state before every 97th tick, and its place among the entries.
    pub(super) snapshots: Vec<(usize, Mark)>,
    arrivals: BTreeMap<u64, SceneArrival>,
}

impl<V: Vector> ReplayedSession<V> {
    pub(super) fn new() -> Self {
        Self::of(setup(), Scene::paper())
    }

    pub(super) fn of(setup: ServoSetup, scene: Scene) -> Self {
        let ServoSetup { settings, scheme, .. } = setup;
        let compiled = CompiledScene::ramped(&scene, &scene, 1, scheme, settings.period_s, 0.0);
        Self {
            setup,
            first: scene.clone(),
            arrivals: BTreeMap::from([(
                1,
                SceneArrival {
                    scene: scene.clone(),
                    ramp: None,
                },
            )]),
            snapshots: Vec::new(),
            servo: Servo::new(settings, Box::new(compiled.expect("it is rendered"))),
            scene,
            revision: 1,
            tick: 0,
            sequence: 0,
            entries: Vec::new(),
        }
    }

    pub(super) fn run(&mut self, ticks: u64) -> &mut Self {
        for _ in 0..ticks {
            self.tick(TickInput::default());
        }
        self
    }

    pub(super) fn command(&mut self, command: Command) -> &mut Self {
        self.with(|input| input.command = Some(command))
    }

    /// A tick in which something happens.
    pub(super) fn with(&mut self, happen: impl FnOnce(&mut TickInput<V>)) -> &mut Self {
        let mut input = TickInput::default();
        happen(&mut input);
        self.tick(input)
    }

    pub(super) fn tick(&mut self, happening: TickInput<V>) -> &mut Self {
        let ServoSetup {
            settings,
            scheme,
            device_resolution_m,
            device_force_limit_n,
            ..
        } = self.setup;
        if self.tick.is_multiple_of(97) {
            let snapshot = self.snapshot();
            self.snapshots.push((self.entries.len(), snapshot));
        }
        self.tick += 1;
        self.sequence += 1;
        // The hand turns at 2 Hz, in the plane on a circle on which it rests twice a turn. Our clock is not exact.
        let turned = 12.6 * f64::from(self.sequence) * 1e-3;
        let rests = if V::AXES > 1 { 0.5 * (2.0 * turned).sin() } else { 0.0 };
        let (sin, cos) = (turned - rests).sin_cos();
        let [x_m, y_m] = [sin, cos].map(|part| (0.03 * part / 1e-5).round() * 1e-5);
        let position_m = V::of_axes(x_m, y_m);
        let usual = Measurement::new(self.sequence, u64::from(self.sequence) * PERIOD_NS, position_m);
        let (elapsed_ns, sample) = happening.measured.unwrap_or((PERIOD_NS + self.tick % 7 * 1000, usual));
        let inputs = Inputs {
            elapsed_ns,
            sample: happening.error.map_or(Ok(sample), Err),
            device_resolution_m,
            device_force_limit_n: device_force_limit_n.unwrap_or(f64::INFINITY),
            events: happening.events,
            command: happening.command,
        };
        let arriving = happening.scene.map(|(scene, ramp_s)| {
            self.revision += 1;
            let from = std::mem::replace(&mut self.scene, scene.clone());
            let compiled = CompiledScene::ramped(&from, &scene, self.revision, scheme, settings.period_s, ramp_s);
            let ramp = (ramp_s > 0.0).then_some(SceneRamp { from, over_s: ramp_s });
            let arrival = SceneArrival { scene, ramp };
            self.arrivals.insert(self.revision, arrival.clone());
            let scene = &arrival.scene;
            self.entries.push(Entry::Mark(Mark::Scene {
                tick: self.tick,
                revision: self.revision,
                name: scene.name.clone(),
                law: scene.friction.law().to_owned(),
                params: haptic_ipc::params_of(scene),
                arrival: Some(Box::new(arrival)),
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
        let t_s = self.tick as f64 * 1e-3;
        let row = of_step(self.tick, t_s, &inputs, word, &self.servo, &outputs);
        self.entries.push(Entry::Row(row.sample, row.y));
        self
    }

    /// The servo's state before the next tick.
    fn snapshot(&mut self) -> Mark {
        let snapshot = self.servo.snapshot().expect("no motion of its own");
        let snapshot = ServoSnapshot::of(&snapshot, |revision| self.arrivals.get(&revision).cloned());
        let snapshot = snapshot.expect("its scenes are known");
        // As a file holds it.
        let text = serde_json::to_string(&snapshot).expect("it is written");
        Mark::Snapshot {
            tick: self.tick + 1,
            snapshot: serde_json::from_str(&text).expect("it is read"),
        }
    }

    /// The entries from one on with the snapshots among them, every so many of them.
    pub(super) fn with_snapshots(&self, first: usize, every: usize) -> Vec<Entry> {
        let mut snapshots = self
            .snapshots
            .iter()
            .filter(|(place, _)| *place >= first)
            .step_by(every)
            .peekable();
        let mut entries = Vec::new();
        for (place, entry) in self.entries.iter().enumerate().skip(first) {
            while let Some((_, mark)) = snapshots.next_if(|(at, _)| *at <= place) {
                entries.push(Entry::Mark(mark.clone()));
            }
            entries.push(entry.clone());
        }
        entries
    }

    /// More is known of the rig from the next tick on.
    pub(super) fn set_rig(&mut self, losses: RigLosses, compensation: Option<Compensation>) -> &mut Self {
        self.servo.set_rig(losses, compensation);
        let mut servo = Box::new(self.setup.clone());
        (servo.settings.losses, servo.settings.compensation) = (losses, compensation);
        let tick = self.tick + 1;
        self.entries.push(Entry::Mark(Mark::Servo { tick, servo }));
        self
    }

    /// State of the rig.
    pub(super) fn state(&self) -> RigState {
        self.servo.state()
    }

    /// A replay of a recording that began a number of entries later, without snapshots.
    pub(super) fn replayed(&self, first: usize) -> Report {
        self.replayed_as(first, self.entries[first..].to_vec())
    }

    /// A replay of a recording that began at one of the snapshots, with every so many of those that follow.
    pub(super) fn replayed_from(&self, snapshot: usize, every: usize) -> Report {
        let first = self.snapshots[snapshot].0;
        self.replayed_as(first, self.with_snapshots(first, every))
    }

    fn replayed_as(&self, first: usize, recorded: Vec<Entry>) -> Report {
        let before = &self.entries[..first];
        let axes = u8::try_from(V::AXES).expect("one or two");
        let mut metadata = metadata_of(axes, self.setup.clone(), self.first.clone());
        for entry in before {
            match entry {
                Entry::Mark(Mark::Scene {
                    revision,
                    arrival: Some(arrival),
                    ..
                }) => (metadata.revision, metadata.scene) = (*revision, arrival.scene.clone()),
                Entry::Mark(Mark::Servo { servo, .. }) => metadata.servo = Some((**servo).clone()),
                _ => {}
            }
        }
        replay(&metadata, recorded.into_iter().map(Ok)).expect("it is replayed")
    }
}

pub(super) fn compared(entries: &[Entry]) -> Report {
    replay(&metadata_with(entries), entries.iter().cloned().map(Ok)).expect("it is replayed")
}

pub(super) fn reasons(report: &Report) -> Vec<SkipReason> {
    report.uncompared.iter().map(|one| one.reason).collect()
}

/// A scene of another law.
pub(super) fn drag() -> Scene {
    let text = r#"{"name":"drag","friction":{"law":"viscous","viscous":20.0}}"#;
    serde_json::from_str(text).expect("a scene")
}

/// Everything that can happen to a rig.
pub(super) fn eventful<V: Vector>() -> ReplayedSession<V> {
    let mut session = ReplayedSession::new();
    let stickier = Scene::paper()
        .with(&[("Fs".parse().expect("a key"), 8.0), ("Fd".parse().expect("a key"), 5.0)])
        .expect("a scene");
    session.run(300).command(Command::Engage).run(200);
    session.with(|now| now.scene = Some((stickier, 0.2))).run(100);
    session.with(|now| now.scene = Some((Scene::paper(), 0.1))).run(200);
    session.with(|now| now.scene = Some((drag(), 0.1))).run(200);
    session.with(|now| now.events = Event::Stop.into()).run(150);
    session.command(Command::Reset).command(Command::Engage).run(200);
    let failed = DeviceError::Failed(ErrorCode::Sensor.into());
    session.with(|now| now.error = Some(failed)).run(20);
    session.command(Command::Reset).command(Command::Engage).run(100);
    session.with(|now| now.write_failed = true).run(50);
    session.with(|now| now.error = Some(DeviceError::Disconnected)).run(50);
    session.with(|now| now.scene = Some((Scene::paper(), 0.1)));
    session.command(Command::Engage).run(200);
    session.with(|now| now.events = Event::LeaseLapsed.into()).run(100);
    session.command(Command::Engage).run(100);
    session.command(Command::Release).run(100);
    session
}
