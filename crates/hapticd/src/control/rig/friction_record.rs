//! The files of what was identified of rigs, one a rig.

use crate::control::rig_files::{Origin, RigFolder};
use device_io::link::DeviceInfo;
use haptic_core::rig_friction::RigFriction;
use haptic_ipc::{Peer, WireError};
use serde::{Deserialize, Serialize};
use std::cell::RefCell;
use std::path::{Path, PathBuf};

/// What was identified of a rig.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct FrictionRecord {
    #[serde(flatten)]
    origin: Origin,
    friction: RigFriction,
}

/// What is known of a rig's friction.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::control) enum KnownFriction {
    /// It was never identified, or no rig is connected.
    #[default]
    Never,
    Identified(RigFriction),
    /// There is a record that does not hold, and why.
    Unusable(String),
    /// Its file could not be read, and why: a disk that was busy may answer next time.
    Unread(String),
}

impl KnownFriction {
    pub(in crate::control) fn identified(&self) -> Option<RigFriction> {
        match self {
            Self::Identified(friction) => Some(*friction),
            Self::Never | Self::Unusable(_) | Self::Unread(_) => None,
        }
    }

    /// Why there is nothing, though there may be a file.
    pub(in crate::control) fn problem(&self) -> Option<&str> {
        match self {
            Self::Never | Self::Identified(_) => None,
            Self::Unusable(why) | Self::Unread(why) => Some(why),
        }
    }
}

/// Reads and writes what was identified of rigs.
#[derive(Debug)]
pub(in crate::control) struct RigFrictions {
    /// The connection that was looked at last.
    newest: RefCell<Option<(u64, KnownFriction)>>,
    folder: RigFolder,
}

impl RigFrictions {
    pub(in crate::control) fn new(state_dir: &Path) -> Self {
        let heading = "What `haptic-ctl identify --rig` found of the rig's own friction.";
        Self {
            newest: RefCell::default(),
            folder: RigFolder::new(state_dir, "friction", heading),
        }
    }

    /// What is known of the friction of the rig on a connection, if its file was read already.
    pub(in crate::control) fn known(&self, connection: u64) -> Option<KnownFriction> {
        let newest = self.newest.borrow();
        let (of, known) = newest.as_ref()?;
        (*of == connection).then(|| known.clone())
    }

    /// What is known of the friction of a rig; its file is read until it was read once for a connection.
    pub(in crate::control) async fn of(&self, device: &DeviceInfo) -> KnownFriction {
        match self.known(device.connection) {
            None | Some(KnownFriction::Unread(_)) => {}
            Some(known) => return known,
        }
        let known = match self.folder.read::<FrictionRecord>(&device.rig.key).await {
            Ok(None) => KnownFriction::Never,
            Ok(Some(record)) => match usable(&record, device) {
                Ok(friction) => KnownFriction::Identified(friction),
                Err(why) => {
                    let path = self.folder.path_of(&device.rig.key);
                    KnownFriction::Unusable(format!("{}: {why}", path.display()))
                }
            },
            Err(why) => KnownFriction::Unread(why),
        };
        *self.newest.borrow_mut() = Some((device.connection, known.clone()));
        known
    }

    /// What was identified of a rig that is not the connected one.
    pub(in crate::control) async fn of_other(&self, key: &str) -> Option<RigFriction> {
        let record = self.folder.read::<FrictionRecord>(key).await.ok()??;
        record.friction.validate().is_ok().then_some(record.friction)
    }

    /// Writes what was identified of a rig, which holds from now on; returns its file.
    ///
    /// # Errors
    /// A value is out of range, or the file cannot be written in time.
    pub(in crate::control) async fn store(
        &self,
        device: &DeviceInfo,
        friction: RigFriction,
        by: &Peer,
    ) -> Result<PathBuf, WireError> {
        friction.validate()?;
        let record = FrictionRecord {
            origin: Origin::now(device, by),
            friction,
        };
        let path = self.folder.write(&device.rig.key, record).await?;
        *self.newest.borrow_mut() = Some((device.connection, KnownFriction::Identified(friction)));
        Ok(path)
    }
}

fn usable(record: &FrictionRecord, device: &DeviceInfo) -> Result<RigFriction, String> {
    record.friction.validate().map_err(|error| error.to_string())?;
    let other_device = || {
        let firmware = record.origin.other_firmware(device)?;
        (!device.rig.has_serial_number).then(|| format!("{firmware}; without a serial number it may be another rig"))
    };
    match record.origin.difference(device).or_else(other_device) {
        None => Ok(record.friction),
        Some(why) => Err(format!("the rig has changed since it was identified: {why}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::rig_files::tests::{device, origin};
    use haptic_core::Directional;
    use haptic_ipc::ErrorCode;

    const FRICTION: RigFriction = RigFriction {
        mass: 1.4,
        dynamic_force: Directional::new(0.8, 0.7),
        viscous: Directional::both(0.5),
        cogging: None,
        uncertainty: None,
    };

    fn record() -> FrictionRecord {
        FrictionRecord {
            origin: origin(),
            friction: FRICTION,
        }
    }

    #[test]
    fn a_record_that_does_not_hold_is_not_used_and_says_why() {
        let mut turned = device();
        turned.rig.reversed = true;
        let why = usable(&record(), &turned).expect_err("its direction has changed");
        assert!(why.contains("direction"), "{why}");
        let mut wrong = record();
        wrong.friction.mass = -1.0;
        let why = usable(&wrong, &device()).expect_err("no rig has it");
        assert!(why.contains("mass_kg = -1 kg"), "{why}");
    }

    #[tokio::test]
    async fn the_file_of_a_rig_is_read_once_for_a_connection() {
        let directory = tempfile::tempdir().expect("a directory");
        let frictions = RigFrictions::new(directory.path());
        assert_eq!(frictions.known(1), None);
        assert_eq!(frictions.of(&device()).await, KnownFriction::Never);
        assert_eq!(frictions.known(1), Some(KnownFriction::Never));
        let by = Peer::default();
        let path = frictions.store(&device(), FRICTION, &by).await.expect("stored");
        assert_eq!(frictions.known(1), Some(KnownFriction::Identified(FRICTION)));
        let mut again = device();
        again.connection = 2;
        assert_eq!(frictions.known(2), None, "another may be plugged in");
        assert_eq!(frictions.of(&again).await, KnownFriction::Identified(FRICTION));
        std::fs::write(&path, "friction = 3").expect("written");
        again.connection = 3;
        let known = frictions.of(&again).await;
        let why = known.problem().expect("it is not a record");
        assert!(why.contains(&path.display().to_string()), "{why}");
        // What could not be read is tried again.
        std::fs::remove_file(&path).expect("removed");
        assert_eq!(frictions.of(&again).await, KnownFriction::Never);
        let wrong = RigFriction {
            mass: f64::NAN,
            ..FRICTION
        };
        let refused = frictions.store(&device(), wrong, &by).await.expect_err("NaN");
        assert_eq!(
            (refused.code, refused.unit.as_deref()),
            (ErrorCode::OutOfRange, Some("kg"))
        );
    }
}
