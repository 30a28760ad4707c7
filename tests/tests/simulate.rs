//! `haptic-ctl simulate`: long motions, and what is wrong with a command line, a scene or a motion.

use std::fmt::Write;
use std::process::Command;
use system_tests::{binary, stderr, text};

const SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/simulated-friction.toml");

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
    assert!(output.status.success(), "{}", stderr(&output));
    assert!(
        text(&output.stdout).contains(&format!("{} ticks", rows - 1)),
        "{}",
        text(&output.stdout)
    );
    let written = std::fs::read_to_string(&out).expect("rows");
    assert_eq!(written.lines().count(), rows + 1);
}
