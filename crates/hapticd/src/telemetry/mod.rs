//! Telemetry: the records of the loop's ticks, from the outbox to the subscribers.

pub(crate) mod excitation;
pub(crate) mod feed;
pub(crate) mod link;
pub(crate) mod motion;
mod pulse_mass;
pub(crate) mod rest;
pub(crate) mod subscribers;
pub(crate) mod timing;
