//! Figures for print: charts beside and below one another on a white ground.

use super::chart::Chart;
use super::svg::{BOTTOM, draw, escaped, head, style};

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

fn figure(charts: &[Chart], columns: usize) -> String {
    let rows = charts.len().div_ceil(columns);
    let (width, row) = (
        WIDTH / columns as f64,
        (MAX_HEIGHT / rows as f64).min(MAX_CHART).floor(),
    );
    let height = row * rows as f64;
    let titles: Vec<&str> = charts.iter().map(|chart| chart.title.as_str()).collect();
    let mut image = String::new();
    image.push_str(&format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{height}\" viewBox=\"0 0 {WIDTH} \
             {height}\" role=\"img\" aria-label=\"{}\">\n<style>{}.chart{{font-size:13px}}</style>\n\
             <rect width=\"{WIDTH}\" height=\"{height}\" fill=\"#fff\"/>\n",
        escaped(&titles.join("; ")),
        style(charts, false)
    ));
    for (line, beside) in charts.chunks(columns).enumerate() {
        // Plots beside one another are alike, whatever stands above them.
        let tallest = beside.iter().map(|chart| head(chart, width)).fold(0.0, f64::max);
        for (column, chart) in beside.iter().enumerate() {
            let (x, y) = (column as f64 * width, line as f64 * row + tallest - head(chart, width));
            let fitted = Chart {
                height_px: (row - tallest - BOTTOM).max(MIN_PLOT),
                ..chart.clone()
            };
            image.push_str(&format!("<g transform=\"translate({x} {y})\">\n"));
            draw(&mut image, &fitted, width, 0.0);
            image.push_str("</g>\n");
        }
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
    fn plots_beside_one_another_have_one_height_and_edge() {
        let charts = [0, 9, 3, 0].map(|traces| {
            let chart = Chart::new("force", "mm", "N");
            (0..traces).fold(chart, |chart, place| {
                chart.with(Trace::line(
                    format!("subject {place} of a long name"),
                    vec![[0.0, 0.0], [1.0, 1.0]],
                ))
            })
        });
        let figure = &figures(&charts)[0];
        let plots: Vec<[f64; 2]> = figure
            .split("<g transform=\"translate(")
            .skip(1)
            .map(|chart| {
                let (_, y) = chart
                    .split(')')
                    .next()
                    .expect("a place")
                    .split_once(' ')
                    .expect("two numbers");
                let frame = &chart[chart.find("class=\"frame\"").expect("a plot")..];
                let y: f64 = y.parse().expect("a number");
                [y + number(frame, "y"), number(frame, "height")]
            })
            .collect();
        assert!(plots[0] == plots[1] && plots[2] == plots[3], "{plots:?}");
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
