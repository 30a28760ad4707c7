//! Who takes part in a study.

/// A subject: a code, and never a name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Subject {
    /// Its number in the study, from 1: it decides on every random order.
    pub number: u32,
    /// Its code in file names and rows.
    pub code: String,
    /// The session, from 1.
    pub session: u32,
    /// Order of its resistances or tests; empty where the plan decides.
    pub order: Vec<String>,
}

/// Why subjects cannot take part under these codes.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CodeError {
    /// A code that cannot stand in a file's name.
    #[error("subject `{0}`: a code has 1 to 32 letters and digits of ASCII, and no other characters")]
    Characters(String),
    /// Two of one code.
    #[error("subject `{0}`: duplicate code (case is ignored)")]
    Twice(String),
    /// Too few or too many.
    #[error("{0} subjects: there must be 1 to 999")]
    Count(usize),
}

impl Subject {
    /// The subject of a code, by its number.
    #[must_use]
    pub fn new(number: u32, code: &str) -> Self {
        Self {
            number,
            code: code.to_owned(),
            session: 1,
            order: Vec::new(),
        }
    }

    /// The subject of a number: its code is the number with two digits, or more where it needs them.
    #[must_use]
    pub fn numbered(number: u32) -> Self {
        Self::new(number, &format!("{number:02}"))
    }
}

/// The codes of `subjects` subjects that nobody named.
#[must_use]
pub fn numbered_codes(subjects: u32) -> Vec<String> {
    (1..=subjects).map(|number| Subject::numbered(number).code).collect()
}

/// Checks codes: they stand in the names of files.
///
/// # Errors
/// One has another character than letters and digits, or is there twice.
pub fn check_codes(codes: &[String]) -> Result<(), CodeError> {
    if !(1..=999).contains(&codes.len()) {
        return Err(CodeError::Count(codes.len()));
    }
    for (index, code) in codes.iter().enumerate() {
        if !(1..=32).contains(&code.len()) || !code.bytes().all(|byte| byte.is_ascii_alphanumeric()) {
            return Err(CodeError::Characters(code.clone()));
        }
        if codes[..index].iter().any(|other| other.eq_ignore_ascii_case(code)) {
            return Err(CodeError::Twice(code.clone()));
        }
    }
    Ok(())
}

/// Rows that are not those of the study to continue.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("{0}")]
pub struct StudyMismatch(String);

/// Compares the cells of a row, which counts from 1, with what the plan has there.
pub(crate) fn compare(subject: &str, row: usize, cells: &[(&str, String, String)]) -> Result<(), StudyMismatch> {
    match cells.iter().find(|(_, found, expected)| found != expected) {
        None => Ok(()),
        Some((column, found, expected)) => Err(StudyMismatch(format!(
            "row {row} of subject {subject}: {column} is {found}, and the plan has {expected}"
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn subject_codes_are_unique_and_fit_a_file_name() {
        let check = |codes: &[&str]| check_codes(&codes.iter().map(|code| (*code).to_owned()).collect::<Vec<_>>());
        assert_eq!(check(&["01", "P7", "abc"]), Ok(()));
        for code in ["", "../x", "a b", "a_b", "a/b", "\u{e4}", &"x".repeat(33)] {
            assert_eq!(check(&[code]), Err(CodeError::Characters(code.to_owned())));
        }
        assert_eq!(check(&["p7", "P7"]), Err(CodeError::Twice("P7".to_owned())));
        assert_eq!(check(&[]), Err(CodeError::Count(0)));
        assert_eq!(numbered_codes(2), ["01", "02"]);
    }
}
