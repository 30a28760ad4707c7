//! A parameter's identity, and the form of its row in the table.

use crate::directional::Directional;
/// A parameter of a scene that can be changed while the rig renders it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Parameter {
    /// Mass of the block, `M`.
    Mass,
    /// Stiffness of the virtual coupling, `K`.
    Stiffness,
    /// Damping of the virtual coupling, `B`.
    Damping,
    /// Static friction limit, `Fs`.
    StaticForce,
    /// Kinetic friction, `Fd`.
    DynamicForce,
    /// Viscous friction, `b`.
    Viscous,
    /// Velocity threshold of re-sticking, `DV`.
    VelocityThreshold,
    /// Velocity over which friction falls from its static to its kinetic value, `ws`.
    StribeckVelocity,
    /// Rate at which the static limit grows while the contact rests, `gamma`.
    RisingRate,
    /// Stiffness of the contact before it slides, `Kp` (`sigma`, `sigma0`).
    ContactStiffness,
    /// Damping of the contact before it slides, `sigma1` (`beta`).
    ContactDamping,
    /// Exponent of Dahl's curve, `i`.
    Exponent,
    /// Share of the greatest deflection up to which the contact is elastic, `zba` (`zs`).
    ElasticFraction,
}

/// How a slider should spread a parameter's range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal distances are equal differences.
    Linear,
    /// Equal distances are equal ratios.
    Logarithmic,
}

/// Description of a parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParameterInfo {
    /// Which parameter this row describes.
    pub parameter: Parameter,
    /// Name on the wire and in scene files.
    pub name: &'static str,
    /// Symbol in the paper, accepted wherever the name is.
    pub symbol: &'static str,
    /// Other symbols that the literature has for it, accepted as well.
    pub aliases: &'static [&'static str],
    /// SI unit; `1` for a bare number.
    pub unit: &'static str,
    /// The part of the scene that it belongs to.
    pub group: &'static str,
    /// Smallest value accepted.
    pub min: f64,
    /// Largest value accepted.
    pub max: f64,
    /// Lower end of a slider: the range that is of use on a desk-top rig.
    pub slider_min: f64,
    /// Upper end of a slider.
    pub slider_max: f64,
    /// The smallest difference worth a step.
    pub step: f64,
    /// How a slider should spread its range.
    pub scale: Scale,
    /// Whether it may differ by direction (`Fs+`, `Fs-`).
    pub directional: bool,
    /// Feel of a larger value.
    pub feel: &'static str,
}

impl ParameterInfo {
    /// Whether `text` is the parameter's name or one of its symbols.
    #[must_use]
    pub fn is_called(&self, text: &str) -> bool {
        self.name == text || self.symbol == text || self.aliases.contains(&text)
    }
}

/// The place of a parameter's value.
#[derive(Debug)]
pub(crate) enum Slot<'a> {
    /// One value.
    One(&'a mut f64),
    /// A value for each direction.
    Two(&'a mut Directional),
}
