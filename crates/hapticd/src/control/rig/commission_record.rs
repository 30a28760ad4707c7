//! The records of commissioned rigs.

use crate::control::facts::of_motor;
use crate::control::rig::both_motors::{DrivenAlone, WorstPlaces, of_both};
use crate::control::rig_files::{Origin, RigFolder};
use crate::threads::Workers;
use device_io::kinematics::Kinematics;
use device_io::link::DeviceInfo;
use haptic_core::scene::Coupling;
use haptic_ipc::{ErrorCode, Peer, WireError};
use serde::{Deserialize, Serialize};
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// Largest age of a cached answer.
const MAX_CACHED: Duration = Duration::from_secs(1);

/// Timeout of the survey of a workspace: some milliseconds, or a fifth of a second of the largest.
const SURVEY_TIMEOUT: Duration = Duration::from_secs(1);

/// The findings of a commissioning.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(in crate::control) struct Record {
    #[serde(flatten)]
    pub(in crate::control) origin: Origin,
    /// The smallest step of its position that was observed, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(in crate::control) step_m: Option<f64>,
    #[serde(flatten)]
    pub(in crate::control) findings: Findings,
    /// Of a motor of a rig of two axes what it has shown alone.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(in crate::control) alone: Option<DrivenAlone>,
    /// The stiffest grip that the rig bears with a factor of two, where one was found.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(in crate::control) coupling: Option<Coupling>,
}

/// What was found of a rig, or of a motor alone, as far as it was. Of a rig of two axes friction and mass are those in
/// the worst direction at the worst place.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(in crate::control) struct Findings {
    /// Travel of its handle between its ends, m.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(in crate::control) range_m: Option<f64>,
    /// Its friction, N.
    #[serde(default, rename = "friction_N", skip_serializing_if = "Option::is_none")]
    pub(in crate::control) friction_n: Option<f64>,
    /// Mass of its moving part, kg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(in crate::control) mass_kg: Option<f64>,
    /// Where that is, of a rig of two axes.
    #[serde(skip)]
    pub(in crate::control) worst: WorstPlaces,
}

/// What a record has of a motor of a rig of two axes.
type Motor = (Findings, Option<DrivenAlone>);

/// Whether a rig is commissioned.
#[derive(Clone, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "there is one at a time")]
pub(in crate::control) enum CommissionState {
    /// It was commissioned, and has not changed since.
    Commissioned {
        findings: Findings,
        /// The stiffest grip that it bears with a factor of two, where one was found.
        coupling: Option<Coupling>,
        /// Why it may yet be another rig, which nobody has denied of this connection.
        doubt: Option<String>,
    },
    /// It does not count as commissioned.
    Not {
        why: String,
        /// Its motor was found to move the wrong way.
        is_reversed: bool,
    },
}

/// Reads and writes the records.
#[derive(Debug)]
pub(in crate::control) struct Records {
    /// The newest answer, with its connection and time.
    cached: RefCell<Option<(u64, Instant, CommissionState)>>,
    /// The connection that was stated, or shown, to be of the commissioned rig.
    confirmed: Cell<Option<u64>>,
    /// Rigs whose motor has moved the handle the wrong way, until they are commissioned again; of one without a serial
    /// number the connection, as the next may be of another.
    refuted: RefCell<BTreeMap<String, Option<u64>>>,
    folder: RigFolder,
    kinematics: Option<Kinematics>,
    /// Workers that survey a workspace.
    surveys: Workers,
    /// The newest survey, of these motors: the files are read every second, and seldom say anything new.
    surveyed: Cell<Option<([Motor; 2], Findings)>>,
}

impl Records {
    /// Of rigs that move a hand in a plane by these kinematics, or on a line.
    pub(in crate::control) fn new(state_dir: &Path, kinematics: Option<Kinematics>) -> Self {
        let heading = "What `haptic-ctl commission` found. Without this file the rig counts as never commissioned.";
        Self {
            cached: RefCell::default(),
            confirmed: Cell::default(),
            refuted: RefCell::default(),
            folder: RigFolder::new(state_dir, "commissioned", heading),
            kinematics,
            surveys: Workers::new("survey", 1),
            surveyed: Cell::default(),
        }
    }

    fn fresh(&self, connection: u64) -> Option<CommissionState> {
        let cached = self.cached.borrow();
        let (of, at, known) = cached.as_ref()?;
        (*of == connection && at.elapsed() < MAX_CACHED).then(|| known.clone())
    }

