//! The reference firmware on a simulated microcontroller, whose motor pulls a simulated handle:
//! everything of a rig but the copper.

use crate::process::Killed;
use serde_json::Value;
use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{ChildStdin, ChildStdout, Command, Stdio};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Of the firmware's own watchdog, s; it counts whole milliseconds.
pub const WATCHDOG_S: f64 = 0.050;

/// What the position is measured with.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoder {
    /// A quadrature encoder on the motor's shaft.
    Quadrature,
    /// The Hapkit's magneto-resistive sensor.
    Magneto,
}

impl Encoder {
    /// As the firmware's Makefile calls it.
    pub fn name(self) -> &'static str {
        match self {
            Self::Quadrature => "quadrature",
            Self::Magneto => "magneto",
        }
    }
}

/// Where the firmware's sources are.
pub fn firmware_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../firmware")
}

/// Whether there are these programs, each with the Debian packages that bring it; a skip for the first that is missing.
pub fn has_tools(tools: &[(&str, &str)]) -> bool {
    tools
        .iter()
        .all(|(program, packages)| is_there(program, packages, test_run::is_there(program)))
}

/// Passes on whether something is there, with a skip and its Debian packages where it is not.
pub fn is_there(what: &str, packages: &str, is_there: bool) -> bool {
    if !is_there {
        test_run::skip(what, &format!("Debian: apt install {packages}"));
    }
    is_there
}

/// Makes what the firmware's Makefile calls so, with what it is to know.
pub fn make(what: &str, known: &[&str]) {
    let made = Command::new("make")
        .args(["--silent", what])
        .args(known)
        .current_dir(firmware_folder())
        .status()
        .expect("make runs");
    assert!(made.success(), "{what} is made");
}

/// How often a check is made at most.
const TRIES: usize = 3;

/// Makes a check of a rig, and again where it fails and prints that its computer stood still. Whether it could be made.
///
/// # Panics
/// The rig is not as it should be.
pub fn tried(check: impl Fn() -> Option<(bool, String)>) -> bool {
    for tries_left in (0..TRIES).rev() {
        let Some((is_right, printed)) = check() else {
            return false;
        };
        if is_right {
            break;
        }
        assert!(
            tries_left > 0 && printed.contains("this computer stood still"),
            "it is not as it should be: {printed}"
        );
    }
    true
}

/// Runs one of the firmware's tests in Python.
pub fn firmware_test(script: &str, arguments: &[&str]) {
    tried(|| Some(python(&format!("tests/{script}"), arguments)));
}

/// Runs a script of the firmware's, and prints what it prints: whether it succeeds, and that.
fn python(script: &str, arguments: &[&str]) -> (bool, String) {
    let output = Command::new("python3")
        .arg(firmware_folder().join(script))
        .args(arguments)
        .output()
        .expect("python3 starts");
    let printed = [output.stdout, output.stderr].map(|printed| String::from_utf8_lossy(&printed).into_owned());
    println!("{script} {arguments:?}\n{}{}", printed[0], printed[1]);
    (output.status.success(), printed.concat())
}

/// Whether a device is as the protocol wants it, by the checker for writers of firmware, and what that prints; nothing
/// where it cannot be run, which is printed.
pub fn checked(line: &Path, arguments: &[&str]) -> Option<(bool, String)> {
    let line = line.to_str().expect("a path of ours");
    test_run::has(&["python3"]).then(|| python("check_rig.py", &[&[line], arguments].concat()))
}

/// A device passes all checks, pushed by so many newtons; its times are those of a busy machine. Whether that could be
/// tried.
pub fn conforms(line: &Path, push_n: &str) -> bool {
    tried(|| checked(line, &["--slow", "2", "--push", push_n]))
}

/// The simulator and the firmware for an encoder, built into a folder; nothing in the short run and where the tools
/// are missing, which is printed.
fn built(encoder: Encoder, folder: &Path) -> Option<(PathBuf, PathBuf)> {
    if !test_run::is_long_for("the firmware as machine code on a simulated microcontroller") {
        return None;
    }
    let headers = [
        ("avr-libc", "avr-libc", "/usr/lib/avr/include/avr/io.h"),
        ("libsimavr", "libsimavr-dev", "/usr/include/simavr/sim_avr.h"),
        ("libelf", "libelf-dev", "/usr/include/libelf.h"),
    ];
    if !has_tools(&[("avr-gcc", "gcc-avr"), ("make", "make"), ("cc", "gcc")])
        || !headers
            .iter()
            .all(|(what, packages, header)| is_there(what, packages, Path::new(header).exists()))
    {
        return None;
    }
    let encoder_is = format!("ENCODER={}", encoder.name());
    make("all", &[&encoder_is, &format!("BUILD={}", folder.display())]);
    Some((
        folder.join("simulator"),
        folder.join(encoder.name()).with_extension("elf"),
    ))
}

/// A running simulated rig. It ends with the test, and there is one at a time.
#[derive(Debug)]
pub struct SimulatedRig {
    _child: Killed,
    orders: ChildStdin,
    answers: BufReader<ChildStdout>,
    line: PathBuf,
    _directory: tempfile::TempDir,
    _alone: MutexGuard<'static, ()>,
}

impl SimulatedRig {
    /// Builds the firmware into a folder and switches the rig on, with more arguments for the
    /// simulator; nothing where the tools to build it are missing.
    pub fn start(encoder: Encoder, folder: &str, arguments: &[&str]) -> Option<Self> {
        // They keep to real time, and a machine has not the processors for many at once. Nor may
        // two be built at once.
        static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
        let alone = ONE_AT_A_TIME.lock().unwrap_or_else(PoisonError::into_inner);
        let (simulator, firmware) = built(encoder, &Path::new(folder).join("firmware"))?;
        let directory = tempfile::tempdir().expect("a directory");
        let line = directory.path().join("rig");
        let mut child = Command::new(simulator)
            .arg(firmware)
            .arg("--pty")
            .arg(&line)
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("the simulator starts");
        let orders = child.stdin.take().expect("it is piped");
        let answers = BufReader::new(child.stdout.take().expect("it is piped"));
        let mut rig = Self {
            _child: Killed(child),
            orders,
            answers,
            line,
            _directory: directory,
            _alone: alone,
        };
        // An answer means that its line is there.
        rig.stats();
        Some(rig)
    }

    /// Its serial line.
    pub fn line(&self) -> &Path {
        &self.line
    }

    /// What has happened on its pins, since it was switched on or [`Self::clear`].
    pub fn stats(&mut self) -> Value {
        self.ask("stats")
    }

    /// Begins all sums and maxima of [`Self::stats`] again.
    pub fn clear(&mut self) {
        self.order("clear");
    }

    /// Carries out an order of the simulator's: `hang HOW`, `cut`.
    pub fn order(&mut self, order: &str) {
        let answer = self.ask(order);
        assert_eq!(answer["done"], true, "{order}");
    }

    fn ask(&mut self, order: &str) -> Value {
        writeln!(self.orders, "{order}").expect("it listens");
        let mut line = String::new();
        self.answers.read_line(&mut line).expect("it answers");
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{line}: {error}"))
    }

    /// Lets some of its own time go by, s; returns the statistics.
    pub fn live(&mut self, time_s: f64) -> Value {
        let until_s = number(&self.stats(), "/time_s") + time_s;
        self.ask(&format!("until {until_s}"))
    }
}

/// A number in the statistics, by its JSON pointer.
pub fn number(stats: &Value, pointer: &str) -> f64 {
    let value = stats.pointer(pointer).and_then(Value::as_f64);
    value.unwrap_or_else(|| panic!("no {pointer} in {stats}"))
}
