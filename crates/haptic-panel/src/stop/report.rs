//! The outcome of the user's last stop. The panel claims only what it knows.

use crate::update::StopNews;
use haptic_ipc::{ErrorCode, RigState, StateReply, WireError};
use std::time::{Duration, Instant};

/// Time without news after which a stop counts as not sent, and a sent one as not confirmed. A daemon
/// confirms within milliseconds.
const STOP_PATIENCE: Duration = Duration::from_millis(300);

/// The outcome of the user's last stop.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(crate) enum StopReport {
    /// No stop is open: the state of the rig says everything.
    #[default]
    Settled,
    /// Pressed; nothing is known of it yet.
    Waiting { since: Instant },
    /// A daemon's socket has it. Late when the answer is overdue.
    Sent { since: Option<Instant>, is_late: bool },
    /// The daemon has carried it out in a tick, and answered this long after the press.
    Confirmed { after: Duration, tick: u64 },
    /// The daemon did not carry it out.
    Failed { reason: String },
    /// The daemon has carried it out, but there was no device to receive it.
    NoDevice { reason: String },
    /// It reached no daemon.
    NotSent { reason: String },
}

impl StopReport {
    /// The report without a connection: the worst case until there is news.
    pub(crate) fn no_connection() -> Self {
        Self::NotSent {
            reason: "no connection to the daemon".to_owned(),
        }
    }

    /// Whether there is something to say of the user's last stop.
    pub(crate) fn is_shown(&self) -> bool {
        *self != Self::Settled
    }

    /// Whether the outcome is still open.
    fn is_open(&self) -> bool {
        matches!(self, Self::Waiting { .. } | Self::Sent { .. } | Self::NotSent { .. })
    }

    /// The user pressed Stop at `now`, on a rig in this state, if that is known. A rig that a stop has just halted is
    /// stopped again, and stays as it is: a key may be seen by the watch on keys first, and by a window after it.
    pub(crate) fn press(&mut self, now: Instant, is_connected: bool, state: Option<RigState>) {
        *self = match *self {
            Self::Confirmed { .. } if is_connected && state.is_some_and(is_halted) => return,
            _ if is_connected => Self::Waiting { since: now },
            _ => Self::no_connection(),
        };
    }

    /// The connection is lost, and the state of the rig with it. A stop on its way has news of its own.
    pub(crate) fn lose_connection(&mut self) {
        match self {
            Self::Confirmed { .. } => *self = Self::Settled,
            Self::Failed { .. } => *self = Self::no_connection(),
            _ => {}
        }
    }

    /// The state of the rig has changed in a tick. The answer to a stop can be here before the event of what it
    /// ended, which may be of the same tick.
    pub(crate) fn take_state(&mut self, before: Option<RigState>, now: RigState, tick: u64) {
        let is_newer = match self {
            Self::Confirmed { tick: stopped, .. } => tick > *stopped,
            Self::NoDevice { .. } => true,
            _ => false,
        };
        let is_reset = before.is_some_and(is_halted) && !is_halted(now);
        // The force is off after all, by another client or a check.
        let is_off = is_halted(now) && matches!(self, Self::Failed { .. });
        if (is_reset && is_newer) || is_off {
            *self = Self::Settled;
        }
    }

    /// Marks a stop without news as late. Returns the time until it is late.
    pub(crate) fn age(&mut self, now: Instant) -> Option<Duration> {
        let since = match self {
            Self::Waiting { since } => *since,
            Self::Sent { since, is_late: false } => *since.get_or_insert(now),
            _ => return None,
        };
        let left = (since + STOP_PATIENCE).saturating_duration_since(now);
        if !left.is_zero() {
            return Some(left);
        }
        *self = match self {
            Self::Waiting { .. } => Self::NotSent {
                reason: "the panel is stuck".to_owned(),
            },
            _ => Self::Sent {
                since: Some(since),
                is_late: true,
            },
        };
        None
    }

    /// Takes news of the stop's own connection, except an answer.
    pub(crate) fn take_progress(&mut self, news: StopNews) {
        if !self.is_open() {
            // The daemon has answered on the other connection.
            return;
        }
        match news {
            StopNews::Sent => {
                let (since, is_late) = match *self {
                    Self::Waiting { since } => (Some(since), false),
                    Self::Sent { since, is_late } => (since, is_late),
                    _ => (None, false),
                };
                *self = Self::Sent { since, is_late };
            }
            StopNews::NotSent { reason } => *self = Self::NotSent { reason },
            StopNews::Dropped => *self = Self::Settled,
            StopNews::Answered { .. } => {}
        }
    }

    /// Takes an answer to a stop. Every stop goes out on two connections: the first answer counts, and a
    /// confirmation counts more than a refusal. `known` is the known state of the rig, and its tick. Returns the state
    /// that a confirmation brings.
    pub(crate) fn take_answer(
        &mut self,
        after: Duration,
        result: Result<StateReply, WireError>,
        known: Option<(RigState, u64)>,
    ) -> Option<(RigState, u64)> {
        if let Ok(StateReply { state, tick }) = result
            && is_halted(state)
        {
            // An earlier stop, or another client's, had halted it.
            let halted = known.filter(|(known, at)| *known == state && *at <= tick);
            let tick = halted.map_or(tick, |(_, at)| at);
            *self = match *self {
                // The second connection's, which found the rig stopped.
                Self::Confirmed { after, tick: first } => Self::Confirmed {
                    after,
                    tick: first.min(tick),
                },
                // The rig was reset since.
                Self::Settled if known.is_some_and(|(_, at)| at > tick) => return None,
                _ => Self::Confirmed { after, tick },
            };
            return Some((state, tick));
        }
        if matches!(self, Self::Confirmed { .. }) {
            return None;
        }
        *self = match result {
            Ok(StateReply { state, .. }) => Self::Failed {
                reason: format!("the daemon answered that the rig is {state}"),
            },
            Err(error) if error.code == ErrorCode::NoDevice => Self::NoDevice { reason: error.message },
            Err(error) => Self::Failed { reason: error.message },
        };
        None
    }
}

/// Whether a person or a check has removed the force until a reset.
pub(crate) fn is_halted(state: RigState) -> bool {
    matches!(state, RigState::Stopped | RigState::Faulted)
}
