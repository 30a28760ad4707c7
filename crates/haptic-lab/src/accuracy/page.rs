//! The work-precision measurement as one page: force error against the cost of a tick, both on
//! logarithmic axes, and the table behind it. Readable on light and dark ground, without a script.

use super::report::{Measurement, schemes};
use std::fmt::Write;

const WIDTH: f64 = 900.0;
const HEIGHT: f64 = 460.0;
const LEFT: f64 = 80.0;
const RIGHT: f64 = 30.0;
const TOP: f64 = 20.0;
const BOTTOM: f64 = 50.0;

/// Powers of ten that the axes span: cost in ns, force error in N. What lies outside is drawn on
/// the border.
const COST: (f64, f64) = (1.0, 5.0);
const ERROR: (f64, f64) = (-15.0, 3.0);

const STYLE: &str = "\
:root { color-scheme: light dark; --ground: #fff; --ink: #1b1b1b; --faint: #d5d5d5; \
--s0: #0072b2; --s1: #d55e00; --s2: #e69f00; --s3: #009e73; --s4: #7a5195; } \
@media (prefers-color-scheme: dark) { :root { --ground: #16181b; --ink: #e6e6e6; --faint: #3a3d42; \
--s0: #56b4e9; --s1: #ff8c4a; --s2: #f0c04a; --s3: #4fd1a5; --s4: #c9a0e0; } } \
body { background: var(--ground); color: var(--ink); font: 15px system-ui, sans-serif; max-width: 60rem; margin: 2rem auto; padding: 0 1rem; } \
svg { width: 100%; height: auto; } svg text { fill: var(--ink); font: 13px system-ui, sans-serif; } \
.grid { stroke: var(--faint); } .s0 { fill: var(--s0); } .s1 { fill: var(--s1); } .s2 { fill: var(--s2); } .s3 { fill: var(--s3); } .s4 { fill: var(--s4); } \
table { border-collapse: collapse; font-variant-numeric: tabular-nums; } td, th { padding: .15rem .7rem; border-bottom: 1px solid var(--faint); text-align: right; } \
td:first-child, td:nth-child(2), th:first-child, th:nth-child(2) { text-align: left; }";

/// The page.
#[must_use]
pub fn page(measurements: &[Measurement]) -> String {
    let mut page = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Speed against error</title><style>{STYLE}</style></head><body>\n\
         <h1>Speed against error</h1>\n\
         <p>Each point is one scheme on one scene and one friction law: what a tick costs on this machine, and the worst force error against the true motion. \
         Down and to the left is better. Made by <code>haptic-ctl accuracy --out DIR</code>.</p>\n"
    );
    plot(&mut page, measurements);
    table(&mut page, measurements);
    page.push_str("</body></html>\n");
    page
}

