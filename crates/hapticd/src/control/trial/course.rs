//! One course of a trial: a hand, a tap, and the second after it.

use super::{LIGHT_RIG_KG, MAX_JUMPS_PER_S, MAX_SIGN_CHANGES_PER_S, Trial, TrialHand};
use device_io::Device;
use device_io::fake::{FakeRig, Hand, HandMotion, RigProperties};
use haptic_core::compensation::Compensation;
use haptic_core::limiter::Limits;
use haptic_core::sample::Measurement;
use haptic_core::servo::{Command, CompiledScene, Events, Inputs, Servo, Settings};
use haptic_core::{Directional, Renderer, Scheme};
use haptic_ipc::UNKNOWN_MASS_KG;
use std::collections::VecDeque;

/// Time that is judged, s.
const JUDGED_S: f64 = 1.0;

/// Time from a tap after which a rig that nobody moves is to rest, s, and the changes of sign from then on that show
/// that it does not: a late link lets a loop swing slowly, with all its force.
const RESTS_AFTER_S: f64 = 0.5;
const MAX_LATE_SIGN_CHANGES: u32 = 2;

/// Least time without force before it, s, and in samples of the device: the servo gets to know its clock.
const SETTLING: (f64, f64) = (0.05, 30.0);

/// Time in which force comes, s: what it is like along the ramp is felt in any case.
const RAMP_S: f64 = 0.02;

/// Speed that a tap gives the handle, m/s: that of an easy reach. Friction alone brings a light rig to rest from a
/// quarter of it, though it chatters for ever from half of it.
const TAP_MPS: f64 = 0.2;

/// Duration of a tap, s.
const TAP_S: f64 = 0.01;

/// Time in which a rig must be still to be at rest, s, beside its delay and some of its samples.
const REST_S: f64 = 0.05;

/// What is still: a change of force from tick to tick, as a share of the rig's limit, and a speed, m/s.
const STILL: (f64, f64) = (1e-4, 1e-5);

/// Share of the rig's limit beyond which a force counts as one.
const FELT_SHARE: f64 = 0.1;

/// Longest delay, and longest time between two samples, that are tried, s: longer ones are no better.
const MAX_DELAY_S: f64 = 0.5;

/// Stiffness (N/m) and damping (N s/m) of a hand that holds a handle: of fingers and relaxed hands some hundred N/m and
/// a few N s/m were measured (Hajian and Howe 1997; Kuchenbecker, Park and Niemeyer 2003). A firmer grip damps more,
/// and the mass of a hand, which calms too, is left out.
const ARM: (f64, f64) = (500.0, 4.0);

/// Least half stroke of a hand that moves, m, and its turns a second, Hz: up to 38 mm/s.
const SLOW_MOTION: (f64, f64) = (6e-3, 1.0);

/// How much farther a hand moves than to where the block breaks away: a loop that holds still with a block at rest may
/// swing while it slides.
const BEYOND_BREAKAWAY: f64 = 1.5;

/// What a trial needs to know of a rig and of the loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::control) struct TrialRig {
    /// Settings of the loop's servo, with what is compensated of the rig's friction.
    pub(in crate::control) settings: Settings,
    pub(in crate::control) scheme: Scheme,
    /// The largest force that the rig is sent, N.
    pub(in crate::control) force_limit_n: f64,
    /// Time between two samples of the device, s; 0 where it measures whenever it is read.
    pub(in crate::control) sample_period_s: f64,
    /// From a sample to the motor that gives the force for it, s.
    pub(in crate::control) delay_s: f64,
    /// One count of the encoder, m; 0 for a perfect one.
    pub(in crate::control) resolution_m: f64,
    /// Mass of the moving part, kg.
    pub(in crate::control) mass_kg: f64,
    /// Coulomb friction of the rig itself, N.
    pub(in crate::control) friction_n: Directional,
    /// Viscous damping of the rig itself, N s/m.
    pub(in crate::control) damping_ns_per_m: f64,
}

impl TrialRig {
    /// It with masses among which its own is, where that is not known: a grip that is stable at both ends is in between,
    /// and a trial is worst at an end or at that of a light rig.
    pub(in crate::control) fn of_every_mass(self) -> [Self; 3] {
        let [lightest_kg, heaviest_kg] = UNKNOWN_MASS_KG;
        [lightest_kg, LIGHT_RIG_KG, heaviest_kg].map(|mass_kg| Self { mass_kg, ..self })
    }

    /// Whether it is its own mirror image.
    pub(super) fn is_symmetric(&self) -> bool {
        self.friction_n.is_symmetric()
            && self.settings.compensation.is_none_or(|Compensation { friction, .. }| {
                friction.dynamic_force.is_symmetric() && friction.viscous.is_symmetric() && friction.cogging.is_none()
            })
    }

