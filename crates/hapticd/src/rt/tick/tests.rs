mod admission;
mod changes;
mod told;

use super::*;
use crate::control::compile::Compiled;
use crate::rt::lateness::LatePolicy;
use crate::rt::outbox;
use device_io::protocol::message::ErrorCode;
use haptic_core::limiter::Limits;
use haptic_core::passivity::RigLosses;
use haptic_core::servo::{Fault, Settings};
use haptic_core::velocity::{METHODS, Method};
use haptic_core::{Renderer, Scene, Scheme};
use proptest::prelude::*;

/// A rig of which the test decides every reading.
struct Scripted {
    readings: Vec<Result<f64, DeviceError>>,
    /// Time between two samples, ns.
    sample_ns: u64,
    time_ns: u64,
    written: Arc<std::sync::Mutex<Vec<f64>>>,
    next: u32,
    /// What becomes of a command.
    writing: Result<Written, DeviceError>,
    repeats: bool,
    /// What the next samples say of the motor.
    motor: Motor,
    buttons: u8,
    force_limit_n: f64,
    /// Of every command, whether the motor was to be enabled.
    enabled: Vec<bool>,
    /// Time that reading and writing takes, if a link lies between.
    link: Option<std::time::Duration>,
}

impl Device for Scripted {
    fn description(&self) -> String {
        "scripted".to_owned()
    }

    fn resolution_m(&self) -> f64 {
        0.0
    }

    fn force_limit_n(&self) -> f64 {
        self.force_limit_n
    }

    fn is_linked(&self) -> bool {
        self.link.is_some()
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
            self.written.lock().expect("one thread").push(force_n);
        }
        Ok(written)
    }
}

struct Bench {
    tick: Tick<Scripted>,
    shared: Arc<Shared>,
    records: outbox::Consumer,
    written: Arc<std::sync::Mutex<Vec<f64>>>,
    serial: u32,
    clock_ns: u64,
    missed_periods: u64,
    asleep_ns: u64,
}

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
const SETTINGS: Settings = Settings {
    period_s: 1e-3,
    ramp_s: 0.02,
    limits: LIMITS,
    losses: NO_LOSSES,
    passivity_control_n: 0.0,
    velocity: Method::AlphaBetaGamma,
    stale_ns: STALE_NS,
    stop_button: Some(0),
    enable_button: None,
};

/// The same with another slew limit, N/s.
fn slewed(slew_n_per_s: f64) -> Settings {
    let limits = Limits { slew_n_per_s, ..LIMITS };
    Settings { limits, ..SETTINGS }
}

/// A step of a ramp counts for this long at most, s: five periods.
const LONGEST_STEP_S: f64 = 0.005;

/// What other tests run the loop with: everything is at work.
pub(crate) fn servo(ramp_s: f64, scene: CompiledScene) -> Servo {
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
    let shared = Arc::new(Shared::new());
    let (producer, records) = outbox::outbox();
    let written = Arc::default();
    let device = Scripted {
        readings: readings.into_iter().collect(),
        sample_ns: 1_000_000,
        time_ns: 0,
        written: Arc::clone(&written),
        next: 0,
        writing: Ok(Written::Taken),
        repeats: false,
        motor: Motor::Unreported,
        buttons: 0,
        force_limit_n: f64::INFINITY,
        enabled: Vec::new(),
        link: None,
    };
    let tick = Tick::new(
        Box::new(device),
        Arc::clone(&shared),
        producer,
        Servo::new(settings, Box::new(compiled(&Scene::paper(), 1))),
        Lateness::new(LatePolicy::Fault { most_in_a_second: 5 }),
        250_000_000,
    );
    Bench {
        tick,
        shared,
        records,
        written,
        serial: 0,
        clock_ns: 1_000_000_000,
        missed_periods: 0,
        asleep_ns: 0,
    }
}

fn compiled(scene: &Scene, revision: u64) -> CompiledScene {
    CompiledScene::at_once(
        Renderer::new(scene, Scheme::Exact, 1e-3).expect("a valid scene"),
        revision,
    )
}

impl Bench {
    fn tick(&mut self) -> TickRecord {
        self.tick_after(1_000_000)
    }

    /// A tick that begins so long after the last one.
    fn tick_after(&mut self, after_ns: u64) -> TickRecord {
        self.clock_ns += after_ns;
        let wake = Wake {
            deadline_ns: self.clock_ns,
            began_ns: self.clock_ns,
            asleep_ns: self.asleep_ns,
        };
        self.tick.run(wake, self.missed_periods);
        self.records.pop().expect("every tick leaves a record")
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
        self.shared.send(self.serial, command, self.shared.stops());
        self.tick();
        self.shared.answers.command(self.serial).expect("answered in the tick")
    }

    fn last_written(&self) -> f64 {
        *self
            .written
            .lock()
            .expect("one thread")
            .last()
            .expect("something was written")
    }
}

/// A ramp of 0.2 m/s: in the paper scene the friction is soon at its limit.
fn ramp() -> impl Iterator<Item = Result<f64, DeviceError>> {
    (0..10_000).map(|k| Ok(2e-4 * f64::from(k)))
}

#[test]
fn force_comes_with_engaging_opposes_the_motion_and_goes_with_a_stop() {
    let mut bench = bench(ramp());
    bench.ticks(SETTLE);
    assert_eq!(bench.last_written(), 0.0);
    assert_eq!(bench.command(Command::Engage).state, RigState::Engaging);
    bench.ticks(300);
    let record = bench.tick();
    assert_eq!(record.state, RigState::Engaged);
    assert!((record.command_force + 3.5).abs() < 0.05, "{record:?}");
    assert_eq!(record.contact, 1);
    let stop = bench.shared.stop();
    assert_eq!(bench.tick().command_force, 0.0);
    assert_eq!(
        bench.shared.answers.stop(stop).map(|stopped| stopped.state),
        Some(RigState::Stopped)
    );
    assert!(bench.command(Command::Engage).refused, "a stop holds until a reset");
    assert_eq!(bench.command(Command::Reset).state, RigState::Idle);
    assert_eq!(bench.last_written(), 0.0, "a reset does not engage");
}

