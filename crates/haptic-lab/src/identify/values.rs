//! What was found, as rows for people: value, unit and interval.

use super::result::{Identified, Interval};

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

/// Parameters by the names that they have in a result, with their unit, for people.
const NAMES: [(&str, &str, &str); 9] = [
    ("mass_kg", "mass", "kg"),
    ("dynamic_force_N", "dynamic friction", "N"),
    ("viscous_Ns_per_m", "viscous friction", "N s/m"),
    ("static_force_N", "static friction", "N"),
    ("offset_N", "offset", "N"),
    ("stiffness_N_per_m", "presliding stiffness", "N/m"),
    ("exponent", "Dahl's exponent", ""),
    ("stribeck_velocity_mps", "Stribeck velocity", "m/s"),
    ("bristle_damping_Ns_per_m", "bristle damping", "N s/m"),
];

/// A parameter of a result in words: `static friction` for `static_force_N`. Another text is returned as it is.
#[must_use]
pub fn in_words(parameter: &str) -> &str {
    let named = NAMES.iter().find(|(name, ..)| *name == parameter);
    named.map_or(parameter, |(_, what, _)| what)
}

impl Identified {
    /// The values with their units and intervals.
    #[must_use]
    pub fn values(&self) -> Vec<FoundValue> {
        let mut values = Vec::new();
        let mut add = |name: &str, direction: &str, value: Option<f64>| {
            let Some(value) = value else { return };
            let (_, what, unit) = NAMES
                .into_iter()
                .find(|(known, ..)| *known == name)
                .unwrap_or((name, name, ""));
            let (what, interval) = match direction {
                "" => (what.to_owned(), self.intervals.get(name)),
                "+" => (format!("{what} +"), self.intervals.get(&format!("{name}.positive"))),
                _ => (format!("{what} -"), self.intervals.get(&format!("{name}.negative"))),
            };
            let digits = decimals(value, interval);
            // A zero has no sign.
            let text = |value: f64| {
                let text = format!("{value:.digits$}");
                let size = text.trim_start_matches('-');
                let is_zero = size.chars().all(|letter| "0.".contains(letter));
                if is_zero { size.to_owned() } else { text }
            };
            values.push(FoundValue {
                what,
                value: text(value),
                unit,
                interval: interval.map_or_else(
                    || "given".to_owned(),
                    |[low, high]| format!("{} to {}", text(*low), text(*high)),
                ),
            });
        };
        add("mass_kg", "", self.mass_kg);
        for (name, value) in [
            ("dynamic_force_N", self.dynamic_force_n),
            ("viscous_Ns_per_m", self.viscous_ns_per_m),
            ("static_force_N", self.static_force_n),
        ] {
            add(name, "+", value.map(|value| value.positive));
            add(name, "-", value.map(|value| value.negative));
        }
        for (name, value) in [
            ("offset_N", self.offset_n),
            ("stiffness_N_per_m", self.stiffness_n_per_m),
            ("exponent", self.exponent),
            ("stribeck_velocity_mps", self.stribeck_velocity_mps),
            ("bristle_damping_Ns_per_m", self.bristle_damping_ns_per_m),
        ] {
            add(name, "", value);
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

#[cfg(test)]
mod tests {
    use crate::identify::{Identified, ModelKind};

    #[test]
    fn an_interval_leaves_its_digits_and_a_zero_has_no_sign() {
        let mut found = Identified::empty(ModelKind::Karnopp);
        let mut shown = |value, interval| {
            found.offset_n = Some(value);
            found.intervals.insert("offset_N".to_owned(), interval);
            let [only] = &found.values()[..] else {
                panic!("one value")
            };
            (only.value.clone(), only.interval.clone())
        };
        let text = |value: &str, interval: &str| (value.to_owned(), interval.to_owned());
        assert_eq!(shown(-0.3, [-19.2, 18.6]), text("0", "-19 to 19"));
        assert_eq!(shown(0.1234, [-0.004, 0.25]), text("0.12", "0.00 to 0.25"));
        assert_eq!(shown(-0.1234, [-0.13, -0.12]), text("-0.1234", "-0.1300 to -0.1200"));
    }
}
