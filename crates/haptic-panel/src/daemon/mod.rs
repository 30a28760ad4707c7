//! The daemon as the panel shows it: its mirror, the connection to it, and what became of the user's commands.

pub(crate) mod advice;
pub(crate) mod hand_strip;
mod histogram;
pub(crate) mod readouts;
pub(crate) mod timing_panel;
pub(crate) mod top_bar;

use crate::intent::Intent;
use crate::stop::report::StopReport;
use crate::update::{Answer, StopNews, Update};
use crate::words::significant;
use advice::Advised;
use haptic_core::{Scene, adviser};
use haptic_ipc::socket_path::NamedSocket;
use haptic_ipc::{DaemonMirror, ErrorCode, Event, MirrorChange, RigMirror, RigState, StateReply, WireError};
use haptic_recording::{Metadata, recorded_by};
use std::cell::OnceCell;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// What the panel knows of the daemon and its rig.
#[derive(Debug, Default)]
pub(crate) struct Daemon {
    pub(crate) mirror: DaemonMirror,
    pub(crate) link: Link,
    /// The options with which haptic-ctl finds it; `None` where it needs none.
    ctl_options: Option<String>,
    /// The other rigs of this machine, as they were before the connection.
    pub(crate) rigs: Vec<NamedSocket>,
    /// Whether there was a daemon since the window opened.
    pub(crate) was_connected: bool,
    /// Whether the daemon before had a link to its rig.
    was_linked: bool,
    pub(crate) advised: Advised,
    /// What [`stick_slip`](Self::stick_slip) has reckoned.
    stick_slip: OnceCell<Option<String>>,
    /// The change that was refused last, if that was because the rig would chatter.
    pub(crate) would_chatter: Option<Intent>,
    /// Lines that this program cannot read, and the reason for the last of them.
    pub(crate) unreadable: u64,
    pub(crate) unreadable_reason: String,
    pub(crate) stop: StopReport,
    /// Why the daemon refused to engage, release or reset.
    refusal: Option<WireError>,
    /// Time for which it has sent no sample, once that is too long; else zero.
    pub(crate) no_sample_for: Duration,
}

/// The connection to the daemon.
#[derive(Debug)]
pub(crate) enum Link {
    Connecting { path: PathBuf },
    Connected { path: PathBuf },
    Lost { path: PathBuf, reason: String },
}

impl Link {
    /// The socket of the rig that Stop is for.
    pub(crate) fn path(&self) -> &Path {
        match self {
            Self::Connecting { path } | Self::Connected { path } | Self::Lost { path, .. } => path,
        }
    }
}

impl Default for Link {
    fn default() -> Self {
        Self::Connecting { path: PathBuf::new() }
    }
}

/// Why numbers are not of now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Staleness {
    /// There is no rig, or no daemon, or it hangs: they are the last that came.
    Gone,
    /// The loop runs, and the device has sent nothing new for a while.
    DeviceSilent,
}

/// Speeds of a hand for which stick-slip is reckoned, mm/s: from a ramp to a fast stroke.
const SPEEDS_MMPS: [f64; 4] = [1.0, 5.0, 20.0, 100.0];

fn stick_slip_in_words(scene: &Scene) -> Option<String> {
    let at = |speed: f64| {
        let found = adviser::stick_slip(scene, speed * 1e-3).ok()?;
        let frequency = found.map_or_else(
            || "none".to_owned(),
            |found| format!("{} Hz", significant(found.frequency_hz, 3)),
        );
        Some(format!("{frequency} at {speed} mm/s"))
    };
    let known: Option<Vec<String>> = SPEEDS_MMPS.into_iter().map(at).collect();
    Some(known?.join(", "))
}

impl Daemon {
    pub(crate) fn is_connected(&self) -> bool {
        self.mirror.is_connected()
    }

    /// The rig, while the daemon says what it does.
    pub(crate) fn rig(&self) -> Option<&RigMirror> {
        self.mirror.rig()
    }

