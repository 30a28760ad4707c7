//! What a fake firmware measures and drives.

use super::fake_rig::FakeRig;
use super::planar_rig::PlanarRig;
use crate::protocol::message::TwoAxes;

/// Smallest distance of two counts that a firmware reports, m or rad: for an encoder without counts.
const SMALLEST_COUNT: f64 = 1e-9;

/// A carriage, two of them side by side, or a mass in the plane.
#[derive(Debug)]
pub enum Mechanics {
    /// One axis.
    Line(Box<FakeRig>),
    /// Two axes that do not know of each other.
    TwoLines(Box<[FakeRig; 2]>),
    /// Two motors that move one hand.
    Plane(Box<PlanarRig>),
}

impl Mechanics {
    pub(super) fn live_until(&mut self, now_ns: u64) {
        match self {
            Self::Line(rig) => rig.live_until(now_ns),
            Self::TwoLines(rigs) => rigs.iter_mut().for_each(|rig| rig.live_until(now_ns)),
            Self::Plane(rig) => rig.live_until(now_ns),
        }
    }

    /// The efforts of the motors from now on, N or N m.
    pub(super) fn drive(&mut self, [first, second]: [f64; 2]) {
        match self {
            Self::Line(rig) => rig.drive(first),
            Self::TwoLines(rigs) => {
                rigs[0].drive(first);
                rigs[1].drive(second);
            }
            Self::Plane(rig) => rig.drive([first, second]),
        }
    }

    pub(super) fn has_two_axes(&self) -> bool {
        !matches!(self, Self::Line(_))
    }

    pub(super) fn are_rotary(&self) -> bool {
        matches!(self, Self::Plane(rig) if rig.kinematics().are_rotary())
    }

    /// Distance of two counts of an encoder, m or rad.
    pub(super) fn count(&self) -> f64 {
        match self {
            Self::Line(rig) => rig.properties().resolution_m,
            Self::TwoLines(rigs) => rigs[0].properties().resolution_m,
            Self::Plane(rig) => rig.properties().count,
        }
        .max(SMALLEST_COUNT)
    }

    /// The encoders, counts.
    pub(super) fn counts(&self) -> (i32, Option<i32>) {
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a desk-top rig goes far less than 2^31 counts"
        )]
        let count = |rig: &FakeRig| (rig.plant().position_m() / self.count()).round() as i32;
        match self {
            Self::Line(rig) => (count(rig), None),
            Self::TwoLines(rigs) => (count(&rigs[0]), Some(count(&rigs[1]))),
            Self::Plane(rig) => {
                let [first, second] = rig.counts();
                (first, Some(second))
            }
        }
    }

    /// What the hello of two axes says beyond that of one. The counts of a linkage without a home pose are its angles.
    pub(super) fn two_axes(&self, second_counts: f32, second_limit: u32) -> Option<TwoAxes> {
        let has_home = matches!(self, Self::Plane(rig) if rig.kinematics().home().is_some());
        self.has_two_axes().then(|| TwoAxes {
            second_counts,
            second_limit,
            are_rotary: self.are_rotary(),
            are_absolute: self.are_rotary() && !has_home,
        })
    }
}
