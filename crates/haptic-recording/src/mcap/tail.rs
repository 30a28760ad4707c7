//! A file that is whole after each flush.

use std::fs::File;
use std::io::{self, Write};
use std::os::unix::fs::FileExt;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// What ends an MCAP file without a summary: `DataEnd` without a checksum, a footer of zeros, the
/// magic bytes.
pub(super) const ENDING: [u8; 50] = {
    let mut ending = [0; 50];
    // Opcode and length of each record, then the magic bytes.
    ending[0] = mcap::records::op::DATA_END;
    ending[1] = 4;
    ending[13] = mcap::records::op::FOOTER;
    ending[14] = 20;
    let mut index = 0;
    while index < mcap::MAGIC.len() {
        ending[42 + index] = mcap::MAGIC[index];
        index += 1;
    }
    ending
};

/// Collects what is written, and puts it into the file together with an ending, which the next flush
/// writes over. What does not fit on the disk leaves the file as it was.
pub(super) struct Tail {
    file: File,
    /// A pipe takes bytes in their order alone, and has no ending but the last one.
    is_file: bool,
    written: u64,
    pending: Vec<u8>,
    /// Size of the file, bytes.
    size: Arc<AtomicU64>,
}

impl Tail {
    pub(super) fn new(file: File) -> io::Result<Self> {
        Ok(Self {
            is_file: file.metadata()?.is_file(),
            file,
            written: 0,
            pending: Vec::new(),
            size: Arc::default(),
        })
    }

    /// Size of the file by now, bytes.
    pub(super) fn size(&self) -> Arc<AtomicU64> {
        Arc::clone(&self.size)
    }

    /// Puts what is left into the file, which has its ending in that.
    pub(super) fn finish(mut self) -> io::Result<()> {
        self.put(&[])?;
        if self.is_file {
            self.file.set_len(self.written)?;
        }
        Ok(())
    }

    fn put(&mut self, ending: &[u8]) -> io::Result<()> {
        let length = self.pending.len();
        if !self.is_file {
            self.file.write_all(&self.pending)?;
        } else {
            self.pending.extend_from_slice(ending);
            let put = self.file.write_all_at(&self.pending, self.written);
            self.pending.truncate(length);
            if let Err(error) = put {
                // A disk that is full has room for the ending that was there before.
                self.file.set_len(self.written).unwrap_or_default();
                self.file.write_all_at(&ENDING, self.written).unwrap_or_default();
                return Err(error);
            }
        }
        self.written += length as u64;
        self.pending.clear();
        self.size.store(self.written + ending.len() as u64, Ordering::Relaxed);
        Ok(())
    }
}

impl Write for Tail {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.pending.extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.put(&ENDING)
    }
}