#[test]
fn engaging_begins_without_force_wherever_and_whenever_it_comes() {
    // In the very first tick, far from the origin; and after a device that was gone has come back elsewhere.
    let away = || std::iter::repeat_n(Err(DeviceError::Disconnected), 1);
    let readings = std::iter::repeat_n(Ok(-0.03), 50)
        .chain(away())
        .chain(std::iter::repeat_n(Ok(0.4), 50));
    let mut bench = bench(readings);
    let still = |bench: &mut Bench| {
        bench.serial += 1;
        bench.shared.send(bench.serial, Command::Engage, bench.shared.stops());
        for _ in 0..30 {
            let record = bench.tick();
            assert_eq!((record.coupling_force, record.command_force), (0.0, 0.0), "{record:?}");
        }
        assert_eq!(bench.tick().state, RigState::Engaged);
    };
    still(&mut bench);
    bench.ticks(50 - 31);
    assert_eq!(bench.tick().state, RigState::Disconnected);
    assert_eq!(bench.tick().state, RigState::Idle);
    still(&mut bench);
}

#[test]
fn engaging_on_a_moving_hand_begins_without_force_and_then_opposes_it() {
    let mut bench = bench(ramp());
    bench.ticks(SETTLE);
    bench.serial += 1;
    bench.shared.send(bench.serial, Command::Engage, bench.shared.stops());
    let first = bench.tick();
    assert_eq!(
        (first.state, first.coupling_force, first.command_force),
        (RigState::Engaging, 0.0, 0.0)
    );
    for _ in 0..10 {
        let record = bench.tick();
        assert!(record.command_force <= 0.0, "against the motion: {record:?}");
    }
}

#[test]
fn a_stall_does_not_skip_the_ramp() {
    let mut bench = bench(ramp());
    bench.ticks(SETTLE);
    bench.clock_ns += 3_000_000_000;
    assert_eq!(bench.command(Command::Engage).state, RigState::Engaging);
    bench.tick.device.sample_ns = STALE_NS;
    assert_eq!(bench.tick_after(STALE_NS).state, RigState::Engaging);
}

// hazard: H7
#[test]
fn a_stall_or_a_sleep_of_the_machine_while_force_flows_is_a_fault() {
    for (stalls_ns, sleeps_ns, fault) in [
        (STALE_NS, 0, None),
        (STALE_NS + 1, 0, Some(Fault::Stalled)),
        (1_000_000_000, 0, Some(Fault::Stalled)),
        (1_000_000, STALE_NS, None),
        // The monotonic clock stands still while the machine sleeps.
        (1_000_000, 10_000_000_000, Some(Fault::Stalled)),
    ] {
        let mut bench = bench(ramp());
        bench.asleep_ns = 3_600_000_000_000;
        bench.ticks(SETTLE);
        bench.engage();
        bench.tick.device.sample_ns = stalls_ns;
        bench.asleep_ns += sleeps_ns;
        let record = bench.tick_after(stalls_ns);
        assert_eq!(record.fault, fault, "{stalls_ns} ns, {sleeps_ns} ns");
        assert_eq!(record.command_force == 0.0, fault.is_some(), "{record:?}");
    }
}

#[test]
fn a_record_has_its_number_and_the_time_that_the_link_took() {
    let mut bench = bench(ramp());
    let first = bench.tick();
    assert_eq!((first.tick, bench.tick().tick, bench.tick().tick), (0, 1, 2));
    assert_eq!(first.device_round_trip_ns, 0, "no link");
    let takes = std::time::Duration::from_millis(2);
    bench.tick.device.link = Some(takes);
    bench.clock_ns = now_ns();
    let record = bench.tick_after(0);
    let round_trip = std::time::Duration::from_nanos(record.device_round_trip_ns);
    let whole = std::time::Duration::from_nanos(record.ended_ns - record.began_ns);
    assert!(
        2 * takes <= round_trip && round_trip <= whole,
        "{round_trip:?} of {whole:?}"
    );
}

// hazard: H2
#[test]
fn a_control_thread_that_hangs_lets_the_force_down_within_300_ms() {
    let mut bench = bench_with(
        Settings {
            ramp_s: 10.0,
            ..SETTINGS
        },
        ramp(),
    );
    bench.shared.beat(bench.clock_ns);
    bench.ticks(SETTLE);
    bench.command(Command::Engage);
    // Of a ramp of ten seconds a tenth is gone.
    for _ in 0..1000 {
        // Not a whole number of ticks before any of them.
        bench.shared.beat(bench.clock_ns + 1);
        assert!(bench.tick().state.is_live());
    }
    let lost_ns = bench.clock_ns;
    let mut last = bench.tick();
    while last.state.is_live() {
        let record = bench.tick();
        assert!(
            (record.command_force - last.command_force).abs() < 0.5,
            "no jump: {last:?} {record:?}"
        );
        last = record;
    }
    assert_eq!((last.state, last.fault), (RigState::Faulted, Some(Fault::ControlLost)));
    let took_ns = bench.clock_ns - lost_ns;
    assert!((240_000_000..=300_000_000).contains(&took_ns), "{took_ns} ns");
    // It comes to itself: that alone brings no force back.
    bench.shared.beat(bench.clock_ns);
    assert!(bench.command(Command::Engage).refused);
    assert_eq!(bench.command(Command::Reset).state, RigState::Idle);
    assert!(!bench.command(Command::Engage).refused);
}

