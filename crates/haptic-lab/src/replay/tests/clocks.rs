//! Recordings of a device behind a link: its clock is not ours, and both jitter.

use super::session::{ReplayedSession, TickInput, drag, setup};
use crate::accuracy::laws;
use crate::replay::Report;
use fastrand::Rng;
use haptic_core::passivity::RigLosses;
use haptic_core::planar::Plane;
use haptic_core::sample::{DeviceError, Measurement};
use haptic_core::servo::{Command, Event};
use haptic_core::velocity::METHODS;
use haptic_core::{Rendering, Scene, Scheme, Vector};
use haptic_ipc::RigState;

/// How a link and its two ends keep time.
#[derive(Clone, Copy, Debug)]
struct Link {
    /// Period of the loop, ns.
    period_ns: u64,
    /// Period of the device's samples, ns.
    sample_ns: u64,
    /// Largest delay of a wake-up, as a share of the period, and the share of ticks that have one.
    late: (f64, f64),
    /// Largest error of the time between two samples, as a share of theirs, and the share that have one.
    jitter: (f64, f64),
    /// Share of samples that are lost.
    lost: f64,
    /// Share of ticks with which a silence begins, and the longest, ns.
    silent: (f64, u64),
    /// Share of ticks with which the device's clock begins to lie, for up to 0.7 s.
    lies: f64,
    /// Share of ticks with which the encoder slips by more than any hand can.
    slips: f64,
}

/// A wrong clock, of the device's time since it went wrong, µs.
type Lie = fn(u64) -> u64;

/// Ways in which it goes wrong: at half speed, too fast, standing still, a leap, two bytes, and backwards.
const LIES: [Lie; 6] = [
    |us| us / 2,
    |us| us + us / 5,
    |_| 0,
    |us| us + 60_000,
    |us| us & 0xffff,
    |us| (1 << 32) - us,
];

/// A device and the loop that reads it.
struct TestRig<V> {
    link: Link,
    rng: Rng,
    now_ns: u64,
    /// The next deadline of the loop.
    deadline_ns: u64,
    /// The next sample of the device, on our clock.
    due_ns: u64,
    silent_until_ns: u64,
    /// A wrong clock, since when on the device's, and until when on ours, ns.
    lie: Option<(Lie, u64, u64)>,
    /// The newest sample of the device, and the newest that came.
    taken: Measurement<V>,
    newest: Measurement<V>,
    hand: [f64; 3],
}

impl<V: Vector> TestRig<V> {
    fn new(link: Link, rng: Rng) -> Self {
        let mut rng = rng;
        let first = Measurement::new(rng.u32(..), rng.u64(0..1 << 40), V::ZERO);
        Self {
            link,
            now_ns: 0,
            deadline_ns: 0,
            due_ns: rng.u64(0..link.sample_ns),
            silent_until_ns: 0,
            lie: None,
            taken: first,
            newest: first,
            // Now and then it lies still.
            hand: [
                if rng.f64() < 0.8 { 0.005 + 0.03 * rng.f64() } else { 0.0 },
                3.0 + 16.0 * rng.f64(),
                rng.f64() - 0.5,
            ],
            rng,
        }
    }

