//! What a tick costs and what the exact scheme reaches: `cargo bench -p haptic-lab --bench accuracy`.
//!
//! Prints bytes, instructions and nanoseconds of each kind of scene, and the targets of the exact scheme. With a
//! document and a folder as arguments it measures every scheme on every case too, replaces the tables of the document,
//! and writes the plot `speed-vs-error.svg` into the folder. Instructions are counted by callgrind (valgrind), under
//! which this program starts itself once more; without it they are left out.

use haptic_lab::accuracy::{self, Extent, Tables, Target, cases};
use haptic_lab::cost::{self, CountError, Probe, SceneCost};
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
        [] => {
            let scenes = scenes()?;
            print_scenes(&scenes);
            let laws = accuracy::measure_laws(Extent::REPORT, None, |_| {})?;
            print_targets(&targets(&laws, &scenes)?);
            Ok(())
        }
        [document, folder] => refresh(&of_workspace(document), &of_workspace(folder)),
        _ => Err("expected nothing, or a document and a folder for the plot".into()),
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

fn scenes() -> Result<Vec<SceneCost>, Box<dyn Error>> {
    Ok(cost::measure(count(Probe::Scenes)?.as_deref())?)
}

fn targets(laws: &[accuracy::LawMeasurement], scenes: &[SceneCost]) -> Result<Vec<Target>, Box<dyn Error>> {
    let karnopp = scenes.iter().find(|scene| scene.scene == "Karnopp behind a block");
    let instructions = karnopp.and_then(|scene| scene.instructions);
    Ok(accuracy::targets(laws, instructions)?)
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

fn print_scenes(scenes: &[SceneCost]) {
    let motion = cost::hand();
    let excitations = count(Probe::Excitations).ok().flatten();
    let excitations = cost::measure_excitations(excitations.as_deref()).unwrap_or_default();
    println!("of {} ticks: bytes of state, instructions, ns\n", motion.len() - 1);
    for cost in scenes.iter().chain(&excitations) {
        let instructions = cost
            .instructions
            .map_or_else(|| "-".to_owned(), |count| format!("{count:.0}"));
        println!(
            "{:48} {:>5} {instructions:>6} {:>7.1}",
            cost.scene, cost.state_bytes, cost.median_ns
        );
    }
}

fn print_targets(targets: &[Target]) {
    println!();
    for target in targets {
        let missed = if target.met { "" } else { "  MISSED" };
        println!(
            "{:72} {:>20} {:>24}{missed}",
            target.what, target.target, target.measured
        );
    }
}
