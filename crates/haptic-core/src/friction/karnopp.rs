//! Karnopp's stick-slip friction (Karnopp 1985, "Computer simulation of stick-slip friction in
//! mechanical dynamic systems"), with limits that may differ by direction as Richard and Cutkosky
//! fitted them to measured surfaces.
//!
//! ```text
//!  friction            stuck: whatever holds the block, up to Fs
//!     Fs |*
//!     Fd |  .--------''''  Fd + b w
//!        |
//! -------+--------------- w
//! ```

use super::Directional;

/// Karnopp friction: limits in newtons, all positive numbers for either direction.
///
/// A block at rest stays at rest while the force on it is within the larger of the static and the
/// dynamic limit. With `static_force >= dynamic_force`, the common case, that is the static limit. With a
/// static limit below the dynamic one a block set loose between the two would be stopped at once by
/// the kinetic friction, so the law's own solution in the sense of Filippov is to stay at rest up to the dynamic
/// limit: see [`Karnopp::breakaway_force`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields))]
pub struct Karnopp {
    /// `Fs`, N: the force that a block at rest withstands.
    pub static_force: Directional,
    /// `Fd`, N: kinetic (Coulomb) friction while sliding.
    pub dynamic_force: Directional,
    /// `b`, N s/m: viscous friction while sliding.
    #[cfg_attr(feature = "serde", serde(default))]
    pub viscous: Directional,
    /// `DV`, m/s: a slide that has been faster than this re-sticks when it falls back to it.
    #[cfg_attr(feature = "serde", serde(default))]
    pub velocity_threshold: f64,
}

impl Karnopp {
    /// The force, N, at which a block at rest starts to slide, by direction.
    #[must_use]
    pub fn breakaway_force(&self) -> Directional {
        Directional {
            positive: self.static_force.positive.max(self.dynamic_force.positive),
            negative: self.static_force.negative.max(self.dynamic_force.negative),
        }
    }
}
