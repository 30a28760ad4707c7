//! What to identify, and from which samples.

use super::fit_chart::FitChart;
use crate::tape::Tape;
use haptic_ipc::Sample;
use haptic_lab::identify;
use haptic_lab::identify::record_file::{Loaded, MovingMass, Source};
use haptic_lab::identify::{Identification, Identified, IdentifiedScene, Options, record_file};
use haptic_recording::{Ending, Metadata, Recording};
use std::ops::ControlFlow;
use std::path::Path;

/// A question of identification.
#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    /// What is asked for.
    pub options: Options,
    pub(crate) data: Data,
}

/// Where the samples come from.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Data {
    File(Source),
    Seen(Box<Samples>),
}

/// The samples of a plot.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Samples {
    /// What they are called in messages.
    pub(crate) name: &'static str,
    pub(crate) tape: Tape,
    /// Where their plots begin, s on the tape's clock.
    pub(crate) zero_s: f64,
    pub(crate) from_s: f64,
    pub(crate) to_s: f64,
    pub(crate) metadata: Metadata,
    pub(crate) moving: MovingMass,
}

impl Question {
    /// What a file says.
    #[must_use]
    pub const fn of_file(source: Source, options: Options) -> Self {
        Self {
            options,
            data: Data::File(source),
        }
    }

    /// The file with its columns and gains; `None` for samples of a plot.
    #[must_use]
    pub fn file(&self) -> Option<&Source> {
        match &self.data {
            Data::File(source) => Some(source),
            Data::Seen(_) => None,
        }
    }

    /// Where the samples come from, for people.
    #[must_use]
    pub fn origin(&self) -> String {
        match &self.data {
            Data::File(source) => source.path.display().to_string(),
            Data::Seen(samples) => {
                format!("{}, {:.1} s", samples.name, samples.to_s - samples.from_s)
            }
        }
    }

    /// Finds the answer. `progress` gets the share that is done, from 0 to 1; `Break` gives it up.
    ///
    /// # Errors
    /// Why nothing can be identified, or that it was given up.
    pub fn answer(&self, progress: &mut dyn FnMut(f64) -> ControlFlow<()>) -> Result<Found, String> {
        let loaded = self.load()?;
        let mut options = self.options.clone();
        options.offset_n = options.offset_n.or(loaded.offset_n);
        options.clocks = loaded.clocks.unwrap_or(options.clocks);
        let mut identified = identify::identify_with_progress(&loaded.record, &options, progress)
            .map_err(|error| format!("{}: {error}", self.origin()))?;
        identified.found.notes.splice(0..0, loaded.notes);
        Ok(Found::new(self.origin(), identified))
    }

    fn load(&self) -> Result<Loaded, String> {
        match &self.data {
            Data::File(source) => record_file::read(source),
            Data::Seen(samples) => {
                let source = Source {
                    moving: samples.moving,
                    ..Source::new(Path::new(samples.name))
                };
                record_file::take(&samples.recording(), &source)
            }
        }
        .map_err(|error| error.to_string())
    }
}

impl Samples {
    fn recording(&self) -> Recording {
        let own_time = |sample: &Sample| Sample {
            t_s: sample.t_s - self.zero_s,
            ..*sample
        };
        Recording {
            metadata: self.metadata.clone(),
            rows: self.tape.within(self.from_s, self.to_s).map(own_time).collect(),
            rows_y: Vec::new(),
            marks: Vec::new(),
            ending: Ending::Open,
        }
    }
}

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
    pub(super) fn new(origin: String, identification: Identification) -> Self {
        Self {
            origin,
            scene: identification.found.scene(NAME),
            charts: identification.plots().into_iter().map(FitChart::new).collect(),
            identified: identification.found,
        }
    }
}
