//! The messages of the link protocol in the frames of a line, or the reports of HID.

use device_io::fake::complaint;
use device_io::protocol::frame::{Decoder, Frame};
use device_io::protocol::message::FromHost;
use device_io::protocol::view::{Axes, Kind, View, ViewError};

/// What was received from a host.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Received {
    /// A message.
    Message(FromHost),
    /// What is no message of a host, as the detail of the complaint: kind, version and length.
    Bad(u32),
}

impl Received {
    /// What bytes say by their view. Nothing for a message of a device: that is an echo on the line, and an answer to
    /// it would come back as well.
    fn read(bytes: &[u8], view: Result<View<'_>, ViewError>) -> Option<Self> {
        if bytes.len() < 2 || bytes[0] < Kind::HostHello as u8 {
            return None;
        }
        let message = view.ok().and_then(|view| FromHost::read(view).ok());
        Some(message.map_or_else(|| Self::Bad(complaint(bytes)), Self::Message))
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
    pub(crate) fn decode(&mut self, frame: &[u8], axes: Axes) -> Vec<Received> {
        if self.is_hid {
            return Received::read(frame, View::padded(frame, axes)).into_iter().collect();
        }
        let mut received = Vec::new();
        for &byte in frame {
            if let Some(Ok(message)) = self.from_host.push(byte) {
                received.extend(Received::read(message, View::whole(message)));
            }
        }
        received
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
