//! What differs between the generations of ODrive's firmware: the same properties under different
//! names.

/// A generation of the firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Generation {
    /// 0.5.4 to 0.5.6, on ODrive 3.x.
    V0_5,
    /// 0.6, on S1, Pro and later.
    V0_6,
}

impl Generation {
    /// That of a version (major, minor, revision); nothing for a firmware whose axis states this
    /// protocol cannot write.
    pub(super) fn of([major, minor, revision]: [f64; 3]) -> Option<Self> {
        if major > 0.0 || minor >= 6.0 {
            Some(Self::V0_6)
        } else if minor >= 5.0 && revision >= 4.0 {
            Some(Self::V0_5)
        } else {
            None
        }
    }

    /// The property of an axis with its present errors.
    pub(super) fn present_errors(self) -> &'static str {
        match self {
            Self::V0_5 => "error",
            Self::V0_6 => "active_errors",
        }
    }

    /// The property of an axis with the errors that switched its motor off.
    pub(super) fn disarming_errors(self) -> &'static str {
        match self {
            Self::V0_5 => "error",
            Self::V0_6 => "disarm_reason",
        }
    }

    /// The properties of an axis that limit its torque, each with its sign.
    pub(super) fn torque_limits(self) -> &'static [(&'static str, f64)] {
        match self {
            Self::V0_5 => &[("motor.config.torque_lim", 1.0)],
            Self::V0_6 => &[("config.torque_soft_max", 1.0), ("config.torque_soft_min", -1.0)],
        }
    }

    /// The property with the errors of the board as a whole, where the axis's errors do not contain
    /// them.
    pub(super) fn board_errors(self) -> Option<&'static str> {
        match self {
            Self::V0_5 => Some("error"),
            Self::V0_6 => None,
        }
    }

    /// The bit of the watchdog in an axis's errors.
    pub(super) fn watchdog_bit(self) -> u32 {
        match self {
            Self::V0_5 => 0x800,
            Self::V0_6 => 0x0100_0000,
        }
    }

    /// The bit of the encoder in an axis's errors.
    pub(super) fn encoder_bit(self) -> u32 {
        match self {
            Self::V0_5 => 0x100,
            Self::V0_6 => 0x8,
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
        assert_eq!(Generation::of([0.0, 5.0, 4.0]), Some(Generation::V0_5));
        assert_eq!(Generation::of([0.0, 6.0, 0.0]), Some(Generation::V0_6));
    }
}
