//! Why a session was interrupted.

use haptic_ipc::RigState;

/// Why a session was interrupted. A trial under way is void, and done again.
#[derive(Clone, Debug, PartialEq)]
pub enum Interruption {
    /// A person paused it.
    Paused,
    /// The rig's force does not flow.
    State(RigState),
    /// Ticks are missing.
    LostTicks(u64),
    /// The daemon was started again, or the connection to it re-established.
    NewLink,
    /// Another program changed the scene.
    SceneChanged {
        /// The revision that is rendered.
        revision: u64,
    },
    /// The scene could not be set.
    SceneRefused(String),
    /// A trial took longer than a recording may be.
    TooLong {
        /// Longest time, s.
        limit_s: f64,
    },
}

impl std::fmt::Display for Interruption {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Paused => write!(formatter, "paused"),
            Self::State(state) => write!(formatter, "the rig is {state}"),
            Self::LostTicks(ticks) => write!(formatter, "{ticks} ticks are missing"),
            Self::NewLink => write!(formatter, "the connection to the daemon was re-established"),
            Self::SceneChanged { revision } => {
                write!(formatter, "another program changed the scene: revision {revision}")
            }
            Self::SceneRefused(why) => write!(formatter, "the scene could not be set: {why}"),
            Self::TooLong { limit_s } => write!(formatter, "the trial took longer than {limit_s} s"),
        }
    }
}
