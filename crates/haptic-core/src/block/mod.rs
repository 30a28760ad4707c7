//! The block behind the virtual coupling: its state, and the schemes that move it on by one tick.
//!
//! [`exact`] solves Karnopp's law in closed form between two samples, [`yielding`] the laws whose
//! contact gives way, piece by piece; [`linear`] is for a block that nothing holds. [`literal`] is
//! the paper's Euler step, for every law. One backward-Euler step a tick, the implicit scheme, is
//! part of the first two, which fall back on it when a tick has more in it than may be worked
//! through.

mod body;
mod budget;
mod course;
pub mod exact;
mod fall;
pub mod linear;
mod linear_slide;
pub mod literal;
mod load;
mod moving;
mod oscillator;
mod piece_length;
mod propagator;
mod response;
mod slide;
mod state;
mod stribeck_slide;
mod tangent_piece;
pub mod yielding;

pub use crate::contact::Contact;
pub use body::{Block, Coupling};
pub use budget::MAX_PHASE_PER_TICK_RAD;
pub use moving::{EventSink, Rendered};
pub use state::BlockState;

pub(crate) use exact::ExactBlock;
pub(crate) use linear::LinearBlock;
pub(crate) use linear_slide::LinearSlide;
pub(crate) use literal::RigidLaw;
pub(crate) use moving::Moving;
pub(crate) use slide::{DirectionalSlides, SymmetricSlides};
pub(crate) use stribeck_slide::{StribeckParts, StribeckSlide};
