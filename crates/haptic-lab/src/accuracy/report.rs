//! The work-precision measurement: cost and error of each scheme in each case.

use super::by_law::LawMeasurement;
use super::cases::Case;
use super::error::{RunError, compare};
use super::reference;
use crate::motion::per_tick;
use crate::simulate::{Cost, measure_cost, simulate};
use haptic_core::{SceneError, Scheme};
use std::io;

/// One scheme in one case.
#[derive(Clone, Debug, PartialEq)]
pub struct Measurement {
    /// The case.
    pub case: String,
    /// The scheme.
    pub scheme: Scheme,
    /// Cost of a tick.
    pub cost: Cost,
    /// Instructions a tick; `None` where they could not be counted.
    pub instructions: Option<f64>,
    /// How far it is from the truth.
    pub error: RunError,
    /// Whether the law has a stuck state, so that changes of contact are compared.
    pub has_events: bool,
    /// Energy that friction put into the block, J.
    pub energy_created_j: f64,
    /// Whether it blew up: a block farther off than a meter.
    pub blew_up: bool,
}

impl Measurement {
    /// How far the times of the changes of contact are off, in words.
    #[must_use]
    pub fn events_text(&self) -> String {
        match self.error.event_time_s {
            _ if !self.has_events => "-".to_owned(),
            Some(time) => format!("{time:.1e}"),
            None => "others".to_owned(),
        }
    }
}

/// The schemes compared.
///
/// # Panics
/// Never: the names are those of schemes.
#[must_use]
pub fn schemes() -> Vec<Scheme> {
    ["exact", "literal", "literal:10", "literal:100", "implicit"]
        .map(|name| name.parse().expect("a scheme"))
        .to_vec()
}

/// A block that far from the truth, m, has blown up.
const BLOWN_UP_M: f64 = 1.0;

/// Runs every scheme through a case. `instructions` are the totals of a [probe](crate::cost::Probe)
/// for the case, scheme by scheme, or none.
///
/// # Errors
/// The case's scene cannot be rendered at the rate of its motion.
pub fn measure(case: &Case, instructions: Option<&[u64]>) -> Result<Vec<Measurement>, SceneError> {
    let truth = reference::solve(&case.scene, &case.motion, case.start);
    schemes()
        .into_iter()
        .enumerate()
        .map(|(index, scheme)| {
            let run = simulate(&case.scene, scheme, &case.motion, case.start)?;
            let error = compare(&run, &truth, case.stiffness());
            Ok(Measurement {
                case: case.name.clone(),
                scheme,
                cost: measure_cost(&case.scene, scheme, &case.motion, case.start)?,
                instructions: instructions
                    .and_then(|totals| totals.get(index))
                    .map(|total| per_tick(*total, &case.motion)),
                error,
                has_events: reference::has_stuck_state(&case.scene.friction),
                energy_created_j: run.energy_created_j,
                blew_up: error.position_m > BLOWN_UP_M,
            })
        })
        .collect()
}

/// Writes measurements as CSV. An event time is empty where the scheme has other changes of contact
/// than the truth, or the law has no stuck state.
///
/// # Errors
/// The output cannot be written.
pub fn write_csv(measurements: &[Measurement], mut out: impl io::Write) -> io::Result<()> {
    writeln!(
        out,
        "case,scheme,tick_ns_median,tick_instructions,position_error_m,force_error_N,relative_force_error,\
         event_time_error_s,energy_created_J,blew_up"
    )?;
    for m in measurements {
        let instructions = m.instructions.map_or_else(String::new, |count| format!("{count:.1}"));
        let event_time = m.error.event_time_s.map_or_else(String::new, |time| time.to_string());
        writeln!(
            out,
            "\"{}\",{},{:.1},{instructions},{:e},{:e},{:e},{event_time},{:e},{}",
            m.case,
            m.scheme,
            m.cost.median_ns,
            m.error.position_m,
            m.error.force_n,
            m.error.relative_force,
            m.energy_created_j,
            m.blew_up
        )?;
    }
    out.flush()
}

/// Writes the laws' measurements as CSV. What was not measured is empty, and so is the mass on the
/// device itself.
///
/// # Errors
/// The output cannot be written.
pub fn write_law_csv(measurements: &[LawMeasurement], mut out: impl io::Write) -> io::Result<()> {
    writeln!(
        out,
        "law,scheme,hand,mass_kg,ticks,force_error_median_N,force_error_breakaway_N,force_error_reversal_N,\
         force_error_worst_N,ticks_at_bound,force_error_at_bound_N,same_contact_changes,reference_error_N,\
         tick_ns_median,tick_ns_dearest,tick_instructions"
    )?;
    for m in measurements {
        let text = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.1}"));
        let (mass, same) = (
            m.mass_kg.map_or_else(String::new, |mass| mass.to_string()),
            m.errors.same_changes.map_or_else(String::new, |same| same.to_string()),
        );
        let e = &m.errors;
        writeln!(
            out,
            "\"{}\",{},\"{}\",{mass},{},{:e},{:e},{:e},{:e},{},{:e},{same},{:e},{},{},{}",
            m.law,
            m.scheme,
            m.hand,
            e.ticks,
            e.median_n,
            e.breakaway_n,
            e.reversal_n,
            e.worst_n,
            e.at_bound,
            e.at_bound_worst_n,
            e.uncertainty_n,
            text(m.cost.map(|cost| cost.median_ns)),
            text(m.cost.map(|cost| cost.dearest_ns)),
            text(m.instructions),
        )?;
    }
    out.flush()
}
