//! The records of commissioned rigs: one file a rig, by its serial number, written whole or not at
//! all.
//!
//! A disk may be slow and a mount may hang, so files are read and written on a [`WorkerPool`] of
//! one thread, which nothing waits for longer than [`DISK_TIMEOUT`].

use crate::control::connected_device::ConnectedDevice;
use crate::control::whole_file;
use crate::control::worker_pool::WorkerPool;
use haptic_ipc::{ErrorCode, WireError, regular_file};
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Timeout of a disk.
const DISK_TIMEOUT: Duration = Duration::from_secs(1);

/// Largest age of a cached answer.
const LONGEST_CACHED: Duration = Duration::from_secs(1);

/// Largest file that is read, bytes.
const LARGEST_FILE: u64 = 64 * 1024;

/// Most letters of a rig's key in the name of its file.
const LONGEST_NAME: usize = 150;

/// Relative tolerance of a resolution: it travels as a number of 32 bits.
const SAME_RESOLUTION: f64 = 1e-6;

/// The findings of a commissioning.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Record {
    /// The rig's key.
    pub(super) rig: String,
    pub(super) firmware: String,
    /// Whether the address reversed force and position.
    pub(super) reversed: bool,
    /// The resolution that the device reported, m.
    pub(super) resolution_m: f64,
    /// The smallest step of its position that was observed, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) step_m: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) range_m: Option<f64>,
    #[serde(default, rename = "friction_N", skip_serializing_if = "Option::is_none")]
    pub(super) friction_n: Option<f64>,
    /// Time of the commissioning, seconds since 1970 (UTC).
    pub(super) time_unix_s: f64,
    /// The client that commissioned the rig.
    pub(super) by: String,
}

/// Whether a rig is commissioned.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::control) enum CommissionState {
    /// It was commissioned, and has not changed since.
    Commissioned,
    /// Why it does not count as commissioned.
    Not(String),
}

/// Reads and writes the records.
#[derive(Debug)]
pub(in crate::control) struct Records {
    /// The newest answer, with its connection and time.
    cached: RefCell<Option<(u64, Instant, CommissionState)>>,
    /// One thread, so that a disk that hangs holds up only one.
    disk: WorkerPool,
}

impl Default for Records {
    fn default() -> Self {
        Self {
            cached: RefCell::default(),
            disk: WorkerPool::new("record", 1),
        }
    }
}

impl Records {
    /// Accesses a file on the worker thread: a disk that hangs holds up no other work.
    async fn run<T: Send + 'static>(
        &self,
        work: impl FnOnce() -> Result<T, String> + Send + 'static,
    ) -> Result<T, String> {
        if self.disk.is_busy() {
            return Err("the disk is still busy with the previous access".to_owned());
        }
        self.disk
            .run(DISK_TIMEOUT, work)
            .await
            .map_err(|error| error.to_string())?
    }

    fn fresh(&self, connection: u64) -> Option<CommissionState> {
        let cached = self.cached.borrow();
        let (of, at, known) = cached.as_ref()?;
        (*of == connection && at.elapsed() < LONGEST_CACHED).then(|| known.clone())
    }

    /// Whether a rig was commissioned and has not changed since. A cached answer may be a moment
    /// old.
    pub(in crate::control) async fn known(
        &self,
        state_dir: &Path,
        device: &ConnectedDevice,
        may_be_cached: bool,
    ) -> CommissionState {
        if may_be_cached && let Some(known) = self.fresh(device.connection) {
            return known;
        }
        let path = path_of(state_dir, &device.rig.key);
        let asked = path.clone();
        let known = match self.run(move || read(&asked)).await {
            Ok(None) => CommissionState::Not("it was never commissioned".to_owned()),
            Ok(Some(record)) => difference(&record, device).map_or(CommissionState::Commissioned, CommissionState::Not),
            Err(why) => CommissionState::Not(format!(
                "its commissioning record cannot be read: {}: {why}",
                path.display()
            )),
        };
        *self.cached.borrow_mut() = Some((device.connection, Instant::now(), known.clone()));
        known
    }

    /// Writes a record; returns its file.
    ///
    /// # Errors
    /// The file cannot be written, or not in time.
    pub(super) async fn store(&self, state_dir: &Path, record: Record) -> Result<PathBuf, WireError> {
        let path = path_of(state_dir, &record.rig);
        let to = path.clone();
        let written = self.run(move || write(&to, &record)).await;
        *self.cached.borrow_mut() = None;
        match written {
            Ok(()) => Ok(path),
            Err(why) => Err(WireError::new(
                ErrorCode::StateFile,
                format!("{}: {why}; --state-dir names another directory", path.display()),
            )),
        }
    }
}

/// How a rig differs from its record.
fn difference(record: &Record, device: &ConnectedDevice) -> Option<String> {
    if record.rig != device.rig.key {
        return Some(format!("its commissioning record is of another rig, {}", record.rig));
    }
    if record.reversed != device.rig.reversed {
        return Some("`direction` in its address has changed since it was commissioned".to_owned());
    }
    let (now_um, then_um) = (device.resolution_m * 1e6, record.resolution_m * 1e6);
    if (now_um - then_um).abs() > SAME_RESOLUTION * then_um.abs() {
        return Some(format!(
            "its resolution is {now_um:.4} um a count, and was {then_um:.4} um when it was commissioned"
        ));
    }
    // Without a serial number another device may have the same address.
    if !device.rig.has_serial_number && record.firmware != device.firmware {
        return Some(format!(
            "its firmware is `{}`, and was `{}` when it was commissioned; without a serial number it may be another \
             rig",
            device.firmware, record.firmware
        ));
    }
    None
}

fn read(path: &Path) -> Result<Option<Record>, String> {
    let text = match regular_file::read_text_of(path, LARGEST_FILE) {
        Ok(text) => text,
        Err(error) => {
            return match error.kind() {
                ErrorKind::NotFound => Ok(None),
                ErrorKind::InvalidInput | ErrorKind::FileTooLarge => {
                    Err(format!("it is not a file of at most {LARGEST_FILE} bytes: {error}"))
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

/// The file of a rig. Its key may hold any text that a device reports: a byte that is not a letter,
/// digit, `-` or `_` is escaped.
fn path_of(state_dir: &Path, key: &str) -> PathBuf {
    let mut name = String::new();
    for byte in key.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' => name.push(char::from(byte)),
            _ => name.push_str(&format!("%{byte:02x}")),
        }
    }
    if name.len() > LONGEST_NAME {
        // FNV-1a of the whole key. The file itself names its rig, too.
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

    fn device() -> ConnectedDevice {
        ConnectedDevice {
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
        let nearly = ConnectedDevice {
            resolution_m: f64::from(1.0 / (1e5_f32)),
            ..device()
        };
        assert_eq!(difference(&record(), &nearly), None, "rounded on the wire");
        let finer = ConnectedDevice {
            resolution_m: 0.5e-5,
            ..device()
        };
        assert!(difference(&record(), &finer).expect("another").contains("5.0000 um"));
        let mut turned = device();
        turned.rig.reversed = true;
        assert!(difference(&record(), &turned).expect("another").contains("direction"));
        let mut other = ConnectedDevice {
            firmware: "theirs 2".to_owned(),
            ..device()
        };
        assert!(difference(&record(), &other).expect("another").contains("theirs 2"));
        other.rig.has_serial_number = true;
        assert_eq!(difference(&record(), &other), None, "an update");
    }
}
