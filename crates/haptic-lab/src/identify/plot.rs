//! What an identification fits, and how well, for people.

use super::Identification;
use super::options::Record;
use super::presliding::Estimate;
use super::result::Identified;
use crate::drawing::{Chart, Trace};
use crate::smoothing::{Window, less_inertia, velocity, weighted};
use haptic_core::Directional;
use haptic_motion::median::median_period_s;

/// Half-length of the window under which accelerations are drawn, s.
fn half_s(period_s: f64) -> f64 {
    (15e-3_f64).max(6.0 * period_s)
}

impl Identification {
    /// Force against velocity and against position, force over time, and what the fit leaves below.
    #[must_use]
    pub fn plots(&self) -> Vec<Chart> {
        let (record, force_n) = self.fitted();
        plots(&record, &self.found, &force_n, self.residual())
    }

    /// What the fit leaves under its windows, N, over time, s.
    fn residual(&self) -> Trace {
        let grid = &self.even.grid;
        let windows = self.left.residual.iter();
        let points = windows.map(|(at, left_n)| [grid.start_s + *at as f64 * grid.period_s, *left_n]);
        Trace::dots("residual", points.collect())
    }

    /// The record on an even grid and on one clock, and the force of the fit at each of its samples, N; NaN where the
    /// model says nothing of it. Both forces are NaN in the record's gaps.
    pub(super) fn fitted(&self) -> (Record, Vec<f64>) {
        let grid = &self.even.grid;
        let (x, last) = (&grid.position_m, grid.len() - 1);
        let window = Window::new(half_s(grid.period_s), grid.period_s);
        let acceleration = |at: usize| {
            let is_inner = at >= window.reach && at + window.reach <= last;
            is_inner.then(|| weighted(&window.curvature, x, at, x[at]))
        };
        let mut force_n: Vec<f64> = match (&self.left.path, Estimate::of(&self.found)) {
            (Some(path), Some(estimate)) => {
                let end = window.reach.min(last / 2);
                let accelerations = (0..=last).map(|at| acceleration(at.clamp(end, last - end)).unwrap_or(0.0));
                estimate.force(path, &accelerations.collect::<Vec<f64>>())
            }
            _ => (0..=last)
                .map(|at| acceleration(at).and_then(|acceleration| self.sliding_force(at, acceleration)))
                .map(|force_n| force_n.unwrap_or(f64::NAN))
                .collect(),
        };
        let mut even = Record {
            t_s: (0..=last).map(|at| grid.start_s + at as f64 * grid.period_s).collect(),
            position_m: x.clone(),
            force_n: grid.force_shifted(self.found.shift_s, 0.0),
            ..Record::default()
        };
        for at in (0..=last).filter(|at| grid.is_in_gap[*at]) {
            (even.force_n[at], force_n[at]) = (f64::NAN, f64::NAN);
        }
        (even, force_n)
    }

    /// The force of a fit to slides at a sample with an acceleration, m/s^2; `None` at rest, of which it says nothing.
    fn sliding_force(&self, at: usize, acceleration: f64) -> Option<f64> {
        let found = &self.found;
        let (dynamic, viscous) = (found.dynamic_force_n?, found.viscous_ns_per_m?);
        let motion = self.even.motion();
        let v = motion.velocity_mps[at];
        let friction = match motion.sense[at] {
            0 => return None,
            1.. => dynamic.positive + viscous.positive * v,
            _ => viscous.negative * v - dynamic.negative,
        };
        Some(found.mass_kg.unwrap_or(0.0) * acceleration + friction + found.offset_n.unwrap_or(0.0))
    }
}

/// The same of an even record; `fitted_force` is the force of the fit at each of its samples, N.
fn plots(record: &Record, identified: &Identified, fitted_force: &[f64], residual: Trace) -> Vec<Chart> {
    let period_s = median_period_s(record.t_s.iter().copied());
    let velocity_mps = velocity(&record.position_m, period_s);
    let friction = |force: &[f64]| match identified.mass_kg {
        Some(mass_kg) => less_inertia(force, &record.position_m, mass_kg, period_s),
        None => force.to_vec(),
    };
    let (measured, fitted) = (friction(&record.force_n), friction(fitted_force));
    let label = match identified.mass_kg {
        Some(mass_kg) => format!("Force less inertia of {mass_kg:.3} kg (N)"),
        None => "Force (N)".to_owned(),
    };
    let against = |across: &[f64], force: &[f64]| {
        across
            .iter()
            .copied()
            .zip(force.iter().copied())
            .map(<[f64; 2]>::from)
            .collect()
    };
    let over_time =
        |force: &mut dyn Iterator<Item = f64>| record.t_s.iter().copied().zip(force).map(|(t, f)| [t, f]).collect();
    let mut of_velocity = Chart::new("Force against velocity", "Velocity (m/s)", label.as_str())
        .with(Trace::dots("measured", against(&velocity_mps, &measured)));
    if let Some(law) = law(identified, &velocity_mps) {
        of_velocity = of_velocity.with(Trace::line("fitted while sliding", law));
    }
    let title = match identified.residual_window_s {
        Some(window_s) => format!("Measured less fitted, under each window of {:.0} ms", 1e3 * window_s),
        None => "Measured less fitted".to_owned(),
    };
    let fitted_name = format!("fitted, accelerations over {:.0} ms", 2e3 * half_s(period_s));
    let mut left = Chart::new(title.as_str(), "Time (s)", "Force (N)").with(residual);
    left.height_px = 150.0;
    vec![
        of_velocity,
        Chart::new("Force against position", "Position (m)", label)
            .with(Trace::dots("measured", against(&record.position_m, &measured)))
            .with(Trace::dots("fitted", against(&record.position_m, &fitted))),
        Chart::new("Force over time", "Time (s)", "Force (N)")
            .with(Trace::line("measured", over_time(&mut record.force_n.iter().copied())))
            .with(Trace::line(fitted_name, over_time(&mut fitted_force.iter().copied()))),
        left,
    ]
}

