//! How the hand moves with the motors at one place, and what follows from it: efforts, forces, and what a property of
//! the motors is to the hand.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

use haptic_core::planar::Plane;

/// Derivatives of the hand's position by the position of each motor, m by m or m by rad.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jacobian {
    pub(super) columns: [Plane; 2],
}

impl Jacobian {
    /// Velocity of the hand, m/s, of motors with these velocities, m/s or rad/s.
    #[cfg(test)]
    pub(super) fn velocity(&self, [first, second]: [f64; 2]) -> Plane {
        self.columns[0] * first + self.columns[1] * second
    }

    /// The travel of the hand by that of a motor, counted from 0.
    #[must_use]
    pub fn column(&self, motor: usize) -> Plane {
        self.columns[motor]
    }

    /// Efforts of the motors, N or N m, that give a force on the hand, N: by virtual work.
    #[must_use]
    pub fn efforts(&self, force: Plane) -> [f64; 2] {
        self.columns.map(|column| column.dot(force))
    }

    /// The force on the hand, N, that efforts of the motors, N or N m, give. Not finite where the linkage is singular.
    #[must_use]
    pub fn force(&self, [first, second]: [f64; 2]) -> Plane {
        let [by_first, by_second] = self.columns;
        // Both equations `column . force = effort` at once, by Cramer's rule.
        (by_first.turned_left() * second - by_second.turned_left() * first) * (1.0 / by_first.cross(by_second))
    }

    /// The force on the hand, N, that one motor alone, counted from 0, gives with an effort of 1 N or 1 N m.
    #[must_use]
    pub fn force_of_motor(&self, motor: usize) -> Plane {
        let mut alone = [0.0; 2];
        alone[motor] = 1.0;
        self.force(alone)
    }

    /// How much farther one motor, counted from 0, carries the hand, m, than the other does either way, as they move by
    /// these distances, m or rad.
    ///
    /// Whatever mass `mu` the hand has and whatever inertias the motors, an effort of this motor alone gives more than
    /// zero, and one of the other motor less: the motors' inertia matrix is `H = mu J'J + diag(I)`, and they move by a
    /// column of its inverse, `(H22, -H12)` for the first. So the ratio of the distances that they carry the hand is at
    /// most the cosine between the columns of `J`, or at least its inverse.
    #[must_use]
    pub fn lead_m(&self, motor: usize, moved: [f64; 2]) -> f64 {
        let carried = |motor: usize| self.columns[motor].length() * moved[motor];
        carried(motor) - carried(1 - motor).abs()
    }

    /// The least and the largest travel of the hand, in any direction, by that of the motors: its singular values.
    pub(super) fn gains(&self) -> (f64, f64) {
        let [first, second] = self.columns;
        let sum = first.dot(first) + second.dot(second);
        let product = first.cross(second).abs();
        let largest = 0.5 * ((sum + 2.0 * product).sqrt() + (sum - 2.0 * product).max(0.0).sqrt());
        (product / largest, largest)
    }

    /// The mass, kg, that inertias of the motors alone, kg or kg m^2, are to the hand: in the direction where it is the
    /// lightest, which is returned, and across it, where it is the heaviest. `M = J^-T diag(I) J^-1`.
    pub(super) fn masses_kg(&self, inertias: [f64; 2]) -> ([f64; 2], Plane) {
        // The eigenvalues of its inverse are the squares of the gains of `J diag(I)^-1/2`.
        let columns = [0, 1].map(|motor| self.columns[motor] * (1.0 / inertias[motor].max(MIN_INERTIA).sqrt()));
        let scaled = Self { columns };
        let (least, largest) = scaled.gains();
        let [first, second] = columns;
        let across = 2.0 * (first.x * first.y + second.x * second.y);
        let along = first.x * first.x + second.x * second.x - first.y * first.y - second.y * second.y;
        let (sin, cos) = libm::sincos(0.5 * libm::atan2(across, along));
        ([largest, least].map(|gain| (gain * gain).recip()), Plane::new(cos, sin))
    }
}

/// An inertia that counts as none, kg or kg m^2.
const MIN_INERTIA: f64 = 1e-12;
