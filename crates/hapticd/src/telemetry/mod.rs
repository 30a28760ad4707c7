//! What the loop did: from the real-time thread through a ring to whoever wants to know.

pub(crate) mod feed;
pub(crate) mod link;
pub(crate) mod ring;
mod stop_times;
pub(crate) mod timing;
