//! Charts as SVG. Colours and lines stand in a style sheet, which a dark ground changes.

use super::axis::Scale;
use super::chart::{Chart, Form, Trace};
use std::collections::HashSet;
use std::fmt::{Arguments, Write as _};

/// Width of an image, px.
const WIDTH: f64 = 760.0;
/// Room for the numbers and names of the axes, px.
const LEFT: f64 = 72.0;
const RIGHT: f64 = 18.0;
const BOTTOM: f64 = 50.0;
/// Height of a line of text, px.
const LINE: f64 = 18.0;
/// Width of a letter, px; about, as the reader's font decides.
const LETTER: f64 = 7.0;

/// Styles of a chart. The colours are those of Okabe and Ito (2008), which people with any colour
/// vision distinguish; on dark ground the lighter ones.
pub(super) const STYLE: &str = "\
.chart{font:12px sans-serif}.chart text{fill:#1b1b1b}.chart .ground{fill:#fff}.chart \
.grid{stroke:#ddd;fill:none}.chart .frame{stroke:#888;fill:none}\
.chart .line,.chart .dashed{fill:none;stroke-width:1.6;stroke-linejoin:round}.chart .dashed{stroke-dasharray:7 4}\
.chart .dots{fill:none;stroke-width:3;stroke-linecap:round;stroke-opacity:.4}\
.chart .t0{stroke:#0072b2}.chart .t1{stroke:#d55e00}.chart .t2{stroke:#009e73}.chart .t3{stroke:#cc79a7}.chart \
.t4{stroke:#1b1b1b}\
@media (prefers-color-scheme:dark){.chart text{fill:#e6e6e6}.chart .ground{fill:#16181b}.chart .grid{stroke:#3a3d42}\
.chart .t0{stroke:#56b4e9}.chart .t1{stroke:#e69f00}.chart .t4{stroke:#e6e6e6}}";
/// Colours above.
const COLOURS: usize = 5;

/// Charts below one another as an image of its own.
#[must_use]
pub fn svg(charts: &[Chart]) -> String {
    let height: f64 = charts.iter().map(height).sum();
    let mut image = String::new();
    let titles: Vec<&str> = charts.iter().map(|chart| chart.title.as_str()).collect();
    add(
        &mut image,
        format_args!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" viewBox=\"0 0 {WIDTH} \
             {height}\" role=\"img\" aria-label=\"{}\">\n<style>{STYLE}</style>",
            escaped(&titles.join("; "))
        ),
    );
    let mut top = 0.0;
    for chart in charts {
        draw(&mut image, chart, top);
        top += self::height(chart);
    }
    image.push_str("</svg>\n");
    image
}

/// A chart within a page that has the [`STYLE`].
pub(super) fn inline(chart: &Chart) -> String {
    let (height, mut image) = (height(chart), String::new());
    add(
        &mut image,
        format_args!(
            "<svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{}\">",
            escaped(&chart.title)
        ),
    );
    draw(&mut image, chart, 0.0);
    image.push_str("</svg>\n");
    image
}

/// Text as HTML and SVG take it.
pub(super) fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

fn add(image: &mut String, text: Arguments<'_>) {
    // A string takes whatever is written to it.
    writeln!(image, "{text}").unwrap_or(());
}

fn head(chart: &Chart) -> f64 {
    let rows = legend(chart).last().map_or(0.0, |(_, row, _)| row + 1.0);
    LINE * (1.0 + rows) + 14.0
}

fn height(chart: &Chart) -> f64 {
    head(chart) + chart.height_px + BOTTOM
}

/// Places of the traces in the legend, but for those without a name: left edge, row and the trace's index.
fn legend(chart: &Chart) -> Vec<(f64, f64, usize)> {
    let (mut x, mut row) = (LEFT, 0.0);
    let mut places = Vec::new();
    let named = |(_, trace): &(usize, &Trace)| !trace.name.is_empty();
    for (index, trace) in chart.traces.iter().enumerate().filter(named) {
        #[expect(clippy::cast_precision_loss, reason = "letters of a name")]
        let width = 44.0 + LETTER * trace.name.chars().count() as f64;
        if x > LEFT && x + width > WIDTH - RIGHT {
            (x, row) = (LEFT, row + 1.0);
        }
        places.push((x, row, index));
        x += width;
    }
    places
}

