//! The linear fit to rows of the weak form.

use super::motion::MotionEstimate;
use crate::identify::grid::Grid;
use crate::robust_fit::{self, PARTS, RobustFit, Uncertainty, Unfit};
use crate::smoothing::{Window, weighted, whole};
use crate::stats::mean::rms;
use haptic_motion::median::extent;
use nalgebra::{DMatrix, DVector};

/// Most rows of a fit; of longer records every second, third ... is taken.
const MAX_ROWS: usize = 8000;

/// Rows that overlap, for each one that does not.
pub(super) const OVERLAPPING: f64 = 3.0;

/// Parts of the record that err each in its own way are pairs of strokes, joined to at most [`PARTS`]. Of fewer pairs
/// than this they are cut.
const MIN_PAIRS: usize = 6;

/// Share of the positions' noise that may be none.
const NOT_NOISE: f64 = 0.5;

/// One window's worth of Newton's law.
#[derive(Clone, Copy, Debug)]
pub(super) struct RegressionRow {
    /// Sample in its middle.
    pub(super) at: usize,
    /// Its place in the record, from -0.5 to 0.5.
    pub(super) place: f64,
    /// Acceleration, m/s^2.
    pub(super) acceleration: f64,
    /// Velocity, m/s.
    pub(super) velocity: f64,
    /// Direction of the slide, 1 or -1.
    pub(super) sense: f64,
}

impl RegressionRow {
    /// Whether it slides in the positive direction, 0, or in the negative one, 1.
    fn is_of(&self, side: usize) -> bool {
        (self.sense < 0.0) == (side == 1)
    }
}

/// The rows of a record under one window.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    pub(super) window: Window,
    pub(super) half_s: f64,
    pub(super) rows: Vec<RegressionRow>,
    /// Samples from one row to the next.
    pub(super) step: usize,
    /// The part of the record that each row belongs to.
    parts: Vec<usize>,
    /// Standard deviation of a position's noise, m.
    position_noise_m: f64,
}

impl Rows {
    /// The rows whose whole window is valid and slides one way: how long the mass rests at a turn, and at which instant
    /// it turns, is not known.
    pub(super) fn new(grid: &Grid, motion: &MotionEstimate, half_s: f64, margin_s: f64) -> Self {
        let window = Window::new(half_s, grid.period_s);
        let reach = window.reach;
        let around = reach + whole(margin_s / grid.period_s);
        let (mut rows, mut step) = (Vec::new(), 1);
        if grid.len() > 2 * around {
            let senses = || motion.sense.iter().zip(&grid.is_valid);
            let sliding = senses().filter(|(sense, is_valid)| **sense != 0 && **is_valid).count();
            step = (reach / 3).max(1).max(sliding / MAX_ROWS);
            let mut before = Vec::with_capacity(grid.len() + 1);
            before.push(0_i64);
            for (sense, is_valid) in senses() {
                before.push(before[before.len() - 1] + if *is_valid { i64::from(*sense) } else { 0 });
            }
            for at in (reach..grid.len() - around).step_by(step).filter(|at| *at >= around) {
                let slid = before[at + around + 1] - before[at - around];
                if slid.unsigned_abs() == 2 * around as u64 + 1 {
                    rows.push(row(grid, motion, &window, at));
                }
            }
        }
        Self {
            parts: parts(&rows, step, motion),
            window,
            half_s,
            rows,
            step,
            position_noise_m: motion.noise_m,
        }
    }

    /// Root mean square of the accelerations, m/s^2.
    pub(super) fn acceleration_rms(&self) -> f64 {
        rms(self.rows.iter().map(|row| row.acceleration))
    }

    /// Those of the rows that are kept.
    pub(super) fn kept(&self, is_kept: &[bool]) -> Self {
        let kept = || {
            is_kept
                .iter()
                .enumerate()
                .filter(|(_, is_kept)| **is_kept)
                .map(|(index, _)| index)
        };
        Self {
            rows: kept().map(|index| self.rows[index]).collect(),
            parts: kept().map(|index| self.parts[index]).collect(),
            ..self.clone()
        }
    }

