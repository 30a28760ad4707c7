//! Continuing where the rows of a study end.

/// Rows that are not those of the study to continue.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("row {row} of subject {subject}: {column} is {found}, and the plan has {expected}")]
pub struct StudyMismatch {
    /// The subject's code.
    pub subject: String,
    /// The row, from 1.
    pub row: usize,
    /// The column that differs.
    pub column: &'static str,
    /// What it holds.
    pub found: String,
    /// What the plan has there.
    pub expected: String,
}

/// Compares a row's cells with what the plan has there.
pub(crate) fn compare(
    subject: &str,
    row: usize,
    cells: &[(&'static str, String, String)],
) -> Result<(), StudyMismatch> {
    match cells.iter().find(|(_, found, expected)| found != expected) {
        None => Ok(()),
        Some((column, found, expected)) => Err(StudyMismatch {
            subject: subject.to_owned(),
            row,
            column,
            found: found.clone(),
            expected: expected.clone(),
        }),
    }
}
