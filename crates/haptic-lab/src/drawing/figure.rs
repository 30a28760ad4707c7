//! Figures for print: charts beside and below one another on a white ground.

use super::chart::Chart;
use super::svg::{BOTTOM, add, draw, escaped, head, style};

/// Width of a figure, px of 1/96 inch: 169 mm, the text of an A4 page.
const WIDTH: f64 = 640.0;
/// Greatest height of a figure, px: 212 mm.
const MAX_HEIGHT: f64 = 800.0;
/// Greatest height of a chart, px.
const MAX_CHART: f64 = 400.0;
/// Most rows of charts in a figure.
const MAX_ROWS: usize = 3;
/// Least height of a plot under a long legend, px.
const MIN_PLOT: f64 = 40.0;

/// Charts as figures for print, 169 mm wide and at most 212 mm (800 px) high, with letters of 10 points. Up to two
/// charts are below one another, more in two columns, and six fill a figure.
#[must_use]
pub fn figures(charts: &[Chart]) -> Vec<String> {
    let columns = if charts.len() > 2 { 2 } else { 1 };
    let parts = charts.chunks(MAX_ROWS * columns);
    parts.map(|part| figure(part, columns)).collect()
}

#[expect(clippy::cast_precision_loss, reason = "rows and columns of a page")]
fn figure(charts: &[Chart], columns: usize) -> String {
    let rows = charts.len().div_ceil(columns);
    let (width, row) = (
        WIDTH / columns as f64,
        (MAX_HEIGHT / rows as f64).min(MAX_CHART).floor(),
    );
    let height = row * rows as f64;
    let titles: Vec<&str> = charts.iter().map(|chart| chart.title.as_str()).collect();
    let mut image = String::new();
    add(
        &mut image,
        format_args!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" viewBox=\"0 0 {WIDTH} \
             {height}\" role=\"img\" aria-label=\"{}\">\n<style>{}.chart{{font-size:13px}}</style>\n\
             <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#fff\"/>",
            escaped(&titles.join("; ")),
            style(charts, false)
        ),
    );
    for (index, chart) in charts.iter().enumerate() {
        let (x, y) = ((index % columns) as f64 * width, (index / columns) as f64 * row);
        let fitted = Chart {
            height_px: (row - head(chart, width) - BOTTOM).max(MIN_PLOT),
            ..chart.clone()
        };
        add(&mut image, format_args!("<g transform=\"translate({x} {y})\">"));
        draw(&mut image, &fitted, width, 0.0);
        add(&mut image, format_args!("</g>"));
    }
    image.push_str("</svg>\n");
    image
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing::{Observation, Trace};

    fn number(image: &str, name: &str) -> f64 {
        let (_, rest) = image.split_once(&format!(" {name}=\"")).expect(name);
        rest.split('"').next().and_then(|text| text.parse().ok()).expect(name)
    }

    #[test]
    fn a_figure_is_at_most_800_px_high_and_lacks_no_chart() {
        let seen = Observation {
            at: [1.0, 0.7],
            bar: Some([0.6, 0.8]),
            count: 20,
        };
        for count in 1..=13 {
            let charts: Vec<Chart> = (0..count)
                .map(|place| Chart::new(format!("<{place}>"), "N", "share").with(Trace::discs("seen", &[seen])))
                .collect();
            let figures = figures(&charts);
            for figure in &figures {
                let height = number(figure, "height");
                assert!(height <= 800.0, "{count} charts: {height}");
                assert_eq!(figure.matches("<svg").count(), figure.matches("</svg>").count());
                assert!(!figure.contains("prefers-color-scheme"), "paper is white");
            }
            let all = figures.concat();
            assert!((0..count).all(|place| all.contains(&format!("bold\">&lt;{place}&gt;</text>"))));
        }
        assert!(figures(&[]).is_empty());
    }
}
