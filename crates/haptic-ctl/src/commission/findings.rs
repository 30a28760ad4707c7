//! What was found out about a rig.

use crate::failure::Failure;
use crate::output;
use haptic_core::scene::Coupling;
use haptic_ipc::CommissionReply;
use serde::Serialize;

/// A step of the encoder that is a count, to the last digits that travel.
const SAME_STEP: f64 = 1e-3;

/// One value for each direction, where it is known.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub(super) struct Pair {
    positive: Option<f64>,
    negative: Option<f64>,
}

impl Pair {
    pub(super) fn of(&self, sign: f64) -> Option<f64> {
        if sign > 0.0 { self.positive } else { self.negative }
    }

    pub(super) fn of_mut(&mut self, sign: f64) -> &mut Option<f64> {
        if sign > 0.0 {
            &mut self.positive
        } else {
            &mut self.negative
        }
    }

    fn shown(&self) -> String {
        let newtons =
            |value: Option<f64>| value.map_or_else(|| "not known".to_owned(), |value| format!("{value:.2} N"));
        format!("+ {}, - {}", newtons(self.positive), newtons(self.negative))
    }
}

#[derive(Clone, Debug, Default, Serialize)]
pub(super) struct Findings {
    pub(super) rig: String,
    pub(super) firmware: String,
    /// Of a rig of two axes the motor, which has neither range nor step of its own.
    #[serde(skip_serializing_if = "Option::is_none")]
    motor: Option<u32>,
    /// 1: a positive force moves the handle in the positive direction. With another nothing comes
    /// so far.
    sign: i8,
    /// The force of the first pulse that moved the handle, N.
    #[serde(rename = "breakaway_N")]
    pub(super) breakaway_n: Pair,
    #[serde(rename = "friction_N")]
    pub(super) friction_n: Pair,
    #[serde(flatten)]
    pub(super) mass: Option<Mass>,
    /// As it was identified, which counts more, kg.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) identified_mass_kg: Option<f64>,
    pub(super) range_m: Option<f64>,
    /// Between two counts, as the device says, m.
    resolution_m: f64,
    /// As it was seen, m.
    pub(super) step_m: Option<f64>,
    pub(super) pulses: u64,
    /// Where the daemon keeps it.
    pub(super) path: Option<String>,
    /// The stiffest grip that the rig bears with a factor of two.
    pub(super) coupling: Option<Coupling>,
    /// The least and the greatest mass with which it bears that, where its own is not known, kg.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) coupling_masses_kg: Option<[f64; 2]>,
    /// The revision since which the active scene has it, where this has changed that.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) scene_revision: Option<u64>,
}

/// Mass of the moving part, as the pulses agree on it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub(super) struct Mass {
    #[serde(rename = "mass_kg")]
    pub(super) kg: f64,
    /// By how much it may differ: the interval holds those of all pulses, kg.
    #[serde(rename = "mass_spread_kg")]
    spread_kg: f64,
}

impl Mass {
    /// Fewest pulses that tell it.
    const MIN_PULSES: usize = 3;

    /// Largest spread with which it is reported, as a share of the mass.
    const MAX_SPREAD: f64 = 0.2;

    /// What some pulses say, each with by how much it may differ, kg, if they agree.
    pub(super) fn of(masses_kg: &[(f64, f64)]) -> Option<Self> {
        let least_kg = masses_kg
            .iter()
            .map(|(kg, within_kg)| kg - within_kg)
            .fold(f64::INFINITY, f64::min);
        let most_kg = masses_kg
            .iter()
            .map(|(kg, within_kg)| kg + within_kg)
            .fold(0.0, f64::max);
        let (kg, spread_kg) = (0.5 * (least_kg + most_kg), 0.5 * (most_kg - least_kg));
        (masses_kg.len() >= Self::MIN_PULSES && spread_kg <= Self::MAX_SPREAD * kg).then_some(Self { kg, spread_kg })
    }
}

impl Findings {
    pub(super) fn new(begun: &CommissionReply) -> Self {
        Self {
            rig: begun.rig.clone(),
            firmware: begun.firmware.clone(),
            motor: begun.motor,
            sign: 1,
            resolution_m: begun.resolution_m,
            ..Self::default()
        }
    }

    /// Of both directions, as far as they are known, N.
    pub(super) fn mean_friction_n(&self) -> Option<f64> {
        let known: Vec<f64> = [self.friction_n.positive, self.friction_n.negative]
            .into_iter()
            .flatten()
            .collect();
        mean(&known)
    }

    pub(super) fn table(&self) -> String {
        let range = self
            .range_m
            .map_or_else(|| "not known".to_owned(), |range_m| format!("{:.1} mm", mm(range_m)));
        let stated_um = self.resolution_m * 1e6;
        let step = match self.step_m {
            None => format!("not seen; the device says {stated_um:.3} um"),
            Some(step_m) if (step_m - self.resolution_m).abs() <= SAME_STEP * self.resolution_m => {
                format!("{stated_um:.3} um, as the device says")
            }
            Some(step_m) => format!(
                "{:.3} um, where the device says {stated_um:.3} um: is counts_per_metre in its hello right?",
                step_m * 1e6
            ),
        };
        let direction = match self.motor {
            None => "right: a positive force moves the handle in the positive direction",
            Some(_) => "right: a positive effort moves the motor's own encoder in the positive direction",
        };
        let mut rows = vec![
            ("  direction", direction.to_owned()),
            ("  first moved at", self.breakaway_n.shown()),
            ("  friction, drag", self.friction_n.shown()),
            ("  mass", self.mass_for_people()),
        ];
        if self.motor.is_none() {
            rows.extend([("  range", range), ("  encoder step", step)]);
        }
        output::named(rows)
    }

