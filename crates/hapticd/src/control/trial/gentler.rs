//! What would pass: the stiffest grip of a scene that is calm, with a factor to spare.

use super::{TrialRig, is_calm};
use crate::control::change::keyed;
use haptic_core::adviser::{Check, RigFacts, advise};
use haptic_core::friction::{Friction, Karnopp};
use haptic_core::scene::Coupling;
use haptic_core::{Parameter, ParameterKey, Scene};

/// How much softer than the stiffest calm grip is what is proposed.
pub(in crate::control) const FACTOR: f64 = 2.0;

/// Softest grip that is tried, as a share of the scene's.
const SOFTEST_SHARE: f64 = 1.0 / 1024.0;

/// Ratio of the softest grip that is known to chatter to the stiffest that is known to be calm, at the end of a search.
const FINENESS: f64 = 1.2;

/// Steps down from there, and the ratio of each, until all of a factor passes.
const MAX_STEPS_DOWN: i32 = 10;
const STEP_DOWN: f64 = 0.8;

/// A change of a scene.
pub(in crate::control) type Gentler = Vec<(ParameterKey, f64)>;

/// A gentler grip with which a scene that is not calm would be, with a factor of two to spare: of its stiffness alone,
/// or else of its damping too. `None` where none is found.
pub(in crate::control) fn gentler(scene: &Scene, rig: &TrialRig) -> Option<Gentler> {
    use Parameter::{ContactDamping, ContactStiffness, Damping, Stiffness, Viscous};
    let attempts: [&[Parameter]; 2] = if scene.is_on_device() {
        [&[ContactStiffness], &[ContactStiffness, ContactDamping, Viscous]]
    } else {
        [&[Stiffness], &[Stiffness, Damping]]
    };
    let found = |of: &[Parameter], is_stable: fn(&Scene, &TrialRig) -> bool| {
        let at = |share: f64| scaled(scene, of, share);
        let passes = |changes: &Gentler, factor: f64| {
            let changes: Gentler = changes.iter().map(|(key, value)| (*key, factor * value)).collect();
            let scene = scene.with(&changes);
            scene.is_ok_and(|scene| is_stable(&scene, rig) && is_calm(&scene, rig))
        };
        let most = stiffest((SOFTEST_SHARE, 1.0), |share| passes(&at(share), 1.0))?;
        with_room(most, at, passes)
    };
    // One that the adviser finds stable too, if there is one; with less damping too where that saves much stiffness.
    let [alone, with_damping] = attempts.map(|of| found(of, is_stable));
    let stiffness = |changes: &Gentler| changes.first().map_or(0.0, |(_, value)| *value);
    match (alone, with_damping) {
        (Some(alone), Some(both)) if stiffness(&both) > FACTOR * stiffness(&alone) => Some(both),
        (alone, both) => alone
            .or(both)
            .or_else(|| attempts.into_iter().find_map(|of| found(of, |_, _| true))),
    }
}

/// Whether a block's grip is stable against a stuck block, as the adviser has it.
fn is_stable(scene: &Scene, rig: &TrialRig) -> bool {
    scene
        .coupling
        .is_none_or(|grip| grip.stiffness <= stable_stiffness(grip.damping, rig))
}

/// Damping of the grips that are tried for a rig, N s/m.
const DAMPINGS_NS_PER_M: [f64; 4] = [2.0, 5.0, 10.0, 20.0];

/// Softest and stiffest grip that is tried for a rig, N/m.
const STIFFNESSES_N_PER_M: [f64; 2] = [20.0, 1e5];

