//! Messages as values, apart from their bytes.

use super::view::{Axes, Bytes, Kind, TWO_AXES, View, ViewError};
pub use haptic_core::sample::{ErrorCode, ErrorReport};
use thiserror::Error;

/// The abilities and units of a device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DeviceHello {
    /// The number of the host's question: an answer to an older question does not count.
    pub nonce: u32,
    /// Counts of the encoder to a metre of the handle.
    pub counts_per_metre: f32,
    /// Largest force that the motor gives, mN.
    pub force_limit_mn: u32,
    /// Samples a second, Hz.
    pub sample_rate_hz: u32,
    /// Time without a command after which the motor is off, ms.
    pub watchdog_ms: u16,
    /// Buttons that there are, one bit each.
    pub buttons: u8,
    /// Whether its measurements carry force and acceleration.
    pub wide: bool,
    /// Name and version of the firmware, in ASCII, padded with zeros.
    pub firmware: [u8; 24],
    /// What a device with two axes says beyond that.
    pub two_axes: Option<TwoAxes>,
}

/// What the hello of a device with two axes says beyond that of one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TwoAxes {
    /// Counts of the second encoder to a metre, or to a radian.
    pub second_counts: f32,
    /// Largest effort of the second motor, mN or uN m.
    pub second_limit: u32,
    /// Whether the axes are rotary: counts to a radian and efforts in uN m, of both axes.
    pub are_rotary: bool,
    /// Whether count 0 of both axes is the home pose, also after power-on.
    pub are_absolute: bool,
}

impl DeviceHello {
    /// Number of axes.
    #[must_use]
    pub fn axes(&self) -> Axes {
        axes_of(self.two_axes.as_ref())
    }

    /// Time without a command after which the motor is off, ms; nothing without a watchdog.
    #[must_use]
    pub fn watchdog(&self) -> Option<u32> {
        (self.watchdog_ms > 0).then_some(self.watchdog_ms.into())
    }

    /// Name of the firmware, as far as it is text.
    #[must_use]
    pub fn firmware_name(&self) -> String {
        self.firmware
            .iter()
            .take_while(|byte| **byte != 0)
            .map(|byte| {
                if byte.is_ascii_graphic() || *byte == b' ' {
                    char::from(*byte)
                } else {
                    '?'
                }
            })
            .collect()
    }

    /// A firmware's name as it goes into a hello: what is not ASCII becomes a question mark, what
    /// is too long is cut.
    #[must_use]
    pub fn firmware_of(name: &str) -> [u8; 24] {
        let mut firmware = [0; 24];
        for (to, from) in firmware.iter_mut().zip(name.chars()) {
            *to = u8::try_from(from).ok().filter(u8::is_ascii).unwrap_or(b'?');
        }
        firmware
    }
}

/// A sample.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeviceSample {
    /// Counts the samples since the hello; it wraps around.
    pub sequence: u32,
    /// Time of the sample, us; it wraps around after 71 minutes.
    pub time_us: u32,
    /// The encoder; it wraps around.
    pub count: i32,
    /// The encoder of the second axis, where there is one; it wraps around.
    pub second_count: Option<i32>,
    /// Sequence of the newest command that the device has taken.
    pub command: u32,
    /// Whether the motor may be driven.
    pub enabled: bool,
    /// Whether the motor was switched off by the device's own watchdog, until the next enable.
    pub watchdog: bool,
    /// Buttons that are pressed, one bit each.
    pub buttons: u8,
}

/// A message from a device.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FromDevice {
    /// Who it is.
    Hello(DeviceHello),
    /// A sample.
    Sample(DeviceSample),
    /// An enable has been carried out, or not.
    Acknowledge {
        /// Sequence of the enable.
        sequence: u32,
        /// Whether it was carried out.
        done: bool,
    },
    /// Something is wrong, and the motor is off.
    Error {
        /// What.
        code: ErrorCode,
        /// A detail for the firmware's maker.
        detail: u32,
    },
}

