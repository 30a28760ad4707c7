//! The loop's tick on a scripted rig: the bench here, one idea in each file below.

mod admission;
mod behind_a_link;
mod changes;
mod engaging;
mod happenings;
mod reports;
mod rooms;
mod samples;
mod stopping;
mod timing;

use super::*;
use crate::rt::handoff::{ControlSide, hand_over};
use crate::rt::inbox::Sender;
use crate::rt::lateness::LatePolicy;
use crate::rt::outbox::{self, RECORDS};
use haptic_core::limiter::Limits;
use haptic_core::passivity::RigLosses;
use haptic_core::servo::Settings;
use haptic_core::velocity::Method;
use haptic_core::{Renderer, Scene, Scheme};

/// A rig of which the test decides every reading.
struct Scripted {
    readings: Vec<Result<f64, DeviceError>>,
    /// Time between two samples, ns.
    sample_ns: u64,
    time_ns: u64,
    /// The forces that were taken, N.
    written: Vec<f64>,
    next: u32,
    /// What becomes of a command.
    writing: Result<Written, DeviceError>,
    repeats: bool,
    /// What the next samples say of the motor.
    motor: Motor,
    buttons: u8,
    connection: u64,
    /// Of every command, whether the motor was to be enabled.
    enabled: Vec<bool>,
    /// Time that reading and writing takes, if a link lies between.
    link: Option<std::time::Duration>,
}

impl Device for Scripted {
    fn description(&self) -> String {
        "scripted".to_owned()
    }

    fn bounds(&self) -> DeviceBounds {
        DeviceBounds {
            connection: self.connection,
            is_linked: self.link.is_some(),
            resolution_m: 0.0,
            force_limit_n: f64::INFINITY,
        }
    }

    fn read(&mut self, _now_ns: u64) -> Result<Measurement, DeviceError> {
        self.link.map(std::thread::sleep).unwrap_or_default();
        if !self.repeats {
            self.next += 1;
            self.time_ns += self.sample_ns;
        }
        let index = self.next - 1;
        self.readings[index as usize].map(|position_m| Measurement {
            motor: self.motor,
            buttons: self.buttons,
            ..Measurement::new(index, self.time_ns, position_m)
        })
    }

    fn write(&mut self, force_n: f64, enabled: bool) -> Result<Written, DeviceError> {
        self.link.map(std::thread::sleep).unwrap_or_default();
        self.enabled.push(enabled);
        let written = self.writing?;
        if written == Written::Taken {
            self.written.push(force_n);
        }
        Ok(written)
    }
}

struct Bench<D: Device = Scripted> {
    tick: Tick<D>,
    shared: Arc<Shared>,
    inbox: Sender,
    records: outbox::Consumer,
    serial: u64,
    clock_ns: u64,
    missed_periods: u64,
    asleep_ns: u64,
}

/// What the clock shows before the first tick, ns.
const BEGAN_NS: u64 = 1_000_000_000;

const MAX_FORCE: f64 = 20.0;

const LIMITS: Limits = Limits {
    force_n: MAX_FORCE,
    slew_n_per_s: 1e6,
    speed_mps: 5.0,
    // The tests' hands move roughly; the one test of this limit sets it.
    acceleration_mps2: 1e6,
};

const NO_LOSSES: RigLosses = RigLosses {
    damping: 0.0,
    friction: 0.0,
};

/// How long a device may repeat itself, and the loop stand still.
const STALE_NS: u64 = 50_000_000;

/// Ticks until the velocity estimate has settled on the ramp.
const SETTLE: usize = 50;

/// How a test's loop is set, unless the test says otherwise.
pub(crate) const SETTINGS: Settings = Settings {
    period_s: 1e-3,
    ramp_s: 0.02,
    limits: LIMITS,
    losses: NO_LOSSES,
    passivity_control_n: 0.0,
    velocity: Method::AlphaBetaGamma,
    stale_ns: STALE_NS,
    stop_button: Some(0),
    enable_button: None,
    workspace: None,
    compensation: None,
};

/// The same with another slew limit, N/s.
fn slewed(slew_n_per_s: f64) -> Settings {
    let limits = Limits { slew_n_per_s, ..LIMITS };
    Settings { limits, ..SETTINGS }
}

/// A step of a ramp counts for this long at most, s: five periods.
const MAX_STEP_S: f64 = 0.005;

/// What other tests run the loop with: everything is at work.
pub(crate) fn servo<V: Space>(ramp_s: f64, scene: CompiledScene<V>) -> Servo<V> {
    let settings = Settings {
        ramp_s,
        limits: Limits {
            force_n: 20.0,
            slew_n_per_s: 50_000.0,
            speed_mps: 5.0,
            acceleration_mps2: 2000.0,
        },
        losses: RigLosses {
            damping: 0.0,
            friction: 0.8,
        },
        passivity_control_n: 1.0,
        stop_button: None,
        ..SETTINGS
    };
    Servo::new(settings, Box::new(scene))
}

