//! What the panel hears from the daemon, and about it.

use crate::intent::Intent;
use haptic_ipc::{AdviceReply, ChangeReply, Description, Event, Hello, StateReply, WireError};
use std::path::PathBuf;

/// One piece of news.
#[derive(Clone, Debug, PartialEq)]
pub enum Update {
    /// The first attempt to reach the daemon began.
    Connecting {
        /// The socket looked at.
        path: PathBuf,
    },
    /// The daemon greeted; everything known of an earlier one is void.
    Connected {
        /// Its socket.
        path: PathBuf,
        /// The greeting.
        hello: Hello,
    },
    /// There is no daemon to talk to; the next attempt follows by itself.
    Disconnected {
        /// The socket looked at.
        path: PathBuf,
        /// Why.
        reason: String,
    },
    /// The parameter table.
    Described(Description),
    /// What the adviser says of a scene. It is asked again whenever the scene changes.
    Advised(Result<AdviceReply, WireError>),
    /// Something subscribed to.
    Event(Event),
    /// The daemon carried out what the user asked for, or refused.
    Answered {
        /// What was asked.
        intent: Intent,
        /// What came of it.
        result: Result<Answer, WireError>,
    },
    /// A line that this program cannot read, as a later daemon may send.
    Unreadable {
        /// What is wrong with it.
        reason: String,
    },
}

/// What the daemon says to a request that it carried out.
#[derive(Clone, Debug, PartialEq)]
pub enum Answer {
    /// To [`Intent::Set`].
    Changed(ChangeReply),
    /// To the others.
    State(StateReply),
}
