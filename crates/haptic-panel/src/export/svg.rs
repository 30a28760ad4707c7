//! A picture as an SVG, in the colours for a white page.

use super::picture::{Group, Picture};
use crate::model::Model;
use crate::model::scope::value_axis::Reach;
use crate::plots::axis::{DEFAULT_COUNT, marks, number};
use crate::plots::chart::{Chart, Curve, Ink, Overlay};
use crate::plots::contact_ribbon::Run;
use crate::plots::labels::Labels;
use crate::theme::Palette;
use egui::{Color32, Rect, Vec2, pos2, vec2};
use std::fmt::Write as _;

/// Size of a plot over time, px.
const OVER_TIME: (f64, f64) = (800.0, 220.0);

/// Size of force against velocity, px.
const FORCE_VELOCITY: (f64, f64) = (480.0, 440.0);

/// Room for the numbers and names at a plot's left, right, top and bottom, px.
const MARGINS: (f64, f64, f64, f64) = (70.0, 20.0, 34.0, 40.0);

/// Room for a letter of a label, px.
const LETTER: Vec2 = vec2(7.0, 14.0);

/// Height of the contact ribbon, px.
const RIBBON: f64 = 8.0;

/// The plots in sight as an SVG.
#[must_use]
pub fn svg(model: &Model) -> String {
    Picture::seen(model).svg()
}

impl Picture {
    /// The picture as an SVG.
    pub(crate) fn svg(&self) -> String {
        let (left, right, top, bottom) = MARGINS;
        let mut drawing = Drawing::default();
        let mut x = 0.0;
        for group in &self.0 {
            match group {
                Group::OverTime { charts, contacts } => {
                    drawing.over_time(charts, contacts, x + left);
                    x += left + OVER_TIME.0 + right;
                }
                Group::Single(chart) => {
                    let frame = Frame::of(chart, (x + left, top), FORCE_VELOCITY);
                    drawing.chart(chart, &frame, true);
                    x += left + FORCE_VELOCITY.0 + right;
                }
            }
        }
        drawing.end(right, bottom)
    }
}

/// The place of a plot in the picture, px, and the ranges of its axes.
struct Frame {
    corner: (f64, f64),
    size: (f64, f64),
    across: Reach,
    up: Reach,
}

impl Frame {
    fn of(chart: &Chart, corner: (f64, f64), size: (f64, f64)) -> Self {
        Self {
            corner,
            size,
            across: chart.across,
            up: chart.up,
        }
    }

    fn x(&self, value: f64) -> f64 {
        let (low, high) = self.across;
        self.corner.0 + self.size.0 * (value - low) / (high - low)
    }

    fn y(&self, value: f64) -> f64 {
        let (low, high) = self.up;
        self.corner.1 + self.size.1 * (high - value) / (high - low)
    }

    /// Its inner part, px.
    fn area(&self) -> Rect {
        let corner = pos2(points(self.corner.0), points(self.corner.1));
        Rect::from_min_size(corner, vec2(points(self.size.0), points(self.size.1)))
    }

