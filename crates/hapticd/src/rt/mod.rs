//! The real-time thread and everything that touches it.
//!
//! Nothing here allocates, locks, logs, formats or waits for anyone once the loop runs; its only system calls are the sleep and
//! the device's own.

pub(crate) mod clock;
pub(crate) mod handoff;
pub(crate) mod lateness;
pub(crate) mod privileges;
pub(crate) mod thread;
pub(crate) mod tick;
