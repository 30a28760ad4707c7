//! The judgement of a scene before a motor pulls a hand by it: it is tried on the connected rig, as far as that is
//! known, off this thread and off the loop. A stop waits for no trial.

use crate::control::rig::commission_record::Findings;
use crate::control::rig::known_rig::{KnownRig, TrialBasis};
use crate::control::trial::{
    self, FACTOR, Gentler, MAX_JUMPS_PER_S, MAX_SIGN_CHANGES_PER_S, Trial, TrialRig, gentler, worst_trial,
};
use crate::threads::{WorkError, Workers};
use haptic_core::Scene;
use haptic_core::scene::Coupling;
use haptic_ipc::quantity::number;
use haptic_ipc::{ANYWAY, ErrorCode, Problem, WireError};
use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;
use std::time::{Duration, Instant};

/// Verdicts that are kept: a slider that goes to and fro asks for the same ones again.
const MAX_KEPT: usize = 32;

/// Most scenes that are tried by a thread before it reports: to begin one and to get its report takes longer than a
/// trial on a busy machine.
const MAX_AT_A_TIME: usize = 16;

/// Threads at a time.
const MAX_WORKERS: usize = 2;

/// Longest time that trials may take: some milliseconds each, or some seconds on a machine that has no time for them.
/// Clients wait for 5 s.
const TIMEOUT: Duration = Duration::from_secs(3);

/// Longest time until trials are over and what would pass is found, which takes a tenth of a second more. Without it
/// there is a refusal all the same.
const MAX_WITH_SEARCH: Duration = Duration::from_secs(4);

/// Longest time of the search for the stiffest coupling: who commissions has a lease of 2 s.
const MAX_FOR_COUPLING: Duration = Duration::from_millis(1500);

/// A scene that would chatter: its index among those that were asked about, what it does, and what would not.
#[derive(Clone, Debug, PartialEq)]
struct Chatter {
    index: usize,
    worst: Trial,
    gentler: Option<Gentler>,
}

/// From this delay on a refusal names it, s: a converter that collects for 16 ms can be set not to.
const LATE_S: f64 = 4e-3;

/// What came of the trials of a scene: nothing, where it is calm.
type Verdict = Option<Chatter>;

/// The verdicts so far, and the threads that find new ones.
#[derive(Debug)]
pub(super) struct Verdicts {
    kept: RefCell<VecDeque<(Scene, TrialRig, Verdict)>>,
    workers: Workers,
}

impl Default for Verdicts {
    fn default() -> Self {
        Self {
            kept: RefCell::default(),
            workers: Workers::new("trial", MAX_WORKERS),
        }
    }
}

impl Verdicts {
    fn known(&self, scene: &Scene, rig: &TrialRig) -> Option<Verdict> {
        let kept = self.kept.borrow();
        let found = kept.iter().find(|(of, on, _)| of == scene && on == rig);
        found.map(|(_, _, verdict)| verdict.clone())
    }

    fn keep(&self, scene: Scene, rig: TrialRig, verdict: Verdict) {
        let mut kept = self.kept.borrow_mut();
        kept.truncate(MAX_KEPT - 1);
        kept.push_front((scene, rig, verdict));
    }
}

/// Refuses scenes of which one would chatter on the connected rig; `what` is what cannot be done with it. With the
/// refusal comes the index of that scene.
///
/// # Errors
/// It would, or nobody can tell in time.
pub(super) async fn refuse_chatter(rig: &KnownRig, scenes: &[Rc<Scene>], what: &str) -> Result<(), (usize, WireError)> {
    let basis = rig.trial_basis(None);
    for (chunk, first) in scenes.chunks(MAX_AT_A_TIME).zip((0..).step_by(MAX_AT_A_TIME)) {
        match first_chatter(&rig.verdicts, chunk, basis.rig).await {
            Ok(None) => {}
            Ok(Some(Chatter { index, worst, gentler })) => {
                let error = refusal(what, &chunk[index], &basis, &worst, gentler.as_ref());
                return Err((first + index, error));
            }
            Err(error) => {
                let message =
                    format!("cannot {what}: whether the scene would chatter on this rig is not known: {error}");
                return Err((first, WireError::new(ErrorCode::WouldChatter, message)));
            }
        }
    }
    Ok(())
}

/// Why the active scene would not be engaged, where it would chatter; `None` where it would not, or nobody can tell in
/// a moment.
pub(super) async fn problem(rig: &KnownRig, scene: Rc<Scene>) -> Option<Problem> {
    if rig.verdicts.workers.is_busy() {
        return None;
    }
    let basis = rig.trial_basis(None);
    let found = first_chatter(&rig.verdicts, &[scene], basis.rig).await;
    found.ok().flatten().map(|chatter| Problem {
        what: what_it_does(&basis, &chatter.worst),
        remedy: remedy(chatter.gentler.as_ref()),
    })
}