fn draw(image: &mut String, chart: &Chart, top: f64) {
    let size = (WIDTH - LEFT - RIGHT, chart.height_px);
    let corner = (LEFT, top + head(chart));
    let values = |axis: usize| {
        chart
            .traces
            .iter()
            .flat_map(move |trace| trace.points.iter().map(move |point| point[axis]))
    };
    let across = Scale::new(&chart.across, values(0), (0.0, size.0));
    let up = Scale::new(&chart.up, values(1), (size.1, 0.0));
    add(
        image,
        format_args!(
            "<g class=\"chart\"><rect class=\"ground\" x=\"0\" y=\"{top}\" width=\"{WIDTH}\" height=\"{}\"/>\n\
             <text x=\"{LEFT}\" y=\"{}\" font-weight=\"bold\">{}</text>",
            height(chart),
            top + LINE,
            escaped(&chart.title)
        ),
    );
    for (x, row, index) in legend(chart) {
        let (trace, y) = (&chart.traces[index], top + LINE * (2.2 + row));
        let sample = if trace.form == Form::Dots {
            "m8 0h0m6 0h0m6 0h0"
        } else {
            "h26"
        };
        add(
            image,
            format_args!(
                "<path class=\"{}\" d=\"M{x} {:.1}{sample}\"/><text x=\"{}\" y=\"{y:.1}\">{}</text>",
                class(trace, index),
                y - 4.0,
                x + 32.0,
                escaped(&trace.name)
            ),
        );
    }
    axes(image, chart, (&across, &up), corner);
    // An inner image is cut at its edges.
    add(
        image,
        format_args!(
            "<svg x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\">",
            corner.0, corner.1, size.0, size.1
        ),
    );
    for (index, trace) in chart.traces.iter().enumerate() {
        let points: Vec<[f64; 2]> = trace.points.iter().map(|[x, y]| [across.px(*x), up.px(*y)]).collect();
        let path = match trace.form {
            Form::Dots => dots(&points),
            Form::Line | Form::Dashed => lines(&points),
        };
        add(
            image,
            format_args!(
                "<path class=\"{}\" d=\"{path}\"><title>{}</title></path>",
                class(trace, index),
                escaped(&trace.name)
            ),
        );
    }
    image.push_str("</svg></g>\n");
}

fn class(trace: &Trace, index: usize) -> String {
    let form = match trace.form {
        Form::Line => "line",
        Form::Dashed => "dashed",
        Form::Dots => "dots",
    };
    format!("{form} t{}", trace.colour.unwrap_or(index) % COLOURS)
}

fn axes(image: &mut String, chart: &Chart, (across, up): (&Scale, &Scale), (left, top): (f64, f64)) {
    let (right, foot) = (WIDTH - RIGHT, top + chart.height_px);
    for (value, text) in up.marks() {
        let y = top + up.px(value);
        add(
            image,
            format_args!(
                "<path class=\"grid\" d=\"M{left} {y:.1}H{right}\"/><text x=\"{}\" y=\"{:.1}\" \
                 text-anchor=\"end\">{text}</text>",
                left - 6.0,
                y + 4.0
            ),
        );
    }
    for (value, text) in across.marks() {
        let x = left + across.px(value);
        add(
            image,
            format_args!(
                "<path class=\"grid\" d=\"M{x:.1} {top}V{foot}\"/><text x=\"{x:.1}\" y=\"{}\" \
                 text-anchor=\"middle\">{text}</text>",
                foot + 16.0
            ),
        );
    }
    let (middle_x, middle_y) = (0.5 * (left + right), 0.5 * (top + foot));
    add(
        image,
        format_args!(
            "<rect class=\"frame\" x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\"/>\
             <text x=\"{middle_x}\" y=\"{}\" text-anchor=\"middle\">{}</text>\
             <text transform=\"translate(16 {middle_y}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            right - left,
            chart.height_px,
            foot + 34.0,
            escaped(&chart.across.label),
            escaped(&chart.up.label)
        ),
    );
}

/// A dot for each place that has one: many samples fall on one. A dot is 3 px wide, so that places 2 px
/// apart leave no gap.
fn dots(points: &[[f64; 2]]) -> String {
    let mut seen = HashSet::new();
    let mut path = String::new();
    for [x, y] in points.iter().filter(|point| is_drawable(point)) {
        #[expect(clippy::cast_possible_truncation, reason = "pixels")]
        let place = (2 * (0.5 * x).round() as i64, 2 * (0.5 * y).round() as i64);
        if seen.insert(place) {
            write!(path, "M{} {}h0", place.0, place.1).unwrap_or(());
        }
    }
    path
}

/// Lines, interrupted at points that are not finite.
fn lines(points: &[[f64; 2]]) -> String {
    let mut path = String::new();
    for part in points.split(|point| !is_drawable(point)) {
        for (index, [x, y]) in decimated(part).into_iter().enumerate() {
            let step = if index == 0 { 'M' } else { 'L' };
            write!(path, "{step}{x:.1} {y:.1}").unwrap_or(());
        }
    }
    path
}

/// A number that programs for images can take.
fn is_drawable([x, y]: &[f64; 2]) -> bool {
    x.abs() <= 1e6 && y.abs() <= 1e6
}

