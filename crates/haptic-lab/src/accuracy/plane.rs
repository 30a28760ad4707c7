//! Karnopp's block in the plane: the exact tick, and what others do, held against true forces along four motions.
//!
//! The forces are stored: two solvers in 128-bit numbers agree on them to 1e-20 N. They are of a block on a surface
//! that is alike in all directions, without a velocity threshold. Viscous friction alone is a block for each axis,
//! which the laws of a line measure. The surface under the device itself is not measured in the plane.

use super::error::worse;
use crate::motion::{DeviceSample, per_tick};
use crate::simulate::{TickCost, cost_of_ticks};
use haptic_core::block::{BlockState, Coupling};
use haptic_core::friction::{Friction, Karnopp};
use haptic_core::planar::{PlanarRenderer, Plane};
use haptic_core::scene::Block;
use haptic_core::{Directional, Renderer, Rendering, Scene, SceneError, Scheme};
use haptic_motion::median::median;
use std::fmt;
use std::hint::black_box;

/// Time between two samples, s.
const PERIOD_S: f64 = 1e-3;

/// A motion of the device in the plane, over a block that rests at the origin at first.
#[derive(Clone, Debug)]
pub struct PlaneCase {
    /// Name of the motion.
    pub name: &'static str,
    /// The scene.
    pub scene: Scene,
    /// The motion.
    pub motion: Vec<DeviceSample<Plane>>,
    /// The true force of the coupling on the block at each sample, N.
    pub forces_n: Vec<Plane>,
    mass: f64,
    coupling: Coupling,
    friction: Karnopp,
}

/// The cases, from the tables of the core's tests.
///
/// # Panics
/// Never: the tables are whole.
#[must_use]
pub fn plane_cases() -> Vec<PlaneCase> {
    macro_rules! case {
        ($name:literal, $mass:literal kg, $coupling:expr, $limits:expr, $viscous:literal) => {
            case(
                $name,
                include_str!(concat!("../../../haptic-core/tests/data/planar/", $name, ".csv")),
                $mass,
                $coupling,
                Karnopp {
                    viscous: Directional::both($viscous),
                    ..Karnopp::new($limits[0], $limits[1])
                },
            )
        };
    }
    vec![
        case!("circle", 0.5 kg, [25_000.0, 10.0], [4.0, 3.5], 0.0),
        case!("zig-zag-stick", 0.5 kg, [2000.0, 4.0], [4.0, 3.5], 0.0),
        case!("slanted-line", 0.5 kg, [25_000.0, 10.0], [4.0, 3.5], 2.0),
        case!("light-block-spiral", 0.001 kg, [25_000.0, 0.5], [2.0, 1.5], 0.0),
    ]
}

fn case(name: &'static str, table: &str, mass: f64, [stiffness, damping]: [f64; 2], friction: Karnopp) -> PlaneCase {
    let rows = table.lines().skip(1).map(|line| {
        let row: Vec<f64> = line.split(',').map(|cell| cell.parse().expect("a number")).collect();
        let pair = |at: usize| Plane::new(row[at], row[at + 1]);
        let sample = DeviceSample {
            t_s: row[0],
            position_m: pair(1),
            velocity_mps: pair(3),
        };
        (sample, pair(9))
    });
    let (motion, forces_n) = rows.unzip();
    let coupling = Coupling { stiffness, damping };
    PlaneCase {
        name,
        scene: Scene {
            name: name.to_owned(),
            block: Some(Block { mass }),
            coupling: Some(coupling),
            friction: Friction::Karnopp(friction),
        },
        motion,
        forces_n,
        mass,
        coupling,
        friction,
    }
}

/// Ways to move the block on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlaneScheme {
    /// What the daemon does.
    Exact,
    /// Moreau's implicit step, as physics engines take it, so many times a tick.
    Moreau(u32),
    /// An exact block on a line for each axis, as the firmware of force-feedback devices has it.
    TwoKarnopps,
}

impl PlaneScheme {
    /// Those that are compared.
    pub const ALL: [Self; 4] = [Self::Exact, Self::Moreau(1), Self::Moreau(100), Self::TwoKarnopps];
}

impl fmt::Display for PlaneScheme {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Exact => f.write_str("exact"),
            Self::Moreau(steps) => write!(f, "Moreau x{steps}"),
            Self::TwoKarnopps => f.write_str("two Karnopps"),
        }
    }
}

/// A block of a case, moved on by one of the schemes.
#[derive(Clone, Debug)]
pub struct PlaneBlock(Solver);

#[derive(Clone, Debug)]
enum Solver {
    Exact(PlanarRenderer),
    Moreau(Moreau),
    TwoKarnopps(Box<[Renderer; 2]>),
}

impl PlaneBlock {
    /// The block at the first sample of a case.
    ///
    /// # Errors
    /// Never in practice: the scenes are valid.
    pub fn new(scheme: PlaneScheme, case: &PlaneCase) -> Result<Self, SceneError> {
        let DeviceSample {
            position_m: position,
            velocity_mps: velocity,
            ..
        } = case.motion[0];
        Ok(Self(match scheme {
            PlaneScheme::Exact => {
                let mut renderer = PlanarRenderer::new(&case.scene, Scheme::Exact, PERIOD_S)?;
                renderer.hold_at(Plane::ZERO, Plane::ZERO, position, velocity);
                Solver::Exact(renderer)
            }
            PlaneScheme::Moreau(steps) => Solver::Moreau(Moreau {
                mass: case.mass,
                coupling: case.coupling,
                friction: case.friction,
                steps,
                position: Plane::ZERO,
                velocity: Plane::ZERO,
                device: (position, velocity),
            }),
            PlaneScheme::TwoKarnopps => {
                let axis = |position, velocity| {
                    let mut axis = Renderer::new(&case.scene, Scheme::Exact, PERIOD_S)?;
                    axis.set_state(BlockState::new(0.0, 0.0, position, velocity));
                    Ok(axis)
                };
                Solver::TwoKarnopps(Box::new([axis(position.x, velocity.x)?, axis(position.y, velocity.y)?]))
            }
        }))
    }

