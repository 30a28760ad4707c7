//! The records of commissioned rigs.

use crate::control::connected_device::ConnectedDevice;
use crate::control::rig_files::{Origin, RigFolder};
use haptic_ipc::WireError;
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Largest age of a cached answer.
const LONGEST_CACHED: Duration = Duration::from_secs(1);

/// The findings of a commissioning.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(in crate::control) struct Record {
    #[serde(flatten)]
    pub(in crate::control) origin: Origin,
    /// The smallest step of its position that was observed, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(in crate::control) step_m: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(in crate::control) range_m: Option<f64>,
    #[serde(default, rename = "friction_N", skip_serializing_if = "Option::is_none")]
    pub(in crate::control) friction_n: Option<f64>,
}

/// Whether a rig is commissioned.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::control) enum CommissionState {
    /// It was commissioned, and has not changed since.
    Commissioned {
        /// Travel of its handle between its ends, m.
        range_m: Option<f64>,
        /// Its friction, N.
        friction_n: Option<f64>,
    },
    /// Why it does not count as commissioned.
    Not(String),
}

/// Reads and writes the records.
#[derive(Debug)]
pub(in crate::control) struct Records {
    /// The newest answer, with its connection and time.
    cached: RefCell<Option<(u64, Instant, CommissionState)>>,
    folder: RigFolder,
}

impl Default for Records {
    fn default() -> Self {
        let heading = "What `haptic-ctl commission` found. Without this file the rig counts as never commissioned.";
        Self {
            cached: RefCell::default(),
            folder: RigFolder::new("commissioned", heading),
        }
    }
}

impl Records {
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
        let known = match self.folder.read::<Record>(state_dir, &device.rig.key).await {
            Ok(None) => CommissionState::Not("it was never commissioned".to_owned()),
            Ok(Some(record)) => match record.origin.difference(device) {
                None => CommissionState::Commissioned {
                    range_m: record.range_m,
                    friction_n: record.friction_n,
                },
                Some(why) => CommissionState::Not(format!("it has changed since it was commissioned: {why}")),
            },
            Err(why) => CommissionState::Not(format!("its commissioning record cannot be read: {why}")),
        };
        *self.cached.borrow_mut() = Some((device.connection, Instant::now(), known.clone()));
        known
    }

    /// Writes a record; returns its file.
    ///
    /// # Errors
    /// The file cannot be written, or not in time.
    pub(in crate::control) async fn store(&self, state_dir: &Path, record: Record) -> Result<PathBuf, WireError> {
        let key = record.origin.rig.clone();
        let written = self.folder.write(state_dir, &key, record).await;
        *self.cached.borrow_mut() = None;
        written
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::rig_files::tests::origin;

    #[test]
    fn an_older_record_reads() {
        let text = "rig = \"serial-/dev/ttyACM0\"\nfirmware = \"mine 1.0\"\nreversed = false\nresolution_m = 1e-5\n\
                    step_m = 1e-5\nfriction_N = 0.8\ntime_unix_s = 1.0\nby = \"ada\"\n";
        let record = Record {
            origin: origin(),
            step_m: Some(1e-5),
            range_m: None,
            friction_n: Some(0.8),
        };
        assert_eq!(toml::from_str(text).as_ref(), Ok(&record));
        assert_eq!(
            toml::from_str(&toml::to_string(&record).expect("it can be written")),
            Ok(record)
        );
    }
}
