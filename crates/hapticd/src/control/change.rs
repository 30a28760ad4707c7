//! How a scene changes: checked, compiled, handed over, and answered with the tick that rendered
//! it. `set`, `scene.load`, `undo` and `redo` all go this way.

use crate::control::history::{Drag, History, Move, Origin};
use crate::control::peer::Requester;
use crate::control::rig::schedule::NewChange;
use crate::control::rig::{Compiled, Suited};
use crate::control::{RigHandle, advise, exclusive_use, judge, library};
use haptic_core::scene::FileCoupling;
use haptic_core::{Direction, Directional, Parameter, ParameterKey, Scene};
use haptic_ipc::{
    ChangeOptions, ChangeReply, Changes, Difference, ErrorCode, JournalEntry, SceneRef, Value, WireError, differences,
};
use std::collections::BTreeMap;
use std::rc::Rc;

/// A change that the real-time thread has yet to render or to schedule, or a dry run.
#[derive(Debug)]
pub(super) struct PendingChange {
    reply: ChangeReply,
    /// Length of the ramp, ticks.
    ramp_ticks: Option<u64>,
}

impl PendingChange {
    /// The answer, after the tick that first rendered it.
    ///
    /// # Errors
    /// The real-time thread does not answer; if it continues, it will render the scene.
    pub(super) async fn finished(&self, rig: &RigHandle) -> Result<ChangeReply, WireError> {
        let mut reply = self.reply.clone();
        if reply.changed && reply.at_tick.is_none() {
            let tick = rig.rendered(reply.revision).await?;
            reply.tick = Some(tick);
            reply.ramp_ends_tick = self.ramp_ticks.map(|ticks| tick + ticks);
        }
        Ok(reply)
    }
}

/// Begins a change of parameters.
///
/// # Errors
/// The change is refused, and nothing has changed.
pub(super) async fn set(
    rig: &RigHandle,
    by: Requester<'_>,
    params: &Changes,
    merge: bool,
    options: ChangeOptions,
) -> Result<PendingChange, WireError> {
    let prepare = |before: &Scene| {
        let changes = params.resolve(before)?;
        let scene = before.with_unvalidated(&changes)?;
        let dragged = Drag {
            session: by.session,
            parameters: changes.iter().map(|(key, _)| *key).collect(),
            goes_on: merge,
        };
        Ok(Step {
            scene: scene.into(),
            step: Move::Merge(dragged),
            applied: Some(changes),
        })
    };
    begin(rig, by, "set", options, prepare).await
}

/// Begins to load another scene.
///
/// # Errors
/// The scene is unknown or refused, and nothing has changed.
pub(super) async fn load(
    rig: &RigHandle,
    by: Requester<'_>,
    scene: SceneRef,
    options: ChangeOptions,
) -> Result<PendingChange, WireError> {
    let (file, origin) = library::find_with_origin(rig, scene).await?;
    let of = rig.known.coupling_owner();
    let scene = Rc::new(file.clone().on(rig.known.coupling()));
    let prepare = |_: &Scene| Ok(Step::to(Rc::clone(&scene), Move::Load(origin.clone())));
    let begun = begin(rig, by, "scene.load", options, prepare).await?;
    if begun.reply.changed && file.has_coupling_of_rig() {
        let revision = begun.reply.revision;
        rig.known.suited.replace(Some(Suited { file, revision, of }));
    }
    Ok(begun)
}

/// Begins to undo the newest change.
///
/// # Errors
/// There is nothing to undo, or the scene cannot be rendered; nothing has changed.
pub(super) async fn undo(
    rig: &RigHandle,
    by: Requester<'_>,
    options: ChangeOptions,
) -> Result<PendingChange, WireError> {
    let nothing = (ErrorCode::NothingToUndo, "no change is left in the history");
    let step = |history: &History| Some(Step::to(Rc::clone(history.undo_scene()?), Move::Undo));
    retrace(rig, by, "undo", options, step, nothing).await
}

/// Begins to redo the change that was undone last.
///
/// # Errors
/// There is nothing to redo, or the scene cannot be rendered; nothing has changed.
pub(super) async fn redo(
    rig: &RigHandle,
    by: Requester<'_>,
    options: ChangeOptions,
) -> Result<PendingChange, WireError> {
    let nothing = (
        ErrorCode::NothingToRedo,
        "no change was undone, or the scene was changed since",
    );
    let step = |history: &History| Some(Step::to(Rc::clone(history.redo_scene()?), Move::Redo));
    retrace(rig, by, "redo", options, step, nothing).await
}

