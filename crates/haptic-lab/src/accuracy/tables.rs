//! The measurements as the tables of the document, and their places in it.

use super::by_law::{LawMeasurement, worst_of};
use super::cases;
use super::error::worse;
use super::hands::laws_under_hands;
use super::plane::PlaneMeasurement;
use super::report::{Measurement, schemes};
use haptic_core::Scheme;
use haptic_motion::median::median;
use std::fmt::Write;

/// All that was measured.
#[derive(Clone, Copy, Debug)]
pub struct Tables<'a> {
    /// The cases by scheme.
    pub cases: &'a [Measurement],
    /// The laws under hands.
    pub laws: &'a [LawMeasurement],
    /// The block in the plane.
    pub plane: &'a [PlaneMeasurement],
}

/// A table in Markdown.
struct Table(String);

impl Table {
    fn new(header: &[&str]) -> Self {
        let mut table = Self(String::new());
        table.row(header);
        table.0.push_str(&format!("|{}\n", "---|".repeat(header.len())));
        table
    }

    fn row<S: AsRef<str>>(&mut self, cells: &[S]) {
        let cells: Vec<String> = cells.iter().map(|cell| cell.as_ref().replace('|', "\\|")).collect();
        // A string takes whatever is written to it.
        writeln!(self.0, "| {} |", cells.join(" | ")).unwrap_or(());
    }
}

fn force(newtons: f64) -> String {
    if newtons == 0.0 {
        "0".to_owned()
    } else if newtons > 1e9 {
        "> 1e9".to_owned()
    } else {
        format!("{newtons:.0e}")
    }
}

fn time(ns: f64) -> String {
    if ns < 1e3 {
        format!("{ns:.0} ns")
    } else {
        format!("{:.1} us", ns * 1e-3)
    }
}

fn count(instructions: Option<f64>) -> String {
    instructions.map_or_else(|| "-".to_owned(), |count| format!("{count:.0}"))
}

impl Tables<'_> {
    /// Every table by its name.
    #[must_use]
    pub fn all(&self) -> Vec<(&'static str, String)> {
        vec![
            ("behind a block", self.behind_block()),
            ("schemes", self.schemes()),
            ("in the plane", self.in_plane()),
        ]
    }

    /// The exact step's runs of a law behind a block.
    fn of(&self, law: &str) -> impl Iterator<Item = &LawMeasurement> {
        self.laws
            .iter()
            .filter(move |one| one.law == law && one.scheme == Scheme::Exact && !one.is_on_device())
    }

    fn behind_block(&self) -> String {
        let mut table = Table::new(&[
            "law, behind a block",
            "error, N: median",
            "worst",
            "60 Hz, 0.5 kg: median",
            "dearest",
            "instructions",
            "437 Hz, 10 g: dearest",
        ]);
        for (law, _) in laws_under_hands() {
            let errors = worst_of(self.of(law));
            let costs = |hand, mass| {
                let mut runs = self.of(law);
                Self::costs(runs.find(|one| one.hand == hand && one.mass_kg == Some(mass)))
            };
            let [median, dearest, instructions] = costs("60 Hz", 0.5);
            let [_, dearest_at_437_hz, _] = costs("437 Hz", 0.01);
            table.row(&[
                law.to_owned(),
                force(errors.median_n),
                force(errors.worst_n),
                median,
                dearest,
                instructions,
                dearest_at_437_hz,
            ]);
        }
        table.0
    }

    fn costs(one: Option<&LawMeasurement>) -> [String; 3] {
        let cost = one.and_then(|one| one.cost);
        [
            cost.map_or_else(|| "-".to_owned(), |cost| time(cost.median_ns)),
            cost.map_or_else(|| "-".to_owned(), |cost| time(cost.dearest_ns)),
            count(one.and_then(|one| one.instructions)),
        ]
    }

    fn in_plane(&self) -> String {
        let mut table = Table::new(&[
            "motion",
            "tick",
            "error, N: median",
            "worst",
            "median",
            "dearest",
            "instructions",
        ]);
        for one in self.plane {
            table.row(&[
                one.case.to_owned(),
                one.scheme.to_string(),
                force(one.median_n),
                force(one.worst_n),
                time(one.cost.median_ns),
                time(one.cost.dearest_ns),
                count(one.instructions),
            ]);
        }
        table.0
    }

    fn schemes(&self) -> String {
        let names: Vec<String> = cases::of_karnopp().into_iter().map(|case| case.name).collect();
        let mut table = Table::new(&[
            "scheme",
            "ns a tick, median",
            "instructions",
            "force error, median, N",
            "force error, worst, N",
            "same list of contact changes",
            "energy created by friction, worst",
            "blew up",
        ]);
        for scheme in schemes() {
            let of_scheme: Vec<&Measurement> = self
                .cases
                .iter()
                .filter(|one| one.scheme == scheme && names.contains(&one.case))
                .collect();
            let of =
                |value: &dyn Fn(&Measurement) -> f64| -> Vec<f64> { of_scheme.iter().map(|one| value(one)).collect() };
            let worst = |values: Vec<f64>| values.into_iter().fold(0.0, worse);
            let times: Vec<f64> = of_scheme.iter().filter_map(|one| one.error.event_time_s).collect();
            let mut counts: Vec<f64> = of_scheme.iter().filter_map(|one| one.instructions).collect();
            let blown_up = of_scheme.iter().filter(|one| one.blew_up).count();
            table.row(&[
                scheme.to_string(),
                format!("{:.0}", median(&mut of(&|one| one.cost.median_ns)).unwrap_or(f64::NAN)),
                count(median(&mut counts)),
                force(median(&mut of(&|one| one.error.force_n)).unwrap_or(f64::NAN)),
                force(worst(of(&|one| one.error.force_n))),
                format!(
                    "{} of {}, to {:.0e} s",
                    times.len(),
                    of_scheme.len(),
                    worst(times.clone())
                ),
                match worst(of(&|one| one.energy_created_j)) {
                    0.0 => "0".to_owned(),
                    energy if energy > 1e9 => "> 1e9".to_owned(),
                    energy => format!("{energy:.0e} J"),
                },
                if blown_up == 0 {
                    "none".to_owned()
                } else {
                    blown_up.to_string()
                },
            ]);
        }
        table.0
    }
}

