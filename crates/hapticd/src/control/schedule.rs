//! `schedule` and `schedule.cancel`: changes of the scene in ticks to come.

use crate::control::change::{check_revision, values_set};
use crate::control::history::Move;
use crate::control::peer::Requester;
use crate::control::rig::Compiled;
use crate::control::rig::schedule::NewChange;
use crate::control::{RigHandle, advise, exclusive_use, judge, library};
use haptic_core::Scene;
use haptic_ipc::{
    AcceptedChange, Advice, ErrorCode, JournalEntry, SceneChange, ScheduleCancelReply, ScheduleReply, ScheduledChange,
    WireError, differences,
};
use std::rc::Rc;

/// Longest name of a schedule, bytes.
const MAX_NAME: usize = 64;

/// What `schedule` takes beside the changes.
#[derive(Debug)]
pub(super) struct ScheduleOptions {
    pub(super) name: Option<String>,
    pub(super) keep: bool,
    pub(super) if_revision: Option<u64>,
    pub(super) dry_run: bool,
    pub(super) anyway: bool,
}

/// Schedules changes: all of them, or none.
///
/// # Errors
/// A change is refused, or the schedule as a whole; the error names the change.
pub(super) async fn schedule(
    rig: &RigHandle,
    by: Requester<'_>,
    changes: Vec<ScheduledChange>,
    options: ScheduleOptions,
) -> Result<ScheduleReply, WireError> {
    let (base_revision, mut scene) = rig.base(true);
    check_revision(options.if_revision, base_revision)?;
    let name = match options.name {
        Some(name) => checked_name(rig, name)?,
        // No two begin on the same revision.
        None => format!("from-revision-{}", base_revision + 1),
    };
    let (mut new, mut accepted, mut advice) = (Vec::new(), Vec::new(), Vec::<Advice>::new());
    for (index, change) in changes.into_iter().enumerate() {
        let made = prepare(rig, by, &name, &scene, change).await;
        let change = made.map_err(|error| at_index(error, index))?;
        accepted.push(AcceptedChange {
            at_tick: change.at_tick,
            revision: base_revision + 1 + index as u64,
            applied: values_set(&change.entry.changes),
        });
        for remark in advise::warnings(&rig.known, &change.scene) {
            if !advice.iter().any(|known| known.message == remark.message) {
                advice.push(remark);
            }
        }
        scene = Rc::clone(&change.scene);
        new.push(change);
        // To compile a long ramp takes a while, in which other clients have their turn.
        tokio::task::yield_now().await;
    }
    // As long as no force flows they are judged when it is to.
    if !options.anyway && rig.channel.may_have_force() {
        let scenes: Vec<_> = new.iter().map(|change| Rc::clone(&change.scene)).collect();
        let calm = judge::refuse_chatter(&rig.known, &scenes, "schedule the change").await;
        calm.map_err(|(index, error)| at_index(error, index))?;
    }
    if options.dry_run {
        rig.check_schedule(by.session, &new)?;
    } else {
        exclusive_use::refuse_others(rig, "schedule a change")?;
        rig.schedule_changes(by, options.keep, base_revision, new)?;
    }
    Ok(ScheduleReply {
        name,
        changes: accepted,
        dry_run: options.dry_run,
        advice,
    })
}

/// Compiles a change of a schedule from the scene before it.
async fn prepare(
    rig: &RigHandle,
    by: Requester<'_>,
    name: &str,
    before: &Scene,
    change: ScheduledChange,
) -> Result<NewChange, WireError> {
    let (op, scene, step) = match change.change {
        SceneChange::Params(params) => ("set", before.with_unvalidated(&params.resolve(before)?)?, Move::Forward),
        SceneChange::Scene(scene) => {
            let (file, origin) = library::find_with_origin(rig, scene).await?;
            ("scene.load", file.on(rig.known.coupling()), Move::Load(origin))
        }
    };
    let ramp_ms = change.ramp_ms.filter(|ramp_ms| *ramp_ms > 0.0);
    Ok(NewChange {
        at_tick: change.at_tick,
        compiled: Compiled::new(before, &scene, &rig.facts, ramp_ms.unwrap_or(0.0) * 1e-3)?,
        step,
        entry: JournalEntry {
            by: Some(by.peer.clone()),
            changes: differences(before, &scene),
            ramp_ms,
            at_tick: Some(change.at_tick),
            schedule: Some(name.to_owned()),
            ..JournalEntry::of(op)
        },
        scene: Rc::new(scene),
    })
}

/// Says which change of the schedule an error is about.
fn at_index(error: WireError, index: usize) -> WireError {
    WireError {
        message: format!("changes[{index}]: {}", error.message),
        ..error
    }
}

fn checked_name(rig: &RigHandle, name: String) -> Result<String, WireError> {
    if name.is_empty() || name.len() > MAX_NAME {
        let message = format!(
            "name = {} bytes is out of range: the name of a schedule must have 1 to {MAX_NAME} bytes",
            name.len()
        );
        return Err(WireError::new(ErrorCode::BadName, message).about("name"));
    }
    let waits = |status: &haptic_ipc::ScheduleStatus| status.names.contains(&name);
    if rig.schedule().status().as_ref().is_some_and(waits) {
        let message = format!("a schedule `{name}` waits already: choose another name, or take it back first");
        return Err(WireError::new(ErrorCode::BadName, message).about("name"));
    }
    Ok(name)
}

/// Takes back scheduled changes, of any client.
///
/// # Errors
/// No schedule of this name waits.
pub(super) fn cancel(rig: &RigHandle, by: Requester<'_>, name: Option<&str>) -> Result<ScheduleCancelReply, WireError> {
    let why = "a client has asked for it";
    let cancelled = rig.cancel_schedule(name, Some(by.peer), why).ok_or_else(|| {
        let known = rig.schedule().status().map_or_else(
            || "none waits".to_owned(),
            |status| format!("those that wait are {}", status.names.join(", ")),
        );
        let message = format!("no schedule `{}` waits for its tick: {known}", name.unwrap_or_default());
        WireError::new(ErrorCode::NoSuchSchedule, message).about("name")
    })?;
    Ok(ScheduleCancelReply {
        cancelled,
        changed: cancelled > 0,
    })
}
