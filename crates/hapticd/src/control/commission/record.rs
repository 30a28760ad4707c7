//! What is kept of a rig that was commissioned: one file a rig, by its serial number, written whole
//! or not at all.
//!
//! A disk may take its time and a mount may hang: both happen [aside](Aside), on one thread, for
//! which nothing waits longer than [`PATIENCE`].

use crate::control::aside::Aside;
use crate::control::connected::Device;
use crate::control::whole_file;
use haptic_ipc::{ErrorCode, WireError, regular_file};
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// How long a disk may take.
const PATIENCE: Duration = Duration::from_secs(1);

/// How old the answer for a status line may be.
const FRESH: Duration = Duration::from_secs(1);

/// The largest file that is read, bytes.
const LARGEST: u64 = 64 * 1024;

/// Letters of a rig's key in the name of its file.
const LONGEST_NAME: usize = 150;

/// A rig's counts agree when their distances differ by no more than this share: they travel as
/// numbers of 32 bits.
const SAME_RESOLUTION: f64 = 1e-6;

/// What was found.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Record {
    /// The rig's key.
    pub(super) rig: String,
    pub(super) firmware: String,
    /// Whether the address turned force and position round.
    pub(super) reversed: bool,
    /// As the device said, m.
    pub(super) resolution_m: f64,
    /// As it was seen, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) step_m: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) range_m: Option<f64>,
    #[serde(default, rename = "friction_N", skip_serializing_if = "Option::is_none")]
    pub(super) friction_n: Option<f64>,
    /// When, in seconds since 1970 (UTC).
    pub(super) time_unix_s: f64,
    /// Who.
    pub(super) by: String,
}

/// What is known of a rig.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::control) enum CommissionState {
    /// It is as it was when it was commissioned.
    Commissioned,
    /// Why it does not count as commissioned.
    Not(String),
}

/// Looks into the files.
#[derive(Debug)]
pub(in crate::control) struct Records {
    /// What was known of the newest connection, and when.
    shown: RefCell<Option<(u64, Instant, CommissionState)>>,
    /// One thread: a disk that hangs must not gather them.
    disk: Aside,
}

impl Default for Records {
    fn default() -> Self {
        Self {
            shown: RefCell::default(),
            disk: Aside::new("record", 1),
        }
    }
}

impl Records {
    /// Works with a file on a thread of its own: a disk that hangs holds up no other work.
    async fn run<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> Result<T, String> + Send + 'static,
    ) -> Result<T, String> {
        if self.disk.is_busy() {
            return Err("the disk is still busy with the last time".to_owned());
        }
        self.disk.run(PATIENCE, work).await.map_err(|error| error.to_string())?
    }

    fn fresh(&self, connection: u64) -> Option<CommissionState> {
        let shown = self.shown.borrow();
        let (of, at, known) = shown.as_ref()?;
        (*of == connection && at.elapsed() < FRESH).then(|| known.clone())
    }

    /// Whether a rig was commissioned, and is as it was then. The answer for a status line may be a
    /// moment old.
    pub(in crate::control) async fn known(
        &self,
        state_dir: &Path,
        device: &Device,
        only_looks: bool,
    ) -> CommissionState {
        if only_looks && let Some(known) = self.fresh(device.connection) {
            return known;
        }
        let path = path_of(state_dir, &device.rig.key);
        let asked = path.clone();
        let known = match self.run(move || read(&asked)).await {
            Ok(None) => CommissionState::Not("it was never commissioned".to_owned()),
            Ok(Some(record)) => difference(&record, device).map_or(CommissionState::Commissioned, CommissionState::Not),
            Err(why) => CommissionState::Not(format!(
                "whether it was commissioned cannot be read: {}: {why}",
                path.display()
            )),
        };
        *self.shown.borrow_mut() = Some((device.connection, Instant::now(), known.clone()));
        known
    }

    /// Keeps what was found; returns its file.
    ///
    /// # Errors
    /// It cannot be written, or not in time.
    pub(super) async fn store(&self, state_dir: &Path, record: Record) -> Result<PathBuf, WireError> {
        let path = path_of(state_dir, &record.rig);
        let to = path.clone();
        let written = self.run(move || write(&to, &record)).await;
        *self.shown.borrow_mut() = None;
        match written {
            Ok(()) => Ok(path),
            Err(why) => Err(WireError::new(
                ErrorCode::StateFile,
                format!("{}: {why}; --state-dir names another place", path.display()),
            )),
        }
    }
}

/// In what a rig differs from what it was when it was commissioned.
fn difference(record: &Record, device: &Device) -> Option<String> {
    if record.rig != device.rig.key {
        return Some(format!("the file of its commissioning is that of {}", record.rig));
    }
    if record.reversed != device.rig.reversed {
        return Some("`direction` in its address is another than when it was commissioned".to_owned());
    }
    let (now_um, then_um) = (device.resolution_m * 1e6, record.resolution_m * 1e6);
    if (now_um - then_um).abs() > SAME_RESOLUTION * then_um.abs() {
        return Some(format!(
            "its resolution is {now_um:.4} um a count, and was {then_um:.4} um when it was commissioned"
        ));
    }
    // Without a serial number another device may be at the same place.
    if !device.rig.has_serial_number && record.firmware != device.firmware {
        return Some(format!(
            "its firmware is `{}`, and was `{}` when it was commissioned; it has no serial number to tell it by",
            device.firmware, record.firmware
        ));
    }
    None
}

