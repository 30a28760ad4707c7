//! What a step is made from.

use super::state::Command;
use crate::sample::{DeviceError, ErrorCode, ErrorReport, Measurement, Motor};

/// What a step is made from, beside a scene that arrives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Inputs<V = f64> {
    /// Time since the step before on our own clock, ns; zero in the first step.
    pub elapsed_ns: u64,
    /// What the device reported.
    pub sample: Result<Measurement<V>, DeviceError>,
    /// Distance between two positions that the device can distinguish, m. It changes only with the
    /// device.
    pub device_resolution_m: f64,
    /// Largest force that the device gives, N; infinite where it names none. It changes only with
    /// the device.
    pub device_force_limit_n: f64,
    /// What happened since the step before.
    pub events: Events,
    /// What a person asked for, if it may be carried out as far as the caller can tell.
    pub command: Option<Command>,
}

/// Something that can happen between two steps; its number is its bit in [`Events`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Event {
    /// A person wants zero force.
    Stop = 1,
    /// The machine slept for longer than a sample may be old.
    Slept = 2,
    /// More periods were missed than the late policy allows.
    TooLate = 4,
    /// A lease has lapsed.
    LeaseLapsed = 8,
    /// The control thread has given no sign of life for too long.
    ControlLost = 16,
}

/// What happened since the step before.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Events(u8);

impl Events {
    /// These, and another one where that happened.
    #[must_use]
    pub fn and(self, event: Event, happened: bool) -> Self {
        Self(self.0 | if happened { event as u8 } else { 0 })
    }

    /// Whether an event is among them.
    #[must_use]
    pub fn has(self, event: Event) -> bool {
        self.0 & event as u8 != 0
    }

    /// Whether nothing happened.
    #[must_use]
    pub fn is_empty(self) -> bool {
        self.0 == 0
    }
}

impl From<Event> for Events {
    fn from(event: Event) -> Self {
        Self(event as u8)
    }
}

/// The inputs of a step that are not measured numbers, as two words of a record.
///
/// | bits of the flags | what |
/// |---|---|
/// | 0 to 2 | reading: 0 a sample, 1 disconnected, 2 motor off, 3 motor off by the device's watchdog, 4 an error report, 5 no command confirmed, 6 a command confirmed too late |
/// | 3 and 4 | motor: 0 unreported, 1 enabled, 2 off but unconfirmed, 3 off |
/// | 5 to 12 | buttons |
/// | 13 to 17 | stop, slept, too late, lease lapsed, control lost |
/// | 18 and 19 | command: 0 none, 1 engage, 2 release, 3 reset |
/// | 20 | the force of this step could not be written |
/// | 21 | a scene arrived |
/// | 22 | a pulse or an excitation is rendered instead of the scene |
/// | 23 | other limits hold from this step on |
/// | 24 to 31 | code of the error report |
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct InputWord {
    /// As in the table.
    pub flags: u32,
    /// Detail of the error report.
    pub detail: u32,
}

const MOTOR: u32 = 3;
const BUTTONS: u32 = 5;
const EVENTS: u32 = 13;
const COMMAND: u32 = 18;
const WRITE_FAILED: u32 = 20;
const NEW_SCENE: u32 = 21;
const MOTION: u32 = 22;
const NEW_LIMITS: u32 = 23;
const ERROR_CODE: u32 = 24;

/// The bits of [`Events`].
const ALL_EVENTS: u8 = 0b1_1111;

impl InputWord {
    /// The word of a step's inputs, and of whether a scene arrived with it.
    #[must_use]
    #[cold]
    pub fn new<V>(inputs: &Inputs<V>, new_scene: bool) -> Self {
        Self::of_reading(inputs).with_happenings(inputs, new_scene)
    }

    /// The same of a step in which nothing happened: without events, command and scene.
    #[must_use]
    #[inline(always)]
    pub fn of_reading<V>(inputs: &Inputs<V>) -> Self {
        match &inputs.sample {
            Ok(sample) => Self {
                flags: (sample.motor as u32) << MOTOR | u32::from(sample.buttons) << BUTTONS,
                detail: 0,
            },
            Err(error) => Self::of_error(*error),
        }
    }

