//! The plot of speed against error: a point for each law and scheme, the exact ones by name.

use super::by_law::{LawMeasurement, schemes_by_law, worst_of};
use super::hands::laws_under_hands;
use haptic_core::Scheme;
use std::fmt::Write;

const WIDTH: f64 = 960.0;
const HEIGHT: f64 = 560.0;
const LEFT: f64 = 80.0;
/// The names of the laws stand to the right of the plot.
const RIGHT: f64 = 250.0;
const TOP: f64 = 50.0;
const BOTTOM: f64 = 60.0;
/// Between two lines of text.
const LINE: f64 = 17.0;

/// Powers of ten that the axes span: cost in ns, force error in N. What lies outside is drawn on
/// the border.
const COST: (f64, f64) = (1.0, 5.0);
const ERROR: (f64, f64) = (-15.0, 3.0);

/// What changes on dark ground: text, ground and grid. A style goes before what an element says of itself.
const DARK: &str = "<style>@media (prefers-color-scheme:dark){text{fill:#e6e6e6}rect{fill:#16181b}\
                    path[stroke=\"#d5d5d5\"]{stroke:#3a3d42}}</style>";

/// Colours of the schemes (Okabe and Ito 2008), which people with any colour vision distinguish.
const COLOURS: [(&str, &str); 3] = [
    ("#0072b2", "exact (named)"),
    ("#d55e00", "literal, as the paper prints it"),
    ("#8a8a8a", "implicit"),
];

struct Point {
    law: &'static str,
    x: f64,
    y: f64,
}

/// The plot as an SVG image of its own, dark text on white.
#[must_use]
pub fn plot(measurements: &[LawMeasurement]) -> String {
    let mut svg = String::new();
    line(
        &mut svg,
        format_args!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" width=\"{WIDTH}\" \
             height=\"{HEIGHT}\" role=\"img\" aria-label=\"Worst force error of each law against the cost of its \
             tick\" font-family=\"sans-serif\" font-size=\"13\" fill=\"#1b1b1b\">"
        ),
    );
    line(
        &mut svg,
        format_args!("{DARK}\n<rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>"),
    );
    axes(&mut svg);
    for (index, scheme) in schemes_by_law().into_iter().enumerate().rev() {
        let points = points(measurements, scheme);
        let (colour, _) = COLOURS[index];
        if index == 0 {
            names(&mut svg, &points, colour);
        }
        for point in &points {
            line(
                &mut svg,
                format_args!(
                    "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"5\" fill=\"{colour}\"><title>{}, {scheme}</title></circle>",
                    point.x, point.y, point.law
                ),
            );
        }
    }
    for (index, (colour, name)) in COLOURS.iter().enumerate() {
        let x = LEFT + 10.0 + 210.0 * index as f64;
        line(
            &mut svg,
            format_args!(
                "<circle cx=\"{x}\" cy=\"26\" r=\"5\" fill=\"{colour}\"/><text x=\"{}\" y=\"30\">{name}</text>",
                x + 12.0
            ),
        );
    }
    svg.push_str("</svg>\n");
    svg
}

fn x(exponent: f64) -> f64 {
    LEFT + across(exponent, COST) * (WIDTH - LEFT - RIGHT)
}

fn y(exponent: f64) -> f64 {
    HEIGHT - BOTTOM - across(exponent, ERROR) * (HEIGHT - TOP - BOTTOM)
}

fn across(exponent: f64, (low, high): (f64, f64)) -> f64 {
    ((exponent - low) / (high - low)).clamp(0.0, 1.0)
}

/// A law's point: the median tick of a hand at 60 Hz behind 0.5 kg, and the worst error under all
/// hands and masses.
fn points(measurements: &[LawMeasurement], scheme: Scheme) -> Vec<Point> {
    let behind_block = |law: &'static str| {
        measurements
            .iter()
            .filter(move |one| one.law == law && one.scheme == scheme && !one.is_on_device())
    };
    laws_under_hands()
        .into_iter()
        .filter_map(|(law, _)| {
            let cost = behind_block(law)
                .find(|one| one.hand == "60 Hz" && one.mass_kg == Some(0.5))?
                .cost?;
            let errors = worst_of(behind_block(law));
            let worst_n = errors.worst_n.clamp(f64::MIN_POSITIVE, f64::MAX);
            Some(Point {
                law,
                x: x(cost.median_ns.max(1.0).log10()),
                y: y(worst_n.log10()),
            })
        })
        .collect()
}

/// The names beside the plot, from top to bottom as the points, with a line to each.
fn names(svg: &mut String, points: &[Point], colour: &str) {
    let mut order: Vec<&Point> = points.iter().collect();
    order.sort_by(|a, b| a.y.total_cmp(&b.y).then(a.x.total_cmp(&b.x)));
    let lowest = HEIGHT - BOTTOM;
    let mut places: Vec<f64> = Vec::new();
    for point in &order {
        let least = places.last().map_or(TOP, |last| last + LINE);
        places.push(point.y.max(least));
    }
    // What would end below the plot moves up.
    let mut most = lowest;
    for place in places.iter_mut().rev() {
        *place = place.min(most);
        most = *place - LINE;
    }
    let edge = WIDTH - RIGHT;
    for (point, place) in order.iter().zip(places) {
        line(
            svg,
            format_args!(
                "<path d=\"M{:.1} {:.1} L{edge} {place:.1} L{} {place:.1}\" stroke=\"{colour}\" \
                 stroke-opacity=\"0.35\" fill=\"none\"/>\
                 <text x=\"{}\" y=\"{:.1}\">{}</text>",
                point.x,
                point.y,
                edge + 12.0,
                edge + 16.0,
                place + 4.0,
                point.law
            ),
        );
    }
}

fn axes(svg: &mut String) {
    let (right, bottom) = (WIDTH - RIGHT, HEIGHT - BOTTOM);
    for (exponent, name) in [
        (1.0, "10 ns"),
        (2.0, "100 ns"),
        (3.0, "1 us"),
        (4.0, "10 us"),
        (5.0, "100 us"),
    ] {
        let x = x(exponent);
        line(
            svg,
            format_args!(
                "<path d=\"M{x:.1} {TOP} V{bottom}\" stroke=\"#d5d5d5\"/><text x=\"{x:.1}\" y=\"{}\" \
                 text-anchor=\"middle\">{name}</text>",
                bottom + 18.0
            ),
        );
    }
    for (exponent, name) in [
        (-15, "1e-15 N"),
        (-12, "1e-12 N"),
        (-9, "1 nN"),
        (-6, "1 uN"),
        (-3, "1 mN"),
        (0, "1 N"),
        (3, "1 kN"),
    ] {
        let y = y(f64::from(exponent));
        line(
            svg,
            format_args!(
                "<path d=\"M{LEFT} {y:.1} H{right}\" stroke=\"#d5d5d5\"/><text x=\"{}\" y=\"{:.1}\" \
                 text-anchor=\"end\">{name}</text>",
                LEFT - 8.0,
                y + 4.0
            ),
        );
    }
    line(
        svg,
        format_args!(
            "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">median tick under a hand at 60 Hz, block of 0.5 kg; up: \
             worst force error under all hands and masses</text>",
            (LEFT + right) / 2.0,
            HEIGHT - 14.0
        ),
    );
}

fn line(svg: &mut String, text: std::fmt::Arguments<'_>) {
    // A string takes whatever is written to it.
    writeln!(svg, "{text}").unwrap_or(());
}
