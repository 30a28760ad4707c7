//! The columns of a row, each as 64 bits: what the formats share.

use haptic_ipc::{RigState, SAMPLE_COLUMNS, SAMPLE_Y_COLUMNS, Sample, SampleY};

/// What the cells of a column are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Kind {
    U64,
    U32,
    F64,
    /// -1, 0 or 1.
    Contact,
    /// A [`RigState`], by its place in [`RigState::ALL`].
    State,
}

/// Names of the states, in the order of [`RigState::ALL`].
pub(crate) const STATES: [&str; 7] = [
    "disconnected",
    "idle",
    "engaging",
    "engaged",
    "releasing",
    "stopped",
    "faulted",
];

/// A column.
pub(crate) struct Column {
    /// Its name, with its unit.
    pub(crate) name: &'static str,
    pub(crate) kind: Kind,
    get: fn(&Sample, Option<&SampleY>) -> u64,
    set: fn(&mut Sample, &mut SampleY, u64) -> bool,
}

impl Column {
    /// The cell's bits: those of the number, of a state its place.
    pub(crate) fn bits(&self, sample: &Sample, y: Option<&SampleY>) -> u64 {
        (self.get)(sample, y)
    }

    /// Sets the cell; says whether the bits are one of this kind.
    #[must_use]
    pub(crate) fn set(&self, sample: &mut Sample, y: &mut SampleY, bits: u64) -> bool {
        (self.set)(sample, y, bits)
    }
}

/// The columns of a recording by its axes: [`SAMPLE_COLUMNS`], and those of a second axis behind them.
pub(crate) fn columns(axes: u8) -> &'static [Column] {
    match axes {
        2 => COLUMNS,
        _ => &COLUMNS[..SAMPLE_COLUMNS.len()],
    }
}

/// A cell as bits.
trait Cell: Sized {
    const KIND: Kind;
    fn bits(self) -> u64;
    fn from_bits(bits: u64) -> Option<Self>;
}

impl Cell for u64 {
    const KIND: Kind = Kind::U64;

    fn bits(self) -> u64 {
        self
    }

    fn from_bits(bits: u64) -> Option<Self> {
        Some(bits)
    }
}

impl Cell for u32 {
    const KIND: Kind = Kind::U32;

    fn bits(self) -> u64 {
        self.into()
    }

    fn from_bits(bits: u64) -> Option<Self> {
        bits.try_into().ok()
    }
}

impl Cell for f64 {
    const KIND: Kind = Kind::F64;

    fn bits(self) -> u64 {
        self.to_bits()
    }

    fn from_bits(bits: u64) -> Option<Self> {
        Some(Self::from_bits(bits))
    }
}

impl Cell for i8 {
    const KIND: Kind = Kind::Contact;

    fn bits(self) -> u64 {
        self.cast_unsigned().into()
    }

    fn from_bits(bits: u64) -> Option<Self> {
        u8::try_from(bits).ok().map(u8::cast_signed)
    }
}

impl Cell for RigState {
    const KIND: Kind = Kind::State;

    fn bits(self) -> u64 {
        self as u64
    }

    fn from_bits(bits: u64) -> Option<Self> {
        Self::ALL.get(usize::try_from(bits).ok()?).copied()
    }
}

/// A column of the second axis, by its place among them.
macro_rules! second {
    ($place:literal $field:ident) => {
        Column {
            name: SAMPLE_Y_COLUMNS[$place],
            kind: Kind::F64,
            get: |_, y| y.map_or(0.0, |y| y.$field).to_bits(),
            set: |_, y, bits| {
                y.$field = f64::from_bits(bits);
                true
            },
        }
    };
}

macro_rules! columns {
    ($($(#[$doc:meta])* $field:ident $name:literal : $type:ty $(= $default:expr)?),* $(,)?) => {
        const COLUMNS: &[Column] = &[
            $(Column {
                name: $name,
                kind: <$type as Cell>::KIND,
                get: |sample, _| sample.$field.bits(),
                set: |sample, _, bits| match <$type as Cell>::from_bits(bits) {
                    Some(cell) => {
                        sample.$field = cell;
                        true
                    }
                    None => false,
                },
            },)*
            second!(0 device_position_m),
            second!(1 device_velocity_mps),
            second!(2 block_position_m),
            second!(3 block_velocity_mps),
            second!(4 coupling_force_n),
            second!(5 command_force_n),
            second!(6 sample_position_m),
        ];
    };
}

haptic_ipc::sample_columns!(columns);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_column_of_a_row_is_there_in_its_place() {
        let names = |axes| columns(axes).iter().map(|column| column.name).collect::<Vec<_>>();
        assert_eq!(names(1), SAMPLE_COLUMNS);
        assert_eq!(names(2), [SAMPLE_COLUMNS, &SAMPLE_Y_COLUMNS].concat());
        let (mut sample, mut y) = (Sample::default(), SampleY::default());
        for (column, bits) in COLUMNS
            .iter()
            .zip([3, 1.5_f64.to_bits(), 5, 255].into_iter().chain(20..))
        {
            assert!(column.set(&mut sample, &mut y, bits), "{}", column.name);
            assert_eq!(column.bits(&sample, Some(&y)), bits, "{}", column.name);
        }
        let object = sample.to_object();
        assert_eq!(object["tick"], 3);
        assert_eq!(object["state"], "stopped");
        assert_eq!(object["contact"], -1);
        assert_eq!(object["error_detail"], 35);
        assert_eq!(y.cells().map(f64::to_bits), [36, 37, 38, 39, 40, 41, 42]);
        assert_eq!(RigState::ALL.map(|state| state as usize), [0, 1, 2, 3, 4, 5, 6]);
        assert_eq!(RigState::ALL.map(|state| state.to_string()), STATES);
        for (name, bits) in [("state", 7), ("contact", 256), ("input_flags", 1 << 32)] {
            let column = COLUMNS.iter().find(|column| column.name == name).expect("a column");
            assert!(!column.set(&mut sample, &mut y, bits), "{name}");
        }
    }
}