    /// The parts of a line within the frame, cut at its edges: not every program can clip.
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

/// The part of a straight line within a box, after Liang and Barsky (1984); `None` outside of it.
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

/// A length of the picture, to place labels by.
#[expect(clippy::cast_possible_truncation, reason = "pixels of a picture")]
const fn points(px: f64) -> f32 {
    px as f32
}

/// Room for a label, px: the font is that of the reader, and a usual letter of it is less wide than high.
fn size(label: &str) -> Vec2 {
    #[expect(clippy::cast_precision_loss, reason = "a label has few letters")]
    let letters = label.chars().count() as f32;
    vec2(LETTER.x * (letters + 1.0), LETTER.y)
}

/// A colour as SVG writes it.
fn hex(color: fn(&Palette) -> Color32) -> String {
    let color = color(Palette::for_paper());
    format!("#{:02x}{:02x}{:02x}", color.r(), color.g(), color.b())
}

/// The attributes of a line.
fn style(ink: &Ink) -> String {
    let Ink { color, width, opacity } = ink;
    let color = hex(*color);
    format!("stroke=\"{color}\" stroke-width=\"{width}\" stroke-opacity=\"{opacity}\"")
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
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" \
             viewBox=\"0 0 {width} {height}\" font-family=\"sans-serif\" font-size=\"12\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n{}</svg>\n",
            self.text
        )
    }

    fn add(&mut self, element: std::fmt::Arguments<'_>) {
        self.text.write_fmt(element).unwrap_or(());
        self.text.push('\n');
    }

    fn over_time(&mut self, charts: &[Chart], contacts: &[Run], left: f64) {
        let mut y = 0.0;
        for (place, chart) in charts.iter().enumerate() {
            y += MARGINS.2;
            let frame = Frame::of(chart, (left, y), OVER_TIME);
            if place == 0 {
                self.ribbon(contacts, &frame);
            }
            self.chart(chart, &frame, place + 1 == charts.len());
            y += OVER_TIME.1;
        }
    }

    /// A chart. Without numbers at the horizontal axis, another one below it has them.
    fn chart(&mut self, chart: &Chart, frame: &Frame, has_across_numbers: bool) {
        let [across, up] = &chart.labels;
        self.frame(frame, has_across_numbers.then_some(across), up);
        let mut labels = Labels::new(frame.area());
        for overlay in &chart.overlays {
            match overlay {
                Overlay::Level { value, label, ink } => self.level(frame, &mut labels, *value, label, ink),
                Overlay::Mark {
                    at,
                    label,
                    is_dashed,
                    ink,
                } => self.mark(frame, &mut labels, (*at, label, *is_dashed), ink),
                Overlay::Curve(_) | Overlay::Dots { .. } => {}
            }
        }
        self.curves(frame, chart.under().chain(&chart.curves));
        for overlay in &chart.overlays {
            if let Overlay::Dots {
                name,
                at,
                radius,
                color,
            } = overlay
            {
                for at in at {
                    self.dot(frame, name, *at, *radius, *color);
                }
            }
        }
    }

    fn level(&mut self, frame: &Frame, labels: &mut Labels, value: f64, label: &str, ink: &Ink) {
        if !within(value, frame.up) {
            return;
        }
        let (x, y, width, style) = (frame.corner.0, frame.y(value), frame.size.0, style(ink));
        self.add(format_args!(
            "<path d=\"M{x:.2} {y:.2}h{width}\" {style} stroke-dasharray=\"6 4\"/>"
        ));
        if !label.is_empty() {
            self.label(
                labels.at_level(points(y), points(frame.y(0.0)), size(label)),
                label,
                ink,
            );
        }
    }

    fn mark(&mut self, frame: &Frame, labels: &mut Labels, (at, label, is_dashed): (f64, &str, bool), ink: &Ink) {
        if !within(at, frame.across) {
            return;
        }
        let (x, y, height, style) = (frame.x(at), frame.corner.1, frame.size.1, style(ink));
        let dashes = if is_dashed { " stroke-dasharray=\"6 4\"" } else { "" };
        let title = escaped(label);
        self.add(format_args!(
            "<path d=\"M{x:.2} {y}v{height}\" {style}{dashes}><title>{title}</title></path>"
        ));
        if !label.is_empty() {
            self.label(labels.at_mark(points(x), points(frame.x(0.0)), size(label)), label, ink);
        }
    }

    /// A label at its place, if it has found one.
    fn label(&mut self, place: Option<Rect>, label: &str, ink: &Ink) {
        let Some(place) = place else { return };
        let (x, y) = (place.center().x, place.center().y);
        let (color, label) = (hex(ink.color), escaped(label));
        self.add(format_args!(
            "<text x=\"{x:.2}\" y=\"{y:.2}\" text-anchor=\"middle\" dominant-baseline=\"central\" \
             fill=\"{color}\">{label}</text>"
        ));
    }

    fn dot(&mut self, frame: &Frame, name: &str, [across, up]: [f64; 2], radius: f32, color: fn(&Palette) -> Color32) {
        if !within(across, frame.across) || !within(up, frame.up) {
            return;
        }
        let (x, y, color) = (frame.x(across), frame.y(up), hex(color));
        self.add(format_args!(
            "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"{radius}\" fill=\"{color}\"><title>{name}</title></circle>"
        ));
    }

    fn ribbon(&mut self, contacts: &[Run], frame: &Frame) {
        let y = RIBBON / 2.0;
        for run in contacts {
            let edges = (frame.corner.0, frame.corner.0 + frame.size.0);
            let [from, to] = [run.from, run.to].map(|t_s| frame.x(t_s).clamp(edges.0, edges.1));
            let (color, what) = if run.slides {
                (hex(|palette| palette.sliding), "sliding")
            } else {
                (hex(|palette| palette.stuck), "stuck")
            };
            let width = to - from;
            self.add(format_args!(
                "<rect x=\"{from:.2}\" y=\"{y}\" width=\"{width:.2}\" height=\"{RIBBON}\" \
                 fill=\"{color}\"><title>{what}</title></rect>"
            ));
        }
    }

    /// A plot's frame, grid, numbers and the names of its axes. Without `across_label` there are no numbers
    /// below it.
    fn frame(&mut self, frame: &Frame, across_label: Option<&String>, up_label: &str) {
        let ((left, top), (width, height)) = (frame.corner, frame.size);
        let foot = top + height;
        self.reaches = (self.reaches.0.max(left + width), self.reaches.1.max(foot));
        for (value, text) in numbers(frame.up) {
            let (y, x) = (frame.y(value), left - 6.0);
            self.add(format_args!(
                "<path d=\"M{left} {y:.2}h{width}\" stroke=\"#ddd\"/>\
                 <text x=\"{x}\" y=\"{y:.2}\" text-anchor=\"end\" dominant-baseline=\"middle\">{text}</text>"
            ));
        }
        for (value, text) in numbers(frame.across) {
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

    /// Lines, and their key above the plot.
    fn curves<'a>(&mut self, frame: &Frame, curves: impl Iterator<Item = &'a Curve>) {
        let (mut x, y) = (frame.corner.0 + 8.0, frame.corner.1 - 4.0);
        for Curve { name, points, ink, .. } in curves {
            let style = style(ink);
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
                "<path d=\"M{x} {key}h16\" {style}/><text x=\"{x_text}\" y=\"{y}\">{}</text>",
                escaped(name)
            ));
            x += 150.0;
        }
    }
}