    /// Variance of the noise in an unknown's coefficients, in their unit.
    fn noise(&self, unknown: Unknown, beside: Beside<'_>, shape: Shape) -> f64 {
        let square = |weights: &[f64]| weights.iter().map(|weight| weight * weight).sum::<f64>();
        let (position, force) = (self.position_noise_m.powi(2), beside.force_noise_n.powi(2));
        match unknown {
            Unknown::Mass => position * square(&self.window.curvature),
            Unknown::Viscous(side) => {
                let with = self.rows.iter().filter(|row| !shape.is_separate || row.is_of(side));
                position * square(&self.window.slope) * with.count() as f64 / self.rows.len() as f64
            }
            Unknown::Shift => force * square(&self.window.slope),
            Unknown::ShiftGrowth => force * square(&self.window.slope) / 12.0,
            Unknown::Level(_) | Unknown::Drift | Unknown::Place(_) => 0.0,
        }
    }

    /// Hats over the travel, each a straight rise to its place and a straight fall from there, in the mean of each
    /// row's window, less the mean of all rows, as the offset has that. The one at the lowest place is that of all
    /// others together.
    pub(super) fn places(&self, grid: &Grid, hats: usize) -> Vec<Vec<f64>> {
        let x = &grid.position_m;
        let (low, high) = extent(x.iter().copied());
        let last = hats as f64;
        let of_row = |row: &RegressionRow| {
            let mut shares = vec![0.0; hats + 1];
            for (weight, x) in self.window.mean.iter().zip(&x[row.at - self.window.reach..]) {
                let place = ((x - low) / (high - low) * last).clamp(0.0, last);
                let below = whole(place).min(hats - 1);
                let share = place - below as f64;
                shares[below] += weight * (1.0 - share);
                shares[below + 1] += weight * share;
            }
            shares.remove(0);
            shares
        };
        let mut places: Vec<Vec<f64>> = self.rows.iter().map(of_row).collect();
        for hat in 0..hats {
            let mean = places.iter().map(|shares| shares[hat]).sum::<f64>() / places.len() as f64;
            places.iter_mut().for_each(|shares| shares[hat] -= mean);
        }
        places
    }

    /// The force of each row, N.
    pub(super) fn forces(&self, force: &[f64]) -> Vec<f64> {
        let smoothed = |row: &RegressionRow| weighted(&self.window.mean, force, row.at, 0.0);
        self.rows.iter().map(smoothed).collect()
    }

    /// Each row's change of force with time, N/s.
    pub(super) fn force_rates(&self, force: &[f64]) -> Vec<f64> {
        self.rows
            .iter()
            .map(|row| weighted(&self.window.slope, force, row.at, force[row.at]))
            .collect()
    }
}

/// The part of each row.
fn parts(rows: &[RegressionRow], step: usize, motion: &MotionEstimate) -> Vec<usize> {
    let mut strokes = vec![0; rows.len()];
    for index in 1..rows.len() {
        let (before, now) = (rows[index - 1].at, rows[index].at);
        let is_next = now > before + step || motion.sense[now] != motion.sense[before];
        strokes[index] = strokes[index - 1] + usize::from(is_next);
    }
    let pairs = strokes.last().map_or(0, |last| last / 2 + 1);
    if pairs < MIN_PAIRS {
        return robust_fit::equal_parts(rows.len());
    }
    if pairs <= PARTS {
        return strokes.iter().map(|stroke| stroke / 2).collect();
    }
    // Each pair whole in the part that its middle lies in, of parts of equal size.
    let mut parts = Vec::with_capacity(rows.len());
    for pair in strokes.chunk_by(|one, two| one / 2 == two / 2) {
        let middle = parts.len() + pair.len() / 2;
        parts.extend(pair.iter().map(|_| middle * PARTS / rows.len()));
    }
    parts
}

