//! The user's description: a block, its coupling to the hand, and the surface below it.

mod another_law;
mod change;
#[cfg(feature = "serde")]
mod file;
#[cfg(feature = "serde")]
mod friction_fields;
mod toward;
mod validate;

pub use crate::block::{Block, Coupling, MAX_PHASE_PER_TICK_RAD};
pub use crate::parameters::{NotApplicable, Note, NoteKind, SceneError};
pub use change::Scene;
#[cfg(feature = "serde")]
pub use file::{FileCoupling, SceneFile};
