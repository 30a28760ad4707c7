//! How far apart the clocks of two records of one motion are, and how fast they drift.
//!
//! The positions show it: where the second record is late, it is behind by its velocity times the delay. A hand that
//! moves both surfaces alike is not where both masses are: a grip gives way by the difference of the forces over its
//! stiffness, less that of the velocities by its damping. Both are unknowns, or a stickier surface would pass for a
//! slower clock. Positions, velocities and forces pass one filter, under which that stays exact.

use super::align::{self, Alignment};
use super::signal::Signal;
use super::{CompareError, Side};
use crate::identify::Record;
use crate::robust_fit;
use crate::smoothing::slope;
use crate::two_clocks::{self, Change, Drift, NoShift, Shift, Shifts, stands_out};
use nalgebra::DMatrix;

/// Most rows of a fit.
const MAX_ROWS: usize = 8000;

/// Half of the time over which a force is averaged, s: as velocities are.
const HALF_MEAN_S: f64 = 0.02;

/// Longest change of a shift that must show in the positions, s, and how many are tried to either side.
const MAX_S: f64 = 0.5;
const TRIED: i32 = 10;

/// Longest shift from the one that was found by whole samples, s: up to there a fit converges.
const FARTHEST_S: f64 = 0.1;

/// Least agreement of the positions at which a drift is looked for, which blurs them in a long record.
const MIN_AGREEMENT: f64 = 0.5;

/// Two records on one clock.
pub(super) struct AlignedRecords {
    /// The second record, without the drift of its clock.
    pub(super) second: Signal,
    pub(super) alignment: Alignment,
    /// The shift with its interval, where the motions determine it.
    pub(super) shift: Option<Shift>,
    /// The drift that was taken out.
    pub(super) drift: Option<Drift>,
    /// Whether any shift leaves about the same positions.
    pub(super) is_any_shift_alike: bool,
}

impl AlignedRecords {
    /// Aligns the record of the second side with the first one's signal.
    ///
    /// # Errors
    /// As those of [`Signal::new`].
    pub(super) fn new(
        first: &Signal,
        record: &Record,
        period_s: f64,
        mass_kg: Option<f64>,
    ) -> Result<Self, CompareError> {
        let signal = |record: &Record| Signal::new(record, period_s, mass_kg, Side::Rendered);
        let (as_recorded, drift) = Self::as_recorded(first, signal(record)?);
        let Some(drift) = drift else { return Ok(as_recorded) };
        let steady = steady(
            record,
            &drift,
            as_recorded.alignment.middle_s(first, &as_recorded.second),
        );
        let (aligned, _) = Self::as_recorded(first, signal(&steady)?);
        Ok(if aligned.alignment.agreement < as_recorded.alignment.agreement {
            as_recorded
        } else {
            Self {
                drift: Some(drift),
                ..aligned
            }
        })
    }

    /// Aligns without removing a drift, and gives the drift that is certain.
    fn as_recorded(first: &Signal, second: Signal) -> (Self, Option<Drift>) {
        let coarse = align::find(first, &second);
        let found = find(first, &second, &coarse);
        let alignment = match &found {
            Ok(shifts) => Alignment::at(first, &second, shifts.middle.value_s),
            Err(_) => coarse,
        };
        let is_blurred = alignment.agreement < MIN_AGREEMENT;
        let growth = found.as_ref().ok().and_then(|shifts| shifts.growth);
        let drift = growth.and_then(|growth| Drift::of(&growth, coarse.overlap_s));
        let aligned = Self {
            second,
            alignment,
            shift: found.as_ref().ok().map(|shifts| shifts.middle),
            drift: None,
            is_any_shift_alike: found == Err(NoShift::AllAlike),
        };
        (aligned, drift.filter(|_| !is_blurred))
    }
}

/// The record with the times of a clock that agrees in the middle, s, with the one that was faster.
fn steady(record: &Record, drift: &Drift, middle_s: f64) -> Record {
    let rate = 1.0 + 1e-6 * drift.ppm;
    Record {
        t_s: record
            .t_s
            .iter()
            .map(|t_s| middle_s + (t_s - middle_s) / rate)
            .collect(),
        ..record.clone()
    }
}

/// The shift in the middle of the time that both hold, and its growth over that time.
fn find(first: &Signal, second: &Signal, alignment: &Alignment) -> Result<Shifts, NoShift> {
    let part = Part::new(first, second, alignment);
    // Two encoders at one steady speed agree to any part of a step at some shifts by chance.
    let steps_m2 = (first.step_m + second.step_m).powi(2);
    let variance = |shift_s: f64| steps_m2 + part.variance(alignment.shift_s + shift_s);
    let most = (-TRIED..=TRIED)
        .map(|step| variance(f64::from(step) / f64::from(TRIED) * MAX_S))
        .fold(0.0, f64::max);
    if !stands_out(variance(0.0), most) {
        return Err(NoShift::AllAlike);
    }
    two_clocks::refine(alignment.shift_s, |shift_s, growth_s| part.fit(shift_s, growth_s))
        .filter(|shifts| (shifts.middle.value_s - alignment.shift_s).abs() < FARTHEST_S)
        .ok_or(NoShift::OutOfReach)
}