fn row(grid: &Grid, motion: &MotionEstimate, window: &Window, at: usize) -> RegressionRow {
    let x = &grid.position_m;
    RegressionRow {
        at,
        place: at as f64 / grid.len() as f64 - 0.5,
        acceleration: weighted(&window.curvature, x, at, x[at]),
        velocity: weighted(&window.slope, x, at, x[at]),
        sense: f64::from(motion.sense[at]),
    }
}

/// The unknowns of a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Shape {
    /// The mass; else it is known, or not determined.
    pub(super) has_mass: bool,
    /// Viscous friction.
    pub(super) has_viscous: bool,
    /// Friction has its own values in each direction.
    pub(super) is_separate: bool,
    /// Whether it slides in the positive and in the negative direction; with one alone, friction is separate.
    pub(super) sides: [bool; 2],
    /// The shift between the clocks.
    pub(super) has_shift: bool,
    /// How much that shift grows over the record.
    pub(super) has_growing_shift: bool,
    /// Hats of a force that depends on the place.
    pub(super) hats: usize,
}

/// Place of an unknown in a fit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unknown {
    Mass,
    /// Viscous friction in the positive and in the negative direction.
    Viscous(usize),
    /// Alike: the dynamic force, and the offset. Separate: the force of a slow slide in the positive and in
    /// the negative direction, `Fd+ + offset` and `offset - Fd-`.
    Level(usize),
    /// How much the force's zero drifts over the record, N.
    Drift,
    /// Height of a hat of the force that depends on the place, N.
    Place(usize),
    /// The force's delay in the middle of the record, s.
    Shift,
    /// By how much that delay grows over the record, s.
    ShiftGrowth,
}

impl Shape {
    /// The unknowns, in the order of a fit.
    pub(super) fn unknowns(self) -> Vec<Unknown> {
        let mut unknowns = Vec::new();
        if self.has_mass {
            unknowns.push(Unknown::Mass);
        }
        let sides = if self.is_separate { self.sides } else { [true, false] };
        if self.has_viscous {
            unknowns.extend((0..2).filter(|side| sides[*side]).map(Unknown::Viscous));
        }
        let levels = if self.is_separate { self.sides } else { [true; 2] };
        unknowns.extend((0..2).filter(|side| levels[*side]).map(Unknown::Level));
        unknowns.push(Unknown::Drift);
        unknowns.extend((0..self.hats).map(Unknown::Place));
        if self.has_shift {
            unknowns.push(Unknown::Shift);
        }
        if self.has_growing_shift {
            unknowns.push(Unknown::ShiftGrowth);
        }
        unknowns
    }

    pub(super) fn coefficient(self, unknown: Unknown, row: &RegressionRow, rate: f64) -> f64 {
        let of_side = |side, value| if row.is_of(side) { value } else { 0.0 };
        match (unknown, self.is_separate) {
            (Unknown::Mass, _) => row.acceleration,
            (Unknown::Viscous(_), false) => row.velocity,
            (Unknown::Viscous(side), true) => of_side(side, row.velocity),
            (Unknown::Level(0), false) => row.sense,
            (Unknown::Level(_), false) => 1.0,
            (Unknown::Level(side), true) => of_side(side, 1.0),
            (Unknown::Drift, _) => row.place,
            // It is not one of the row alone.
            (Unknown::Place(_), _) => 0.0,
            (Unknown::Shift, _) => -rate,
            (Unknown::ShiftGrowth, _) => -rate * row.place,
        }
    }
}

/// A fit, with the covariance of what it found.
#[derive(Clone, Debug)]
pub(super) struct Fit {
    pub(super) shape: Shape,
    pub(super) found: RobustFit,
}

impl Fit {
    /// Root mean square of what it leaves, N.
    pub(super) fn rms_n(&self) -> f64 {
        rms(self.found.residuals.iter().copied())
    }

    /// Where an unknown is among the values.
    pub(super) fn place(&self, unknown: Unknown) -> Option<usize> {
        self.shape.unknowns().into_iter().position(|each| each == unknown)
    }