    /// Time for which a daemon has sent no sample, if that is too long, also once the connection is given up for it.
    pub(crate) fn silence(&self) -> Option<Duration> {
        Some(self.no_sample_for).filter(|lasts| !lasts.is_zero())
    }

    /// Whether the rig takes commands now. A daemon that hangs would carry them out later, and surprise the hand.
    pub(crate) fn takes_commands(&self) -> bool {
        self.is_connected() && self.silence().is_none()
    }

    /// Whether nobody knows what the rig does: its daemon is silent, or is lost and had force on a motor.
    pub(crate) fn is_rig_unknown(&self) -> bool {
        let had_force = || self.mirror.last_rig().is_some_and(|rig| rig.state.is_live()) && !self.takes_hand();
        self.silence().is_some() || !self.is_connected() && had_force()
    }

    /// Why the numbers of the rig are not of now.
    pub(crate) fn staleness(&self) -> Option<Staleness> {
        if self.silence().is_some() {
            return Some(Staleness::Gone);
        }
        match self.rig().map(|rig| rig.state) {
            None | Some(RigState::Disconnected) => Some(Staleness::Gone),
            Some(_) => None,
        }
    }

    /// Whether the hand on its rig is moved from here.
    pub(crate) fn takes_hand(&self) -> bool {
        self.mirror
            .status
            .as_ref()
            .is_some_and(|status| status.device.takes_hand)
    }

    /// Why there is no rig, as the daemon's link to it says.
    pub(crate) fn why_no_rig(&self) -> Option<&str> {
        let rig = self.rig().filter(|rig| rig.state == RigState::Disconnected);
        let link = self.mirror.timing.as_ref().filter(|_| rig.is_some())?.link.as_ref();
        link?.waiting.as_deref()
    }

    /// Why the daemon refused to engage, release or reset.
    pub(crate) fn refusal(&self) -> Option<&str> {
        self.refusal.as_ref().map(|error| error.message.as_str())
    }

    /// What is asked of the user before it would engage: whether the device is the rig that was commissioned, or
    /// whether the rig may chatter.
    pub(crate) fn asks_before_engaging(&self) -> Option<Intent> {
        match self.refusal.as_ref()?.code {
            ErrorCode::MaybeAnotherRig => Some(Intent::SameRig),
            ErrorCode::WouldChatter => Some(Intent::Anyway(Box::new(Intent::Engage))),
            _ => None,
        }
    }

    /// Takes what an update says of the daemon. Returns what that changes.
    pub(crate) fn take(&mut self, update: &Update) -> MirrorChange {
        match update {
            Update::Connecting { path } => self.link = Link::Connecting { path: path.clone() },
            // What a former daemon stated is forgotten; the outcome of a stop stays.
            Update::Connected { path, ctl_options, .. } => {
                *self = Self {
                    ctl_options: ctl_options.clone(),
                    was_connected: true,
                    was_linked: self.has_link_line(),
                    link: Link::Connected { path: path.clone() },
                    stop: std::mem::take(&mut self.stop),
                    rigs: std::mem::take(&mut self.rigs),
                    ..Self::default()
                };
            }
            Update::Disconnected { path, reason } => {
                let (path, reason) = (path.clone(), reason.clone());
                self.link = Link::Lost { path, reason };
                self.refusal = None;
                self.stop.lose_connection();
            }
            Update::Scene(Ok(_)) => self.stick_slip = OnceCell::new(),
            Update::Rigs(rigs) => self.rigs.clone_from(rigs),
            Update::NoSample(lasts) => self.no_sample_for = *lasts,
            Update::Unreadable { reason } => {
                self.unreadable += 1;
                self.unreadable_reason.clone_from(reason);
            }
            _ => {}
        }
        let change = update.tell(&mut self.mirror);
        self.note_rig(&change);
        match update {
            Update::Event(Event::State(event)) => self.advised.overtaken(event.revision),
            Update::Answered {
                result: Ok(Answer::Changed(reply)),
                ..
            } if !reply.dry_run && self.mirror.scene.revision == Some(reply.revision) => {
                self.advised.take_remarks(reply);
            }
            Update::Advised(result) => self.advised.take(result.clone(), self.mirror.scene.revision),
            _ => {}
        }
        change
    }