    #[cold]
    fn of_error(error: DeviceError) -> Self {
        let (flags, detail) = match error {
            DeviceError::Disconnected => (1, 0),
            DeviceError::MotorOff { watchdog } => (2 + u32::from(watchdog), 0),
            DeviceError::CommandsIgnored => (5, 0),
            DeviceError::CommandsLate => (6, 0),
            DeviceError::Failed(ErrorReport { code, detail }) => (4 | u32::from(code as u8) << ERROR_CODE, detail),
        };
        Self { flags, detail }
    }

    fn with_happenings<V>(mut self, inputs: &Inputs<V>, new_scene: bool) -> Self {
        let command = inputs.command.map_or(0, |command| u32::from(command.code()));
        self.flags |= u32::from(inputs.events.0) << EVENTS | command << COMMAND | u32::from(new_scene) << NEW_SCENE;
        self
    }

    /// The same, of a step whose force could not be written.
    #[must_use]
    pub fn with_write_failed(mut self) -> Self {
        self.flags |= 1 << WRITE_FAILED;
        self
    }

    /// Whether the force of the step could not be written.
    #[must_use]
    pub fn write_failed(self) -> bool {
        self.bit(WRITE_FAILED)
    }

    /// Whether a scene arrived with the step.
    #[must_use]
    pub fn new_scene(self) -> bool {
        self.bit(NEW_SCENE)
    }

    /// The same, of a step that rendered a pulse or an excitation instead of the scene.
    #[must_use]
    pub fn with_motion(mut self) -> Self {
        self.flags |= 1 << MOTION;
        self
    }

    /// Whether the step rendered a pulse or an excitation instead of the scene: its force drives the
    /// handle, and the recording does not hold what it was computed from.
    #[must_use]
    pub fn is_motion(self) -> bool {
        self.bit(MOTION)
    }

    /// The same, of the first step with other limits.
    #[must_use]
    pub fn with_new_limits(mut self) -> Self {
        self.flags |= 1 << NEW_LIMITS;
        self
    }

    /// Whether other limits hold from this step on.
    #[must_use]
    pub fn has_new_limits(self) -> bool {
        self.bit(NEW_LIMITS)
    }

    /// What happened.
    #[must_use]
    pub fn events(self) -> Events {
        Events(self.byte(EVENTS) & ALL_EVENTS)
    }

    /// Whether a button of the rig is pressed, by its bit; none is where the device sent no sample.
    #[must_use]
    pub fn is_pressed(self, button: u8) -> bool {
        self.byte(BUTTONS) & 1_u8.checked_shl(button.into()).unwrap_or(0) != 0
    }

    /// The command.
    #[must_use]
    pub fn command(self) -> Option<Command> {
        Command::from_code(self.byte(COMMAND) & 3)
    }

    /// What the device reported, with the numbers of its sample.
    ///
    /// # Errors
    /// The device reported an error.
    pub fn sample<V>(self, sequence: u32, time_ns: u64, position_m: V) -> Result<Measurement<V>, DeviceError> {
        match self.flags & 7 {
            0 => Ok(Measurement {
                sequence,
                time_ns,
                position_m,
                motor: Motor::ALL[usize::from(self.byte(MOTOR) & 3)],
                buttons: self.byte(BUTTONS),
            }),
            2 => Err(DeviceError::MotorOff { watchdog: false }),
            3 => Err(DeviceError::MotorOff { watchdog: true }),
            4 => Err(DeviceError::Failed(ErrorReport {
                code: ErrorCode::from_byte(self.byte(ERROR_CODE)),
                detail: self.detail,
            })),
            5 => Err(DeviceError::CommandsIgnored),
            6 => Err(DeviceError::CommandsLate),
            _ => Err(DeviceError::Disconnected),
        }
    }

