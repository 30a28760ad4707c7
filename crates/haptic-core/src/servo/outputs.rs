//! What a step leads to.

/// What a step leads to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outputs {
    /// Force on the hand, N, to be commanded until the next step.
    pub force_n: f64,
    /// Whether the motor may be driven.
    pub enabled: bool,
    /// Force in the coupling, which drives the block, N.
    pub coupling_force_n: f64,
    /// Position of the hand, m.
    pub device_position_m: f64,
    /// Velocity of the hand, m/s.
    pub device_velocity_mps: f64,
    /// Position of the block, m.
    pub block_position_m: f64,
    /// Velocity of the block, m/s.
    pub block_velocity_mps: f64,
    /// 0 stuck or without force, +1 and -1 sliding.
    pub contact: i8,
    /// Energy that sampling made and the rig did not take up, J.
    pub energy_excess_j: f64,
    /// Whether the command of this step was refused.
    pub refused: bool,
}
