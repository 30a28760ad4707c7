//! A study's table of subjects: their codes, the order in which each does things, and free fields.
//!
//! ```text
//! subject,order,age_band,handedness
//! P1,real | viscous | baseline,20-29,right
//! P2,viscous | baseline | real,30-39,left
//! ```
//!
//! A study keeps it as `subjects.csv`, which may get more columns at any time; the orders are fixed when it is made.

use super::trial::{TrialError, cells};
use std::collections::BTreeSet;

/// Column of the codes.
pub(crate) const SUBJECT: &str = "subject";
/// Column of the orders, and what separates the names in it.
const ORDER: &str = "order";
const SEPARATOR: char = '|';

/// A study's subjects.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct SubjectTable {
    /// Names of the free fields.
    pub fields: Vec<String>,
    /// The subjects.
    pub rows: Vec<SubjectRow>,
}

/// A row of the table.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SubjectRow {
    /// The subject's code.
    pub code: String,
    /// Order of its resistances or tests; empty where the plan decides.
    pub order: Vec<String>,
    /// Its free fields.
    pub values: Vec<String>,
}

/// Why a table of subjects cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum SubjectTableError {
    /// It cannot be read.
    #[error(transparent)]
    Text(#[from] TrialError),
    /// Its columns do not say who the subjects are, or not clearly.
    #[error("{0}")]
    Heading(String),
}

impl SubjectTable {
    /// The table of subjects that nothing but the codes is known of.
    #[must_use]
    pub fn of_codes(codes: &[String]) -> Self {
        let row = |code: &String| SubjectRow {
            code: code.clone(),
            order: Vec::new(),
            values: Vec::new(),
        };
        Self {
            fields: Vec::new(),
            rows: codes.iter().map(row).collect(),
        }
    }

    /// Reads a file of text, as it reads trials.
    ///
    /// # Errors
    /// It is not a table, has no column `subject`, or a column twice.
    pub fn read(bytes: &[u8]) -> Result<Self, SubjectTableError> {
        let mut cells = cells(bytes)?.into_iter();
        let heading = cells.next().unwrap_or_default();
        for (place, name) in heading.iter().enumerate() {
            if name.is_empty() || heading[..place].contains(name) {
                let why = format!("the column `{name}` is there twice, or has no name");
                return Err(SubjectTableError::Heading(why));
            }
            let own = [SUBJECT, ORDER]
                .into_iter()
                .find(|own| name.trim().eq_ignore_ascii_case(own));
            if let Some(own) = own.filter(|own| own != name) {
                return Err(SubjectTableError::Heading(format!(
                    "the column `{name}` is not `{own}`: write `{own}`, or give the free field another name"
                )));
            }
        }
        let place = |name: &str| heading.iter().position(|column| column == name);
        let none = || format!("no column `{SUBJECT}`: it must have the subjects' codes");
        let subject = place(SUBJECT).ok_or_else(|| SubjectTableError::Heading(none()))?;
        let order = place(ORDER);
        let is_free = |place: &usize| *place != subject && Some(*place) != order;
        let free: Vec<usize> = (0..heading.len()).filter(is_free).collect();
        let pick = |row: &[String]| free.iter().map(|place| row[*place].clone()).collect();
        let rows = cells.map(|row| SubjectRow {
            code: row[subject].clone(),
            order: order.map(|place| names(&row[place])).unwrap_or_default(),
            values: pick(&row),
        });
        Ok(Self {
            rows: rows.collect(),
            fields: pick(&heading),
        })
    }

    /// The subjects' codes.
    #[must_use]
    pub fn codes(&self) -> Vec<String> {
        self.rows.iter().map(|row| row.code.clone()).collect()
    }

    /// Adds the rows of subjects that it does not have. A field that one of the two lacks is empty in its rows.
    pub(crate) fn add(&mut self, more: &Self) {
        for name in &more.fields {
            if !self.fields.contains(name) {
                self.fields.push(name.clone());
            }
        }
        for row in &mut self.rows {
            row.values.resize(self.fields.len(), String::new());
        }
        for SubjectRow { code, order, values } in &more.rows {
            if self.rows.iter().any(|row| row.code == *code) {
                continue;
            }
            let value = |name| {
                more.fields
                    .iter()
                    .position(|field| field == name)
                    .map(|place| values[place].clone())
            };
            self.rows.push(SubjectRow {
                code: code.clone(),
                order: order.clone(),
                values: self.fields.iter().map(|name| value(name).unwrap_or_default()).collect(),
            });
        }
    }

