//! A snapshot of the plots in sight, for another thread to draw.

use crate::model::view::PlotGroup;
use crate::model::{Model, has_block, scene_seen};
use crate::plots::chart::Chart;
use crate::plots::contact_ribbon::{self, Run};
use crate::plots::over_time::Background;
use crate::plots::{self, force_velocity, over_time, spectrum_plot};

/// Columns over which the samples of a plot over time are drawn.
const COLUMNS: f64 = 1600.0;

/// The plots in sight, from left to right.
#[derive(Debug)]
pub(crate) struct Picture(pub(super) Vec<Group>);

/// Plots that stand together.
#[derive(Debug)]
pub(super) enum Group {
    /// Plots over time, one below the other, and the contact ribbon above them.
    OverTime { charts: Vec<Chart>, contacts: Vec<Run> },
    /// A plot of its own.
    Single(Chart),
}

impl Picture {
    /// The plots in sight now. This costs as much as a frame.
    pub(crate) fn seen(model: &Model) -> Self {
        let Model { daemon, tapes, view } = model;
        let scope = view.scope(tapes);
        let limits = plots::limits(model);
        let background = Background {
            reference: view.reference.as_ref(),
            limits: limits.as_ref(),
            has_block: has_block(model),
        };
        let groups = view.layout.drawn.iter().filter_map(|group| match group {
            PlotGroup::OverTime => {
                let seen = scope.seen(tapes);
                let ends = (seen.from_s, seen.to_s);
                let contacts = scope.tape(tapes).contacts(ends, seen.column_s(COLUMNS));
                let chart = |place| over_time::chart(tapes, scope, place, background, &[], COLUMNS);
                Some(Group::OverTime {
                    charts: (0..scope.plots.plots().len()).map(chart).collect(),
                    contacts: contact_ribbon::runs(contacts, seen.zero_s),
                })
            }
            PlotGroup::ForceVelocity => {
                let scene = scene_seen(daemon, tapes, scope);
                Some(Group::Single(force_velocity::chart(
                    tapes,
                    scope,
                    scene,
                    view.reference.as_ref(),
                )))
            }
            PlotGroup::Spectrum => spectrum_plot::seen(&view.measuring).map(Group::Single),
            // A table is not drawn; its numbers follow from the samples, which are exported as CSV.
            PlotGroup::Statistics => None,
        });
        Self(groups.collect())
    }
}
