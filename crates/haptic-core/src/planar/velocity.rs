//! Velocity in the plane: each axis has an estimator of its own.

use super::vector::Plane;
use crate::snapshot::Archive;
use crate::velocity::{Estimating, Estimator, Method};

/// Two estimators, one an axis.
#[derive(Clone, Copy, Debug)]
pub struct PlanarEstimator {
    x: Estimator,
    y: Estimator,
}

impl Estimating<Plane> for PlanarEstimator {
    fn new(method: Method, period_s: f64, resolution_m: f64) -> Self {
        let axis = Estimator::new(method, period_s, resolution_m);
        Self { x: axis, y: axis }
    }

    fn reset(&mut self) {
        self.x.reset();
        self.y.reset();
    }

    fn update(&mut self, elapsed_s: f64, position: Plane) -> Plane {
        Plane::new(
            self.x.update(elapsed_s, position.x),
            self.y.update(elapsed_s, position.y),
        )
    }

    fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.part("velocity", |archive| self.x.archive(archive));
        archive.part("velocity_y", |archive| self.y.archive(archive));
    }
}