    /// What of a table with free fields does not belong to the subjects of the trials, for people: a spreadsheet saves
    /// the code 01 as 1. The codes of the study, where there is one, need not have trials yet.
    #[must_use]
    pub fn strangers(&self, of_trials: &BTreeSet<&str>, of_study: Option<&[String]>) -> Option<String> {
        if self.fields.is_empty() || self.rows.is_empty() {
            return None;
        }
        let has_row = |code: &&&str| self.rows.iter().any(|row| row.code == **code);
        let lacking: Vec<&str> = of_trials.iter().filter(|code| !has_row(code)).copied().collect();
        let is_known = |code: &String| {
            of_trials.contains(code.as_str()) || of_study.map_or(lacking.is_empty(), |codes| codes.contains(code))
        };
        let rows = self.rows.iter().map(|row| &row.code);
        let strange: Vec<&str> = rows.filter(|code| !is_known(code)).map(String::as_str).collect();
        let lacking = (!lacking.is_empty()).then(|| {
            let codes = lacking.join(", ");
            format!("it has no row of subject {codes}, whose fields are empty")
        });
        let strange = (!strange.is_empty()).then(|| format!("it has {}, not of this study", strange.join(", ")));
        let notes: Vec<String> = lacking.into_iter().chain(strange).collect();
        (!notes.is_empty()).then(|| format!("subjects.csv: {}", notes.join("; ")))
    }

    /// The table as CSV.
    ///
    /// # Errors
    /// None that a table of this kind can have.
    pub(crate) fn csv(&self) -> Result<Vec<u8>, csv::Error> {
        let has_orders = self.rows.iter().any(|row| !row.order.is_empty());
        let mut csv = csv::Writer::from_writer(Vec::new());
        let mut put = |code: &str, order: String, values: &[String]| {
            let order = has_orders.then_some(order);
            csv.write_record(
                std::iter::once(code.to_owned())
                    .chain(order)
                    .chain(values.iter().cloned()),
            )
        };
        put(SUBJECT, ORDER.to_owned(), &self.fields)?;
        for row in &self.rows {
            put(&row.code, row.order.join(" | "), &row.values)?;
        }
        csv.into_inner().map_err(|error| error.into_error().into())
    }
}

fn names(cell: &str) -> Vec<String> {
    let names = cell.split(SEPARATOR).map(str::trim);
    names.filter(|name| !name.is_empty()).map(str::to_owned).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_column_that_is_nearly_the_order_is_no_free_field() {
        let read = |heading: &str| SubjectTable::read(format!("{heading}\nP1,A | C | B\n").as_bytes());
        for (heading, own) in [("subject,Order", "order"), ("Subject,order", "subject")] {
            let message = read(heading).expect_err(heading).to_string();
            assert!(message.contains(&format!("is not `{own}`")), "{message}");
        }
        assert_eq!(read("subject,orders").expect("a free field").fields, ["orders"]);
    }

    #[test]
    fn a_table_of_other_codes_than_the_trials_says_so() {
        let study = ["01", "02", "03"].map(str::to_owned);
        let remark = |text: &str, of_study: Option<&[String]>| {
            let table = SubjectTable::read(text.as_bytes()).expect("a table");
            table.strangers(&BTreeSet::from(["01", "02"]), of_study)
        };
        // As a spreadsheet saves it.
        let saved = "subject,age_band\n1,20-29\n2,30-39\n";
        let note =
            "subjects.csv: it has no row of subject 01, 02, whose fields are empty; it has 1, 2, not of this study";
        assert_eq!(remark(saved, Some(&study)).as_deref(), Some(note));
        assert_eq!(remark(saved, None).as_deref(), Some(note));
        let one = remark("subject,age_band\n01,20-29\n02,30-39\n4,\n", Some(&study));
        assert_eq!(one.as_deref(), Some("subjects.csv: it has 4, not of this study"));
        // A subject may have no trials yet, and a table without fields none to lose.
        assert_eq!(
            remark("subject,age_band\n01,20-29\n02,30-39\n03,\n", Some(&study)),
            None
        );
        assert_eq!(remark("subject,age_band\n01,20-29\n02,30-39\n03,\n", None), None);
        assert_eq!(remark("subject\n1\n", Some(&study)), None);
    }

    #[test]
    fn a_table_of_subjects_reads_back_with_orders_and_fields() {
        let text = "subject,handedness,order,note\nP1,left,real | high stiction,\"a, \"\"b\"\"\"\nP2,right,,\n";
        let table = SubjectTable::read(text.as_bytes()).expect("a table");
        assert_eq!(
            (table.codes(), &*table.fields),
            (
                vec!["P1".to_owned(), "P2".to_owned()],
                &["handedness".to_owned(), "note".to_owned()][..]
            )
        );
        assert_eq!(table.rows[0].order, ["real", "high stiction"]);
        assert!(table.rows[1].order.is_empty());
        assert_eq!(table.rows[0].values, ["left", "a, \"b\""]);
        assert_eq!(SubjectTable::read(&table.csv().expect("CSV")).expect("a table"), table);
        let plain = SubjectTable::of_codes(&["01".to_owned()]);
        assert_eq!(plain.csv().expect("CSV"), b"subject\n01\n");
        for (text, message) in [
            (
                "code,age\nP1,20\n",
                "no column `subject`: it must have the subjects' codes",
            ),
            (
                "subject,age,age\nP1,20,30\n",
                "the column `age` is there twice, or has no name",
            ),
            ("subject,\nP1,20\n", "the column `` is there twice, or has no name"),
        ] {
            let error = SubjectTable::read(text.as_bytes()).expect_err(message);
            assert_eq!(error.to_string(), message);
        }
    }
}