/// The points that a drawing shows. Where a line only runs to the right, these are the first, the
/// lowest, the highest and the last of each column of pixels; elsewhere, those half a pixel apart.
fn decimated(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let goes_right = points.windows(2).all(|pair| pair[1][0] >= pair[0][0]);
    let mut kept: Vec<[f64; 2]> = Vec::new();
    if goes_right {
        for column in points.chunk_by(|a, b| a[0].floor() == b[0].floor()) {
            let by_height = |&a: &usize, &b: &usize| column[a][1].total_cmp(&column[b][1]);
            let extremes = [(0..column.len()).min_by(by_height), (0..column.len()).max_by(by_height)];
            let mut wanted: Vec<usize> = extremes.into_iter().flatten().chain([0, column.len() - 1]).collect();
            wanted.sort_unstable();
            wanted.dedup();
            kept.extend(wanted.into_iter().map(|index| column[index]));
        }
    } else {
        for (index, point) in points.iter().enumerate() {
            let is_apart = kept
                .last()
                .is_none_or(|last| (point[0] - last[0]).hypot(point[1] - last[1]) >= 0.5);
            if is_apart || index + 1 == points.len() {
                kept.push(*point);
            }
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(points: Vec<[f64; 2]>) -> Chart {
        Chart::new("F & v", "Velocity (m/s)", "Force (N)").with(Trace::line("a < b", points))
    }

    #[test]
    fn a_chart_has_its_names_units_and_traces_and_both_grounds() {
        let two = chart(vec![[0.0, 0.0], [1.0, 2.0]]).with(Trace::dots("measured", vec![[0.5, 1.0]]));
        let text = svg(&[two.clone(), two]);
        for part in [
            "F &amp; v",
            "Velocity (m/s)",
            "Force (N)",
            "a &lt; b",
            "prefers-color-scheme:dark",
        ] {
            assert!(text.contains(part), "{part}");
        }
        assert_eq!(text.matches("<title>measured</title>").count(), 2);
        assert_eq!(text.matches("<svg").count(), text.matches("</svg>").count());
        assert!(!text.contains("NaN") && !text.contains("inf"));
    }

    #[test]
    fn the_legend_stands_above_the_plot_and_takes_a_second_row() {
        let mut many = chart(vec![[0.0, 0.0]]);
        for index in 0..9 {
            many = many.with(Trace::line(format!("a trace with a long name {index}"), Vec::new()));
        }
        let rows = legend(&many);
        assert_eq!(legend(&many.clone().with(Trace::line("", Vec::new()))), rows);
        assert!(rows.iter().all(|(x, ..)| *x < WIDTH - RIGHT - 100.0));
        let lowest = LINE * (2.2 + rows.last().expect("a place").1);
        assert!(
            lowest >= 4.0 * LINE && lowest < head(&many),
            "{lowest} of {}",
            head(&many)
        );
    }

    #[test]
    fn a_line_is_interrupted_where_a_value_is_missing() {
        let text = lines(&[[0.0, 0.0], [1.0, 1.0], [2.0, f64::NAN], [3.0, 1.0], [4.0, 0.0]]);
        assert_eq!(text, "M0.0 0.0L1.0 1.0M3.0 1.0L4.0 0.0");
    }

    #[test]
    fn trace_colour_follows_its_index_or_its_partner() {
        let traces = [Trace::dots("a", Vec::new()), Trace::line("b", Vec::new()).in_colour(0)];
        let classes = [class(&traces[0], 0), class(&traces[1], 1)];
        assert_eq!(classes, ["dots t0", "line t0"]);
    }

    #[test]
    fn a_long_line_keeps_its_spikes_and_little_else() {
        let mut points: Vec<[f64; 2]> = (0..100_000).map(|k| [f64::from(k) * 7e-3, f64::from(k % 7)]).collect();
        points[54_321][1] = 250.0;
        let kept = decimated(&points);
        assert!(kept.len() < 2900, "{}", kept.len());
        assert!(kept.iter().any(|point| point[1] == 250.0));
        assert_eq!((kept[0], kept[kept.len() - 1]), (points[0], points[99_999]));
        let round: Vec<[f64; 2]> = (0..100_000)
            .map(|k| [100.0 * f64::from(k).cos(), 100.0 * f64::from(k).sin()])
            .collect();
        let slow: Vec<[f64; 2]> = (0..100_000)
            .map(|k| [100.0 * (f64::from(k) * 1e-4).cos(), 100.0 * (f64::from(k) * 1e-4).sin()])
            .collect();
        assert!(decimated(&slow).len() < 2100, "{}", decimated(&slow).len());
        assert!(dots(&round).matches('M').count() < 450);
    }
}
