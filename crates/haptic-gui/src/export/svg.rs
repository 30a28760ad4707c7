//! The plots as they are seen, as an SVG in the colours for a white page.

use crate::model::Model;
use crate::plots::Shown;
use crate::plots::axis::{USUAL_COUNT, number, steps};
use crate::plots::contact_ribbon;
use crate::plots::force_velocity::{Graph, LABELS, dot_name};
use crate::plots::over_time::{stroke, time_label, traces, value_reach};
use crate::scope::Scope;
use crate::scope::signal::Quantity;
use crate::scope::value_axes::Reach;
use crate::theme::Palette;
use egui::Color32;
use std::fmt::Write as _;

/// Size of a plot over time, px.
const OVER_TIME: (f64, f64) = (800.0, 220.0);
/// Size of force against velocity, px.
const FORCE_VELOCITY: (f64, f64) = (480.0, 440.0);
/// Room for the numbers and names at a plot's left, right, top and bottom, px.
const MARGINS: (f64, f64, f64, f64) = (70.0, 20.0, 34.0, 40.0);
const RIBBON: f64 = 8.0;

/// The plots that are seen.
#[must_use]
pub fn svg(model: &Model) -> String {
    let scope = model.scope();
    let (left, right, top, bottom) = MARGINS;
    let mut drawing = Drawing::default();
    let mut x = 0.0;
    for shown in model.plots_seen {
        match shown {
            Shown::OverTime => {
                drawing.over_time(scope, x + left);
                x += left + OVER_TIME.0 + right;
            }
            Shown::ForceVelocity => {
                let graph = Graph::of(scope, model.scene_seen());
                drawing.force_velocity(&graph, dot_name(scope), x + left, top);
                x += left + FORCE_VELOCITY.0 + right;
            }
        }
    }
    drawing.end(right, bottom)
}

/// Where a plot lies in the picture, px, and what of its values it shows.
struct Frame {
    corner: (f64, f64),
    size: (f64, f64),
    across: Reach,
    up: Reach,
}

impl Frame {
    fn x(&self, value: f64) -> f64 {
        let (low, high) = self.across;
        self.corner.0 + self.size.0 * (value - low) / (high - low)
    }

    fn y(&self, value: f64) -> f64 {
        let (low, high) = self.up;
        self.corner.1 + self.size.1 * (high - value) / (high - low)
    }

    /// The parts of a line that lie within, cut at the edges: not every program that reads the picture can clip.
    fn within(&self, points: &[[f64; 2]]) -> Vec<Vec<[f64; 2]>> {
        let mut parts: Vec<Vec<[f64; 2]>> = Vec::new();
        let mut goes_on = false;
        for pair in points.windows(2) {
            let Some([from, to]) = cut(pair[0], pair[1], [self.across, self.up]) else {
                goes_on = false;
                continue;
            };
            match parts.last_mut().filter(|_| goes_on) {
                Some(part) => part.push(to),
                None => parts.push(vec![from, to]),
            }
            // A line that leaves may come back elsewhere.
            goes_on = to == pair[1];
        }
        parts
    }
}

/// The part of a straight line within a box, after Liang and Barsky (1984); nothing where it passes by.
fn cut(from: [f64; 2], to: [f64; 2], within: [Reach; 2]) -> Option<[[f64; 2]; 2]> {
    let (mut enters, mut leaves) = (0.0_f64, 1.0_f64);
    for axis in 0..2 {
        let (start, way, (low, high)) = (from[axis], to[axis] - from[axis], within[axis]);
        if way == 0.0 {
            if start < low || start > high {
                return None;
            }
            continue;
        }
        let ends = [(low - start) / way, (high - start) / way];
        enters = enters.max(ends[0].min(ends[1]));
        leaves = leaves.min(ends[0].max(ends[1]));
    }
    let at = |share: f64| match share {
        0.0 => from,
        1.0 => to,
        _ => [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis])),
    };
    (enters < leaves).then(|| [at(enters), at(leaves)])
}

