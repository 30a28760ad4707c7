//! One signal against another: which ones, over which time, and how far their axes reach.

use super::value_axis::ValueAxis;
use crate::tape::signal::Signal;

/// Which samples are drawn.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Extent {
    /// The last second in sight.
    #[default]
    LastSecond,
    /// All that is in sight.
    Seen,
    /// Those between the cursors; all that is in sight without cursors.
    Cursors,
}

impl Extent {
    pub(crate) const ALL: [Self; 3] = [Self::LastSecond, Self::Seen, Self::Cursors];

    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::LastSecond => "Last second",
            Self::Seen => "All in sight",
            Self::Cursors => "Between cursors",
        }
    }
}

/// The plot of one signal against another.
#[derive(Debug)]
pub(crate) struct Against {
    /// The signal of the horizontal axis.
    pub(crate) across: Signal,
    /// The signal of the vertical axis.
    pub(crate) up: Signal,
    pub(crate) extent: Extent,
    pub(crate) across_axis: ValueAxis,
    pub(crate) up_axis: ValueAxis,
    pub(crate) zooms_to_stick_band: bool,
}

impl Default for Against {
    fn default() -> Self {
        Self {
            across: Signal::BLOCK_VELOCITY,
            up: Signal::COUPLING_FORCE,
            extent: Extent::default(),
            across_axis: ValueAxis::default(),
            up_axis: ValueAxis::default(),
            zooms_to_stick_band: false,
        }
    }
}

impl Against {
    /// Whether it shows what a law is drawn in: force against velocity.
    pub(crate) fn shows_law(&self) -> bool {
        self.across == Signal::BLOCK_VELOCITY && self.up == Signal::COUPLING_FORCE
    }

    /// Fits both axes to the samples.
    pub(crate) fn fit(&mut self) {
        self.across_axis.fit();
        self.up_axis.fit();
    }
}
