//! From a record of motion and force to a scene: mass, friction and their honest intervals.
//!
//! ```text
//! M a + friction(v, deflection) + offset = F
//! ```
//!
//! `F` is the force that drives the moving mass, positive along the position. Friction is that of a
//! law of `haptic_core::friction`. What a record cannot determine is refused by name, with the reason
//! and what to record instead.

mod plot;
mod result;
mod sensor;
pub mod study;

pub use plot::plots;
pub use result::{Identified, Interval, ModelKind, Refusal};

/// A record to identify from: samples of one clock, with the force that drives the moving mass.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Record {
    /// Times of the samples, s; they grow.
    pub t_s: Vec<f64>,
    /// Position, m.
    pub position_m: Vec<f64>,
    /// Velocity, m/s, where it was measured.
    pub velocity_mps: Option<Vec<f64>>,
    /// Force that drives the moving mass, N, positive along the position.
    pub force_n: Vec<f64>,
    /// Step of the position's encoder, m, where it is known; else it is estimated from the positions.
    pub resolution_m: Option<f64>,
}

/// What is asked for.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// The law, or the choice of one.
    pub model: ModelKind,
    /// The mass, kg, where it is known and not to be identified.
    pub mass_kg: Option<f64>,
    /// Seed of the bootstrap.
    pub seed: u64,
}