/// A text that may hold anything, as XML.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Whether a value lies in a range.
fn within(value: f64, (low, high): Reach) -> bool {
    (low..=high).contains(&value)
}

/// The numbers of an axis.
fn numbers(reach: Reach) -> impl Iterator<Item = (f64, String)> {
    marks(reach, DEFAULT_COUNT).map(move |mark| (mark, number(mark, reach)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::fixture::with_samples;
    use crate::model::view::PlotGroup;

    #[test]
    fn the_picture_has_every_plot_its_units_and_the_spike() {
        let text = svg(&with_samples());
        for part in [
            "Force (N)",
            "Position (mm)",
            "Velocity (mm/s)",
            "Time from the newest sample (s)",
            "Force on the hand",
            ">40<",
        ] {
            assert!(text.contains(part), "{part}");
        }
        assert_eq!(text.matches("<polyline").count(), 5);
        assert!(!text.contains("NaN") && !text.contains("inf"));
        assert!(!text.contains("Block velocity (mm/s)"), "it is not seen");
    }

    #[test]
    fn force_against_velocity_is_in_the_picture_where_it_is_seen() {
        let mut model = with_samples();
        model.view.layout.drawn = vec![PlotGroup::OverTime, PlotGroup::ForceVelocity];
        let threshold = [("DV".parse().expect("a parameter"), 0.005)];
        model.daemon.scene.active = haptic_core::Scene::paper().with(&threshold).ok();
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
        model.view.layout.drawn = vec![PlotGroup::ForceVelocity];
        assert!(!svg(&model).contains("Time from"));
    }

    #[test]
    fn an_axis_that_is_held_is_held_in_the_picture() {
        let mut model = with_samples();
        model.view.scope.plots.plots_mut()[0].axis.hold((-1.0, 3.0));
        let text = svg(&model);
        assert!(text.contains(">3<") && !text.contains(">40<"));
        assert_eq!(text.matches("<polyline").count(), 6, "the spike leaves and comes back");
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
