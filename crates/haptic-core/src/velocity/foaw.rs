//! First-order adaptive windowing (Janabi-Sharifi, Hayward and Chen 2000, "Discrete-time adaptive
//! windowing for velocity estimation"): the longest window in which a straight line stays within
//! one count of every sample. Slow motion gets a long window and little noise, fast motion a short
//! one and little lag.

use crate::snapshot::Archive;

/// Most samples that a window reaches back.
const MAX_WINDOW: usize = 16;

/// How the line of a window is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Fit {
    /// From the window's first sample to its last.
    End,
    /// By least squares, and through the last sample as the line's error is judged.
    Best,
}

/// Estimates velocity as the slope of the longest window that a line explains.
#[derive(Clone, Copy, Debug)]
pub(super) struct Foaw {
    fit: Fit,
    tolerance_m: f64,
    /// Age (s) and position (m) of the samples before the newest, the newest first.
    past: [(f64, f64); MAX_WINDOW],
    kept: usize,
    newest: Option<f64>,
    velocity: f64,
}

impl Foaw {
    /// `resolution_m` (m) is one count of the encoder: samples may lie so far off the line.
    pub(super) fn new(fit: Fit, resolution_m: f64) -> Self {
        Self {
            fit,
            tolerance_m: resolution_m,
            past: [(0.0, 0.0); MAX_WINDOW],
            kept: 0,
            newest: None,
            velocity: 0.0,
        }
    }

    pub(super) fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.number("tolerance_m", &mut self.tolerance_m);
        archive.option("has_sample", &mut self.newest, 0.0, |archive, newest| {
            archive.number("sample_m", newest);
        });
        archive.place("past_samples", &mut self.kept, MAX_WINDOW);
        let past = &mut self.past[..self.kept];
        archive.numbers("past_age_s", past.iter_mut().map(|(age_s, _)| age_s));
        archive.numbers("past_m", past.iter_mut().map(|(_, position)| position));
        archive.number("slope_mps", &mut self.velocity);
    }

    pub(super) fn reset(&mut self) {
        self.kept = 0;
        self.newest = None;
        self.velocity = 0.0;
    }

    pub(super) fn update(&mut self, elapsed_s: f64, position: f64) -> f64 {
        let Some(last) = self.newest else {
            self.newest = Some(position);
            return 0.0;
        };
        if elapsed_s <= 0.0 {
            return self.velocity;
        }
        self.newest = Some(position);
        self.kept = (self.kept + 1).min(MAX_WINDOW);
        self.past.copy_within(..MAX_WINDOW - 1, 1);
        self.past[0] = (0.0, last);
        for sample in &mut self.past[..self.kept] {
            sample.0 += elapsed_s;
        }
        // One step back always explains itself.
        self.velocity = self.slope(1, position);
        for length in 2..=self.kept {
            let slope = self.slope(length, position);
            if !self.explains(length, position, slope) {
                break;
            }
            self.velocity = slope;
        }
        self.velocity
    }

    fn slope(&self, length: usize, position: f64) -> f64 {
        let window = &self.past[..length];
        match self.fit {
            Fit::End => {
                let (age, then) = window[length - 1];
                (position - then) / age
            }
            Fit::Best => {
                // Least squares of position against age, the newest sample included with age 0.
                let count = length as f64 + 1.0;
                let (mut ages, mut squares, mut offsets, mut products) = (0.0, 0.0, 0.0, 0.0);
                for &(age, then) in window {
                    let offset = then - position;
                    ages += age;
                    squares += age * age;
                    offsets += offset;
                    products += age * offset;
                }
                -(count * products - ages * offsets) / (count * squares - ages * ages)
            }
        }
    }

    /// Whether a line through the newest sample passes every sample of the window within one count.
    fn explains(&self, length: usize, position: f64, slope: f64) -> bool {
        self.past[..length]
            .iter()
            .all(|&(age, then)| (position - slope * age - then).abs() <= self.tolerance_m)
    }
}
