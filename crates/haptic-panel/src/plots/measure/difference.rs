//! The difference of a signal in two runs that lie over one another.

use crate::tape::Tape;
use crate::tape::signal::Signal;

/// Most samples that are compared: some milliseconds.
pub(crate) const MAX_SAMPLES: usize = 200_000;

/// Least share of the samples' time that the reference covers: less is no fact about the run that is seen.
const MIN_OVERLAP: f64 = 0.1;

/// The difference of the run that is seen and the reference, in the unit of the signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Difference {
    /// Root of the mean square.
    pub(crate) rms: f64,
    /// The one that is farthest from zero, with its sign: above zero the run that is seen is greater.
    pub(crate) peak: f64,
    /// Where that is, s on the clock of the run that is seen.
    pub(crate) peak_at_s: f64,
}

/// The difference from one time to another, s on the clock of `tape`, both included. The reference is read
/// `shift_s` earlier on its own clock, between its samples on the line from one to the next. `None` where both
/// have less than a tenth of that time in common.
pub(crate) fn difference(
    tape: &Tape,
    reference: &Tape,
    shift_s: f64,
    signal: Signal,
    (from_s, to_s): (f64, f64),
) -> Option<Difference> {
    let (from_s, to_s) = (from_s.max(tape.oldest_s()?), to_s.min(tape.newest_s()?));
    let first = from_s.max(reference.oldest_s()? + shift_s);
    let last = to_s.min(reference.newest_s()? + shift_s);
    if last <= first || last - first < MIN_OVERLAP * (to_s - from_s) {
        return None;
    }
    let points = reference.pairs_around(first - shift_s, last - shift_s);
    let mut points = points
        .map(|(before, sample)| (sample.t_s + shift_s, signal.of(before, sample)))
        .peekable();
    let (mut squares, mut count, mut peak, mut peak_at_s) = (0.0, 0.0, 0.0_f64, from_s);
    let mut left = None;
    for (before, sample) in tape.pairs_within(first, last) {
        while let Some(point) = points.next_if(|(t_s, _)| *t_s <= sample.t_s) {
            left = Some(point);
        }
        let Some((left_s, left_value)) = left else { continue };
        let other = match points.peek() {
            Some((right_s, right_value)) => {
                left_value + (right_value - left_value) * (sample.t_s - left_s) / (right_s - left_s)
            }
            None => left_value,
        };
        let differs = signal.of(before, sample) - other;
        squares += differs * differs;
        count += 1.0;
        if differs.abs() > peak.abs() {
            (peak, peak_at_s) = (differs, sample.t_s);
        }
    }
    (count > 0.0).then(|| Difference {
        rms: (squares / count).sqrt(),
        peak,
        peak_at_s,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tape::tests::forced;

    #[test]
    fn difference_across_clocks_has_known_rms_and_peak() {
        let ramp = |t_s: f64| 10.0 * t_s;
        let reference = forced(500.0, 0..1000, ramp);
        // Half a millisecond off the reference's samples, 1 N more, and one sample that is 5 N more.
        let run = forced(7.0005, 0..998, |t_s| {
            ramp(t_s + 0.0005) + if (t_s - 0.4).abs() < 1e-6 { 5.0 } else { 1.0 }
        });
        let found = difference(&run, &reference, 7.0 - 500.0, Signal::COUPLING_FORCE, (0.0, 100.0)).expect("both");
        assert!(
            (found.peak - 5.0).abs() < 1e-9 && (found.peak_at_s - 7.4005).abs() < 1e-9,
            "{found:?}"
        );
        let rms = ((997.0 + 25.0) / 998.0_f64).sqrt();
        assert!((found.rms - rms).abs() < 1e-9, "{found:?}: {rms}");
        let none = difference(&run, &reference, 0.0, Signal::COUPLING_FORCE, (0.0, 100.0));
        assert_eq!(none, None, "they have no time in common");
        // The reference ends with the first sample of the run, or a hundredth of its time later.
        for common_s in [0.0, 0.01] {
            let shift_s = 7.0005 - 500.999 + common_s;
            let found = difference(&run, &reference, shift_s, Signal::COUPLING_FORCE, (0.0, 100.0));
            assert_eq!(found, None, "{common_s} s in common");
        }
        let same = difference(&reference, &reference, 0.0, Signal::COUPLING_FORCE, (500.0, 501.0)).expect("both");
        assert_eq!((same.rms, same.peak), (0.0, 0.0));
    }
}
