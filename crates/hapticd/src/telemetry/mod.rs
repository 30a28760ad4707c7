//! What the loop did: from the real-time thread through its outbox to whoever wants to know.

pub(crate) mod feed;
pub(crate) mod link;
pub(crate) mod motion;
mod stop_times;
pub(crate) mod timing;