/// A document with its tables made again. A table `NAME` stands between the lines `<!-- table: NAME
/// -->` and `<!-- end of table -->`.
///
/// # Errors
/// The document has no place for one of the tables, or has one that does not end.
pub fn refresh(document: &str, tables: &[(&str, String)]) -> Result<String, String> {
    const END: &str = "<!-- end of table -->";
    let mut document = document.to_owned();
    for (name, table) in tables {
        let begin = format!("<!-- table: {name} -->\n");
        let at = document
            .find(&begin)
            .ok_or_else(|| format!("the document has no line `{}`", begin.trim_end()))?
            + begin.len();
        let length = document[at..]
            .find(END)
            .ok_or_else(|| format!("the table `{name}` has no line `{END}`"))?;
        document.replace_range(at..at + length, &format!("\n{table}\n"));
    }
    Ok(document)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_document_keeps_all_but_its_tables() {
        let document = "# Head\n<!-- table: a -->\nold\n<!-- end of table -->\nmiddle\n<!-- table: b -->\n<!-- end of \
                        table -->\nend\n";
        let tables = [("a", "| 1 |\n".to_owned()), ("b", "| 2 |\n".to_owned())];
        let fresh = refresh(document, &tables).expect("both have a place");
        assert_eq!(
            fresh,
            "# Head\n<!-- table: a -->\n\n| 1 |\n\n<!-- end of table -->\nmiddle\n<!-- table: b -->\n\n| 2 |\n\n<!-- \
             end of table -->\nend\n"
        );
        assert_eq!(refresh(&fresh, &tables).expect("again"), fresh);
        assert!(refresh(document, &[("c", String::new())]).is_err());
        assert!(refresh("<!-- table: a -->\n", &tables[..1]).is_err());
    }

    #[test]
    fn the_document_has_a_place_for_every_table() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/speed-vs-error.md");
        let document = std::fs::read_to_string(path).expect("the document");
        let nothing = Tables {
            cases: &[],
            laws: &[],
            plane: &[],
        };
        let tables = nothing.all();
        refresh(&document, &tables).expect("a place for each");
        assert_eq!(document.matches("<!-- table: ").count(), tables.len());
    }
}
