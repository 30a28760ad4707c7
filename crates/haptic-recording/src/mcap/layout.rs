//! A row as CDR, and the schema that says so.

use crate::columns::{Column, Kind, STATES, columns};
use haptic_ipc::{Sample, SampleY};
use haptic_motion::cdr::{self, Field};
use std::fmt::Write as _;

/// CDR's header: little endian, plain.
const CDR_HEADER: [u8; 4] = [0, 1, 0, 0];

/// Most bytes of a row; a schema that needs more is damaged.
const MAX_ROW: usize = 1 << 16;

/// Where the cells of a row are.
pub(super) struct Layout {
    /// Place and column of each cell that this version knows.
    cells: Vec<(usize, &'static Column)>,
    /// Bytes of a row.
    size: usize,
    axes: u8,
}

/// Size and name of a kind of cell in `ros2msg`.
fn type_of(kind: Kind) -> (usize, &'static str) {
    match kind {
        Kind::U64 => (8, "uint64"),
        Kind::F64 => (8, "float64"),
        Kind::U32 => (4, "uint32"),
        Kind::State => (1, "uint8"),
        Kind::Contact => (1, "int8"),
    }
}

fn size_of(kind: Kind) -> usize {
    type_of(kind).0
}

impl Layout {
    /// The layout that is written here: the largest cells first, so that none needs padding.
    pub(super) fn current(axes: u8) -> Self {
        let mut cells = Vec::with_capacity(columns(axes).len());
        let mut size = CDR_HEADER.len();
        for width in [8, 4, 1] {
            for column in columns(axes).iter().filter(|column| size_of(column.kind) == width) {
                cells.push((size, column));
                size += width;
            }
        }
        Self { cells, size, axes }
    }

    /// The schema of the current layout.
    pub(super) fn schema(axes: u8) -> String {
        let mut text = String::from(
            "# A tick of hapticd. The ends of the names are units: s, m, mps (m/s), n (N), ns.\n\n# State of the rig\n",
        );
        let mut line = |line: std::fmt::Arguments<'_>| writeln!(text, "{line}").unwrap_or_default();
        for (place, state) in STATES.iter().enumerate() {
            line(format_args!("uint8 {}={place}", state.to_uppercase()));
        }
        line(format_args!(""));
        for (_, column) in Self::current(axes).cells {
            let note = match column.kind {
                Kind::Contact => " # 0 stuck, +1 and -1 sliding",
                _ => "",
            };
            line(format_args!(
                "{} {}{note}",
                type_of(column.kind).1,
                column.name.to_lowercase()
            ));
        }
        text
    }

    /// Reads a schema, of this or a later version.
    ///
    /// # Errors
    /// It has another type than those of numbers, or lacks a column.
    pub(super) fn parse(schema: &str, axes: u8) -> Result<Self, String> {
        let (fields, other) = cdr::fields(schema);
        if let Some((type_name, name)) = other {
            return Err(format!(
                "field `{name}` has the type `{type_name}`, which has no fixed size"
            ));
        }
        let size = CDR_HEADER.len() + fields.last().map_or(0, |field| field.offset + field.size);
        if size > MAX_ROW {
            return Err(format!("a row has more than {MAX_ROW} bytes"));
        }
        let mut cells = Vec::new();
        for Field { name, kind, offset, .. } in fields {
            if let Some(column) = columns(axes)
                .iter()
                .find(|column| column.name.eq_ignore_ascii_case(&name))
            {
                let wanted = type_of(column.kind).1;
                if kind != wanted {
                    return Err(format!("field `{name}` has the type `{kind}` in place of `{wanted}`"));
                }
                // CDR counts from behind its header.
                cells.push((CDR_HEADER.len() + offset, column));
            }
        }
        let missing = columns(axes)
            .iter()
            .find(|column| !cells.iter().any(|(_, other)| other.name == column.name));
        match missing {
            Some(column) => Err(format!("there is no field `{}`", column.name.to_lowercase())),
            None => Ok(Self { cells, size, axes }),
        }
    }

