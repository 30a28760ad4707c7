//! Charts as SVG. Colours and lines stand in a style sheet, which a dark ground changes.

use super::axis::Scale;
use super::chart::{Axis, Chart, Form, Trace};
use super::paths::{discs, dots, lines};

/// Width of an image, px.
const WIDTH: f64 = 760.0;
/// Room for the numbers and names of the axes, px.
const LEFT: f64 = 72.0;
const RIGHT: f64 = 18.0;
/// Width of a plot in an image, px; of one whose points have names it is less.
pub const PLOT_WIDTH_PX: f64 = WIDTH - LEFT - RIGHT;
/// Room to the right of a plot whose points have names, px.
const LABELS: f64 = 210.0;
pub(super) const BOTTOM: f64 = 50.0;
/// Height of a line of text, px.
const LINE: f64 = 18.0;
/// Width of a letter, px; about, as the reader's font decides.
const LETTER: f64 = 7.0;
/// The same of a title, which is bold.
const BOLD_LETTER: f64 = 8.5;

/// Room for a number at the horizontal and at the vertical axis, px.
const MARK_ROOM: [f64; 2] = [45.0, 12.0];

/// Styles of a chart. The colours are those of Okabe and Ito (2008), which people with any colour
/// vision distinguish.
const LIGHT: &str = "\
.chart{font:12px sans-serif}.chart text{fill:#1b1b1b}.chart .ground{fill:#fff}.chart \
.grid{stroke:#ddd;fill:none}.chart .frame{stroke:#888;fill:none}\
.chart .line,.chart .dashed{fill:none;stroke-width:1.6;stroke-linejoin:round}.chart .dashed{stroke-dasharray:7 4}\
.chart .dots{fill:none;stroke-width:3;stroke-linecap:round;stroke-opacity:.4}\
.chart .t0{stroke:#0072b2}.chart .t1{stroke:#d55e00}.chart .t2{stroke:#009e73}.chart .t3{stroke:#cc79a7}.chart \
.t4{stroke:#1b1b1b}";
/// On dark ground: the lighter ones.
const DARK: &str = "@media (prefers-color-scheme:dark){.chart text{fill:#e6e6e6}.chart .ground{fill:#16181b}.chart .grid{stroke:#3a3d42}\
.chart .t0{stroke:#56b4e9}.chart .t1{stroke:#e69f00}.chart .t4{stroke:#e6e6e6}}";
/// Styles of discs, error bars and notes.
const LIGHT_DISCS: &str = "\
.chart .disc{fill-opacity:.5;stroke-width:1.2}.chart .bar{fill:none;stroke-width:1.2}.chart .note{font-style:italic}\
.chart .disc.t0{fill:#0072b2}.chart .disc.t1{fill:#d55e00}.chart .disc.t2{fill:#009e73}.chart .disc.t3{fill:#cc79a7}\
.chart .disc.t4{fill:#1b1b1b}";
const DARK_DISCS: &str = "@media (prefers-color-scheme:dark){.chart .disc.t0{fill:#56b4e9}.chart .disc.t1{fill:#e69f00}\
.chart .disc.t4{fill:#e6e6e6}}";
/// Style of moments.
const MARKS: &str = ".chart .mark{fill:none;stroke-width:.8;stroke-opacity:.5}";
/// Colours above.
const COLOURS: usize = 5;

/// The styles that charts need, on light ground alone or on both.
pub(super) fn style(charts: &[Chart], on_dark_too: bool) -> String {
    let has_discs = |chart: &Chart| {
        let mut traces = chart.traces.iter();
        !chart.notes.is_empty() || traces.any(|trace| trace.form == Form::Discs)
    };
    let has_discs = charts.iter().any(has_discs);
    let mut traces = charts.iter().flat_map(|chart| &chart.traces);
    let has_marks = traces.any(|trace| trace.form == Form::Mark);
    [
        (LIGHT, true),
        (LIGHT_DISCS, has_discs),
        (MARKS, has_marks),
        (DARK, on_dark_too),
        (DARK_DISCS, on_dark_too && has_discs),
    ]
    .into_iter()
    .filter_map(|(style, is_needed)| is_needed.then_some(style))
    .collect()
}

