//! How near to the truth the identification of an experiment comes, over many seeds.

use super::Truth;
use super::cases::Case;
use crate::identify::{Identified, Options, identify};
use haptic_core::Directional;
use haptic_core::friction::Friction;
use std::collections::BTreeMap;
use std::ops::Range;

/// What was found of a parameter over many seeds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ParameterJudgement {
    /// The truth, in the parameter's unit; `None` where the truth has no such parameter.
    pub truth: Option<f64>,
    /// In how many runs it was reported.
    pub reported: usize,
    /// In how many of those the truth was inside the 95 % interval.
    pub inside: usize,
    /// Mean of the values that were reported.
    pub mean: f64,
    /// Root mean square of the values' errors, in the parameter's unit.
    pub rms: f64,
    /// Greatest error of a value, in the parameter's unit.
    pub worst: f64,
    /// Mean of half of the intervals, in the parameter's unit.
    pub half: f64,
    /// The first reason for which it was refused.
    pub refused: Option<String>,
}

/// What was found of a case.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Judgement {
    /// Parameter by parameter, by the names of the intervals.
    pub parameters: BTreeMap<String, ParameterJudgement>,
    /// How many seeds were run.
    pub runs: usize,
    /// In how many of them the program remarked that the law lacks something.
    pub doubted: usize,
}

impl Judgement {
    /// Runs a case once for each seed.
    ///
    /// # Panics
    /// The case's record cannot be made or is refused as a whole: the case is wrong.
    #[must_use]
    pub fn of(case: &Case, seeds: Range<u64>) -> Self {
        let motion = case.experiment.motion().expect("the case's scene can be rendered");
        let mut judgement = Self::default();
        for seed in seeds {
            let record = case.experiment.sensors.watch(&motion, seed);
            let options = Options {
                seed,
                ..Options::new(case.model)
            };
            let found = identify(&record, &options).expect("the case's record is whole");
            judgement.take(&found, &case.experiment.truth);
        }
        for judged in judgement.parameters.values_mut() {
            let count = judged.reported.max(1) as f64;
            judged.mean /= count;
            judged.half /= count;
            judged.rms = (judged.rms / count).sqrt();
        }
        judgement
    }

    fn take(&mut self, found: &Identified, truth: &Truth) {
        self.runs += 1;
        self.doubted += usize::from(found.notes.iter().any(|note| note.contains("lacks something")));
        for (name, [low, high]) in &found.intervals {
            let judged = self.parameters.entry(name.clone()).or_default();
            judged.truth = value_in(truth, name);
            let value = found.value(name).unwrap_or(f64::NAN);
            judged.reported += 1;
            judged.mean += value;
            judged.half += 0.5 * (high - low);
            if let Some(truth) = judged.truth {
                judged.inside += usize::from((*low..=*high).contains(&truth));
                judged.rms += (value - truth).powi(2);
                judged.worst = judged.worst.max((value - truth).abs());
            }
        }
        for refusal in &found.refused {
            let judged = self.parameters.entry(refusal.parameter.clone()).or_default();
            judged.refused.get_or_insert_with(|| refusal.reason.clone());
        }
    }
}

fn of_side(pair: Directional, side: &str) -> f64 {
    if side == "negative" {
        pair.negative
    } else {
        pair.positive
    }
}

/// The true value of a parameter, by the name of its interval.
pub(in crate::identify) fn value_in(truth: &Truth, name: &str) -> Option<f64> {
    let (name, side) = name.split_once('.').unwrap_or((name, ""));
    match (name, truth.friction) {
        ("mass_kg", _) => Some(truth.mass_kg),
        ("offset_N", _) => Some(truth.offset_n),
        ("dynamic_force_N", Friction::Dahl(law)) => Some(of_side(law.dynamic_force, side)),
        ("dynamic_force_N", Friction::Lugre(law)) => Some(of_side(law.dynamic_force, side)),
        ("dynamic_force_N", Friction::Karnopp(law)) => Some(of_side(law.dynamic_force, side)),
        ("viscous_Ns_per_m", Friction::Dahl(law)) => Some(of_side(law.viscous, side)),
        ("viscous_Ns_per_m", Friction::Lugre(law)) => Some(of_side(law.viscous, side)),
        ("viscous_Ns_per_m", Friction::Karnopp(law)) => Some(of_side(law.viscous, side)),
        ("static_force_N", Friction::Lugre(law)) => Some(of_side(law.static_force, side)),
        ("static_force_N", Friction::Karnopp(law)) => Some(of_side(law.static_force, side)),
        ("stiffness_N_per_m", Friction::Dahl(law)) => Some(law.contact_stiffness),
        ("stiffness_N_per_m", Friction::Lugre(law)) => Some(law.contact_stiffness),
        ("exponent", Friction::Dahl(law)) => Some(law.exponent),
        ("stribeck_velocity_mps", Friction::Lugre(law)) => Some(law.stribeck_velocity),
        ("bristle_damping_Ns_per_m", Friction::Lugre(law)) => Some(law.contact_damping),
        _ => None,
    }
}
