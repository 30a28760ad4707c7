//! The files of an analysis: a page, and the tables as CSV.

use super::FittsAnalysis;
use super::page::{fitts_page, perception_page};
use super::perception::PerceptionAnalysis;
use super::tables::{fitts_tables, perception_tables};
use super::trajectories::Trajectory;
use crate::drawing::{Page, Table};
use serde::Serialize;

/// Names and contents of the files of a targeting task: the page, the tables as they are shown, and the sequences and
/// differences with all their digits.
#[must_use]
pub fn fitts_files(analysis: &FittsAnalysis, trajectories: &[Trajectory], title: &str) -> Vec<(String, Vec<u8>)> {
    let mut files = files(&fitts_page(analysis, trajectories, title), &fitts_tables(analysis));
    files.push(("sequences.csv".to_owned(), rows(&analysis.sequences)));
    files.push(("differences.csv".to_owned(), rows(&analysis.differences)));
    files
}

/// Names and contents of the files of a perception test: the page, and the tables as they are shown.
#[must_use]
pub fn perception_files(analysis: &PerceptionAnalysis, title: &str) -> Vec<(String, Vec<u8>)> {
    files(&perception_page(analysis, title), &perception_tables(analysis))
}

fn files(page: &Page, tables: &[(String, Table)]) -> Vec<(String, Vec<u8>)> {
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