/// How a line is drawn.
struct Stroke {
    color: String,
    width: f32,
    opacity: f32,
}

impl Stroke {
    fn solid(color: Color32, width: f32) -> Self {
        Self {
            color: format!("#{:02x}{:02x}{:02x}", color.r(), color.g(), color.b()),
            width,
            opacity: 1.0,
        }
    }
}

/// An SVG that grows. Writing to a `String` cannot fail.
#[derive(Default)]
struct Drawing {
    text: String,
    /// The farthest corner of a plot, px.
    reaches: (f64, f64),
}

impl Drawing {
    fn end(self, right: f64, bottom: f64) -> String {
        let (width, height) = (self.reaches.0 + right, self.reaches.1 + bottom);
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
             font-family=\"sans-serif\" font-size=\"12\">\n<rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n{}</svg>\n",
            self.text
        )
    }

    fn add(&mut self, element: std::fmt::Arguments<'_>) {
        self.text.write_fmt(element).unwrap_or(());
        self.text.push('\n');
    }

    fn over_time(&mut self, scope: &Scope, left: f64) {
        let seen = scope.seen();
        let quantities: Vec<Quantity> = scope.quantities().collect();
        let mut y = 0.0;
        for (place, quantity) in quantities.iter().enumerate() {
            y += MARGINS.2;
            let traces = traces(scope, *quantity, &seen, OVER_TIME.0 * 2.0);
            let frame = Frame {
                corner: (left, y),
                size: OVER_TIME,
                across: (seen.from_s - seen.zero_s, seen.to_s - seen.zero_s),
                up: value_reach(scope, *quantity, &traces),
            };
            if place == 0 {
                self.ribbon(scope, &frame);
            }
            let is_lowest = place + 1 == quantities.len();
            let value_label = format!("{} ({})", quantity.name(), quantity.unit());
            self.frame(&frame, is_lowest.then(|| time_label(scope)), &value_label);
            let lines = traces.iter().map(|trace| {
                let (color, width) = stroke(Palette::for_paper(), trace.signal);
                (trace.signal.name(), Stroke::solid(color, width), &*trace.points)
            });
            self.lines(&frame, lines);
            y += OVER_TIME.1;
        }
    }

    fn force_velocity(&mut self, graph: &Graph, dot: &str, left: f64, top: f64) {
        let frame = Frame {
            corner: (left, top),
            size: FORCE_VELOCITY,
            across: graph.velocities,
            up: graph.forces,
        };
        let palette = Palette::for_paper();
        self.frame(&frame, Some(LABELS[0]), LABELS[1]);
        let mark = Stroke::solid(palette.mark, 1.0);
        for threshold in &graph.thresholds {
            let (x, y, height) = (frame.x(*threshold), frame.corner.1, frame.size.1);
            if (graph.velocities.0..=graph.velocities.1).contains(threshold) {
                self.add(format_args!(
                    "<path d=\"M{x:.2} {y}v{height}\" stroke=\"{}\" stroke-dasharray=\"6 4\"><title>DV</title></path>",
                    mark.color
                ));
                let outwards = threshold.signum();
                let (x, foot) = (x + 4.0 * outwards, y + height - 8.0);
                let anchor = if outwards < 0.0 { "end" } else { "start" };
                self.add(format_args!(
                    "<text x=\"{x:.2}\" y=\"{foot}\" text-anchor=\"{anchor}\" fill=\"{}\">DV</text>",
                    mark.color
                ));
            }
        }
        let faint = Stroke {
            opacity: 0.5,
            ..Stroke::solid(palette.block, 1.0)
        };
        let lines = [
            ("Law", Stroke::solid(palette.law, 2.0), &*graph.law),
            ("Trail of the last second", faint, &*graph.trail),
        ];
        self.lines(&frame, lines.into_iter());
        if let Some([velocity, force]) = graph.trail.last() {
            let (x, y, color) = (
                frame.x(*velocity),
                frame.y(*force),
                Stroke::solid(palette.device, 1.0).color,
            );
            if velocity.abs() <= graph.velocities.1 {
                self.add(format_args!(
                    "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"5\" fill=\"{color}\"><title>{dot}</title></circle>"
                ));
            }
        }
    }

    fn ribbon(&mut self, scope: &Scope, frame: &Frame) {
        let palette = Palette::for_paper();
        let seen = scope.seen();
        let column_s = seen.column_s(OVER_TIME.0 * 2.0);
        let contacts = scope.tape().contacts((seen.from_s, seen.to_s), column_s);
        let y = RIBBON / 2.0;
        for run in contact_ribbon::runs(contacts, seen.zero_s) {
            let edges = (frame.corner.0, frame.corner.0 + frame.size.0);
            let [from, to] = [run.from, run.to].map(|t_s| frame.x(t_s).clamp(edges.0, edges.1));
            let (color, what) = if run.slides {
                (palette.sliding, "sliding")
            } else {
                (palette.stuck, "stuck")
            };
            let (color, width) = (Stroke::solid(color, 1.0).color, to - from);
            self.add(format_args!(
                "<rect x=\"{from:.2}\" y=\"{y}\" width=\"{width:.2}\" height=\"{RIBBON}\" fill=\"{color}\"><title>{what}</title></rect>"
            ));
        }
    }

    /// A plot's frame, grid and numbers, with names at its axes; no `across_label` leaves the numbers below it out too.
    fn frame(&mut self, frame: &Frame, across_label: Option<&str>, up_label: &str) {
        let ((left, top), (width, height)) = (frame.corner, frame.size);
        let foot = top + height;
        self.reaches = (self.reaches.0.max(left + width), self.reaches.1.max(foot));
        for (value, text) in marks(frame.up) {
            let (y, x) = (frame.y(value), left - 6.0);
            self.add(format_args!(
                "<path d=\"M{left} {y:.2}h{width}\" stroke=\"#ddd\"/><text x=\"{x}\" y=\"{y:.2}\" text-anchor=\"end\" dominant-baseline=\"middle\">{text}</text>"
            ));
        }
        for (value, text) in marks(frame.across) {
            let (x, below) = (frame.x(value), foot + 16.0);
            self.add(format_args!("<path d=\"M{x:.2} {top}v{height}\" stroke=\"#ddd\"/>"));
            if across_label.is_some() {
                self.add(format_args!(
                    "<text x=\"{x:.2}\" y=\"{below}\" text-anchor=\"middle\">{text}</text>"
                ));
            }
        }
        self.add(format_args!(
            "<rect x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\" fill=\"none\" stroke=\"#888\"/>"
        ));
        let (aside, middle) = (left - 54.0, top + height / 2.0);
        self.add(format_args!(
            "<text transform=\"translate({aside} {middle}) rotate(-90)\" text-anchor=\"middle\">{up_label}</text>"
        ));
        if let Some(label) = across_label {
            let (x, below) = (left + width / 2.0, foot + 34.0);
            self.add(format_args!(
                "<text x=\"{x}\" y=\"{below}\" text-anchor=\"middle\">{label}</text>"
            ));
        }
    }

    /// Lines, and above the plot what each of them is.
    fn lines<'a>(&mut self, frame: &Frame, lines: impl Iterator<Item = (&'a str, Stroke, &'a [[f64; 2]])>) {
        let (mut x, y) = (frame.corner.0 + 8.0, frame.corner.1 - 4.0);
        for (name, Stroke { color, width, opacity }, points) in lines {
            let style = format!("stroke=\"{color}\" stroke-width=\"{width}\" stroke-opacity=\"{opacity}\"");
            for part in frame.within(points) {
                let points = part
                    .iter()
                    .map(|[across, up]| format!("{:.2},{:.2}", frame.x(*across), frame.y(*up)));
                let points = points.collect::<Vec<_>>().join(" ");
                self.add(format_args!(
                    "<polyline fill=\"none\" {style} stroke-linejoin=\"round\" points=\"{points}\"/>"
                ));
            }
            let (key, x_text) = (y - 4.0, x + 22.0);
            self.add(format_args!(
                "<path d=\"M{x} {key}h16\" {style}/><text x=\"{x_text}\" y=\"{y}\">{name}</text>"
            ));
            x += 150.0;
        }
    }
}

