//! `haptic-ctl simulate`: long motions, and what is wrong with a command line, a scene or a motion.

use std::fmt::Write;
use std::path::Path;
use std::process::{Command, Output};
use system_tests::{binary, ctl};

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/simulated-friction.toml");

fn simulate(directory: &Path, motion: &str, more: &[&str]) -> Output {
    let (motion_file, out) = (directory.join("motion.csv"), directory.join("out.csv"));
    std::fs::write(&motion_file, motion).expect("written");
    let (motion_file, out) = (
        motion_file.to_str().expect("a plain path"),
        out.to_str().expect("a plain path"),
    );
    let basic = ["simulate", SCENE, "--motion", motion_file, "--out", out, "--force"];
    ctl(Path::new("/nonexistent"), &[&basic, more].concat())
}

fn motion(rows: usize) -> String {
    let mut text = String::from("t_s,device_position_m,device_velocity_mps\n");
    for k in 0..rows {
        let t = k as f64 * 1e-3;
        writeln!(text, "{t},{},{}", 0.03 * (6.0 * t).sin(), 0.18 * (6.0 * t).cos()).expect("written");
    }
    text
}

#[test]
fn the_length_of_a_motion_is_no_matter_of_memory() {
    let directory = tempfile::tempdir().expect("a directory");
    let rows = test_run::extent(200_000, 2_000_000);
    let (motion_file, out) = (directory.path().join("motion.csv"), directory.path().join("out.csv"));
    // A recording is read row by row; a table of another program is read whole.
    std::fs::write(&motion_file, format!("# hapticd recording 1\n{}", motion(rows))).expect("written");
    // 16 MiB of data is less than the samples of the short motion take with their rows.
    let output = Command::new("sh")
        .arg("-c")
        .arg("ulimit -d 16384 && exec \"$0\" simulate \"$@\"")
        .arg(binary("haptic-ctl"))
        .arg(SCENE)
        .arg("--motion")
        .arg(&motion_file)
        .arg("--out")
        .arg(&out)
        .output()
        .expect("sh starts");
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(
        text(&output.stdout).contains(&format!("{} ticks", rows - 1)),
        "{}",
        text(&output.stdout)
    );
    let written = std::fs::read_to_string(&out).expect("rows");
    assert_eq!(written.lines().count(), rows + 1);
}

#[test]
fn a_negative_number_with_an_exponent_is_a_number() {
    let directory = tempfile::tempdir().expect("a directory");
    let more = ["--block-position", "-2e-5", "--block-velocity", "-1e-1"];
    let output = simulate(directory.path(), &motion(10), &more);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let rows = std::fs::read_to_string(directory.path().join("out.csv")).expect("rows");
    let begun = rows
        .lines()
        .nth(1)
        .is_some_and(|row| row.starts_with("0,0,0.18,-0.00002,-0.1,") && row.ends_with(",-1"));
    assert!(begun, "{rows}");
}

#[test]
fn a_wrong_motion_is_reported_before_anything_is_written() {
    for (wrong, parts) in [
        (
            format!("# hapticd recording 1\n{}9,0\n", motion(20_000)),
            vec!["line 20003", "2 of 3 cells", "device_velocity_mps"],
        ),
        (
            format!("# hapticd recording 1\n{}9,0,0,7\n", motion(20_000)),
            vec!["line 20003", "4 cells", "3 columns"],
        ),
        (
            "t_s,device_position_m,device_position_m\n0,0,0\n".to_owned(),
            vec!["which is the position", "(column 2)", "(column 3)"],
        ),
    ] {
        let directory = tempfile::tempdir().expect("a directory");
        let output = simulate(directory.path(), &wrong, &[]);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{said}");
        for part in parts {
            assert!(said.contains(part), "`{said}` lacks `{part}`");
        }
        assert!(!directory.path().join("out.csv").exists(), "{said}");
    }
}

#[test]
fn a_scene_value_given_as_text_is_reported_at_its_field() {
    let directory = tempfile::tempdir().expect("a directory");
    let scene = directory.path().join("scene.toml");
    std::fs::write(&scene, "[friction]\nlaw = \"dahl\"\nFd = 3\nsigma = \"1e5\"\n").expect("written");
    let scene = scene.to_str().expect("a plain path");
    let output = ctl(
        Path::new("/nonexistent"),
        &["simulate", scene, "--motion", "/nonexistent.csv", "--out", "/dev/null"],
    );
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(2), "{said}");
    for part in ["line 4, column 9", "sigma = \"1e5\"", "a number"] {
        assert!(said.contains(part), "`{said}` lacks `{part}`");
    }
}
