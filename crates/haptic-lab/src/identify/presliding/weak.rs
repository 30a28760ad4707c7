//! The equation of motion under test functions, so that no acceleration is ever computed (Shinbrot 1957; Preisig and
//! Rippin 1993).
//!
//! ```text
//! M sum phi'' x + sum phi friction = sum phi (F - offset)       phi: cubic B-splines, one every `stride` samples
//! ```
//!
//! The second difference of `phi` meets the position where that of the position would meet its steps. Forces meet `phi`
//! averaged with the weights 1, 10, 1, which sees a smooth acceleration as the second difference of its position does, to
//! the fourth order (Numerov 1924).

use super::path::Path;

/// The test functions of a record.
#[derive(Clone, Debug)]
pub(crate) struct TestFunctions {
    /// On forces: each adds up to 1.
    on_force: Vec<f64>,
    /// On positions: the second derivative, 1/s^2.
    on_position: Vec<f64>,
    /// The first sample of each.
    pub(crate) starts: Vec<usize>,
}

impl TestFunctions {
    /// One every `stride` samples, but where samples are missing.
    pub(crate) fn new(path: &Path, stride: usize) -> Self {
        let spline = cubic_spline(stride);
        let at = |k: isize| {
            usize::try_from(k)
                .ok()
                .and_then(|k| spline.get(k))
                .copied()
                .unwrap_or(0.0)
        };
        let squared = path.period_s * path.period_s;
        let (on_force, on_position): (Vec<f64>, Vec<f64>) = (-1..=spline.len() as isize)
            .map(|k| {
                let (before, here, after) = (at(k - 1), at(k), at(k + 1));
                (
                    (before + 10.0 * here + after) / 12.0,
                    (before - 2.0 * here + after) / squared,
                )
            })
            .unzip();
        let length = on_force.len();
        let starts = (0..(path.force_n.len() + 1).saturating_sub(length))
            .step_by(stride)
            .filter(|&start| path.is_recorded[start..start + length].iter().all(|recorded| *recorded))
            .collect();
        Self {
            on_force,
            on_position,
            starts,
        }
    }

    /// Samples that a test function reaches over.
    pub(crate) fn length(&self) -> usize {
        self.on_force.len()
    }

    /// `sum phi force` for each.
    pub(crate) fn of_force(&self, force_n: &[f64]) -> Vec<f64> {
        self.apply(&self.on_force, force_n)
    }

    /// `sum phi'' x` for each: the acceleration as it sees it.
    pub(crate) fn of_position(&self, position_m: &[f64]) -> Vec<f64> {
        self.apply(&self.on_position, position_m)
    }

    fn apply(&self, weights: &[f64], signal: &[f64]) -> Vec<f64> {
        let sum = |&start: &usize| {
            // From a value of its own, so that a far origin loses no digits.
            let origin = signal[start];
            let total: f64 = weights.iter().sum();
            let moved = weights
                .iter()
                .zip(&signal[start..])
                .map(|(weight, value)| weight * (value - origin))
                .sum::<f64>();
            moved + total * origin
        };
        self.starts.iter().map(sum).collect()
    }
}

/// The cubic B-spline over four strides, by convolving a box with itself; it adds up to 1.
fn cubic_spline(stride: usize) -> Vec<f64> {
    let share = 1.0 / stride as f64;
    let mut spline = vec![share; stride];
    for _ in 0..3 {
        let mut wider = vec![0.0; spline.len() + stride - 1];
        for (k, value) in spline.iter().enumerate() {
            for sum in &mut wider[k..k + stride] {
                *sum += share * value;
            }
        }
        spline = wider;
    }
    spline
}

#[cfg(test)]
mod tests {
    use super::super::super::Record;
    use super::*;

    #[test]
    fn they_give_force_and_acceleration_of_a_parabola() {
        let t_s: Vec<f64> = (0..1000).map(|k| f64::from(k) * 1e-3).collect();
        let path = Path::new(&Record {
            position_m: t_s.iter().map(|t| 7.0 + t - 1.5 * t * t).collect(),
            force_n: vec![2.0; 1000],
            t_s,
            ..Record::default()
        })
        .expect("long enough");
        let functions = TestFunctions::new(&path, 8);
        assert!(functions.starts.len() > 100);
        assert!(
            functions
                .of_force(&path.force_n)
                .iter()
                .all(|force| (force - 2.0).abs() < 1e-12)
        );
        assert!(
            functions
                .of_position(&path.counted_m)
                .iter()
                .all(|a| (a + 3.0).abs() < 1e-7)
        );
    }
}