/// A message from a host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FromHost {
    /// Who are you? The device switches its motor off and begins again.
    Hello {
        /// Comes back in the answer.
        nonce: u32,
    },
    /// The force from now on.
    Command {
        /// Counts commands and enables since the hello; it wraps around.
        sequence: u32,
        /// Force on the hand, mN; of two axes that of the first motor, mN, or its torque, uN m.
        force_mn: i32,
        /// The same of the second motor, where there is one.
        second_mn: Option<i32>,
        /// Whether the motor may be driven. Without, it is switched off until the next enable.
        enabled: bool,
    },
    /// The motor may be driven, or no longer.
    Enable {
        /// Counts commands and enables since the hello; it wraps around.
        sequence: u32,
        /// Which of the two.
        enabled: bool,
    },
}

/// Why bytes are not a message of the other side.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum MessageError {
    /// They are not a message.
    #[error(transparent)]
    View(#[from] ViewError),
    /// The message is for the other direction.
    #[error("a {0:?} does not come from this side")]
    WrongWay(Kind),
    /// A value that no device can have.
    #[error("invalid {field}: {value}")]
    Value {
        /// Which.
        field: &'static str,
        /// What.
        value: f64,
    },
}

const ENABLED: u8 = 1;
const WATCHDOG: u8 = 1 << 1;
const WIDE: u8 = 1;
const ROTARY: u8 = 1 << 2;
const ABSOLUTE: u8 = 1 << 3;

/// Those of a message with or without fields of a second axis.
fn axes_of<T>(second: Option<&T>) -> Axes {
    if second.is_some() { Axes::Two } else { Axes::One }
}

/// Counts to a metre, or a radian, that are plausible: from a potentiometer's to a laser's.
const COUNTS_PER_METRE: std::ops::RangeInclusive<f32> = 1.0..=1e10;
/// Samples a second that are plausible.
const SAMPLE_RATE_HZ: std::ops::RangeInclusive<u32> = 10..=100_000;

impl FromDevice {
    /// Reads a message.
    ///
    /// # Errors
    /// It is not a message of a device.
    pub fn read(view: View<'_>) -> Result<Self, MessageError> {
        Ok(match view.kind() {
            Kind::DeviceHello => {
                let hello = DeviceHello {
                    wide: view.u8(2) & WIDE != 0,
                    buttons: view.u8(3),
                    nonce: view.u32(4),
                    counts_per_metre: view.f32(8),
                    force_limit_mn: view.u32(12),
                    sample_rate_hz: view.u32(16),
                    watchdog_ms: view.u16(20),
                    firmware: view.bytes(24),
                    two_axes: view.has_second_axis().then(|| TwoAxes {
                        second_counts: view.f32(48),
                        second_limit: view.u32(52),
                        are_rotary: view.u8(2) & ROTARY != 0,
                        are_absolute: view.u8(2) & ABSOLUTE != 0,
                    }),
                };
                let counts = [
                    Some(hello.counts_per_metre),
                    hello.two_axes.map(|two| two.second_counts),
                ];
                if let Some(value) = counts
                    .into_iter()
                    .flatten()
                    .find(|counts| !COUNTS_PER_METRE.contains(counts))
                {
                    return Err(MessageError::Value {
                        field: "counts_per_metre",
                        value: value.into(),
                    });
                }
                if !SAMPLE_RATE_HZ.contains(&hello.sample_rate_hz) {
                    return Err(MessageError::Value {
                        field: "sample_rate_hz",
                        value: hello.sample_rate_hz.into(),
                    });
                }
                Self::Hello(hello)
            }
            // Nothing reads what the wide one has beyond that.
            kind @ (Kind::Measurement | Kind::WideMeasurement) => Self::Sample(DeviceSample {
                enabled: view.u8(2) & ENABLED != 0,
                watchdog: view.u8(2) & WATCHDOG != 0,
                buttons: view.u8(3),
                sequence: view.u32(4),
                time_us: view.u32(8),
                count: view.i32(12),
                second_count: view.has_second_axis().then(|| view.i32(kind.length(Axes::One))),
                command: view.u32(16),
            }),
            Kind::Acknowledge => Self::Acknowledge {
                done: view.u8(2) == 0,
                sequence: view.u32(4),
            },
            Kind::Error => Self::Error {
                code: ErrorCode::from_byte(view.u8(2)),
                detail: view.u32(4),
            },
            kind @ (Kind::HostHello | Kind::Command | Kind::Enable) => return Err(MessageError::WrongWay(kind)),
        })
    }