    /// What the newest answer has of the rig at a connection.
    pub(in crate::control) fn newest(&self, connection: u64) -> Option<(Findings, Option<Coupling>)> {
        let cached = self.cached.borrow();
        let (of, _, known) = cached.as_ref()?;
        match known {
            CommissionState::Commissioned { findings, coupling, .. } if *of == connection => {
                Some((*findings, *coupling))
            }
            _ => None,
        }
    }

    /// Whether a rig was commissioned and has not changed since. A cached answer may be a moment
    /// old.
    pub(in crate::control) async fn known(&self, device: &DeviceInfo, may_be_cached: bool) -> CommissionState {
        if may_be_cached && let Some(known) = self.fresh(device.connection) {
            return known;
        }
        let known = self.of_all_motors(device).await;
        *self.cached.borrow_mut() = Some((device.connection, Instant::now(), known.clone()));
        known
    }

    /// What is commissioned of a device, each under a key of its own: the rig, or each of two motors.
    fn parts(&self, device: &DeviceInfo) -> Vec<DeviceInfo> {
        match self.kinematics {
            None => vec![device.clone()],
            Some(_) => [0, 1].map(|motor| of_motor(device.clone(), motor)).into(),
        }
    }

    /// What is known of a rig by the records of all its motors.
    async fn of_all_motors(&self, device: &DeviceInfo) -> CommissionState {
        let is_confirmed = self.confirmed.get() == Some(device.connection);
        let (mut records, mut doubt) = (Vec::new(), None);
        for (number, part) in (1..).zip(self.parts(device)) {
            match self.of_this_rig(&part).await {
                Err(why) => {
                    let is_reversed = self.is_refuted(&part);
                    let why = match self.kinematics {
                        None => why,
                        Some(_) => format!("motor {number}: {why}"),
                    };
                    return CommissionState::Not { why, is_reversed };
                }
                Ok(record) => {
                    doubt = doubt.or_else(|| record.origin.doubt(&part).filter(|_| !is_confirmed));
                    records.push(record);
                }
            }
        }
        // One is found with the last motor that is commissioned, and with each that is commissioned again.
        let couplings = records.iter().filter_map(|record| record.coupling);
        let coupling = couplings.reduce(|one, other| if one.stiffness <= other.stiffness { one } else { other });
        CommissionState::Commissioned {
            findings: self.of_whole(&records).await,
            coupling,
            doubt,
        }
    }

    /// What a rig is by a record that is not stored yet, and by those of its other motors; `None` where one has none.
    pub(in crate::control) async fn findings_with(&self, device: &DeviceInfo, record: &Record) -> Option<Findings> {
        let mut records = Vec::new();
        for part in self.parts(device) {
            records.push(if part.rig.key == record.origin.rig {
                record.clone()
            } else {
                self.of_this_rig(&part).await.ok()?
            });
        }
        Some(self.of_whole(&records).await)
    }

    async fn of_whole(&self, records: &[Record]) -> Findings {
        let (Some(kinematics), [first, second]) = (self.kinematics, records) else {
            return records.first().map(|record| record.findings).unwrap_or_default();
        };
        let motors = [first, second].map(|record| (record.findings, record.alone));
        if let Some((of, found)) = self.surveyed.get()
            && of == motors
        {
            return found;
        }
        let found = self.surveys.run(SURVEY_TIMEOUT, move || of_both(&kinematics, motors));
        let Ok(found) = found.await else {
            return Findings::default();
        };
        self.surveyed.set(Some((motors, found)));
        found
    }

    fn is_refuted(&self, device: &DeviceInfo) -> bool {
        let refuted = self.refuted.borrow();
        let of = refuted.get(&device.rig.key);
        of.is_some_and(|of| of.is_none_or(|connection| connection == device.connection))
    }

    /// The record that is valid for a device, or why there is none.
    async fn of_this_rig(&self, device: &DeviceInfo) -> Result<Record, String> {
        if self.is_refuted(device) {
            return Err(
                "its motor has moved the handle the wrong way: swap its wires or those of the encoder first".to_owned(),
            );
        }
        let found = self.folder.read::<Record>(&device.rig.key).await;
        let record = found
            .map_err(|why| format!("its commissioning record cannot be read: {why}"))?
            .ok_or("it was never commissioned")?;
        match record.origin.difference(device) {
            None => Ok(record),
            Some(why) => Err(format!("it has changed since it was commissioned: {why}")),
        }
    }