fn plot(page: &mut String, measurements: &[Measurement]) {
    let across = |exponent: f64, (low, high): (f64, f64)| ((exponent - low) / (high - low)).clamp(0.0, 1.0);
    let x = |exponent: f64| LEFT + across(exponent, COST) * (WIDTH - LEFT - RIGHT);
    let y = |exponent: f64| HEIGHT - BOTTOM - across(exponent, ERROR) * (HEIGHT - TOP - BOTTOM);
    line(
        page,
        format_args!(
            "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"Force error against the cost of a tick\">"
        ),
    );
    for (exponent, name) in [
        (1.0, "10 ns"),
        (2.0, "100 ns"),
        (3.0, "1 us"),
        (4.0, "10 us"),
        (5.0, "100 us"),
    ] {
        let (x, bottom) = (x(exponent), HEIGHT - BOTTOM);
        line(
            page,
            format_args!("<line class=\"grid\" x1=\"{x}\" x2=\"{x}\" y1=\"{TOP}\" y2=\"{bottom}\"/>"),
        );
        line(
            page,
            format_args!(
                "<text x=\"{x}\" y=\"{}\" text-anchor=\"middle\">{name}</text>",
                bottom + 18.0
            ),
        );
    }
    for exponent in [-15, -12, -9, -6, -3, 0, 3] {
        let y = y(f64::from(exponent));
        line(
            page,
            format_args!(
                "<line class=\"grid\" x1=\"{LEFT}\" x2=\"{}\" y1=\"{y}\" y2=\"{y}\"/>",
                WIDTH - RIGHT
            ),
        );
        line(
            page,
            format_args!(
                "<text x=\"{}\" y=\"{}\" text-anchor=\"end\">1e{exponent} N</text>",
                LEFT - 8.0,
                y + 4.0
            ),
        );
    }
    line(
        page,
        format_args!(
            "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\">cost of a tick (median)</text>",
            (LEFT + WIDTH) / 2.0,
            HEIGHT - 8.0
        ),
    );
    let schemes = schemes();
    for measurement in measurements {
        let class = schemes
            .iter()
            .position(|scheme| *scheme == measurement.scheme)
            .unwrap_or(0);
        // An error of nothing, or beyond all numbers, lies on the border.
        let error = measurement.error.force_n.clamp(f64::MIN_POSITIVE, f64::MAX);
        let (x, y) = (x(measurement.cost.median_ns.max(1.0).log10()), y(error.log10()));
        line(
            page,
            format_args!(
                "<circle class=\"s{class}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5\" fill-opacity=\"0.75\"><title>{}, {}: {:.1} ns, {:.1e} N</title></circle>",
                escaped(&measurement.case),
                measurement.scheme,
                measurement.cost.median_ns,
                measurement.error.force_n
            ),
        );
    }
    for (class, scheme) in schemes.iter().enumerate() {
        // Low on the right, where slow and exact would be, and nothing is.
        let y = HEIGHT - BOTTOM - 120.0 + 20.0 * class as f64;
        let x = WIDTH - RIGHT - 110.0;
        line(
            page,
            format_args!(
                "<circle class=\"s{class}\" cx=\"{x}\" cy=\"{}\" r=\"5\"/><text x=\"{}\" y=\"{y}\">{scheme}</text>",
                y - 4.0,
                x + 12.0
            ),
        );
    }
    page.push_str("</svg>\n");
}

fn table(page: &mut String, measurements: &[Measurement]) {
    page.push_str(
        "<table><tr><th>case</th><th>scheme</th><th>ns a tick</th><th>instructions</th><th>position, m</th><th>force, N</th><th>events, s</th><th>energy from friction, J</th></tr>\n",
    );
    for m in measurements {
        let events = m
            .error
            .event_time_s
            .map_or_else(|| "others".to_owned(), |time| format!("{time:.1e}"));
        let instructions = m.instructions.map_or_else(String::new, |count| format!("{count:.0}"));
        line(
            page,
            format_args!(
                "<tr><td>{}</td><td>{}</td><td>{:.1}</td><td>{instructions}</td><td>{}</td><td>{:.1e}</td><td>{events}</td><td>{:.1e}</td></tr>",
                escaped(&m.case),
                m.scheme,
                m.cost.median_ns,
                if m.blew_up {
                    "blew up".to_owned()
                } else {
                    format!("{:.1e}", m.error.position_m)
                },
                m.error.force_n,
                m.energy_created_j
            ),
        );
    }
    page.push_str("</table>\n");
}

fn line(page: &mut String, text: std::fmt::Arguments<'_>) {
    // A string takes whatever is written to it.
    writeln!(page, "{text}").unwrap_or(());
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::{cases, measure};

    #[test]
    fn every_measurement_is_a_point_and_a_row() {
        let case = &cases::of_karnopp()[10];
        assert_eq!(case.name, "Fs >> Fd", "a name that must be escaped");
        let measurements = measure(case, None).expect("a valid scene");
        let page = page(&measurements);
        assert_eq!(page.matches("<title>Fs &gt;&gt; Fd").count(), measurements.len());
        assert_eq!(page.matches("<tr><td>").count(), measurements.len());
        assert!(!page.contains("NaN") && page.contains("prefers-color-scheme: dark"));
    }
}
