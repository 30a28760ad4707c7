//! A row of a motion, and the limit of its numbers.

/// One row of a motion.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Time, s.
    pub t_s: f64,
    /// Position, m.
    pub position_m: f64,
    /// Velocity, m/s; every row of a file has one, or none.
    pub velocity_mps: Option<f64>,
}

/// Largest time (s), position (m) or velocity (m/s) taken: beyond it the products that forces are
/// made of leave the range of numbers.
pub const LARGEST: f64 = 1e12;
