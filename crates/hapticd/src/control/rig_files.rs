//! Files in the state directory that hold what was found of a rig: one file a rig, by its serial
//! number, written whole or not at all.
//!
//! A disk may be slow and a mount may hang, so files are read and written by [`Workers`] of which
//! there is one, for whom nothing waits for longer than [`READ_TIMEOUT`] or [`WRITE_TIMEOUT`].

use crate::control::whole_file;
use crate::threads::Workers;
use device_io::link::DeviceInfo;
use haptic_ipc::quantity::number;
use haptic_ipc::regular_file::{self, with_short_lines};
use haptic_ipc::{ErrorCode, Peer, WireError};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

/// Timeout of a file that is read: somebody wants to engage.
const READ_TIMEOUT: Duration = Duration::from_secs(1);

/// Timeout of a file that is written: a busy disk can take seconds to keep it, and what was found of a rig took a
/// person minutes. Below the 5 s for which haptic-ctl waits.
const WRITE_TIMEOUT: Duration = Duration::from_secs(4);

/// Largest file that is read, bytes.
const MAX_FILE: u64 = 64 * 1024;

/// Most letters of a rig's key in the name of its file.
const MAX_NAME: usize = 150;

/// Relative tolerance of a resolution: it travels as a number of 32 bits.
const SAME_RESOLUTION: f64 = 1e-6;

/// The rig that something was found of, when, and who asked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Origin {
    /// The rig's key.
    pub(super) rig: String,
    pub(super) firmware: String,
    /// Whether the address reversed force and position.
    pub(super) reversed: bool,
    /// The resolution that the device reported, m.
    pub(super) resolution_m: f64,
    /// What else it reported.
    #[serde(rename = "force_limit_N")]
    pub(super) force_limit_n: f64,
    #[serde(rename = "sample_rate_Hz")]
    pub(super) sample_rate_hz: f64,
    /// 0 for none.
    pub(super) watchdog_ms: u32,
    /// Buttons that there are, one bit each.
    pub(super) buttons: u8,
    /// Time of the finding, seconds since 1970 (UTC).
    pub(super) time_unix_s: f64,
    /// The client that asked for it.
    pub(super) by: String,
}

impl Origin {
    /// Something found of a device now, for a client.
    pub(super) fn now(device: &DeviceInfo, by: &Peer) -> Self {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        Self {
            rig: device.rig.key.clone(),
            firmware: device.firmware.clone(),
            reversed: device.rig.reversed,
            resolution_m: device.resolution_m,
            force_limit_n: device.force_limit_n,
            sample_rate_hz: device.sample_rate_hz,
            watchdog_ms: device.watchdog_ms.unwrap_or(0),
            buttons: device.buttons,
            time_unix_s: now.as_secs_f64(),
            by: by.to_string(),
        }
    }

    /// Whether a device reported the same of itself, whenever that was.
    pub(super) fn is_of_the_same(&self, then: &Self) -> bool {
        let now = Self {
            time_unix_s: then.time_unix_s,
            by: then.by.clone(),
            ..self.clone()
        };
        now == *then
    }

    /// How a device differs from the one that something was found of, so that it is not valid for it.
    pub(super) fn difference(&self, device: &DeviceInfo) -> Option<String> {
        if self.rig != device.rig.key {
            return Some(format!("its record is of another rig, {}", self.rig));
        }
        if self.reversed != device.rig.reversed {
            return Some("`direction` in its address has changed since then".to_owned());
        }
        let (now_um, then_um) = (device.resolution_m * 1e6, self.resolution_m * 1e6);
        if (now_um - then_um).abs() > SAME_RESOLUTION * then_um.abs() {
            return Some(format!(
                "its resolution is {now_um:.4} um a count, and was {then_um:.4} um then"
            ));
        }
        None
    }

    /// Why a device that does not differ may yet be another, or do something else with a command: nothing that is
    /// relied on is taken as it was then.
    pub(super) fn doubt(&self, device: &DeviceInfo) -> Option<String> {
        let mut doubts = Vec::new();
        if !device.rig.has_serial_number {
            doubts.push("it has no serial number".to_owned());
        }
        doubts.extend(self.other_firmware(device));
        let mut compare = |what: &str, now: String, then: String| {
            if now != then {
                doubts.push(format!("its {what} is {now}, and was {then} then"));
            }
        };
        for (what, unit, now, then) in [
            ("force limit", "N", device.force_limit_n, self.force_limit_n),
            ("sample rate", "Hz", device.sample_rate_hz, self.sample_rate_hz),
            (
                "watchdog",
                "ms",
                device.watchdog_ms.unwrap_or(0).into(),
                self.watchdog_ms.into(),
            ),
        ] {
            let text = |value: f64| format!("{} {unit}", number(value));
            compare(what, text(now), text(then));
        }
        compare(
            "set of buttons",
            button_names(device.buttons),
            button_names(self.buttons),
        );
        (!doubts.is_empty()).then(|| doubts.join("; "))
    }

