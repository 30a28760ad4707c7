//! The work-precision measurement as one page: the plot, and the tables behind it. Readable on light
//! and dark ground, without a script.

use super::by_law::LawMeasurement;
use super::plot::plot;
use super::report::Measurement;
use crate::drawing::escaped;
use std::fmt::Write;

const STYLE: &str = "\
:root { color-scheme: light dark; --ground: #fff; --ink: #1b1b1b; --faint: #d5d5d5; } \
@media (prefers-color-scheme: dark) { :root { --ground: #16181b; --ink: #e6e6e6; --faint: #3a3d42; } } \
body { background: var(--ground); color: var(--ink); font: 15px system-ui, sans-serif; max-width: 60rem; margin: 2rem \
auto; padding: 0 1rem; } svg { width: 100%; height: auto; } \
table { border-collapse: collapse; font-variant-numeric: tabular-nums; } td, th { padding: .15rem .7rem; \
border-bottom: 1px solid var(--faint); text-align: right; } td:first-child, td:nth-child(2), th:first-child, \
th:nth-child(2) { text-align: left; }";

/// The page, of the laws under hands and of the cases.
#[must_use]
pub fn page(laws: &[LawMeasurement], cases: &[Measurement]) -> String {
    let mut page = format!(
        "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>Speed against \
         error</title><style>{STYLE}</style></head><body>\n\
         <h1>Speed against error</h1>\n\
         <p>Each point is one friction law with one scheme: what its median tick costs on this machine, and its worst \
         force error against the true motion, under all hands and masses. Down and to the left is better. Made by \
         <code>haptic-ctl accuracy --out DIR</code>.</p>\n"
    );
    page.push_str(&plot(laws));
    page.push_str("<h2>Laws under hands</h2>\n");
    law_table(&mut page, laws);
    page.push_str("<h2>Cases</h2>\n");
    table(&mut page, cases);
    page.push_str("</body></html>\n");
    page
}

fn law_table(page: &mut String, laws: &[LawMeasurement]) {
    page.push_str(
        "<table><tr><th>law</th><th>scheme</th><th>hand</th><th>block, kg</th><th>median, N</th><th>breakaway tick, \
         N</th><th>reversal tick, N</th><th>worst tick, N</th>\
         <th>ticks at their bound</th><th>their worst, N</th><th>stops and breakaways</th><th>median, \
         ns</th><th>dearest, ns</th><th>instructions</th></tr>\n",
    );
    for m in laws {
        let e = &m.errors;
        let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.0}"));
        line(
            page,
            format_args!(
                "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{:.0e}</td><td>{:.0e}</td><td>{:.0e}</td>\
                 <td>{:.0e}</td><td>{}</td><td>{:.0e}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
                escaped(m.law),
                m.scheme,
                m.hand,
                match m.mass_kg {
                    Some(mass) => mass.to_string(),
                    None if m.is_on_device() => "on the device".to_owned(),
                    None => "any".to_owned(),
                },
                e.median_n,
                e.breakaway_n,
                e.reversal_n,
                e.worst_n,
                e.at_bound,
                e.at_bound_worst_n,
                match e.same_changes {
                    None => "",
                    Some(true) => "same",
                    Some(false) => "others",
                },
                number(m.cost.map(|cost| cost.median_ns)),
                number(m.cost.map(|cost| cost.dearest_ns)),
                number(m.instructions),
            ),
        );
    }
    page.push_str("</table>\n");
}

fn table(page: &mut String, measurements: &[Measurement]) {
    page.push_str(
        "<table><tr><th>case</th><th>scheme</th><th>ns a tick</th><th>instructions</th><th>position, m</th><th>force, \
         N</th><th>events, s</th><th>energy from friction, J</th></tr>\n",
    );
    for m in measurements {
        let events = m.events_text();
        let instructions = m.instructions.map_or_else(String::new, |count| format!("{count:.0}"));
        line(
            page,
            format_args!(
                "<tr><td>{}</td><td>{}</td><td>{:.1}</td><td>{instructions}</td><td>{}</td><td>{:.1e}</td>\
                 <td>{events}</td><td>{:.1e}</td></tr>",
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::{LawCase, cases, law_cases, measure, measure_law};

    #[test]
    fn every_measurement_is_a_row_and_every_law_a_point() {
        let case = &cases::of_karnopp()[10];
        assert_eq!(case.name, "Fs >> Fd", "a name that must be escaped");
        let measurements = measure(case, None).expect("a valid scene");
        let wanted = |case: &&LawCase| case.law == "lugre" && case.hand == "60 Hz" && case.mass_kg == Some(0.5);
        let case = law_cases(20).into_iter().find(|case| wanted(&case)).expect("a case");
        let laws = measure_law(&case, true, None).expect("a valid scene");
        let page = page(&laws, &measurements);
        assert_eq!(page.matches("<tr><td>Fs &gt;&gt; Fd").count(), measurements.len());
        assert_eq!(page.matches("<tr><td>").count(), measurements.len() + laws.len());
        assert_eq!(page.matches("<title>lugre, ").count(), laws.len());
        assert!(!page.contains("NaN") && page.contains("prefers-color-scheme: dark"));
    }
}
