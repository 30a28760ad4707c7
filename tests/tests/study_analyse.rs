//! `haptic-ctl study analyse` on trials from elsewhere and on the folder of a study.

use serde_json::Value;
use std::path::Path;
use system_tests::{ctl_offline, ctl_offline_json, ctl_offline_refused};

const HEADING: &str = "subject,block,resistance,condition,trial,amplitude_m,width_m,end_error_m,movement_time_s,errors";

/// A 300 mm, W 40 mm, and eight movements; worked by hand in haptic-lab's `stats::throughput`.
const WORKED: [(f64, f64); 8] = [
    (-0.006, 0.612),
    (0.003, 0.580),
    (0.011, 0.655),
    (-0.002, 0.701),
    (0.0, 0.590),
    (0.025, 0.640),
    (-0.009, 0.622),
    (0.004, 0.598),
];

fn rows(subject: &str, resistance: &str) -> Vec<String> {
    let row = |(trial, (end_error_m, time_s)): (usize, (f64, f64))| {
        format!(
            "{subject},1,{resistance},c,{},0.3,0.04,{end_error_m},{time_s},0",
            trial + 1
        )
    };
    WORKED.into_iter().enumerate().map(row).collect()
}

fn file(directory: &Path, name: &str, heading: &str, rows: &[String]) -> String {
    let path = directory.join(name);
    std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    std::fs::write(&path, format!("{heading}\n{}\n", rows.join("\n"))).expect("written");
    path.display().to_string()
}

#[test]
fn foreign_trials_give_hand_computed_throughput_in_any_order() {
    let directory = tempfile::tempdir().expect("a directory");
    let mut all = rows("x", "drag");
    let name = file(directory.path(), "trials.csv", HEADING, &all);
    let found = ctl_offline_json(&["study", "analyse", &name]);
    for (field, by_hand, within) in [
        ("effective_amplitude_m", 0.306, 1e-9),
        ("effective_width_m", 0.044_387_371, 1e-8),
        ("effective_id_bit", 2.980_730, 1e-6),
        ("throughput_bit_per_s", 4.771_076, 1e-6),
    ] {
        for value in [
            &found[field],
            &found["by_resistance"][0][field],
            &found["sequences"][0][field],
        ] {
            let value = value.as_f64().unwrap_or_else(|| panic!("{field}: {found}"));
            assert!((value - by_hand).abs() < within, "{field}: {value}");
        }
    }
    assert_eq!(found["error_rate"], 0.125);
    all.reverse();
    let reversed = file(directory.path(), "reversed.csv", HEADING, &all);
    assert_eq!(ctl_offline_json(&["study", "analyse", &reversed]), found);
}

#[test]
fn the_tables_fit_a_terminal_and_the_files_are_not_replaced() {
    let directory = tempfile::tempdir().expect("a directory");
    let names = ["baseline", "high stiction", "real", "simulated", "viscous"];
    let all: Vec<String> = names.into_iter().flat_map(|name| rows("x", name)).collect();
    let name = file(directory.path(), "trials.csv", HEADING, &all);
    let out = directory.path().join("out");
    let out_name = out.display().to_string();
    let arguments = ["study", "analyse", &name, "--out", &out_name];
    let shown = String::from_utf8(ctl_offline(&arguments).stdout).expect("text");
    assert!(
        shown.contains("Throughput by ISO 9241-411") && shown.contains("Table 3"),
        "{shown}"
    );
    let wide = shown
        .lines()
        .take_while(|line| !line.starts_with("not found"))
        .find(|line| line.chars().count() > 80);
    assert_eq!(wide, None);
    let page = std::fs::read_to_string(out.join("analysis.html")).expect("the page");
    assert!(page.contains("prefers-color-scheme:dark") && page.contains("real: time against errors"));
    for name in [
        "table-3-time.csv",
        "table-3-time.md",
        "table-3-time.tex",
        "difficulty.svg",
        "quadrants-errors.svg",
    ] {
        assert!(out.join(name).exists(), "{name}");
    }
    std::fs::write(out.join("sequences.csv"), "mine").expect("written");
    ctl_offline_refused(&arguments, 2, &["exists; --force replaces it"]);
    assert_eq!(std::fs::read(out.join("sequences.csv")).expect("it is there"), b"mine");
    let replaced = ctl_offline(&[&arguments[..], &["--force"]].concat());
    assert!(!replaced.stdout.is_empty());
    assert_ne!(std::fs::read(out.join("sequences.csv")).expect("it is there"), b"mine");
}