/// A signal through one filter: what is equal of the positions stays so.
struct Smooth {
    position_m: Vec<f64>,
    velocity_mps: Vec<f64>,
    force_n: Vec<f64>,
}

impl Smooth {
    fn of(signal: &Signal) -> Self {
        let mean = |values: &[f64]| signal.mean_of(values, signal.samples_in(HALF_MEAN_S));
        let position_m = mean(&signal.position_m);
        Self {
            velocity_mps: slope(&position_m, 1, signal.period_s),
            force_n: mean(&signal.force_n),
            position_m,
        }
    }

    /// Position, velocity and force, each by the same rule.
    fn each(&self, value: impl Fn(&[f64]) -> f64) -> [f64; 3] {
        [&self.position_m, &self.velocity_mps, &self.force_n].map(|values| value(values))
    }
}

/// Samples of the time that both hold.
struct Part<'a> {
    first: &'a Signal,
    second: &'a Signal,
    /// Times on the first clock, s.
    times: Vec<f64>,
    first_smooth: Smooth,
    second_smooth: Smooth,
    /// Position of the second less that of the first, m: small values keep their digits.
    offset_m: f64,
}

impl<'a> Part<'a> {
    fn new(first: &'a Signal, second: &'a Signal, alignment: &Alignment) -> Self {
        let (from_s, count) = alignment.overlap(first, second);
        let step = count.div_ceil(MAX_ROWS).max(1);
        let times = (0..count).step_by(step);
        Self {
            times: times.map(|index| from_s + first.period_s * index as f64).collect(),
            first_smooth: Smooth::of(first),
            second_smooth: Smooth::of(second),
            offset_m: alignment.position_offset_m,
            first,
            second,
        }
    }

    /// Place of a time in the part, from -0.5 to 0.5.
    fn place(&self, index: usize) -> f64 {
        index as f64 / (self.times.len() - 1) as f64 - 0.5
    }

    /// The variance of what is left of the positions under a shift, m^2, over the times that both hold then.
    fn variance(&self, shift_s: f64) -> f64 {
        let (begin_s, end_s) = (self.second.start_s, self.second.start_s + self.second.length_s());
        let (mut count, mut sum, mut squares) = (0.0, 0.0, 0.0);
        for t in self
            .times
            .iter()
            .filter(|t| (begin_s..=end_s).contains(&(*t + shift_s)))
        {
            let left = self.second.value_at(&self.second.position_m, t + shift_s)
                - self.first.value_at(&self.first.position_m, *t)
                - self.offset_m;
            count += 1.0;
            sum += left;
            squares += left * left;
        }
        squares / count - (sum / count).powi(2)
    }

    fn fit(&self, shift_s: f64, growth_s: f64) -> Option<Change> {
        let (n, columns) = (self.times.len(), 5);
        let mut design = DMatrix::zeros(n, columns);
        let mut left = Vec::with_capacity(n);
        for (index, t) in self.times.iter().enumerate() {
            let place = self.place(index);
            let later = t + shift_s + growth_s * place;
            let (own, other) = (&self.first_smooth, &self.second_smooth);
            let [own_m, own_mps, own_n] = own.each(|values| self.first.value_at(values, *t));
            let [other_m, velocity, other_n] = other.each(|values| self.second.value_at(values, later));
            left.push(other_m - own_m);
            let (force, faster) = (other_n - own_n, velocity - own_mps);
            for (column, value) in [-velocity, -velocity * place, 1.0, force, faster]
                .into_iter()
                .enumerate()
            {
                design[(index, column)] = value;
            }
        }
        // Surfaces that are alike say nothing of the grip, and those that differ by viscous friction alone look late.
        let parts = robust_fit::equal_parts(n);
        let of_columns = |columns: usize| {
            let design = design.columns(0, columns).into_owned();
            robust_fit::fit(design, &left, &vec![0.0; columns], &parts).ok()
        };
        let found = of_columns(columns)
            .filter(|found| found.uncertainty_of(0).error < self.first.period_s)
            .or_else(|| of_columns(columns - 2))?;
        Some(Change {
            shift: (found.values[0], found.uncertainty_of(0)),
            growth: Some((found.values[1], found.uncertainty_of(1))),
        })
    }
}
