//! `haptic-ctl simulate` along motions in the plane: where a block begins, how the hand's velocity is known, and what is
//! refused.

use std::fmt::Write;
use std::process::{Command, Output};

/// A block under Karnopp's friction.
const KARNOPP: &str = "\
name = \"a block\"
block = { mass = 0.5 }
coupling = { stiffness = 25000, damping = 10 }
[friction]
law = \"karnopp\"
static_force = 4
dynamic_force = 3.5
viscous = 0
velocity_threshold = 0
";

/// Runs it with a scene and a motion; returns what it says and, where it succeeds, its table.
fn simulate(scene: &str, motion: &str, options: &[&str]) -> (Output, Option<String>) {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, text) in [("scene.toml", scene), ("motion.csv", motion)] {
        std::fs::write(folder.path().join(name), text).expect("written");
    }
    let output = Command::new(env!("CARGO_BIN_EXE_haptic-ctl"))
        .args(["simulate", "scene.toml", "--motion", "motion.csv", "--out", "out.csv"])
        .args(options)
        .current_dir(folder.path())
        .output()
        .expect("it starts");
    (output, std::fs::read_to_string(folder.path().join("out.csv")).ok())
}

/// The rows of a run that succeeds.
fn rows(motion: &str, options: &[&str]) -> Vec<Vec<f64>> {
    let (output, table) = simulate(KARNOPP, motion, options);
    let table = table.unwrap_or_else(|| panic!("{output:?}"));
    let row = |line: &str| line.split(',').map(|cell| cell.parse().expect("a number")).collect();
    table.lines().skip(1).map(row).collect()
}

/// What a run that is refused says.
fn refusal(scene: &str, motion: &str, options: &[&str]) -> String {
    let (output, table) = simulate(scene, motion, options);
    assert_eq!((output.status.code(), table), (Some(2), None), "{:?}", output.stderr);
    String::from_utf8(output.stderr).expect("text")
}

/// A circle, by samples every millisecond.
fn circle() -> String {
    let mut text = "t_s,device_position_m,device_velocity_mps,device_position_y_m,device_velocity_y_mps\n".to_owned();
    for tick in 0..300_u32 {
        let t_s = f64::from(tick) * 1e-3;
        let (sine, cosine) = (12.0 * t_s).sin_cos();
        let ([x, y], [vx, vy]) = ([0.03 * cosine, 0.03 * sine], [-0.36 * sine, 0.36 * cosine]);
        writeln!(text, "{t_s},{x},{vx},{y},{vy}").expect("written");
    }
    text
}

#[test]
fn block_begins_where_it_is_put() {
    let placed = rows(
        &circle(),
        &["--block-position", "-0.01,0.002", "--block-velocity", "0.1,-0.2"],
    );
    assert_eq!([placed[0][3], placed[0][9]], [-0.01, 0.002]);
    assert_eq!([placed[0][4], placed[0][10], placed[0][6]], [0.1, -0.2, 1.0]);
    let at_hand = rows(&circle(), &[]);
    assert_eq!([at_hand[0][3], at_hand[0][9], at_hand[0][6]], [0.03, 0.0, 0.0]);
}

#[test]
fn velocities_that_are_missing_are_estimated_by_axis() {
    let without: String = circle()
        .lines()
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            format!("{},{},{}\n", cells[0], cells[1], cells[3])
        })
        .collect();
    for (row, truth) in rows(&without, &[]).iter().zip(rows(&circle(), &[])).skip(200) {
        assert!((row[2] - truth[2]).abs() < 0.01, "{row:?}, {truth:?}");
        assert!((row[8] - truth[8]).abs() < 0.01, "{row:?}, {truth:?}");
    }
}

#[test]
fn what_the_plane_has_not_is_refused_by_name() {
    let lugre = include_str!("../../../scenes/lugre.toml");
    let unequal = KARNOPP.replace("static_force = 4", "static_force = { positive = 5, negative = 4 }");
    let (position, velocity) = ("--block-position", "--block-velocity");
    for (scene, options, parts) in [
        (lugre, &[][..], &["lugre", "karnopp and viscous"][..]),
        (&unequal, &[], &["static_force"]),
        (KARNOPP, &["--scheme", "literal"], &["the scheme `literal`", "exact"]),
        (
            KARNOPP,
            &[position, "0.1"],
            &["position takes X,Y", "two axes", "given: 1"],
        ),
        (KARNOPP, &[velocity, "1,2,3"], &["velocity takes X,Y", "given: 3"]),
        (KARNOPP, &[velocity, "1,inf"], &["block-velocity = inf"]),
    ] {
        let refusal = refusal(scene, &circle(), options);
        for part in parts {
            assert!(refusal.contains(part), "{part}: {refusal}");
        }
    }
    let on_a_line = "t_s,device_position_m,device_velocity_mps\n0,0,0\n0.001,0,0\n";
    let refusal = refusal(KARNOPP, on_a_line, &[position, "0,0"]);
    assert!(
        refusal.contains("one number where the motion has one axis"),
        "{refusal}"
    );
}
