//! Dispatches each request to the file of its operation, and writes its answer.

use super::{Answer, Client};
use crate::control::admission::Admission;
use crate::control::change::{self, PendingChange};
use crate::control::peer::Requester;
use crate::control::places::MAX_CLIENTS;
use crate::control::rig::commission_record::Findings;
use crate::control::rig::{Asked, ReadAfter};
use crate::control::schedule::ScheduleOptions;
use crate::control::{
    advise, commission, devices, hand, home, identify, lease, library, reload, schedule, status, subscribe,
};
use crate::rt::handoff::Outcome;
use haptic_core::servo::Command;
use haptic_ipc::{Description, Envelope, ErrorCode, Request, Rights, StateReply, WireError};
use serde::Serialize;

/// Default number of entries in the answer to `log`: a line with more is hard to read.
const DEFAULT_LOG_LIMIT: usize = 100;

impl Client {
    /// Carries out a request; a change of scene is only begun.
    pub(super) async fn dispatch(&self, envelope: Envelope, read_after: ReadAfter) -> Answer {
        let id = Some(envelope.id);
        let (rig, by) = (&*self.rig, self.by());
        // What the client was sent is in what it reads, and all that is read here is of one moment.
        rig.pump();
        if let Some(refusal) = self.refusal(&envelope.request) {
            return Answer::Now(answer::<()>(id, Err(refusal)));
        }
        // Those that bring no force.
        let command = async |command| {
            let asked = Asked::By(by.peer);
            rig.carry_out(command, Admission::NONE, read_after.stops, asked)
                .await
                .map(reply)
        };
        let begun = |begun: Result<PendingChange, WireError>| match begun {
            Ok(change) => Answer::OnceRendered(envelope.id, change),
            Err(error) => Answer::Now(answer::<()>(id, Err(error))),
        };
        Answer::Now(match envelope.request {
            Request::Set { params, merge, options } => {
                return begun(change::set(rig, by, &params, merge, options).await);
            }
            Request::SceneLoad { scene, options } => return begun(change::load(rig, by, scene, options).await),
            Request::Undo { options } => return begun(change::undo(rig, by, options).await),
            Request::Redo { options } => return begun(change::redo(rig, by, options).await),
            Request::Describe {} => {
                let description = Description {
                    sample_columns: rig.facts.sample_columns(),
                    ..Description::of(&rig.scene())
                };
                answer(id, Ok(description))
            }
            Request::Get { scene } => answer(id, library::get(rig, scene).await),
            Request::SceneSave { name, scene, replace } => {
                answer(id, library::save(rig, by.peer, name, scene, replace).await)
            }
            Request::SceneList {} => answer(id, rig.library.list().await),
            Request::SceneDiff { from, to } => answer(id, library::diff(rig, from, to).await),
            Request::SceneDelete { name } => answer(id, library::delete(rig, by.peer, name).await),
            Request::SceneRename { name, to, replace } => {
                answer(id, library::rename(rig, by.peer, name, to, replace).await)
            }
            Request::Schedule {
                changes,
                name,
                keep,
                if_revision,
                dry_run,
                anyway,
            } => {
                let options = ScheduleOptions {
                    name,
                    keep,
                    if_revision,
                    dry_run,
                    anyway,
                };
                answer(id, schedule::schedule(rig, by, changes, options).await)
            }
            Request::ScheduleCancel { name } => answer(id, schedule::cancel(rig, by, name.as_deref())),
            Request::Engage { anyway } => answer(id, rig.engage(anyway, read_after, by).await.map(reply)),
            Request::Release {} => answer(id, command(Command::Release).await),
            Request::Reset {} => answer(id, command(Command::Reset).await),
            // It was raised when its line was read.
            Request::Stop {} => {
                let stopped = rig.stopped(read_after.stops).await;
                answer(id, stopped.map(|(tick, state)| StateReply { state, tick }))
            }
            Request::Status {} => answer(id, Ok(status::status(rig).await)),
            Request::Timing {} => answer(id, Ok(rig.feed().timing_report())),
            Request::Devices { probe } => answer(id, devices::devices(&rig.known, probe).await),
            Request::Advise {} => answer(id, Ok(advise::advise(rig))),
            Request::Subscribe {
                topics,
                rate_hz,
                batch_ms,
            } => {
                let outlet = (&self.lines, &self.events);
                answer(
                    id,
                    subscribe::subscribe(rig, self.session, outlet, &topics, rate_hz, batch_ms),
                )
            }
            Request::Log { after, limit } => {
                let limit = limit.unwrap_or(DEFAULT_LOG_LIMIT);
                answer(id, Ok(rig.journal(after.unwrap_or(0), limit)))
            }
            Request::Reload {} => answer(id, reload::reload(&self.rig, Some(by.peer.clone())).await),
            Request::Lease { timeout_ms } => answer(id, Ok(lease::lease(rig, by, timeout_ms))),
            Request::Hand { target_m } => answer(id, hand::point(&rig.facts, by, target_m)),
            Request::Home {} => answer(id, home::home(rig, by).await),
            Request::CommissionBegin { motor, check } => {
                answer(id, commission::begin(rig, by, motor, check == Some(true)).await)
            }
            Request::CommissionPulse { force_n, duration_ms } => {
                answer(id, commission::pulse(&self.rig, by, force_n, duration_ms).await)
            }
            Request::CommissionStatus {} => answer(id, commission::status(rig, by)),
            Request::CommissionStore {
                range_m,
                friction_n,
                mass_kg,
            } => {
                let findings = Findings {
                    range_m,
                    friction_n,
                    mass_kg,
                    ..Findings::default()
                };
                answer(id, commission::store(rig, by, findings).await)
            }
            Request::CommissionEnd {} => answer(id, commission::end(rig, by)),
            Request::CommissionConfirm {} => answer(id, commission::confirm(rig, by).await),
            Request::IdentifyBegin { range_m } => answer(id, identify::begin(rig, by, range_m).await),
            Request::IdentifyExcite { excitation } => answer(id, identify::excite(&self.rig, by, excitation).await),
            Request::IdentifyStatus {} => answer(id, identify::status(rig, by)),
            Request::IdentifyStore { friction } => answer(id, identify::store(rig, by, friction).await),
            Request::IdentifyEnd {} => answer(id, identify::end(rig, by)),
        })
    }

