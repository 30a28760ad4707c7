//! Where force may flow, and what the motors can do there.

use super::{Geometry, Jacobian, KinematicsProblem, Reading};
use haptic_core::planar::{Plane, Workspace};

/// Largest distance between two neighbours of the grid on which a workspace is surveyed, m.
const GRID_M: f64 = 2e-3;

/// The origin alone, for a geometry that is the same everywhere.
pub(super) const ORIGIN: Workspace = Workspace {
    x_m: [0.0; 2],
    y_m: [0.0; 2],
};

/// Positions in rows, with both ends, at most 2 mm from each other.
fn grid(workspace: &Workspace) -> impl Iterator<Item = Plane> {
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

/// The gains from motors to hand, over the whole workspace, m by m of a linear motor or m by rad of a rotary one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Survey {
    /// Largest way of the hand by each motor's.
    pub(super) largest_by_motor: [f64; 2],
    /// Least gain, in the worst direction.
    pub(super) least: f64,
    /// Largest ratio of the gains in the best and the worst direction; 1 where the hand moves alike in all directions.
    pub(super) condition: f64,
}

impl Survey {
    /// The gains in a workspace.
    ///
    /// # Errors
    /// The hand cannot be, or is not held firmly, everywhere in it; the error names the worst place.
    pub(super) fn of(geometry: &Geometry, workspace: &Workspace) -> Result<Self, KinematicsProblem> {
        let mut survey = Self {
            largest_by_motor: [0.0; 2],
            least: f64::INFINITY,
            condition: 1.0,
        };
        let mut least_share = f64::INFINITY;
        let mut refusal = None;
        for position in grid(workspace) {
            let reading = geometry.motors(position).map(|motors| geometry.reading(motors));
            let Some(Reading::Position(pose) | Reading::Singular(pose)) = reading else {
                return Err(KinematicsProblem::Unreachable { position });
            };
            survey = survey.with(&pose.jacobian);
            let (gain, largest) = pose.jacobian.gains();
            // A gain that is not a number counts as none.
            let gain = gain.max(0.0);
            let least_allowed = geometry.least_allowed_gain(largest);
            let share = gain / least_allowed;
            if share < least_share {
                least_share = share;
                refusal = (share < 1.0).then_some(KinematicsProblem::Singular {
                    position,
                    gain,
                    least_allowed,
                });
            }
        }
        refusal.map_or(Ok(survey), Err)
    }

    fn with(self, jacobian: &Jacobian) -> Self {
        let [first, second] = jacobian.columns.map(Plane::length);
        let (least, largest) = jacobian.gains();
        Self {
            largest_by_motor: [
                self.largest_by_motor[0].max(first),
                self.largest_by_motor[1].max(second),
            ],
            least: self.least.min(least),
            condition: self.condition.max(largest / least),
        }
    }
}
