//! A snapshot of the plots in sight, and its picture as an SVG by the writer of all figures of this project
//! (`haptic_lab::drawing`). Another thread draws it.

use crate::model::{Model, has_block, scene_seen};
use crate::plots::chart::{Chart, Curve, Ink, Overlay};
use crate::plots::contact_ribbon::{self, Run};
use crate::plots::over_time::{self, Background};
use crate::plots::{self, force_velocity, plane, spectrum_plot};
use crate::theme::Palette;
use crate::view::PlotGroup;
use egui::Color32;
use haptic_lab::drawing::{self, Axis, Form, PLOT_WIDTH_PX, Trace};

/// Columns over which the samples of a plot over time are drawn.
const COLUMNS: f64 = 1600.0;

/// The plots in sight, from left to right.
#[derive(Debug)]
pub(crate) struct Picture(Vec<Group>);

/// Plots that stand together.
#[derive(Debug)]
enum Group {
    /// Plots over time, one below the other, and the contact ribbon above them.
    OverTime { charts: Vec<Chart>, contacts: Vec<Run> },
    /// A plot of its own.
    Single(Chart),
    /// The plots of a plane, on equal scales.
    Plane([Chart; 2]),
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
            PlotGroup::Plane => Some(Group::Plane(plane::charts(model, 1))),
            // A table is not drawn; its numbers follow from the samples, which are exported as CSV.
            PlotGroup::Statistics => None,
        });
        Self(groups.collect())
    }
}

/// Height of a plot over time, px.
const OVER_TIME_PX: f64 = 220.0;

/// Height of a plot of its own, px.
const SINGLE_PX: f64 = 440.0;

/// Height of the contact ribbon within its plot, as a share of the vertical axis.
const RIBBON_AT: f64 = 0.985;

/// The plots in sight as an SVG.
#[must_use]
pub fn svg(model: &Model) -> String {
    Picture::seen(model).svg()
}

impl Picture {
    /// The picture as an SVG: its plots below one another.
    pub(crate) fn svg(&self) -> String {
        let mut figures = Vec::new();
        let name = |label: &str| label.split(" (").next().unwrap_or_default().to_owned();
        for group in &self.0 {
            match group {
                Group::OverTime { charts, contacts } => {
                    for (place, chart) in charts.iter().enumerate() {
                        let contacts = if place == 0 { contacts.as_slice() } else { &[] };
                        let title = format!("{} over time", name(&chart.labels[1]));
                        figures.push(figure(title, chart, contacts, OVER_TIME_PX));
                    }
                }
                Group::Plane([positions, force]) => {
                    figures.push(on_equal_scales("Hand and block", positions));
                    figures.push(on_equal_scales("Coupling force", force));
                }
                Group::Single(chart) => {
                    let [across, up] = &chart.labels;
                    let title = format!("{} against {}", name(up), name(across).to_lowercase());
                    figures.push(figure(title, chart, &[], SINGLE_PX));
                }
            }
        }
        drawing::svg(&figures)
    }
}

/// A chart whose axes have the same scale.
fn on_equal_scales(title: &str, chart: &Chart) -> drawing::Chart {
    let span = |(low, high): (f64, f64)| high - low;
    // A plot that would be higher than wide gets a wider axis instead.
    let (left, right) = chart.across;
    let half = span(chart.across).max(span(chart.up)) / 2.0;
    let middle = left.midpoint(right);
    let chart = Chart {
        across: (middle - half, middle + half),
        ..chart.clone()
    };
    let height_px = PLOT_WIDTH_PX * span(chart.up) / span(chart.across);
    figure(title.to_owned(), &chart, &[], height_px)
}

/// A chart with the contact ribbon at its upper edge.
fn figure(title: String, chart: &Chart, contacts: &[Run], height_px: f64) -> drawing::Chart {
    let [across, up] = chart.labels.clone();
    let axis = |label, range| Axis {
        label,
        range: Some(range),
    };
    let mut traces = Vec::new();
    for (name, slides, color) in [("sliding", true, 2), ("stuck", false, 4)] {
        let at = chart.up.0 + RIBBON_AT * (chart.up.1 - chart.up.0);
        let runs = contacts.iter().filter(|run| run.slides == slides);
        let points: Vec<_> = runs
            .flat_map(|run| [[run.from, at], [run.to, at], [f64::NAN; 2]])
            .collect();
        if !points.is_empty() {
            traces.push(Trace::line(name, points).in_colour(color));
        }
    }
    let is_within = |at: &f64, (from, to): (f64, f64)| (from..=to).contains(at);
    for overlay in &chart.overlays {
        // A name in the legend is of something that is drawn.
        let (name, points, form, ink) = match overlay {
            Overlay::Level { value, .. } if !is_within(value, chart.up) => continue,
            Overlay::Mark { at, .. } if !is_within(at, chart.across) => continue,
            Overlay::Level { value, label, ink, .. } => (
                &**label,
                [chart.across.0, chart.across.1].map(|at| [at, *value]),
                Form::Dashed,
                ink,
            ),
            Overlay::Mark {
                at,
                label,
                is_dashed,
                ink,
            } => (
                // What happened to the rig has no label of its own.
                if label.is_empty() && ink.opacity < 1.0 {
                    "faults, changes, missed periods"
                } else {
                    &**label
                },
                [chart.up.0, chart.up.1].map(|value| [*at, value]),
                if *is_dashed { Form::Dashed } else { Form::Mark },
                ink,
            ),
            Overlay::Curve(_) | Overlay::Dots { .. } => continue,
        };
        add_line(&mut traces, name, &points, form, ink);
    }
    traces.extend(chart.under().chain(&chart.curves).map(line));
    for overlay in &chart.overlays {
        if let Overlay::Dots { name, at, color, .. } = overlay
            && !at.is_empty()
        {
            traces.push(Trace::dots(*name, at.clone()).in_colour(colour(*color)));
        }
    }
    drawing::Chart {
        title,
        across: axis(across, chart.across),
        up: axis(up, chart.up),
        traces,
        is_logarithmic: false,
        notes: Vec::new(),
        height_px,
    }
}

