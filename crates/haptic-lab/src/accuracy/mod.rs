//! Speed against error: schemes held against true motions.

mod by_law;
pub mod cases;
mod error;
pub mod hands;
mod limits;
mod plane;
mod plot;
pub mod reference;
mod report;
mod tables;

pub use by_law::{
    Extent, ForceErrors, LawCase, LawMeasurement, SINGLE_TICKS, law_cases, measure_law, measure_laws,
    measure_single_ticks, schemes_by_law, worst_of,
};
pub use error::{RunError, compare};
pub use limits::{INSTRUCTIONS_ON, LIMITS, LawLimit, laws};
pub use plane::{PlaneBlock, PlaneCase, PlaneMeasurement, PlaneScheme, measure_plane, plane_cases};
pub use plot::plot;
pub use report::{Measurement, measure, schemes};
pub use tables::{Tables, refresh};
