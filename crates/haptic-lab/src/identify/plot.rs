//! What an identification fits, and how well, for people.

use super::{Identified, Record};
use crate::derivatives::{derivatives, usual_period_s};
use crate::drawing::{Chart, Trace};
use haptic_core::Directional;

/// Force against velocity and against position, force over time, and what the fit leaves below.
/// `fitted_force` is the force of the fit at each sample of the record, N.
#[must_use]
pub fn plots(record: &Record, identified: &Identified, fitted_force: &[f64]) -> Vec<Chart> {
    let mass_kg = identified.mass_kg.unwrap_or(0.0);
    let (smooth_mps, acceleration_mps2) = derivatives(&record.position_m, usual_period_s(&record.t_s));
    let velocity_mps = record.velocity_mps.as_ref().unwrap_or(&smooth_mps);
    let label = if mass_kg > 0.0 {
        format!("Force less inertia of {mass_kg:.3} kg (N)")
    } else {
        "Force (N)".to_owned()
    };
    let against = |across: &[f64], force: &[f64]| -> Vec<[f64; 2]> {
        across
            .iter()
            .zip(force)
            .zip(&acceleration_mps2)
            .map(|((x, force), acceleration)| [*x, force - mass_kg * acceleration])
            .collect()
    };
    let over_time =
        |force: &mut dyn Iterator<Item = f64>| record.t_s.iter().copied().zip(force).map(|(t, f)| [t, f]).collect();
    let mut of_velocity = Chart::new("Force against velocity", "Velocity (m/s)", label.as_str())
        .with(Trace::dots("measured", against(velocity_mps, &record.force_n)));
    if let Some(law) = law(identified, velocity_mps) {
        of_velocity = of_velocity.with(Trace::line("fitted while sliding", law));
    }
    let mut left = Chart::new("Measured less fitted", "Time (s)", "Force (N)").with(Trace::line(
        "residual",
        over_time(
            &mut record
                .force_n
                .iter()
                .zip(fitted_force)
                .map(|(force, fitted)| force - fitted),
        ),
    ));
    left.height_px = 150.0;
    vec![
        of_velocity,
        Chart::new("Force against position", "Position (m)", label)
            .with(Trace::dots("measured", against(&record.position_m, &record.force_n)))
            .with(Trace::dots("fitted", against(&record.position_m, fitted_force))),
        Chart::new("Force over time", "Time (s)", "Force (N)")
            .with(Trace::line("measured", over_time(&mut record.force_n.iter().copied())))
            .with(Trace::line("fitted", over_time(&mut fitted_force.iter().copied()))),
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
