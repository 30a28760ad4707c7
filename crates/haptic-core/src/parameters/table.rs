//! The table of parameters: name, paper symbol, unit, range, and feel.

use super::parameter::{ParameterInfo, Scale};
use alloc::string::String;
use alloc::vec::Vec;

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

/// What most rows have.
const ROW: ParameterInfo = ParameterInfo {
    parameter: Parameter::Mass,
    name: "",
    symbol: "",
    aliases: &[],
    unit: "",
    group: "friction",
    min: 0.0,
    max: 0.0,
    slider_min: 0.0,
    slider_max: 0.0,
    step: 0.01,
    scale: Scale::Linear,
    directional: false,
    feel: "",
};

/// The parameter table, in the order in which people read a scene.
pub const TABLE: [ParameterInfo; 13] = [
    ParameterInfo {
        parameter: Parameter::Mass,
        name: "mass",
        symbol: "M",
        unit: "kg",
        group: "block",
        min: 1e-6,
        max: 100.0,
        slider_min: 0.01,
        slider_max: 10.0,
        step: 0.001,
        scale: Scale::Logarithmic,
        feel: "a heavier block: slower to set off and harder to stop",
        ..ROW
    },
    ParameterInfo {
        parameter: Parameter::StaticForce,
        name: "static_force",
        symbol: "Fs",
        unit: "N",
        max: 1e3,
        slider_max: 20.0,
        directional: true,
        feel: "a harder pull before the block lets go",
        ..ROW
    },
    ParameterInfo {
        parameter: Parameter::DynamicForce,
        name: "dynamic_force",
        symbol: "Fd",
        unit: "N",
        max: 1e3,
        slider_max: 20.0,
        directional: true,
        feel: "a steady drag while the block slides, the same at every speed",
        ..ROW
    },
    ParameterInfo {
        parameter: Parameter::Viscous,
        name: "viscous",
        symbol: "b",
        aliases: &["sigma2"],
        unit: "N s/m",
        max: 1e4,
        slider_max: 50.0,
        directional: true,
        feel: "a drag that grows with speed, as in oil",
        ..ROW
    },
    ParameterInfo {
        parameter: Parameter::VelocityThreshold,
        name: "velocity_threshold",
        symbol: "DV",
        unit: "m/s",
        max: 1.0,
        slider_max: 0.05,
        step: 0.0001,
        feel: "a block that sticks again earlier: more stick-slip at low speed",
        ..ROW
    },
    ParameterInfo {
        parameter: Parameter::StribeckVelocity,
        name: "stribeck_velocity",
        symbol: "ws",
        aliases: &["vs"],
        unit: "m/s",
        max: 1.0,
        slider_max: 0.1,
        step: 0.0001,
        feel: "friction that falls off more gently as the block picks up speed",
        ..ROW
    },
    ParameterInfo {
        parameter: Parameter::RisingRate,
        name: "rising_rate",
        symbol: "gamma",
        unit: "1/s",
        max: 1e4,
        slider_max: 50.0,
        step: 0.1,
        feel: "stiction that is back sooner after a stop; 0 has it back at once",
        ..ROW
    },
    ParameterInfo {
        parameter: Parameter::ContactStiffness,
        name: "contact_stiffness",
        symbol: "Kp",
        aliases: &["sigma", "sigma0"],
        unit: "N/m",
        min: 1.0,
        max: 1e7,
        slider_min: 100.0,
        slider_max: 100_000.0,
        step: 1.0,
        scale: Scale::Logarithmic,
        feel: "a surface that gives way less before it slips; too much and the rig buzzes",
        ..ROW
    },
    ParameterInfo {
        parameter: Parameter::ContactDamping,
        name: "contact_damping",
        symbol: "sigma1",
        aliases: &["beta"],
        unit: "N s/m",
        max: 1e4,
        slider_max: 100.0,
        feel: "a contact that rings less while it sticks",
        ..ROW
    },
    ParameterInfo {
        parameter: Parameter::Exponent,
        name: "exponent",
        symbol: "i",
        unit: "1",
        max: 10.0,
        slider_max: 3.0,
        step: 0.1,
        feel: "a rounder, earlier yielding from stuck to sliding; 0 yields all at once",
        ..ROW
    },
    ParameterInfo {
        parameter: Parameter::ElasticFraction,
        name: "elastic_fraction",
        symbol: "zba",
        aliases: &["zs"],
        unit: "1",
        max: 0.99,
        slider_min: 0.1,
        slider_max: 0.95,
        feel: "a contact that springs back farther before it begins to slip",
        ..ROW
    },
    ParameterInfo {
        parameter: Parameter::Stiffness,
        name: "stiffness",
        symbol: "K",
        unit: "N/m",
        group: "coupling",
        max: 3e6,
        slider_min: 100.0,
        slider_max: 100_000.0,
        step: 1.0,
        scale: Scale::Logarithmic,
        feel: "a crisper grip on the block; too much and the rig buzzes",
        ..ROW
    },
    ParameterInfo {
        parameter: Parameter::Damping,
        name: "damping",
        symbol: "B",
        unit: "N s/m",
        group: "coupling",
        max: 1e4,
        slider_max: 100.0,
        feel: "a grip that rings less; too much and encoder noise is felt",
        ..ROW
    },
];

impl Parameter {
    /// The parameter's row in [`TABLE`].
    #[must_use]
    pub fn info(self) -> &'static ParameterInfo {
        // The table holds every parameter (a test counts them), so the search always ends on a row.
        TABLE.iter().find(|row| row.parameter == self).unwrap_or(&TABLE[0])
    }
}

/// All names and symbols, as a list for messages.
#[must_use]
pub fn known_names() -> String {
    names(&TABLE.map(|row| row.parameter))
}

/// The names and symbols of some parameters.
pub(super) fn names(parameters: &[Parameter]) -> String {
    let with_symbol = |parameter: &Parameter| {
        let info = parameter.info();
        alloc::format!("{} ({})", info.name, info.symbol)
    };
    let names: Vec<String> = parameters.iter().map(with_symbol).collect();
    names.join(", ")
}
