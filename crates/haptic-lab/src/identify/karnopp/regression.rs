//! The linear fit to rows of the weak form.

use super::motion::Motion;
use crate::identify::grid::Grid;
use crate::median::extent;
use crate::robust_fit::{self, RobustFit, Unfit};
use crate::smoothing::{Window, weighted, whole};
use crate::stats::mean::student_t;
use nalgebra::{DMatrix, DVector};

/// Most rows of a fit; of longer records every second, third ... is taken.
const MOST_ROWS: usize = 8000;

/// One window's worth of Newton's law.
#[derive(Clone, Copy, Debug)]
pub(super) struct Row {
    /// Sample in its middle.
    pub(super) at: usize,
    /// Its place in the record, from -0.5 to 0.5.
    pub(super) place: f64,
    /// Acceleration, m/s^2.
    pub(super) acceleration: f64,
    /// Velocity while it is positive, and while it is negative, m/s.
    pub(super) velocity: [f64; 2],
    /// Share of the window that slides in the positive direction.
    pub(super) positive_share: f64,
}

/// The rows of a record under one window.
#[derive(Clone, Debug)]
pub(super) struct Rows {
    pub(super) window: Window,
    pub(super) half_s: f64,
    pub(super) rows: Vec<Row>,
}

impl Rows {
    /// The rows whose whole window is valid and slides.
    pub(super) fn new(grid: &Grid, motion: &Motion, half_s: f64) -> Self {
        let window = Window::new(half_s, grid.period_s);
        let reach = window.reach;
        let mut rows = Vec::new();
        if grid.len() > 2 * reach {
            let is_bad: Vec<bool> = motion
                .sense
                .iter()
                .zip(&grid.is_valid)
                .map(|(sense, valid)| *sense == 0 || !valid)
                .collect();
            let sliding = is_bad.iter().filter(|is_bad| !**is_bad).count();
            let step = (reach / 3).max(1).max(sliding / MOST_ROWS);
            let mut bad_before = Vec::with_capacity(is_bad.len() + 1);
            bad_before.push(0_u32);
            for bad in &is_bad {
                bad_before.push(bad_before[bad_before.len() - 1] + u32::from(*bad));
            }
            for at in (reach..grid.len() - reach).step_by(step) {
                if bad_before[at + reach + 1] == bad_before[at - reach] {
                    rows.push(row(grid, motion, &window, at));
                }
            }
        }
        Self { window, half_s, rows }
    }

    /// Hats over the way, each a straight rise to its place and a straight fall from there, in the mean of each row's
    /// window, less the mean of all rows, as the offset has that. The one at the lowest place is that of all others together.
    pub(super) fn places(&self, grid: &Grid, hats: usize) -> Vec<Vec<f64>> {
        let x = &grid.position_m;
        let (low, high) = extent(x.iter().copied());
        let last = hats as f64;
        let of_row = |row: &Row| {
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
        let smoothed = |row: &Row| weighted(&self.window.mean, force, row.at, 0.0);
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

fn row(grid: &Grid, motion: &Motion, window: &Window, at: usize) -> Row {
    let reach = window.reach;
    let (mut velocity, mut positive_share) = ([0.0; 2], 0.0);
    for (weight, index) in window.mean.iter().zip(at - reach..) {
        let v = motion.velocity_mps[index];
        if motion.sense[index] > 0 {
            velocity[0] += weight * v;
            positive_share += weight;
        } else {
            velocity[1] += weight * v;
        }
    }
    let x = &grid.position_m;
    // Through one direction the velocity passes the same filter as all the rest.
    if motion.sense[at - reach..=at + reach]
        .iter()
        .all(|sense| *sense == motion.sense[at])
    {
        velocity = [0.0; 2];
        velocity[usize::from(motion.sense[at] < 0)] = weighted(&window.slope, x, at, x[at]);
    }
    Row {
        at,
        place: at as f64 / grid.len() as f64 - 0.5,
        acceleration: weighted(&window.curvature, x, at, x[at]),
        velocity,
        positive_share,
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

    pub(super) fn coefficient(self, unknown: Unknown, row: &Row, rate: f64) -> f64 {
        let (p, n) = (row.positive_share, 1.0 - row.positive_share);
        match (unknown, self.is_separate) {
            (Unknown::Mass, _) => row.acceleration,
            (Unknown::Viscous(0), false) => row.velocity[0] + row.velocity[1],
            (Unknown::Viscous(side), _) => row.velocity[side],
            (Unknown::Level(0), false) => p - n,
            (Unknown::Level(_), false) => 1.0,
            (Unknown::Level(0), true) => p,
            (Unknown::Level(_), true) => n,
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
        let residuals = &self.found.residuals;
        (residuals.iter().map(|each| each * each).sum::<f64>() / residuals.len() as f64).sqrt()
    }

    /// Where an unknown is among the values.
    pub(super) fn place(&self, unknown: Unknown) -> Option<usize> {
        self.shape.unknowns().into_iter().position(|each| each == unknown)
    }

    /// The value found for an unknown of the fit.
    pub(super) fn value(&self, unknown: Unknown) -> Option<f64> {
        self.place(unknown).map(|place| self.found.values[place])
    }

    /// Its standard error.
    pub(super) fn error(&self, unknown: Unknown) -> Option<f64> {
        self.combined_error(&[(unknown, 1.0)])
    }

    /// The standard error of a sum of unknowns with factors.
    pub(super) fn combined_error(&self, sum: &[(Unknown, f64)]) -> Option<f64> {
        let mut factors = DVector::zeros(self.found.values.len());
        for (unknown, factor) in sum {
            factors[self.place(*unknown)?] = *factor;
        }
        Some(
            (factors.transpose() * &self.found.covariance * &factors)[0]
                .max(0.0)
                .sqrt(),
        )
    }

    /// The share of an unknown's own variance that noise of this standard deviation in its coefficient
    /// makes: so much is missing from its value.
    pub(super) fn attenuation(&self, unknown: Unknown, noise: f64) -> Option<f64> {
        self.place(unknown)
            .map(|place| noise * noise / self.found.own_variance[place].max(f64::MIN_POSITIVE))
    }

    /// Its variance among the rows that the other unknowns do not explain, in its coefficient's unit.
    pub(super) fn own_variance(&self, unknown: Unknown) -> Option<f64> {
        self.place(unknown).map(|place| self.found.own_variance[place])
    }

    /// How far this factor of standard errors reaches to 95 %.
    pub(super) fn reach_95(&self) -> f64 {
        student_t(self.found.freedom)
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
    let mut found = robust_fit::fit(design, forces)?;
    // Each hat is of a part of the way alone.
    found.freedom = robust_fit::freedom(unknowns.len() - shape.hats);
    Ok(Fit { shape, found })
}
