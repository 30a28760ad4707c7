//! The master path of a law whose deflection follows the distance alone, `du/dX = rate(u)`: `u` is the
//! deflection over that of steady motion, `X` the distance in the same unit. Every motion in one
//! direction is a part of the one curve `u(X)`, which is compiled with the scene: power series in
//! cells whose widths keep each series right to rounding. A tick is then a sum, a look-up and a
//! polynomial, whatever the law.

use crate::contact::bristle::Plasticity;
use crate::math::{exp, exp_m1, ln_1p, powf};
use alloc::vec::Vec;

/// Order of the series.
pub(crate) const ORDER: usize = 15;

/// The coefficients of a series, lowest order first.
pub(crate) type PathSeries = [f64; ORDER + 1];

/// A law that is compiled to a master path.
pub(crate) trait MasterLaw: Plasticity {
    /// `du/dX`, the elastic share of the motion: it falls from 1 to 0 as `u` comes to 1.
    fn rate(&self, u: f64) -> f64 {
        1.0 - self.alpha(u, 1.0) * u
    }

    /// The power series of `u` in `X` from a start.
    fn series(&self, start: f64) -> PathSeries;

    /// Up to this `u` there is no plastic flow at all; `None` where there always is.
    fn elastic_up_to(&self) -> Option<f64> {
        None
    }

    /// Most that a cell may be wide which begins at `u`: where a narrow part lies ahead of which a
    /// series before it shows nothing.
    fn widest(&self, _u: f64) -> f64 {
        f64::INFINITY
    }

    /// Farther than [`FARTHEST`] against the motion, `rate = -slope (u - root)`: slope and root.
    fn far(&self) -> (f64, f64) {
        (1.0, 1.0)
    }
}

/// A deflection this far against the motion, over the steady one, is where the path begins at most.
pub(crate) const FARTHEST: f64 = 128.0;

/// The first term that a series leaves out is about 1e-16 of the first: the sixteenth root of that.
const LEFT_OUT_ROOT: f64 = 0.1;
/// Greatest difference of a series' slope from the rate.
const DEFECT: f64 = 1e-14;
/// Nearer to 1 than this the path ends.
const AT_THE_END: f64 = 4e-16;
/// Widths that are tried for a cell.
const MAX_TRIALS: u32 = 64;
/// Widest cell.
const WIDEST: f64 = 8.0;
/// Most cells; some 40 are usual.
const MAX_CELLS: usize = 1024;

#[derive(Clone, Debug)]
struct Cell {
    series: PathSeries,
    /// The integral of `u` up to the cell.
    work: f64,
}

/// A compiled path.
#[derive(Clone, Debug)]
pub(crate) struct MasterPath {
    /// Where each cell begins, and the last one ends.
    edges: Vec<f64>,
    cells: Vec<Cell>,
    slope: f64,
    root: f64,
}

impl MasterPath {
    /// The path of `law` from `u = start`.
    pub(crate) fn new(law: &impl MasterLaw, start: f64) -> Self {
        let (mut edges, mut cells) = (Vec::new(), Vec::new());
        let (mut from, mut u, mut work) = (0.0, start, 0.0);
        while 1.0 - u > AT_THE_END && cells.len() < MAX_CELLS {
            let series = law.series(u);
            let width = width(law, &series);
            edges.push(from);
            cells.push(Cell { series, work });
            from += width;
            u = value(&series, width);
            work += integral(&series, width);
        }
        edges.push(from);
        let (slope, root) = law.far();
        Self {
            edges,
            cells,
            slope,
            root,
        }
    }

    /// Its last cell.
    pub(crate) fn last_cell(&self) -> usize {
        self.cells.len() - 1
    }

    /// Where it comes to 1.
    pub(crate) fn end(&self) -> f64 {
        self.edges[self.cells.len()]
    }

    /// `u` at a place, which is put within the path; `cell` is where to look first, and becomes
    /// where it was found.
    pub(crate) fn at(&self, place: &mut f64, cell: &mut usize) -> f64 {
        if *place >= self.end() {
            *place = self.end();
            *cell = self.cells.len() - 1;
            return 1.0;
        }
        if *place < 0.0 {
            return self.before(*place);
        }
        *cell = self.cell(*place, *cell);
        value(&self.cells[*cell].series, *place - self.edges[*cell])
    }

    /// The place and the cell of a `u`.
    pub(crate) fn find(&self, u: f64) -> (f64, usize) {
        let cell = self.cells.partition_point(|cell| cell.series[0] <= u);
        if cell == 0 {
            return (self.place_before(u), 0);
        }
        let cell = cell - 1;
        let series = &self.cells[cell].series;
        let (from, to) = (self.edges[cell], self.edges[cell + 1]);
        let next = self.cells.get(cell + 1).map_or(1.0, |next| next.series[0]);
        if u >= next {
            return (to, cell);
        }
        // The path is concave: Newton's method from the left does not pass the root.
        let width = to - from;
        let mut t = width * (u - series[0]) / (next - series[0]);
        for _ in 0..12 {
            let step = (u - value(series, t)) / slope(series, t);
            t = (t + step).clamp(0.0, width);
            if step.abs() <= 1e-16 * width {
                break;
            }
        }
        (from + t, cell)
    }

