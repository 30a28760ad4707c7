//! A text up to its last newline. Its writer may have died in the middle of a line.

use std::io::{self, Read};

/// Bytes read at a time.
const CHUNK: usize = 1 << 16;

/// Longest line, bytes: a damaged file is not read into memory whole.
const MAX_LINE: usize = 1 << 20;

/// Reads whole lines only.
pub(crate) struct WholeLines<R> {
    input: R,
    ready: Vec<u8>,
    taken: usize,
    /// The beginning of a line whose end has not been read.
    partial: Vec<u8>,
}

impl<R: Read> WholeLines<R> {
    pub(crate) fn new(input: R) -> Self {
        Self {
            input,
            ready: Vec::new(),
            taken: 0,
            partial: Vec::new(),
        }
    }
}

impl<R: Read> Read for WholeLines<R> {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        while self.taken == self.ready.len() {
            let begun = self.partial.len();
            if begun > MAX_LINE {
                return Err(io::Error::new(
                    io::ErrorKind::InvalidData,
                    format!("a line is longer than {MAX_LINE} bytes: the file is damaged"),
                ));
            }
            let mut chunk = std::mem::take(&mut self.partial);
            chunk.resize(begun + CHUNK, 0);
            let read = self.input.read(&mut chunk[begun..])?;
            if read == 0 {
                return Ok(0);
            }
            chunk.truncate(begun + read);
            let whole = chunk.iter().rposition(|byte| *byte == b'\n').map_or(0, |last| last + 1);
            self.partial = chunk.split_off(whole);
            (self.ready, self.taken) = (chunk, 0);
        }
        let count = buffer.len().min(self.ready.len() - self.taken);
        buffer[..count].copy_from_slice(&self.ready[self.taken..self.taken + count]);
        self.taken += count;
        Ok(count)
    }
}
