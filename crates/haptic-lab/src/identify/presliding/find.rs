//! The best fit of a law to a record, from several starts.

use super::super::grid::Even;
use super::super::options::{Directions, Options, Record};
use super::super::sensor::samples_in;
use super::fit::{Assumptions, Estimate, Fit, Rows, fit};
use super::laws::PathLaw;
use super::path::Path;
use crate::smoothing::white_noise;

/// A fit has ended when a step changes the sum of squares, or the parameters, by less than this share.
const FINAL: f64 = 1e-8;
/// The same while starts are compared.
const ROUGH: f64 = 1e-4;
/// The same for a fit that starts next to where it ends.
const WARM: f64 = 1e-4;
/// Steps of the encoder by which a motion must go back to count as a turn.
const STEPS_OF_A_TURN: f64 = 3.0;
/// Directions differ where values of their own explain this much more, as twice the logarithm of a likelihood: far
/// beyond chance, for neighbouring rows share their noise. Limits that are alike reach 60 where the surface gives way
/// by four steps of the encoder; limits that are 20 % apart reach 2000.
const CLEARLY_BETTER: f64 = 150.0;

/// A record made ready for fits.
#[derive(Clone, Debug)]
pub(crate) struct PreparedRecord {
    /// The record on an even clock.
    pub(crate) path: Path,
    /// The equation of motion.
    pub(crate) rows: Rows,
    /// Samples between two test functions.
    pub(crate) stride: usize,
    /// The fit of a surface that is rigid until it slides, with friction alike in both directions.
    pub(crate) coulomb: Fit,
    /// Root mean square of the white noise of the force, N.
    pub(crate) white_rms_n: f64,
    /// Whether the constant force was given.
    pub(crate) knows_offset: bool,
}

impl PreparedRecord {
    /// `None` where nothing moves. The force's clock is `shift_s` ahead.
    pub(crate) fn new(even: &Even, shift_s: f64, options: &Options) -> Option<Self> {
        let path = Path::new(even, shift_s)?;
        let white_rms_n = white_noise(&path.force_n, &path.is_recorded);
        let assumed = Assumptions::of(options, true);
        let start = Estimate {
            law: PathLaw::Coulomb,
            mass_kg: 0.0,
            viscous: [0.0; 2],
            offset_n: 0.0,
            shift_s: 0.0,
            values: vec![path.force_n.iter().map(|force| force.abs()).sum::<f64>() / path.force_n.len() as f64; 2],
        };
        let at = |stride| {
            let rows = Rows::new(&path, stride);
            let moving = rows.moving();
            fit(&path, &rows, &moving, &assumed, &start, FINAL).map(|coulomb| (rows, coulomb))
        };
        let (_, rough) = at(samples_in(0.008, path.period_s).max(2))?;
        // Short enough for the turns, and long enough for the steps of the encoder to make less noise of the inertia
        // than the force has: `h^4 = 5.6 (q M/noise)^2` makes them equal, with q the steps' root mean square.
        let steps_rms = path.resolution_m / 12_f64.sqrt();
        let equal_s = 1.54 * (steps_rms * rough.estimate.mass_kg.max(0.0) / white_rms_n.max(1e-9)).sqrt();
        let stride = samples_in((1.35 * equal_s).clamp(0.004, 0.02), path.period_s).max(2);
        let (rows, coulomb) = at(stride)?;
        Some(Self {
            path,
            rows,
            stride,
            coulomb,
            white_rms_n,
            knows_offset: options.offset_n.is_some(),
        })
    }

    /// All rows.
    pub(crate) fn all(&self) -> Vec<usize> {
        (0..self.rows.len()).collect()
    }

    /// Weighs the rows as a fit of a law says.
    pub(crate) fn weigh(&mut self, fit: &Fit) {
        self.rows.weigh(&self.path, fit);
    }

    /// The fit of a law, with what had to be assumed of its directions.
    /// From an earlier fit it starts there.
    pub(crate) fn find(
        &self,
        law: PathLaw,
        kept: &[usize],
        options: &Options,
        earlier: Option<&Fit>,
    ) -> Option<(Fit, Assumptions)> {
        let alike = Assumptions::of(options, true);
        let separate = Assumptions {
            offset_n: Some(options.offset_n.unwrap_or(0.0)),
            alike: false,
            ..alike
        };
        let refined = |assumed, start: &Fit| self.refine(kept, &assumed, &start.estimate, FINAL);
        let rough = earlier.cloned().or_else(|| self.best_start(law, kept, &alike))?;
        let fits_alike = refined(alike, &rough).map(|fit| (fit, alike));
        if options.directions == Directions::Alike {
            return fits_alike;
        }
        let fits_separate = refined(separate, &rough).map(|fit| (fit, separate));
        if options.directions == Directions::Separate {
            return fits_separate;
        }
        match (&fits_alike, &fits_separate) {
            (Some((one, _)), Some((two, _))) => {
                let better = 2.0 * kept.len() as f64 * (one.weighted_rms / two.weighted_rms).ln();
                if better > CLEARLY_BETTER {
                    fits_separate
                } else {
                    fits_alike
                }
            }
            _ => fits_alike.or(fits_separate),
        }
    }

