//! `haptic-ctl study analyse` on trials from elsewhere and on the folder of a study.

use system_tests::{ctl_offline, ctl_offline_json, ctl_offline_refused};

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
    ctl_offline_refused(
        &["study", "analyse", &study, "--out", &out],
        2,
        &["exists; --force replaces it"],
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