    /// The record of each motor of a device that was commissioned.
    ///
    /// # Errors
    /// One was not, or has changed too much since.
    pub(in crate::control) async fn of_parts(
        &self,
        device: &DeviceInfo,
    ) -> Result<Vec<(DeviceInfo, Record)>, WireError> {
        let mut records = Vec::new();
        for part in self.parts(device) {
            let record = self.of_this_rig(&part).await.map_err(|why| {
                let message = format!(
                    "cannot take {} for a commissioned rig: {why}: run `haptic-ctl commission`",
                    part.rig.key
                );
                WireError::new(ErrorCode::NotCommissioned, message).about("rig")
            })?;
            records.push((part, record));
        }
        Ok(records)
    }

    /// Takes a device for the rig that was commissioned, as it is now, for as long as it is connected; of one with a
    /// serial number this stays known.
    ///
    /// # Errors
    /// None is, the device has changed too much for that, or the file cannot be written.
    pub(in crate::control) async fn confirm(&self, device: &DeviceInfo, by: &Peer) -> Result<(), WireError> {
        for (part, record) in self.of_parts(device).await? {
            let origin = Origin::now(&part, by);
            if origin.is_of_the_same(&record.origin) {
                self.taken_for_the_rig(device.connection);
            } else {
                self.store(Record { origin, ..record }, device.connection).await?;
            }
        }
        Ok(())
    }

    /// Whether the record of a device could be written.
    ///
    /// # Errors
    /// It could not, or not in time.
    pub(in crate::control) async fn check(&self, device: &DeviceInfo) -> Result<(), WireError> {
        self.folder.check(&device.rig.key).await
    }

    /// Writes the record of the rig at a connection; returns its file.
    ///
    /// # Errors
    /// The file cannot be written, or not in time.
    pub(in crate::control) async fn store(&self, record: Record, connection: u64) -> Result<PathBuf, WireError> {
        let key = record.origin.rig.clone();
        let written = self.folder.write(&key, record).await?;
        self.refuted.borrow_mut().remove(&key);
        self.taken_for_the_rig(connection);
        Ok(written)
    }

    /// A motor has moved the handle the wrong way: whatever was found of its rig before holds no longer, from now on.
    pub(in crate::control) fn refute(&self, device: &DeviceInfo) {
        let of = (!device.rig.has_serial_number).then_some(device.connection);
        self.refuted.borrow_mut().insert(device.rig.key.clone(), of);
        self.confirmed.set(None);
        *self.cached.borrow_mut() = None;
    }

    /// Removes the record of a rig that is [refuted](Self::refute), so that it holds for no later daemon either. That of a
    /// rig without a serial number may be of another one.
    ///
    /// # Errors
    /// The file cannot be removed, or not in time.
    pub(in crate::control) async fn withdraw(&self, device: &DeviceInfo) -> Result<(), String> {
        if !device.rig.has_serial_number {
            return Ok(());
        }
        self.folder.remove(&device.rig.key).await
    }

    fn taken_for_the_rig(&self, connection: u64) {
        self.confirmed.set(Some(connection));
        *self.cached.borrow_mut() = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::rig_files::tests::{device, origin};

    #[test]
    fn each_motor_has_a_record_of_its_own() {
        let [first, second] = [0, 1].map(|motor| of_motor(device(), motor).rig.key);
        assert_ne!(first, second);
    }

    // hazard: H13
    #[tokio::test]
    async fn a_motor_that_moved_the_wrong_way_withdraws_its_record() {
        let directory = tempfile::tempdir().expect("a directory");
        let (place, is_in) = (directory.path(), |state: &CommissionState| {
            matches!(state, CommissionState::Commissioned { .. })
        });
        for has_serial_number in [true, false] {
            let mut rig = device();
            rig.rig.has_serial_number = has_serial_number;
            let found = Record {
                origin: origin(),
                step_m: None,
                findings: Findings::default(),
                alone: None,
                coupling: None,
            };
            let records = Records::new(place, None);
            records.store(found.clone(), rig.connection).await.expect("kept");
            assert!(is_in(&records.known(&rig, false).await));

            records.refute(&rig);
            assert!(!is_in(&records.known(&rig, true).await), "at once");
            records.withdraw(&rig).await.expect("removed");
            assert!(!is_in(&records.known(&rig, false).await));
            let plugged_in_again = DeviceInfo {
                connection: rig.connection + 1,
                ..rig.clone()
            };
            // Of a board without a number the next may be another one, which is in doubt anyway.
            for (what, records) in [("this daemon", &records), ("the next", &Records::new(place, None))] {
                let known = records.known(&plugged_in_again, false).await;
                assert_eq!(is_in(&known), !has_serial_number, "{what}");
            }

            records.store(found, rig.connection).await.expect("kept");
            assert!(is_in(&records.known(&rig, false).await), "commissioned again");
        }
    }
}
