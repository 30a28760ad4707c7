//! Speed against error: `cargo bench -p haptic-lab --bench accuracy -- DOCUMENT FOLDER`.
//!
//! Measures every scheme on every case, replaces the tables of the document, and writes the plot `speed-vs-error.svg`
//! into the folder. Instructions are counted by callgrind (valgrind), under which this program starts itself once more;
//! without it they are left out.

use haptic_lab::accuracy::{self, Extent, Tables, cases};
use haptic_lab::cost::{self, CountError, Probe};
use std::error::Error;
use std::path::{Path, PathBuf};

/// The argument before the name of a probe.
const PROBE: &str = "probe";

fn main() -> Result<(), Box<dyn Error>> {
    // Cargo adds `--bench`.
    let arguments: Vec<String> = std::env::args()
        .skip(1)
        .filter(|word| !word.starts_with("--"))
        .collect();
    match &arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [PROBE, probe] => Ok(probe.parse::<Probe>()?.run()?),
        [document, folder] => refresh(&of_workspace(document), &of_workspace(folder)),
        _ => Err("expected a document and a folder for the plot".into()),
    }
}

/// The instructions of a probe; nothing without valgrind.
fn count(probe: Probe) -> Result<Option<Vec<u64>>, Box<dyn Error>> {
    let directory = tempfile::tempdir()?;
    let arguments = [PROBE, &probe.to_string()];
    match cost::count(&std::env::current_exe()?, &arguments, directory.path()) {
        Ok(totals) => Ok(Some(totals)),
        Err(error @ CountError::NoValgrind) => {
            eprintln!("instructions are not counted: {error}");
            Ok(None)
        }
        Err(error) => Err(error.into()),
    }
}

/// A path from the workspace's root: cargo starts benches in the crate's folder.
fn of_workspace(path: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..").join(path)
}

fn refresh(document: &Path, folder: &Path) -> Result<(), Box<dyn Error>> {
    let before = std::fs::read_to_string(document).map_err(|error| format!("{}: {error}", document.display()))?;
    let counted = count(Probe::Cases)?;
    let schemes = accuracy::schemes().len();
    let mut measured = Vec::new();
    for (index, case) in cases::all().iter().enumerate() {
        eprintln!("{}", case.name);
        let counted = counted.as_ref().and_then(|totals| totals.chunks(schemes).nth(index));
        measured.extend(accuracy::measure(case, counted)?);
    }
    let laws = accuracy::measure_laws(Extent::REPORT, count(Probe::Hands)?.as_deref(), |law| {
        eprintln!("{law}");
    })?;
    let plane = accuracy::measure_plane(count(Probe::Plane)?.as_deref())?;
    let tables = Tables {
        cases: &measured,
        laws: &laws,
        plane: &plane,
    };
    let text = accuracy::refresh(&before, &tables.all())?;
    std::fs::write(document, text)?;
    std::fs::write(folder.join("speed-vs-error.svg"), accuracy::plot(&laws))?;
    Ok(())
}
