//! `haptic-ctl compare` and `surface`, and the example that goes from a real surface to its rendering and back.

use serde_json::Value;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use system_tests::{binary, ctl, ctl_offline};

fn json(path: &Path) -> Value {
    let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn scene(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes").join(name)
}

fn refused(arguments: &[&str]) -> Output {
    ctl(Path::new("/nonexistent"), arguments)
}

/// What a lab records of a scene's surface under 1 kg.
fn record(directory: &Path, name: &str, seed: &str) -> String {
    let out = directory.join(format!("{name}-{seed}.csv")).display().to_string();
    let scene = scene(name).display().to_string();
    let said = ctl_offline(&["surface", &scene, "--mass", "1", "--seed", seed, "--out", &out]);
    assert!(text(&said.stdout).contains("27001 rows"));
    out
}

#[test]
fn stiffer_surface_differs_by_its_force_levels() {
    let directory = tempfile::tempdir().expect("a directory");
    let (real, other) = (
        record(directory.path(), "aluminium-on-teflon.toml", "1"),
        record(directory.path(), "simulated-friction.toml", "2"),
    );
    let plot = directory.path().join("plot.html");
    let plot_name = plot.display().to_string();
    let said = ctl_offline(&["compare", &real, &other, "--plot", &plot_name, "--json"]);
    let found: Value = serde_json::from_slice(&said.stdout).expect("JSON");
    assert_eq!(found["aligned_by"], "time", "{found}");
    assert!(found["shift_s"].as_f64().expect("a shift").abs() < 0.003, "{found}");
    for direction in ["positive", "negative"] {
        // 2 N and 2 N s/m at 0.1 m/s on the mean against 3.5 N; 2.2 N against 4 N.
        for (level, real, rendered) in [("sliding_force_N", 2.2, 3.5), ("breakaway_force_N", 2.25, 4.05)] {
            let level = &found[level][direction];
            for (name, expected) in [("real_N", real), ("rendered_N", rendered)] {
                let value = level[name].as_f64().expect("a level");
                assert!((value / expected - 1.0).abs() < 0.06, "{direction} {name}: {level}");
            }
        }
    }
    let page = std::fs::read_to_string(&plot).expect("the plot");
    assert!(page.contains("<svg") && page.contains("breakaway") && !page.contains("<script"));
    let shown = text(&ctl_offline(&["compare", &real, &other]).stdout);
    assert!(
        shown.contains("Aligned by time") && shown.contains("sliding"),
        "{shown}"
    );
    // A record is like itself, whatever the noise.
    let again = record(directory.path(), "aluminium-on-teflon.toml", "3");
    let said = ctl_offline(&["compare", &real, &again, "--json"]);
    let found: Value = serde_json::from_slice(&said.stdout).expect("JSON");
    let rms = found["force_rms_difference_N"].as_f64().expect("a number");
    assert!(rms < 0.16, "two sensors of 0.1 N: {found}");
}

#[test]
fn what_cannot_be_compared_is_refused_with_the_reason() {
    let directory = tempfile::tempdir().expect("a directory");
    let line = |name: &str, slope: f64| {
        let rows: String = (0..3000)
            .map(|k| f64::from(k) * 1e-3)
            .map(|t| format!("{t},{},1\n", slope * t))
            .collect();
        let path = directory.path().join(name);
        std::fs::write(&path, format!("t_s,position_m,force_N\n{rows}")).expect("written");
        path.display().to_string()
    };
    let (there, back, still) = (line("there.csv", 0.02), line("back.csv", -0.02), line("still.csv", 0.0));
    for (arguments, code, part) in [
        (vec!["compare", &there, &back], 1, "no motion in common"),
        (
            vec!["compare", &there, &still],
            1,
            "the rendered record holds no motion",
        ),
        (vec!["compare", &there, &back, "--align", "time"], 1, "--align velocity"),
        (
            vec!["compare", &there, &there, "--plot", "plot.png"],
            2,
            ".svg or .html",
        ),
        (vec!["compare", &there, &there, "--mass=-1"], 2, "mass = -1 kg"),
        (vec!["compare", &there, "/nonexistent.csv"], 2, "/nonexistent.csv"),
    ] {
        let output = refused(&arguments);
        assert_eq!(
            output.status.code(),
            Some(code),
            "{arguments:?}: {}",
            text(&output.stderr)
        );
        assert!(text(&output.stderr).contains(part), "{}", text(&output.stderr));
    }
    let output = refused(&["compare", &there, &back, "--json"]);
    let error: Value = serde_json::from_slice(&output.stderr).expect("JSON");
    assert_eq!(error["error"]["code"], "not_comparable");
}

#[test]
fn a_surface_needs_a_block_and_sensible_sensors() {
    let directory = tempfile::tempdir().expect("a directory");
    let out = directory.path().join("real.csv").display().to_string();
    let (on_device, with_block) = (
        scene("stuck-spring-on-the-device.toml").display().to_string(),
        scene("aluminium-on-teflon.toml").display().to_string(),
    );
    for (arguments, part) in [
        (vec!["surface", &on_device, "--out", &out], "no block"),
        (
            vec!["surface", &with_block, "--out", &out, "--noise", "-1"],
            "noise = -1 N",
        ),
        (
            vec!["surface", &with_block, "--out", &out, "--mass", "0"],
            "mass = 0 kg",
        ),
    ] {
        let output = refused(&arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(text(&output.stderr).contains(part), "{}", text(&output.stderr));
        assert!(!Path::new(&out).exists());
    }
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
    let said = format!("{}{}", text(&output.stdout), text(&output.stderr));
    assert!(output.status.success(), "{said}");
    println!("{said}");
    let near = |value: &Value, expected: f64, share: f64| {
        let found = value.as_f64().unwrap_or_else(|| panic!("{value} is no number: {said}"));
        assert!(
            (found / expected - 1.0).abs() <= share,
            "{found} for {expected}: {said}"
        );
    };
    let identified = json(&directory.path().join("identified.json"));
    near(&identified["mass_kg"], 1.0, 0.01);
    let compared = json(&directory.path().join("compare.json"));
    assert_eq!(compared["aligned_by"], "time", "{said}");
    for direction in ["positive", "negative"] {
        near(&identified["dynamic_force_N"][direction], 2.0, 0.01);
        near(&identified["viscous_Ns_per_m"][direction], 2.0, 0.04);
        near(&identified["static_force_N"][direction], 2.2, 0.06);
        for (level, most_percent) in [("sliding_force_N", 1.0), ("breakaway_force_N", 10.0)] {
            let percent = &compared[level][direction]["difference_percent"];
            let percent = percent.as_f64().unwrap_or_else(|| panic!("no {level}: {said}"));
            assert!(
                percent.abs() <= most_percent,
                "{level} {direction}: {percent} %: {said}"
            );
        }
    }
    let rms = compared["force_rms_difference_N"].as_f64().expect("a number");
    assert!(rms < 0.25, "{rms} N: {said}");
    for plot in ["identified.html", "compare.html", "compare.svg"] {
        let plot = std::fs::read_to_string(directory.path().join(plot)).expect("the plot");
        assert!(plot.contains("<svg"), "{said}");
    }
}
