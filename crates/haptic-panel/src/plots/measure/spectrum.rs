//! The spectrum of a signal: a Hann window over the whole time, its mean taken off.

use crate::tape::Tape;
use crate::tape::signal::Signal;
use realfft::RealFftPlanner;
use std::f64::consts::TAU;

/// Most samples of a spectrum: some milliseconds.
const MAX_SAMPLES: usize = 1 << 18;

/// Fewest samples of a spectrum: its window needs some.
const MIN_SAMPLES: usize = 16;

/// What the height of the spectrum is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Scaling {
    /// Of a sine, its amplitude, in the unit of the signal.
    #[default]
    Amplitude,
    /// One-sided power spectral density, in the unit of the signal squared over Hz.
    Density,
}

impl Scaling {
    pub(crate) const ALL: [Self; 2] = [Self::Amplitude, Self::Density];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Amplitude => "Amplitude",
            Self::Density => "Power density",
        }
    }

    /// The unit of the spectrum of a signal with a unit.
    pub(crate) fn unit(self, unit: &str) -> String {
        match self {
            Self::Amplitude => unit.to_owned(),
            Self::Density => format!("({unit})²/Hz"),
        }
    }

    /// A value in dB: 20 lg of an amplitude, 10 lg of a density, over 1 of its unit.
    pub(crate) fn decibel(self, value: f64) -> f64 {
        let factor = match self {
            Self::Amplitude => 20.0,
            Self::Density => 10.0,
        };
        factor * value.log10()
    }
}

/// A spectrum from 0 to half of the rate of the samples.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Spectrum {
    /// Distance of the frequencies, Hz.
    pub(crate) step_hz: f64,
    /// By frequency, from 0, in the unit of the scaling.
    pub(crate) values: Vec<f64>,
}

impl Spectrum {
    /// Of a signal from one time to another, s on the daemon's clock.
    ///
    /// # Errors
    /// Why there is none: too few or too many samples, or some are missing.
    pub(crate) fn of(tape: &Tape, signal: Signal, from_s: f64, to_s: f64, scaling: Scaling) -> Result<Self, String> {
        let count = tape.count(from_s, to_s);
        if count > MAX_SAMPLES {
            return Err(format!(
                "{count} samples in sight; a spectrum takes {MAX_SAMPLES} at most: zoom in"
            ));
        }
        if count < MIN_SAMPLES {
            return Err(format!(
                "{count} samples in sight; a spectrum needs {MIN_SAMPLES} at least"
            ));
        }
        let mut values = Vec::with_capacity(count);
        let (mut first_s, mut last_s, mut tick_before, mut stride) = (None, 0.0, None, None);
        for (before, sample) in tape.pairs_within(from_s, to_s) {
            let first_s = *first_s.get_or_insert(sample.t_s);
            if let Some(tick) = tick_before.replace(sample.tick) {
                let ticks = sample.tick.saturating_sub(tick);
                if ticks != *stride.get_or_insert(ticks) {
                    return Err(format!(
                        "samples are missing {:.3} s after the first in sight: a spectrum needs every one",
                        last_s - first_s
                    ));
                }
            }
            last_s = sample.t_s;
            values.push(signal.of(before, sample));
        }
        let length_s = last_s - first_s.unwrap_or(last_s);
        #[expect(clippy::cast_precision_loss, reason = "at most 2^18 samples")]
        let rate_hz = (count - 1) as f64 / length_s;
        if !rate_hz.is_finite() {
            return Err("the samples in sight have all the same time".to_owned());
        }
        Ok(Self::of_values(values, rate_hz, scaling))
    }

