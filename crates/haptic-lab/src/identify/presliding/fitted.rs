//! The force of a fit, sample by sample, to be drawn beside the record.

use super::super::options::Record;
use super::super::result::{Identified, ModelKind};
use super::fit::Estimate;
use super::laws::PathLaw;
use super::path::Path;
use crate::smoothing::{Window, weighted};

/// Half-length of the window under which accelerations are drawn, s; of at least six samples.
const HALF_S: f64 = 15e-3;

/// The record on an even grid and on one clock, and the force of the fit at each of its samples, N; `None` where the
/// law was not found.
pub(in super::super) fn fitted(record: &Record, found: &Identified) -> Option<(Record, Vec<f64>)> {
    let estimate = estimate(found)?;
    let path = Path::new(record, found.shift_s)?;
    let window = Window::new(HALF_S.max(6.0 * path.period_s), path.period_s);
    let (x, last) = (&path.counted_m, path.counted_m.len() - 1);
    let accelerations: Vec<f64> = (0..=last)
        .map(|at| {
            let at = at.clamp(window.reach.min(last / 2), last - window.reach.min(last / 2));
            if at < window.reach || at + window.reach > last {
                return 0.0;
            }
            weighted(&window.curvature, x, at, x[at])
        })
        .collect();
    let force = estimate.force(&path, &accelerations);
    let even = Record {
        t_s: (0..=last)
            .map(|sample| record.t_s[0] + sample as f64 * path.period_s)
            .collect(),
        position_m: path.counted_m,
        velocity_mps: None,
        force_n: path.force_n,
        resolution_m: None,
    };
    Some((even, force))
}

/// The law with the values that were found. A fall from static friction that was refused is none, and so is a damping.
fn estimate(found: &Identified) -> Option<Estimate> {
    let (dynamic, stiffness) = (found.dynamic_force_n?, found.stiffness_n_per_m?);
    let viscous = found.viscous_ns_per_m.unwrap_or_default();
    let fixed = found.static_force_n.unwrap_or(dynamic);
    let ratios = [fixed.positive / dynamic.positive, fixed.negative / dynamic.negative];
    let fall = found.stribeck_velocity_mps;
    let (law, rest) = match found.model {
        ModelKind::Dahl => (PathLaw::Dahl, vec![found.exponent.unwrap_or(1.0)]),
        ModelKind::Lugre => {
            let [positive, negative] = if fall.is_some() { ratios } else { [1.0; 2] };
            let damping = found.bristle_damping_ns_per_m.unwrap_or(0.0);
            (PathLaw::Lugre, vec![positive, negative, fall.unwrap_or(1.0), damping])
        }
        ModelKind::Karnopp | ModelKind::Auto => return None,
    };
    Some(Estimate {
        law,
        mass_kg: found.mass_kg.unwrap_or(0.0),
        viscous: [viscous.positive, viscous.negative],
        offset_n: found.offset_n.unwrap_or(0.0),
        shift_s: 0.0,
        values: [&[dynamic.positive, dynamic.negative, 0.0, stiffness], rest.as_slice()].concat(),
    })
}
