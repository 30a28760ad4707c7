//! What was found, as rows for people: value, unit and interval.

use super::{Identified, Interval};

/// A value that was found or given.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FoundValue {
    /// What it is, with its direction where it has one: `dynamic friction +`.
    pub what: String,
    /// The value, with the digits that its interval leaves.
    pub value: String,
    /// Its unit; empty for a number.
    pub unit: &'static str,
    /// Its 95 % interval, or `given`.
    pub interval: String,
}

impl Identified {
    /// The values with their units and intervals.
    #[must_use]
    pub fn values(&self) -> Vec<FoundValue> {
        let mut values = Vec::new();
        let mut add = |what: &str, value: Option<f64>, unit, name: &str| {
            let Some(value) = value else { return };
            let interval = self.intervals.get(name);
            let digits = decimals(value, interval);
            values.push(FoundValue {
                what: what.to_owned(),
                value: format!("{value:.digits$}"),
                unit,
                interval: interval.map_or_else(
                    || "given".to_owned(),
                    |[low, high]| format!("{low:.digits$} to {high:.digits$}"),
                ),
            });
        };
        add("mass", self.mass_kg, "kg", "mass_kg");
        for (what, value, unit, name) in [
            ("dynamic friction", self.dynamic_force_n, "N", "dynamic_force_N"),
            ("viscous friction", self.viscous_ns_per_m, "N s/m", "viscous_Ns_per_m"),
            ("static friction", self.static_force_n, "N", "static_force_N"),
        ] {
            let [up, down] = [value.map(|value| value.positive), value.map(|value| value.negative)];
            add(&format!("{what} +"), up, unit, &format!("{name}.positive"));
            add(&format!("{what} -"), down, unit, &format!("{name}.negative"));
        }
        for (what, value, unit, name) in [
            ("offset", self.offset_n, "N", "offset_N"),
            (
                "presliding stiffness",
                self.stiffness_n_per_m,
                "N/m",
                "stiffness_N_per_m",
            ),
            ("Dahl's exponent", self.exponent, "", "exponent"),
            (
                "Stribeck velocity",
                self.stribeck_velocity_mps,
                "m/s",
                "stribeck_velocity_mps",
            ),
            (
                "bristle damping",
                self.bristle_damping_ns_per_m,
                "N s/m",
                "bristle_damping_Ns_per_m",
            ),
        ] {
            add(what, value, unit, name);
        }
        values
    }
}

/// Digits behind the point that the interval leaves: those of a tenth of its half width.
fn decimals(value: f64, interval: Option<&Interval>) -> usize {
    let scale = interval.map_or(value.abs() * 1e-2, |[low, high]| (high - low) / 2.0);
    if !(scale > 0.0 && scale.is_finite()) {
        return 4;
    }
    let first = -scale.log10().floor();
    // A scale of 0.03 has its first digit two places behind the point.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "it is clamped")]
    let decimals = (first + 1.0).clamp(0.0, 9.0) as usize;
    decimals
}