    /// A tick, to the next sample; returns the force of the coupling on the block, N.
    pub fn tick(&mut self, to: &DeviceSample<Plane>) -> Plane {
        let (position, velocity) = (to.position_m, to.velocity_mps);
        match &mut self.0 {
            Solver::Exact(renderer) => renderer.render(PERIOD_S, position, velocity),
            Solver::Moreau(moreau) => moreau.tick(position, velocity),
            Solver::TwoKarnopps(axes) => Plane::new(
                axes[0].tick(PERIOD_S, position.x, velocity.x).coupling_force,
                axes[1].tick(PERIOD_S, position.y, velocity.y).coupling_force,
            ),
        }
    }
}

/// Backward Euler with Coulomb friction in the cone (Moreau 1988).
#[derive(Clone, Debug)]
struct Moreau {
    mass: f64,
    coupling: Coupling,
    friction: Karnopp,
    steps: u32,
    position: Plane,
    velocity: Plane,
    device: (Plane, Plane),
}

impl Moreau {
    fn tick(&mut self, position: Plane, velocity: Plane) -> Plane {
        let Coupling { stiffness, damping } = self.coupling;
        let Karnopp {
            static_force,
            dynamic_force,
            viscous,
            ..
        } = self.friction;
        let step_s = PERIOD_S / f64::from(self.steps);
        let from = self.device;
        for step in 1..=self.steps {
            let share = f64::from(step) / f64::from(self.steps);
            let there = from.0 + (position - from.0) * share;
            let fast = from.1 + (velocity - from.1) * share;
            let pull = (there - self.position) * stiffness + fast * damping;
            let impulse = self.velocity * (self.mass / step_s) + pull;
            let is_stuck = self.velocity == Plane::ZERO;
            let holds = if is_stuck { static_force } else { dynamic_force };
            let length = impulse.length();
            let drag = self.mass / step_s + damping + viscous.positive + stiffness * step_s;
            self.velocity = if length <= holds.positive {
                Plane::ZERO
            } else {
                impulse * ((length - dynamic_force.positive) / (drag * length))
            };
            self.position += self.velocity * step_s;
        }
        self.device = (position, velocity);
        (position - self.position) * stiffness + (velocity - self.velocity) * damping
    }
}

/// One scheme along one motion.
#[derive(Clone, Debug, PartialEq)]
pub struct PlaneMeasurement {
    /// Name of the motion.
    pub case: &'static str,
    /// The scheme.
    pub scheme: PlaneScheme,
    /// Median error of the force, N: the length of the difference.
    pub median_n: f64,
    /// The worst tick's, N.
    pub worst_n: f64,
    /// Cost of a tick.
    pub cost: TickCost,
    /// Instructions a tick, over the motion; none where they were not counted.
    pub instructions: Option<f64>,
}

/// Runs every scheme along every motion. `instructions` are the totals of
/// [`Probe::Plane`](crate::cost::Probe), scheme by scheme of each motion, or none.
///
/// # Errors
/// Never in practice: the scenes are valid.
pub fn measure_plane(instructions: Option<&[u64]>) -> Result<Vec<PlaneMeasurement>, SceneError> {
    let mut totals = instructions.unwrap_or_default().iter();
    let mut measurements = Vec::new();
    for case in plane_cases() {
        for scheme in PlaneScheme::ALL {
            let begun = PlaneBlock::new(scheme, &case)?;
            let mut block = begun.clone();
            let ticks = case.motion.iter().zip(&case.forces_n).skip(1);
            let mut errors: Vec<f64> = ticks
                .map(|(sample, force)| worse(0.0, (block.tick(sample) - *force).length()))
                .collect();
            measurements.push(PlaneMeasurement {
                case: case.name,
                scheme,
                worst_n: errors.iter().copied().fold(0.0, f64::max),
                median_n: median(&mut errors).unwrap_or(0.0),
                cost: cost_of_ticks(begun, &case.motion, |block, _, to| {
                    black_box(block.tick(to));
                }),
                instructions: totals.next().map(|total| per_tick(*total, &case.motion)),
            });
        }
    }
    Ok(measurements)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_exact_tick_meets_the_true_forces() {
        let measured = measure_plane(None).expect("valid scenes");
        assert_eq!(measured.len(), 16);
        for one in measured {
            let PlaneMeasurement { median_n, worst_n, .. } = one;
            let is_as_expected = match one.scheme {
                PlaneScheme::Exact => median_n < 1e-12 && worst_n < 1e-10,
                PlaneScheme::Moreau(1) => median_n > 0.01 && worst_n > 0.3,
                PlaneScheme::Moreau(_) => median_n > 1e-4 && worst_n < 2.0,
                PlaneScheme::TwoKarnopps => median_n > 0.3 && worst_n > 1.0,
            };
            assert!(is_as_expected, "{one:?}");
        }
    }
}
