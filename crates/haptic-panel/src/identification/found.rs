//! What an identification found, ready to be shown.

use super::FitChart;
use haptic_lab::identify::{self, Identified, IdentifiedScene, Record};

/// Values, scene and plots.
#[derive(Clone, Debug, PartialEq)]
pub struct Found {
    /// Where the samples come from.
    pub(crate) origin: String,
    pub(crate) identified: Identified,
    /// The scene that feels like it, or why there is none.
    pub(crate) scene: Result<IdentifiedScene, String>,
    pub(crate) charts: Vec<FitChart>,
}

/// Name of the scene until it is saved.
const NAME: &str = "identified";

impl Found {
    pub(super) fn new(origin: String, record: &Record, identified: Identified) -> Self {
        let (even, fitted_n) = identify::fitted(record, &identified);
        let charts = identify::plots(&even, &identified, &fitted_n);
        Self {
            origin,
            scene: identified.scene(NAME),
            charts: charts.iter().map(FitChart::new).collect(),
            identified,
        }
    }
}