/// The stiffest grip that is stable and calm on rigs, with a factor of two to spare, of the paper's block and of one that
/// does not give way. `None` where none is found.
pub(in crate::control) fn stiffest_coupling(rigs: &[TrialRig]) -> Option<Coupling> {
    let [softest, stiffest_tried] = STIFFNESSES_N_PER_M;
    let mut stable = DAMPINGS_NS_PER_M.map(|damping| {
        let bounds = rigs.iter().map(|rig| stable_stiffness(damping, rig));
        (bounds.fold(stiffest_tried, f64::min), damping)
    });
    stable.sort_by(|(one, _), (other, _)| other.total_cmp(one));
    let mut best: Option<Coupling> = None;
    for (bound, damping) in stable {
        if bound <= FACTOR * best.map_or(softest, |best| best.stiffness) {
            break;
        }
        let passes = |stiffness: &f64, factor: f64| {
            let stiffness = factor * stiffness;
            rigs.iter().all(|rig| {
                let slides = coupled(Coupling { stiffness, damping });
                let holds = Scene {
                    friction: Friction::Karnopp(Karnopp::new(rig.force_limit_n, rig.force_limit_n)),
                    ..slides.clone()
                };
                stiffness <= bound && is_calm(&holds, rig) && is_calm(&slides, rig)
            })
        };
        let most = stiffest((softest, bound), |stiffness| passes(&stiffness, 1.0));
        let found = most.and_then(|most| with_room(most, rounded_down, passes));
        best = best
            .into_iter()
            .chain(found.map(|stiffness| Coupling { stiffness, damping }))
            .max_by(|one, other| one.stiffness.total_cmp(&other.stiffness));
    }
    best
}

/// The paper's block in a grip.
fn coupled(coupling: Coupling) -> Scene {
    Scene {
        coupling: Some(coupling),
        ..Scene::paper()
    }
}

/// The stiffness, N/m, from which on a rig oscillates against a stuck block, as the adviser has it: a rig's friction can
/// hide that from a trial.
pub(super) fn stable_stiffness(damping: f64, rig: &TrialRig) -> f64 {
    let losses = rig.settings.losses;
    let left = rig.settings.compensation.map_or(losses, |some| some.left_of(losses));
    let facts = RigFacts {
        period_s: rig.settings.period_s,
        sample_period_s: rig.sample_period_s,
        delay_s: rig.delay_s,
        mass: Some(rig.mass_kg),
        damping: left.damping,
        friction: left.friction,
        resolution: rig.resolution_m,
    };
    let scene = coupled(Coupling {
        stiffness: STIFFNESSES_N_PER_M[0],
        damping,
    });
    let findings = advise(&scene, rig.scheme, &facts);
    let stability = findings.iter().find(|finding| finding.check == Check::LinearStability);
    // With too much damping the bound is one of damping.
    stability.map_or(f64::INFINITY, |found| {
        if found.parameter == Parameter::Stiffness {
            found.bound
        } else {
            0.0
        }
    })
}

/// The greatest value of a range that passes, to 20 %; `None` where the smallest does not.
fn stiffest((least, most): (f64, f64), passes: impl Fn(f64) -> bool) -> Option<f64> {
    if !passes(least) {
        return None;
    }
    let (mut calm, mut restless) = (least, most);
    while restless > FINENESS * calm {
        let middle = (calm * restless).sqrt();
        *(if passes(middle) { &mut calm } else { &mut restless }) = middle;
    }
    Some(calm)
}

/// What is a factor below the stiffest grip, or a little more, and passes up to that factor: close to its edge a scene
/// may be calm by chance.
fn with_room<T>(most: f64, at: impl Fn(f64) -> T, passes: impl Fn(&T, f64) -> bool) -> Option<T> {
    let mut fewer = (0..MAX_STEPS_DOWN).map(|step| at(most / FACTOR * STEP_DOWN.powi(step)));
    let up_to_the_factor = [1.0, FACTOR.sqrt(), FACTOR];
    fewer.find(|found| up_to_the_factor.iter().all(|factor| passes(found, *factor)))
}

/// The values of some parameters that a scene has, times a share, rounded down to two digits.
fn scaled(scene: &Scene, parameters: &[Parameter], share: f64) -> Gentler {
    let values = parameters
        .iter()
        .filter_map(|&parameter| Some(keyed(parameter, scene.value(parameter)?)));
    let scaled = values.flatten().map(|(key, value)| (key, rounded_down(value * share)));
    scaled.collect()
}

/// The greatest number of two significant digits that is no greater.
pub(super) fn rounded_down(value: f64) -> f64 {
    if value <= 0.0 {
        return value;
    }
    let digit = 10_f64.powf(value.log10().floor() - 1.0);
    (value / digit).floor() * digit
}
