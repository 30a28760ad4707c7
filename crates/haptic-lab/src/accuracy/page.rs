//! The work-precision measurement for people: the plot of speed against error, and a page of it with the tables behind.

use super::by_law::{LawMeasurement, schemes_by_law, worst_of};
use super::hands::laws_under_hands;
use super::plane::PlaneMeasurement;
use super::report::Measurement;
use crate::drawing::{Chart, Observation, Page, Table, Trace, svg};

/// What the axes span: cost of a tick, ns, and force error, N. What lies outside is drawn on the border.
const COST_NS: (f64, f64) = (10.0, 1e5);
const ERROR_N: (f64, f64) = (1e-15, 1e3);

/// What the schemes are called, in their order.
const SCHEMES: [&str; 3] = ["exact (named)", "literal, as the paper prints it", "implicit"];

/// The plot as an image of its own.
#[must_use]
pub fn plot(laws: &[LawMeasurement]) -> String {
    svg(&[chart(laws)])
}

/// A point for each law and scheme: the median tick of a hand at 60 Hz behind 0.5 kg, and the worst error under all
/// hands and masses.
fn chart(measurements: &[LawMeasurement]) -> Chart {
    let mut chart = Chart::new(
        "Worst force error of each law against the cost of its tick",
        "Median tick under a hand at 60 Hz, block of 0.5 kg (ns)",
        "Worst force error under all hands and masses (N)",
    );
    (chart.across.range, chart.up.range) = (Some(COST_NS), Some(ERROR_N));
    (chart.is_logarithmic, chart.height_px) = (true, 420.0);
    for (place, scheme) in schemes_by_law().into_iter().enumerate().rev() {
        let (mut points, mut names) = (Vec::new(), Vec::new());
        for (law, _) in laws_under_hands() {
            let of_law = || {
                let is_of_law =
                    move |one: &&LawMeasurement| one.law == law && one.scheme == scheme && !one.is_on_device();
                measurements.iter().filter(is_of_law)
            };
            let is_usual = |one: &&LawMeasurement| one.hand == "60 Hz" && one.mass_kg == Some(0.5);
            let Some(cost) = of_law().find(is_usual).and_then(|one| one.cost) else {
                continue;
            };
            points.push(Observation {
                at: [
                    cost.median_ns.clamp(COST_NS.0, COST_NS.1),
                    worst_of(of_law()).worst_n.clamp(ERROR_N.0, ERROR_N.1),
                ],
                bar: None,
                count: 1,
            });
            names.push(law.to_owned());
        }
        let mut trace = Trace::discs(SCHEMES[place], &points).in_colour(place);
        if place == 0 {
            trace.labels = names;
        }
        chart = chart.with(trace);
    }
    chart
}

/// The page, of the laws under hands, of the cases, and of the block in the plane.
#[must_use]
pub fn page(laws: &[LawMeasurement], cases: &[Measurement], plane: &[PlaneMeasurement]) -> String {
    let page = Page {
        title: "Speed against error".to_owned(),
        paragraphs: vec![
            "Each point is one friction law with one scheme: what its median tick costs on this machine, and its worst \
             force error against the true motion, under all hands and masses. Down and to the left is better. Made by \
             `haptic-ctl accuracy --out DIR`."
                .to_owned(),
        ],
        charts: vec![chart(laws)],
        tables: vec![law_table(laws), case_table(cases), plane_table(plane)],
    };
    page.html()
}

fn law_table(laws: &[LawMeasurement]) -> Table {
    let head = "law|scheme|hand|block, kg|median, N|breakaway tick, N|reversal tick, N|worst tick, N|ticks at their \
                bound|their worst, N|stops and breakaways|median, ns|dearest, ns|instructions";
    let mut rows = vec![head.split('|').map(str::to_owned).collect()];
    for m in laws {
        let e = &m.errors;
        let force = |newtons: f64| format!("{newtons:.0e}");
        let number = |value: Option<f64>| value.map_or_else(String::new, |value| format!("{value:.0}"));
        rows.push(vec![
            m.law.to_owned(),
            m.scheme.to_string(),
            m.hand.to_owned(),
            match m.mass_kg {
                Some(mass) => mass.to_string(),
                None if m.is_on_device() => "on the device".to_owned(),
                None => "any".to_owned(),
            },
            force(e.median_n),
            force(e.breakaway_n),
            force(e.reversal_n),
            force(e.worst_n),
            e.at_bound.to_string(),
            force(e.at_bound_worst_n),
            e.same_changes
                .map_or("", |same| if same { "same" } else { "others" })
                .to_owned(),
            number(m.cost.map(|cost| cost.median_ns)),
            number(m.cost.map(|cost| cost.dearest_ns)),
            number(m.instructions),
        ]);
    }
    Table {
        caption: "Laws under hands".to_owned(),
        rows,
    }
}

fn case_table(cases: &[Measurement]) -> Table {
    let head = "case|scheme|ns a tick|instructions|position, m|force, N|events, s|energy from friction, J";
    let mut rows = vec![head.split('|').map(str::to_owned).collect()];
    rows.extend(cases.iter().map(|m| {
        vec![
            m.case.clone(),
            m.scheme.to_string(),
            format!("{:.1}", m.cost.median_ns),
            m.instructions.map_or_else(String::new, |count| format!("{count:.0}")),
            if m.blew_up {
                "blew up".to_owned()
            } else {
                format!("{:.1e}", m.error.position_m)
            },
            format!("{:.1e}", m.error.force_n),
            m.events_text(),
            format!("{:.1e}", m.energy_created_j),
        ]
    }));
    Table {
        caption: "Cases".to_owned(),
        rows,
    }
}

fn plane_table(plane: &[PlaneMeasurement]) -> Table {
    let head = "motion|tick|median, N|worst tick, N|median, ns|dearest, ns|instructions";
    let mut rows = vec![head.split('|').map(str::to_owned).collect()];
    rows.extend(plane.iter().map(|m| {
        vec![
            m.case.to_owned(),
            m.scheme.to_string(),
            format!("{:.0e}", m.median_n),
            format!("{:.0e}", m.worst_n),
            format!("{:.0}", m.cost.median_ns),
            format!("{:.0}", m.cost.dearest_ns),
            m.instructions.map_or_else(String::new, |count| format!("{count:.0}")),
        ]
    }));
    Table {
        caption: "Karnopp's block in the plane".to_owned(),
        rows,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::{LawCase, cases, law_cases, measure, measure_law, measure_plane};

    #[test]
    fn every_measurement_is_a_row_and_every_law_a_point() {
        let case = &cases::of_karnopp()[10];
        assert_eq!(case.name, "Fs >> Fd", "a name that must be escaped");
        let measurements = measure(case, None).expect("a valid scene");
        let wanted = |case: &&LawCase| case.law == "lugre" && case.hand == "60 Hz" && case.mass_kg == Some(0.5);
        let case = law_cases(20).into_iter().find(|case| wanted(&case)).expect("a case");
        let laws = measure_law(&case, true, None).expect("a valid scene");
        let plane = measure_plane(None).expect("valid scenes");
        let page = page(&laws, &measurements, &plane);
        assert_eq!(page.matches("<tr><td>Fs &gt;&gt; Fd").count(), measurements.len());
        let rows = measurements.len() + laws.len() + plane.len();
        assert_eq!(page.matches("<tr><td>").count(), rows);
        assert_eq!(
            page.matches("<circle class=\"disc t").count(),
            2 * laws.len(),
            "a point and its legend"
        );
        assert_eq!(page.matches(">lugre</text>").count(), 1);
        assert!(!page.contains("NaN"));
    }
}
