//! One tick, as subscribers see it.

use crate::sample_y::SampleRow;
use crate::status::RigState;
use haptic_core::servo::InputWord;
use serde::de::{DeserializeOwned, Error, SeqAccess};
use serde::ser::SerializeSeq;
use serde::{Deserialize, Serialize};

/// A cell of a row. What is no number, as the place of a linkage that cannot close, is null in JSON.
trait Cell {
    type Wire: DeserializeOwned;

    fn of(wire: Self::Wire) -> Self;
}

impl Cell for f64 {
    type Wire = Option<Self>;

    fn of(wire: Option<Self>) -> Self {
        wire.unwrap_or(Self::NAN)
    }
}

macro_rules! whole_cells {
    ($($type:ty),*) => {
        $(impl Cell for $type {
            type Wire = Self;

            fn of(wire: Self) -> Self {
                wire
            }
        })*
    };
}

whole_cells!(u64, u32, i8, RigState);

/// Writes the struct, its column names and its form as a row from one list.
macro_rules! sample {
    ($($(#[doc = $doc:literal])* $field:ident $column:literal : $type:ty $(= $default:expr)?),* $(,)?) => {
        /// One tick. On the wire it is a row: an array in the order of [`SAMPLE_COLUMNS`].
        #[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
        #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
        #[serde(from = "SampleRow", into = "SampleRow")]
        pub struct Sample {
            $($(#[doc = $doc])* pub $field: $type,)*
        }

        /// Names of a sample's columns, with units, in the order of a row.
        pub const SAMPLE_COLUMNS: &[&str] = &[$($column),*];

        /// Columns that every server has: version 1 began with these.
        pub const FIRST_SAMPLE_COLUMNS: usize = 14;

        #[cfg(feature = "schema")]
        impl schemars::JsonSchema for SampleRow {
            fn schema_name() -> std::borrow::Cow<'static, str> {
                "SampleRow".into()
            }

            fn json_schema(generator: &mut schemars::SchemaGenerator) -> schemars::Schema {
                let cells = [$({
                    let mut cell = generator.subschema_for::<<$type as Cell>::Wire>();
                    cell.insert("title".to_owned(), $column.into());
                    cell.insert("description".to_owned(), concat!($($doc),*).trim().into());
                    cell
                }),*];
                let least = FIRST_SAMPLE_COLUMNS;
                schemars::json_schema!({
                    "description": "One tick: a number or word for each column, null for what is no number. A later server \
                                    may have more columns.",
                    "type": "array",
                    "prefixItems": cells,
                    "minItems": least,
                })
            }
        }

        impl Sample {
            /// Reads the cells of a row.
            pub(crate) fn of_cells<'de, A: SeqAccess<'de>>(cells: &mut A) -> Result<Self, A::Error> {
                $(let $field = cells
                    .next_element()?
                    .map(<$type as Cell>::of)
                    // An earlier server has fewer columns.
                    $(.or(Some($default)))?
                    .ok_or_else(|| A::Error::missing_field($column))?;)*
                Ok(Self { $($field),* })
            }

            /// Writes the cells of a row.
            pub(crate) fn write_cells<S: SerializeSeq>(&self, row: &mut S) -> Result<(), S::Error> {
                $(row.serialize_element(&self.$field)?;)*
                Ok(())
            }

            /// The sample as an object with the columns' names, for those who read one at a time.
            ///
            /// # Panics
            /// Never: numbers and names can always be written.
            #[must_use]
            pub fn to_object(&self) -> serde_json::Map<String, serde_json::Value> {
                let mut object = serde_json::Map::new();
                $(object.insert(
                    $column.to_owned(),
                    serde_json::to_value(self.$field).unwrap_or(serde_json::Value::Null),
                );)*
                object
            }
        }
    };
}

/// Calls a macro with the columns of a sample, in the order of a row: for each its documentation, the
/// field of [`Sample`], the column's name, the type, and the value where an earlier server has none.
#[macro_export]
macro_rules! sample_columns {
    ($callback:ident) => {
        $callback! {
            /// Number of the tick; consecutive unless samples were thinned or dropped.
            tick "tick": u64,
            /// Time since the loop began, s, on the daemon's clock.
            t_s "t_s": f64,
            /// State of the rig.
            state "state": RigState,
            /// 0 stuck, +1 and -1 sliding.
            contact "contact": i8,
            /// Position of the device, m.
            device_position_m "device_position_m": f64,
            /// Estimated velocity of the device, m/s.
            device_velocity_mps "device_velocity_mps": f64,
            /// Position of the block, m.
            block_position_m "block_position_m": f64,
            /// Velocity of the block, m/s.
            block_velocity_mps "block_velocity_mps": f64,
            /// Force in the coupling, which drives the block, N.
            coupling_force_n "coupling_force_N": f64,
            /// Force commanded on the hand after ramps and limits, N.
            command_force_n "command_force_N": f64,
            /// Revision of the rendered scene.
            revision "revision": u64,
            /// Time from the deadline to the tick, ns.
            wake_latency_ns "wake_latency_ns": u64,
            /// Duration of the tick, ns, with the device's read and write.
            tick_ns "tick_ns": u64,
            /// Duration of the device's read and write, ns; 0 within the daemon.
            device_round_trip_ns "device_round_trip_ns": u64,
            /// Time since the previous tick, ns: with the next columns the servo's input.
            elapsed_ns "elapsed_ns": u64 = 0,
            /// Sequence of the device's sample; wraps around.
            device_sequence "device_sequence": u32 = 0,
            /// Time of the sample on the device's clock, ns.
            device_time_ns "device_time_ns": u64 = 0,
            /// Position as the device reported it, m.
            sample_position_m "sample_position_m": f64 = 0.0,
            /// The other inputs, bit by bit ([`InputWord`]).
            input_flags "input_flags": u32 = 0,
            /// Detail of an error that the device reported.
            error_detail "error_detail": u32 = 0,
        }
    };
}

sample_columns!(sample);

impl Sample {
    /// The servo's inputs that are not measured numbers.
    #[must_use]
    pub const fn input_word(&self) -> InputWord {
        InputWord {
            flags: self.input_flags,
            detail: self.error_detail,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sample_y::SampleY;

    #[test]
    fn place_that_is_no_number_is_read() {
        let lost = Sample {
            tick: 7,
            sample_position_m: f64::NAN,
            ..Sample::default()
        };
        let y = SampleY {
            device_position_m: 0.1,
            sample_position_m: f64::NAN,
            ..SampleY::default()
        };
        let row = SampleRow {
            sample: lost,
            y: Some(y),
        };
        let text = serde_json::to_string(&row).expect("writes");
        let read: SampleRow = serde_json::from_str(&text).expect("reads");
        assert!(read.sample.tick == 7 && read.sample.sample_position_m.is_nan());
        let y = read.y.expect("a second axis");
        assert!(y.device_position_m == 0.1 && y.sample_position_m.is_nan(), "{y:?}");
    }

    #[test]
    fn a_row_has_the_columns_in_their_order() {
        let row = serde_json::json!([
            7, 0.007, "engaged", -1, 0.1, 0.2, 0.3, 0.4, 5.0, -5.0, 1, 100, 200, 300, 1_000_001, 11, 12, 0.5, 13, 14
        ]);
        let sample: Sample = serde_json::from_value(row.clone()).expect("reads");
        assert_eq!((sample.t_s, sample.contact, sample.error_detail), (0.007, -1, 14));
        assert_eq!(serde_json::to_value(sample).expect("writes"), row);
        let object = sample.to_object();
        for (index, column) in SAMPLE_COLUMNS.iter().enumerate() {
            assert_eq!(row[index], object[*column], "{column}");
        }
        let mut longer = row.clone();
        longer.as_array_mut().expect("a row").push("new".into());
        assert_eq!(
            serde_json::from_value::<Sample>(longer).expect("a later server's row"),
            sample
        );
        let mut earlier = row.clone();
        earlier.as_array_mut().expect("a row").truncate(FIRST_SAMPLE_COLUMNS);
        let earlier = serde_json::from_value::<Sample>(earlier).expect("an earlier server's row");
        assert_eq!((earlier.device_round_trip_ns, earlier.elapsed_ns), (300, 0));
        let mut shorter = row;
        shorter
            .as_array_mut()
            .expect("a row")
            .truncate(FIRST_SAMPLE_COLUMNS - 1);
        let error = serde_json::from_value::<Sample>(shorter).expect_err("a column is missing");
        assert!(error.to_string().contains("device_round_trip_ns"), "{error}");
    }
}
