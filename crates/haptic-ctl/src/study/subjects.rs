//! Who takes part: the options that `study new` and `study run` share.

use crate::failure::Failure;
use clap::{Args, ValueHint};
use haptic_ipc::{quoted, regular_file};
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
        for verb in ["new", "run"] {
            let reads = |options: &[&str]| {
                let words = ["haptic-ctl", "study", verb, "fitts", "--out", "x"];
                Arguments::try_parse_from([&words, options].concat()).map_err(|error| error.to_string())
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
