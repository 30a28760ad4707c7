//! `haptic-ctl identify FILE`.

use haptic_core::Directional;
use haptic_core::friction::{Friction, Karnopp};
use haptic_lab::identify::study::{Experiment, Movement, Truth};
use serde_json::Value;
use std::fmt::Write;
use std::path::{Path, PathBuf};
use system_tests::{Daemon, ctl, ctl_offline_json, is_refused, plain};

/// A record of 0.5 kg on a known surface, as a lab with its own names, units and signs writes it.
fn write(directory: &Path, movements: Option<&[Movement]>) -> PathBuf {
    let mut experiment = Experiment::thorough(Truth {
        mass_kg: 0.5,
        friction: Friction::Karnopp(Karnopp {
            viscous: Directional::both(10.0),
            ..Karnopp::new(5.0, 3.5)
        }),
        offset_n: 0.0,
    });
    if let Some(movements) = movements {
        experiment = experiment.with_movements(movements);
    }
    let record = experiment.record(1).expect("it can be rendered");
    let mut text = "# bench 3\nclock (ms);encoder;load cell\n".to_owned();
    for ((t, x), force) in record.t_s.iter().zip(&record.position_m).zip(&record.force_n) {
        writeln!(text, "{};{};{}", 1e3 * t + 500.0, -1e6 * x, -force / 4.0).expect("a string takes it");
    }
    let path = directory.join("bench.csv");
    std::fs::write(&path, text).expect("written");
    path
}

const COLUMNS: [&str; 8] = [
    "identify",
    "--model=karnopp",
    "--time-column=clock (ms)",
    "--position-column=encoder",
    "--position-gain=-1e-6",
    "--force-column=load cell",
    "--force-gain=-4",
    "--directions=auto",
];

#[test]
fn a_labs_record_becomes_a_scene_that_the_daemon_renders() {
    let directory = tempfile::tempdir().expect("a directory");
    let (file, scene) = (write(directory.path(), None), directory.path().join("bench.toml"));
    let found = ctl_offline_json(&[&COLUMNS[..], &[plain(&file), "--out", plain(&scene)]].concat());
    assert_eq!(found["model"], "karnopp");
    let near = |value: &Value, truth: f64, within: f64| {
        let value = value.as_f64().expect("a number");
        assert!((value - truth).abs() < within, "{value} for {truth}: {found}");
    };
    near(&found["mass_kg"], 0.5, 0.005);
    near(&found["offset_N"], 0.0, 0.02);
    near(&found["residual_rms_N"], 0.0, 0.1);
    for (name, truth, within) in [
        ("dynamic_force_N", 3.5, 0.0175),
        ("viscous_Ns_per_m", 10.0, 0.1),
        ("static_force_N", 5.0, 0.25),
    ] {
        for direction in ["positive", "negative"] {
            near(&found[name][direction], truth, within);
            let interval = &found["intervals"][format!("{name}.{direction}")];
            assert!(interval[0].as_f64() < interval[1].as_f64(), "{found}");
        }
    }
    assert_eq!(found["refused"], serde_json::json!([]));

    let written = std::fs::read_to_string(&scene).expect("a scene");
    assert!(written.starts_with("# Identified from"), "{written}");
    let daemon = Daemon::start(&[]);
    daemon.ctl_ok(&["scene", "load", plain(&scene)]);
    near(&daemon.ctl_json(&["get"])["scene"]["block"]["mass"], 0.5, 0.005);

    let slow = [Movement::Ramp {
        speed_mps: 0.05,
        stroke_m: 0.05,
        duration_s: 15.0,
    }];
    let (file, scene) = (write(directory.path(), Some(&slow)), directory.path().join("none.toml"));
    let output = ctl(
        Path::new("/nonexistent"),
        &[&COLUMNS[..], &["--json", plain(&file), "--out", plain(&scene)]].concat(),
    );
    is_refused("a slow motion", &output, 1, &["is not written"]);
    let found: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert!(found["refused"].to_string().contains("\"viscous_Ns_per_m\""), "{found}");
    assert!(
        found["viscous_Ns_per_m"].is_null() && found["refused"][0]["instead"].is_string(),
        "{found}"
    );
    assert!(!scene.exists(), "no scene of half a surface");
}
