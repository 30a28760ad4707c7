//! What a whole tick costs, in instructions, and what its parts cost by themselves: the processor's trap flag
//! counts them, deaf to whatever else the machine does.

use super::stall_tests::{Bench, compiled, extent, in_a_child, instructions_of, renderer};
use crate::rt::clock::now_ns;
use crate::rt::outbox;
use crate::rt::tick::tests::servo;
use crate::self_test::NoLink;
use device_io::Device;
use haptic_core::Renderer;
use haptic_core::limiter::SafetyLimiter;
use haptic_core::passivity::PassivityObserver;
use haptic_core::position_guard::{Motion, PositionGuard};
use haptic_core::sample_clock::{SampleClock, Stamp};
use haptic_core::servo::{Command, Events, Inputs, Servo};
use haptic_core::velocity::Estimator;
use std::hint::black_box;
use std::sync::atomic::Ordering::SeqCst;

/// Instructions of a whole tick on the paper's scene: its median, and its most, which has a change of
/// contact in it. Without those of the test's own device and of the counting. The first of the two is for the
/// profile of the tests, which does not optimise the daemon, with a tenth on top; .ci/full tests the second with
/// `--release`. What the median took when this was written is in docs/measured.md.
const TICK_BUDGET: (u64, u64) = if cfg!(debug_assertions) {
    (5100, 5870)
} else {
    (1500, 3500)
};

/// What of a tick is counted by itself as well, the test's own first.
const PARTS: [&str; 11] = [
    "nothing: the counting",
    "the test's device: read, connection, write",
    "device clock held against ours",
    "position guard",
    "velocity",
    "scene (physics)",
    "limiter",
    "passivity",
    "reading the clock",
    "record for the control thread",
    "the servo's whole step",
];

/// Instructions of each of the [`PARTS`] in one tick.
type Parts = [u64; PARTS.len()];

/// The parts of ticks on the paper's scene by themselves, through the same motion.
struct Apart {
    device: Box<dyn Device>,
    clock: SampleClock,
    guard: PositionGuard,
    estimator: Estimator,
    renderer: Renderer,
    limiter: SafetyLimiter,
    passivity: PassivityObserver,
    records: (outbox::Producer, outbox::Consumer),
    servo: Servo,
    /// What the servo is asked for in its first step.
    command: Option<Command>,
    position: f64,
    velocity: f64,
    host_ns: u64,
}

impl Apart {
    fn new(device: Box<dyn Device>, renderer: Renderer) -> Self {
        let servo = servo(0.001, compiled(&renderer, 1));
        let settings = *servo.settings();
        Self {
            device,
            clock: SampleClock::new(settings.stale_ns),
            guard: PositionGuard::default(),
            estimator: Estimator::new(settings.velocity, settings.period_s, 0.0),
            renderer,
            limiter: SafetyLimiter::new(settings.limits),
            passivity: PassivityObserver::new(settings.losses, settings.passivity_control_n),
            records: outbox::outbox(outbox::RECORDS),
            servo,
            command: Some(Command::Engage),
            position: 0.0,
            velocity: 0.0,
            host_ns: 1_000_000_000,
        }
    }