    /// Of values at a rate.
    fn of_values(mut values: Vec<f64>, rate_hz: f64, scaling: Scaling) -> Self {
        #[expect(clippy::cast_precision_loss, reason = "at most 2^18 samples")]
        let count = values.len() as f64;
        let mean = values.iter().sum::<f64>() / count;
        let (mut sum, mut squares) = (0.0, 0.0);
        let mut phase = 0.0;
        for value in &mut values {
            let weight = 0.5 - 0.5 * (TAU * phase / count).cos();
            phase += 1.0;
            sum += weight;
            squares += weight * weight;
            *value = (*value - mean) * weight;
        }
        let plan = RealFftPlanner::<f64>::new().plan_fft_forward(values.len());
        let mut bins = plan.make_output_vec();
        // It fails only for buffers of another length.
        plan.process(&mut values, &mut bins).unwrap_or(());
        let last = bins.len() - 1;
        let has_middle = values.len().is_multiple_of(2);
        let heights = bins.iter().enumerate().map(|(place, bin)| {
            // A frequency and its mirror image count together; 0 and half of the rate have none.
            let sides = if place == 0 || (place == last && has_middle) {
                1.0
            } else {
                2.0
            };
            match scaling {
                Scaling::Amplitude => sides * bin.norm() / sum,
                Scaling::Density => sides * bin.norm_sqr() / (rate_hz * squares),
            }
        });
        Self {
            step_hz: rate_hz / count,
            values: heights.collect(),
        }
    }

    /// Frequency, Hz, and value of the highest peak.
    pub(crate) fn peak(&self) -> Option<(f64, f64)> {
        let highest = self.values.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1));
        #[expect(clippy::cast_precision_loss, reason = "at most 2^18 samples")]
        highest.map(|(place, value)| (place as f64 * self.step_hz, *value))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tape::tests::forced;

    fn of(tape: &Tape, scaling: Scaling) -> Result<Spectrum, String> {
        Spectrum::of(tape, Signal::COUPLING_FORCE, 0.0, 1e9, scaling)
    }

    #[test]
    fn a_sine_has_its_amplitude_at_its_frequency_and_no_mean() {
        let tape = forced(0.0, 0..2000, |t_s| 7.0 + 3.0 * (TAU * 50.0 * t_s).sin());
        let spectrum = of(&tape, Scaling::Amplitude).expect("a spectrum");
        let (frequency_hz, height) = spectrum.peak().expect("a peak");
        assert!(
            (frequency_hz - 50.0).abs() < 1e-6 && (height - 3.0).abs() < 1e-6,
            "{frequency_hz} Hz: {height}"
        );
        assert!(spectrum.values[0] < 1e-9 && spectrum.values[400] < 1e-9);
        assert_eq!(spectrum.values.len(), 1001);
        assert_eq!(Scaling::Amplitude.decibel(10.0), 20.0);
    }

    /// Parseval: the density adds up to the mean square, 3^2 / 2.
    #[test]
    fn the_density_of_a_sine_adds_up_to_its_mean_square() {
        let tape = forced(0.0, 0..2000, |t_s| 3.0 * (TAU * 50.0 * t_s).sin());
        let spectrum = of(&tape, Scaling::Density).expect("a spectrum");
        let power: f64 = spectrum.values.iter().sum::<f64>() * spectrum.step_hz;
        assert!((power - 4.5).abs() < 1e-6, "{power}");
    }

    #[test]
    fn missing_samples_and_too_few_or_too_many_are_reported() {
        let gap = of(&forced(0.0, (0..500).chain(510..1000), |_| 1.0), Scaling::Amplitude).expect_err("a gap");
        assert!(gap.contains("missing 0.499 s"), "{gap}");
        let few = of(&forced(0.0, 0..10, |_| 1.0), Scaling::Amplitude).expect_err("too few");
        assert!(few.starts_with("10 samples"), "{few}");
        let many = of(&forced(0.0, 0..300_000, |_| 1.0), Scaling::Amplitude).expect_err("too many");
        assert!(many.contains("262144 at most"), "{many}");
        // Every tenth tick is as even as every one.
        let thinned = forced(0.0, (0..10_000).step_by(10), |t_s| 3.0 * (TAU * 20.0 * t_s).sin());
        let (frequency_hz, _) = of(&thinned, Scaling::Amplitude)
            .expect("a spectrum")
            .peak()
            .expect("a peak");
        assert!((frequency_hz - 20.0).abs() < 0.1, "{frequency_hz}");
    }
}