    /// The refusal of a request that the client's rights do not cover.
    fn refusal(&self, request: &Request) -> Option<WireError> {
        match self.rights {
            Rights::All => None,
            Rights::Watch => (!request.is_for_watchers()).then(only_watching),
            // Every client may stop.
            Rights::Stop | Rights::Unknown => (*request != (Request::Stop {})).then(|| self.only_stopping()),
        }
    }

    /// The refusal of a newcomer.
    pub(super) fn only_stopping(&self) -> WireError {
        let places = self.newcomer.as_ref().map_or(MAX_CLIENTS, |newcomer| newcomer.places);
        let message = format!(
            "{places} clients are connected, the maximum: close one first; until then only `stop` is served, to who asks \
             for it at once: if the motor pulls and you cannot stop it, cut the power"
        );
        WireError::new(ErrorCode::TooManyClients, message)
    }

    fn by(&self) -> Requester<'_> {
        Requester {
            session: self.session,
            peer: &self.peer,
        }
    }
}

fn only_watching() -> WireError {
    let message = "this socket only serves watching and `stop`: connect to the control socket to change anything";
    WireError::new(ErrorCode::ReadOnly, message)
}

fn reply(outcome: Outcome) -> StateReply {
    StateReply {
        state: outcome.state,
        tick: outcome.tick,
    }
}

/// An answer, serialised without a tree of values in between: some are long.
#[derive(Serialize)]
struct Reply<T> {
    id: Option<u64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    ok: Option<T>,
    #[serde(skip_serializing_if = "Option::is_none")]
    error: Option<WireError>,
}

/// The line that answers a request.
pub(super) fn answer<T: Serialize>(id: Option<u64>, result: Result<T, WireError>) -> String {
    let (ok, error) = match result {
        Ok(ok) => (Some(ok), None),
        Err(error) => (None, Some(error)),
    };
    line(&Reply { id, ok, error })
}

/// A message as a line.
pub(super) fn line(message: &impl Serialize) -> String {
    let mut line = serde_json::to_string(message).expect("messages hold nothing that JSON cannot");
    line.push('\n');
    line
}
