//! Who takes part: the options that `study new`, `study run` and `study add` share.

use crate::failure::Failure;
use clap::{Args, ValueHint};
use haptic_ipc::{quoted, regular_file};
use haptic_studies::store::StudyDescription;
use haptic_studies::subject::numbered_codes;
use haptic_studies::subject_table::SubjectTable;
use std::fmt::{self, Display, Formatter};
use std::path::PathBuf;

#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
pub(super) struct Subjects {
    /// Number of subjects, from 1 to 999; their codes are 01, 02, ...
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=999))]
    subjects: Option<u32>,

    /// Codes of the subjects, as in --codes P1,P2,P3
    #[arg(long, value_name = "CODE,...", value_delimiter = ',')]
    codes: Vec<String>,

    /// Table of the subjects: columns subject, order (optional), and free fields
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    subjects_file: Option<PathBuf>,
}

impl Subjects {
    /// The subjects of the command line, or of the file that it names.
    pub(super) fn table(&self) -> Result<SubjectTable, Failure> {
        let Some(path) = &self.subjects_file else {
            let codes = self.subjects.map_or_else(|| self.codes.clone(), numbered_codes);
            return Ok(SubjectTable::of_codes(&codes));
        };
        let wrong = |error: &dyn Display| Failure::Usage(format!("{}: {error}", path.display()));
        let text = regular_file::read_text(path).map_err(|error| wrong(&error))?;
        SubjectTable::read(text.as_bytes()).map_err(|error| wrong(&error))
    }

    /// The subjects to add to those of a study.
    pub(super) fn new_ones(&self, about: &StudyDescription) -> Result<SubjectTable, Failure> {
        if self.subjects_file.is_none() && !about.orders.is_empty() {
            let why = "a table gave the orders of this study's subjects: --subjects-file must name the new ones, each \
                       with an order, or an empty one where the plan decides";
            return Err(Failure::Usage(why.to_owned()));
        }
        let mut table = self.table()?;
        if let Some(subjects) = self.subjects {
            let has = about.subjects.len();
            if !table.codes().starts_with(&about.subjects) {
                return Err(Failure::Usage(format!(
                    "--subjects {subjects}: the study has {has} subjects: {}; N is the number that it then has, of the \
                     codes 01, 02, ...; --codes adds subjects of other codes",
                    about.subjects.join(", ")
                )));
            }
            table.rows.drain(..has);
        }
        Ok(table)
    }
}

/// The option as it was given.
impl Display for Subjects {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        match (&self.subjects_file, self.subjects) {
            (Some(path), _) => write!(f, "--subjects-file {}", quoted(path)),
            (None, Some(subjects)) => write!(f, "--subjects {subjects}"),
            (None, None) => write!(f, "--codes {}", self.codes.join(",")),
        }
    }
}

#[cfg(test)]
mod tests {
    use crate::command_line::Arguments;
    use clap::Parser;

    #[test]
    fn a_study_and_its_rehearsal_take_one_list_of_subjects() {
        let lists = [["--subjects", "2"], ["--codes", "P1,P2"], ["--subjects-file", "s.csv"]];
        for words in [
            &["new", "fitts", "--out", "x"][..],
            &["run", "fitts", "--out", "x"],
            &["add", "x"],
        ] {
            let verb = words[0];
            let reads = |options: &[&str]| {
                Arguments::try_parse_from([&["haptic-ctl", "study"], words, options].concat())
                    .map_err(|error| error.to_string())
            };
            let nobody = reads(&[]).expect_err("nobody takes part");
            assert!(lists.iter().all(|[name, _]| nobody.contains(name)), "{verb}: {nobody}");
            for (place, list) in lists.iter().enumerate() {
                assert!(reads(list).is_ok(), "{verb} {list:?}");
                for other in &lists[..place] {
                    assert!(reads(&[*list, *other].concat()).is_err(), "{verb} {list:?} {other:?}");
                }
            }
        }
    }
}
