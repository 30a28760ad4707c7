//! The plot of speed against error.

use super::by_law::{LawMeasurement, schemes_by_law, worst_of};
use super::hands::laws_under_hands;
use crate::drawing::{Chart, Observation, Trace, svg};

/// What the axes span: cost of a tick, ns, and force error, N. What lies outside is drawn on the border.
const COST_NS: (f64, f64) = (10.0, 1e5);
const ERROR_N: (f64, f64) = (1e-15, 1e3);

/// What the schemes are called, in their order.
const SCHEMES: [&str; 3] = ["exact (named)", "literal, as the paper prints it", "implicit"];

/// An image with a point for each law and scheme: the median tick of a hand at 60 Hz behind 0.5 kg, and the worst error
/// under all hands and masses.
#[must_use]
pub fn plot(measurements: &[LawMeasurement]) -> String {
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
    svg(&[chart])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::{LawCase, law_cases, measure_law};

    #[test]
    fn every_law_is_a_point() {
        let wanted = |case: &&LawCase| case.law == "lugre" && case.hand == "60 Hz" && case.mass_kg == Some(0.5);
        let case = law_cases(20).into_iter().find(|case| wanted(&case)).expect("a case");
        let laws = measure_law(&case, true, None).expect("a valid scene");
        let plot = plot(&laws);
        assert_eq!(
            plot.matches("<circle class=\"disc t").count(),
            2 * laws.len(),
            "a point and its legend"
        );
        assert_eq!(plot.matches(">lugre</text>").count(), 1);
        assert!(!plot.contains("NaN"));
    }
}
