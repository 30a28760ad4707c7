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

    /// Length of the whole message of a device with one axis, or two, bytes.
    #[must_use]
    pub const fn length(self, axes: Axes) -> usize {
        match (self, axes) {
            (Self::DeviceHello, Axes::One) => 48,
            (Self::DeviceHello, Axes::Two) => MAX_MESSAGE,
            (Self::Measurement, Axes::One) => 20,
            (Self::Measurement, Axes::Two) => 24,
            (Self::WideMeasurement, Axes::One) => 28,
            (Self::WideMeasurement, Axes::Two) => 40,
            (Self::Command, Axes::Two) => 16,
            (Self::Acknowledge | Self::Error | Self::HostHello, _) => 8,
            (Self::Command, Axes::One) | (Self::Enable, _) => 12,
        }
    }
}

/// Number of axes of a device.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Axes {
    /// One motor on a line.
    #[default]
    One,
    /// Two motors in a plane: every message has the fields of the second one appended.
    Two,
}

/// Longest message, bytes: the hello of a device with two axes.
pub const MAX_MESSAGE: usize = 56;

/// Flag of a hello: the device has two axes.
pub(super) const TWO_AXES: u8 = 1 << 1;

/// Why bytes are not a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum ViewError {
    /// There is no such kind of message.
    #[error("no message of version {VERSION} begins with {0:#04x}")]
    Kind(u8),
    /// It is of another version of the protocol.
    #[error("the device speaks version {0} of the link protocol, and this is version {VERSION}")]
    Version(u8),
    /// It is too short or too long.
    #[error("a message of {got} bytes where {kind:?} of {} has {}", match .axes {
        Axes::One => "one axis",
        Axes::Two => "two axes",
    }, .kind.length(*.axes))]
    Length {
        /// Its kind.
        kind: Kind,
        /// The axes that it is for; of a kind whose length tells them, one.
        axes: Axes,
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
    axes: Axes,
    bytes: &'a [u8],
}

impl<'a> View<'a> {
    /// A view of bytes that are exactly one message: its length says of how many axes.
    ///
    /// # Errors
    /// They are not.
    pub fn whole(bytes: &'a [u8]) -> Result<Self, ViewError> {
        let (kind, flagged) = header(bytes)?;
        let by_length = [Axes::One, Axes::Two]
            .into_iter()
            .find(|axes| bytes.len() == kind.length(*axes));
        match by_length {
            Some(axes) if flagged.is_none_or(|flagged| flagged == axes) => Ok(Self { kind, axes, bytes }),
            _ => Err(ViewError::Length {
                kind,
                axes: flagged.unwrap_or_default(),
                got: bytes.len(),
            }),
        }
    }

    /// A view of bytes that begin with a message of a device with so many axes, as a HID report does. A hello says
    /// itself of how many it is.
    ///
    /// # Errors
    /// They do not.
    pub fn padded(bytes: &'a [u8], axes: Axes) -> Result<Self, ViewError> {
        let (kind, flagged) = header(bytes)?;
        let axes = flagged.unwrap_or(axes);
        let whole = bytes.get(..kind.length(axes)).ok_or(ViewError::Length {
            kind,
            axes,
            got: bytes.len(),
        })?;
        Ok(Self {
            kind,
            // Those that a view of the same bytes by themselves has.
            axes: if kind.length(axes) == kind.length(Axes::One) {
                Axes::One
            } else {
                axes
            },
            bytes: whole,
        })
    }

    /// Its kind.
    #[must_use]
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Whether it has fields of a second axis.
    #[must_use]
    pub fn has_second_axis(&self) -> bool {
        self.axes == Axes::Two
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

/// The kind of a message; of a hello also the number of axes, which its flags say.
fn header(bytes: &[u8]) -> Result<(Kind, Option<Axes>), ViewError> {
    let [first, version, ..] = *bytes else {
        return Err(ViewError::Empty);
    };
    // The first two bytes are where they are in every version, so that a device of another version is known as one.
    if version != VERSION {
        return Err(ViewError::Version(version));
    }
    let kind = Kind::from_byte(first).ok_or(ViewError::Kind(first))?;
    let flags = bytes.get(2).filter(|_| kind == Kind::DeviceHello);
    let axes = flags.map(|flags| if flags & TWO_AXES == 0 { Axes::One } else { Axes::Two });
    Ok((kind, axes))
}

/// A message being written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Bytes {
    bytes: [u8; MAX_MESSAGE],
    length: usize,
}

impl Bytes {
    /// A message of a kind, of a device with so many axes; zero but for its first two bytes.
    #[must_use]
    pub fn new(kind: Kind, axes: Axes) -> Self {
        let mut bytes = [0; MAX_MESSAGE];
        bytes[0] = kind as u8;
        bytes[1] = VERSION;
        Self {
            bytes,
            length: kind.length(axes),
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
