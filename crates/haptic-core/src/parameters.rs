//! The one table of parameters: name, paper symbol, unit, range, and what each makes the hand feel.
//!
//! Validation, the wire, the command line's help and the panel's sliders are all driven by [`TABLE`],
//! so that a parameter is described in one place and cannot be described differently in another.

use crate::scene::SceneError;
use alloc::string::{String, ToString};
use core::fmt;
use core::str::FromStr;

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

/// Direction of motion along the device axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Direction {
    /// Along the positive axis.
    Positive,
    /// Along the negative axis.
    Negative,
}

impl Direction {
    /// Both, positive first.
    pub const BOTH: [Self; 2] = [Self::Positive, Self::Negative];

    /// `+1` or `-1`.
    #[must_use]
    pub const fn sign(self) -> f64 {
        match self {
            Self::Positive => 1.0,
            Self::Negative => -1.0,
        }
    }

    /// The direction in which a force or velocity points; zero counts as positive.
    #[must_use]
    pub fn of(value: f64) -> Self {
        if value < 0.0 { Self::Negative } else { Self::Positive }
    }
}

/// How a slider should spread a parameter's range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Equal distances are equal differences.
    Linear,
    /// Equal distances are equal ratios.
    Logarithmic,
}

/// Everything there is to say about a parameter.
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
    /// What a larger value makes the hand feel.
    pub feel: &'static str,
}

impl ParameterInfo {
    /// Whether `text` is the parameter's name or one of its symbols.
    #[must_use]
    pub fn is_called(&self, text: &str) -> bool {
        self.name == text || self.symbol == text || self.aliases.contains(&text)
    }
}

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
    /// One direction of it.
    #[must_use]
    pub const fn in_direction(self, direction: Direction) -> ParameterKey {
        ParameterKey {
            parameter: self,
            direction: Some(direction),
        }
    }

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

/// A parameter, or one direction of it: `mass`, `M`, `static_force`, `Fs`, `Fs+`, `static_force-`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct ParameterKey {
    /// The parameter.
    pub parameter: Parameter,
    /// One direction of it, or both.
    pub direction: Option<Direction>,
}

impl From<Parameter> for ParameterKey {
    fn from(parameter: Parameter) -> Self {
        Self {
            parameter,
            direction: None,
        }
    }
}

impl fmt::Display for ParameterKey {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.parameter.info().name)?;
        match self.direction {
            None => Ok(()),
            Some(Direction::Positive) => f.write_str("+"),
            Some(Direction::Negative) => f.write_str("-"),
        }
    }
}

impl FromStr for ParameterKey {
    type Err = SceneError;

    /// Reads a name or a symbol with an optional trailing `+` or `-`.
    ///
    /// # Errors
    /// [`SceneError::UnknownParameter`], with the nearest name, or [`SceneError::NotDirectional`].
    fn from_str(text: &str) -> Result<Self, SceneError> {
        let (base, direction) = match text.as_bytes().last() {
            Some(b'+') => (&text[..text.len() - 1], Some(Direction::Positive)),
            Some(b'-') => (&text[..text.len() - 1], Some(Direction::Negative)),
            _ => (text, None),
        };
        let Some(info) = TABLE.iter().find(|row| row.is_called(base)) else {
            return Err(SceneError::UnknownParameter {
                name: text.to_string(),
                nearest: nearest_name(base),
            });
        };
        if direction.is_some() && !info.directional {
            return Err(SceneError::NotDirectional {
                param: info.parameter,
                given: text.to_string(),
            });
        }
        Ok(Self {
            parameter: info.parameter,
            direction,
        })
    }
}

/// Bytes of the longest text for which a name is looked for.
const LONGEST_NAME: usize = 64;

/// The name or symbol that `text` was most likely meant to be, when one is near enough to say so.
fn nearest_name(text: &str) -> Option<&'static str> {
    // No name is near to a longer one; and looking takes time that grows with it, while anybody may send one of any length.
    if text.len() > LONGEST_NAME {
        return None;
    }
    let wanted = text.to_ascii_lowercase();
    let mut best: Option<(usize, &'static str)> = None;
    for row in &TABLE {
        for candidate in [row.name, row.symbol] {
            let distance = edit_distance(&wanted, &candidate.to_ascii_lowercase());
            if best.is_none_or(|(least, _)| distance < least) {
                best = Some((distance, candidate));
            }
        }
    }
    // A third of the letters may be wrong; a one-letter symbol must match but for its case.
    best.filter(|(distance, name)| *distance <= name.len() / 3)
        .map(|(_, name)| name)
}

/// Levenshtein distance in bytes; both texts are short.
fn edit_distance(a: &str, b: &str) -> usize {
    let mut row: alloc::vec::Vec<usize> = (0..=b.len()).collect();
    for (i, from) in a.bytes().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, to) in b.bytes().enumerate() {
            let substituted = diagonal + usize::from(from != to);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_has_its_own_row_name_and_symbol() {
        for (index, row) in TABLE.iter().enumerate() {
            assert_eq!(row.parameter.info(), row);
            assert!(row.min <= row.slider_min && row.slider_min < row.slider_max && row.slider_max <= row.max);
            for other in &TABLE[index + 1..] {
                assert_ne!(row.name, other.name);
                assert_ne!(row.symbol, other.symbol);
            }
        }
    }

    #[test]
    fn names_symbols_and_directions_are_read() {
        let both: ParameterKey = "Fs".parse().expect("a symbol");
        assert_eq!(both, Parameter::StaticForce.into());
        let negative: ParameterKey = "dynamic_force-".parse().expect("a name with a direction");
        assert_eq!(negative.direction, Some(Direction::Negative));
        assert_eq!(negative.to_string(), "dynamic_force-");
    }

    #[test]
    fn a_misspelt_name_is_answered_with_the_nearest() {
        let error = "static_forse".parse::<ParameterKey>().expect_err("no such name");
        assert!(error.to_string().contains("did you mean `static_force`"), "{error}");
        let error = "fs".parse::<ParameterKey>().expect_err("symbols keep their case");
        assert!(error.to_string().contains("did you mean `Fs`"), "{error}");
        let error = "colour".parse::<ParameterKey>().expect_err("no such name");
        assert!(!error.to_string().contains("did you mean"), "{error}");
    }

    #[test]
    fn a_direction_on_a_parameter_without_one_is_refused() {
        let error = "M+".parse::<ParameterKey>().expect_err("mass has no direction");
        assert!(error.to_string().contains("mass"), "{error}");
    }
}
