//! Which checks of a device are waived.

/// Checks of a device that the configuration waives.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct EngageRules {
    /// Engages a rig that was not commissioned.
    pub(crate) uncommissioned: bool,
    /// Engages a device whose watchdog is missing or too long.
    pub(crate) allow_no_watchdog: bool,
}
