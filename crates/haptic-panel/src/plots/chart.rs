//! A chart: traces of a tape, and overlays that do not come from it. Window and SVG draw the same chart.
//!
//! A limit is an overlay at a level; a cursor, a trigger's moment or a change is one at a mark; a law, a
//! fit, a trial or another recording is a curve.

use super::axis::reach;
use super::scope::TimeRange;
use crate::plots::scope::value_axis::Reach;
use crate::tape::Tape;
use crate::tape::outline::BREAK;
use crate::tape::plane::Component;
use crate::tape::signal::Signal;
use crate::theme::Palette;
use egui::Color32;
use std::borrow::Cow;

/// How a line is drawn.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ink {
    /// Colour in the palette of the theme.
    pub(crate) color: fn(&Palette) -> Color32,
    /// Width, points.
    pub(crate) width: f32,
    /// From 0 to 1.
    pub(crate) opacity: f32,
    pub(crate) is_dashed: bool,
}

impl Ink {
    pub(crate) const fn solid(color: fn(&Palette) -> Color32, width: f32) -> Self {
        Self {
            color,
            width,
            opacity: 1.0,
            is_dashed: false,
        }
    }

    pub(crate) fn color(&self, palette: &Palette) -> Color32 {
        (self.color)(palette).gamma_multiply(self.opacity)
    }
}

/// The horizontal axis of a trace.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Across {
    /// Time: the extremes of each column of pixels are drawn.
    Time,
    /// Another signal, of which one in `stride` samples is drawn.
    Signal {
        signal: Signal,
        stride: usize,
        /// Only samples with force are drawn.
        with_force: bool,
    },
}

/// A line that a chart reads from its tape.
#[derive(Clone, Debug)]
pub(crate) struct Trace {
    pub(crate) name: Cow<'static, str>,
    pub(crate) across: Across,
    pub(crate) signal: Signal,
    pub(crate) component: Component,
    pub(crate) ink: Ink,
}

impl Trace {
    /// A signal of a rig of one axis over time.
    pub(crate) fn over_time(signal: Signal) -> Self {
        Self {
            name: signal.name().into(),
            across: Across::Time,
            signal,
            component: Component::Whole,
            ink: Ink::solid(signal.color(), signal.width()),
        }
    }

    /// Signals over time in one plot: the colour of each differs from those before it.
    pub(crate) fn all_over_time(signals: &[Signal]) -> Vec<Self> {
        let mut traces: Vec<Self> = Vec::new();
        for signal in signals {
            let mut trace = Self::over_time(*signal);
            // The order of function pointers means nothing: the colours themselves are compared.
            let paper = Palette::for_paper();
            let is_free =
                |color: &fn(&Palette) -> Color32| traces.iter().all(|other| (other.ink.color)(paper) != color(paper));
            let choice = [trace.ink.color].into_iter().chain(Palette::OTHER_LINES);
            trace.ink.color = choice.into_iter().find(is_free).unwrap_or(trace.ink.color);
            traces.push(trace);
        }
        traces
    }

    /// Its components: the second axis is dashed.
    pub(crate) fn components(self, is_plane: bool, as_length: bool) -> impl Iterator<Item = Self> {
        let components = Component::of(self.signal, is_plane, as_length).iter();
        components.map(move |component| Self {
            name: component.name(self.signal),
            component: *component,
            ink: Ink {
                is_dashed: *component == Component::Y,
                ..self.ink
            },
            ..self
        })
    }

    pub(crate) fn line(&self) -> (Signal, Component) {
        (self.signal, self.component)
    }
}

/// A line in the units of the axes.
#[derive(Clone, Debug)]
pub(crate) struct Curve {
    pub(crate) name: Cow<'static, str>,
    /// What it is, for the hint of its name; may be empty.
    pub(crate) hint: &'static str,
    /// With a [`BREAK`] where samples are missing.
    pub(crate) points: Vec<[f64; 2]>,
    pub(crate) ink: Ink,
}

/// Something on a chart that does not come from its tape, in the units of the axes.
#[derive(Clone, Debug)]
pub(crate) enum Overlay {
    /// A curve, below the traces.
    Curve(Curve),
    /// A dashed line at a value of the vertical axis, with a label at its end that may be empty.
    Level {
        value: f64,
        label: Cow<'static, str>,
        /// The label stands on the side of zero.
        is_inward: bool,
        ink: Ink,
    },
    /// A line at a value of the horizontal axis, with a label at its foot that may be empty.
    Mark {
        at: f64,
        label: Cow<'static, str>,
        is_dashed: bool,
        ink: Ink,
    },
    Dots {
        name: &'static str,
        at: Vec<[f64; 2]>,
        /// Radius, points.
        radius: f32,
        color: fn(&Palette) -> Color32,
    },
}

#[derive(Clone, Debug)]
pub(crate) struct Axes {
    /// The samples of this time are drawn.
    pub(crate) seen: TimeRange,
    /// Columns of pixels.
    pub(crate) columns: f64,
    pub(crate) across: Reach,
    /// The range of the vertical axis if the user holds it; otherwise it fits the lines.
    pub(crate) up: Option<Reach>,
    /// Smallest span of a fitted vertical axis.
    pub(crate) smallest_span: f64,
    /// Names of the horizontal and the vertical axis.
    pub(crate) labels: [String; 2],
}

