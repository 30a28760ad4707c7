//! The files of an analysis: a page, its charts as pictures, and the tables as CSV.

use super::FittsAnalysis;
use super::page::{fitts_charts, fitts_page, perception_charts, perception_page};
use super::perception::PerceptionAnalysis;
use super::tables::{fitts_tables, perception_tables};
use super::trajectories::Trajectory;
use haptic_lab::drawing::{Chart, Page, Table, svg};
use serde::Serialize;

/// Names and contents of the files of a targeting task: the page, its charts as pictures, the tables as they are shown,
/// and the sequences and differences with all their digits.
#[must_use]
pub fn fitts_files(analysis: &FittsAnalysis, trajectories: &[Trajectory], title: &str) -> Vec<(String, Vec<u8>)> {
    let charts = fitts_charts(analysis, trajectories);
    let pictures = pictures(&charts);
    let mut files = with_tables(&fitts_page(analysis, all(charts), title), &fitts_tables(analysis));
    files.extend(pictures);
    files.push(("sequences.csv".to_owned(), rows(&analysis.sequences)));
    files.push(("differences.csv".to_owned(), rows(&analysis.differences)));
    files
}

/// Names and contents of the files of a perception test: the page, its charts as a picture, and the tables as they are
/// shown.
#[must_use]
pub fn perception_files(analysis: &PerceptionAnalysis, title: &str) -> Vec<(String, Vec<u8>)> {
    let charts = perception_charts(analysis);
    let pictures = pictures(&charts);
    let page = perception_page(analysis, all(charts), title);
    let mut files = with_tables(&page, &perception_tables(analysis));
    files.extend(pictures);
    files
}

fn all(charts: Vec<(&str, Vec<Chart>)>) -> Vec<Chart> {
    charts.into_iter().flat_map(|(_, charts)| charts).collect()
}

fn pictures(charts: &[(&str, Vec<Chart>)]) -> Vec<(String, Vec<u8>)> {
    let drawn = charts.iter().filter(|(_, charts)| !charts.is_empty());
    drawn
        .map(|(name, charts)| (format!("{name}.svg"), svg(charts).into_bytes()))
        .collect()
}

fn with_tables(page: &Page, tables: &[(String, Table)]) -> Vec<(String, Vec<u8>)> {
    let tables = tables.iter().map(|(name, table)| (format!("{name}.csv"), table.csv()));
    std::iter::once(("analysis.html".to_owned(), page.html().into_bytes()))
        .chain(tables)
        .collect()
}

fn rows<T: Serialize>(rows: &[T]) -> Vec<u8> {
    let mut csv = csv::Writer::from_writer(Vec::new());
    for row in rows {
        // Memory takes whatever is written to it.
        csv.serialize(row).unwrap_or(());
    }
    csv.into_inner().unwrap_or_default()
}
