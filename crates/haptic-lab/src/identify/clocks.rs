//! What is known of the clocks by which positions and forces were stamped.

use super::options::Record;

/// The clocks of positions and forces.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Clocks {
    /// One clock, as it is known.
    One,
    /// One clock, as one file has it: the shift is 0, and it is said where another would fit better.
    #[default]
    OneFile,
    /// One clock, and perhaps a delay of one of the columns, as by a filter: a shift is looked for.
    Delayed,
    /// Two recorders: a shift and a drift are looked for.
    Two,
    /// A shift that is known: how much the force's stamps are later than the position's for the same instant, s.
    Shifted(f64),
}

/// Largest shift that may be given, s.
pub(super) const MAX_SHIFT_S: f64 = 10.0;

impl Clocks {
    /// Longest shift that is looked for, s.
    pub(super) const fn longest_shift_s(self) -> f64 {
        match self {
            Self::One | Self::OneFile | Self::Shifted(_) => 0.0,
            Self::Delayed => 0.06,
            Self::Two => 0.5,
        }
    }
}

/// The record with forces stamped by a clock that runs as fast as the position's, and agrees in the middle of the
/// record with the one that was faster by the drift, parts in a million.
pub(super) fn without_drift(record: &Record, drift_ppm: f64) -> Record {
    let (t, last) = (&record.t_s, record.t_s.len() - 1);
    let middle_s = f64::midpoint(t[0], t[last]);
    let mut left = 0;
    let force_n = t.iter().map(|t_s| {
        let at_s = (t_s + 1e-6 * drift_ppm * (t_s - middle_s)).clamp(t[0], t[last]);
        while left + 1 < last && t[left + 1] <= at_s {
            left += 1;
        }
        let share = (at_s - t[left]) / (t[left + 1] - t[left]);
        record.force_n[left] + share * (record.force_n[left + 1] - record.force_n[left])
    });
    Record {
        force_n: force_n.collect(),
        ..record.clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_drift_is_taken_out_about_the_middle() {
        let t_s: Vec<f64> = (0..=1000).map(|k| 7.0 + 1e-2 * f64::from(k)).collect();
        // The force is 100 N/s times the true time since the middle; its clock runs 1000 ppm fast.
        let record = Record {
            force_n: t_s.iter().map(|t| 100.0 * (t - 12.0) / 1.001).collect(),
            position_m: t_s.clone(),
            t_s,
            ..Record::default()
        };
        let steady = without_drift(&record, 1000.0);
        for k in 10..=990 {
            let error = steady.force_n[k] - 100.0 * (steady.t_s[k] - 12.0);
            assert!(error.abs() < 1e-9, "{k}: {error}");
        }
    }
}