/// A chart that is ready to be drawn.
#[derive(Clone, Debug)]
pub(crate) struct Chart {
    pub(crate) curves: Vec<Curve>,
    pub(crate) overlays: Vec<Overlay>,
    pub(crate) across: Reach,
    pub(crate) up: Reach,
    pub(crate) labels: [String; 2],
}

impl Chart {
    pub(crate) fn new(tape: &Tape, traces: &[Trace], overlays: &[Overlay], axes: Axes) -> Self {
        let Axes {
            seen,
            columns,
            across,
            up,
            smallest_span,
            labels,
        } = axes;
        let mut chart = Self {
            curves: curves(tape, traces, &seen, columns),
            overlays: overlays.to_vec(),
            across,
            up: (0.0, 0.0),
            labels,
        };
        chart.up = up.unwrap_or_else(|| {
            let lines = chart.curves.iter().chain(chart.under());
            reach(
                lines.flat_map(|curve| values_within(&curve.points, across)),
                smallest_span,
            )
        });
        chart
    }

    pub(crate) fn under(&self) -> impl Iterator<Item = &Curve> {
        self.overlays.iter().filter_map(|overlay| match overlay {
            Overlay::Curve(curve) => Some(curve),
            _ => None,
        })
    }
}

/// The lines of traces. Traces over time are read in one pass.
fn curves(tape: &Tape, traces: &[Trace], seen: &TimeRange, columns: f64) -> Vec<Curve> {
    let of_time = |trace: &&Trace| matches!(trace.across, Across::Time);
    let of_time: Vec<_> = traces.iter().filter(of_time).map(Trace::line).collect();
    let outlines = tape.lines(&of_time, (seen.from_s, seen.to_s), seen.column_s(columns));
    let mut outlines = outlines.into_iter();
    let points = |trace: &Trace| match trace.across {
        Across::Time => {
            let mut points = outlines.next().unwrap_or_default();
            for [t_s, _] in &mut points {
                *t_s -= seen.zero_s;
            }
            points
        }
        Across::Signal {
            signal: across,
            stride,
            with_force,
        } => tape
            .component(trace.component)
            .into_iter()
            .flat_map(|tape| tape.pairs_every(stride, with_force, (seen.from_s, seen.to_s)))
            .map(|pair| {
                let point = |(before, sample)| [across.of(before, sample), trace.signal.of(before, sample)];
                pair.map_or(BREAK, point)
            })
            .collect(),
    };
    let points: Vec<_> = traces.iter().map(points).collect();
    let lines = traces.iter().zip(points);
    lines
        .map(|(trace, points)| Curve {
            name: trace.name.clone(),
            hint: trace.signal.definition(),
            points,
            ink: trace.ink,
        })
        .collect()
}

/// The values of a line that is seen within a range of the horizontal axis, with the points next to it.
fn values_within(points: &[[f64; 2]], (left, right): Reach) -> impl Iterator<Item = f64> {
    let touches = move |from: &[f64; 2], to: &[f64; 2]| from[0].min(to[0]) <= right && from[0].max(to[0]) >= left;
    (0..points.len()).filter_map(move |place| {
        let point = &points[place];
        let neighbours = [place.checked_sub(1), Some(place), Some(place + 1)];
        let mut neighbours = neighbours.into_iter().flatten().filter_map(|place| points.get(place));
        neighbours.any(|other| touches(point, other)).then_some(point[1])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tape::tests::at;

    #[test]
    fn an_axis_fits_the_overlays_and_traces_in_sight() {
        let mut rows: Vec<_> = (0..100).map(|i| at(f64::from(i))).collect();
        rows[50].coupling_force_n = 8.0;
        rows[90].coupling_force_n = 100.0;
        let tape = Tape::recorded(rows);
        let fit = Overlay::Curve(Curve {
            name: "Fit".into(),
            hint: "",
            points: vec![[-100.0, -300.0], [-50.0, -4.0], [-40.0, -4.0], [0.0, -500.0]],
            ink: Ink::solid(|palette| palette.law, 1.0),
        });
        let axes = Axes {
            seen: TimeRange {
                zero_s: 99.0,
                from_s: 45.0,
                to_s: 55.0,
            },
            columns: 1000.0,
            across: (-54.0, -44.0),
            up: None,
            smallest_span: 1.0,
            labels: ["Time".to_owned(), "Force".to_owned()],
        };
        let traces = [Trace::over_time(Signal::COUPLING_FORCE)];
        let chart = Chart::new(&tape, &traces, &[], axes.clone());
        assert!(chart.curves[0].points.contains(&[-49.0, 8.0]), "{:?}", chart.curves);
        assert!(chart.up.1 > 8.0 && chart.up.1 < 10.0, "{:?}", chart.up);
        let with_fit = Chart::new(&tape, &traces, &[fit], axes.clone());
        assert_eq!(with_fit.overlays.len(), 1);
        assert!(with_fit.up.0 < -300.0 && with_fit.up.0 > -400.0, "{:?}", with_fit.up);
        let held = Chart::new(
            &tape,
            &traces,
            &[],
            Axes {
                up: Some((0.0, 1.0)),
                ..axes
            },
        );
        assert_eq!(held.up, (0.0, 1.0));
    }
}
