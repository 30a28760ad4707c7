//! The true motion under Karnopp's law, by a method that shares nothing with the exact tick.
//!
//! Between samples the device's `K p + B v` is linear, as the exact scheme has it. The block's
//! equation is integrated by its Taylor series in short steps, in double-double arithmetic (31
//! digits); a step in which the contact changes is halved until the change is found. There are no
//! closed forms, no roots of the characteristic polynomial and no extremum formulas here, so a
//! mistake in those cannot hide. It is slow: a tick takes from microseconds to milliseconds.

use crate::motion::DeviceSample;
use crate::simulate::{ContactChange, SimulatedRow, Simulation, Start};
use haptic_core::block::Contact;
use haptic_core::friction::Karnopp;
use haptic_core::scene::Coupling;
use haptic_core::{Direction, Directional};
use twofloat::TwoFloat;

/// Terms of the series: with `max(omega, 2 sigma) h <= 1/4` the last is below 1e-33 of the first.
const TERMS: usize = 26;
/// Largest `max(omega, 2 sigma) h` of a step.
const STEP: f64 = 0.25;
/// Halvings that find a change of contact to the last digit.
const HALVINGS: usize = 120;

/// Shorter times, s, count as zero: rounding in the net force at a breakaway lasts this long.
const NO_TIME_S: f64 = 1e-14;

struct Block {
    mass: TwoFloat,
    stiffness: TwoFloat,
    damping: TwoFloat,
    breakaway: Directional,
    dynamic_force: Directional,
    viscous: Directional,
    threshold: f64,
    /// Longest step, s.
    step_s: f64,
}

/// Where the block is, and how it touches the surface.
#[derive(Clone, Copy)]
struct State {
    x: TwoFloat,
    w: TwoFloat,
    contact: Contact,
    armed: bool,
}

/// `K p + B v` as a straight line, from the start of a tick.
struct Drive {
    at_start: TwoFloat,
    slope: TwoFloat,
}

impl Drive {
    fn at(&self, t: TwoFloat) -> TwoFloat {
        self.at_start + self.slope * t
    }
}

fn exact(value: f64) -> TwoFloat {
    TwoFloat::from(value)
}

/// Taylor coefficients of the displacement of a slide: `y = sum c_n t^n`.
struct Series([TwoFloat; TERMS]);

impl Series {
    fn displacement(&self, t: TwoFloat) -> TwoFloat {
        self.0.iter().rev().fold(exact(0.0), |sum, &c| sum * t + c)
    }

    fn velocity(&self, t: TwoFloat) -> TwoFloat {
        (1..TERMS)
            .rev()
            .fold(exact(0.0), |sum, n| sum * t + self.0[n] * n as f64)
    }

    fn acceleration(&self, t: TwoFloat) -> TwoFloat {
        (2..TERMS)
            .rev()
            .fold(exact(0.0), |sum, n| sum * t + self.0[n] * (n * (n - 1)) as f64)
    }
}

impl Block {
    fn new(mass: f64, coupling: &Coupling, law: &Karnopp) -> Self {
        let two_sigma = (coupling.damping + law.viscous.greatest()) / mass;
        let fastest = two_sigma.max((coupling.stiffness / mass).sqrt());
        Self {
            mass: exact(mass),
            stiffness: exact(coupling.stiffness),
            damping: exact(coupling.damping),
            breakaway: law.breakaway_force(),
            dynamic_force: law.dynamic_force,
            viscous: law.viscous,
            threshold: law.velocity_threshold,
            step_s: STEP / fastest,
        }
    }

    fn frictionless(&self) -> bool {
        self.breakaway == Directional::both(0.0)
    }

    /// The series of a slide from a state, at a time of the tick. `M y'' = drive - K (x + y) - (B +
    /// b) y' - s Fd`.
    fn series(&self, state: &State, drive: &Drive, t: TwoFloat, direction: Direction) -> Series {
        let damping = self.damping + exact(self.viscous.get(direction));
        let force =
            drive.at(t) - self.stiffness * state.x - exact(direction.sign() * self.dynamic_force.get(direction));
        let mut c = [exact(0.0); TERMS];
        c[1] = state.w;
        for n in 0..TERMS - 2 {
            let mut right = -(self.stiffness * c[n]) - damping * c[n + 1] * (n + 1) as f64;
            match n {
                0 => right += force,
                1 => right += drive.slope,
                _ => {}
            }
            c[n + 2] = right / self.mass / (((n + 1) * (n + 2)) as f64);
        }
        Series(c)
    }

    /// Integrates one tick; reports each change of contact and its time.
    fn tick(
        &self,
        state: &mut State,
        drive: &Drive,
        elapsed_s: TwoFloat,
        mut changed: impl FnMut(TwoFloat, Contact, Contact),
    ) {
        let mut t = exact(0.0);
        while t < elapsed_s {
            let before = state.contact;
            match before {
                Contact::Stuck => match self.breakaway_time(state, drive, t) {
                    Some((at, direction)) if at < elapsed_s => {
                        t = at;
                        state.contact = Contact::Sliding(direction);
                        state.armed = false;
                    }
                    _ => return,
                },
                Contact::Sliding(direction) => {
                    let step = exact(self.step_s).min(elapsed_s - t);
                    self.slide(state, drive, &mut t, step, direction);
                }
            }
            if before != state.contact {
                changed(t, before, state.contact);
            }
        }
    }

    /// Within this a force equals a limit: a hundred units in the last place of what it is the
    /// difference of.
    fn rounding(&self, state: &State, drive: &Drive, t: TwoFloat) -> TwoFloat {
        (drive.at(t).abs() + (self.stiffness * state.x).abs()) * 1e-29
    }

