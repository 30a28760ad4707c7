//! The trial of a scene on a rig: the servo and the rig's mechanics in this process, for a second of each hand, before
//! a motor pulls a hand by it.
//!
//! A rig is left alone, held, and moved slowly, and each begins with a tap, either way. A loop that oscillates by
//! itself then sends its motor to and fro many times a second, with a good part of its force: it would chatter. The
//! same scene on the same rig has the same verdict, to the last bit.

mod course;
mod gentler;
#[cfg(test)]
mod tests;

pub(super) use course::TrialRig;
pub(super) use gentler::{FACTOR, Gentler, gentler, stiffest_coupling};

use course::course;
use haptic_core::servo::Fault;
use haptic_core::{Directional, Parameter, Renderer, Scene, SceneError};
use std::cmp::Ordering;
use std::fmt;

/// Most changes of sign a second: a hand that goes to and fro makes some, a loop that oscillates by itself two a
/// period, of 10 Hz and more.
pub(super) const MAX_SIGN_CHANGES_PER_S: f64 = 20.0;

/// Most jumps of the force a second. Friction pulls to one side, so a loop may chatter without a change of sign; a
/// block that sticks and slips lets go some ten times a second.
pub(super) const MAX_JUMPS_PER_S: f64 = 100.0;

/// Mass of a rig of which none is known, kg, where a scene is tried: that of light ones.
pub(super) const LIGHT_RIG_KG: f64 = 0.1;

/// The hand of a trial.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum TrialHand {
    Absent,
    Holding,
    Moving,
}

impl TrialHand {
    const ALL: [Self; 3] = [Self::Absent, Self::Holding, Self::Moving];
}

impl fmt::Display for TrialHand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Absent => "left alone",
            Self::Holding => "held",
            Self::Moving => "moved slowly",
        })
    }
}

/// What came of a trial with one hand.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Trial {
    pub(super) hand: TrialHand,
    /// Changes of sign of the force a second, where it exceeds a tenth of the rig's limit on both sides.
    pub(super) sign_changes_per_s: f64,
    /// Changes of the force from tick to tick by more than a tenth of the rig's limit, a second.
    pub(super) jumps_per_s: f64,
    /// Share of the time with the force at the rig's limit, 0 to 1.
    pub(super) share_at_limit: f64,
    /// Greatest size of the force, N.
    pub(super) greatest_force_n: f64,
    /// Whether it comes to rest, where nobody moves it.
    pub(super) rests: bool,
    /// What took the force away, if anything did.
    pub(super) fault: Option<Fault>,
}

impl Trial {
    /// Whether a hand may feel this.
    pub(super) fn is_calm(&self) -> bool {
        let is_quiet = self.sign_changes_per_s <= MAX_SIGN_CHANGES_PER_S && self.jumps_per_s <= MAX_JUMPS_PER_S;
        self.fault.is_none() && self.rests && is_quiet
    }

    /// Whether its jumps are too many, but not its changes of sign.
    fn jumps(&self) -> bool {
        self.sign_changes_per_s <= MAX_SIGN_CHANGES_PER_S && self.jumps_per_s > MAX_JUMPS_PER_S
    }

    /// What it is judged by, a second, and the most that is allowed.
    pub(super) fn measure_per_s(&self) -> (f64, f64) {
        if self.jumps() {
            (self.jumps_per_s, MAX_JUMPS_PER_S)
        } else {
            (self.sign_changes_per_s, MAX_SIGN_CHANGES_PER_S)
        }
    }

    /// The worse one is the greater one.
    fn compare(&self, other: &Self) -> Ordering {
        self.fault
            .is_some()
            .cmp(&other.fault.is_some())
            .then(other.is_calm().cmp(&self.is_calm()))
            .then(self.sign_changes_per_s.total_cmp(&other.sign_changes_per_s))
            .then(self.jumps_per_s.total_cmp(&other.jumps_per_s))
            .then(self.share_at_limit.total_cmp(&other.share_at_limit))
    }
}

impl fmt::Display for Trial {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (what, by) = if self.jumps() {
            ("its force jumps", " by more than a tenth of the rig's limit")
        } else {
            ("it changes sign", "")
        };
        write!(
            f,
            "{} {what} {:.0} times a second{by}, up to {:.2} N and {:.0} % of the time at the rig's limit",
            self.hand,
            self.measure_per_s().0,
            self.greatest_force_n,
            100.0 * self.share_at_limit
        )?;
        match self.fault {
            Some(fault) => write!(f, ", and ends in a fault: {fault}"),
            None if !self.rests => f.write_str(", and does not come to rest"),
            None => Ok(()),
        }
    }
}

/// The trials of a scene, one by one: each hand, and its mirror image where that is another, so that a mirrored scene
/// on a mirrored rig has the same verdict. Where only the verdict is wanted (`brief`), each ends as soon as that is
/// known.
fn trials(scene: &Scene, rig: &TrialRig, brief: bool) -> Result<impl Iterator<Item = Trial>, SceneError> {
    let renderer = Renderer::new(scene, rig.scheme, rig.settings.period_s)?;
    let forces = [Parameter::StaticForce, Parameter::DynamicForce].map(|force| scene.value(force));
    let forces = forces.into_iter().flatten().map(Directional::greatest);
    let stroke_m = rig.stroke_m(forces.fold(0.0, f64::max));
    let is_symmetric = |parameter| scene.value(parameter).is_none_or(Directional::is_symmetric);
    let is_one_sided = !rig.is_symmetric() || !scene.parameters().into_iter().all(is_symmetric);
    let sides = if is_one_sided { &[1.0, -1.0][..] } else { &[1.0] };
    let each = TrialHand::ALL
        .into_iter()
        .flat_map(move |hand| sides.iter().map(move |&side| (hand, side)));
    Ok(each.map(move |(hand, side)| course(renderer.clone(), rig, hand, side * stroke_m, brief)))
}

/// The worst of all trials of a scene.
///
/// # Errors
/// The scene cannot be rendered.
pub(super) fn worst_trial(scene: &Scene, rig: &TrialRig) -> Result<Option<Trial>, SceneError> {
    Ok(trials(scene, rig, false)?.max_by(Trial::compare))
}

/// Whether a scene can be rendered and is calm.
fn is_calm(scene: &Scene, rig: &TrialRig) -> bool {
    trials(scene, rig, true).is_ok_and(|mut trials| trials.all(|trial| trial.is_calm()))
}
