//! The block behind the virtual coupling: its state, and the schemes that move it on by one tick.
//!
//! [`exact`] solves Karnopp's law in closed form between two samples, [`yielding`] the laws whose
//! contact gives way, piece by piece; [`linear`] is for a block that nothing holds. [`literal`] is
//! the paper's Euler step, for every law. One backward-Euler step a tick, the implicit scheme, is
//! part of the first two, which fall back on it when a tick has more in it than may be worked
//! through.
//!
//! Where a law is curved, a piece is a power series of the motion: see the `expansion`.

mod body;
mod course;
pub mod exact;
mod expansion;
mod falling_slide;
pub mod linear;
mod linear_slide;
pub mod literal;
mod oscillator;
mod straight;
pub mod yielding;

pub use crate::contact::{Contact, ContactMemory};
pub use body::{Block, BlockState, Coupling, EventSink, Rendered};
pub use course::MAX_PHASE_PER_TICK_RAD;

pub(crate) use body::{Body, Moving};
pub(crate) use exact::{ExactBlock, Slides};
pub(crate) use expansion::{CoupledMass, Expansion, Piece, Start};
pub(crate) use falling_slide::FallingSlide;
pub(crate) use linear::LinearBlock;
pub(crate) use linear_slide::LinearSlide;
pub(crate) use literal::RigidLaw;
pub(crate) use straight::{LineEnd, straight_piece};
pub(crate) use yielding::PiecewiseContact;
