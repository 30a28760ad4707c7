//! The samples in sight, as CSV.

use crate::model::Model;
use crate::tape::Tape;
use crate::tape::plane::{self, Component};
use haptic_ipc::{SAMPLE_COLUMNS, SAMPLE_Y_COLUMNS};
use std::io::{self, Write};

/// Every sample in sight with every column, as CSV.
///
/// # Panics
/// Never: writing to memory cannot fail.
#[must_use]
pub fn csv(model: &Model) -> String {
    let mut text = Vec::new();
    RowsInSight::seen(model)
        .write(&mut text)
        .expect("memory can be written to");
    String::from_utf8(text).expect("numbers and names")
}

/// The samples in sight, for another thread to write: an hour is 400 MB of text.
#[derive(Debug)]
pub(crate) struct RowsInSight {
    tape: Tape,
    from_s: f64,
    to_s: f64,
}

impl RowsInSight {
    /// The samples in sight now. Nothing is copied.
    pub(crate) fn seen(model: &Model) -> Self {
        let tapes = &model.tapes;
        let scope = model.view.scope(tapes);
        let seen = scope.seen(tapes);
        Self {
            tape: scope.tape(tapes).part(seen.from_s, seen.to_s),
            from_s: seen.from_s,
            to_s: seen.to_s,
        }
    }

    pub(crate) fn write(&self, out: &mut impl Write) -> io::Result<()> {
        let y = self.tape.component(Component::Y);
        let of_y: &[&str] = if y.is_some() { &SAMPLE_Y_COLUMNS } else { &[] };
        writeln!(out, "{}", [SAMPLE_COLUMNS, of_y].concat().join(","))?;
        let mut line = Vec::new();
        let mut ys = y.into_iter().flat_map(|y| y.within(self.from_s, self.to_s));
        for sample in self.tape.within(self.from_s, self.to_s) {
            line.clear();
            // A row is a JSON array of numbers and one word: without JSON's signs it is a row of cells.
            serde_json::to_writer(&mut line, sample)?;
            if let Some(y) = ys.next() {
                line.push(b',');
                serde_json::to_writer(&mut line, &plane::of_second_axis(y).cells())?;
            }
            line.retain(|byte| !matches!(byte, b'[' | b']' | b'"'));
            line.push(b'\n');
            out.write_all(&line)?;
        }
        out.flush()
    }
}
