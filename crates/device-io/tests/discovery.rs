//! Asking what is at an address who it is, against the fake rig behind a pseudo-terminal.

use device_io::Address;
use device_io::discovery::probe;
use device_io::link::{ConnectError, DeviceInfo};
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::{Mutex, PoisonError};

/// A fake rig, which ends with the test.
struct FakeRig {
    child: Child,
    link: PathBuf,
}

impl FakeRig {
    fn start(folder: &Path, arguments: &[&str]) -> Self {
        let link = folder.join("rig");
        let mut child = Command::new(env!("CARGO_BIN_EXE_fake-rig"))
            .arg("--pty")
            .arg(&link)
            .args(arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("it starts");
        let mut line = String::new();
        let stdout = child.stdout.take().expect("it is piped");
        BufReader::new(stdout)
            .read_line(&mut line)
            .expect("it says where it is");
        assert!(line.starts_with("fake-rig: "), "{line}");
        Self { child, link }
    }

    fn address(&self) -> String {
        format!("serial:{}", self.link.display())
    }
}

impl Drop for FakeRig {
    fn drop(&mut self) {
        drop(self.child.kill());
        drop(self.child.wait());
    }
}

fn ask(address: &str) -> Result<DeviceInfo, ConnectError> {
    let address: Address = address.parse().expect("an address");
    probe(&mut *address.connector().expect("not the rig in this process"))
}

/// While one test forks, its child holds the lines that the other has open, and their locks.
static ALONE: Mutex<()> = Mutex::new(());

#[test]
fn a_rig_says_who_it_is() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = tempfile::tempdir().expect("a folder");
    let rig = FakeRig::start(folder.path(), &["--force-limit-n", "7", "--sample-rate-hz", "500"]);
    // And once more: the first has let go of it.
    for _ in 0..2 {
        let facts = ask(&rig.address()).expect("it answers");
        assert!(facts.firmware.starts_with("fake-rig "), "{facts:?}");
        assert_eq!((facts.force_limit_n, facts.sample_rate_hz), (7.0, 500.0));
        assert!((facts.resolution_m - 10e-6).abs() < 1e-9, "{facts:?}");
    }
}

#[test]
fn why_a_rig_does_not_answer_is_distinguished() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let folder = tempfile::tempdir().expect("a folder");
    let nothing = format!("serial:{}", folder.path().join("nothing").display());
    assert!(matches!(ask(&nothing), Err(ConnectError::Absent { .. })));
    assert!(matches!(ask("hid:0000:0000"), Err(ConnectError::Absent { .. })));

    for (option, value, words) in [
        ("--fault", "version 9", "version 9"),
        ("--fault", "loss 1", "nothing answers"),
    ] {
        let other = FakeRig::start(folder.path(), &[option, value]);
        let Err(ConnectError::Protocol { problem, .. }) = ask(&other.address()) else {
            panic!("{value}");
        };
        assert!(problem.contains(words), "{problem}");
    }

    let rig = FakeRig::start(folder.path(), &[]);
    let line = rig.link.canonicalize().expect("it is there");
    let held = serialport::new(line.to_string_lossy(), 1_000_000)
        .open_native()
        .expect("nobody has it");
    let Err(ConnectError::Refused { remedy, .. }) = ask(&rig.address()) else {
        panic!("it is in use");
    };
    assert!(remedy.contains("another program has it open"), "{remedy}");
    drop(held);
    ask(&rig.address()).expect("it is free again");
}
