//! Friction laws: what each one is made of.

mod directional;
mod karnopp;

pub use directional::Directional;
pub use karnopp::Karnopp;

/// The friction law of a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(tag = "law", rename_all = "kebab-case"))]
pub enum Friction {
    /// Stiction, kinetic and viscous friction with a true stuck state.
    Karnopp(Karnopp),
}
