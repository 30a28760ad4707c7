//! What of a sample is drawn, in the units in which people read it.

use haptic_ipc::Sample;

/// Positions are shown in mm and velocities in mm/s: a desk-top rig moves by a few centimetres.
pub(crate) const MM_PER_M: f64 = 1e3;

/// Beyond this nothing is a force in N or a position in mm, and the axes' arithmetic runs out of digits.
const DRAWABLE: f64 = 1e9;

/// What a plot shows: each has one axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    Force,
    Position,
    Velocity,
}

impl Quantity {
    pub(crate) const ALL: [Self; 3] = [Self::Force, Self::Position, Self::Velocity];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Force => "Force",
            Self::Position => "Position",
            Self::Velocity => "Velocity",
        }
    }

    pub(crate) const fn unit(self) -> &'static str {
        match self {
            Self::Force => "N",
            Self::Position => "mm",
            Self::Velocity => "mm/s",
        }
    }

    /// An axis spans at least this much, so that the encoder's noise at rest does not fill the plot.
    pub(crate) const fn smallest_span(self) -> f64 {
        match self {
            Self::Force => 2.0,
            Self::Position => 1.0,
            Self::Velocity => 10.0,
        }
    }

    /// What the block does, drawn first and wider, and what the device does.
    pub(crate) const fn signals(self) -> [Signal; 2] {
        match self {
            Self::Force => [Signal::CouplingForce, Signal::HandForce],
            Self::Position => [Signal::BlockPosition, Signal::DevicePosition],
            Self::Velocity => [Signal::BlockVelocity, Signal::DeviceVelocity],
        }
    }
}

/// One line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Signal {
    CouplingForce,
    HandForce,
    BlockPosition,
    DevicePosition,
    BlockVelocity,
    DeviceVelocity,
}

impl Signal {
    pub(crate) const ALL: [Self; 6] = [
        Self::HandForce,
        Self::CouplingForce,
        Self::DevicePosition,
        Self::BlockPosition,
        Self::DeviceVelocity,
        Self::BlockVelocity,
    ];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::CouplingForce => "Coupling force",
            Self::HandForce => "Force on the hand",
            Self::BlockPosition => "Block position",
            Self::DevicePosition => "Device position",
            Self::BlockVelocity => "Block velocity",
            Self::DeviceVelocity => "Device velocity",
        }
    }

    pub(crate) const fn quantity(self) -> Quantity {
        match self {
            Self::CouplingForce | Self::HandForce => Quantity::Force,
            Self::BlockPosition | Self::DevicePosition => Quantity::Position,
            Self::BlockVelocity | Self::DeviceVelocity => Quantity::Velocity,
        }
    }

    /// Whether it is of the block, or of the coupling that drives it.
    pub(crate) const fn is_of_block(self) -> bool {
        matches!(self, Self::CouplingForce | Self::BlockPosition | Self::BlockVelocity)
    }

    /// Its value, in the unit of its quantity.
    pub(crate) fn of(self, sample: &Sample) -> f64 {
        let value = match self {
            Self::CouplingForce => sample.coupling_force_n,
            Self::HandForce => sample.command_force_n,
            Self::BlockPosition => sample.block_position_m * MM_PER_M,
            Self::DevicePosition => sample.device_position_m * MM_PER_M,
            Self::BlockVelocity => sample.block_velocity_mps * MM_PER_M,
            Self::DeviceVelocity => sample.device_velocity_mps * MM_PER_M,
        };
        value.clamp(-DRAWABLE, DRAWABLE)
    }
}
