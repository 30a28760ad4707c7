//! Messages in a byte stream: a message and its CRC-32, stuffed (COBS) so that zeros appear only
//! between frames. A receiver that begins in the middle, or loses bytes, is in step again at the
//! next zero.
//!
//! COBS: Cheshire and Baker, "Consistent overhead byte stuffing", IEEE/ACM Trans. Networking 7(2),
//! 1999. CRC: CRC-32/ISO-HDLC, as in Ethernet and zip.

use super::view::MAX_MESSAGE;
use crc::{CRC_32_ISO_HDLC, Crc};

static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

const CRC_BYTES: usize = 4;
/// Longest frame, bytes: a message, its CRC, one byte of stuffing (below 254 bytes there is no
/// more) and the zero that ends it.
pub const MAX_FRAME: usize = MAX_MESSAGE + CRC_BYTES + 2;

/// The bytes between two zeros are not a frame: too long or too short, stuffed as no sender does it, or with a wrong CRC.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BadFrame;

/// A frame, ready to be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frame {
    bytes: [u8; MAX_FRAME],
    length: usize,
}

impl Frame {
    /// The frame of a message of at most [`MAX_MESSAGE`] bytes; a longer one is cut, and no receiver takes it.
    #[must_use]
    pub fn of(message: &[u8]) -> Self {
        let message = &message[..message.len().min(MAX_MESSAGE)];
        let crc = CRC.checksum(message).to_le_bytes();
        let mut bytes = [0; MAX_FRAME];
        // Where the distance to the next zero goes, and how far it is by now.
        let (mut code_at, mut next) = (0, 1);
        for &byte in message.iter().chain(&crc) {
            if byte == 0 {
                bytes[code_at] = distance(next - code_at);
                code_at = next;
            } else {
                bytes[next] = byte;
            }
            next += 1;
        }
        bytes[code_at] = distance(next - code_at);
        Self {
            bytes,
            length: next + 1,
        }
    }

    /// Its bytes, the ending zero included.
    #[must_use]
    pub fn as_slice(&self) -> &[u8] {
        &self.bytes[..self.length]
    }
}

fn distance(bytes: usize) -> u8 {
    // A frame is far shorter than 255 bytes.
    u8::try_from(bytes).unwrap_or(u8::MAX)
}

/// Cuts a byte stream into messages.
#[derive(Clone, Debug)]
pub struct Decoder {
    bytes: [u8; MAX_FRAME],
    length: usize,
    too_long: bool,
}

impl Default for Decoder {
    fn default() -> Self {
        Self {
            bytes: [0; MAX_FRAME],
            length: 0,
            too_long: false,
        }
    }
}

impl Decoder {
    /// Takes the next byte of the stream. At the end of a frame it returns the message, without the
    /// CRC, or the error. Repeated zeros count as nothing.
    pub fn push(&mut self, byte: u8) -> Option<Result<&[u8], BadFrame>> {
        if byte != 0 {
            match self.bytes.get_mut(self.length) {
                Some(place) => {
                    *place = byte;
                    self.length += 1;
                }
                None => self.too_long = true,
            }
            return None;
        }
        let length = std::mem::take(&mut self.length);
        if std::mem::take(&mut self.too_long) {
            return Some(Err(BadFrame));
        }
        if length == 0 {
            return None;
        }
        Some(open(&mut self.bytes[..length]))
    }
}

/// Takes the stuffing out, in place, and the CRC off.
fn open(stuffed: &mut [u8]) -> Result<&[u8], BadFrame> {
    let mut zero_at = 0;
    while let Some(&code) = stuffed.get(zero_at) {
        // No byte between two zeros is zero, so this moves on.
        stuffed[zero_at] = 0;
        zero_at += usize::from(code);
    }
    // The last distance leads to the ending zero; one that leads beyond it was damaged, and what
    // remains has no end.
    if zero_at != stuffed.len() {
        return Err(BadFrame);
    }
    let (message, crc) = stuffed[1..].split_last_chunk::<CRC_BYTES>().ok_or(BadFrame)?;
    if CRC.checksum(message).to_le_bytes() != *crc {
        return Err(BadFrame);
    }
    Ok(message)
}