    /// Writes a row in place of what `data` holds.
    pub(super) fn encode(&self, row: &Sample, y: Option<&SampleY>, data: &mut Vec<u8>) {
        data.clear();
        data.extend(CDR_HEADER);
        for (_, column) in &self.cells {
            let bytes = column.bits(row, y).to_le_bytes();
            data.extend_from_slice(&bytes[..size_of(column.kind)]);
        }
    }

    /// Reads a row.
    ///
    /// # Errors
    /// What is wrong with it.
    pub(super) fn decode(&self, data: &[u8]) -> Result<(Sample, Option<SampleY>), String> {
        if data.len() < self.size || !data.starts_with(&CDR_HEADER) {
            return Err(format!(
                "{} bytes in place of {} of little-endian CDR",
                data.len(),
                self.size
            ));
        }
        let (mut row, mut y) = (Sample::default(), SampleY::default());
        for (place, column) in &self.cells {
            let bits = match size_of(column.kind) {
                8 => u64::from_le_bytes(bytes_at(data, *place)),
                4 => u32::from_le_bytes(bytes_at(data, *place)).into(),
                _ => data[*place].into(),
            };
            if !column.set(&mut row, &mut y, bits) {
                return Err(format!("{} = {bits} is out of range", column.name));
            }
        }
        Ok((row, (self.axes == 2).then_some(y)))
    }
}

/// Bytes at a place; zeros beyond the end.
pub(super) fn bytes_at<const N: usize>(data: &[u8], place: usize) -> [u8; N] {
    data.get(place..)
        .and_then(|rest| rest.first_chunk())
        .copied()
        .unwrap_or([0; N])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tests::sample;

    #[test]
    fn a_row_is_the_struct_that_its_schema_says() {
        let schema = Layout::schema(1);
        let parsed = Layout::parse(&schema, 1).expect("it reads");
        let mut data = Vec::new();
        let current = Layout::current(1);
        current.encode(&sample(0x0102), None, &mut data);
        assert_eq!((data.len(), parsed.size, current.size), (138, 138, 138));
        assert_eq!(data[..12], [0, 1, 0, 0, 2, 1, 0, 0, 0, 0, 0, 0]);
        assert_eq!(data[20..28], 0.1_f64.to_le_bytes(), "the device's position comes third");
        assert_eq!(data[136..], [3, 255], "engaged, sliding backwards");
        assert_eq!(parsed.decode(&data), Ok((sample(0x0102), None)));
        for line in [
            "uint8 FAULTED=6",
            "uint64 tick",
            "float64 coupling_force_n",
            "uint32 input_flags",
            "uint8 state",
            "int8 contact # 0 stuck, +1 and -1 sliding",
        ] {
            assert!(schema.lines().any(|other| other == line), "{line}");
        }
    }

    #[test]
    fn rows_of_a_later_version_read_by_their_schema() {
        let schema = Layout::schema(1);
        // A later version has more, and padding before it.
        let later = format!("{schema}bool new\nfloat64 mood\n");
        let (mut data, layout) = (Vec::new(), Layout::parse(&later, 1).expect("it reads"));
        Layout::current(1).encode(&sample(7), None, &mut data);
        assert_eq!(layout.size, 4 + 136 + 8);
        data.resize(layout.size, 0);
        assert_eq!(layout.decode(&data), Ok((sample(7), None)));
        for (damaged, part) in [
            (schema.replace("uint32 error_detail\n", ""), "no field `error_detail`"),
            (
                schema.replace("uint64 tick\n", "uint32 tick\n"),
                "`uint32` in place of `uint64`",
            ),
            (format!("{schema}string word\n"), "`word` has the type `string`"),
            (
                format!("{schema}{}", "uint64 x\n".repeat(9000)),
                "more than 65536 bytes",
            ),
        ] {
            let error = Layout::parse(&damaged, 1).err().expect("damaged");
            assert!(error.contains(part), "{error}");
        }
    }

    #[test]
    fn a_row_that_is_none_is_refused() {
        let mut data = Vec::new();
        let layout = Layout::current(1);
        layout.encode(&sample(1), None, &mut data);
        assert!(layout.decode(&data[..137]).is_err());
        data[136] = 7;
        assert_eq!(layout.decode(&data), Err("state = 7 is out of range".to_owned()));
    }
}