/// Charts below one another as an image of its own.
#[must_use]
pub fn svg(charts: &[Chart]) -> String {
    let height_of = |chart: &Chart| height(chart, WIDTH);
    let (height, style): (f64, String) = (charts.iter().map(height_of).sum(), style(charts, true));
    let mut image = String::new();
    let titles: Vec<&str> = charts.iter().map(|chart| chart.title.as_str()).collect();
    image.push_str(&format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" viewBox=\"0 0 {WIDTH} \
             {height}\" role=\"img\" aria-label=\"{}\">\n<style>{style}</style>\n",
        escaped(&titles.join("; "))
    ));
    let mut top = 0.0;
    for chart in charts {
        draw(&mut image, chart, WIDTH, top);
        top += height_of(chart);
    }
    image.push_str("</svg>\n");
    image
}

/// A chart within a page that has its [`style`].
pub(super) fn inline(chart: &Chart) -> String {
    let (height, mut image) = (height(chart, WIDTH), String::new());
    image.push_str(&format!(
        "<svg viewBox=\"0 0 {WIDTH} {height}\" role=\"img\" aria-label=\"{}\">\n",
        escaped(&chart.title)
    ));
    draw(&mut image, chart, WIDTH, 0.0);
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

/// Rows of the legend.
fn legend_rows(chart: &Chart, width: f64) -> f64 {
    legend(chart, width).last().map_or(0.0, |(_, row, _)| row + 1.0)
}

/// A text in lines from the plot's left edge to the image's right one.
fn lines_over_plot(text: &str, width: f64, letter: f64) -> Vec<String> {
    #[expect(clippy::cast_sign_loss, reason = "letters of a line")]
    let letters = ((width - LEFT - RIGHT) / letter).max(1.0) as usize;
    wrapped(text, letters)
}

fn title_lines(chart: &Chart, width: f64) -> Vec<String> {
    lines_over_plot(&chart.title, width, BOLD_LETTER)
}

fn note_lines(chart: &Chart, width: f64) -> Vec<String> {
    let notes = chart.notes.iter();
    notes.flat_map(|note| lines_over_plot(note, width, LETTER)).collect()
}

/// Foot of the first line of the legend below the upper edge, px.
fn legend_foot(chart: &Chart, width: f64) -> f64 {
    LINE * (1.2 + title_lines(chart, width).len() as f64)
}

/// Height of what stands above the plot, px.
pub(super) fn head(chart: &Chart, width: f64) -> f64 {
    let lines = title_lines(chart, width).len() + note_lines(chart, width).len();
    LINE * (lines as f64 + legend_rows(chart, width)) + 14.0
}

fn height(chart: &Chart, width: f64) -> f64 {
    head(chart, width) + chart.height_px + BOTTOM
}

/// Places of the traces in the legend, but for those without a name: left edge, row and the trace's index.
fn legend(chart: &Chart, image_width: f64) -> Vec<(f64, f64, usize)> {
    let (mut x, mut row) = (LEFT, 0.0);
    let mut places = Vec::new();
    let named = |(_, trace): &(usize, &Trace)| !trace.name.is_empty();
    for (index, trace) in chart.traces.iter().enumerate().filter(named) {
        let width = 44.0 + LETTER * trace.name.chars().count() as f64;
        if x > LEFT && x + width > image_width - RIGHT {
            (x, row) = (LEFT, row + 1.0);
        }
        places.push((x, row, index));
        x += width;
    }
    places
}

/// Draws a chart of a width with its upper edge at `top`, px.
pub(super) fn draw(image: &mut String, chart: &Chart, width: f64, top: f64) {
    let has_labels = chart.traces.iter().any(|trace| !trace.labels.is_empty());
    let size = (width - LEFT - if has_labels { LABELS } else { RIGHT }, chart.height_px);
    let corner = (LEFT, top + head(chart, width));
    let scaled = |value: f64| if chart.is_logarithmic { value.log10() } else { value };
    let range = |axis: &Axis| axis.range.map(|(low, high)| (scaled(low), scaled(high)));
    let values = |axis: usize| {
        let points = chart.traces.iter().flat_map(|trace| &trace.points);
        points.map(move |point| scaled(point[axis]))
    };
    let across = Scale::new(range(&chart.across), values(0), (0.0, size.0));
    let bars = chart
        .traces
        .iter()
        .flat_map(|trace| trace.bars.iter().flatten())
        .flatten();
    let ends = values(1).chain(bars.map(|end| scaled(*end)));
    let up = Scale::new(range(&chart.up), ends, (size.1, 0.0));
    let place = |[x, y]: &[f64; 2]| [across.px(scaled(*x)), up.px(scaled(*y))];
    image.push_str(&format!(
        "<g class=\"chart\"><rect class=\"ground\" x=\"0\" y=\"{top}\" width=\"{width}\" height=\"{}\"/>\n",
        height(chart, width)
    ));
    let mut y = top;
    for line in title_lines(chart, width) {
        y += LINE;
        let line = escaped(&line);
        image.push_str(&format!(
            "<text x=\"{LEFT}\" y=\"{y}\" font-weight=\"bold\">{line}</text>\n"
        ));
    }
    let legend_foot = top + legend_foot(chart, width);
    for (x, row, index) in legend(chart, width) {
        let (trace, y) = (&chart.traces[index], legend_foot + LINE * row);
        let (class, middle) = (class(trace, index), y - 4.0);
        let sample = match trace.form {
            Form::Discs => format!(
                "<circle class=\"{class}\" cx=\"{}\" cy=\"{middle:.1}\" r=\"5\"/>",
                x + 14.0
            ),
            Form::Dots => format!("<path class=\"{class}\" d=\"M{x} {middle:.1}m8 0h0m6 0h0m6 0h0\"/>"),
            Form::Line | Form::Dashed | Form::Mark => format!("<path class=\"{class}\" d=\"M{x} {middle:.1}h26\"/>"),
        };
        let name = escaped(&trace.name);
        image.push_str(&format!(
            "{sample}<text x=\"{}\" y=\"{y:.1}\">{name}</text>\n",
            x + 32.0
        ));
    }
    let mut y = legend_foot + LINE * legend_rows(chart, width);
    for line in note_lines(chart, width) {
        let line = escaped(&line);
        image.push_str(&format!(
            "<text class=\"note\" x=\"{LEFT}\" y=\"{y:.1}\">{line}</text>\n"
        ));
        y += LINE;
    }
    axes(image, chart, (&across, &up), corner, size.0);
    // An inner image is cut at its edges.
    image.push_str(&format!(
        "<svg x=\"{}\" y=\"{}\" width=\"{}\" height=\"{}\">\n",
        corner.0, corner.1, size.0, size.1
    ));
    let most = chart.traces.iter().flat_map(|trace| trace.counts.iter().copied());
    let most = most.max().unwrap_or(1);
    for (index, trace) in chart.traces.iter().enumerate() {
        let (class, name) = (class(trace, index), escaped(&trace.name));
        let points: Vec<[f64; 2]> = trace.points.iter().map(place).collect();
        let path = match trace.form {
            Form::Discs => {
                let bars = trace
                    .bars
                    .iter()
                    .map(|bar| bar.map(|ends| ends.map(|end| up.px(scaled(end)))));
                let discs = discs(&points, &bars.collect::<Vec<_>>(), (&trace.counts, most), &class);
                image.push_str(&format!("<g><title>{name}</title>{discs}</g>\n"));
                continue;
            }
            Form::Dots => dots(&points),
            Form::Line | Form::Dashed | Form::Mark => lines(&points),
        };
        image.push_str(&format!(
            "<path class=\"{class}\" d=\"{path}\"><title>{name}</title></path>\n"
        ));
    }
    image.push_str("</svg>");
    for (index, trace) in chart.traces.iter().enumerate() {
        let labelled = trace.points.iter().map(place).zip(&trace.labels);
        let colour = trace.colour.unwrap_or(index) % COLOURS;
        labels(image, labelled.collect(), &format!("line t{colour}"), corner, size);
    }
    image.push_str("</g>\n");
}

/// The names of points to the right of the plot, from top to bottom as the points, with a line to each.
fn labels(
    image: &mut String,
    mut labelled: Vec<([f64; 2], &String)>,
    class: &str,
    (left, top): (f64, f64),
    (width, height): (f64, f64),
) {
    labelled.sort_by(|([a_x, a_y], _), ([b_x, b_y], _)| a_y.total_cmp(b_y).then(a_x.total_cmp(b_x)));
    let mut places: Vec<f64> = Vec::new();
    for ([_, y], _) in &labelled {
        places.push(places.last().map_or(0.0, |last| last + LINE).max(*y));
    }
    // What would end below the plot moves up.
    let mut lowest = height;
    for place in places.iter_mut().rev() {
        *place = place.min(lowest);
        lowest = *place - LINE;
    }
    for (([x, y], label), place) in labelled.into_iter().zip(places) {
        let (x, y, edge, place) = (left + x, top + y, left + width, top + place);
        image.push_str(&format!(
            "<path class=\"{class}\" d=\"M{x:.1} {y:.1}L{edge} {place:.1}h12\" stroke-opacity=\"0.35\"/>\
                 <text x=\"{}\" y=\"{:.1}\">{}</text>\n",
            edge + 16.0,
            place + 4.0,
            escaped(label)
        ));
    }
}

/// A text in lines of at most so many letters, broken at words.
fn wrapped(text: &str, letters: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= letters => {
                line.push(' ');
                line.push_str(word);
            }
            _ => lines.push(word.to_owned()),
        }
    }
    lines
}