    /// A haptic-ctl command, for this daemon.
    pub(crate) fn addressed(&self, command: String) -> String {
        match (command.strip_prefix("haptic-ctl "), &self.ctl_options) {
            (Some(rest), Some(options)) => format!("haptic-ctl {options} {rest}"),
            _ => command,
        }
    }

    fn note_rig(&mut self, change: &MirrorChange) {
        let Some(rig) = change.rig else { return };
        if rig.before != Some(rig.now) {
            self.refusal = None;
        }
        self.stop.take_state(rig.before, rig.now, rig.tick);
    }

    /// How often the block of the scene lets go of hands of some speeds, in words; `None` where that is not reckoned.
    /// It is reckoned when it is first looked at: a slider that is dragged brings a scene in every frame.
    pub(crate) fn stick_slip(&self) -> Option<&str> {
        let scene = self.mirror.scene.whole.as_ref()?;
        self.stick_slip.get_or_init(|| stick_slip_in_words(scene)).as_deref()
    }

    /// Whether the link to the rig has a line: it keeps its place until the next daemon has stated its timing.
    pub(crate) fn has_link_line(&self) -> bool {
        let timing = self.mirror.timing.as_ref();
        timing.map_or(self.was_linked, |timing| timing.link.is_some())
    }

    /// The head of a recording that begins now; `None` before the daemon has stated its parts.
    pub(crate) fn metadata(&self) -> Option<Metadata> {
        let mirror = &self.mirror;
        let status = mirror.status.as_ref().filter(|_| self.is_connected())?;
        Some(Metadata {
            server: status.server.clone(),
            device: status.device.description.clone(),
            axes: status.device.axes,
            loop_rate_hz: status.rate_hz,
            rate_hz: status.rate_hz,
            recorded_by: Some(recorded_by(concat!("haptic-gui ", env!("CARGO_PKG_VERSION")))),
            // The writing thread sets the clock.
            started_unix_s: 0.0,
            revision: mirror.scene.revision?,
            scene: mirror.scene.whole.clone()?,
            servo: mirror.servo.clone(),
            notes: None,
            configuration: serde_json::to_value(status).ok(),
        })
    }

    /// The limit of the force: the smaller one of the daemon and its device, N.
    pub(crate) fn force_limit_n(&self) -> f64 {
        let Some(status) = &self.mirror.status else {
            return f64::INFINITY;
        };
        let linked = status.device.link.as_ref().and_then(|link| link.device.as_ref());
        let limit = linked.map_or(f64::INFINITY, |device| device.force_limit_n);
        limit.min(status.device.force_limit_n)
    }

    /// Takes the outcome of a command to the rig, except a stop.
    pub(crate) fn take_outcome(&mut self, result: Result<Answer, WireError>) {
        match result {
            Ok(Answer::State(_)) => self.refusal = None,
            Ok(_) => {}
            Err(error) => self.refusal = Some(error),
        }
    }

    /// Notes what became of a change of the scene.
    pub(crate) fn note_change(&mut self, change: &Intent, result: &Result<Answer, WireError>) {
        self.would_chatter = match result {
            Err(error) if error.code == ErrorCode::WouldChatter => Some(change.clone()),
            _ => None,
        };
    }

    pub(crate) fn take_stop(&mut self, news: StopNews) {
        match news {
            StopNews::Answered { after, result } => {
                let known = self.mirror.last_rig().map(|rig| (rig.state, rig.tick));
                if let Some((state, tick)) = self.stop.take_answer(after, result, known) {
                    let change = self.mirror.take_state(&StateReply { state, tick });
                    self.note_rig(&change);
                }
            }
            news => self.stop.take_progress(news),
        }
    }
}
