//! Which columns of a table make a motion.

use crate::error::MotionError;
use std::path::Path;

/// A column of a table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Column {
    pub(crate) name: &'static str,
    /// Its place in the header.
    pub(crate) index: usize,
}

/// The columns of a motion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Columns {
    pub(crate) time: Column,
    pub(crate) position: Column,
    pub(crate) velocity: Option<Column>,
}

pub(crate) const TIME: &str = "t_s";

impl Columns {
    pub(crate) fn find(path: &Path, header: &[&str]) -> Result<Self, MotionError> {
        let required = |found: Option<Column>, column| {
            found.ok_or_else(|| MotionError::MissingColumn {
                path: path.to_path_buf(),
                column,
                header: header.join(","),
            })
        };
        Ok(Self {
            time: required(find(path, header, TIME)?, TIME)?,
            position: required(either(path, header, "position_m", "device_position_m")?, "position_m")?,
            velocity: either(path, header, "velocity_mps", "device_velocity_mps")?,
        })
    }
}

fn either(
    path: &Path,
    header: &[&str],
    first: &'static str,
    second: &'static str,
) -> Result<Option<Column>, MotionError> {
    match (find(path, header, first)?, find(path, header, second)?) {
        (Some(_), Some(_)) => Err(MotionError::AmbiguousColumn {
            path: path.to_path_buf(),
            first,
            second,
        }),
        (found, None) | (None, found) => Ok(found),
    }
}

fn find(path: &Path, header: &[&str], name: &'static str) -> Result<Option<Column>, MotionError> {
    let mut places = header.iter().enumerate().filter(|(_, found)| **found == name);
    let first = places.next().map(|(index, _)| Column { name, index });
    match places.count() {
        0 => Ok(first),
        more => Err(MotionError::RepeatedColumn {
            path: path.to_path_buf(),
            column: name,
            count: 1 + more,
        }),
    }
}
