//! How often intervals hold the truth, over many records of a kind.

use super::kinds::{Conditions, Kind, Values, record};
use crate::identify::{Clocks, Identified, ModelKind, Options, identify};
use haptic_motion::median::median;
use std::ops::Range;
use std::thread;

/// What was found of a value in the records of a kind.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Found {
    /// In how many records it was answered.
    pub answered: usize,
    /// In how many of those its interval held the truth.
    pub held: usize,
    /// Half of each interval: a share of the truth, but for viscous friction in N s/m.
    halves: Vec<f64>,
}

impl Found {
    fn take(&mut self, interval: Option<[f64; 2]>, truth: f64, unit: f64) {
        let Some([low, high]) = interval else { return };
        self.answered += 1;
        self.held += usize::from((low..=high).contains(&truth));
        self.halves.push((high - low) / 2.0 / unit);
    }

    /// The median half of an interval, as a share of the truth, or in N s/m.
    #[must_use]
    pub fn median_half(&self) -> Option<f64> {
        median(&mut self.halves.clone())
    }
}

/// What was found in the records of a kind under some conditions.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Coverage {
    /// How many records there were.
    pub records: usize,
    /// Mass.
    pub mass: Found,
    /// Viscous friction in the positive direction.
    pub viscous: Found,
    /// Dynamic friction in the positive direction.
    pub dynamic: Found,
    /// Shift of two recorders.
    pub shift: Found,
}

impl Coverage {
    /// Identifies one record for each seed, on all processors.
    ///
    /// # Panics
    /// A record is refused as a whole: the kind is wrong.
    #[must_use]
    pub fn of(kind: Kind, conditions: &Conditions, seeds: Range<u64>) -> Self {
        let workers = thread::available_parallelism().map_or(1, std::num::NonZero::get);
        let mut whole = Self::default();
        thread::scope(|scope| {
            let work = |worker: usize| {
                let seeds = seeds.clone().skip(worker).step_by(workers);
                seeds.map(|seed| identified(kind, conditions, seed)).collect::<Vec<_>>()
            };
            let parts: Vec<_> = (0..workers).map(|worker| scope.spawn(move || work(worker))).collect();
            for part in parts {
                for (found, values) in part.join().expect("an identification does not panic") {
                    whole.take(&found, &values, conditions.shift_s);
                }
            }
        });
        whole
    }

    fn take(&mut self, found: &Identified, values: &Values, shift_s: f64) {
        let interval = |name: &str| found.intervals.get(name).copied();
        self.records += 1;
        self.mass.take(interval("mass_kg"), values.mass_kg, values.mass_kg);
        let viscous = interval("viscous_Ns_per_m.positive");
        self.viscous.take(viscous, values.viscous_ns_per_m, 1.0);
        let dynamic = interval("dynamic_force_N.positive");
        self.dynamic
            .take(dynamic, values.dynamic_force_n, values.dynamic_force_n);
        if shift_s != 0.0 {
            self.shift.take(interval("shift_s"), shift_s, 1e-3);
        }
    }
}

/// What is found of a record, and the values behind it.
fn identified(kind: Kind, conditions: &Conditions, seed: u64) -> (Identified, Values) {
    let (record, values) = record(kind, conditions, seed);
    let clocks = if conditions.shift_s == 0.0 {
        Clocks::One
    } else {
        Clocks::Two
    };
    let options = Options {
        clocks,
        seed,
        ..Options::new(ModelKind::Karnopp)
    };
    (identify(&record, &options).expect("the record is whole"), values)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_interval_holds_the_truth_nineteen_times_in_twenty() {
        let conditions = Conditions {
            rate_hz: 250.0,
            ..Conditions::FAIR
        };
        let records = test_run::extent(8, 200);
        let (mut answered, mut held) = (0, 0);
        for (kind, name) in Kind::ALL.into_iter().filter(|(kind, _)| kind.is_by_hand()) {
            let found = Coverage::of(kind, &conditions, 0..records);
            println!("{name}: {found:?}");
            for found in [&found.mass, &found.viscous, &found.dynamic] {
                answered += found.answered;
                held += found.held;
                assert!(
                    4 * found.answered >= 3 * usize::try_from(records).expect("few"),
                    "{name}"
                );
            }
        }
        assert!(100 * held >= 92 * answered, "{held} of {answered}");
    }
}