/// The numbers of an axis.
fn marks(reach: Reach) -> Vec<(f64, String)> {
    let [_, step, _] = steps(reach, USUAL_COUNT);
    let mut marks = Vec::new();
    let mut mark = (reach.0 / step).ceil() * step;
    while mark <= reach.1 {
        marks.push((mark, number(mark, reach)));
        mark += step;
    }
    marks
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::tests::with_samples;

    #[test]
    fn the_picture_has_every_plot_its_units_and_the_spike() {
        let text = svg(&with_samples());
        for part in [
            "Force (N)",
            "Position (mm)",
            "Velocity (mm/s)",
            "Time from the newest sample (s)",
            "Coupling force",
            ">40<",
        ] {
            assert!(text.contains(part), "{part}");
        }
        assert_eq!(text.matches("<polyline").count(), 6);
        assert!(!text.contains("NaN") && !text.contains("inf"));
        assert!(!text.contains("Block velocity (mm/s)"), "it is not seen");
    }

    #[test]
    fn force_against_velocity_is_in_the_picture_where_it_is_seen() {
        let mut model = with_samples();
        model.plots_seen = &[Shown::OverTime, Shown::ForceVelocity];
        let threshold = [("DV".parse().expect("a parameter"), 0.005)];
        model.scene_mut().in_force = haptic_core::Scene::paper().with(&threshold).ok();
        let text = svg(&model);
        for part in [
            "Block velocity (mm/s)",
            "Time from",
            ">Law<",
            "Trail",
            "<title>DV<",
            ">DV</text>",
            "<title>Now<",
        ] {
            assert!(text.contains(part), "{part}");
        }
        assert!(!text.contains("NaN") && !text.contains("inf"));
        model.plots_seen = &[Shown::ForceVelocity];
        assert!(!svg(&model).contains("Time from"));
    }

    #[test]
    fn an_axis_that_is_held_is_held_in_the_picture() {
        let mut model = with_samples();
        model.scope_mut().value_axes.hold(Quantity::Force, (-1.0, 3.0));
        let text = svg(&model);
        assert!(text.contains(">3<") && !text.contains(">40<"));
        assert_eq!(text.matches("<polyline").count(), 7, "the spike leaves and comes back");
    }

    #[test]
    fn a_line_ends_at_the_edges_of_the_plot() {
        let frame = Frame {
            corner: (0.0, 0.0),
            size: (10.0, 10.0),
            across: (0.5, 2.5),
            up: (-1.0, 8.0),
        };
        let line = [[0.0, 0.0], [1.0, 4.0], [2.0, 12.0], [3.0, 4.0]];
        assert_eq!(
            frame.within(&line),
            [[[0.5, 2.0], [1.0, 4.0], [1.5, 8.0]]],
            "coming back, it only touches the corner"
        );
        assert_eq!(frame.within(&line[..2]), [vec![[0.5, 2.0], [1.0, 4.0]]]);
        assert_eq!(frame.within(&[[0.0, 0.0], [0.2, 0.0]]), Vec::<Vec<[f64; 2]>>::new());
        assert_eq!(
            frame.within(&[[1.0, -5.0], [1.0, 20.0]]),
            [vec![[1.0, -1.0], [1.0, 8.0]]]
        );
    }
}