    fn mass_for_people(&self) -> String {
        let by_pulses = self
            .mass
            .map(|Mass { kg, spread_kg }| output::within(kg, spread_kg, "kg"));
        match (self.identified_mass_kg, by_pulses) {
            (Some(kg), Some(by_pulses)) => return format!("{kg:.3} kg, as identified; by the pulses {by_pulses}"),
            (Some(kg), None) => return format!("{kg:.3} kg, as identified; the pulses do not tell it"),
            (None, Some(by_pulses)) => return by_pulses,
            (None, None) => {}
        }
        let mut text = "not known: the pulses do not tell it".to_owned();
        if self.motor.is_none() {
            let range = self.range_m.map_or(" --range-mm MM", |_| "");
            text.push_str(&format!(
                "; for a stiffer grip run `haptic-ctl identify --rig{range}`, then commission again"
            ));
        }
        text
    }

    /// The stiffest grip, for people.
    fn grip(&self) -> Option<String> {
        let Coupling { stiffness, damping } = self.coupling?;
        let masses = self.coupling_masses_kg.map_or_else(String::new, |[least, most]| {
            format!(" with any mass from {least} to {most} kg, as its own is not known")
        });
        Some(format!(
            "The stiffest grip that it bears with a factor of two{masses}: K = {stiffness} N/m with B = {damping} N s/m, \
             which scenes with `coupling = \"rig\"` have"
        ))
    }

    pub(super) fn show(&self, json: bool) -> Result<(), Failure> {
        if json {
            return output::json(self);
        }
        let mut text = format!("{} is commissioned\n{}", self.rig, self.table());
        if let Some(path) = &self.path {
            text.push_str(&format!("\nkept in {path}"));
        }
        if let Some(grip) = self.grip() {
            text.push_str(&format!("\n{grip}"));
        } else if self.path.is_some() {
            text.push_str(
                "\nNo grip was found that it bears with a factor of two, as where the link or the machine was late: scenes \
                 with `coupling = \"rig\"` have a calm one. Commission it again for a stiffer one",
            );
        }
        if let Some(revision) = self.scene_revision {
            text.push_str(&format!("\nThe active scene has this grip, as revision {revision}"));
        }
        output::line(&text)
    }
}

pub(super) fn mm(metres: f64) -> f64 {
    metres * 1e3
}

/// Of some numbers; nothing of none.
pub(super) fn mean(values: &[f64]) -> Option<f64> {
    #[expect(clippy::cast_precision_loss, reason = "a few values")]
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn mass_holds_what_each_pulse_says() {
        let pulses = [(0.0205, 0.0006), (0.0208, 0.0012), (0.0207, 0.0001)];
        let mass = Mass::of(&pulses).expect("they agree");
        for (kg, within_kg) in pulses {
            assert!((mass.kg - kg).abs() + within_kg <= mass.spread_kg + 1e-12, "{mass:?}");
        }
        assert_eq!(Mass::of(&pulses[..2]), None, "too few");
        assert_eq!(Mass::of(&[(0.02, 0.006); 3]), None, "too wide");
    }

    fn begun() -> CommissionReply {
        serde_json::from_value(serde_json::json!({
            "by": {"session": "ada", "uid": 0}, "rig": "fake", "firmware": "mine 1.0", "pulsing": false, "force_limit_N": 1.0,
            "rig_force_limit_N": 2.0, "resolution_m": 1e-5, "ramp_ms": 200.0, "pulses": 0, "positive_confirmed": false,
            "negative_confirmed": false, "position_m": 0.0,
        }))
        .expect("a reply")
    }

    #[test]
    fn a_mass_that_pulses_do_not_tell_says_what_does() {
        let mut found = Findings::new(&begun());
        let unknown = found.mass_for_people();
        assert!(
            unknown.contains("`haptic-ctl identify --rig --range-mm MM`"),
            "{unknown}"
        );
        found.range_m = Some(0.1);
        let unknown = found.mass_for_people();
        assert!(unknown.contains("`haptic-ctl identify --rig`"), "{unknown}");
        found.identified_mass_kg = Some(0.05);
        assert_eq!(
            found.mass_for_people(),
            "0.050 kg, as identified; the pulses do not tell it"
        );
        found.mass = Mass::of(&[(0.06, 0.001); 3]);
        assert_eq!(
            found.mass_for_people(),
            "0.050 kg, as identified; by the pulses 0.0600 kg, within 0.0011 kg"
        );
    }

    #[test]
    fn a_grip_says_for_which_masses_it_holds() {
        let coupling = Coupling {
            stiffness: 500.0,
            damping: 2.0,
        };
        let known = Findings {
            coupling: Some(coupling),
            ..Findings::new(&begun())
        };
        let ends = "K = 500 N/m with B = 2 N s/m, which scenes with `coupling = \"rig\"` have";
        let text = |found: &Findings| found.grip().expect("a grip");
        assert_eq!(
            text(&known),
            format!("The stiffest grip that it bears with a factor of two: {ends}")
        );
        let unknown = Findings {
            coupling_masses_kg: Some([0.02, 3.0]),
            ..known
        };
        assert_eq!(
            text(&unknown),
            format!(
                "The stiffest grip that it bears with a factor of two with any mass from 0.02 to 3 kg, as its own is not \
                 known: {ends}"
            )
        );
    }
}