    /// One tick, of which each part is run by `counted`.
    fn tick(&mut self, counted: impl Fn(&mut dyn FnMut()) -> u64) -> Parts {
        self.host_ns += 1_000_000;
        let (host_ns, mut sample, mut elapsed, mut force) = (self.host_ns, None, Ok(0.0), 0.0);
        let before = Motion {
            felt: 0.15e-3,
            position: self.position,
            velocity: self.velocity,
            seen_over_s: 1e-3,
            resolution: 0.0,
        };
        let nothing = counted(&mut || ());
        let device = counted(&mut || {
            sample = self.device.read(host_ns).ok();
            black_box(self.device.bounds());
            black_box(self.device.write(force, true)).expect("it takes it");
        });
        let sample = sample.expect("it is there");
        let clock = counted(&mut || {
            elapsed = self.clock.elapsed_s(Stamp {
                sequence: sample.sequence,
                device_ns: sample.time_ns,
                host_ns,
            });
        });
        let elapsed_s = elapsed.expect("an honest clock");
        let guard = counted(&mut || {
            black_box(self.guard.judge(before, sample.position_m, elapsed_s, &self.limiter));
        });
        self.position = sample.position_m;
        let velocity = counted(&mut || self.velocity = self.estimator.update(elapsed_s, sample.position_m));
        let scene = counted(&mut || {
            force = self
                .renderer
                .tick(elapsed_s, self.position, self.velocity)
                .coupling_force;
        });
        let limiter = counted(&mut || {
            force = self.limiter.limit(-force, black_box(1.0), elapsed_s).unwrap_or(0.0);
        });
        let passivity = counted(&mut || {
            black_box(self.passivity.observe(elapsed_s, self.position, self.velocity, force));
        });
        let reading = counted(&mut || {
            black_box(now_ns());
        });
        let mut left = outbox::tests::record(host_ns);
        left.device_position = self.position;
        let record = counted(&mut || self.records.0.push(None, || left));
        while self.records.1.pop().is_some() {}
        let inputs = Inputs {
            elapsed_ns: 1_000_000,
            sample: Ok(sample),
            device_resolution_m: self.device.bounds().resolution_m,
            device_force_limit_n: f64::INFINITY,
            events: Events::default(),
            command: self.command.take(),
        };
        let mut is_live = false;
        let step = counted(&mut || is_live = self.servo.step(black_box(&inputs), None).enabled);
        assert!(is_live, "the servo renders");
        [
            nothing, device, clock, guard, velocity, scene, limiter, passivity, reading, record, step,
        ]
    }
}

fn median(mut counts: Vec<u64>) -> u64 {
    counts.sort_unstable();
    counts[counts.len() / 2]
}

#[test]
fn whole_tick_on_the_papers_scene_keeps_its_budget() {
    let no_link = || Box::new(NoLink::new(1_000_000));
    // Some of the ticks of two strokes: a trap costs microseconds.
    let (ticks, counted) = (4000, extent(10, 500));
    let report = in_a_child(|report| {
        // The loop's own queue: a short one would be full before every tick that is counted.
        let mut bench = Bench::on(no_link(), &renderer(), outbox::RECORDS);
        let counts: Vec<u64> = (0..counted)
            .map(|_| {
                bench.ticks(ticks / counted - 1);
                while bench.control.records.pop().is_some() {}
                instructions_of(|| bench.ticks(1))
            })
            .collect();
        report.worst.store(counts.iter().copied().max().unwrap_or(0), SeqCst);
        report.steps.store(median(counts), SeqCst);
        let mut apart = Apart::new(no_link(), renderer());
        let parts: Vec<Parts> = (0..counted)
            .map(|_| {
                for _ in 1..ticks / counted {
                    apart.tick(|part| {
                        part();
                        0
                    });
                }
                apart.tick(|part| instructions_of(part))
            })
            .collect();
        for (index, part) in report.parts.iter().enumerate() {
            part.store(median(parts.iter().map(|parts| parts[index]).collect()), SeqCst);
        }
    });
    let [counting, parts @ ..] = report.parts.each_ref().map(|part| part.load(SeqCst));
    let own = parts[0];
    let (median, most) = (report.steps.load(SeqCst) - own, report.worst.load(SeqCst) - own);
    println!("{median} instructions a tick (median), {most} at most, without {own} of the test's own; of these:");
    let net = parts.map(|part| part.saturating_sub(counting));
    let [_, of_step @ .., reading, record, step] = net;
    for (name, part) in PARTS.into_iter().skip(2).zip(&net[1..net.len() - 1]) {
        println!("{part:6} {name}");
    }
    let rest_of_step = step.saturating_sub(of_step.iter().sum());
    println!("{rest_of_step:6} events, rig, buttons, ramps, transitions: the rest of the servo's step");
    let rest = median.saturating_sub(step + reading + record);
    println!("{rest:6} stops, commands, scenes, schedule, lateness, leases, answers: the rest of the loop");
    assert!(median > 200, "nothing was rendered");
    assert!(median <= TICK_BUDGET.0 && most <= TICK_BUDGET.1, "{median}, {most}");
}