    /// The integral of `u` from the path's first cell to a place that [`at`](Self::at) has found.
    pub(crate) fn work(&self, place: f64, cell: usize) -> f64 {
        if place < 0.0 {
            let from = self.cells[0].series[0] - self.root;
            return self.root * place - from * exp_m1(-self.slope * place) / self.slope;
        }
        let Cell { series, work } = &self.cells[cell];
        let last = self.edges[cell + 1];
        let within = place.min(last) - self.edges[cell];
        work + integral(series, within) + (place - last).max(0.0)
    }

    fn cell(&self, place: f64, guess: usize) -> usize {
        if place >= self.edges[guess] {
            if place < self.edges[guess + 1] {
                return guess;
            }
            if guess + 2 < self.edges.len() && place < self.edges[guess + 2] {
                return guess + 1;
            }
        }
        self.edges[1..self.cells.len()].partition_point(|&edge| edge <= place)
    }

    fn before(&self, place: f64) -> f64 {
        self.root + (self.cells[0].series[0] - self.root) * exp(-self.slope * place)
    }

    /// Also where the path begins before [`FARTHEST`], for a `u` that rounding puts before it.
    fn place_before(&self, u: f64) -> f64 {
        let start = self.cells.first().map_or(1.0, |cell| cell.series[0]);
        if start > -FARTHEST {
            return 0.0;
        }
        -ln_1p((u - start) / (start - self.root)) / self.slope
    }
}

/// A coefficient of the product of two series: the sum of `a[k] b[n - k]` over both slices.
pub(crate) fn series_product(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b.iter().rev()).map(|(a, b)| a * b).sum()
}

/// The value of a series: by pairs, which do not wait for each other (Estrin 1960).
fn value(c: &PathSeries, t: f64) -> f64 {
    let t2 = t * t;
    let t4 = t2 * t2;
    let pair = |k: usize| c[k] + c[k + 1] * t;
    let four = |k: usize| pair(k) + pair(k + 2) * t2;
    let eight = |k: usize| four(k) + four(k + 4) * t4;
    eight(0) + eight(8) * (t4 * t4)
}

/// Its slope.
fn slope(c: &PathSeries, t: f64) -> f64 {
    let mut sum = 0.0;
    let mut order = 15.0;
    for k in (1..=ORDER).rev() {
        sum = sum * t + order * c[k];
        order -= 1.0;
    }
    sum
}

/// Its integral from 0.
fn integral(c: &PathSeries, t: f64) -> f64 {
    let mut sum = 0.0;
    let mut order = 16.0;
    for k in (0..=ORDER).rev() {
        sum = sum * t + c[k] / order;
        order -= 1.0;
    }
    sum * t
}

/// How far a series is the path: as its last coefficients say, and then as its slope does, because
/// some series have a term in every eighth order only.
fn width(law: &impl MasterLaw, series: &PathSeries) -> f64 {
    let size = series[0].abs().max(1.0);
    let mut growth: f64 = 0.0;
    let mut order = 13.0;
    for coefficient in &series[13..] {
        growth = growth.max(powf(coefficient.abs() / size, 1.0 / order));
        order += 1.0;
    }
    let mut width = if growth * WIDEST > LEFT_OUT_ROOT {
        LEFT_OUT_ROOT / growth
    } else {
        WIDEST
    };
    width = width.min(law.widest(series[0]));
    let defect = |t: f64| (slope(series, t) - law.rate(value(series, t).min(1.0))).abs() / (DEFECT * size);
    for _ in 0..MAX_TRIALS {
        let worst = defect(width).max(defect(0.6 * width));
        if worst <= 1.0 {
            break;
        }
        width *= (0.9 * powf(worst, -1.0 / 15.0)).max(0.2);
    }
    width
}

/// Follows each cell by the classical Runge-Kutta method. Returns the number of cells and the worst
/// difference at the end of one, over the size of `u` there.
#[cfg(test)]
pub(crate) fn cells_and_error(law: &impl MasterLaw, start: f64) -> (usize, f64) {
    let path = MasterPath::new(law, start);
    let mut worst: f64 = 0.0;
    for (k, cell) in path.cells.iter().enumerate() {
        let (width, mut u) = (path.edges[k + 1] - path.edges[k], cell.series[0]);
        let step = width / 1000.0;
        for _ in 0..1000 {
            let first = law.rate(u);
            let second = law.rate(u + 0.5 * step * first);
            let third = law.rate(u + 0.5 * step * second);
            u += step / 6.0 * (first + 2.0 * second + 2.0 * third + law.rate(u + step * third));
        }
        let (mut place, mut found) = (path.edges[k + 1], k);
        let end = path.at(&mut place, &mut found);
        worst = worst.max((u - end).abs() / u.abs().max(1.0));
        let (again, _) = path.find(cell.series[0]);
        worst = worst.max((again - path.edges[k]).abs() * law.rate(cell.series[0]));
    }
    (path.cells.len(), worst)
}