    /// The fit of Dahl's law with the clocks' further shift in it, from an earlier estimate where there is one.
    pub(crate) fn further_shift(&self, earlier: Option<&Estimate>, options: &Options) -> Option<Estimate> {
        let assumed = Assumptions {
            one_clock: false,
            ..Assumptions::of(options, true)
        };
        let fit = match earlier {
            Some(start) => self.refine(&self.all(), &assumed, start, ROUGH),
            None => self.best_start(PathLaw::Dahl, &self.all(), &assumed),
        };
        fit.map(|fit| fit.estimate)
    }

    /// The fit of a law from one start.
    pub(crate) fn refine(
        &self,
        kept: &[usize],
        assumed: &Assumptions,
        start: &Estimate,
        tolerance: f64,
    ) -> Option<Fit> {
        fit(&self.path, &self.rows, kept, assumed, start, tolerance)
    }

    /// The same fit to another record of the same kind, which starts at its result.
    pub(crate) fn refit(&self, record: &Record, assumed: &Assumptions, start: &Estimate) -> Option<Fit> {
        let path = self.path.drawn_again(record);
        let mut rows = Rows::new(&path, self.stride);
        rows.errors.clone_from(&self.rows.errors);
        let all: Vec<usize> = (0..rows.len()).collect();
        fit(&path, &rows, &all, assumed, start, WARM)
    }

    /// The best of several starts.
    fn best_start(&self, law: PathLaw, kept: &[usize], assumed: &Assumptions) -> Option<Fit> {
        let limits = [self.coulomb.estimate.values[0]; 2];
        let starts: Vec<Vec<f64>> = match law {
            PathLaw::Coulomb => vec![limits.to_vec()],
            PathLaw::Dahl => self
                .deflections()
                .map(|deflection| [limits[0], limits[1], 0.0, limits[0] / deflection, 1.0].to_vec())
                .collect(),
            PathLaw::Lugre => {
                let dahl = self.best_start(PathLaw::Dahl, kept, assumed)?.estimate;
                let fastest = self.fastest_mps();
                let stribeck = [0.003, 0.02, 0.1].map(|share| share * fastest);
                let start = |speed: f64| [&dahl.values[..PathLaw::EXPONENT], &[1.2, 1.2, speed, 0.0]].concat();
                stribeck.map(start).to_vec()
            }
        };
        let fits = starts.into_iter().filter_map(|values| {
            let start = Estimate {
                law,
                values,
                ..self.coulomb.estimate.clone()
            };
            self.refine(kept, assumed, &start, ROUGH)
        });
        fits.min_by(|one, two| one.weighted_rms.total_cmp(&two.weighted_rms))
    }

    /// Deflections at which a surface may yield, m: from what the encoder shows to what was gone.
    fn deflections(&self) -> impl Iterator<Item = f64> {
        let farthest = self.path.longest_stroke(self.path.resolution_m);
        let least = self.path.resolution_m.max(farthest / 3000.0);
        let ratio = (0.25 * farthest / least).max(1.0);
        (0..4).map(move |k| least * ratio.powf(f64::from(k) / 3.0))
    }

    /// How many rows move each way.
    pub(crate) fn sides(&self) -> [usize; 2] {
        let moving = self.rows.moving();
        [1.0, -1.0].map(|sign: f64| moving.iter().filter(|&&row| sign * self.speed(row) > 0.0).count())
    }

    /// Velocity in the middle of a row, m/s.
    pub(crate) fn speed(&self, row: usize) -> f64 {
        self.path.speed_mps[self.rows.middle(row)]
    }

    /// The samples at which the motion turns.
    pub(crate) fn turns(&self) -> Vec<usize> {
        self.path.turns(STEPS_OF_A_TURN * self.path.resolution_m.max(1e-9))
    }

    /// Greatest speed, m/s.
    pub(crate) fn fastest_mps(&self) -> f64 {
        self.path
            .speed_mps
            .iter()
            .fold(0.0, |most, speed| most.max(speed.abs()))
    }
}
