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
}

impl Subject {
    /// The subject of a number: its code is the number with two digits, or more where it needs them.
    #[must_use]
    pub fn numbered(number: u32) -> Self {
        Self {
            number,
            code: format!("{number:02}"),
            session: 1,
        }
    }
}
