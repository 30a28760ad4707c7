//! The true motion under the laws that have no series of a few terms: the classical Runge-Kutta
//! method in very short steps, with every change of direction, of contact and of regime found by
//! halving, so that no step runs across a kink.
//!
//! The laws are written down here once more, from their papers' equations and as differential
//! equations, which the core's closed forms and tangents are not.

use super::equations::{Drive, Mode, Problem, State};
use crate::motion::DeviceSample;
use crate::simulate::{ContactChange, Row, Simulation, Start};
use haptic_core::Direction;
use haptic_core::block::Contact;
use haptic_core::friction::{Friction, Karnopp};
use haptic_core::scene::Coupling;

/// Fewest steps between two samples.
const FEWEST_STEPS: f64 = 200.0;
/// Halvings that find an event to the last digit.
const HALVINGS: usize = 60;

impl Problem<'_> {
    fn rate(&self, drive: Drive, t: f64, state: &State, mode: Mode) -> State {
        if mode == Mode::Rigid {
            return [0.0, 0.0, 1.0];
        }
        let (friction, own) = self.friction(state, mode);
        let pull = self.load(drive, t, state) - self.coupling.damping * state[1];
        [state[1], (pull - friction) / self.mass, own]
    }

    fn step(&self, drive: Drive, t: f64, y: &State, h: f64, mode: Mode) -> State {
        let after = |k: &State, by: f64| [y[0] + by * k[0], y[1] + by * k[1], y[2] + by * k[2]];
        let k1 = self.rate(drive, t, y, mode);
        let k2 = self.rate(drive, t + 0.5 * h, &after(&k1, 0.5 * h), mode);
        let k3 = self.rate(drive, t + 0.5 * h, &after(&k2, 0.5 * h), mode);
        let k4 = self.rate(drive, t + h, &after(&k3, h), mode);
        std::array::from_fn(|i| y[i] + h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]))
    }

    /// Whether the mode has ended in a state.
    fn has_ended(&self, drive: Drive, t: f64, state: &State, mode: Mode) -> bool {
        match mode {
            Mode::Rigid => {
                let load = self.load(drive, t, state);
                load.abs() > self.limit(Direction::of(load), state[2])
            }
            Mode::Spring => {
                let force = self.spring(state[2]);
                force.abs() > self.limit(Direction::of(force), 0.0)
            }
            Mode::Moving { direction, armed, .. } => {
                let level = if armed { self.threshold() } else { 0.0 };
                direction.sign() * state[1] < level || (!armed && self.is_saturated(state, direction))
            }
        }
    }

    /// The mode that follows one that has ended.
    fn next(&self, drive: Drive, t: f64, state: &mut State, mode: Mode) -> Mode {
        let towards = |value: f64, slope: f64| Direction::of(if value == 0.0 { slope } else { value });
        match (mode, self.law) {
            (Mode::Rigid, _) => {
                let load = self.load(drive, t, state);
                let direction = Direction::of(load);
                self.moving(direction, self.limit(direction, state[2]))
            }
            (Mode::Spring, _) => self.moving(Direction::of(self.spring(state[2])), 0.0),
            (Mode::Moving { direction, armed, .. }, Friction::Karnopp(law)) => {
                let load = self.load(drive, t, state);
                let rest_s = Self::rest_of(law, direction, mode);
                if load.abs() <= self.limit(Direction::of(load), rest_s) {
                    (state[1], state[2]) = (0.0, rest_s);
                    Mode::Rigid
                } else if armed && self.threshold() > 0.0 {
                    state[1] = direction.sign() * self.threshold();
                    let Mode::Moving { peak, .. } = mode else { return mode };
                    Mode::Moving {
                        direction,
                        armed: false,
                        peak,
                    }
                } else {
                    state[1] = 0.0;
                    self.moving(Direction::of(load), self.limit(Direction::of(load), rest_s))
                }
            }
            (Mode::Moving { direction, armed, .. }, Friction::ResetIntegrator(_) | Friction::SalcudeanVlaar(_)) => {
                state[1] = if armed {
                    direction.sign() * self.threshold()
                } else {
                    0.0
                };
                let (friction, _) = self.friction(state, mode);
                let limit = self.limit(Direction::of(friction), 0.0);
                state[2] = if friction == 0.0 {
                    0.0
                } else {
                    self.deflection(friction.clamp(-limit, limit))
                };
                Mode::Spring
            }
            (
                Mode::Moving {
                    direction,
                    armed: false,
                    peak,
                },
                Friction::Dahl(law),
            ) if self.is_saturated(state, direction) => {
                state[2] = direction.sign() * law.dynamic_force.get(direction);
                Mode::Moving {
                    direction,
                    armed: true,
                    peak,
                }
            }
            (Mode::Moving { .. }, _) => {
                state[1] = 0.0;
                let (friction, _) = self.friction(state, mode);
                self.moving(towards(self.load(drive, t, state) - friction, drive.slope), 0.0)
            }
        }
    }

    /// The rest that a contact has behind it, so to speak, which comes to rest with the friction
    /// that its slide began with.
    fn rest_of(law: &Karnopp, direction: Direction, mode: Mode) -> f64 {
        let Mode::Moving { peak, .. } = mode else { return 0.0 };
        let (held, sliding) = (law.static_force.get(direction), law.dynamic_force.get(direction));
        if law.stribeck_velocity == 0.0 || law.rising_rate == 0.0 || peak <= sliding {
            return 0.0;
        }
        let share = ((peak - sliding) / (held - sliding)).min(1.0);
        -(1.0 - share).ln() / law.rising_rate
    }

    fn moving(&self, direction: Direction, peak: f64) -> Mode {
        let _ = self;
        Mode::Moving {
            direction,
            armed: false,
            peak,
        }
    }

    /// The contact that a state counts as: as the core has it, stuck where deflection takes up half
    /// of a motion or more.
    fn contact(&self, state: &State, mode: Mode) -> Contact {
        match mode {
            Mode::Rigid | Mode::Spring => Contact::Stuck,
            Mode::Moving { direction, .. } => match self.law {
                Friction::Karnopp(_)
                | Friction::Viscous(_)
                | Friction::ResetIntegrator(_)
                | Friction::SalcudeanVlaar(_) => Contact::Sliding(direction),
                law => {
                    // At rest the share is that of a very slow motion.
                    let w = if state[1] == 0.0 {
                        direction.sign() * 1e-12
                    } else {
                        state[1]
                    };
                    let moving = [state[0], w, state[2]];
                    let (_, rate) = self.friction(&moving, mode);
                    let stiffness = match law {
                        Friction::Dahl(law) => law.contact_stiffness,
                        _ => 1.0,
                    };
                    if rate / w / stiffness >= 0.5 {
                        Contact::Stuck
                    } else {
                        Contact::Sliding(direction)
                    }
                }
            },
        }
    }
}

