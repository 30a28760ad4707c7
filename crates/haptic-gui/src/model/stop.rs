//! What became of the user's last stop. Nothing is said of it that is not known.

use super::{Model, is_halted};
use crate::update::Answer;
use crate::update::StopNews;
use haptic_ipc::{ErrorCode, StateReply, WireError};
use std::time::{Duration, Instant};

/// After how long without news a stop counts as not sent, and one that was sent as not heard. A daemon confirms within milliseconds.
const STOP_PATIENCE: Duration = Duration::from_millis(300);

/// What became of the user's last stop.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum StopReport {
    /// None was asked for, or the rig was reset since: the state of the rig says so.
    Settled,
    /// Asked for, and nothing is known of it yet.
    Waiting { since: Instant },
    /// A daemon's socket has it. Late once it should have been answered.
    Sent { since: Option<Instant>, is_late: bool },
    /// The daemon has carried it out, so long after the press where that is known.
    Confirmed { after: Option<Duration> },
    /// The daemon did not carry it out.
    Failed { reason: String },
    /// The daemon has carried it out, and there was no device to hear it.
    Unheard { reason: String },
    /// It reached no daemon.
    NotSent { reason: String },
}

impl StopReport {
    /// Whether it is still to be seen what becomes of it.
    fn is_open(&self) -> bool {
        matches!(self, Self::Waiting { .. } | Self::Sent { .. } | Self::NotSent { .. })
    }
}

impl Model {
    /// The user asked for a stop at `now`.
    pub(crate) fn stop_asked(&mut self, now: Instant) {
        self.stop = if self.is_connected() {
            StopReport::Waiting { since: now }
        } else {
            // The worst until there is news.
            no_connection()
        };
    }

    /// Whatever hangs: a stop of which nothing is heard is not said to be on its way. Gives how long until that is so.
    pub(super) fn age_stop(&mut self, now: Instant) -> Option<Duration> {
        let (StopReport::Waiting { since }
        | StopReport::Sent {
            since: Some(since),
            is_late: false,
        }) = self.stop
        else {
            if let StopReport::Sent { since, .. } = &mut self.stop {
                since.get_or_insert(now);
                return Some(STOP_PATIENCE);
            }
            return None;
        };
        let left = (since + STOP_PATIENCE).saturating_duration_since(now);
        if !left.is_zero() {
            return Some(left);
        }
        self.stop = match self.stop {
            StopReport::Waiting { .. } => StopReport::NotSent {
                reason: "the panel is stuck".to_owned(),
            },
            _ => StopReport::Sent {
                since: Some(since),
                is_late: true,
            },
        };
        None
    }

    pub(super) fn take_stop(&mut self, news: StopNews) {
        match news {
            StopNews::Sent if self.stop.is_open() => {
                let (since, is_late) = match self.stop {
                    StopReport::Waiting { since } => (Some(since), false),
                    StopReport::Sent { since, is_late } => (since, is_late),
                    _ => (None, false),
                };
                self.stop = StopReport::Sent { since, is_late };
            }
            StopNews::NotSent { reason } if self.stop.is_open() => self.stop = StopReport::NotSent { reason },
            // The daemon has answered on the other connection.
            StopNews::Sent | StopNews::NotSent { .. } => {}
            StopNews::Answered { after, result } => self.take_stop_answer(Some(after), result.map(Answer::State)),
        }
    }

    /// Takes an answer to a stop; every stop goes out on two connections, and the first answer counts unless it is the worse.
    pub(super) fn take_stop_answer(&mut self, after: Option<Duration>, result: Result<Answer, WireError>) {
        if let Ok(Answer::State(StateReply { state, tick })) = result
            && is_halted(state)
        {
            let known = match self.stop {
                StopReport::Confirmed { after } => after,
                // It was reset since.
                StopReport::Settled if self.rig().is_some_and(|rig| rig.tick > tick) => return,
                _ => None,
            };
            self.take_rig(state, None, tick);
            self.stop = StopReport::Confirmed { after: known.or(after) };
            return;
        }
        if matches!(self.stop, StopReport::Confirmed { .. }) {
            return;
        }
        self.stop = match result {
            Ok(Answer::State(StateReply { state, .. })) => StopReport::Failed {
                reason: format!("the daemon answered that the rig is {state}"),
            },
            Ok(_) => StopReport::Failed {
                reason: "the daemon's answer is not that to a stop".to_owned(),
            },
            Err(error) if error.code == ErrorCode::NoDevice => StopReport::Unheard { reason: error.message },
            Err(error) => StopReport::Failed { reason: error.message },
        };
    }
}

pub(super) fn no_connection() -> StopReport {
    StopReport::NotSent {
        reason: "no connection to the daemon".to_owned(),
    }
}
