//! Reads a client's lines.

use haptic_ipc::{ErrorCode, MAX_LINE_BYTES, WireError};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use tokio::io::AsyncReadExt;
use tokio::net::unix::OwnedReadHalf;
use tokio_util::bytes::BytesMut;
use tokio_util::codec::{Decoder, LinesCodec, LinesCodecError};

pub(super) struct Lines {
    reader: OwnedReadHalf,
    codec: LinesCodec,
    buffer: BytesMut,
    /// Bytes so far.
    pub(super) received: usize,
    pub(super) ended: bool,
}

impl Lines {
    pub(super) fn new(reader: OwnedReadHalf) -> Self {
        Self {
            reader,
            codec: LinesCodec::new_with_max_length(MAX_LINE_BYTES),
            buffer: BytesMut::new(),
            received: 0,
            ended: false,
        }
    }

    /// The next line received. An unterminated last line counts as a line: no prefix of a request
    /// is a valid request.
    pub(super) fn next(&mut self) -> Option<Result<String, LinesCodecError>> {
        let decoded = if self.ended {
            self.codec.decode_eof(&mut self.buffer)
        } else {
            self.codec.decode(&mut self.buffer)
        };
        decoded.transpose()
    }

    /// Waits for more bytes or the end of the stream; false after the end.
    pub(super) async fn wait(&mut self) -> bool {
        if self.ended {
            return false;
        }
        let read = self.reader.read_buf(&mut self.buffer).await.unwrap_or(0);
        self.received += read;
        self.ended = read == 0;
        true
    }

    /// Whether the client has closed the connection, and hears no answer. One that only sends nothing more has not.
    pub(super) fn is_hung_up(&self) -> bool {
        let mut asked = [PollFd::new(self.reader.as_ref(), PollFlags::empty())];
        poll(&mut asked, Some(&Timespec::default())).is_ok() && asked[0].revents().contains(PollFlags::HUP)
    }

    /// Reads what was received so far, without waiting; returns the number of bytes.
    pub(super) fn read_now(&mut self) -> usize {
        let mut chunk = [0; 16 * 1024];
        // Asks the system itself: the runtime's knowledge of the socket may be old.
        let read = rustix::io::read(self.reader.as_ref(), &mut chunk[..]).unwrap_or(0);
        self.buffer.extend_from_slice(&chunk[..read]);
        read
    }
}

/// The refusal of a line that cannot be read.
pub(super) fn unreadable(error: &LinesCodecError) -> WireError {
    match error {
        LinesCodecError::MaxLineLengthExceeded => WireError {
            max: u32::try_from(MAX_LINE_BYTES).ok().map(f64::from),
            unit: Some("bytes".to_owned()),
            ..WireError::new(
                ErrorCode::LineTooLong,
                format!("the line is longer than the limit of {MAX_LINE_BYTES} bytes"),
            )
            .about("line")
        },
        LinesCodecError::Io(error) => WireError::new(ErrorCode::BadJson, format!("the line cannot be read: {error}")),
    }
}
