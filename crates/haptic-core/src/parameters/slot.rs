//! The place of a parameter's value inside a scene.

use crate::directional::Directional;

/// The place of a parameter's value.
#[derive(Debug)]
pub(crate) enum Slot<'a> {
    /// One value.
    One(&'a mut f64),
    /// A value for each direction.
    Two(&'a mut Directional),
}
