//! The shift between two recorders' clocks and their drift, with intervals.
//!
//! What both saw of one motion is laid over one another: the shift, and how much it grows over the record, are unknowns
//! of a linear fit, repeated until they stand still. A motion that leaves about the same under every shift
//! does not determine it.

use crate::robust_fit::Uncertainty;

/// Least ratio of the squares that the worst shift leaves to those that the best one leaves; below it the motion does
/// not determine the shift: what is left scatters by a twentieth where nothing does.
const MIN_DIFFERENCE: f64 = 1.25;

/// Least drift that is reported, parts in a million: it moves a minute's record by 6 us from its middle to its ends.
const MIN_PPM: f64 = 0.2;

/// Most fits until a shift stands still, and the share of its error within which it does.
const MAX_FITS: usize = 8;
const STANDS_STILL: f64 = 0.01;

/// A time between the clocks, with its error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shift {
    /// How much later the second clock's stamps are for the same instant, s.
    pub(crate) value_s: f64,
    /// Half of its 95 % interval, s.
    pub(crate) reach_95_s: f64,
    /// Whether it is certain not to be zero.
    pub(crate) is_significant: bool,
}

impl Shift {
    /// The 95 % interval, s.
    pub(crate) fn interval(&self) -> [f64; 2] {
        [self.value_s - self.reach_95_s, self.value_s + self.reach_95_s]
    }
}

/// The shift in the middle of a record, and by how much it grows from the first sample to the last.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Shifts {
    pub(crate) middle: Shift,
    /// Where the fit has it.
    pub(crate) growth: Option<Shift>,
}

/// Why there is no shift.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum NoShift {
    /// Any shift leaves about the same.
    AllAlike,
    /// No shift within the longest one fits best.
    OutOfReach,
    /// What tells shifts from each other is little more than noise.
    Noise,
    /// So does another one, s.
    Other(f64),
}

/// How much faster the second clock runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Drift {
    /// Parts in a million.
    pub(crate) ppm: f64,
    /// 95 % interval of that.
    pub(crate) interval: [f64; 2],
}

/// `2.0 ppm faster`, or slower, and within which rates.
impl std::fmt::Display for Drift {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (sign, word) = if self.ppm < 0.0 {
            (-1.0, "slower")
        } else {
            (1.0, "faster")
        };
        let [mut low, mut high] = self.interval.map(|end| sign * end);
        if low > high {
            std::mem::swap(&mut low, &mut high);
        }
        write!(f, "{:.1} ppm {word}, within [{low:.1}, {high:.1}] ppm", sign * self.ppm)
    }
}

impl Drift {
    /// The drift under which a shift grows so over a time, s; `None` where it is not certain, or too small to matter.
    pub(crate) fn of(growth: &Shift, length_s: f64) -> Option<Self> {
        let ppm = 1e6 / length_s;
        let is_reported = growth.is_significant && (ppm * growth.value_s).abs() >= MIN_PPM;
        is_reported.then(|| Self {
            ppm: ppm * growth.value_s,
            interval: growth.interval().map(|end_s| ppm * end_s),
        })
    }
}

/// What a fit would change of the shift and of its growth, each with its uncertainty, s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Change {
    pub(crate) shift: (f64, Uncertainty),
    pub(crate) growth: Option<(f64, Uncertainty)>,
}

impl Change {
    fn is_small(&self) -> bool {
        let is_small = |(change, of): (f64, Uncertainty)| change.abs() < STANDS_STILL * of.error;
        is_small(self.shift) && self.growth.is_none_or(is_small)
    }
}

/// Whether the best shift stands out, by the squares that it and the worst one leave.
pub(crate) fn stands_out(least: f64, most: f64) -> bool {
    most >= MIN_DIFFERENCE * least
}

/// Repeats a fit from a shift near the best one until it changes nothing. `fit` gets the shift in the middle and its
/// growth, s; `None` from it ends the search.
pub(crate) fn refine(begin_s: f64, mut fit: impl FnMut(f64, f64) -> Option<Change>) -> Option<Shifts> {
    let (mut middle_s, mut growth_s) = (begin_s, 0.0);
    let mut last = None;
    for _ in 0..MAX_FITS {
        let change = fit(middle_s, growth_s)?;
        middle_s += change.shift.0;
        growth_s += change.growth.map_or(0.0, |(grown, _)| grown);
        last = Some(change);
        if change.is_small() {
            break;
        }
    }
    let change = last?;
    let shift = |value_s: f64, of: Uncertainty| Shift {
        value_s,
        reach_95_s: of.reach_95(),
        is_significant: value_s.abs() > of.reach_certain(),
    };
    Some(Shifts {
        middle: shift(middle_s, change.shift.1),
        growth: change.growth.map(|(_, of)| shift(growth_s, of)),
    })
}
