//! Where a record is, and how it is read: files, columns, gains, and which mass of a recording.

use super::columns::Columns;
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
    /// Names of columns.
    pub columns: Columns,
    /// Newtons a unit of the force column; negative where the sensor points the other way. `None` for
    /// the unit in the column's name, or N.
    pub force_gain: Option<f64>,
    /// Metres a unit of the position column; `None` for the unit in the column's name, or m.
    pub position_gain: Option<f64>,
    /// Seconds a unit of the time column; `None` for the unit in the column's name, or s.
    pub time_unit_s: Option<f64>,
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
            columns: Columns::default(),
            force_gain: None,
            position_gain: None,
            time_unit_s: None,
            moving: MovingMass::Auto,
        }
    }
}
