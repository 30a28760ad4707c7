//! `haptic-ctl simulate` along motions in the plane: against the stored references, and against the line.

use std::fmt::Write;
use std::path::{Path, PathBuf};
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

/// A folder with a scene and a motion.
struct Bench {
    folder: tempfile::TempDir,
}

impl Bench {
    fn new(scene: &str, motion: &str) -> Self {
        let bench = Self {
            folder: tempfile::tempdir().expect("a folder"),
        };
        std::fs::write(bench.path("scene.toml"), scene).expect("written");
        std::fs::write(bench.path("motion.csv"), motion).expect("written");
        bench
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn simulate(&self, options: &[&str]) -> Output {
        Command::new(env!("CARGO_BIN_EXE_haptic-ctl"))
            .args(["simulate", "--force"])
            .arg(self.path("scene.toml"))
            .arg("--motion")
            .arg(self.path("motion.csv"))
            .arg("--out")
            .arg(self.path("out.csv"))
            .arg("--events")
            .arg(self.path("events.csv"))
            .args(options)
            .output()
            .expect("it starts")
    }

    /// The table of a run that succeeds: its header and its rows.
    fn rows(&self, options: &[&str]) -> (String, Vec<Vec<f64>>) {
        let output = self.simulate(options);
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        table(&self.path("out.csv"))
    }

    /// What a run that is refused says.
    fn refusal(&self, options: &[&str]) -> String {
        let output = self.simulate(options);
        assert_eq!(output.status.code(), Some(2), "{output:?}");
        assert!(!self.path("out.csv").exists());
        String::from_utf8(output.stderr).expect("text")
    }
}

fn table(path: &Path) -> (String, Vec<Vec<f64>>) {
    let text = std::fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut lines = text.lines();
    let header = lines.next().unwrap_or_default().to_owned();
    let row = |line: &str| line.split(',').map(|cell| cell.parse().expect("a number")).collect();
    (header, lines.map(row).collect())
}

const IN_THE_PLANE: &str = "t_s,device_position_m,device_velocity_mps,device_position_y_m,device_velocity_y_mps\n";

/// Samples every millisecond: place and velocity.
fn motion(ticks: u32, hand: impl Fn(f64) -> ([f64; 2], [f64; 2])) -> String {
    let mut text = IN_THE_PLANE.to_owned();
    for tick in 0..ticks {
        let t_s = f64::from(tick) * 1e-3;
        let ([x, y], [vx, vy]) = hand(t_s);
        writeln!(text, "{t_s},{x},{vx},{y},{vy}").expect("written");
    }
    text
}

fn circle() -> String {
    motion(300, |t_s| {
        let (sine, cosine) = (12.0 * t_s).sin_cos();
        ([0.03 * cosine, 0.03 * sine], [-0.36 * sine, 0.36 * cosine])
    })
}

#[test]
fn block_begins_where_it_is_put() {
    let bench = Bench::new(KARNOPP, &circle());
    let (_, rows) = bench.rows(&["--block-position", "-0.01,0.002", "--block-velocity", "0.1,-0.2"]);
    assert_eq!([rows[0][3], rows[0][9]], [-0.01, 0.002]);
    assert_eq!([rows[0][4], rows[0][10], rows[0][6]], [0.1, -0.2, 1.0]);
    let (_, rows) = bench.rows(&[]);
    assert_eq!([rows[0][3], rows[0][9], rows[0][6]], [0.03, 0.0, 0.0]);
}

#[test]
fn velocities_that_are_missing_are_estimated_by_axis() {
    let bench = Bench::new(KARNOPP, &circle());
    let (_, whole) = bench.rows(&[]);
    let without: String = circle()
        .lines()
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            format!("{},{},{}\n", cells[0], cells[1], cells[3])
        })
        .collect();
    let (_, estimated) = Bench::new(KARNOPP, &without).rows(&[]);
    for (row, truth) in estimated.iter().zip(&whole).skip(200) {
        assert!((row[2] - truth[2]).abs() < 0.01, "{row:?}, {truth:?}");
        assert!((row[8] - truth[8]).abs() < 0.01, "{row:?}, {truth:?}");
    }
}

#[test]
fn what_the_plane_has_not_is_refused_by_name() {
    let lugre = include_str!("../../../scenes/lugre.toml");
    let unequal = KARNOPP.replace("static_force = 4", "static_force = { positive = 5, negative = 4 }");
    for (scene, options, parts) in [
        (lugre, &[][..], &["lugre", "karnopp and viscous"][..]),
        (&unequal, &[], &["static_force"]),
        (KARNOPP, &["--scheme", "literal"], &["the scheme `literal`", "exact"]),
        (
            KARNOPP,
            &["--block-position", "0.1"],
            &["--block-position takes X,Y", "two axes", "given: 1"],
        ),
        (
            KARNOPP,
            &["--block-velocity", "1,2,3"],
            &["--block-velocity takes X,Y", "given: 3"],
        ),
        (KARNOPP, &["--block-velocity", "1,inf"], &["block-velocity = inf"]),
    ] {
        let refusal = Bench::new(scene, &circle()).refusal(options);
        for part in parts {
            assert!(refusal.contains(part), "{part}: {refusal}");
        }
    }
    let on_a_line = "t_s,device_position_m,device_velocity_mps\n0,0,0\n0.001,0,0\n";
    let refusal = Bench::new(KARNOPP, on_a_line).refusal(&["--block-position", "0,0"]);
    assert!(
        refusal.contains("one number where the motion has one axis"),
        "{refusal}"
    );
}