    /// How the name of a device's firmware differs.
    pub(super) fn other_firmware(&self, device: &DeviceInfo) -> Option<String> {
        (self.firmware != device.firmware).then(|| {
            format!(
                "its firmware is `{}`, and was `{}` then",
                device.firmware, self.firmware
            )
        })
    }
}

/// Buttons by their bits, for people.
pub(super) fn button_names(buttons: u8) -> String {
    if buttons == 0 {
        return "no button".to_owned();
    }
    let names = (0..8).filter(|bit| buttons >> bit & 1 == 1);
    names
        .map(|bit| format!("button {}", bit + 1))
        .collect::<Vec<_>>()
        .join(", ")
}

/// A folder of the state directory, with a thread of its own: a disk that hangs holds up nothing
/// else.
#[derive(Debug)]
pub(super) struct RigFolder {
    directory: PathBuf,
    /// The first line of each file.
    heading: &'static str,
    disk: Workers,
}

impl RigFolder {
    pub(super) fn new(state_dir: &Path, name: &str, heading: &'static str) -> Self {
        Self {
            directory: state_dir.join(name),
            heading,
            disk: Workers::new("rig-file", 1),
        }
    }

    /// The file of a rig.
    pub(super) fn path_of(&self, key: &str) -> PathBuf {
        self.directory.join(file_name(key))
    }

    /// Reads the file of a rig, if there is one.
    ///
    /// # Errors
    /// The file cannot be read, or not in time; the message names it.
    pub(super) async fn read<T: DeserializeOwned + Send + 'static>(&self, key: &str) -> Result<Option<T>, String> {
        self.run(key, READ_TIMEOUT, read).await
    }

    /// Writes the file of a rig; returns its path.
    ///
    /// # Errors
    /// The file cannot be written, or not in time.
    pub(super) async fn write<T: Serialize + Send + 'static>(&self, key: &str, found: T) -> Result<PathBuf, WireError> {
        let heading = self.heading;
        let written = self.run(key, WRITE_TIMEOUT, move |path| write(path, heading, &found));
        written.await.map_err(cannot_write)?;
        Ok(self.path_of(key))
    }

    /// Whether the file of a rig could be written, before what takes a minute and ends with it.
    ///
    /// # Errors
    /// As [`Self::write`].
    pub(super) async fn check(&self, key: &str) -> Result<(), WireError> {
        let written = self.run(key, WRITE_TIMEOUT, |path| {
            whole_file::check(path).map_err(|error| error.to_string())
        });
        written.await.map_err(cannot_write)
    }

    /// Removes the file of a rig, behind what is under way with files.
    ///
    /// # Errors
    /// It cannot be removed, or not in time.
    pub(super) async fn remove(&self, key: &str) -> Result<(), String> {
        let path = self.path_of(key);
        let gone = path.clone();
        let removed = self.disk.run(WRITE_TIMEOUT, move || match std::fs::remove_file(&gone) {
            Err(error) if error.kind() != ErrorKind::NotFound => Err(error.to_string()),
            _ => Ok(()),
        });
        let removed = removed.await.map_err(|error| error.to_string()).flatten();
        removed.map_err(|why| format!("{}: {why}", path.display()))
    }

    /// Works with the file of a rig; an error names it.
    async fn run<T: Send + 'static>(
        &self,
        key: &str,
        limit: Duration,
        work: impl FnOnce(&Path) -> Result<T, String> + Send + 'static,
    ) -> Result<T, String> {
        let path = self.path_of(key);
        let shown = path.display().to_string();
        let done = if self.disk.is_busy() {
            Err("the disk is still busy with the previous access".to_owned())
        } else {
            let done = self.disk.run(limit, move || work(&path)).await;
            done.map_err(|error| error.to_string()).flatten()
        };
        done.map_err(|why| format!("{shown}: {why}"))
    }
}

fn cannot_write(mut why: String) -> WireError {
    why.push_str("; --state-dir names another directory");
    WireError::new(ErrorCode::StateFile, why)
}

fn read<T: DeserializeOwned>(path: &Path) -> Result<Option<T>, String> {
    let text = match regular_file::read_text_of(path, MAX_FILE) {
        Ok(text) => text,
        Err(error) => {
            return match error.kind() {
                ErrorKind::NotFound => Ok(None),
                ErrorKind::InvalidInput | ErrorKind::FileTooLarge => {
                    Err(format!("it is not a file of at most {MAX_FILE} bytes: {error}"))
                }
                _ => Err(error.to_string()),
            };
        }
    };
    toml::from_str(&text)
        .map(Some)
        .map_err(|error| with_short_lines(&error.to_string()))
}

fn write(path: &Path, heading: &str, found: &impl Serialize) -> Result<(), String> {
    let text = toml::to_string(found).map_err(|error| error.to_string())?;
    let text = format!("# {heading}\n{text}");
    std::fs::create_dir_all(path.parent().unwrap_or(Path::new(".")))
        .and_then(|()| whole_file::write(path, &text, true))
        .map_err(|error| error.to_string())
}

