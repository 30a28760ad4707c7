//! Where force may flow in the plane.

use super::vector::Plane;

/// A rectangle, m.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Workspace {
    /// Its ends along x, m.
    pub x_m: [f64; 2],
    /// Its ends along y, m.
    pub y_m: [f64; 2],
}

impl Workspace {
    /// Whether a position, m, lies inside.
    #[must_use]
    pub fn contains(&self, position: Plane) -> bool {
        let within = |[low, high]: [f64; 2], value: f64| (low..=high).contains(&value);
        within(self.x_m, position.x) && within(self.y_m, position.y)
    }

    /// Its middle, m.
    #[must_use]
    pub fn middle(&self) -> Plane {
        let middle = |[low, high]: [f64; 2]| 0.5 * (low + high);
        Plane::new(middle(self.x_m), middle(self.y_m))
    }
}
