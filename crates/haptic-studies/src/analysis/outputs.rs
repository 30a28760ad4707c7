//! The files of an analysis: a page, its charts as figures, and each table as data (CSV), Markdown and LaTeX.

use super::FittsAnalysis;
use super::data::{fitts_data, perception_data};
use super::page::{fitts_charts, page, perception_charts};
use super::perception::PerceptionAnalysis;
use super::tables::{PAGE, dashes, fitts_tables, footnotes, perception_tables};
use super::trajectories::Trajectory;
use crate::subject_table::SubjectTable;
use haptic_lab::drawing::{Chart, Page, Table, figures};

/// Names and contents of files.
type Files = Vec<(String, Vec<u8>)>;

/// Names and contents of the files of a targeting task.
#[must_use]
pub fn fitts_files(
    analysis: &FittsAnalysis,
    trajectories: &[Trajectory],
    subjects: &SubjectTable,
    title: &str,
) -> Files {
    let charts = fitts_charts(analysis, trajectories);
    let pictures = pictures(&charts);
    let tables = fitts_tables(analysis, PAGE);
    let page = page(title, all(charts), &tables, &analysis.refused, &analysis.notes);
    let data = fitts_data(analysis, subjects);
    let notes = |table: &str| {
        let pooled = analysis.pooled_baseline.iter();
        pooled
            .filter(|_| matches!(table, "throughput" | "difficulty"))
            .cloned()
            .collect()
    };
    files(&page, pictures, &tables, &data, |_| Vec::new(), notes)
}

/// Names and contents of the files of a perception test.
#[must_use]
pub fn perception_files(analysis: &PerceptionAnalysis, subjects: &SubjectTable, title: &str) -> Files {
    let charts = perception_charts(analysis);
    let pictures = pictures(&charts);
    let tables = perception_tables(analysis);
    let page = page(title, all(charts), &tables, &analysis.refused, &analysis.notes);
    let data = perception_data(analysis, subjects);
    let (dashes, notes) = (
        |table: &str| dashes(analysis, table),
        |table: &str| footnotes(analysis, table),
    );
    files(&page, pictures, &tables, &data, dashes, notes)
}

fn all(charts: Vec<(&str, Vec<Chart>)>) -> Vec<Chart> {
    charts.into_iter().flat_map(|(_, charts)| charts).collect()
}

/// The figures of each name; numbered where it has more than one.
fn pictures(charts: &[(&str, Vec<Chart>)]) -> Files {
    let mut pictures = Vec::new();
    for (name, charts) in charts {
        let figures = figures(charts);
        let is_alone = figures.len() == 1;
        pictures.extend((1..).zip(figures).map(|(number, figure)| {
            let number = if is_alone { String::new() } else { format!("-{number}") };
            (format!("{name}{number}.svg"), figure.into_bytes())
        }));
    }
    pictures
}

/// The files; `dashes` says why cells of a table are empty, `footnotes` what else stands below it.
fn files(
    page: &Page,
    pictures: Files,
    shown: &[(String, Table)],
    data: &[(String, Table)],
    dashes: impl Fn(&str) -> Vec<String>,
    footnotes: impl Fn(&str) -> Vec<String>,
) -> Files {
    let mut files = vec![("analysis.html".to_owned(), page.html().into_bytes())];
    files.extend(pictures);
    for (name, table) in shown {
        let has_dashes = table.rows.iter().flatten().any(|cell| cell == "-");
        let mut notes = if has_dashes { dashes(name) } else { Vec::new() };
        if table.rows.iter().flatten().any(|cell| cell.ends_with('*')) {
            notes.push("*: p < 0.05, sign test, not corrected for the number of cells".to_owned());
        }
        notes.extend(footnotes(name));
        let below: String = notes.iter().map(|note| format!("\n{note}\n")).collect();
        files.push((format!("{name}.md"), (table.markdown() + &below).into_bytes()));
        files.push((format!("{name}.tex"), table.latex(name, &notes).into_bytes()));
    }
    files.extend(data.iter().map(|(name, table)| (format!("{name}.csv"), table.csv())));
    files
}
