//! What a fake firmware measures and drives, and its time, which lives from one read to the next.

use super::fake_rig::FakeRig;
use super::planar_rig::PlanarRig;
use crate::protocol::message::TwoAxes;

/// Smallest distance of two counts that a firmware reports, m or rad: for an encoder without counts.
const SMALLEST_COUNT: f64 = 1e-9;

/// Most steps between two reads: after a stall the steps grow instead of their number.
const MAX_SUB_STEPS: f64 = 1000.0;

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

/// The time of a rig, which begins with its first read.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct RigTime {
    started_ns: Option<u64>,
    last_ns: u64,
}

impl RigTime {
    /// Goes on to a time of its reader, ns. Returns how much later that is, s, and the time since it began, s.
    #[expect(clippy::cast_precision_loss, reason = "nanoseconds of a run are far below 2^53")]
    pub(super) fn go_on(&mut self, now_ns: u64) -> (f64, f64) {
        let started = *self.started_ns.get_or_insert(now_ns);
        let now_ns = now_ns.saturating_sub(started);
        let elapsed_s = now_ns.saturating_sub(self.last_ns) as f64 * 1e-9;
        self.last_ns = self.last_ns.max(now_ns);
        (elapsed_s, now_ns as f64 * 1e-9)
    }

    /// The latest time since it began, ns.
    pub(super) fn ns(self) -> u64 {
        self.last_ns
    }
}

/// Equal steps of at most `longest_s` seconds that end at `now_s`: the length of each, s, and the time of its middle,
/// s.
pub(super) fn sub_steps(elapsed_s: f64, now_s: f64, longest_s: f64) -> impl Iterator<Item = (f64, f64)> {
    let steps = (elapsed_s / longest_s).ceil().min(MAX_SUB_STEPS);
    let h = elapsed_s / steps;
    let middles = std::iter::successors(Some(now_s - elapsed_s + 0.5 * h), move |middle_s| Some(middle_s + h));
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 1 to 1000")]
    middles.take(steps as usize).map(move |middle_s| (h, middle_s))
}
