//! `reload`, and SIGHUP: reads the configuration's limits again, and looks through the library, while force flows on.
//!
//! All of the file is checked before anything of it takes effect. Only limits take effect; what needs a restart is
//! named. The scenes of the library are read whenever one is asked for, so here they are only looked through.

use crate::config::{ConfigError, ReloadedLimits};
use crate::control::journal::Completion;
use crate::control::{RigHandle, library};
use crate::service::ServiceManager;
use crate::shutdown::SignalWakeup;
use haptic_ipc::{ErrorCode, JournalEntry, LimitsChange, Peer, ReloadReply, WireError};
use std::cell::{Ref, RefCell};
use std::rc::Rc;
use std::sync::Arc;
use tokio::sync::Mutex;

/// What is kept of reloads.
#[derive(Debug, Default)]
pub(crate) struct Reloads {
    /// One at a time.
    turn: Arc<Mutex<()>>,
    refusal: RefCell<Option<String>>,
}

impl Reloads {
    /// Why the newest one was refused, if it was.
    pub(crate) fn refusal(&self) -> Ref<'_, Option<String>> {
        self.refusal.borrow()
    }
}

/// Reloads, for a client or for a signal.
///
/// # Errors
/// The configuration file cannot be read or has an invalid value, which changes nothing; or the real-time thread does
/// not answer.
pub(super) async fn reload(rig: &Rc<RigHandle>, by: Option<Peer>) -> Result<ReloadReply, WireError> {
    let turn = Arc::clone(&rig.reloads.turn).lock_owned().await;
    let rig = Rc::clone(rig);
    // A task of its own: a client that goes away does not leave it half-way.
    let done = tokio::task::spawn_local(async move {
        let _turn = turn;
        let done = reread(&rig).await;
        let (op, message) = match &done {
            Ok(reply) => ("reload", reply.to_string()),
            Err(error) if error.code == ErrorCode::ConfigFile => {
                ("reload_refused", format!("{}: nothing has changed", error.message))
            }
            // The loop may yet take the limits.
            Err(error) => ("reload_refused", error.message.clone()),
        };
        *rig.reloads.refusal.borrow_mut() = done.as_ref().err().map(|error| error.message.clone());
        let entry = JournalEntry {
            by,
            message: Some(message),
            tick: done.as_ref().ok().and_then(|reply| Some(reply.limits?.tick)),
            ..JournalEntry::of(op)
        };
        rig.enter(Completion::Done, entry);
        done
    });
    done.await.unwrap_or_else(|error| Err(refusal(&error.to_string())))
}

async fn reread(rig: &RigHandle) -> Result<ReloadReply, WireError> {
    let configuration = rig.facts.configuration.clone();
    let read = rig.library.on_disk(move || configuration.reload()).await;
    let ReloadedLimits { limits, needs_restart } = match read {
        Ok(read) => read.map_err(|error| refused(&error))?,
        Err(error) => {
            let path = rig.facts.configuration.path().unwrap_or("configuration".as_ref());
            return Err(refusal(&format!("{}: {error}", path.display())));
        }
    };
    let (changed_scene, scene_problems) = library::look_through(rig).await;
    let before = rig.facts.limits();
    let tick = if limits == before {
        None
    } else {
        Some(rig.change_limits(limits).await?)
    };
    Ok(ReloadReply {
        file: rig.facts.configuration.path().map(|path| path.display().to_string()),
        limits: tick.map(|tick| LimitsChange {
            before,
            after: limits,
            tick,
        }),
        needs_restart,
        changed_scene,
        scene_problems,
    })
}

fn refusal(message: &str) -> WireError {
    WireError::new(ErrorCode::ConfigFile, message).about("config")
}

fn refused(error: &ConfigError) -> WireError {
    let refusal = refusal(&error.to_string());
    match error.innermost() {
        ConfigError::OutOfRange {
            name,
            value,
            min,
            max,
            unit,
        } => refusal.about(*name).within(*value, *min, *max, unit),
        _ => refusal,
    }
}

/// Reloads whenever a signal asks for it, for ever. Signals that come during a reload ask for one more.
pub(crate) async fn on_signal(rig: &Rc<RigHandle>, manager: &ServiceManager, asked: SignalWakeup) {
    while asked.next().await.is_ok() {
        manager.reloading();
        // The journal has what came of it.
        drop(reload(rig, None).await);
        manager.reloaded();
    }
    std::future::pending::<()>().await;
}