/// Begins a step along the history, or says why there is none.
async fn retrace(
    rig: &RigHandle,
    by: Requester<'_>,
    op: &str,
    options: ChangeOptions,
    step: impl Fn(&History) -> Option<Step>,
    (code, why): (ErrorCode, &str),
) -> Result<PendingChange, WireError> {
    no_tick(op, options)?;
    let prepare =
        |_: &Scene| step(&rig.history()).ok_or_else(|| WireError::new(code, format!("nothing to {op}: {why}")));
    begin(rig, by, op, options, prepare).await
}

/// Gives the scene the coupling of the rig, once that is known, and again for each other rig: where its file leaves it
/// to the rig, and where nobody has named a scene and the rig bears only a softer one. As long as nobody has changed
/// the scene since, and no force may flow.
pub(super) fn suit_the_rig(rig: &RigHandle) {
    let (newest, before) = rig.base(false);
    let suited = match &*rig.known.suited.borrow() {
        Some(suited) if suited.revision == newest => suited.clone(),
        _ => return,
    };
    if rig.channel.may_have_force() || refuse_others(rig).is_err() {
        return;
    }
    let (file, of) = (&suited.file, rig.known.coupling_owner());
    // A delay is measured anew each time, and changes nothing twice.
    if !of.is_commissioned && of == suited.of {
        return;
    }
    let scene = match (&file.coupling, rig.known.coupling()) {
        (Some(FileCoupling::Own(own)), Some(softer)) if softer.stiffness < own.stiffness => Scene {
            coupling: Some(softer),
            ..file.clone().on(None)
        },
        (_, of_rig) => file.clone().on(of_rig),
    };
    let is_now = |revision| {
        let (file, of) = (file.clone(), of.clone());
        rig.known.suited.replace(Some(Suited { file, revision, of }));
    };
    if *before == scene {
        is_now(newest);
        return;
    }
    let scene = Rc::new(scene);
    // What a rig bears is a valid coupling; with another the scene stays as it is.
    let Ok(compiled) = rig.compile(&scene, 0.0) else { return };
    let entry = JournalEntry {
        changes: differences(&before, &scene),
        message: Some("the coupling that this rig bears".to_owned()),
        ..JournalEntry::of("scene.load")
    };
    let origin = match rig.history().origin() {
        Some(origin) if file.has_coupling_of_rig() => Some(Rc::new(Origin {
            name: origin.name.clone(),
            scene: Scene::clone(&scene),
        })),
        _ => None,
    };
    is_now(rig.apply(scene, compiled, Move::Load(origin), entry));
}

/// Where a change leads from a scene.
struct Step {
    scene: Rc<Scene>,
    step: Move,
    /// The values that were asked for, where values were.
    applied: Option<Vec<(ParameterKey, f64)>>,
}

impl Step {
    fn to(scene: Rc<Scene>, step: Move) -> Self {
        Self {
            scene,
            step,
            applied: None,
        }
    }
}

/// Begins a change that leads from the scene before it to what `prepare` says. While force may flow a scene that would
/// chatter is refused. Its trial gives others time to change the scene: then the change begins again from there.
async fn begin(
    rig: &RigHandle,
    by: Requester<'_>,
    op: &str,
    options: ChangeOptions,
    prepare: impl Fn(&Scene) -> Result<Step, WireError>,
) -> Result<PendingChange, WireError> {
    let mut judged: Option<Rc<Scene>> = None;
    loop {
        let (newest, before) = rig.base(options.at_tick.is_some());
        let step = prepare(&before)?;
        check_revision(options.if_revision, newest)?;
        let is_new = before != step.scene && judged.as_ref() != Some(&step.scene);
        if options.anyway || !is_new || !rig.channel.may_have_force() {
            return begin_from(rig, by, op, (newest, before), options, step);
        }
        let refused = judge::refuse_chatter(&rig.known, std::slice::from_ref(&step.scene), "change the scene").await;
        refused.map_err(|(_, error)| error)?;
        judged = Some(step.scene);
    }
}

