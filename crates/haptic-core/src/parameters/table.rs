//! The table of parameters: name, paper symbol, unit, range, and feel.

use super::parameter::{Parameter, ParameterInfo, Scale};
use alloc::string::String;

/// The parameter table, in the order in which people read a scene.
pub const TABLE: [ParameterInfo; 13] = [
    ParameterInfo {
        parameter: Parameter::Mass,
        name: "mass",
        symbol: "M",
        aliases: &[],
        unit: "kg",
        group: "block",
        min: 1e-6,
        max: 100.0,
        slider_min: 0.01,
        slider_max: 10.0,
        step: 0.001,
        scale: Scale::Logarithmic,
        directional: false,
        feel: "a heavier block: slower to set off and harder to stop",
    },
    ParameterInfo {
        parameter: Parameter::StaticForce,
        name: "static_force",
        symbol: "Fs",
        aliases: &[],
        unit: "N",
        group: "friction",
        min: 0.0,
        max: 1e3,
        slider_min: 0.0,
        slider_max: 20.0,
        step: 0.01,
        scale: Scale::Linear,
        directional: true,
        feel: "a harder pull before the block lets go",
    },
    ParameterInfo {
        parameter: Parameter::DynamicForce,
        name: "dynamic_force",
        symbol: "Fd",
        aliases: &[],
        unit: "N",
        group: "friction",
        min: 0.0,
        max: 1e3,
        slider_min: 0.0,
        slider_max: 20.0,
        step: 0.01,
        scale: Scale::Linear,
        directional: true,
        feel: "a steady drag while the block slides, the same at every speed",
    },
    ParameterInfo {
        parameter: Parameter::Viscous,
        name: "viscous",
        symbol: "b",
        aliases: &["sigma2"],
        unit: "N s/m",
        group: "friction",
        min: 0.0,
        max: 1e4,
        slider_min: 0.0,
        slider_max: 50.0,
        step: 0.01,
        scale: Scale::Linear,
        directional: true,
        feel: "a drag that grows with speed, as in oil",
    },
    ParameterInfo {
        parameter: Parameter::VelocityThreshold,
        name: "velocity_threshold",
        symbol: "DV",
        aliases: &[],
        unit: "m/s",
        group: "friction",
        min: 0.0,
        max: 1.0,
        slider_min: 0.0,
        slider_max: 0.05,
        step: 0.0001,
        scale: Scale::Linear,
        directional: false,
        feel: "a block that sticks again earlier: more stick-slip at low speed",
    },
    ParameterInfo {
        parameter: Parameter::StribeckVelocity,
        name: "stribeck_velocity",
        symbol: "ws",
        aliases: &["vs"],
        unit: "m/s",
        group: "friction",
        min: 0.0,
        max: 1.0,
        slider_min: 0.0,
        slider_max: 0.1,
        step: 0.0001,
        scale: Scale::Linear,
        directional: false,
        feel: "friction that falls off more gently as the block picks up speed",
    },
    ParameterInfo {
        parameter: Parameter::RisingRate,
        name: "rising_rate",
        symbol: "gamma",
        aliases: &[],
        unit: "1/s",
        group: "friction",
        min: 0.0,
        max: 1e4,
        slider_min: 0.0,
        slider_max: 50.0,
        step: 0.1,
        scale: Scale::Linear,
        directional: false,
        feel: "stiction that is back sooner after a stop; 0 has it back at once",
    },
    ParameterInfo {
        parameter: Parameter::ContactStiffness,
        name: "contact_stiffness",
        symbol: "Kp",
        aliases: &["sigma", "sigma0"],
        unit: "N/m",
        group: "friction",
        min: 1.0,
        max: 1e7,
        slider_min: 100.0,
        slider_max: 100_000.0,
        step: 1.0,
        scale: Scale::Logarithmic,
        directional: false,
        feel: "a surface that gives way less before it slips; too much and the rig buzzes",
    },
    ParameterInfo {
        parameter: Parameter::ContactDamping,
        name: "contact_damping",
        symbol: "sigma1",
        aliases: &["beta"],
        unit: "N s/m",
        group: "friction",
        min: 0.0,
        max: 1e4,
        slider_min: 0.0,
        slider_max: 100.0,
        step: 0.01,
        scale: Scale::Linear,
        directional: false,
        feel: "a contact that rings less while it sticks",
    },
    ParameterInfo {
        parameter: Parameter::Exponent,
        name: "exponent",
        symbol: "i",
        aliases: &[],
        unit: "1",
        group: "friction",
        min: 0.0,
        max: 10.0,
        slider_min: 0.0,
        slider_max: 3.0,
        step: 0.1,
        scale: Scale::Linear,
        directional: false,
        feel: "a rounder, earlier yielding from stuck to sliding; 0 yields all at once",
    },
    ParameterInfo {
        parameter: Parameter::ElasticFraction,
        name: "elastic_fraction",
        symbol: "zba",
        aliases: &["zs"],
        unit: "1",
        group: "friction",
        min: 0.0,
        max: 0.99,
        slider_min: 0.1,
        slider_max: 0.95,
        step: 0.01,
        scale: Scale::Linear,
        directional: false,
        feel: "a contact that springs back farther before it begins to slip",
    },
    ParameterInfo {
        parameter: Parameter::Stiffness,
        name: "stiffness",
        symbol: "K",
        aliases: &[],
        unit: "N/m",
        group: "coupling",
        min: 0.0,
        max: 3e6,
        slider_min: 100.0,
        slider_max: 100_000.0,
        step: 1.0,
        scale: Scale::Logarithmic,
        directional: false,
        feel: "a crisper grip on the block; too much and the rig buzzes",
    },
    ParameterInfo {
        parameter: Parameter::Damping,
        name: "damping",
        symbol: "B",
        aliases: &[],
        unit: "N s/m",
        group: "coupling",
        min: 0.0,
        max: 1e4,
        slider_min: 0.0,
        slider_max: 100.0,
        step: 0.01,
        scale: Scale::Linear,
        directional: false,
        feel: "a grip that rings less; too much and encoder noise is felt",
    },
];

impl Parameter {
    /// The parameter's row in [`TABLE`].
    #[must_use]
    pub fn info(self) -> &'static ParameterInfo {
        // The table holds every parameter (a test counts them), so the search always ends on a row.
        let mut row = &TABLE[0];
        for candidate in &TABLE {
            if candidate.parameter == self {
                row = candidate;
            }
        }
        row
    }
}

/// All names and symbols, as a list for messages.
#[must_use]
pub fn known_names() -> String {
    let mut names = String::new();
    for row in &TABLE {
        if !names.is_empty() {
            names.push_str(", ");
        }
        names.push_str(row.name);
        names.push_str(" (");
        names.push_str(row.symbol);
        names.push(')');
    }
    names
}
