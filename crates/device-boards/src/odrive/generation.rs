//! What differs between the generations of ODrive's firmware: the same properties under different
//! names.

/// A generation of the firmware.
#[derive(Debug, PartialEq)]
pub(super) struct Generation {
    /// The property of an axis with its present errors.
    pub(super) present_errors: &'static str,
    /// The property of an axis with the errors that switched its motor off.
    pub(super) disarming_errors: &'static str,
    /// The properties of an axis that limit its torque, each with its sign.
    pub(super) torque_limits: &'static [(&'static str, f64)],
    /// The property with the errors of the board as a whole, where the axis's errors do not contain
    /// them.
    pub(super) board_errors: Option<&'static str>,
    /// The bit of the watchdog in an axis's errors.
    pub(super) watchdog_bit: u32,
    /// The bit of the encoder in an axis's errors.
    pub(super) encoder_bit: u32,
}

/// 0.5.4 to 0.5.6, on ODrive 3.x.
static V0_5: Generation = Generation {
    present_errors: "error",
    disarming_errors: "error",
    torque_limits: &[("motor.config.torque_lim", 1.0)],
    board_errors: Some("error"),
    watchdog_bit: 0x800,
    encoder_bit: 0x100,
};

/// 0.6, on S1, Pro and later.
static V0_6: Generation = Generation {
    present_errors: "active_errors",
    disarming_errors: "disarm_reason",
    torque_limits: &[("config.torque_soft_max", 1.0), ("config.torque_soft_min", -1.0)],
    board_errors: None,
    watchdog_bit: 0x0100_0000,
    encoder_bit: 0x8,
};

impl Generation {
    /// That of a version (major, minor, revision); nothing for a firmware whose axis states this
    /// protocol cannot write.
    pub(super) fn of([major, minor, revision]: [f64; 3]) -> Option<&'static Self> {
        if major > 0.0 || minor >= 6.0 {
            Some(&V0_6)
        } else if minor >= 5.0 && revision >= 4.0 {
            Some(&V0_5)
        } else {
            None
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_firmware_is_known_or_refused() {
        assert_eq!(Generation::of([0.0, 4.0, 12.0]), None);
        assert_eq!(Generation::of([0.0, 5.0, 3.0]), None);
        assert_eq!(Generation::of([0.0, 5.0, 4.0]), Some(&V0_5));
        assert_eq!(Generation::of([0.0, 6.0, 0.0]), Some(&V0_6));
    }
}