    /// Its bytes.
    #[must_use]
    pub fn bytes(&self) -> Bytes {
        match self {
            Self::Hello(hello) => {
                let two =
                    |is_so: fn(&TwoAxes) -> bool, flag: u8| u8::from(hello.two_axes.as_ref().is_some_and(is_so)) * flag;
                let flags = (u8::from(hello.wide) * WIDE)
                    | two(|_| true, TWO_AXES)
                    | two(|two| two.are_rotary, ROTARY)
                    | two(|two| two.are_absolute, ABSOLUTE);
                let bytes = Bytes::new(Kind::DeviceHello, hello.axes())
                    .with(2, [flags, hello.buttons])
                    .with(4, hello.nonce.to_le_bytes())
                    .with(8, hello.counts_per_metre.to_le_bytes())
                    .with(12, hello.force_limit_mn.to_le_bytes())
                    .with(16, hello.sample_rate_hz.to_le_bytes())
                    .with(20, hello.watchdog_ms.to_le_bytes())
                    .with(24, hello.firmware);
                match hello.two_axes {
                    Some(two) => bytes
                        .with(48, two.second_counts.to_le_bytes())
                        .with(52, two.second_limit.to_le_bytes()),
                    None => bytes,
                }
            }
            Self::Sample(sample) => {
                let bytes = Bytes::new(Kind::Measurement, axes_of(sample.second_count.as_ref()))
                    .with(
                        2,
                        [(u8::from(sample.enabled) * ENABLED) | (u8::from(sample.watchdog) * WATCHDOG)],
                    )
                    .with(3, [sample.buttons])
                    .with(4, sample.sequence.to_le_bytes())
                    .with(8, sample.time_us.to_le_bytes())
                    .with(12, sample.count.to_le_bytes())
                    .with(16, sample.command.to_le_bytes());
                match sample.second_count {
                    Some(count) => bytes.with(20, count.to_le_bytes()),
                    None => bytes,
                }
            }
            Self::Acknowledge { sequence, done } => Bytes::new(Kind::Acknowledge, Axes::One)
                .with(2, [u8::from(!done)])
                .with(4, sequence.to_le_bytes()),
            Self::Error { code, detail } => Bytes::new(Kind::Error, Axes::One)
                .with(2, [*code as u8])
                .with(4, detail.to_le_bytes()),
        }
    }
}

impl FromHost {
    /// Reads a message.
    ///
    /// # Errors
    /// It is not a message of a host.
    pub fn read(view: View<'_>) -> Result<Self, MessageError> {
        let enabled = view.u8(2) & ENABLED != 0;
        Ok(match view.kind() {
            Kind::HostHello => Self::Hello { nonce: view.u32(4) },
            Kind::Command => Self::Command {
                enabled,
                sequence: view.u32(4),
                force_mn: view.i32(8),
                second_mn: view.has_second_axis().then(|| view.i32(12)),
            },
            Kind::Enable => Self::Enable {
                enabled,
                sequence: view.u32(4),
            },
            kind => return Err(MessageError::WrongWay(kind)),
        })
    }

    /// Its bytes.
    #[must_use]
    pub fn bytes(&self) -> Bytes {
        match *self {
            Self::Hello { nonce } => Bytes::new(Kind::HostHello, Axes::One).with(4, nonce.to_le_bytes()),
            Self::Command {
                sequence,
                force_mn,
                second_mn,
                enabled,
            } => {
                let bytes = Bytes::new(Kind::Command, axes_of(second_mn.as_ref()))
                    .with(2, [u8::from(enabled)])
                    .with(4, sequence.to_le_bytes())
                    .with(8, force_mn.to_le_bytes());
                match second_mn {
                    Some(second_mn) => bytes.with(12, second_mn.to_le_bytes()),
                    None => bytes,
                }
            }
            Self::Enable { sequence, enabled } => Bytes::new(Kind::Enable, Axes::One)
                .with(2, [u8::from(enabled)])
                .with(4, sequence.to_le_bytes()),
        }
    }
}

/// Whether `newer` comes after `than` in a count that wraps around.
#[must_use]
pub fn is_newer(newer: u32, than: u32) -> bool {
    let ahead = newer.wrapping_sub(than);
    ahead != 0 && ahead < 1 << 31
}