/// Adds a straight line. Lines of one name and look are one trace.
fn add_line(traces: &mut Vec<Trace>, name: &str, points: &[[f64; 2]], form: Form, ink: &Ink) {
    let colour = Some(colour(ink.color));
    let alike = |trace: &&mut Trace| trace.name == name && trace.form == form && trace.colour == colour;
    if let Some(trace) = traces.iter_mut().find(alike) {
        trace.points.push([f64::NAN; 2]);
        trace.points.extend(points);
        return;
    }
    let trace = Trace::new(name, points.to_vec(), form);
    traces.push(Trace { colour, ..trace });
}

/// A curve; a faint one, as that of a reference, is dashed, too.
fn line(curve: &Curve) -> Trace {
    let points = curve.points.clone();
    let trace = if curve.ink.opacity < 1.0 || curve.ink.is_dashed {
        Trace::dashed(curve.name.clone(), points)
    } else {
        Trace::line(curve.name.clone(), points)
    };
    trace.in_colour(colour(curve.ink.color))
}

/// The place of a colour among those of the writer, which are of Okabe and Ito as well: blue, orange, green, pink, and
/// black for everything else.
fn colour(color: fn(&Palette) -> Color32) -> usize {
    let paper = Palette::for_paper();
    let known = [paper.device, paper.block, paper.sliding, paper.law];
    let mut places = known.iter();
    places.position(|known| *known == color(paper)).unwrap_or(known.len())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plots::scope::trigger::Mode;
    use crate::tape::tests::{at, batch};
    use crate::update::Update;
    use haptic_ipc::Event;

    /// Two seconds, with a spike of 42 N.
    fn with_samples() -> Model {
        let rows = (0..2000).map(|i| {
            let mut row = at(f64::from(i) * 1e-3);
            row.command_force_n = if i == 1500 { 42.0 } else { 0.0 };
            row
        });
        let mut model = Model::new();
        model.apply(Update::Event(Event::Samples(batch(rows.collect()))));
        model
    }

    #[test]
    fn the_picture_has_each_plot_in_sight_its_units_and_the_spike() {
        let mut model = with_samples();
        let threshold = [("DV".parse().expect("a parameter"), 0.005)];
        model.daemon.mirror.scene.whole = haptic_core::Scene::paper().with(&threshold).ok();
        let over_time: &[_] = &[
            "Force (N)",
            "Position (mm)",
            "Velocity (mm/s)",
            "Time from the newest sample (s)",
            "Force on the hand",
            ">40<",
        ];
        let against: &[_] = &[
            "Block velocity (mm/s)",
            ">Law</text>",
            ">Trail",
            ">DV</text>",
            "<title>Now<",
        ];
        for (drawn, parts, others) in [
            (vec![PlotGroup::OverTime], over_time, against),
            (vec![PlotGroup::ForceVelocity], against, &over_time[1..4]),
            (
                vec![PlotGroup::OverTime, PlotGroup::ForceVelocity],
                [over_time, against].concat().as_slice(),
                ["NaN", "inf"].as_slice(),
            ),
        ] {
            model.view.layout.drawn = drawn;
            let text = svg(&model);
            for part in parts {
                assert!(text.contains(part), "{part}");
            }
            for other in others {
                assert!(!text.contains(other), "{other} is not seen");
            }
        }
        model.view.scope.trigger.set_mode(Mode::Normal);
        assert!(
            svg(&model).contains("Time from the newest sample"),
            "nothing has crossed yet"
        );
        model.view.scope.trigger.set_mode(Mode::Off);
        model.view.scope.plots.plots_mut()[0].axis.hold((-1.0, 3.0));
        let text = svg(&model);
        assert!(text.contains(">3.0<") && !text.contains(">40<"), "the axis is held");
    }
}
