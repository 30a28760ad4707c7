//! The five-bar linkage, as pantographs have it (Campion, Wang and Hayward 2005).

use super::{Jacobian, Pose};
use haptic_core::planar::Plane;

/// Two arms of two links each. The axis of the first motor is at `-base_m / 2` on the x axis, that of the second at
/// `base_m / 2`; angles are counted from the x axis, to the left; the handle is on the side of positive y.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FiveBar {
    /// Distance of the motors' axes, m.
    pub base_m: f64,
    /// From each axis to its elbow, m.
    pub proximal_m: f64,
    /// From each elbow to the handle, m.
    pub distal_m: f64,
}

impl FiveBar {
    fn axes(&self) -> [Plane; 2] {
        [Plane::new(-0.5 * self.base_m, 0.0), Plane::new(0.5 * self.base_m, 0.0)]
    }

    pub(super) fn pose(&self, angles: [f64; 2]) -> Option<Pose> {
        let [first, second] = self.axes();
        let arm = |axis: Plane, angle: f64| {
            let (sine, cosine) = libm::sincos(angle);
            let link = Plane::new(cosine, sine) * self.proximal_m;
            (axis + link, link.turned_left())
        };
        let ((left, left_moves), (right, right_moves)) = (arm(first, angles[0]), arm(second, angles[1]));
        let between = right - left;
        let apart = between.length();
        let half = 0.5 * apart;
        let height = (self.distal_m - half) * (self.distal_m + half);
        // Elbows that are together leave the handle anywhere on a circle, and those too far apart nowhere.
        if !(height > 0.0 && apart > f64::EPSILON) {
            return None;
        }
        let up = between.turned_left() * (libm::sqrt(height) / apart);
        let position = left + between * 0.5 + up;
        // Each distal link keeps its length: (p - e) . p' = (p - e) . e'.
        let (from_left, from_right) = (position - left, position - right);
        let area = from_left.cross(from_right);
        if area == 0.0 {
            return None;
        }
        let jacobian = Jacobian {
            first: -from_right.turned_left() * (from_left.dot(left_moves) / area),
            second: from_left.turned_left() * (from_right.dot(right_moves) / area),
        };
        Some(Pose { position, jacobian })
    }

    /// Angles of the motors, rad, with both elbows outward.
    pub(super) fn motors(&self, position: Plane) -> Option<[f64; 2]> {
        let [first, second] = self.axes();
        let angle = |axis: Plane, outward: f64| {
            let way = position - axis;
            let far = way.length();
            let Self { proximal_m, distal_m, .. } = *self;
            let cosine = (far * far + (proximal_m - distal_m) * (proximal_m + distal_m)) / (2.0 * proximal_m * far);
            (cosine.abs() <= 1.0).then(|| libm::atan2(way.y, way.x) + outward * libm::acos(cosine))
        };
        Some([angle(first, 1.0)?, angle(second, -1.0)?])
    }
}
