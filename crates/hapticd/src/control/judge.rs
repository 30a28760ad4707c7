//! The judgement of a scene before a motor pulls a hand by it: it is tried on the connected rig, as far as that is known,
//! off this thread and off the loop. A stop waits for no trial.

use crate::control::RigHandle;
use crate::control::rig::commission_record::Findings;
use crate::control::rig_friction::{TrialBasis, trial_basis};
use crate::control::trial::{self, FACTOR, Gentler, MOST_SIGN_CHANGES_PER_S, Trial, TrialRig, gentler, worst_trial};
use crate::control::worker_pool::{WorkError, WorkerPool};
use haptic_core::Scene;
use haptic_core::scene::Coupling;
use haptic_ipc::quantity::number;
use haptic_ipc::{ErrorCode, WireError};
use std::cell::RefCell;
use std::collections::VecDeque;
use std::rc::Rc;
use std::time::Duration;

/// Verdicts that are kept: a slider that goes to and fro asks for the same ones again.
const MOST_KEPT: usize = 32;

/// Trials at a time.
const MOST_WORKERS: usize = 2;

/// Longest time that a trial may take: some milliseconds, or some seconds on a machine that has no time for it. Clients
/// wait for 5 s.
const LONGEST: Duration = Duration::from_secs(3);

/// Longest time of a search for what would pass: a tenth of a second. Without it there is a refusal all the same.
const LONGEST_SEARCH: Duration = Duration::from_millis(1500);

/// What came of the trials of a scene.
#[derive(Clone, Debug, PartialEq)]
enum Verdict {
    Calm,
    Chatters { worst: Trial, gentler: Option<Gentler> },
}

/// The verdicts so far, and the threads that find new ones.
#[derive(Debug)]
pub(super) struct Verdicts {
    kept: RefCell<VecDeque<(Scene, TrialRig, Verdict)>>,
    workers: WorkerPool,
}

impl Default for Verdicts {
    fn default() -> Self {
        Self {
            kept: RefCell::default(),
            workers: WorkerPool::new("trial", MOST_WORKERS),
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
        kept.truncate(MOST_KEPT - 1);
        kept.push_front((scene, rig, verdict));
    }
}

/// Refuses a scene that would chatter on the connected rig; `what` is what cannot be done with it.
///
/// # Errors
/// It would, or nobody can tell in time.
pub(super) async fn refuse_chatter(rig: &RigHandle, scene: &Rc<Scene>, what: &str) -> Result<(), WireError> {
    let basis = trial_basis(rig, None);
    match verdict(rig.verdicts(), scene, basis.rig).await {
        Ok(Verdict::Calm) => Ok(()),
        Ok(Verdict::Chatters { worst, gentler }) => Err(refusal(what, scene, &basis, &worst, gentler.as_ref())),
        Err(error) => {
            let message = format!("cannot {what}: whether the scene would chatter on this rig is not known: {error}");
            Err(WireError::new(ErrorCode::WouldChatter, message))
        }
    }
}

/// Tries a scene that was not tried yet. One that cannot be rendered is refused as such, elsewhere.
async fn verdict(verdicts: &Verdicts, scene: &Rc<Scene>, rig: TrialRig) -> Result<Verdict, WorkError> {
    if let Some(known) = verdicts.known(scene, &rig) {
        return Ok(known);
    }
    let tried = Scene::clone(scene);
    let worst = verdicts.workers.run(LONGEST, move || worst_trial(&tried, &rig)).await?;
    let verdict = match worst {
        Ok(Some(worst)) if !worst.is_calm() => {
            let tried = Scene::clone(scene);
            let search = verdicts.workers.run(LONGEST_SEARCH, move || gentler(&tried, &rig));
            let gentler = search.await.unwrap_or_default();
            Verdict::Chatters { worst, gentler }
        }
        _ => Verdict::Calm,
    };
    verdicts.keep(Scene::clone(scene), rig, verdict.clone());
    Ok(verdict)
}

/// The stiffest grip that the connected rig bears with a factor of two, as it was found just now; `None` where there is
/// none, or nobody can tell in time.
pub(super) async fn stiffest_coupling(rig: &RigHandle, found: Findings) -> Option<Coupling> {
    let on = trial_basis(rig, Some(found)).rig;
    let search = rig
        .verdicts()
        .workers
        .run(LONGEST_SEARCH, move || trial::stiffest_coupling(&on));
    search.await.unwrap_or_default()
}

fn refusal(what: &str, scene: &Scene, basis: &TrialBasis, worst: &Trial, gentler: Option<&Gentler>) -> WireError {
    let most = number(MOST_SIGN_CHANGES_PER_S);
    let mut message =
        format!("cannot {what}: the scene would chatter on this rig: {worst} (allowed are {most} changes)");
    if let Some(mass_kg) = basis.assumed_mass_kg {
        message.push_str(&format!(
            "; its mass is not known, and taken as {} kg: `haptic-ctl identify --rig` measures it",
            number(mass_kg)
        ));
    }
    let remedy = gentler.map(|changes| {
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
    let remedy = remedy.unwrap_or_else(|| "`haptic-ctl advise` has the bounds that it breaks".to_owned());
    message.push_str(&format!(
        "; {remedy}; `--anyway` (`\"anyway\":true`) does it all the same"
    ));
    let error = WireError::new(ErrorCode::WouldChatter, message);
    let first = gentler.and_then(|changes| changes.first());
    match first.and_then(|(key, most)| Some((key, scene.value(key.parameter)?.greatest(), most))) {
        Some((key, value, most)) => {
            let unit = key.parameter.info().unit;
            error.about(key.to_string()).within(value, 0.0, *most, unit)
        }
        None => error.within(worst.sign_changes_per_s, 0.0, MOST_SIGN_CHANGES_PER_S, "1/s"),
    }
}