/// The name of a rig's file. Its key may hold any text that a device reports: a byte that is not a
/// letter, digit, `-` or `_` is escaped.
fn file_name(key: &str) -> String {
    let mut name = String::new();
    for byte in key.bytes() {
        match byte {
            b'a'..=b'z' | b'A'..=b'Z' | b'0'..=b'9' | b'-' | b'_' => name.push(char::from(byte)),
            _ => name.push_str(&format!("%{byte:02x}")),
        }
    }
    if name.len() > MAX_NAME {
        // FNV-1a of the whole key. The file itself names its rig, too.
        let hash = key.bytes().fold(0xcbf2_9ce4_8422_2325_u64, |hash, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3)
        });
        name.truncate(MAX_NAME);
        name.push_str(&format!("-{hash:016x}"));
    }
    name.push_str(".toml");
    name
}

#[cfg(test)]
pub(in crate::control) mod tests {
    use super::*;
    use device_io::link::RigIdentity;

    pub(in crate::control) fn device() -> DeviceInfo {
        DeviceInfo {
            motors: None,
            firmware: "mine 1.0".to_owned(),
            force_limit_n: 20.0,
            resolution_m: 1e-5,
            sample_rate_hz: 1000.0,
            watchdog_ms: Some(50),
            buttons: 0,
            rig: RigIdentity {
                key: "serial-/dev/ttyACM0".to_owned(),
                has_serial_number: false,
                reversed: false,
            },
            connection: 1,
        }
    }

    pub(in crate::control) fn origin() -> Origin {
        Origin {
            rig: device().rig.key,
            firmware: device().firmware,
            reversed: false,
            resolution_m: 1e-5,
            force_limit_n: 20.0,
            sample_rate_hz: 1000.0,
            watchdog_ms: 50,
            buttons: 0,
            time_unix_s: 1.0,
            by: "ada".to_owned(),
        }
    }

    #[test]
    fn a_record_is_read_back_and_other_files_are_refused() {
        let directory = tempfile::tempdir().expect("a directory");
        let folder = RigFolder::new(directory.path(), "commissioned", "What was found.");
        let path = folder.path_of("usb-1209:0001-../../etc/x");
        assert_eq!(path.parent(), Some(directory.path().join("commissioned").as_path()));
        assert_eq!(read::<Origin>(&path), Ok(None));
        write(&path, "What was found.", &origin()).expect("it can be written");
        assert_eq!(read(&path), Ok(Some(origin())));
        std::fs::write(&path, "rig = 3").expect("written");
        assert!(read::<Origin>(&path).is_err());
        let endless = Path::new("/dev/zero");
        assert!(read::<Origin>(endless).expect_err("no file").contains("not a file"));
    }

    #[test]
    fn names_of_files_are_short_and_differ() {
        let name = file_name(&"/".repeat(4000)).len();
        assert!(name <= 200, "{name}");
        assert_ne!(
            file_name(&format!("{}a", "x".repeat(200))),
            file_name(&format!("{}b", "x".repeat(200)))
        );
    }

    #[test]
    fn a_changed_rig_is_reported_by_what_has_changed() {
        let difference = |device: &DeviceInfo| origin().difference(device);
        assert_eq!(difference(&device()), None);
        let nearly = DeviceInfo {
            resolution_m: f64::from(1.0 / (1e5_f32)),
            ..device()
        };
        assert_eq!(difference(&nearly), None, "rounded on the wire");
        let finer = DeviceInfo {
            resolution_m: 0.5e-5,
            ..device()
        };
        assert!(difference(&finer).expect("another").contains("5.0000 um"));
        let mut turned = device();
        turned.rig.reversed = true;
        assert!(difference(&turned).expect("another").contains("direction"));
        let mut other = device();
        other.rig.key = "usb-2".to_owned();
        assert!(difference(&other).expect("another").contains("another rig"));
    }

    // hazard: H27
    #[test]
    fn whatever_else_a_device_says_otherwise_than_then_is_in_doubt() {
        let mut sure = device();
        sure.rig.has_serial_number = true;
        let doubt = |device: &DeviceInfo| origin().doubt(device);
        assert_eq!(doubt(&sure), None);
        assert_eq!(doubt(&device()).as_deref(), Some("it has no serial number"));
        let with = |change: fn(&mut DeviceInfo)| {
            let mut device = sure.clone();
            change(&mut device);
            doubt(&device).expect("in doubt")
        };
        assert_eq!(
            with(|device| device.firmware = "mine 1.1".to_owned()),
            "its firmware is `mine 1.1`, and was `mine 1.0` then"
        );
        assert_eq!(
            with(|device| device.force_limit_n = 40.0),
            "its force limit is 40 N, and was 20 N then"
        );
        assert_eq!(
            with(|device| device.sample_rate_hz = 500.0),
            "its sample rate is 500 Hz, and was 1000 Hz then"
        );
        assert_eq!(
            with(|device| device.watchdog_ms = None),
            "its watchdog is 0 ms, and was 50 ms then"
        );
        assert_eq!(
            with(|device| device.buttons = 0b101),
            "its set of buttons is button 1, button 3, and was no button then"
        );
    }
}