/// The true motion of the block.
pub(super) fn solve(
    mass: f64,
    coupling: &Coupling,
    law: &Friction,
    motion: &[DeviceSample],
    start: Start,
) -> Simulation {
    let problem = Problem { mass, coupling, law };
    let (mut rows, mut events) = (Vec::with_capacity(motion.len()), Vec::new());
    let Some(first) = motion.first() else {
        return Simulation {
            rows,
            events,
            energy_created_j: 0.0,
            exhausted_ticks: 0,
        };
    };
    let fastest_hand = motion
        .iter()
        .map(|sample| sample.velocity_mps.abs())
        .fold(0.0, f64::max);
    let longest = problem.longest_step(2.0 * fastest_hand + start.velocity_mps.abs());
    let mut state = [start.position_m.unwrap_or(first.position_m), start.velocity_mps, 0.0];
    let mut mode = match law {
        _ if start.velocity_mps != 0.0 => problem.moving(
            Direction::of(start.velocity_mps),
            problem.limit(Direction::of(start.velocity_mps), f64::INFINITY),
        ),
        Friction::Karnopp(_) => Mode::Rigid,
        Friction::ResetIntegrator(_) | Friction::SalcudeanVlaar(_) => Mode::Spring,
        _ => problem.moving(Direction::of(first.velocity_mps), 0.0),
    };
    let mut contact = problem.contact(&state, mode);
    let mut last = *first;
    for sample in motion {
        let elapsed_s = sample.t_s - last.t_s;
        if elapsed_s > 0.0 {
            let pull =
                |sample: &DeviceSample| coupling.stiffness * sample.position_m + coupling.damping * sample.velocity_mps;
            let drive = Drive {
                at_start: pull(&last),
                slope: (pull(sample) - pull(&last)) / elapsed_s,
            };
            let h = longest.min(elapsed_s / FEWEST_STEPS);
            let mut t = 0.0;
            while t < elapsed_s {
                let step = h.min(elapsed_s - t);
                let mut next = problem.step(drive, t, &state, step, mode);
                let mut lasted = step;
                let ended = problem.has_ended(drive, t + step, &next, mode);
                if ended {
                    let (mut before, mut after) = (0.0, step);
                    for _ in 0..HALVINGS {
                        let middle = 0.5 * (before + after);
                        let there = problem.step(drive, t, &state, middle, mode);
                        if problem.has_ended(drive, t + middle, &there, mode) {
                            after = middle;
                        } else {
                            before = middle;
                        }
                    }
                    lasted = after;
                    next = problem.step(drive, t, &state, lasted, mode);
                }
                state = next;
                // The last step ends at the sample, whatever the sum of the steps says.
                t = if !ended && step < h { elapsed_s } else { t + lasted };
                if ended {
                    mode = problem.next(drive, t, &mut state, mode);
                } else if let Mode::Moving { direction, armed, .. } = &mut mode {
                    *armed |= problem.threshold() > 0.0 && direction.sign() * state[1] > problem.threshold();
                }
                let now = problem.contact(&state, mode);
                if now != contact {
                    events.push(ContactChange {
                        t_s: last.t_s + t,
                        from: contact,
                        to: now,
                    });
                    contact = now;
                }
            }
        }
        let force =
            coupling.stiffness * (sample.position_m - state[0]) + coupling.damping * (sample.velocity_mps - state[1]);
        rows.push(Row {
            device: *sample,
            block_position_m: state[0],
            block_velocity_mps: state[1],
            coupling_force_n: force,
            contact,
        });
        last = *sample;
    }
    Simulation {
        rows,
        events,
        energy_created_j: 0.0,
        exhausted_ticks: 0,
    }
}
