//! What a tick of a rig of two axes has beside its [`Sample`], and how both are one row.

use crate::sample::Sample;
use haptic_core::Vector;
use haptic_core::servo::Outputs;
use serde::de::{IgnoredAny, SeqAccess, Visitor};
use serde::ser::SerializeSeq;
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

/// Writes the struct, its column names and its cells from one list, in the order of a row.
macro_rules! sample_y {
    ($count:literal $($(#[doc = $doc:literal])* $field:ident $column:literal,)*) => {
        /// The second axis of a tick. On the wire its cells follow those of the [`Sample`], whose own are of the first
        /// axis.
        #[derive(Clone, Copy, Debug, Default, PartialEq)]
        pub struct SampleY {
            $($(#[doc = $doc])* pub $field: f64,)*
        }

        /// Names of its columns, with units, in the order of a row.
        pub const SAMPLE_Y_COLUMNS: [&str; $count] = [$($column),*];

        impl SampleY {
            /// Its cells, in the order of [`SAMPLE_Y_COLUMNS`].
            #[must_use]
            pub fn cells(&self) -> [f64; $count] {
                [$(self.$field),*]
            }

            /// From its cells.
            #[must_use]
            pub fn of_cells([$($field),*]: [f64; $count]) -> Self {
                Self { $($field),* }
            }
        }
    };
}

sample_y! {
    7
    /// Position of the device, m.
    device_position_m "device_position_y_m",
    /// Estimated velocity of the device, m/s.
    device_velocity_mps "device_velocity_y_mps",
    /// Position of the block, m.
    block_position_m "block_position_y_m",
    /// Velocity of the block, m/s.
    block_velocity_mps "block_velocity_y_mps",
    /// Force in the coupling, which drives the block, N.
    coupling_force_n "coupling_force_y_N",
    /// Force commanded on the hand after ramps and limits, N.
    command_force_n "command_force_y_N",
    /// Position as the device reported it, m.
    sample_position_m "sample_position_y_m",
}

impl SampleY {
    /// What a step of the servo has of the second axis, and the position that the device reported, m; `None` on a line.
    #[inline(always)]
    #[must_use]
    pub fn of_step<V: Vector>(outputs: &Outputs<V>, sample_position_m: V) -> Option<Self> {
        (V::AXES > 1).then(|| Self {
            device_position_m: outputs.device_position_m.second(),
            device_velocity_mps: outputs.device_velocity_mps.second(),
            block_position_m: outputs.block_position_m.second(),
            block_velocity_mps: outputs.block_velocity_mps.second(),
            coupling_force_n: outputs.coupling_force_n.second(),
            command_force_n: outputs.force_n.second(),
            sample_position_m: sample_position_m.second(),
        })
    }

    /// Its cells by the names of their columns.
    pub fn named(&self) -> impl Iterator<Item = (&'static str, f64)> {
        SAMPLE_Y_COLUMNS.into_iter().zip(self.cells())
    }
}

/// Axes of a rig that says nothing of them.
pub(crate) fn one_axis() -> u8 {
    1
}

/// Whether there is nothing to say of a rig's axes.
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks with a reference")]
pub(crate) fn is_one_axis(axes: &u8) -> bool {
    *axes == 1
}

/// A row of a rig of one axis or of two.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SampleRow {
    pub(crate) sample: Sample,
    pub(crate) y: Option<SampleY>,
}

impl From<SampleRow> for Sample {
    fn from(row: SampleRow) -> Self {
        row.sample
    }
}

impl From<Sample> for SampleRow {
    fn from(sample: Sample) -> Self {
        Self { sample, y: None }
    }
}

impl Serialize for SampleRow {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut row = serializer.serialize_seq(None)?;
        self.sample.write_cells(&mut row)?;
        for cell in self.y.iter().flat_map(SampleY::cells) {
            row.serialize_element(&cell)?;
        }
        row.end()
    }
}

impl<'de> Deserialize<'de> for SampleRow {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Cells;

        #[derive(Deserialize)]
        #[serde(untagged)]
        enum Cell {
            /// What is no number is null in JSON.
            Number(Option<f64>),
            Other(IgnoredAny),
        }

        impl<'de> Visitor<'de> for Cells {
            type Value = SampleRow;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a row of a sample")
            }

            fn visit_seq<A: SeqAccess<'de>>(self, mut cells: A) -> Result<SampleRow, A::Error> {
                let sample = Sample::of_cells(&mut cells)?;
                let mut y = [0.0; SAMPLE_Y_COLUMNS.len()];
                let mut there = 0;
                for cell in &mut y {
                    // Whether these columns are of a second axis, or of a later server, is stated beside the rows.
                    let Some(Cell::Number(number)) = cells.next_element()? else {
                        break;
                    };
                    *cell = number.unwrap_or(f64::NAN);
                    there += 1;
                }
                while cells.next_element::<IgnoredAny>()?.is_some() {}
                let y = (there == y.len()).then(|| SampleY::of_cells(y));
                Ok(SampleRow { sample, y })
            }
        }
        deserializer.deserialize_seq(Cells)
    }
}