    fn breakaway_time(&self, state: &State, drive: &Drive, t: TwoFloat) -> Option<(TwoFloat, Direction)> {
        let force = drive.at(t) - self.stiffness * state.x;
        let pulled = Direction::of(f64::from(force));
        if force.abs() > exact(self.breakaway.get(pulled)) + self.rounding(state, drive, t) {
            return Some((t, pulled));
        }
        if drive.slope == exact(0.0) {
            return None;
        }
        let towards = Direction::of(f64::from(drive.slope));
        let limit = exact(towards.sign() * self.breakaway.get(towards));
        Some((t + ((limit - force) / drive.slope).max(exact(0.0)), towards))
    }

    /// One step of a slide, cut short where it falls to its re-stick level.
    fn slide(&self, state: &mut State, drive: &Drive, t: &mut TwoFloat, step: TwoFloat, direction: Direction) {
        let sign = direction.sign();
        let series = self.series(state, drive, *t, direction);
        let speed = |at: TwoFloat| series.velocity(at) * sign;
        // A quarter of a radian holds one extremum at most: the step is one monotone piece, or two.
        let slope = |at: TwoFloat| f64::from(series.acceleration(at) * sign);
        let mut pieces = vec![exact(0.0)];
        if slope(exact(0.0)) * slope(step) < 0.0 {
            let rising = slope(exact(0.0)) > 0.0;
            pieces.push(bisect(exact(0.0), step, |at| (slope(at) > 0.0) == rising));
        }
        pieces.push(step);
        let mut fall = None;
        let mut armed = state.armed;
        for piece in pieces.windows(2) {
            let (begin, end) = (speed(piece[0]), speed(piece[1]));
            if end > begin {
                armed |= end > exact(self.threshold);
                continue;
            }
            let level = if armed { exact(self.threshold) } else { exact(0.0) };
            // A slide that sets off with no net force may dip by rounding before it moves.
            let setting_off = begin == exact(0.0) && piece[1] < exact(NO_TIME_S);
            let resting = begin == exact(0.0) && end == exact(0.0);
            if end <= level && !resting && !setting_off {
                fall = Some((bisect(piece[0], piece[1], |at| speed(at) > level), armed));
                break;
            }
        }
        let Some((at, was_armed)) = fall else {
            state.x += series.displacement(step);
            state.w = series.velocity(step);
            state.armed = armed;
            *t += step;
            return;
        };
        state.x += series.displacement(at);
        *t += at;
        let force = drive.at(*t) - self.stiffness * state.x;
        let limit = exact(self.breakaway.get(Direction::of(f64::from(force))));
        let rounding = self.rounding(state, drive, *t);
        if force.abs() <= limit + rounding && !(self.frictionless() && drive.slope != exact(0.0)) {
            state.contact = Contact::Stuck;
            state.w = exact(0.0);
        } else if was_armed && self.threshold > 0.0 {
            state.w = exact(sign * self.threshold);
        } else {
            state.w = exact(0.0);
            let pull = if force.abs() <= rounding { drive.slope } else { force };
            state.contact = Contact::Sliding(Direction::of(f64::from(pull)));
        }
        state.armed = false;
    }
}

/// The end of the part of an interval on which `holds`, which it does from the start on.
fn bisect(from: TwoFloat, to: TwoFloat, holds: impl Fn(TwoFloat) -> bool) -> TwoFloat {
    let (mut low, mut high) = (from, to);
    for _ in 0..HALVINGS {
        let middle = (low + high) * 0.5;
        if middle <= low || middle >= high {
            break;
        }
        if holds(middle) {
            low = middle;
        } else {
            high = middle;
        }
    }
    high
}

/// The true motion of the block, rounded once at the end.
///
/// Its cost grows with `max(omega, 2 sigma) T`: a block of a milligram is a matter of patience.
pub(super) fn solve(
    mass: f64,
    coupling: &Coupling,
    law: &Karnopp,
    motion: &[DeviceSample],
    start: Start,
) -> Simulation {
    let block = Block::new(mass, coupling, law);
    let (mut rows, mut events) = (Vec::with_capacity(motion.len()), Vec::new());
    let first = motion.first().copied().unwrap_or_default();
    let mut state = State {
        x: exact(start.position_m.unwrap_or(first.position_m)),
        w: exact(start.velocity_mps),
        contact: match start.velocity_mps {
            0.0 if block.frictionless() => Contact::Sliding(Direction::Positive),
            0.0 => Contact::Stuck,
            velocity => Contact::Sliding(Direction::of(velocity)),
        },
        armed: false,
    };
    let mut last = first;
    for sample in motion {
        let elapsed_s = sample.t_s - last.t_s;
        if elapsed_s > 0.0 {
            let pull = |sample: &DeviceSample| {
                block.stiffness * exact(sample.position_m) + block.damping * exact(sample.velocity_mps)
            };
            let drive = Drive {
                at_start: pull(&last),
                slope: (pull(sample) - pull(&last)) / exact(elapsed_s),
            };
            block.tick(&mut state, &drive, exact(elapsed_s), |at, from, to| {
                events.push(ContactChange {
                    t_s: f64::from(exact(last.t_s) + at),
                    from,
                    to,
                });
            });
        }
        let force = block.stiffness * (exact(sample.position_m) - state.x)
            + block.damping * (exact(sample.velocity_mps) - state.w);
        rows.push(SimulatedRow {
            device: *sample,
            block_position_m: f64::from(state.x),
            block_velocity_mps: f64::from(state.w),
            coupling_force_n: f64::from(force),
            contact: state.contact,
            at_bound: false,
        });
        last = *sample;
    }
    Simulation {
        rows,
        events,
        ..Simulation::default()
    }
}
