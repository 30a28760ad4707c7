//! Facts of the daemon, as it last stated them.

use super::scene::SceneFacts;
use super::stop::StopReport;
use crate::intent::Intent;
use crate::update::{Answer, StopNews};
use haptic_ipc::{ErrorCode, RigState, ServoSetup, Status, Timing, WireError};
use haptic_recording::{Metadata, recorded_by};
use std::path::PathBuf;
use std::time::Duration;

/// What the panel knows of the daemon and its rig.
#[derive(Debug, Default)]
pub(crate) struct Daemon {
    pub(crate) link: Link,
    /// Whether there was a daemon since the window opened.
    pub(crate) was_connected: bool,
    /// Whether the daemon before had a link to its rig.
    was_linked: bool,
    rig: Option<Rig>,
    pub(crate) scene: SceneFacts,
    pub(crate) timing: Option<Timing>,
    pub(crate) status: Option<Status>,
    /// What the samples are computed with.
    pub(crate) servo: Option<ServoSetup>,
    pub(crate) losses: Losses,
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
    Connected { path: PathBuf, server: String },
    Lost { path: PathBuf, reason: String },
}

impl Default for Link {
    fn default() -> Self {
        Self::Connecting { path: PathBuf::new() }
    }
}

/// The rig, as the daemon last described it.
#[derive(Debug)]
pub(crate) struct Rig {
    pub(crate) state: RigState,
    pub(crate) fault: Option<String>,
    /// The tick at which the state began.
    pub(crate) tick: u64,
}

/// Why numbers are not of now.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Staleness {
    /// There is no rig, or no daemon, or it hangs: they are the last that came.
    Gone,
    /// A fault: the rig may measure no more.
    Faulted,
}

/// What was lost on the way to this panel.
#[derive(Debug, Default)]
pub(crate) struct Losses {
    /// Rows that the daemon could not send.
    pub(crate) rows: u64,
    /// Lines that this program cannot read, and the reason for the last of them.
    pub(crate) unreadable: u64,
    pub(crate) unreadable_reason: String,
}

impl Daemon {
    pub(crate) fn is_connected(&self) -> bool {
        matches!(self.link, Link::Connected { .. })
    }

    /// The rig, while the daemon says what it does.
    pub(crate) fn rig(&self) -> Option<&Rig> {
        self.rig.as_ref().filter(|_| self.is_connected())
    }

    /// Time for which a daemon that is connected has sent no sample, if that is too long: nobody knows what the rig does.
    pub(crate) fn silence(&self) -> Option<Duration> {
        Some(self.no_sample_for).filter(|lasts| !lasts.is_zero() && self.is_connected())
    }

    /// Why the numbers of the rig are not of now.
    pub(crate) fn staleness(&self) -> Option<Staleness> {
        if self.silence().is_some() {
            return Some(Staleness::Gone);
        }
        match self.rig().map(|rig| rig.state) {
            None | Some(RigState::Disconnected) => Some(Staleness::Gone),
            Some(RigState::Faulted) => Some(Staleness::Faulted),
            Some(_) => None,
        }
    }

    /// Whether the hand on its rig is moved from here.
    pub(crate) fn takes_hand(&self) -> bool {
        self.status.as_ref().is_some_and(|status| status.device.takes_hand)
    }

    /// Why there is no rig, as the daemon's link to it says.
    pub(crate) fn why_no_rig(&self) -> Option<&str> {
        let rig = self.rig().filter(|rig| rig.state == RigState::Disconnected);
        let link = self.timing.as_ref().filter(|_| rig.is_some())?.link.as_ref();
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

    /// Forgets what a former daemon stated; the outcome of a stop stays.
    pub(crate) fn connect(&mut self, link: Link) {
        *self = Self {
            was_connected: true,
            was_linked: self.has_link_line(),
            link,
            stop: std::mem::take(&mut self.stop),
            ..Self::default()
        };
    }

    /// The connection is lost, or there is none yet. What the daemon stated stays, to be shown as what it was.
    pub(crate) fn lose_connection(&mut self, link: Link) {
        self.link = link;
        self.refusal = None;
        self.no_sample_for = Duration::ZERO;
        self.stop.lose_connection();
    }

    /// Whether the link to the rig has a line: it keeps its place until the next daemon has stated its timing.
    pub(crate) fn has_link_line(&self) -> bool {
        let timing = self.timing.as_ref();
        timing.map_or(self.was_linked, |timing| timing.link.is_some())
    }

    /// The head of a recording that begins now; `None` before the daemon has stated its parts.
    pub(crate) fn metadata(&self) -> Option<Metadata> {
        let status = self.status.as_ref().filter(|_| self.is_connected())?;
        Some(Metadata {
            server: status.server.clone(),
            device: status.device.description.clone(),
            loop_rate_hz: status.rate_hz,
            rate_hz: status.rate_hz,
            recorded_by: Some(recorded_by(concat!("haptic-gui ", env!("CARGO_PKG_VERSION")))),
            // The writing thread sets the clock.
            started_unix_s: 0.0,
            revision: self.scene.revision?,
            scene: self.scene.active.clone()?,
            servo: self.servo.clone(),
            notes: None,
            configuration: serde_json::to_value(status).ok(),
        })
    }

    /// The limit of the force: the smaller one of the daemon and its device, N.
    pub(crate) fn force_limit_n(&self) -> f64 {
        let Some(status) = &self.status else {
            return f64::INFINITY;
        };
        let linked = status.device.link.as_ref().and_then(|link| link.device.as_ref());
        let limit = linked.map_or(f64::INFINITY, |device| device.force_limit_n);
        limit.min(status.device.force_limit_n)
    }

    pub(crate) fn take_state(&mut self, state: RigState, fault: Option<String>, tick: u64) {
        let known = self.rig.as_ref();
        if known.is_some_and(|known| tick < known.tick) {
            return;
        }
        let before = known.map(|known| known.state);
        // An answer has no reason of a fault, the event after it has. A later event does not move the
        // beginning of the state.
        let (fault, tick) = match known.filter(|known| known.state == state) {
            Some(known) => (fault.or_else(|| known.fault.clone()), known.tick),
            None => (fault, tick),
        };
        self.rig = Some(Rig { state, fault, tick });
        if before != Some(state) {
            self.refusal = None;
        }
        self.stop.take_state(before, state, tick);
    }

    /// Takes the answer to a command to the rig, except a stop.
    pub(crate) fn take_answer(&mut self, result: Result<Answer, WireError>) {
        match result {
            Ok(Answer::State(reply)) => {
                self.refusal = None;
                self.take_state(reply.state, None, reply.tick);
            }
            Ok(_) => {}
            Err(error) => self.refusal = Some(error),
        }
    }

    /// Takes news of a stop.
    pub(crate) fn take_stop(&mut self, news: StopNews) {
        match news {
            StopNews::Answered { after, result } => {
                let known_tick = self.rig.as_ref().map(|rig| rig.tick);
                if let Some((state, tick)) = self.stop.take_answer(after, result, known_tick) {
                    self.take_state(state, None, tick);
                }
            }
            news => self.stop.take_progress(news),
        }
    }
}