    fn bit(self, at: u32) -> bool {
        self.flags >> at & 1 != 0
    }

    #[expect(clippy::cast_possible_truncation, reason = "a byte of the word")]
    fn byte(self, at: u32) -> u8 {
        (self.flags >> at) as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn sample() -> impl Strategy<Value = Result<Measurement, DeviceError>> {
        let motor = prop::sample::select(&Motor::ALL[..]);
        let code = prop::sample::select(
            &[
                ErrorCode::BadMessage,
                ErrorCode::Sensor,
                ErrorCode::Motor,
                ErrorCode::Other,
            ][..],
        );
        prop_oneof![
            (any::<u32>(), any::<u64>(), -1.0..1.0f64, motor, any::<u8>()).prop_map(
                |(sequence, time_ns, position_m, motor, buttons)| Ok(Measurement {
                    sequence,
                    time_ns,
                    position_m,
                    motor,
                    buttons,
                })
            ),
            Just(Err(DeviceError::Disconnected)),
            any::<bool>().prop_map(|watchdog| Err(DeviceError::MotorOff { watchdog })),
            Just(Err(DeviceError::CommandsIgnored)),
            Just(Err(DeviceError::CommandsLate)),
            (code, any::<u32>()).prop_map(|(code, detail)| Err(DeviceError::Failed(ErrorReport { code, detail }))),
        ]
    }

    proptest! {
        /// A record holds exactly the inputs of its step.
        #[test]
        fn a_word_and_the_numbers_beside_it_are_the_inputs(
            sample in sample(), flags in prop::array::uniform9(any::<bool>()), command in 0..4_usize,
        ) {
            let [stop, slept, too_late, lease_lapsed, control_lost, new_scene, write_failed, is_motion, new_limits] = flags;
            let events = Events::default()
                .and(Event::Stop, stop)
                .and(Event::Slept, slept)
                .and(Event::TooLate, too_late)
                .and(Event::LeaseLapsed, lease_lapsed)
                .and(Event::ControlLost, control_lost);
            let inputs = Inputs {
                elapsed_ns: 7,
                sample,
                device_resolution_m: 1e-5,
                device_force_limit_n: 20.0,
                events,
                command: [None, Some(Command::Engage), Some(Command::Release), Some(Command::Reset)][command],
            };
            let mut word = InputWord::new(&inputs, new_scene);
            if is_motion {
                word = word.with_motion();
            }
            if new_limits {
                word = word.with_new_limits();
            }
            if write_failed {
                // However often it is set.
                word = word.with_write_failed().with_write_failed();
            }
            let Measurement { sequence, time_ns, position_m, .. } = sample.unwrap_or(Measurement::new(0, 0, 0.0));
            prop_assert_eq!(word.sample(sequence, time_ns, position_m), sample);
            prop_assert_eq!((word.events(), word.command()), (events, inputs.command));
            let buttons = sample.map_or(0, |sample| sample.buttons);
            for button in 0..=u8::MAX {
                let is_pressed = u32::from(buttons).checked_shr(button.into()).unwrap_or(0) & 1 == 1;
                prop_assert_eq!(word.is_pressed(button), is_pressed);
            }
            let bits = [stop, slept, too_late, lease_lapsed, control_lost].map(u32::from);
            for (place, bit) in bits.into_iter().enumerate() {
                prop_assert_eq!(word.flags >> (13 + place) & 1, bit, "as the table has it");
            }
            prop_assert_eq!(events.has(Event::Stop), stop);
            prop_assert_eq!(events.is_empty(), !(stop || slept || too_late || lease_lapsed || control_lost));
            prop_assert_eq!((word.new_scene(), word.write_failed()), (new_scene, write_failed));
            prop_assert_eq!((word.is_motion(), word.flags >> 22 & 1), (is_motion, u32::from(is_motion)));
            prop_assert_eq!((word.has_new_limits(), word.flags >> 23 & 1), (new_limits, u32::from(new_limits)));
        }
    }
}