/// Dynamic and viscous friction with the offset, over the velocities of the record.
fn law(identified: &Identified, velocity_mps: &[f64]) -> Option<Vec<[f64; 2]>> {
    let dynamic = identified.dynamic_force_n?;
    let viscous = identified.viscous_ns_per_m.unwrap_or(Directional::both(0.0));
    let offset = identified.offset_n.unwrap_or(0.0);
    let fastest = |sign: f64| velocity_mps.iter().map(|velocity| sign * velocity).fold(0.0, f64::max);
    let (up, down) = (fastest(1.0), -fastest(-1.0));
    Some(vec![
        [down, offset - dynamic.negative + viscous.negative * down],
        [0.0, offset - dynamic.negative],
        [f64::NAN, f64::NAN],
        [0.0, offset + dynamic.positive],
        [up, offset + dynamic.positive + viscous.positive * up],
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::study::{Experiment, Movement, cases};
    use crate::identify::{ModelKind, Options, identify_with_progress};
    use haptic_core::friction::{Friction, Karnopp};
    use std::ops::ControlFlow;

    const STROKES: Movement = Movement::Chirp {
        from_hz: 0.5,
        to_hz: 3.0,
        stroke_m: 0.03,
        duration_s: 8.0,
    };

    #[test]
    fn the_law_goes_through_what_was_measured_while_sliding() {
        let t_s: Vec<f64> = (0..4000).map(|k| f64::from(k) * 1e-3).collect();
        let position = |t: &f64| 0.02 * (6.0 * t).sin();
        let record = Record {
            position_m: t_s.iter().map(position).collect(),
            // 1 kg, 2 N and 3 N s/m.
            force_n: t_s
                .iter()
                .map(|t| (0.12 * (6.0 * t).cos(), -36.0 * position(t)))
                .map(|(v, a)| a + 2.0 * v.signum() + 3.0 * v)
                .collect(),
            t_s,
            ..Record::default()
        };
        let identified = Identified {
            mass_kg: Some(1.0),
            dynamic_force_n: Some(Directional::both(2.0)),
            viscous_ns_per_m: Some(Directional::both(3.0)),
            ..Identified::empty(ModelKind::Karnopp)
        };
        let charts = plots(
            &record,
            &identified,
            &record.force_n,
            Trace::dots("residual", Vec::new()),
        );
        let [data, law] = &charts[0].traces[..] else {
            panic!("{:?}", charts[0].title)
        };
        let fastest = law.points[law.points.len() - 1];
        assert!(
            (fastest[0] - 0.12).abs() < 1e-3 && (fastest[1] - 2.36).abs() < 5e-3,
            "{fastest:?}"
        );
        for [v, force] in data.points.iter().filter(|point| point[0] > 0.05) {
            assert!((force - 2.0 - 3.0 * v).abs() < 0.02, "{force} N at {v} m/s");
        }
    }

    /// The rms of what is drawn as residual, and the one that is printed, N.
    fn drawn_and_printed_n(experiment: &Experiment, model: ModelKind) -> (f64, f64) {
        let record = experiment.record(3).expect("the scene is sound");
        let identification = identify_with_progress(&record, &Options::new(model), &mut |_| ControlFlow::Continue(()))
            .expect("a record");
        let charts = identification.plots();
        let drawn = charts[3].traces[0].points.iter().map(|point| point[1]);
        let drawn: Vec<f64> = drawn.filter(|left| left.is_finite()).collect();
        let rms = (drawn.iter().map(|left| left * left).sum::<f64>() / drawn.len() as f64).sqrt();
        (rms, identification.found.residual_rms_n)
    }

    #[test]
    fn the_residual_that_is_drawn_is_the_one_that_is_printed() {
        let karnopp = Friction::Karnopp(Karnopp {
            viscous: Directional::both(5.0),
            ..Karnopp::new(4.0, 3.5)
        });
        for (friction, model, movements, noises) in [
            (karnopp, ModelKind::Karnopp, None, &[0.0, 0.01, 0.1, 1.0][..]),
            (
                Friction::Dahl(cases::DAHL),
                ModelKind::Dahl,
                Some([STROKES]),
                &[0.0, 0.1],
            ),
        ] {
            for (&force_noise_n, resolution_m) in noises.iter().flat_map(|noise| [(noise, 0.0), (noise, 1e-5)]) {
                let mut experiment = Experiment::thorough(cases::half_a_kilogram(friction));
                if let Some(movements) = &movements {
                    experiment = experiment.with_movements(movements);
                }
                experiment.sensors.force_noise_n = force_noise_n;
                experiment.sensors.resolution_m = resolution_m;
                let (drawn_n, printed_n) = drawn_and_printed_n(&experiment, model);
                // A fit's freedom is less than its rows.
                assert!(
                    (0.97..=1.000_001).contains(&(drawn_n / printed_n)),
                    "{model:?}, noise of {force_noise_n} N, steps of {resolution_m} m: {drawn_n} N drawn, \
                     {printed_n} N printed"
                );
            }
        }
    }
}
