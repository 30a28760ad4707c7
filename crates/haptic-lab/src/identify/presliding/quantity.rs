//! What is reported of an estimate: each quantity's name, its value, and how sure one must be of it.

use super::super::result::Identified;
use super::fit::{Assumptions, Estimate};
use super::laws::PathLaw;
use haptic_core::Directional;

/// A quantity of an estimate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Quantity {
    Mass,
    Dynamic(usize),
    Viscous(usize),
    Static(usize),
    Offset,
    Stiffness,
    Exponent,
    Stribeck,
    Damping,
}

impl Quantity {
    /// Those that a law has, but for what was assumed.
    pub(crate) fn of(law: PathLaw, assumed: &Assumptions) -> Vec<Self> {
        let mut quantities = Vec::new();
        if assumed.mass_kg.is_none() {
            quantities.push(Self::Mass);
        }
        for side in 0..2 {
            quantities.extend([Self::Dynamic(side), Self::Viscous(side)]);
        }
        if assumed.offset_n.is_none() {
            quantities.push(Self::Offset);
        }
        quantities.push(Self::Stiffness);
        match law {
            PathLaw::Coulomb => (),
            PathLaw::Dahl => quantities.push(Self::Exponent),
            PathLaw::Lugre => {
                quantities.extend([Self::Static(0), Self::Static(1), Self::Stribeck, Self::Damping]);
            }
        }
        quantities
    }

    /// Name of the parameter in [`Identified`].
    pub(crate) const fn parameter(self) -> &'static str {
        match self {
            Self::Mass => "mass_kg",
            Self::Dynamic(_) => "dynamic_force_N",
            Self::Viscous(_) => "viscous_Ns_per_m",
            Self::Static(_) => "static_force_N",
            Self::Offset => "offset_N",
            Self::Stiffness => "stiffness_N_per_m",
            Self::Exponent => "exponent",
            Self::Stribeck => "stribeck_velocity_mps",
            Self::Damping => "bristle_damping_Ns_per_m",
        }
    }

    /// Name of its interval.
    pub(crate) fn interval(self) -> String {
        match self {
            Self::Dynamic(side) | Self::Viscous(side) | Self::Static(side) => {
                format!("{}.{}", self.parameter(), ["positive", "negative"][side])
            }
            _ => self.parameter().to_owned(),
        }
    }

    /// Whether it is positive, so that its logarithm is what scatters evenly.
    pub(crate) const fn is_positive(self) -> bool {
        !matches!(self, Self::Viscous(_) | Self::Offset | Self::Damping)
    }

    /// Its value: the logarithm of one that is positive.
    pub(crate) fn value(self, estimate: &Estimate) -> f64 {
        let values = &estimate.values;
        match self {
            Self::Mass => estimate.mass_kg.max(1e-9).ln(),
            Self::Dynamic(side) => values[PathLaw::DYNAMIC + side].ln(),
            Self::Static(side) => {
                (values[PathLaw::DYNAMIC + side] * values[PathLaw::STATIC_RATIO + side].max(1e-3)).ln()
            }
            Self::Viscous(side) => estimate.viscous[side],
            Self::Offset => estimate.offset_n,
            Self::Stiffness => values[PathLaw::STIFFNESS].ln(),
            Self::Exponent => values[PathLaw::EXPONENT].ln(),
            Self::Stribeck => values[PathLaw::STRIBECK].ln(),
            Self::Damping => values[PathLaw::DAMPING],
        }
    }

    /// The value itself from that of [`value`](Self::value).
    pub(crate) fn itself(self, value: f64) -> f64 {
        if self.is_positive() { value.exp() } else { value }
    }

    /// Puts a value into what was found.
    pub(crate) fn store(self, value: f64, found: &mut Identified) {
        let set = |place: &mut Option<Directional>, side: usize| {
            let pair = place.get_or_insert(Directional::both(value));
            if side == 0 {
                pair.positive = value;
            } else {
                pair.negative = value;
            }
        };
        match self {
            Self::Mass => found.mass_kg = Some(value),
            Self::Dynamic(side) => set(&mut found.dynamic_force_n, side),
            Self::Viscous(side) => set(&mut found.viscous_ns_per_m, side),
            Self::Static(side) => set(&mut found.static_force_n, side),
            Self::Offset => found.offset_n = Some(value),
            Self::Stiffness => found.stiffness_n_per_m = Some(value),
            Self::Exponent => found.exponent = Some(value),
            Self::Stribeck => found.stribeck_velocity_mps = Some(value),
            Self::Damping => found.bristle_damping_ns_per_m = Some(value),
        }
    }
}
