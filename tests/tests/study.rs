//! `haptic-ctl study`: a whole study by simulated operators, interrupted, and analysed.

use rustix::process::Signal;
use std::fs;
use std::path::{Path, PathBuf};
use system_tests::{
    ctl_command, ctl_offline, ctl_offline_json, ctl_offline_refused, files, plain, process, stderr, text,
};

/// The program's own targeting task, of two conditions, two resistances and two trials a segment.
fn small_plan(folder: &Path) -> PathBuf {
    let plan = text(&ctl_offline(&["study", "plan", "fitts"]).stdout);
    let plan = plan.replace("trials_per_segment = 8", "trials_per_segment = 2");
    let (head, rest) = plan
        .split_once("[[conditions]]\nname = \"3\"")
        .expect("a third condition");
    let (_, resistances) = rest.split_once("[[resistances]]").expect("resistances");
    let (two, _) = resistances.split_once("# 0.5 kg with").expect("a third resistance");
    let path = folder.join("small.toml");
    fs::write(&path, format!("{head}[[resistances]]{two}")).expect("written");
    path
}

/// The tables of a study, but those of its recordings.
fn tables(folder: &Path) -> Vec<PathBuf> {
    let is_table = |file: &PathBuf| {
        file.extension().is_some_and(|ending| ending == "csv") && !file.iter().any(|name| name == "recordings")
    };
    files(folder).into_iter().filter(is_table).collect()
}

#[test]
fn interrupt_ends_study_cleanly_and_second_program_is_refused() {
    let parent = tempfile::tempdir().expect("a folder");
    let folder = parent.path().join("study");
    let run = [
        "study",
        "run",
        "perception",
        "--operator=simulated",
        "--subjects=2",
        "--seed=4",
        "--no-recordings",
        "--out",
    ];
    let mut command = ctl_command(Path::new("/nonexistent"), &[&run[..], &[plain(&folder)]].concat());
    let mut program = command.spawn().expect("it starts");
    let mut until_rows_in = |folder: &Path| {
        let is_filled = |file: &PathBuf| fs::metadata(file).is_ok_and(|file| file.len() > 0);
        while !tables(folder).iter().any(is_filled) {
            assert!(program.try_wait().expect("a state").is_none(), "it ended by itself");
            std::thread::yield_now();
        }
        program.id()
    };
    // Paused as soon as its folder can be found: a busy machine may start a program later than the study ends.
    let id = until_rows_in(&folder);
    process::signal(id, Signal::STOP);
    let second = ["study", "resume", plain(&folder)];
    ctl_offline_refused(&second, 2, &["another program is running this study\n"]);
    process::signal(id, Signal::CONT);
    until_rows_in(&folder.join("data"));
    let ended = process::end(program, Signal::INT);
    assert_eq!(ended.status.code(), Some(130), "{}", stderr(&ended));
    let printed = text(&ended.stdout);
    assert!(
        printed.contains("The study is interrupted; continue with `haptic-ctl study resume "),
        "{printed}"
    );
    assert!(!folder.join("trials.parquet").exists());
    for path in tables(&folder) {
        let bytes = fs::read(&path).expect("a table");
        assert!(bytes.ends_with(b"\n"), "{} ends within a row", path.display());
    }
}

#[test]
fn simulated_study_analysis_shows_movement_per_resistance() {
    let parent = tempfile::tempdir().expect("a directory");
    let plan = small_plan(parent.path()).display().to_string();
    let [study, out] = ["study", "out"].map(|name| parent.path().join(name).display().to_string());
    let run = ["study", "run", &plan, "--operator=simulated", "--subjects=1", "--out"];
    assert!(!ctl_offline(&[&run[..], &[&study]].concat()).stdout.is_empty());
    let analyse = ["study", "analyse", &study, "--out", &out];
    let shown = text(&ctl_offline(&analyse).stdout);
    assert!(shown.contains("note: a model did these trials"), "{shown}");
    assert!(!shown.contains("no trajectory"), "{shown}");
    let page = fs::read_to_string(format!("{out}/analysis.html")).expect("the page");
    // The easiest and the hardest condition, each with both resistances.
    assert_eq!(
        page.matches("A movement under each resistance: subject 01").count(),
        2 * 2
    );
    ctl_offline_refused(&analyse, 2, &["exists; --force replaces it"]);
    let found = ctl_offline_json(&["study", "analyse", &study]);
    assert_eq!(found["comparisons"][0]["resistances"][0], "real", "{found}");
    assert_eq!(found["comparisons"][0]["rows"].as_array().map(Vec::len), Some(2));
    assert_eq!(
        ctl_offline_json(&["study", "analyse", &format!("{study}/trials.parquet")]),
        found
    );
    // Its trials are not taken for those of another plan.
    let plan = format!("{study}/plan.toml");
    let changed = fs::read_to_string(&plan).expect("the plan") + "# changed\n";
    fs::write(&plan, changed).expect("written");
    ctl_offline_refused(&["study", "analyse", &study], 2, &["the plan was changed"]);
}
