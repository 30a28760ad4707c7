//! Rows in their order, as they are written.

use haptic_ipc::{Sample, SampleY};
use std::io;
use std::slice;

/// Rows, and what each has of a second axis: nothing on a rig of one.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Rows<'a> {
    pub(crate) samples: &'a [Sample],
    pub(crate) ys: &'a [SampleY],
}

impl<'a> Rows<'a> {
    /// Rows of a recording with as many axes.
    ///
    /// # Errors
    /// They are of a rig with another number of axes.
    pub(crate) fn of(samples: &'a [Sample], ys: &'a [SampleY], axes: u8) -> io::Result<Self> {
        let wanted = if axes == 2 { samples.len() } else { 0 };
        if ys.len() == wanted {
            return Ok(Self { samples, ys });
        }
        let reason = match axes {
            2 => "rows of a rig of one axis in a recording of two",
            _ => "rows of a rig of two axes in a recording of one",
        };
        Err(io::Error::new(io::ErrorKind::InvalidInput, reason))
    }

    pub(crate) fn one(sample: &'a Sample, y: Option<&'a SampleY>) -> Self {
        Self {
            samples: slice::from_ref(sample),
            ys: y.map_or(&[], slice::from_ref),
        }
    }

    /// The first rows, and the others.
    pub(crate) fn split_at(self, count: usize) -> (Self, Self) {
        let (samples, later_samples) = self.samples.split_at(count);
        let (ys, later_ys) = self.ys.split_at(count.min(self.ys.len()));
        let later = Self {
            samples: later_samples,
            ys: later_ys,
        };
        (Self { samples, ys }, later)
    }

    pub(crate) fn iter(self) -> impl Iterator<Item = (&'a Sample, Option<&'a SampleY>)> {
        let rows = self.samples.iter().enumerate();
        rows.map(move |(index, row)| (row, self.ys.get(index)))
    }
}