    /// The time since the last tick, ns, and what the device says.
    #[expect(clippy::cast_sign_loss, reason = "times are not negative")]
    fn tick(&mut self) -> (u64, Measurement<V>) {
        let Link {
            period_ns,
            sample_ns,
            late,
            jitter,
            lost,
            silent,
            lies,
            slips,
        } = self.link;
        let rng = &mut self.rng;
        self.deadline_ns += period_ns;
        let mut now_ns = self.deadline_ns + rng.u64(0..period_ns / 100);
        if rng.f64() < late.1 {
            now_ns += (rng.f64() * late.0 * period_ns as f64) as u64;
        }
        let now_ns = now_ns.max(self.now_ns + period_ns / 50);
        if rng.f64() < silent.0 {
            self.silent_until_ns = now_ns + rng.u64(0..silent.1);
        }
        if rng.f64() < lies {
            let until_ns = now_ns + rng.u64(0..700_000_000);
            self.lie = Some((LIES[rng.usize(0..LIES.len())], self.taken.time_ns, until_ns));
        }
        if rng.f64() < slips {
            self.hand[2] = 0.5 - self.hand[2];
        }
        self.lie = self.lie.filter(|&(_, _, until_ns)| now_ns < until_ns);
        while self.due_ns <= now_ns {
            let mut step_ns = sample_ns;
            if rng.f64() < jitter.1 {
                step_ns = (sample_ns as f64 * (1.0 + jitter.0 * (2.0 * rng.f64() - 1.0))) as u64;
            }
            let at_s = self.due_ns as f64 * 1e-9;
            self.due_ns += step_ns.max(1000);
            // A microsecond is the device's unit of time.
            let time_ns = self.taken.time_ns + step_ns.max(1000) / 1000 * 1000;
            let [amplitude_m, omega, middle_m] = self.hand;
            let (sin, cos) = (omega * at_s).sin_cos();
            let [x_m, y_m] = [middle_m + amplitude_m * sin, amplitude_m * cos].map(|m| (m / 1e-5).round() * 1e-5);
            let position_m = V::of_axes(x_m, y_m);
            self.taken = Measurement::new(self.taken.sequence.wrapping_add(1), time_ns, position_m);
            if rng.f64() >= lost && now_ns >= self.silent_until_ns {
                self.newest = self.taken;
                if let Some((lie, since_ns, _)) = self.lie {
                    self.newest.time_ns = since_ns + lie((time_ns - since_ns) / 1000) * 1000;
                }
            }
        }
        let elapsed_ns = now_ns - std::mem::replace(&mut self.now_ns, now_ns);
        (elapsed_ns, self.newest)
    }
}

/// A session of a rig with scenes, stops, resets and unplugged cables, at random.
fn session<V: Vector>(seed: u64, link: Link) -> ReplayedSession<V> {
    let mut rng = Rng::with_seed(seed);
    let mut setup = setup();
    let settings = &mut setup.settings;
    settings.period_s = link.period_ns as f64 * 1e-9;
    settings.velocity = METHODS[rng.usize(0..METHODS.len())];
    if rng.bool() {
        settings.compensation = None;
    }
    if rng.bool() {
        settings.passivity_control_n = 0.0;
    }
    settings.limits.acceleration_mps2 = 1e5;
    setup.scheme = [Scheme::Exact, Scheme::Implicit][rng.usize(0..3 - V::AXES)];
    let paper_on_device = Scene {
        block: None,
        coupling: None,
        ..Scene::paper()
    };
    let mut scenes = vec![Scene::paper(), drag()];
    if V::AXES > 1 {
        scenes.push(paper_on_device);
    }
    for (_, friction) in laws() {
        let on_block = Scene {
            friction,
            ..Scene::paper()
        };
        let on_device = Scene {
            block: None,
            coupling: None,
            ..on_block.clone()
        };
        scenes.extend([on_block, on_device]);
    }
    scenes.retain(|scene| V::Renderer::new(scene, setup.scheme, setup.settings.period_s).is_ok());
    let scene = |rng: &mut Rng| scenes[rng.usize(0..scenes.len())].clone();
    let mut session = ReplayedSession::of(setup, scene(&mut rng));
    let mut rig = TestRig::new(link, rng.fork());
    let mut pause = rng.u32(150..900);
    for _ in 0..LENGTH {
        let measured = Some(rig.tick());
        let mut happening = TickInput {
            measured,
            ..TickInput::default()
        };
        pause = pause.saturating_sub(1);
        if pause == 0 {
            pause = rng.u32(1..900);
            match (session.state(), rng.u32(0..8)) {
                (RigState::Idle, 0) => {
                    let losses = RigLosses {
                        damping: rng.f64(),
                        friction: 0.1 * rng.f64(),
                    };
                    let compensation = super::session::setup().settings.compensation;
                    session.set_rig(losses, compensation.filter(|_| rng.bool()));
                    happening.command = Some(Command::Engage);
                }
                (RigState::Idle, _) => happening.command = Some(Command::Engage),
                (RigState::Stopped | RigState::Faulted, _) => happening.command = Some(Command::Reset),
                (_, 0) => happening.events = Event::Stop.into(),
                (_, 1) => happening.error = Some(DeviceError::Disconnected),
                (_, 2) => happening.write_failed = true,
                (_, 3) => happening.command = Some(Command::Release),
                (_, 4) => happening.events = Event::LeaseLapsed.into(),
                _ => happening.scene = Some((scene(&mut rng), 0.2 * rng.f64())),
            }
        }
        session.tick(happening);
    }
    session
}