// hazard: H15
#[test]
fn a_lapsed_lease_lets_the_force_down_within_200_ms_whatever_the_ramp() {
    let mut bench = bench_with(
        Settings {
            ramp_s: 1.0,
            ..SETTINGS
        },
        ramp(),
    );
    bench.command(Command::Engage);
    while bench.tick().state != RigState::Engaged {}
    bench.shared.lease_until(bench.clock_ns);
    let mut ticks = 0;
    while bench.tick().state.is_live() {
        ticks += 1;
    }
    assert!((190..=202).contains(&ticks), "{ticks} ms");
    assert_eq!(bench.tick.servo.state(), RigState::Idle);
}

// hazard: P6
#[test]
fn the_jitter_of_our_own_clock_is_not_felt() {
    let run = |jitter_ns: u64| {
        let mut bench = bench(ramp());
        bench.ticks(SETTLE);
        bench.engage();
        bench.ticks(300);
        let records: Vec<TickRecord> = (0..200)
            .map(|k| {
                bench.tick_after(if k % 2 == 0 {
                    1_000_000 - jitter_ns
                } else {
                    1_000_000 + jitter_ns
                })
            })
            .collect();
        records
    };
    for (even, uneven) in run(0).iter().zip(&run(700_000)) {
        assert_eq!(even.device_velocity, uneven.device_velocity);
        assert_eq!(even.command_force, uneven.command_force);
    }
}

