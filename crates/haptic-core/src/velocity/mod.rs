//! Velocity from encoder positions.

mod alpha_beta_gamma;

pub use alpha_beta_gamma::{AlphaBetaGamma, DEFAULT_MEMORY};