fn bench(readings: impl IntoIterator<Item = Result<f64, DeviceError>>) -> Bench {
    bench_with(SETTINGS, readings)
}

fn bench_with(settings: Settings, readings: impl IntoIterator<Item = Result<f64, DeviceError>>) -> Bench {
    let device = Scripted {
        readings: readings.into_iter().collect(),
        sample_ns: 1_000_000,
        time_ns: 0,
        written: Vec::new(),
        next: 0,
        writing: Ok(Written::Taken),
        repeats: false,
        motor: Motor::Unreported,
        buttons: 0,
        connection: 1,
        enabled: Vec::new(),
        link: None,
    };
    bench_on(device, settings)
}

/// A loop on a device.
fn bench_on<D: Device>(device: D, settings: Settings) -> Bench<D> {
    let (ControlSide { shared, inbox, records }, loop_side) = hand_over(RECORDS);
    let tick = Tick::new(
        Box::new(device),
        loop_side,
        Servo::new(settings, Box::new(compiled(&Scene::paper(), 1))),
        Lateness::new(LatePolicy::Fault { most_in_a_second: 5 }),
        250_000_000,
    );
    Bench {
        tick,
        shared,
        inbox,
        records,
        serial: 0,
        clock_ns: BEGAN_NS,
        missed_periods: 0,
        asleep_ns: 0,
    }
}

pub(crate) fn compiled(scene: &Scene, revision: u64) -> CompiledScene {
    CompiledScene::at_once(
        Renderer::new(scene, Scheme::Exact, 1e-3).expect("a valid scene"),
        revision,
    )
}

impl<D: Device> Bench<D> {
    fn tick(&mut self) -> TickRecord {
        self.tick_after(1_000_000)
    }

    /// A tick that begins so long after the last one.
    fn tick_after(&mut self, after_ns: u64) -> TickRecord {
        let ended_ns = self.run_after(after_ns);
        let record = self.records.pop().expect("every tick leaves a record");
        assert_eq!(record.ended_ns, ended_ns);
        assert!(self.records.pop().is_none(), "one record, and the answers after it");
        record
    }

    /// The same, of which nobody takes the record; returns when it ended.
    fn run_after(&mut self, after_ns: u64) -> u64 {
        self.clock_ns += after_ns;
        let wake = Wake {
            deadline_ns: self.clock_ns,
            began_ns: self.clock_ns,
            asleep_ns: self.asleep_ns,
        };
        self.tick.run(wake, self.missed_periods)
    }

    /// The scene that a tick renders whose record nobody takes.
    fn rendered_unread(&mut self) -> u64 {
        self.run_after(1_000_000);
        self.tick.scene().revision
    }

    fn ticks(&mut self, count: usize) {
        for _ in 0..count {
            self.tick();
        }
    }

    /// Engages, and waits until the ramp has ended.
    fn engage(&mut self) {
        assert!(!self.command(Command::Engage).refused);
        self.ticks(30);
        assert_eq!(self.tick.servo.state(), RigState::Engaged);
    }

    fn command(&mut self, command: Command) -> Outcome {
        self.serial += 1;
        self.inbox.command(self.serial, command, self.shared.stops());
        self.tick();
        self.records
            .answers()
            .command(self.serial)
            .expect("answered in the tick")
    }
}

impl Bench {
    fn last_written(&self) -> f64 {
        *self.tick.device.written.last().expect("something was written")
    }
}

/// A ramp of 0.2 m/s: in the paper scene the friction is soon at its limit.
fn ramp() -> impl Iterator<Item = Result<f64, DeviceError>> {
    (0..10_000).map(|k| Ok(2e-4 * f64::from(k)))
}

fn scenes() -> Vec<Scene> {
    let mut scenes = vec![Scene::paper()];
    for (name, value) in [("K", 3e5), ("M", 100.0), ("b", 1e4), ("DV", 0.5)] {
        let key = name.parse().expect("a parameter");
        scenes.push(Scene::paper().with(&[(key, value)]).expect("a valid scene"));
    }
    // On the device itself, with a stiff spring and with drag.
    for law in [
        r#"{"law":"karnopp","static_force":40,"dynamic_force":30,"contact_stiffness":10000000}"#,
        r#"{"law":"viscous","viscous":10000}"#,
        r#"{"law":"lugre","static_force":40,"dynamic_force":30,"stribeck_velocity":0.001,"contact_stiffness":1000000,"contact_damping":1000}"#,
    ] {
        scenes.push(Scene {
            block: None,
            coupling: None,
            friction: serde_json::from_str(law).expect("a law"),
            ..Scene::paper()
        });
    }
    scenes
}