    /// Half the stroke of a hand that moves, m: a block that a force within the rig's limit breaks away, N, does so.
    pub(super) fn stroke_m(&self, static_force_n: f64) -> f64 {
        if static_force_n >= self.force_limit_n {
            return SLOW_MOTION.0;
        }
        SLOW_MOTION
            .0
            .max(BEYOND_BREAKAWAY * (static_force_n + self.friction_n.greatest()) / ARM.0)
    }

    fn in_process(&self, hand: TrialHand, stroke_m: f64) -> FakeRig {
        let properties = RigProperties {
            mass_kg: self.mass_kg,
            friction_n: self.friction_n.positive,
            negative_friction_n: Some(self.friction_n.negative),
            damping_ns_per_m: self.damping_ns_per_m,
            resolution_m: self.resolution_m,
            ..RigProperties::default()
        };
        let (stiffness_n_per_m, damping_ns_per_m) = ARM;
        let arm = |amplitude_m, frequency_hz| Hand::Arm {
            stiffness_n_per_m,
            damping_ns_per_m,
            motion: HandMotion::Sine {
                amplitude_m,
                frequency_hz,
            },
        };
        let hand = match hand {
            TrialHand::Absent => Hand::Free,
            TrialHand::Holding => arm(0.0, 0.0),
            TrialHand::Moving => arm(stroke_m, SLOW_MOTION.1),
        };
        FakeRig::new(properties, hand)
    }

    fn servo(&self, renderer: Renderer) -> Servo {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a few sample periods, ns"
        )]
        let slow_ns = (3.0 * self.sample_period_s * 1e9) as u64;
        let settings = Settings {
            ramp_s: RAMP_S,
            // A tap may be faster than a rig allows; a loop that runs away changes sign, too.
            limits: Limits {
                speed_mps: f64::MAX,
                ..self.settings.limits
            },
            // Nobody presses one here.
            stop_button: None,
            enable_button: None,
            workspace: None,
            stale_ns: self.settings.stale_ns.max(slow_ns),
            ..self.settings
        };
        Servo::new(settings, Box::new(CompiledScene::at_once(renderer, 1)))
    }
}

/// The path of forces to the motor: whole periods and a rest.
struct DelayedForce {
    waiting: VecDeque<f64>,
    rest_ns: u64,
}

impl DelayedForce {
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most some ten thousand periods"
    )]
    fn new(delay_s: f64, period_s: f64) -> Self {
        let delay_s = delay_s.clamp(0.0, MAX_DELAY_S);
        let periods = (delay_s / period_s).floor();
        Self {
            waiting: VecDeque::from(vec![0.0; periods as usize + 1]),
            rest_ns: ((delay_s - periods * period_s) * 1e9).round() as u64,
        }
    }

    /// Sends a force, N; returns that which the motor gives for the rest, and that which it gives from then on.
    fn send(&mut self, force_n: f64) -> [f64; 2] {
        self.waiting.push_back(force_n);
        let old_n = self.waiting.pop_front().unwrap_or(force_n);
        [old_n, self.waiting.front().copied().unwrap_or(force_n)]
    }
}

/// Counts what a motor is sent.
#[derive(Default)]
struct Count {
    limit_n: f64,
    /// The tick from which on a rig that nobody moves is to rest.
    rests_from: u32,
    /// The force that last exceeded a tenth of the limit, N.
    last_n: f64,
    sign_changes: u32,
    late_sign_changes: u32,
    /// The force of the tick before, N.
    before_n: f64,
    jumps: u32,
    at_limit: u32,
    greatest_force_n: f64,
    ticks: u32,
}

impl Count {
    /// A number so far as one a second.
    fn per_s(&self, number: u32, period_s: f64) -> f64 {
        f64::from(number) / (f64::from(self.ticks.max(1)) * period_s)
    }

    fn add(&mut self, force_n: f64) {
        self.ticks += 1;
        self.greatest_force_n = self.greatest_force_n.max(force_n.abs());
        let jump_n = (force_n - std::mem::replace(&mut self.before_n, force_n)).abs();
        self.jumps += u32::from(jump_n > FELT_SHARE * self.limit_n);
        self.at_limit += u32::from(force_n.abs() >= self.limit_n && self.limit_n > 0.0);
        if force_n.abs() > FELT_SHARE * self.limit_n {
            let has_changed = u32::from(self.last_n * force_n < 0.0);
            self.sign_changes += has_changed;
            if self.ticks > self.rests_from {
                self.late_sign_changes += has_changed;
            }
            self.last_n = force_n;
        }
    }
}

/// Whether a rig that nobody moves rests, with a force that stays.
#[derive(Default)]
struct Rest {
    limit_n: f64,
    last_n: f64,
    ticks: u32,
    least_ticks: u32,
}