#[test]
fn a_wrong_file_is_refused_with_line_column_and_value() {
    let directory = tempfile::tempdir().expect("a directory");
    let all: Vec<String> = rows("x", "drag")
        .iter()
        .map(|row| row.replace(",0.655,", ",soon,"))
        .collect();
    let word = file(directory.path(), "word.csv", HEADING, &all);
    let begun = directory.path().join("begun").display().to_string();
    drop(ctl_offline(&[
        "study", "new", "fitts", "--codes", "P1", "--out", &begun,
    ]));
    let bare = file(
        directory.path(),
        "bare.csv",
        "subject,case,level_N",
        &["x,A,1".to_owned()],
    );
    let missing = "no column `method`, `trial`, `base_static_N`, `base_dynamic_N`, `comparison_static_N`, \
                   `comparison_dynamic_N`, `comparison_first`, `answer`, `correct`";
    for (arguments, part) in [
        (vec![bare.as_str()], missing),
        (vec![word.as_str()], "line 4: movement_time_s = `soon`"),
        (vec!["/nonexistent.csv"], "/nonexistent.csv"),
        (vec![begun.as_str()], "no trials: a study has them in data/"),
        (vec![], "<DIR|FILE>"),
    ] {
        ctl_offline_refused(&[&["study", "analyse"], &arguments[..]].concat(), 2, &[part]);
    }
}

#[test]
fn a_folder_under_way_is_analysed_as_far_as_it_goes() {
    let directory = tempfile::tempdir().expect("a directory");
    for subject in ["01", "02"] {
        let name = format!("data/subject-{subject}/session-01/subject-{subject}_session-01_task-fitts_data.csv");
        file(directory.path(), &name, HEADING, &rows(subject, "drag"));
    }
    // Practice does not count, and neither does a row that is being written.
    let practice = "data/subject-02/session-01/subject-02_session-01_task-fitts_practice.csv";
    file(directory.path(), practice, HEADING, &["nonsense".to_owned()]);
    let last = directory
        .path()
        .join("data/subject-02/session-01/subject-02_session-01_task-fitts_data.csv");
    let text = std::fs::read_to_string(&last).expect("rows");
    std::fs::write(&last, format!("{text}02,1,drag,c,9,0.3,0.0")).expect("written");
    let found = ctl_offline_json(&["study", "analyse", &directory.path().display().to_string()]);
    assert_eq!(
        (&found["trials"], &found["subject_count"]),
        (&Value::from(16), &Value::from(2))
    );
    let of_others = ["1,20-29", "2,30-39"].map(str::to_owned);
    file(directory.path(), "subjects.csv", "subject,age_band", &of_others);
    let found = ctl_offline_json(&["study", "analyse", &directory.path().display().to_string()]);
    let notes = found["notes"].to_string();
    assert!(
        notes.contains("no row of subject 01, 02, whose fields are empty"),
        "{notes}"
    );
}

#[test]
fn simulated_study_analysis_shows_movement_per_resistance() {
    let parent = tempfile::tempdir().expect("a directory");
    let plan = crate::study::small_plan(parent.path(), 2).display().to_string();
    let [study, out] = ["study", "out"].map(|name| parent.path().join(name).display().to_string());
    let run = [
        "study",
        "run",
        &plan,
        "--operator=simulated",
        "--subjects=1",
        "--out",
        &study,
    ];
    assert!(!ctl_offline(&run).stdout.is_empty());
    let shown = String::from_utf8(ctl_offline(&["study", "analyse", &study, "--out", &out]).stdout).expect("text");
    assert!(shown.contains("note: a model did these trials"), "{shown}");
    assert!(!shown.contains("no trajectory"), "{shown}");
    let page = std::fs::read_to_string(format!("{out}/analysis.html")).expect("the page");
    // The easiest and the hardest condition, each with both resistances.
    assert_eq!(
        page.matches("A movement under each resistance: subject 01").count(),
        2 * 2
    );
    let found = ctl_offline_json(&["study", "analyse", &study]);
    assert_eq!(found["comparisons"][0]["resistances"][0], "real", "{found}");
    assert_eq!(found["comparisons"][0]["rows"].as_array().map(Vec::len), Some(2));
    assert_eq!(
        ctl_offline_json(&["study", "analyse", &format!("{study}/trials.parquet")]),
        found
    );
    // Its trials are not taken for those of another plan.
    let plan = format!("{study}/plan.toml");
    let changed = std::fs::read_to_string(&plan).expect("the plan") + "# changed\n";
    std::fs::write(&plan, changed).expect("written");
    ctl_offline_refused(&["study", "analyse", &study], 2, &["the plan was changed"]);
}
