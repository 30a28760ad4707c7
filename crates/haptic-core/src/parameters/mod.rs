//! The one table of parameters, and how a parameter is named, addressed, stored and refused.
//!
//! Validation, the wire, the command line's help and the panel's sliders all read [`TABLE`], so
//! that a parameter is described in one place and cannot be described differently in another.

mod error;
mod note;
mod parameter;
mod table;

pub use error::{NotApplicable, SceneError};
pub use note::{Note, NoteKind};
pub use parameter::{ParameterInfo, ParameterKey, Scale};
pub use table::{Parameter, TABLE, known_names};

pub(crate) use error::check_range;
pub(crate) use parameter::Slot;