impl Rest {
    fn add(&mut self, force_n: f64, velocity_mps: f64) {
        let stays = (force_n - self.last_n).abs() <= STILL.0 * self.limit_n && velocity_mps.abs() <= STILL.1;
        self.ticks = if stays { self.ticks + 1 } else { 0 };
        self.last_n = force_n;
    }

    fn lasts(&self) -> bool {
        self.ticks >= self.least_ticks
    }
}

/// The course of a trial with a hand, to and fro by `stroke_m` if it moves; mirrored where that is negative. Where only
/// the verdict is wanted (`brief`), it ends as soon as that is known.
pub(super) fn course(renderer: Renderer, rig: &TrialRig, hand: TrialHand, stroke_m: f64, brief: bool) -> Trial {
    let side = stroke_m.signum();
    let period_s = rig.settings.period_s;
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a few seconds of ticks, and a period in ns"
    )]
    let (ticks_in, period_ns) = (
        |time_s: f64| (time_s / period_s).ceil() as u32,
        (period_s * 1e9).round() as u64,
    );
    let sample_period_s = rig.sample_period_s.min(MAX_DELAY_S);
    let engaged_at = ticks_in(SETTLING.0.max(SETTLING.1 * sample_period_s));
    let tapped_at = engaged_at + ticks_in(RAMP_S) + 1;
    let tapped_until = tapped_at + ticks_in(TAP_S);
    let ends_at = tapped_at + ticks_in(JUDGED_S);
    let tap_s = f64::from(tapped_until - tapped_at) * period_s;
    let friction_n = if side > 0.0 {
        rig.friction_n.positive
    } else {
        rig.friction_n.negative
    };
    let tap_n = side * (rig.mass_kg * TAP_MPS / tap_s + friction_n);

    let (mut servo, mut device) = (rig.servo(renderer), rig.in_process(hand, stroke_m));
    let mut line = DelayedForce::new(rig.delay_s, period_s);
    let limit_n = rig.force_limit_n;
    let mut count = Count {
        limit_n,
        rests_from: ticks_in(RESTS_AFTER_S),
        ..Count::default()
    };
    let mut rest = Rest {
        limit_n,
        least_ticks: ticks_in(REST_S + 2.0 * rig.delay_s + SETTLING.1 * sample_period_s),
        ..Rest::default()
    };
    let mut sample = Measurement::new(0, 0, device.plant().position_m());
    for tick in 0..ends_at {
        let (now_s, now_ns) = (f64::from(tick) * period_s, u64::from(tick) * period_ns);
        if now_s + 0.5 * period_s >= f64::from(sample.sequence) * sample_period_s {
            sample = device.read(now_ns).unwrap_or(sample);
        }
        let inputs = Inputs {
            elapsed_ns: if tick == 0 { 0 } else { period_ns },
            sample: Ok(sample),
            device_resolution_m: rig.resolution_m,
            device_force_limit_n: rig.force_limit_n,
            events: Events::default(),
            command: (tick == engaged_at).then_some(Command::Engage),
        };
        let outputs = servo.step(&inputs, None);
        let force_n = if outputs.enabled { outputs.force_n } else { 0.0 };
        if tick >= tapped_at {
            count.add(force_n);
        }
        if servo.fault().is_some() {
            break;
        }
        let hit_n = if (tapped_at..tapped_until).contains(&tick) {
            tap_n
        } else {
            0.0
        };
        let is_over = f64::from(count.sign_changes) > MAX_SIGN_CHANGES_PER_S * JUDGED_S
            || f64::from(count.jumps) > MAX_JUMPS_PER_S * JUDGED_S;
        if brief && is_over {
            break;
        }
        if hand != TrialHand::Moving && tick >= tapped_until {
            rest.add(force_n, device.plant().velocity_mps());
            if rest.lasts() {
                // Nothing comes any more.
                count.ticks = ticks_in(JUDGED_S);
                break;
            }
        }
        let [old_n, new_n] = line.send(force_n);
        device.drive(old_n + hit_n);
        device.live_until(now_ns + line.rest_ns);
        device.drive(new_n + hit_n);
        device.live_until(now_ns + period_ns);
    }
    let judged = f64::from(count.ticks.max(1));
    Trial {
        hand,
        sign_changes_per_s: count.per_s(count.sign_changes, period_s),
        jumps_per_s: count.per_s(count.jumps, period_s),
        share_at_limit: f64::from(count.at_limit) / judged,
        greatest_force_n: count.greatest_force_n,
        rests: hand == TrialHand::Moving || count.late_sign_changes < MAX_LATE_SIGN_CHANGES,
        fault: servo.fault(),
    }
}