/// Compiles a scene, which validates it, and hands it over. Nothing else happens meanwhile: the scene before it is
/// still the newest one.
fn begin_from(
    rig: &RigHandle,
    by: Requester<'_>,
    op: &str,
    (newest, before): (u64, Rc<Scene>),
    options: ChangeOptions,
    Step { scene, step, applied }: Step,
) -> Result<PendingChange, WireError> {
    let ramp_ms = options.ramp_ms.unwrap_or(0.0);
    let compiled = match options.at_tick {
        Some(_) => Compiled::new(&before, &scene, &rig.facts, ramp_ms * 1e-3),
        None => rig.compile(&scene, ramp_ms * 1e-3),
    }?;
    let ramp_ticks = compiled.ramp_ticks;
    let changes = differences(&before, &scene);
    let reply = ChangeReply {
        dry_run: options.dry_run,
        applied: applied.map_or_else(
            || values_set(&changes),
            |asked| asked.iter().map(|(key, value)| (key.to_string(), *value)).collect(),
        ),
        advice: advise::warnings(&rig.known, &scene),
        changes,
        ..ChangeReply::default()
    };
    // Setting the current value is a no-op: it adds no step to the history and no revision, so
    // other clients' revisions stay current.
    let is_noop = before == scene && !rig.is_ramping();
    let entry = JournalEntry {
        by: Some(by.peer.clone()),
        changes: reply.changes.clone(),
        ramp_ms: (ramp_ms > 0.0).then_some(ramp_ms),
        at_tick: options.at_tick,
        ..JournalEntry::of(op)
    };
    let revision = match options.at_tick {
        Some(at_tick) => {
            let change = NewChange {
                at_tick,
                scene,
                compiled,
                step: on_its_own(step),
                entry,
            };
            schedule(rig, by, newest, change, options.dry_run || is_noop)?
        }
        None if options.dry_run || (is_noop && rig.history_mut().is_noop(&step)) => None,
        None => {
            refuse_others(rig)?;
            Some(rig.apply(scene, compiled, step, entry))
        }
    };
    let at_tick = options.at_tick.filter(|_| revision.is_some());
    Ok(PendingChange {
        reply: ChangeReply {
            revision: revision.unwrap_or(newest),
            changed: revision.is_some(),
            at_tick,
            ramp_ends_tick: at_tick.zip(ramp_ticks).map(|(at_tick, ticks)| at_tick + ticks),
            ..reply
        },
        ramp_ticks,
    })
}

/// Refuses a change at once while the rig is somebody's alone, or other changes come before it.
fn refuse_others(rig: &RigHandle) -> Result<(), WireError> {
    exclusive_use::refuse_others(rig, "change the scene")?;
    rig.schedule().refuse("change the scene")
}

/// Schedules a change, and returns its revision; one that is only tried, or changes nothing, has none.
fn schedule(
    rig: &RigHandle,
    by: Requester<'_>,
    newest: u64,
    change: NewChange,
    is_only_tried: bool,
) -> Result<Option<u64>, WireError> {
    if is_only_tried {
        rig.check_schedule(by.session, &[change])?;
        return Ok(None);
    }
    exclusive_use::refuse_others(rig, "change the scene")?;
    rig.schedule_changes(by, false, newest, vec![change]).map(Some)
}

/// The effect on the history of a change that other changes may come before: it is no part of a drag.
fn on_its_own(step: Move) -> Move {
    match step {
        Move::Merge(_) => Move::Forward,
        step => step,
    }
}

/// Refuses a tick where the change depends on the history of that tick.
fn no_tick(op: &str, options: ChangeOptions) -> Result<(), WireError> {
    let Some(at_tick) = options.at_tick else { return Ok(()) };
    let message = format!(
        "`{op}` takes no at_tick = {at_tick}: what it leads to depends on the changes before that tick; schedule \
         `scene.load` with the number of a revision"
    );
    Err(WireError::new(ErrorCode::BadRequest, message).about("at_tick"))
}

/// Refuses a change that was meant for a revision that is not the newest.
pub(super) fn check_revision(if_revision: Option<u64>, newest: u64) -> Result<(), WireError> {
    let Some(wanted) = if_revision.filter(|wanted| *wanted != newest) else {
        return Ok(());
    };
    let message = format!("if_revision = {wanted}, but the scene is at revision {newest}: read it again");
    #[expect(clippy::cast_precision_loss, reason = "revisions are below 2^53")]
    let (wanted, newest) = (wanted as f64, newest as f64);
    Err(WireError::new(ErrorCode::Conflict, message)
        .about("if_revision")
        .within(wanted, newest, newest, "1"))
}

/// The values that the change of scene sets, by full name.
pub(super) fn values_set(changes: &[Difference]) -> BTreeMap<String, f64> {
    let mut applied = BTreeMap::new();
    for change in changes {
        if let (Some(Value::Number(value)), Ok(key)) = (&change.after, change.param.parse::<ParameterKey>()) {
            let values = keyed(key.parameter, *value).into_iter();
            applied.extend(values.map(|(key, value)| (key.to_string(), value)));
        }
    }
    applied
}

/// The values of a parameter: under its own key where both directions are alike, else under that of each direction.
pub(super) fn keyed(parameter: Parameter, value: Directional) -> Vec<(ParameterKey, f64)> {
    if value.is_symmetric() {
        return vec![(parameter.into(), value.positive)];
    }
    Direction::BOTH
        .map(|direction| (parameter.in_direction(direction), value.get(direction)))
        .into()
}
