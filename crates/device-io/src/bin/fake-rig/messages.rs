//! The messages of the link protocol in the frames of a line, or the reports of HID.

use device_io::protocol::frame::{Decoder, Frame};
use device_io::protocol::message::FromHost;
use device_io::protocol::view::{Kind, View};

/// What a host has said.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Heard {
    /// A message; of a command to two axes, with the force of the second, mN.
    Message(FromHost, i32),
    /// What is no message of a host, as the detail of the complaint: kind, version and length.
    Bad(u32),
}

impl Heard {
    /// Reads a message, which may be padded. Nothing for a message of a device: that is an echo on the line, and an answer
    /// to it would come back as well.
    fn read(bytes: &[u8], is_padded: bool, has_second_axis: bool) -> Option<Self> {
        let [kind, version, ..] = *bytes else { return None };
        if kind < Kind::HostHello as u8 {
            return None;
        }
        let (first, second_mn) = match bytes.split_at_checked(Kind::Command.length()) {
            Some((first, second)) if has_second_axis && kind == Kind::Command as u8 => {
                match second.first_chunk::<4>() {
                    Some(second_mn) if is_padded || second.len() == 4 => (first, i32::from_le_bytes(*second_mn)),
                    // A command for one axis, or none at all.
                    _ => (&bytes[..2], 0),
                }
            }
            _ => (bytes, 0),
        };
        let view = if is_padded {
            View::padded(first)
        } else {
            View::whole(first)
        };
        let message = view.ok().and_then(|view| FromHost::read(view).ok());
        let length = u32::try_from(bytes.len()).unwrap_or(0);
        Some(message.map_or(
            Self::Bad(u32::from(kind) | u32::from(version) << 8 | length << 16),
            |message| Self::Message(message, second_mn),
        ))
    }
}

/// Bytes of a HID report.
const REPORT: usize = 64;

/// Reads and writes messages.
#[derive(Debug)]
pub(crate) struct Messages {
    is_hid: bool,
    from_host: Decoder,
}

impl Messages {
    pub(crate) fn new(is_hid: bool) -> Self {
        Self {
            is_hid,
            from_host: Decoder::default(),
        }
    }

    /// What a frame says.
    pub(crate) fn decode(&mut self, frame: &[u8], has_second_axis: bool) -> Vec<Heard> {
        if self.is_hid {
            return Heard::read(frame, true, has_second_axis).into_iter().collect();
        }
        let mut heard = Vec::new();
        for &byte in frame {
            if let Some(Ok(message)) = self.from_host.push(byte) {
                heard.extend(Heard::read(message, false, has_second_axis));
            }
        }
        heard
    }

    /// The frame for a message's bytes.
    pub(crate) fn encode(&self, message: &[u8]) -> Vec<u8> {
        if !self.is_hid {
            return Frame::of(message).as_slice().to_vec();
        }
        let mut report = message.to_vec();
        report.resize(REPORT, 0);
        report
    }
}
