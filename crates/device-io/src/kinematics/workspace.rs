//! Where force may flow, and what the motors can do there.

use super::{Geometry, Jacobian};
use haptic_core::planar::{Plane, Workspace};

/// Largest distance between two neighbours of the grid on which a workspace is surveyed, m.
const GRID_M: f64 = 2e-3;

/// The origin alone, for a geometry that is the same everywhere.
pub(super) const ORIGIN: Workspace = Workspace {
    x_m: [0.0; 2],
    y_m: [0.0; 2],
};

/// Positions in rows, with both ends, at most 2 mm from each other.
pub(super) fn grid(workspace: &Workspace) -> impl Iterator<Item = Plane> {
    let x = points(workspace.x_m);
    points(workspace.y_m).flat_map(move |y| x.clone().map(move |x| Plane::new(x, y)))
}

fn points([low, high]: [f64; 2]) -> impl Iterator<Item = f64> + Clone {
    // A side that is a whole number of steps but for rounding has that number.
    let steps = ((high - low) / GRID_M - 1e-9).ceil().max(1.0);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 4 m")]
    let count = steps as u32;
    (0..=count).map(move |step| low + (high - low) * (f64::from(step) / steps))
}

/// A quantity of the hand where it is the worst in the workspace.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Worst {
    /// It, in its own unit.
    pub value: f64,
    /// Where the hand is then, m.
    pub position: Plane,
    /// The direction in which it is so, of length 1.
    pub direction: Plane,
}

impl Worst {
    /// Before any place is known.
    fn none(value: f64) -> Self {
        Self {
            value,
            position: Plane::ZERO,
            direction: Plane::ZERO,
        }
    }
}

/// The gains from motors to hand, over the whole workspace, m by m of a linear motor or m by rad of a rotary one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Survey {
    /// Largest travel of the hand by each motor's.
    largest_by_motor: [Worst; 2],
}

impl Survey {
    /// The gains in a workspace.
    ///
    /// # Errors
    /// The hand cannot be, or is not held firmly, everywhere in it; the error names the worst place.
    pub(super) fn of(geometry: &Geometry, workspace: &Workspace) -> Result<Self, String> {
        let mut survey = Self {
            largest_by_motor: [Worst::none(0.0); 2],
        };
        let mut least_share = f64::INFINITY;
        let mut worst = (Plane::ZERO, 0.0, 0.0);
        for position in grid(workspace) {
            let Plane { x, y } = position;
            let beyond =
                || format!("workspace_m: the links do not reach x = {x:.4} m, y = {y:.4} m with the elbows outside");
            let jacobian = jacobian(geometry, position).ok_or_else(beyond)?;
            survey.add(position, &jacobian);
            let (gain, largest) = jacobian.gains();
            // A gain that is not a number counts as none.
            let gain = gain.max(0.0);
            let least_allowed = geometry.least_allowed_gain(largest);
            let share = gain / least_allowed;
            if share < least_share {
                least_share = share;
                worst = (position, gain, least_allowed);
            }
        }
        if least_share >= 1.0 {
            return Ok(survey);
        }
        let (Plane { x, y }, gain, least_allowed) = worst;
        Err(format!(
            "workspace_m: the linkage is singular, or nearly so, at x = {x:.4} m, y = {y:.4} m: the hand moves {:.1} \
             mm/rad in the worst direction and must move at least {:.1} mm/rad, a quarter of the proximal link and of \
             the best direction",
            gain * 1e3,
            least_allowed * 1e3
        ))
    }

    /// Adds a place.
    fn add(&mut self, position: Plane, jacobian: &Jacobian) {
        for (most, column) in self.largest_by_motor.iter_mut().zip(jacobian.columns) {
            let value = column.length();
            if value > most.value {
                *most = Worst {
                    value,
                    position,
                    direction: column * (1.0 / value),
                };
            }
        }
    }

    /// What is made of each motor and of the largest travel of the hand by its own, and where that is.
    pub(super) fn by_motor(&self, of: impl Fn(usize, f64) -> f64) -> [Worst; 2] {
        [0, 1].map(|motor| Worst {
            value: of(motor, self.largest_by_motor[motor].value),
            ..self.largest_by_motor[motor]
        })
    }
}

/// How the hand moves at a position, where the links reach it.
fn jacobian(geometry: &Geometry, position: Plane) -> Option<Jacobian> {
    let pose = geometry.reading(geometry.motors(position)?).pose()?;
    Some(pose.jacobian)
}

/// The lightest and the heaviest mass, kg, that inertias of the motors are to the hand in a workspace.
pub(super) fn masses_kg(geometry: &Geometry, workspace: &Workspace, inertias: [f64; 2]) -> [Worst; 2] {
    let mut found = [Worst::none(f64::INFINITY), Worst::none(0.0)];
    for position in grid(workspace) {
        let Some(jacobian) = jacobian(geometry, position) else {
            continue;
        };
        let ([lightest, heaviest], direction) = jacobian.masses_kg(inertias);
        let worst = |value, direction| Worst {
            value,
            position,
            direction,
        };
        if lightest < found[0].value {
            found[0] = worst(lightest, direction);
        }
        if heaviest > found[1].value {
            found[1] = worst(heaviest, direction.turned_left());
        }
    }
    found
}
