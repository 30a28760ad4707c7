//! Messages as bytes: the place of every field. Only the byte order is interpreted here, and
//! nothing can panic: a view exists only over bytes of the right kind, version and length.

use super::VERSION;
use thiserror::Error;

/// First byte of a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Kind {
    /// Device to host: who it is.
    DeviceHello = 0x01,
    /// Device to host: a sample.
    Measurement = 0x02,
    /// Device to host: a sample with force and acceleration.
    WideMeasurement = 0x03,
    /// Device to host: an enable has been carried out, or not.
    Acknowledge = 0x04,
    /// Device to host: something is wrong.
    Error = 0x05,
    /// Host to device: who are you?
    HostHello = 0x11,
    /// Host to device: the force from now on.
    Command = 0x12,
    /// Host to device: the motor may be driven, or no longer.
    Enable = 0x13,
}

impl Kind {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::DeviceHello,
        Self::Measurement,
        Self::WideMeasurement,
        Self::Acknowledge,
        Self::Error,
        Self::HostHello,
        Self::Command,
        Self::Enable,
    ];

    /// The kind with this first byte.
    #[must_use]
    pub fn from_byte(byte: u8) -> Option<Self> {
        Self::ALL.into_iter().find(|kind| *kind as u8 == byte)
    }

    /// Length of the whole message, bytes.
    #[must_use]
    pub const fn length(self) -> usize {
        match self {
            Self::DeviceHello => 48,
            Self::Measurement => 20,
            Self::WideMeasurement => 28,
            Self::Acknowledge | Self::Error | Self::HostHello => 8,
            Self::Command | Self::Enable => 12,
        }
    }
}

/// Longest message, bytes.
pub const LONGEST: usize = 48;

/// Longest message on a line, bytes: the hello of a device with two axes, which hapticd refuses by name.
pub const LONGEST_OF_TWO_AXES: usize = 56;

/// Flag of a hello: the device has two axes.
pub const TWO_AXES: u8 = 1 << 1;

/// Why bytes are not a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum ViewError {
    /// There is no such kind of message.
    #[error("no message of version {VERSION} begins with {0:#04x}")]
    Kind(u8),
    /// It is of another version of the protocol.
    #[error("the device speaks version {0} of the link protocol, and this is version {VERSION}")]
    Version(u8),
    /// It is the hello of a device with two axes.
    #[error("the device has two axes, and hapticd renders one")]
    TwoAxes,
    /// It is too short or too long.
    #[error("a message of {got} bytes where {kind:?} has {}", .kind.length())]
    Length {
        /// Its kind.
        kind: Kind,
        /// Its length, bytes.
        got: usize,
    },
    /// It has no first and second byte.
    #[error("an empty message")]
    Empty,
}

/// A message of known kind, version and length.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct View<'a> {
    kind: Kind,
    bytes: &'a [u8],
}

impl<'a> View<'a> {
    /// A view of bytes that are exactly one message.
    ///
    /// # Errors
    /// They are not.
    pub fn whole(bytes: &'a [u8]) -> Result<Self, ViewError> {
        let view = Self::padded(bytes)?;
        if bytes.len() != view.kind.length() {
            return Err(ViewError::Length {
                kind: view.kind,
                got: bytes.len(),
            });
        }
        Ok(view)
    }

    /// A view of bytes that begin with a message, as a HID report does.
    ///
    /// # Errors
    /// They do not.
    pub fn padded(bytes: &'a [u8]) -> Result<Self, ViewError> {
        let [first, version, ..] = *bytes else {
            return Err(ViewError::Empty);
        };
        // The first two bytes are where they are in every version, so that a device of another
        // version is known as one.
        if version != VERSION {
            return Err(ViewError::Version(version));
        }
        let kind = Kind::from_byte(first).ok_or(ViewError::Kind(first))?;
        if kind == Kind::DeviceHello && bytes.get(2).is_some_and(|flags| flags & TWO_AXES != 0) {
            return Err(ViewError::TwoAxes);
        }
        let bytes = bytes
            .get(..kind.length())
            .ok_or(ViewError::Length { kind, got: bytes.len() })?;
        Ok(Self { kind, bytes })
    }

    /// Its kind.
    #[must_use]
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// `N` bytes from an offset; zeros beyond the end, where no field lies.
    #[must_use]
    pub fn bytes<const N: usize>(&self, offset: usize) -> [u8; N] {
        self.bytes
            .get(offset..)
            .and_then(|rest| rest.first_chunk())
            .copied()
            .unwrap_or([0; N])
    }

    /// The byte at an offset.
    #[must_use]
    pub fn u8(&self, offset: usize) -> u8 {
        self.bytes::<1>(offset)[0]
    }

    /// The unsigned number of 16 bits at an offset.
    #[must_use]
    pub fn u16(&self, offset: usize) -> u16 {
        u16::from_le_bytes(self.bytes(offset))
    }

    /// The unsigned number of 32 bits at an offset.
    #[must_use]
    pub fn u32(&self, offset: usize) -> u32 {
        u32::from_le_bytes(self.bytes(offset))
    }

    /// The signed number of 32 bits at an offset.
    #[must_use]
    pub fn i32(&self, offset: usize) -> i32 {
        i32::from_le_bytes(self.bytes(offset))
    }

    /// The floating-point number of 32 bits at an offset.
    #[must_use]
    pub fn f32(&self, offset: usize) -> f32 {
        f32::from_le_bytes(self.bytes(offset))
    }
}

/// A message being written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bytes {
    bytes: [u8; LONGEST],
    length: usize,
}

impl Bytes {
    /// A message of a kind, zero but for its first two bytes.
    #[must_use]
    pub fn new(kind: Kind) -> Self {
        let mut bytes = [0; LONGEST];
        bytes[0] = kind as u8;
        bytes[1] = VERSION;
        Self {
            bytes,
            length: kind.length(),
        }
    }

    /// The same message with a field at an offset.
    ///
    /// # Panics
    /// The field does not lie within the longest message; every field of this protocol does.
    #[must_use]
    pub fn with<const N: usize>(mut self, offset: usize, field: [u8; N]) -> Self {
        self.bytes[offset..offset + N].copy_from_slice(&field);
        self
    }

    /// The message.
    #[must_use]
    pub fn as_slice(&self) -> &[u8] {
        &self.bytes[..self.length]
    }
}