fn read(path: &Path) -> Result<Option<Record>, String> {
    let text = match regular_file::read_text_of(path, LARGEST) {
        Ok(text) => text,
        Err(error) => {
            return match error.kind() {
                ErrorKind::NotFound => Ok(None),
                ErrorKind::InvalidInput | ErrorKind::FileTooLarge => {
                    Err(format!("it is not a file of at most {LARGEST} bytes: {error}"))
                }
                _ => Err(error.to_string()),
            };
        }
    };
    toml::from_str(&text).map(Some).map_err(|error| error.to_string())
}

fn write(path: &Path, record: &Record) -> Result<(), String> {
    let text = toml::to_string(record).map_err(|error| error.to_string())?;
    let text = format!(
        "# What `haptic-ctl commission` found. Without this file the rig counts as never commissioned.\n{text}"
    );
    std::fs::create_dir_all(path.parent().unwrap_or(Path::new(".")))
        .and_then(|()| whole_file::write(path, &text, true))
        .map_err(|error| error.to_string())
}

/// The file of a rig. Its key may hold anything that a device says of itself: a byte that is not a
/// plain letter is written as a number.
fn path_of(state_dir: &Path, key: &str) -> PathBuf {
    let mut name = String::new();
    for byte in key.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' => name.push(char::from(byte)),
            _ => name.push_str(&format!("%{byte:02x}")),
        }
    }
    if name.len() > LONGEST_NAME {
        // FNV-1a of the whole key; which rig a file is of stands in it, too.
        let hash = key.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3)
        });
        name.truncate(LONGEST_NAME);
        name.push_str(&format!("-{hash:016x}"));
    }
    state_dir.join("commissioned").join(format!("{name}.toml"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use device_io::link::RigIdentity;

    fn device() -> Device {
        Device {
            firmware: "mine 1.0".to_owned(),
            force_limit_n: 20.0,
            resolution_m: 1e-5,
            watchdog_ms: Some(50),
            rig: RigIdentity {
                key: "serial-/dev/ttyACM0".to_owned(),
                has_serial_number: false,
                reversed: false,
            },
            connection: 1,
        }
    }

    fn record() -> Record {
        Record {
            rig: device().rig.key,
            firmware: device().firmware,
            reversed: false,
            resolution_m: 1e-5,
            step_m: Some(1e-5),
            range_m: None,
            friction_n: Some(0.8),
            time_unix_s: 1.0,
            by: "ada".to_owned(),
        }
    }

    #[test]
    fn what_is_written_is_read_and_what_is_none_of_it_is_told() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = path_of(directory.path(), "usb-1209:0001-../../etc/x");
        assert_eq!(path.parent(), Some(directory.path().join("commissioned").as_path()));
        assert_eq!(read(&path), Ok(None));
        write(&path, &record()).expect("it can be written");
        assert_eq!(read(&path), Ok(Some(record())));
        std::fs::write(&path, "rig = 3").expect("written");
        assert!(read(&path).is_err());
        let endless = Path::new("/dev/zero");
        assert!(read(endless).expect_err("no file").contains("not a file"));
        let fifo = directory.path().join("fifo");
        rustix::fs::mknodat(
            rustix::fs::CWD,
            &fifo,
            rustix::fs::FileType::Fifo,
            rustix::fs::Mode::from_raw_mode(0o600),
            0,
        )
        .expect("a fifo");
        assert!(read(&fifo).expect_err("nobody writes it").contains("not a file"));
    }

    #[test]
    fn names_of_files_are_short_and_differ() {
        let long = |letter: &str| path_of(Path::new("/s"), &letter.repeat(4000));
        let name = long("/").file_name().expect("a name").len();
        assert!(name <= 200, "{name}");
        assert_ne!(
            path_of(Path::new("/s"), &format!("{}a", "x".repeat(200))),
            path_of(Path::new("/s"), &format!("{}b", "x".repeat(200)))
        );
    }

    #[test]
    fn a_rig_that_is_another_now_is_told_by_what_has_changed() {
        assert_eq!(difference(&record(), &device()), None);
        let nearly = Device {
            resolution_m: f64::from(1.0 / (1e5_f32)),
            ..device()
        };
        assert_eq!(difference(&record(), &nearly), None, "rounded on the wire");
        let finer = Device {
            resolution_m: 0.5e-5,
            ..device()
        };
        assert!(difference(&record(), &finer).expect("another").contains("5.0000 um"));
        let mut turned = device();
        turned.rig.reversed = true;
        assert!(difference(&record(), &turned).expect("another").contains("direction"));
        let mut other = Device {
            firmware: "theirs 2".to_owned(),
            ..device()
        };
        assert!(difference(&record(), &other).expect("another").contains("theirs 2"));
        other.rig.has_serial_number = true;
        assert_eq!(difference(&record(), &other), None, "an update");
    }
}
