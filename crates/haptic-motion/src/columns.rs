//! Which columns of a table make a motion.

use crate::MotionRow;
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
    pub(crate) position_y: Option<Column>,
    pub(crate) velocity_y: Option<Column>,
}

pub(crate) const TIME: &str = "t_s";

impl Columns {
    pub(crate) fn find(path: &Path, header: &[&str]) -> Result<Self, MotionError> {
        let required = |found: Option<Column>, column| {
            found.ok_or_else(|| MotionError::missing_column(path, column, &header.join(",")))
        };
        let position_y = either(path, header, "position_y_m", "device_position_y_m")?;
        let velocity_y = match position_y {
            Some(_) => either(path, header, "velocity_y_mps", "device_velocity_y_mps")?,
            None => None,
        };
        Ok(Self {
            position_y,
            velocity_y,
            time: required(find(path, header, TIME)?, TIME)?,
            position: required(either(path, header, "position_m", "device_position_m")?, "position_m")?,
            velocity: either(path, header, "velocity_mps", "device_velocity_mps")?,
        })
    }

    /// Its columns in the order of a [`MotionRow`]'s fields.
    pub(crate) fn all(&self) -> [Option<Column>; 5] {
        [
            Some(self.time),
            Some(self.position),
            self.velocity,
            self.position_y,
            self.velocity_y,
        ]
    }

    /// A row of its cells, which are asked for in the order of [`all`](Self::all).
    pub(crate) fn row(
        &self,
        mut cell: impl FnMut(&Column) -> Result<f64, MotionError>,
    ) -> Result<MotionRow, MotionError> {
        Ok(MotionRow {
            t_s: cell(&self.time)?,
            position_m: cell(&self.position)?,
            velocity_mps: self.velocity.as_ref().map(&mut cell).transpose()?,
            position_y_m: self.position_y.as_ref().map(&mut cell).transpose()?,
            velocity_y_mps: self.velocity_y.as_ref().map(&mut cell).transpose()?,
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
        (Some(_), Some(_)) => {
            let reason =
                format!("both `{first}` and `{second}` are columns, and either could be meant: remove or rename one");
            Err(MotionError::new(path, reason))
        }
        (found, None) | (None, found) => Ok(found),
    }
}

fn find(path: &Path, header: &[&str], name: &'static str) -> Result<Option<Column>, MotionError> {
    let mut places = header.iter().enumerate().filter(|(_, found)| **found == name);
    let first = places.next().map(|(index, _)| Column { name, index });
    match places.count() {
        0 => Ok(first),
        more => {
            let count = 1 + more;
            let reason = "and any could be meant: remove or rename all but one";
            Err(MotionError::new(
                path,
                format_args!("there are {count} columns `{name}`, {reason}"),
            ))
        }
    }
}
