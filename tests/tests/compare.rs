//! `haptic-ctl compare` and `surface`, and the example that goes from a real surface to its rendering and back.

use serde_json::Value;
use std::path::Path;
use std::process::{Command, Stdio};
use system_tests::{binary, stderr, text};

fn json(path: &Path) -> Value {
    let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Aluminium on Teflon: what docs/how-to/identify.md claims of it.
#[test]
fn the_example_renders_what_a_lab_has_recorded() {
    if !test_run::has(&["bash"]) || !test_run::is_long_for("a rendering in real time against a lab's record") {
        return;
    }
    let directory = tempfile::tempdir().expect("a directory");
    let hapticd = binary("hapticd");
    let output = Command::new("bash")
        .arg(Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/aluminium-on-teflon.sh"))
        .arg(directory.path())
        .env("HAPTICD_BIN", hapticd.parent().expect("it lies in a directory"))
        .env(
            "HAPTICD_OPTIONS",
            "--stale-ms 500 --control-timeout-ms 5000 --spin-us 0",
        )
        .stdin(Stdio::null())
        .output()
        .expect("bash starts");
    let printed = format!("{}{}", text(&output.stdout), stderr(&output));
    assert!(output.status.success(), "{printed}");
    println!("{printed}");
    let near = |value: &Value, expected: f64, share: f64| {
        let is_near = value
            .as_f64()
            .is_some_and(|found| (found / expected - 1.0).abs() <= share);
        assert!(is_near, "{value} for {expected}: {printed}");
    };
    let identified = json(&directory.path().join("identified.json"));
    near(&identified["mass_kg"], 1.0, 0.01);
    let compared = json(&directory.path().join("compare.json"));
    assert_eq!(compared["aligned_by"], "time", "{printed}");
    for direction in ["positive", "negative"] {
        near(&identified["dynamic_force_N"][direction], 2.0, 0.01);
        near(&identified["viscous_Ns_per_m"][direction], 2.0, 0.04);
        near(&identified["static_force_N"][direction], 2.2, 0.06);
        for (level, most_percent) in [("sliding_force_N", 1.0), ("breakaway_force_N", 10.0)] {
            let percent = compared[level][direction]["difference_percent"].as_f64();
            let is_small = percent.is_some_and(|percent| percent.abs() <= most_percent);
            assert!(is_small, "{level} {direction}: {percent:?} %: {printed}");
        }
    }
    let rms = compared["force_rms_difference_N"].as_f64().expect("a number");
    assert!(rms < 0.25, "{rms} N: {printed}");
    for plot in ["identified.html", "compare.html", "compare.svg"] {
        let plot = std::fs::read_to_string(directory.path().join(plot)).expect("the plot");
        assert!(plot.contains("<svg"), "{printed}");
    }
}