    /// The value found for an unknown of the fit.
    pub(super) fn value(&self, unknown: Unknown) -> Option<f64> {
        self.place(unknown).map(|place| self.found.values[place])
    }

    /// The uncertainty of an unknown of the fit.
    pub(super) fn uncertainty_of(&self, unknown: Unknown) -> Option<Uncertainty> {
        self.uncertainty(&[(unknown, 1.0)])
    }

    /// The uncertainty of a sum of unknowns with factors.
    pub(super) fn uncertainty(&self, sum: &[(Unknown, f64)]) -> Option<Uncertainty> {
        self.factors(sum).map(|factors| self.found.uncertainty(&factors))
    }

    /// A sum of unknowns with factors, as factors of all.
    pub(super) fn factors(&self, sum: &[(Unknown, f64)]) -> Option<DVector<f64>> {
        let mut factors = DVector::zeros(self.found.values.len());
        for (unknown, factor) in sum {
            factors[self.place(*unknown)?] = *factor;
        }
        Some(factors)
    }

    /// By how much a sum of unknowns may be wrong as the positions' noise is not what was taken out: an encoder's steps
    /// are noise in a fast motion alone.
    pub(super) fn bias(&self, sum: &[(Unknown, f64)]) -> f64 {
        self.factors(sum)
            .map_or(0.0, |factors| NOT_NOISE * factors.dot(&self.found.noise_pull).abs())
    }

    /// The variance of the noise in an unknown's coefficients, as a share of its own variance.
    pub(super) fn noise_share(&self, unknown: Unknown) -> Option<f64> {
        self.place(unknown).map(|place| self.found.noise_share[place])
    }

    /// Its variance among the rows that the other unknowns do not explain, in its coefficient's unit.
    pub(super) fn own_variance(&self, unknown: Unknown) -> Option<f64> {
        self.place(unknown).map(|place| self.found.own_variance[place])
    }

    /// The correlation of residuals whose windows do not touch: what the law misses, rather than noise.
    pub(super) fn structure(&self, rows: &Rows) -> f64 {
        let apart = 2 * rows.window.reach;
        let (mut product, mut square, mut count) = (0.0, 0.0, 0_u32);
        let mut behind = 0;
        for (row, residual) in rows.rows.iter().zip(&self.found.residuals) {
            while rows.rows[behind].at + apart < row.at {
                behind += 1;
            }
            let other = rows.rows[behind].at;
            if other + apart - rows.window.reach / 2 <= row.at && other + apart <= row.at + rows.window.reach / 2 {
                let before = self.found.residuals[behind];
                product += residual * before;
                square += f64::midpoint(residual * residual, before * before);
                count += 1;
            }
        }
        if count < 10 { 0.0 } else { product / square }
    }
}

/// What a row has beside itself for some unknowns; empty for a shape without them.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Beside<'a> {
    /// Changes of the rows' forces with time, for the shift, N/s.
    pub(super) rates: &'a [f64],
    /// Standard deviation of the force's noise, N.
    pub(super) force_noise_n: f64,
    /// As [`Rows::places`] gives them.
    pub(super) places: &'a [Vec<f64>],
}

/// Fits `shape` to the rows' forces.
pub(super) fn fit(rows: &Rows, forces: &[f64], beside: Beside<'_>, shape: Shape) -> Result<Fit, Unfit> {
    let unknowns = shape.unknowns();
    let design = DMatrix::from_fn(rows.rows.len(), unknowns.len(), |i, j| match unknowns[j] {
        Unknown::Place(hat) => beside.places[i][hat],
        unknown => shape.coefficient(unknown, &rows.rows[i], beside.rates.get(i).copied().unwrap_or(0.0)),
    });
    let noise: Vec<f64> = unknowns
        .iter()
        .map(|unknown| rows.noise(*unknown, beside, shape))
        .collect();
    let found = robust_fit::fit(design, forces, &noise, &rows.parts)?;
    Ok(Fit { shape, found })
}