fn class(trace: &Trace, index: usize) -> String {
    let form = match trace.form {
        Form::Line => "line",
        Form::Dashed => "dashed",
        Form::Mark => "mark",
        Form::Dots => "dots",
        Form::Discs => "disc",
    };
    format!("{form} t{}", trace.colour.unwrap_or(index) % COLOURS)
}

fn axes(image: &mut String, chart: &Chart, (across, up): (&Scale, &Scale), (left, top): (f64, f64), width: f64) {
    let (right, foot) = (left + width, top + chart.height_px);
    for (value, text) in up.marks(MARK_ROOM[1], chart.is_logarithmic) {
        let y = top + up.px(value);
        image.push_str(&format!(
            "<path class=\"grid\" d=\"M{left} {y:.1}H{right}\"/><text x=\"{}\" y=\"{:.1}\" \
                 text-anchor=\"end\">{text}</text>\n",
            left - 6.0,
            y + 4.0
        ));
    }
    for (value, text) in across.marks(MARK_ROOM[0], chart.is_logarithmic) {
        let x = left + across.px(value);
        image.push_str(&format!(
            "<path class=\"grid\" d=\"M{x:.1} {top}V{foot}\"/><text x=\"{x:.1}\" y=\"{}\" \
                 text-anchor=\"middle\">{text}</text>\n",
            foot + 16.0
        ));
    }
    let (middle_x, middle_y) = (0.5 * (left + right), 0.5 * (top + foot));
    image.push_str(&format!(
        "<rect class=\"frame\" x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\"/>\
             <text x=\"{middle_x}\" y=\"{}\" text-anchor=\"middle\">{}</text>\
             <text transform=\"translate(16 {middle_y}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n",
        right - left,
        chart.height_px,
        foot + 34.0,
        escaped(&chart.across.label),
        escaped(&chart.up.label)
    ));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(points: Vec<[f64; 2]>) -> Chart {
        Chart::new("F & v", "Velocity (m/s)", "Force (N)").with(Trace::line("a < b", points))
    }

    #[test]
    fn a_chart_has_its_names_units_and_traces_and_both_grounds() {
        let partner = Trace::line("fitted", vec![[0.0, 1.0]]).in_colour(1);
        let two = chart(vec![[0.0, 0.0], [1.0, 2.0]]).with(Trace::dots("measured", vec![[0.5, 1.0]]));
        let two = two.with(partner);
        let text = svg(&[two.clone(), two]);
        for part in [
            "F &amp; v",
            "Velocity (m/s)",
            "Force (N)",
            "a &lt; b",
            "prefers-color-scheme:dark",
            "class=\"line t0\"",
            "class=\"dots t1\"",
            "class=\"line t1\"",
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
        let rows = legend(&many, WIDTH);
        assert_eq!(legend(&many.clone().with(Trace::line("", Vec::new())), WIDTH), rows);
        assert!(rows.iter().all(|(x, ..)| *x < WIDTH - RIGHT - 100.0));
        let lowest = legend_foot(&many, WIDTH) + LINE * rows.last().expect("a place").1;
        assert!(
            lowest >= 4.0 * LINE && lowest < head(&many, WIDTH),
            "{lowest} of {}",
            head(&many, WIDTH)
        );
    }

    #[test]
    fn named_points_have_their_lines_and_powers_of_ten() {
        let mut named = Trace::dots("laws", vec![[10.0, 1e-9], [100.0, 2e-9], [1e3, 1.0]]);
        named.labels = ["a", "b", "c & d"].map(str::to_owned).to_vec();
        let mut chart = Chart::new("cost", "Tick (ns)", "Error (N)").with(named);
        chart.is_logarithmic = true;
        let text = svg(&[chart]);
        assert_eq!(text.matches("stroke-opacity=\"0.35\"").count(), 3);
        for part in [">c &amp; d</text>", ">1e-5</text>", ">1e1</text>"] {
            assert!(text.contains(part), "{part} in {text}");
        }
        let heights = text.split("stroke-opacity").skip(1).filter_map(|rest| {
            let (_, rest) = rest.split_once(" y=\"")?;
            rest.split('"').next()?.parse::<f64>().ok()
        });
        let heights: Vec<f64> = heights.collect();
        assert!(heights.windows(2).all(|pair| pair[1] - pair[0] >= LINE), "{heights:?}");
    }

    #[test]
    fn a_title_wider_than_the_image_takes_a_second_line() {
        let mut titled = chart(vec![[0.0, 0.0]]);
        let before = head(&titled, 320.0);
        titled.title = "high stiction: time against the size of errors".to_owned();
        assert_eq!(title_lines(&titled, 320.0).len(), 2);
        assert_eq!(head(&titled, 320.0), before + LINE);
        let mut image = String::new();
        draw(&mut image, &titled, 320.0, 0.0);
        for part in [
            "y=\"18\" font-weight=\"bold\">high",
            "y=\"36\" font-weight=\"bold\">",
            "y=\"57.6\">a &lt; b",
        ] {
            assert!(image.contains(part), "{part} in {image}");
        }
    }

    #[test]
    fn a_note_is_broken_at_words() {
        assert_eq!(wrapped("no threshold: all wrong", 14), ["no threshold:", "all wrong"]);
        assert_eq!(wrapped("unbreakable", 3), ["unbreakable"]);
        let mut noted = chart(vec![[0.0, 0.0]]);
        noted.notes.push("not fitted: 2 < 3".to_owned());
        let text = svg(&[noted]);
        assert!(
            text.contains("class=\"note\" x=\"72\" y=\"57.6\">not fitted: 2 &lt; 3</text>"),
            "{text}"
        );
    }
}