/// Tries the scenes that were not tried yet, until one is found that would chatter. One that cannot be rendered is
/// refused as such, elsewhere.
async fn first_chatter(verdicts: &Verdicts, scenes: &[Rc<Scene>], rig: TrialRig) -> Result<Option<Chatter>, WorkError> {
    let mut untried = Vec::new();
    for (index, scene) in scenes.iter().enumerate() {
        match verdicts.known(scene, &rig) {
            None => untried.push((index, Scene::clone(scene))),
            Some(None) => {}
            Some(Some(chatter)) => return Ok(Some(Chatter { index, ..chatter })),
        }
    }
    if untried.is_empty() {
        return Ok(None);
    }
    let tried: Vec<Scene> = untried.iter().map(|(_, scene)| scene.clone()).collect();
    let search = move || {
        let restless = |scene| worst_trial(scene, &rig).ok().flatten().filter(|worst| !worst.is_calm());
        tried
            .iter()
            .enumerate()
            .find_map(|(place, scene)| Some((place, restless(scene)?)))
    };
    let begun = Instant::now();
    let found = verdicts.workers.run(TIMEOUT, search).await?;
    let calm = found.map_or(untried.len(), |(place, _)| place);
    for (_, scene) in untried.drain(..calm) {
        verdicts.keep(scene, rig, None);
    }
    let (Some((_, worst)), Some((index, scene))) = (found, untried.into_iter().next()) else {
        return Ok(None);
    };
    let tried = scene.clone();
    let left = MAX_WITH_SEARCH.saturating_sub(begun.elapsed());
    let search = verdicts.workers.run(left, move || gentler(&tried, &rig)).await;
    let is_over = search.is_ok();
    let chatter = Chatter {
        index,
        worst,
        gentler: search.unwrap_or_default(),
    };
    if is_over {
        verdicts.keep(scene, rig, Some(chatter.clone()));
    }
    Ok(Some(chatter))
}

/// The stiffest grip that the connected rig bears with a factor of two, as it was found just now, whatever its mass where
/// that is not known; `None` where there is none, or nobody can tell in time.
pub(super) async fn stiffest_coupling(rig: &KnownRig, found: Findings) -> Option<Coupling> {
    let rigs = rig.trial_basis(Some(found)).of_every_mass();
    let search = rig
        .verdicts
        .workers
        .run(MAX_FOR_COUPLING, move || trial::stiffest_coupling(&rigs));
    search.await.unwrap_or_default()
}

fn refusal(what: &str, scene: &Scene, basis: &TrialBasis, worst: &Trial, gentler: Option<&Gentler>) -> WireError {
    let message = format!("cannot {what}: {}; {}", what_it_does(basis, worst), remedy(gentler));
    let error = WireError::new(ErrorCode::WouldChatter, message);
    // Where only two together pass, one of them alone would be refused again.
    let only = gentler.filter(|changes| changes.len() == 1);
    let only = only.and_then(|changes| changes.first());
    match only.and_then(|(key, most)| Some((key, scene.value(key.parameter)?.greatest(), most))) {
        Some((key, value, most)) => {
            let unit = key.parameter.info().unit;
            error.about(key.to_string()).within(value, 0.0, *most, unit)
        }
        None => {
            let (measure_per_s, most_per_s) = worst.measure_per_s();
            error.within(measure_per_s, 0.0, most_per_s, "1/s")
        }
    }
}

fn what_it_does(basis: &TrialBasis, worst: &Trial) -> String {
    let allowed = format!(
        "{} changes and {} jumps",
        number(MAX_SIGN_CHANGES_PER_S),
        number(MAX_JUMPS_PER_S)
    );
    let mut message = format!("the scene would chatter on this rig: {worst} (allowed are {allowed})");
    if basis.rig.delay_s >= LATE_S {
        message.push_str(&format!(
            "; its link is late: {:.0} ms from a sample to the force for it",
            1e3 * basis.rig.delay_s
        ));
    }
    if let Some(mass_kg) = basis.assumed_mass_kg {
        let measure = if basis.is_plane {
            "commission --motor N"
        } else {
            "identify --rig"
        };
        message.push_str(&format!(
            "; its mass is not known, and taken as {} kg: `haptic-ctl {measure}` measures it",
            number(mass_kg)
        ));
    }
    if let Some(at) = basis.lightest_at {
        message.push_str(&format!("; the rig is the lightest {at}"));
    }
    message
}

fn remedy(gentler: Option<&Gentler>) -> String {
    let gentler = gentler.map(|changes| {
        let values: Vec<String> = changes
            .iter()
            .map(|(key, value)| format!("{key} = {} {}", number(*value), key.parameter.info().unit))
            .collect();
        format!(
            "{} would pass with a factor of {}",
            values.join(" and "),
            number(FACTOR)
        )
    });
    let gentler = gentler.unwrap_or_else(|| "`haptic-ctl advise` has the bounds that it breaks".to_owned());
    gentler + ANYWAY
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::rig::fixture::rig;
    use haptic_ipc::UNKNOWN_MASS_KG;

    #[test]
    fn the_grip_of_a_rig_of_unknown_mass_is_one_for_every_mass() {
        let (rig, _loop_side) = rig();
        let stiffness = |mass_kg| {
            let found = Findings {
                friction_n: Some(0.15),
                mass_kg,
                ..Findings::default()
            };
            let grip = trial::stiffest_coupling(&rig.known.trial_basis(Some(found)).of_every_mass());
            grip.expect("there is one").stiffness
        };
        let of_known = UNKNOWN_MASS_KG.map(|mass_kg| stiffness(Some(mass_kg)));
        let of_any = stiffness(None);
        assert!(
            of_known.iter().all(|known| of_any <= *known),
            "{of_any} N/m, {of_known:?} N/m"
        );
    }
}