// hazard: H3
#[test]
fn no_lying_clock_makes_more_force_than_an_honest_one() {
    // A hand at 0.1 m/s that turns round every half second.
    let hand = || {
        (0..4000).map(|k| {
            let phase = k % 1000;
            Ok(1e-4 * f64::from(if phase < 500 { phase } else { 1000 - phase }))
        })
    };
    let run = |lie: fn(u64) -> u64| {
        let mut bench = bench(hand());
        bench.ticks(SETTLE);
        bench.engage();
        bench.ticks(600);
        let (mut largest, mut fault) = (0.0_f64, None);
        for k in 1..1500 {
            // What the device's clock goes on by while ours goes on by a millisecond.
            bench.tick.device.sample_ns = lie(k);
            let record = bench.tick();
            largest = largest.max(record.command_force.abs());
            fault = fault.or(record.fault);
        }
        (largest, fault)
    };
    let (honest, none) = run(|_| 1_000_000);
    assert_eq!(none, None);
    type Lie = (&'static str, fn(u64) -> u64);
    let lies: [Lie; 8] = [
        ("stands still", |_| 0),
        ("half speed", |_| 500_000),
        ("double speed", |_| 2_000_000),
        ("ten percent fast", |_| 1_100_000),
        ("runs backwards", |_| ((1 << 32) - 1000) * 1000),
        ("jumps ahead", |k| if k == 100 { 60_000_000 } else { 1_000_000 }),
        ("jumps back", |k| {
            if k == 100 {
                ((1 << 32) - 60_000) * 1000
            } else {
                1_000_000
            }
        }),
        ("wraps at 16 bits", |k| {
            if k % 65 == 0 {
                ((1 << 32) - 64_000) * 1000
            } else {
                1_000_000
            }
        }),
    ];
    for (name, lie) in lies {
        let (largest, fault) = run(lie);
        assert!(matches!(fault, Some(Fault::DeviceClock(_))), "{name}: {fault:?}");
        assert!(
            largest <= 1.5 * honest,
            "{name}: {largest} N, the honest one {honest} N"
        );
    }
}

// hazard: H6
#[test]
fn a_lone_wrong_sample_changes_no_force_and_is_counted() {
    let run = |wrong_m: f64| {
        let mut bench = bench((0..2000).map(|k| {
            let honest = 1e-4 * f64::from(k);
            Ok(if k == 400 { honest + wrong_m } else { honest })
        }));
        bench.ticks(SETTLE);
        bench.engage();
        let records: Vec<TickRecord> = (0..600).map(|_| bench.tick()).collect();
        assert_eq!(bench.shared.answers.samples_forgotten(), u64::from(wrong_m != 0.0));
        records
    };
    let honest = run(0.0);
    for wrong_m in [0.5e-3, 1e-3, -1e-3, 0.05, -3.0] {
        let wrong = run(wrong_m);
        assert!(wrong.iter().all(|record| record.fault.is_none()), "{wrong_m} m");
        for (honest, wrong) in honest.iter().zip(&wrong) {
            let difference = (wrong.command_force - honest.command_force).abs();
            assert!(difference < 0.3, "{wrong_m} m: {difference} N at tick {}", wrong.tick);
        }
    }
}

// hazard: H16
#[test]
fn the_force_decays_while_no_new_sample_comes_and_returns_without_a_jump() {
    let mut bench = bench(ramp());
    bench.ticks(SETTLE);
    bench.engage();
    bench.ticks(300);
    let before = bench.tick().command_force.abs();
    bench.tick.device.repeats = true;
    let mut last = before;
    for silent in 1..=30 {
        let record = bench.tick();
        assert!(record.state.is_live(), "{record:?}");
        let force = record.command_force.abs();
        assert!(force <= last, "it only decays: {record:?}");
        match silent {
            1..=3 => assert_eq!(force, before, "three periods are no reason"),
            4..=22 => assert!(force < last, "{silent}: {record:?}"),
            _ => assert_eq!(force, 0.0, "{silent}"),
        }
        last = force;
    }
    bench.tick.device.repeats = false;
    // The hand has gone on meanwhile.
    bench.tick.device.next += 30;
    bench.tick.device.sample_ns = 31_000_000;
    for _ in 0..100 {
        let record = bench.tick();
        bench.tick.device.sample_ns = 1_000_000;
        assert!(record.command_force.abs() - last < 0.5, "no jump: {record:?}");
        last = record.command_force.abs();
    }
    assert!(last > 0.8 * before, "{last} N of {before} N");
}

// hazard: H8
#[test]
fn the_devices_own_force_limit_holds_and_a_motor_without_force_is_not_engaged() {
    let mut weak = bench(ramp());
    weak.tick.device.force_limit_n = 1.0;
    weak.ticks(SETTLE);
    weak.engage();
    weak.ticks(300);
    assert_eq!(
        weak.tick().command_force,
        -1.0,
        "what the record says is what the rig gives"
    );
    let mut none = bench(ramp());
    none.tick.device.force_limit_n = 0.0;
    none.ticks(SETTLE);
    assert!(none.command(Command::Engage).refused);
}

// hazard: H12
#[test]
fn a_stop_is_confirmed_when_the_device_says_that_its_motor_is_off_and_never_waited_for_longer_than_100_ms() {
    let mut bench = bench(ramp());
    bench.tick.device.motor = Motor::Off;
    bench.ticks(SETTLE);
    bench.tick.device.motor = Motor::Enabled;
    bench.engage();
    let stop = bench.shared.stop();
    bench.ticks(3);
    bench.tick.device.motor = Motor::Unconfirmed;
    bench.ticks(3);
    assert_eq!(
        bench.shared.answers.stop(stop),
        None,
        "the link has it, and the device has not said so"
    );
    assert_eq!(bench.last_written(), 0.0);
    bench.tick.device.motor = Motor::Off;
    bench.tick();
    let stopped = bench.shared.answers.stop(stop).expect("confirmed");
    assert_eq!((stopped.heard, stopped.state), (Heard::Confirmed, RigState::Stopped));
    assert!(stopped.confirmed_ns > stopped.written_ns);
    // One that never says so.
    bench.command(Command::Reset);
    bench.tick.device.motor = Motor::Enabled;
    bench.engage();
    bench.tick.device.motor = Motor::Unconfirmed;
    let stop = bench.shared.stop();
    let began_ns = bench.clock_ns;
    while bench.shared.answers.stop(stop).is_none() {
        bench.tick();
        assert!(bench.clock_ns - began_ns < 200_000_000, "it waits for ever");
    }
    assert_eq!(
        bench.shared.answers.stop(stop).map(|stopped| stopped.heard),
        Some(Heard::Unconfirmed)
    );
}

// hazard: H9
#[test]
fn a_motor_that_stays_enabled_is_an_alarm_in_every_state_without_force() {
    for stop in [true, false] {
        let mut bench = bench(ramp());
        bench.tick.device.motor = Motor::Off;
        bench.ticks(SETTLE);
        bench.tick.device.motor = Motor::Enabled;
        bench.engage();
        bench.ticks(300);
        if stop {
            bench.shared.stop();
        } else {
            bench.command(Command::Release);
            while bench.tick().state.is_live() {}
        }
        bench.ticks(95);
        let before = bench.tick();
        assert_eq!(before.state, if stop { RigState::Stopped } else { RigState::Idle });
        bench.ticks(5);
        let alarmed = bench.tick();
        assert_eq!(
            (alarmed.state, alarmed.fault),
            (RigState::Faulted, Some(Fault::StillEnabled))
        );
        // A reset does not make it well.
        bench.command(Command::Reset);
        bench.ticks(90);
        assert_eq!(bench.tick.servo.state(), RigState::Idle, "it has its time again");
        bench.ticks(15);
        assert_eq!(bench.tick.servo.fault(), Some(Fault::StillEnabled));
    }
}

// hazard: H19
#[test]
fn the_rigs_own_buttons_stop_it_and_let_it_go() {
    let settings = Settings {
        enable_button: Some(3),
        ..SETTINGS
    };
    let mut bench = bench_with(settings, ramp());
    bench.ticks(SETTLE);
    assert!(bench.command(Command::Engage).refused, "the enable button is not held");
    bench.tick.device.buttons = 1 << 3;
    bench.tick();
    bench.engage();
    bench.ticks(100);
    bench.tick.device.buttons = 0;
    let let_go = bench.tick();
    assert_eq!(
        (let_go.state, let_go.command_force),
        (RigState::Idle, 0.0),
        "in that very tick"
    );
    bench.tick.device.buttons = 1 << 3;
    bench.ticks(5);
    assert_eq!(bench.tick().state, RigState::Idle, "it does not come back by itself");
    bench.engage();
    bench.tick.device.buttons |= 1;
    let stopped = bench.tick();
    assert_eq!(
        (stopped.state, stopped.fault, stopped.command_force),
        (RigState::Stopped, Some(Fault::StopButton), 0.0)
    );
    // While it is pressed nothing helps; after that a reset does.
    bench.command(Command::Reset);
    assert_eq!(bench.tick().state, RigState::Stopped);
    bench.tick.device.buttons = 1 << 3;
    bench.tick();
    assert_eq!(bench.command(Command::Reset).state, RigState::Idle);
    bench.engage();
}

// hazard: P3, P4, P5
#[test]
fn the_motor_is_enabled_while_force_may_flow_and_never_else() {
    let mut bench = bench(ramp());
    let last = |bench: &mut Bench| {
        let record = bench.tick();
        (
            record.state.is_live(),
            bench
                .tick
                .device
                .enabled
                .last()
                .copied()
                .expect("written in every tick"),
        )
    };
    for _ in 0..SETTLE {
        assert_eq!(last(&mut bench), (false, false));
    }
    bench.command(Command::Engage);
    for _ in 0..100 {
        assert_eq!(last(&mut bench), (true, true));
    }
    bench.shared.stop();
    assert_eq!(last(&mut bench), (false, false));
    bench.command(Command::Reset);
    bench.engage();
    // A write that fails takes the rig with it.
    bench.tick.device.writing = Err(DeviceError::Disconnected);
    assert_eq!(bench.tick().state, RigState::Disconnected);
    bench.tick.device.writing = Ok(Written::Taken);
    assert!(!last(&mut bench).1);
    assert!(bench.tick.zero_force().is_ok());
    assert_eq!(bench.tick.device.enabled.last(), Some(&false), "the last word");
}

// hazard: P7
#[test]
fn ramps_go_by_our_clock() {
    let mut bench = bench_with(
        Settings {
            ramp_s: 0.1,
            ..SETTINGS
        },
        ramp(),
    );
    bench.ticks(SETTLE);
    // A device at half the speed, which is a fault only later.
    bench.tick.device.sample_ns = 500_000;
    bench.command(Command::Engage);
    bench.ticks(98);
    assert_eq!(bench.tick.servo.state(), RigState::Engaging);
    bench.ticks(3);
    assert_eq!(bench.tick.servo.state(), RigState::Engaged);
}

// hazard: P8, P9
#[test]
fn nothing_of_the_force_before_a_stop_is_left_after_it() {
    let mut bench = bench(ramp());
    bench.ticks(SETTLE);
    bench.engage();
    bench.ticks(200);
    // A change of scene whose step of force is still fading, and an energy account with something in it.
    bench.shared.scenes.post(compiled(&scenes()[6], 2));
    bench.ticks(5);
    bench.shared.stop();
    bench.tick();
    assert_eq!(bench.tick().energy_excess, 0.0);
    bench.shared.scenes.post(compiled(&Scene::paper(), 3));
    bench.command(Command::Reset);
    bench.command(Command::Engage);
    let first = bench.tick();
    assert!(first.command_force.abs() < 0.1, "force begins anew: {first:?}");
}

#[test]
fn a_stall_does_not_lift_the_slew_limit() {
    // At rest, and a millimetre on after the stall, on a spring that gives all the force there is.
    let still = || std::iter::repeat_n(Ok(0.0), 150);
    let slew_n_per_s = 1000.0;
    let mut bench = bench_with(slewed(slew_n_per_s), still().chain(std::iter::repeat_n(Ok(1e-3), 10)));
    bench.shared.scenes.post(compiled(&scenes()[5], 2));
    bench.command(Command::Engage);
    bench.ticks(148);
    assert_eq!(bench.tick().state, RigState::Engaged);
    bench.tick.device.sample_ns = STALE_NS;
    let after = bench.tick_after(STALE_NS);
    assert!(after.coupling_force.abs() > MAX_FORCE, "{after:?}");
    assert_eq!(after.command_force.abs(), slew_n_per_s * LONGEST_STEP_S, "{after:?}");
    bench.tick.device.sample_ns = 1_000_000;
    let next = bench.tick();
    assert_eq!(next.command_force.abs(), slew_n_per_s * (LONGEST_STEP_S + 1e-3));
}

#[test]
fn what_the_passivity_controller_adds_grows_with_the_ramp_as_everything_does() {
    const CONTROL_N: f64 = 3.0;
    // A hand that trembles on a stiff coupling, along a ramp of a second.
    let run = |control_n: f64| {
        let tremble = (0..400).map(|k| Ok(1e-4 * (0.8 * f64::from(k)).sin()));
        let settings = Settings {
            ramp_s: 1.0,
            passivity_control_n: control_n,
            ..SETTINGS
        };
        let mut bench = bench_with(settings, tremble);
        bench.command(Command::Engage);
        let records: Vec<TickRecord> = (0..350).map(|_| bench.tick()).collect();
        records
    };
    let (watched, controlled) = (run(0.0), run(CONTROL_N));
    let mut added = false;
    for (k, (watched, controlled)) in (1..).zip(watched.iter().zip(&controlled)) {
        let gain = 1e-3 * f64::from(k);
        let most = gain * (controlled.coupling_force.abs() + CONTROL_N) + 1e-9;
        assert!(controlled.command_force.abs() <= most, "{most}: {controlled:?}");
        added |= controlled.command_force != watched.command_force;
    }
    assert!(added, "the controller had nothing to do");
    // As long as the gain is next to nothing so is what it takes out, and it must know that.
    let (watched, controlled) = (watched[10].energy_excess, controlled[10].energy_excess);
    assert!(
        watched > 0.0 && (controlled / watched - 1.0).abs() < 0.1,
        "{watched} J, {controlled} J"
    );
}

#[test]
fn a_stop_is_confirmed_only_when_the_device_has_taken_zero_force() {
    let mut bench = bench(ramp());
    bench.ticks(SETTLE);
    bench.command(Command::Engage);
    bench.ticks(50);
    // A link that is busy: the zero force waits.
    bench.tick.device.writing = Ok(Written::Later);
    let stop = bench.shared.stop();
    bench.ticks(5);
    assert_eq!(bench.shared.answers.stop(stop), None);
    // Another has seen the stop and resets; force may not come before the zero force has gone.
    assert_eq!(bench.command(Command::Reset).state, RigState::Idle);
    assert!(bench.command(Command::Engage).refused);
    assert_eq!(bench.shared.answers.stop(stop), None);
    bench.tick.device.writing = Ok(Written::Taken);
    let tick = bench.tick().tick;
    let stopped = bench.shared.answers.stop(stop).expect("confirmed");
    assert_eq!(
        (stopped.tick, stopped.state, stopped.heard),
        (tick, RigState::Stopped, Heard::Confirmed)
    );
    assert_eq!(bench.last_written(), 0.0);
    assert!(!bench.command(Command::Engage).refused);
}

#[test]
fn a_stop_that_no_device_can_hear_is_answered_at_once_and_says_so() {
    let gone = || std::iter::repeat_n(Err(DeviceError::Disconnected), 20);
    let mut bench = bench(ramp().take(100).chain(gone()).chain(ramp().take(50)));
    bench.ticks(SETTLE);
    bench.command(Command::Engage);
    bench.ticks(99 - SETTLE);
    bench.tick.device.writing = Err(DeviceError::Disconnected);
    bench.tick();
    let stop = bench.shared.stop();
    let tick = bench.tick().tick;
    let unheard = bench.shared.answers.stop(stop).expect("answered at once");
    assert_eq!(
        (unheard.tick, unheard.state, unheard.heard),
        (tick, RigState::Stopped, Heard::NoDevice)
    );
    // The device that comes back is told, and nobody pulls before a reset.
    bench.ticks(18);
    bench.written.lock().expect("one thread").clear();
    bench.tick.device.writing = Ok(Written::Taken);
    assert_eq!(bench.tick().state, RigState::Stopped);
    assert_eq!(bench.last_written(), 0.0);
    assert!(bench.command(Command::Engage).refused);
    // The next stop is heard.
    let stop = bench.shared.stop();
    bench.tick();
    let heard = bench.shared.answers.stop(stop).map(|stopped| stopped.heard);
    assert_eq!(heard, Some(Heard::Confirmed));
}

#[test]
fn a_device_that_repeats_itself_faults_and_comes_back_idle_after_a_reset() {
    let mut bench = bench(ramp());
    bench.ticks(SETTLE);
    bench.command(Command::Engage);
    bench.ticks(60);
    bench.tick.device.repeats = true;
    let before = bench.tick();
    assert!(
        before.command_force != 0.0,
        "a late sample is no reason yet: {before:?}"
    );
    bench.ticks(50);
    let lost = bench.tick();
    assert_eq!((lost.state, lost.command_force), (RigState::Faulted, 0.0));
    assert_eq!(lost.fault, Some(Fault::Stale));
    bench.command(Command::Reset);
    bench.ticks(2);
    assert_eq!(bench.tick().state, RigState::Disconnected, "there is still nothing new");
    bench.tick.device.repeats = false;
    bench.ticks(10);
    assert_eq!(bench.tick().state, RigState::Idle);
}

#[test]
fn a_device_that_has_its_motor_off_faults_and_is_told_apart_from_one_that_is_gone() {
    for (error, state, fault) in [
        (
            DeviceError::MotorOff { watchdog: true },
            RigState::Faulted,
            Some(Fault::MotorOff { watchdog: true }),
        ),
        (
            DeviceError::Failed(ErrorCode::Sensor.into()),
            RigState::Faulted,
            Some(Fault::Device(ErrorCode::Sensor.into())),
        ),
        (DeviceError::Disconnected, RigState::Disconnected, None),
    ] {
        let mut bench = bench(ramp().take(100).chain([Err(error)]).chain(ramp()));
        bench.tick();
        bench.command(Command::Engage);
        bench.ticks(98);
        let told = bench.tick();
        assert_eq!((told.state, told.fault, told.command_force), (state, fault, 0.0));
        assert_eq!(bench.last_written(), 0.0);
    }
}

#[test]
fn a_reset_that_a_stop_has_overtaken_clears_nothing() {
    let mut bench = bench(ramp());
    bench.shared.stop();
    bench.tick();
    bench.shared.send(7, Command::Reset, bench.shared.stops());
    bench.shared.stop();
    bench.tick();
    let outcome = bench.shared.answers.command(7).expect("answered");
    assert!(outcome.refused);
    assert_eq!(outcome.state, RigState::Stopped);
}

#[test]
fn a_failed_read_is_zero_force_and_never_engages_by_itself() {
    let readings = ramp()
        .take(100)
        .chain(std::iter::repeat_n(Err(DeviceError::Disconnected), 5))
        .chain(ramp());
    let mut bench = bench(readings);
    bench.ticks(SETTLE);
    bench.command(Command::Engage);
    bench.ticks(99 - SETTLE);
    assert!(bench.last_written() < -0.1);
    let lost = bench.tick();
    assert_eq!((lost.state, lost.command_force), (RigState::Disconnected, 0.0));
    bench.ticks(4);
    for _ in 0..50 {
        let back = bench.tick();
        assert_eq!((back.state, back.command_force), (RigState::Idle, 0.0));
    }
}

#[test]
fn a_position_that_is_no_number_faults_at_zero_force() {
    let mut bench = bench(ramp().take(100).chain([Ok(f64::NAN)]).chain(ramp()));
    bench.ticks(SETTLE);
    bench.command(Command::Engage);
    bench.ticks(99 - SETTLE);
    let record = bench.tick();
    assert_eq!(
        (record.state, record.fault),
        (RigState::Faulted, Some(Fault::NonFinitePosition))
    );
    assert_eq!(record.command_force, 0.0);
    assert_eq!(bench.tick().command_force, 0.0, "until a reset");
}

#[test]
fn a_jump_of_the_encoder_faults_before_it_is_rendered() {
    // 2 mm within a millisecond, from a hand at 0.1 m/s: slower than the speed limit, and no motion.
    let jumped = (0..50).map(|k| Ok(0.02 + 2e-3 + 2e-4 * f64::from(k)));
    let limits = Limits {
        acceleration_mps2: 2000.0,
        ..LIMITS
    };
    let mut bench = bench_with(Settings { limits, ..SETTINGS }, ramp().take(100).chain(jumped));
    bench.ticks(SETTLE);
    bench.command(Command::Engage);
    let mut before = bench.tick();
    while before.state.is_live() {
        let record = bench.tick();
        let step = record.command_force - before.command_force;
        assert!(record.command_force == 0.0 || step.abs() < 1.0, "{before:?} {record:?}");
        before = record;
    }
    assert_eq!(bench.tick.servo.fault(), Some(Fault::Jump));
    assert_eq!(bench.last_written(), 0.0);
}

#[test]
fn a_jump_of_the_encoder_is_cut_to_the_force_limit() {
    let mut bench = bench(ramp().take(100).chain(std::iter::repeat_n(Ok(5.0), 50)));
    bench.tick();
    bench.command(Command::Engage);
    for _ in 2..150 {
        let record = bench.tick();
        assert!(record.command_force.abs() <= MAX_FORCE, "{record:?}");
    }
}

#[test]
fn a_new_scene_lands_between_two_ticks_without_a_step_of_force() {
    for changes in [
        vec![("K", 3000.0)],
        vec![("B", 0.0), ("M", 2.0)],
        vec![("K", 0.0), ("B", 30.0)],
    ] {
        let mut bench = bench(ramp());
        bench.ticks(SETTLE);
        bench.command(Command::Engage);
        bench.ticks(200);
        let before = bench.tick();
        let changes: Vec<_> = changes
            .iter()
            .map(|(name, value)| (name.parse().expect("a parameter"), *value))
            .collect();
        let scene = Scene::paper().with(&changes).expect("a valid scene");
        bench.shared.scenes.post(compiled(&scene, 2));
        let after = bench.tick();
        assert_eq!((before.revision, after.revision), (1, 2));
        assert_eq!(bench.shared.answers.applied(2), Some(after.tick));
        let step = (after.command_force - before.command_force).abs();
        assert!(step < 1.0, "{changes:?}: {step} N");
        bench.records.drop_retired();
    }
}

#[test]
fn a_device_that_goes_too_fast_faults_at_zero_force() {
    // 8 m/s, from rest, while it is engaged.
    let fast = (0..200).map(|k| Ok(0.2 * 0.1 + 8e-3 * f64::from(k)));
    let mut bench = bench(ramp().take(100).chain(fast));
    bench.ticks(SETTLE);
    bench.command(Command::Engage);
    bench.ticks(100);
    assert_eq!(bench.tick.servo.fault(), Some(Fault::TooFast));
    assert_eq!(bench.last_written(), 0.0);
}

#[test]
fn a_loop_that_is_too_late_faults_where_the_policy_says_so() {
    let mut bench = bench(ramp());
    bench.ticks(SETTLE);
    bench.command(Command::Engage);
    bench.ticks(50);
    let mut missed = |periods: u64| {
        bench.missed_periods += periods;
        let record = bench.tick();
        (record.fault, record.command_force)
    };
    assert_eq!(missed(4).0, None);
    assert_eq!(missed(1), (Some(Fault::TooLate), 0.0));
}

#[test]
fn only_what_is_missed_while_force_flows_makes_the_loop_too_late() {
    let mut bench = bench(ramp());
    bench.ticks(SETTLE);
    // Idle, and late in many ticks: nobody is harmed.
    for _ in 0..100 {
        bench.missed_periods += 3;
        bench.tick();
    }
    bench.command(Command::Engage);
    bench.ticks(5);
    assert_eq!(bench.tick().fault, None, "what was missed while it was idle");
    // Four at the end of a second, four at the beginning of the next.
    bench.missed_periods += 4;
    assert_eq!(bench.tick().fault, None);
    bench.missed_periods += 4;
    assert_eq!(bench.tick().fault, Some(Fault::TooLate));
    // While it is faulted it is late again; after a reset that is the past.
    bench.missed_periods += 50;
    bench.tick();
    assert_eq!(bench.command(Command::Reset).state, RigState::Idle);
    bench.missed_periods += 50;
    bench.tick();
    assert_eq!(bench.command(Command::Engage).state, RigState::Engaging);
    bench.ticks(5);
    bench.missed_periods += 4;
    let engaged = bench.tick();
    assert!(engaged.state.is_live(), "{engaged:?}");
    // Released and engaged again within the second: it begins anew.
    bench.command(Command::Release);
    bench.ticks(30);
    assert_eq!(bench.command(Command::Engage).state, RigState::Engaging);
    bench.missed_periods += 4;
    assert_eq!(bench.tick().fault, None);
    bench.missed_periods += 1;
    assert_eq!(bench.tick().fault, Some(Fault::TooLate));
}

/// Something that can happen to the loop between two ticks, or in one.
#[derive(Clone, Debug)]
enum Happening {
    Command(Command),
    Stop,
    Scene(usize),
    /// Over a time, s: in steps or, where the law is another, fading over.
    SlowScene(usize, f64),
    /// Leases lapse, or are taken anew.
    Lease {
        lapses: bool,
    },
    /// A reading, or none; and time that goes by, ns.
    Tick(Option<f64>, u64),
    Repeat,
    Error(DeviceError),
    /// The device's clock goes on by a time other than ours, ns; negative, it jumps back.
    DeviceClock(i64),
    Missed(u64),
    RefusedWrite,
    BusyLink,
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

fn happening() -> impl Strategy<Value = Happening> {
    let position = prop_oneof![
        20 => (-0.1..0.1f64).prop_map(Some),
        1 => Just(None),
        1 => prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(1e300), Just(-1e9), Just(f64::MIN_POSITIVE)].prop_map(Some),
    ];
    let tick = (
        position,
        prop_oneof![8 => Just(1_000_000_u64), 1 => 0..2_000_000_u64, 1 => 0..100_000_000_u64],
    );
    prop_oneof![
        2 => Just(Happening::Command(Command::Engage)),
        1 => Just(Happening::Command(Command::Release)),
        2 => Just(Happening::Command(Command::Reset)),
        1 => Just(Happening::Stop),
        2 => (0..8_usize).prop_map(Happening::Scene),
        2 => (0..8_usize, 0.002..0.05f64).prop_map(|(which, over_s)| Happening::SlowScene(which, over_s)),
        1 => any::<bool>().prop_map(|lapses| Happening::Lease { lapses }),
        30 => tick.prop_map(|(position, after_ns)| Happening::Tick(position, after_ns)),
        1 => Just(Happening::Repeat),
        1 => prop_oneof![
            Just(DeviceError::MotorOff { watchdog: true }),
            Just(DeviceError::MotorOff { watchdog: false }),
            Just(DeviceError::Failed(ErrorCode::Sensor.into())),
        ]
        .prop_map(Happening::Error),
        2 => prop_oneof![Just(0), -1_000_000_000..0_i64, 0..100_000_000_i64].prop_map(Happening::DeviceClock),
        1 => (1..4_u64).prop_map(Happening::Missed),
        1 => Just(Happening::RefusedWrite),
        1 => Just(Happening::BusyLink),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig { cases: test_run::extent(150, 1000), failure_persistence: None, ..ProptestConfig::default() })]

    /// Whatever is measured, commanded and changed: the force is a number within the limits, and
    /// zero where none may flow.
    // hazard: P2
    #[test]
    fn force_stays_within_its_limits_and_where_it_belongs(
        happenings in prop::collection::vec(happening(), 1..250),
        accelerations in prop::collection::vec(-150.0..150.0f64, 250),
        method in prop::sample::select(&METHODS[..]),
        ramp_s in 0.001..0.05f64,
    ) {
        let scenes = scenes();
        let slew_n_per_s = 1000.0;
        let settings = Settings {
            ramp_s,
            passivity_control_n: 3.0,
            velocity: method,
            ..slewed(slew_n_per_s)
        };
        let mut bench = bench_with(settings, []);
        let (mut position, mut velocity, mut revision, mut last) = (0.0, 0.0_f64, 1, 0.0_f64);
        let mut newest = Scene::paper();
        for (happening, acceleration) in happenings.into_iter().zip(accelerations) {
            // A hand that shakes as hard as one can, at no more than 2 m/s.
            velocity = (velocity + 1e-3 * acceleration).clamp(-2.0, 2.0);
            let step = 1e-3 * velocity;
            let (mut reading, mut after_ns, mut stopped) = (Ok(position), 1_000_000, false);
            let device = &mut *bench.tick.device;
            device.repeats = false;
            device.writing = Ok(Written::Taken);
            device.sample_ns = 1_000_000;
            match happening {
                Happening::Command(command) => {
                    bench.serial += 1;
                    bench.shared.send(bench.serial, command, bench.shared.stops());
                }
                Happening::Stop => {
                    bench.shared.stop();
                    stopped = true;
                }
                Happening::Scene(which) => {
                    revision += 1;
                    newest = scenes[which].clone();
                    bench.shared.scenes.post(compiled(&newest, revision));
                }
                Happening::SlowScene(which, over_s) => {
                    revision += 1;
                    let from = std::mem::replace(&mut newest, scenes[which].clone());
                    let way = Compiled::new(&from, &newest, Scheme::Exact, 1e-3, over_s).expect("both are valid");
                    bench.shared.scenes.post(way.into_scene(revision).0);
                }
                Happening::Lease { lapses } => bench.shared.lease_until(if lapses { 0 } else { u64::MAX }),
                // Mostly a hand that goes on, and now and then a leap to anywhere.
                Happening::Tick(Some(anywhere), ns) if !anywhere.is_finite() || anywhere.abs() > 0.09 => {
                    (reading, after_ns) = (Ok(anywhere), ns);
                }
                Happening::Tick(None, ns) => (reading, after_ns) = (Err(DeviceError::Disconnected), ns),
                Happening::Tick(Some(_), ns) => {
                    position += step;
                    (reading, after_ns) = (Ok(position), ns);
                }
                Happening::Repeat => device.repeats = device.next > 0,
                Happening::Error(error) => reading = Err(error),
                Happening::DeviceClock(ns) => {
                    position += step;
                    reading = Ok(position);
                    device.sample_ns = 0;
                    device.time_ns = device.time_ns.saturating_add_signed(ns);
                }
                Happening::Missed(periods) => bench.missed_periods += periods,
                Happening::RefusedWrite => device.writing = Err(DeviceError::Disconnected),
                Happening::BusyLink => device.writing = Ok(Written::Later),
            }
            let unreadable = !reading.is_ok_and(f64::is_finite);
            if !bench.tick.device.repeats {
                bench.tick.device.readings.push(reading);
            }
            let wrote_before = bench.written.lock().expect("one thread").len();
            let record = bench.tick_after(after_ns);
            bench.records.drop_retired();
            let force = record.command_force;
            prop_assert!(force.is_finite() && force.abs() <= MAX_FORCE, "{record:?}");
            prop_assert!(!stopped || force == 0.0, "a stop takes it away at once: {record:?}");
            prop_assert!(!unreadable || force == 0.0, "nothing is known of the hand: {record:?}");
            let most = slew_n_per_s * (after_ns as f64 * 1e-9).min(LONGEST_STEP_S) + 1e-9;
            prop_assert!(force.abs() - last.abs() <= most, "from {last} N to {force} N in {after_ns} ns");
            let written = bench.written.lock().expect("one thread").clone();
            if written.len() > wrote_before {
                prop_assert_eq!(*written.last().expect("a force"), force);
                let live = record.state.is_live() || force == 0.0;
                prop_assert!(live, "force without a live rig: {:?}", record);
            }
            last = force;
        }
    }
}
