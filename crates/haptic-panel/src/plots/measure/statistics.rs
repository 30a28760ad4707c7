//! Statistics of a signal over a time: each sample counts the same.

use crate::tape::Tape;
use crate::tape::signal::Signal;

/// Share of the time at whose end the signal is taken as settled.
const SETTLED_SHARE: f64 = 0.1;

/// Half of the band around the final value in which a signal is settled, as a share of the step.
const SETTLING_BAND: f64 = 0.02;

/// A step is at least this share of the range of the signal: else there is none.
const MIN_STEP: f64 = 0.1;

/// Share of a signal that a rounding error may be.
const ROUNDING: f64 = 1e-9;

/// Statistics in the unit of the signal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Statistics {
    pub(crate) least: f64,
    pub(crate) greatest: f64,
    pub(crate) mean: f64,
    /// Root of the mean square.
    pub(crate) rms: f64,
    /// The response to a step, if the signal makes one.
    pub(crate) step: Option<Step>,
}

/// How a signal goes from its first value to its final one, which is the mean of the last tenth of the time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Step {
    /// How far the signal goes beyond the final value, in the direction of the step, over the step.
    pub(crate) overshoot: f64,
    /// Time from the beginning until the signal stays within 2 % of the step around the final value, s; `None`
    /// if it does not do so before the last tenth.
    pub(crate) settling_s: Option<f64>,
}

impl Statistics {
    /// Of a signal from one time to another, s on the daemon's clock; `None` without a sample.
    pub(crate) fn of(tape: &Tape, signal: Signal, from_s: f64, to_s: f64) -> Option<Self> {
        let summary = tape.summary(signal, from_s, to_s)?;
        let count = summary.sums.count;
        Some(Self {
            least: summary.least,
            greatest: summary.greatest,
            mean: summary.sums.value / count,
            rms: (summary.sums.square / count).sqrt(),
            step: step(tape, signal, (from_s, to_s), summary.least, summary.greatest),
        })
    }

    pub(crate) fn peak_to_peak(&self) -> f64 {
        self.greatest - self.least
    }
}

fn step(tape: &Tape, signal: Signal, (from_s, to_s): (f64, f64), least: f64, greatest: f64) -> Option<Step> {
    let begin_s = tape.within(from_s, to_s).next()?.t_s;
    let first = tape.value_at(signal, begin_s)?;
    // A tape may end before the time does.
    let end_s = tape.newest_s()?.min(to_s);
    let settled_s = end_s - SETTLED_SHARE * (end_s - begin_s);
    let last = tape.summary(signal, settled_s, end_s)?.sums;
    let end = last.value / last.count;
    let change = end - first;
    // The mean of a constant signal differs from it by a rounding error.
    let rounding = ROUNDING * least.abs().max(greatest.abs());
    if change.abs() <= rounding || change.abs() < MIN_STEP * (greatest - least) {
        return None;
    }
    let beyond = if change > 0.0 { greatest - end } else { end - least };
    let half = SETTLING_BAND * change.abs();
    let stays_s = tape.stays_within(signal, from_s, end_s, (end - half, end + half));
    Some(Step {
        overshoot: (beyond / change.abs()).max(0.0),
        settling_s: stays_s
            .filter(|stays_s| *stays_s <= settled_s)
            .map(|stays_s| stays_s - begin_s),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tape::tests::forced;

    fn of(tape: &Tape, from_s: f64, to_s: f64) -> Statistics {
        Statistics::of(tape, Signal::COUPLING_FORCE, from_s, to_s).expect("samples")
    }

    #[test]
    fn a_constant_signal_makes_no_step() {
        for force_n in [0.0, 0.1, -3.3, 1e6 / 3.0] {
            let tape = forced(0.0, 0..1000, |_| force_n);
            assert_eq!(of(&tape, 0.0, 1.0).step, None, "{force_n}");
        }
    }

    #[test]
    fn a_sine_over_whole_periods_has_its_known_mean_and_rms() {
        let tape = forced(0.0, 0..5000, |t_s| {
            1.0 + 2.0 * (std::f64::consts::TAU * 10.0 * t_s).sin()
        });
        let found = of(&tape, 0.0, 4.9995);
        assert!((found.mean - 1.0).abs() < 1e-9, "{found:?}");
        // The mean square of a constant and a sine: 1 + 2^2 / 2.
        assert!((found.rms - 3.0_f64.sqrt()).abs() < 1e-9, "{found:?}");
        assert!((found.peak_to_peak() - 4.0).abs() < 1e-9, "{found:?}");
        assert_eq!(found.step, None, "it ends where it began");
        assert_eq!(Statistics::of(&tape, Signal::COUPLING_FORCE, 9.0, 10.0), None);
    }

    /// Second order, as of an oscillator with damping ratio 0.5 at 5 Hz: its overshoot is exp(-pi z / sqrt(1 - z^2)).
    #[test]
    fn the_response_to_a_step_has_its_overshoot_and_settling_time() {
        let (ratio, omega) = (0.5_f64, std::f64::consts::TAU * 5.0);
        let damped = omega * (1.0 - ratio * ratio).sqrt();
        let response = |t_s: f64| {
            let fades = (-ratio * omega * t_s).exp();
            3.0 - 2.0 * fades * ((damped * t_s).cos() + ratio * omega / damped * (damped * t_s).sin())
        };
        for sign in [1.0, -1.0] {
            let tape = forced(0.0, 0..2000, |t_s| sign * response(t_s));
            let step = of(&tape, 0.0, 2.0).step.expect("a step");
            let overshoot = (-std::f64::consts::PI * ratio / (1.0 - ratio * ratio).sqrt()).exp();
            assert!((step.overshoot - overshoot).abs() < 1e-3, "{step:?}: {overshoot}");
            // The envelope reaches 2 % at ln(0.02 sqrt(1 - z^2)) / (-z w); the last lobe may end earlier.
            let envelope_s = -(0.02 * (1.0 - ratio * ratio).sqrt()).ln() / (ratio * omega);
            let settling_s = step.settling_s.expect("it settles");
            assert!(
                settling_s <= envelope_s && settling_s > 0.5 * envelope_s,
                "{settling_s}, {envelope_s}"
            );
        }
        let ringing = forced(
            0.0,
            0..1000,
            |t_s| if t_s < 0.01 { 0.0 } else { 5.0 + (300.0 * t_s).sin() },
        );
        assert_eq!(of(&ringing, 0.0, 1.0).step.expect("a step").settling_s, None);
    }
}