const LENGTH: u32 = 6000;

/// What can go wrong alone goes wrong together with the rest.
fn links() -> [(&'static str, Link); 9] {
    type Change = fn(&mut Link);
    let changes: [(&str, Change); 9] = [
        ("steady", |_| {}),
        ("its clock is fast", |link| link.sample_ns = 985_000),
        ("all of it", |link| {
            (link.silent, link.lost) = ((0.003, 12_000_000), 0.05);
            (link.late, link.jitter) = ((4.0, 0.2), (0.9, 0.3));
        }),
        ("a slow device", |link| {
            (link.sample_ns, link.jitter, link.late) = (5_000_000, (0.5, 0.2), (2.0, 0.1));
        }),
        ("a fast loop", |link| {
            (link.period_ns, link.jitter, link.late) = (250_000, (0.9, 0.3), (6.0, 0.2));
        }),
        ("a fast device", |link| {
            (link.sample_ns, link.jitter, link.late) = (100_000, (0.9, 0.3), (2.0, 0.2));
        }),
        ("a clock that lies and long silences", |link| {
            (link.lies, link.silent, link.lost) = (0.001, (0.003, 150_000_000), 0.01);
            (link.late, link.jitter) = ((3.0, 0.1), (0.2, 0.3));
        }),
        ("a starved loop", |link| link.late = (60.0, 0.03)),
        ("a clock that lies and an encoder that slips", |link| {
            (link.lies, link.slips, link.late) = (0.001, 0.003, (1.0, 0.1));
        }),
    ];
    changes.map(|(name, change)| {
        let mut link = Link {
            period_ns: 1_000_000,
            sample_ns: 1_000_000,
            late: (0.0, 0.0),
            jitter: (0.0, 0.0),
            lost: 0.0,
            silent: (0.0, 1),
            lies: 0.0,
            slips: 0.0,
        };
        change(&mut link);
        (name, link)
    })
}

#[test]
fn a_replay_differs_nowhere_however_the_clocks_jitter() {
    differs_nowhere::<f64>(test_run::extent(5, 200));
    differs_nowhere::<Plane>(test_run::extent(2, 60));
}

fn differs_nowhere<V: Vector>(seeds: u64) {
    for (name, link) in links() {
        let mut with_force = 0;
        for seed in 0..seeds {
            let session = session::<V>(seed, link);
            let mut rng = Rng::with_seed(seed);
            let is_same = |report: &Report, begun: &str| {
                assert_eq!(
                    (report.differing, &report.first_differing),
                    (0, &None),
                    "{name}, seed {seed}, {begun}: {report:?}"
                );
            };
            // One snapshot at the beginning, or more of them: all of it is compared.
            for every in [usize::MAX, rng.usize(1..20)] {
                let report = session.replayed_from(rng.usize(..session.snapshots.len()), every);
                is_same(&report, "begun at a snapshot");
                assert_eq!(report.not_compared, 0, "{name}, seed {seed}: {report:?}");
                with_force += report.with_force;
            }
            let anywhere = rng.usize(..session.entries.len() / 2);
            for first in [seed as usize * 7 % 140, anywhere] {
                is_same(&session.replayed(first), "without a snapshot");
            }
        }
        assert!(with_force > 0, "{name}: no force flows from a snapshot on");
    }
}
