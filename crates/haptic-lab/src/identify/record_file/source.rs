//! Where a record is, and how it is read: files, columns, gains, and which mass of a recording.

use haptic_motion::table::TableOptions;
use std::path::{Path, PathBuf};

/// Which mass of a recording of hapticd is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum MovingMass {
    /// The block, where the scene has one and the rig was engaged; else the device.
    #[default]
    Auto,
    /// The virtual block, driven by its coupling.
    Block,
    /// The device's own carriage, driven by its motor.
    Device,
}

/// Where a record is, and how it is read.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// The file.
    pub path: PathBuf,
    /// Another file that holds the forces, on a clock of its own.
    pub force_path: Option<PathBuf>,
    /// Names of columns, gains and the unit of times.
    pub table: TableOptions,
    /// The mass of a recording of hapticd.
    pub moving: MovingMass,
}

impl Source {
    /// A file whose columns have their usual names, in SI units.
    #[must_use]
    pub fn new(path: &Path) -> Self {
        Self {
            path: path.to_path_buf(),
            force_path: None,
            table: TableOptions::default(),
            moving: MovingMass::Auto,
        }
    }
}
