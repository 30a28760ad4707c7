//! The work-precision measurement: cost and error of each scheme in each case.

use super::cases::Case;
use super::error::{RunError, compare};
use super::reference;
use crate::motion::per_tick;
use crate::simulate::{Cost, measure_cost, simulate};
use haptic_core::{SceneError, Scheme};

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
