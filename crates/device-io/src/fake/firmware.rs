//! The device's side of the link protocol, on the fake rig: a firmware in a few hundred lines of
//! Rust. It has no clock of its own: its caller passes the time.

use super::fake_rig::FakeRig;
use super::hand::Hand;
use super::mechanics::Mechanics;
use super::misbehaviour::{FaultyClock, Misbehaviour};
use super::plant::RigProperties;
use crate::protocol::DEVICE_SILENCE_NS;
use crate::protocol::message::{DeviceHello, DeviceSample, ErrorCode, FromDevice, FromHost, is_newer};
use crate::protocol::view::Axes;

/// Properties of a fake firmware, as its hello reports them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirmwareProperties {
    /// Samples a second, Hz.
    pub sample_rate_hz: u32,
    /// Largest force of each motor, N; of a rotary one its torque, N m.
    pub force_limit_n: f64,
    /// Error of its clock, parts in 1e6; positive where it is too fast.
    pub clock_ppm: f64,
    /// Time without a command after which the motor is off, ms; 0 without a watchdog.
    pub watchdog_ms: u16,
    /// Buttons that there are, one bit each.
    pub buttons: u8,
    /// Its name, as [`DeviceHello::firmware_of`] makes it.
    pub name: [u8; 24],
    /// Whether each motor is wired the other way: a positive command pulls the handle in the
    /// negative direction.
    pub reversed: [bool; 2],
    /// Whether the plugs of two encoders are swapped.
    pub swapped_encoders: bool,
    /// Whether those of two motors are.
    pub swapped_motors: bool,
}

impl Default for FirmwareProperties {
    fn default() -> Self {
        Self {
            sample_rate_hz: 1000,
            force_limit_n: 20.0,
            clock_ppm: 0.0,
            watchdog_ms: 50,
            buttons: 0,
            name: DeviceHello::firmware_of(concat!("fake-rig ", env!("CARGO_PKG_VERSION"))),
            reversed: [false; 2],
            swapped_encoders: false,
            swapped_motors: false,
        }
    }
}

/// The detail of a complaint about a message: its kind, version and length.
#[must_use]
pub fn complaint(bytes: &[u8]) -> u32 {
    let [kind, version]: [u32; 2] = [0, 1].map(|at| bytes.get(at).copied().unwrap_or(0).into());
    kind | version << 8 | u32::try_from(bytes.len()).unwrap_or(0) << 16
}

/// The forces of motors that are off, N, by axis.
const NO_FORCE: [f64; 2] = [0.0; 2];

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Silent,
    Off,
    Enabled,
}

/// A fake rig with its firmware.
#[derive(Debug)]
pub struct Firmware {
    pub(crate) mechanics: Mechanics,
    properties: FirmwareProperties,
    state: State,
    watchdog: bool,
    /// Sequence of the next sample.
    sequence: u32,
    /// Sequence of the newest message of the host's.
    newest_message: u32,
    /// Sequence of the newest command.
    command: u32,
    command_at_ns: u64,
    received_at_ns: u64,
    /// Offsets of the clock, us, and of the encoder, counts.
    clock_offset_us: u32,
    count_offset: i32,
    clock: FaultyClock,
    /// The faults that are active, and the error of the next sample, m or rad.
    wrong: Vec<Misbehaviour>,
    spike: f64,
    pressed: u8,
    /// Largest force of the motor since the last call, N.
    largest_force_n: f64,
    force_n: f64,
}

impl Firmware {
    /// A rig of one axis that was just switched on.
    #[must_use]
    pub fn new(rig: RigProperties, hand: Hand, properties: FirmwareProperties) -> Self {
        Self::of(Mechanics::Line(Box::new(FakeRig::new(rig, hand))), properties)
    }

    /// A rig that was just switched on.
    #[must_use]
    pub fn of(mechanics: Mechanics, properties: FirmwareProperties) -> Self {
        Self {
            mechanics,
            properties,
            state: State::Silent,
            watchdog: false,
            sequence: 0,
            newest_message: 0,
            command: 0,
            command_at_ns: 0,
            received_at_ns: 0,
            clock_offset_us: 0,
            count_offset: 0,
            clock: FaultyClock::default(),
            wrong: Vec::new(),
            spike: 0.0,
            pressed: 0,
            largest_force_n: 0.0,
            force_n: 0.0,
        }
    }

    /// Takes in a message at a time, ns; returns the answer, if there is one.
    pub fn receive(&mut self, message: FromHost, now_ns: u64) -> Option<FromDevice> {
        self.advance(now_ns);
        if let FromHost::Command { second_mn, .. } = message
            && second_mn.is_some() != self.mechanics.has_two_axes()
        {
            return Some(FromDevice::Error {
                code: ErrorCode::BadMessage,
                detail: complaint(message.bytes().as_slice()),
            });
        }
        let sequence = match message {
            FromHost::Hello { nonce } => {
                self.drive(NO_FORCE);
                self.state = State::Off;
                self.watchdog = false;
                (self.sequence, self.newest_message, self.command) = (0, 0, 0);
                self.received_at_ns = now_ns;
                return Some(FromDevice::Hello(self.hello(nonce)));
            }
            FromHost::Command { sequence, .. } | FromHost::Enable { sequence, .. } => sequence,
        };
        if self.state == State::Silent || !is_newer(sequence, self.newest_message) {
            return None;
        }
        self.newest_message = sequence;
        self.received_at_ns = now_ns;
        match message {
            FromHost::Command {
                force_mn,
                second_mn,
                enabled,
                ..
            } => {
                self.command = sequence;
                self.command_at_ns = now_ns;
                if !enabled {
                    if self.does(Misbehaviour::StayEnabled) || self.does(Misbehaviour::IgnoreCommandOff) {
                        return None;
                    }
                    self.state = State::Off;
                }
                self.drive(if self.state == State::Enabled {
                    [force_mn, second_mn.unwrap_or(0)].map(|effort| f64::from(effort) * self.unit())
                } else {
                    NO_FORCE
                });
                None
            }
            FromHost::Enable { enabled: true, .. } => {
                self.drive(NO_FORCE);
                self.state = State::Enabled;
                self.watchdog &= self.does(Misbehaviour::KeepMark);
                self.command_at_ns = now_ns;
                Some(FromDevice::Acknowledge { sequence, done: true })
            }
            FromHost::Enable { enabled: false, .. } => {
                // The watchdog's mark stays: it says why the motor was off before.
                if !self.does(Misbehaviour::StayEnabled) && !self.does(Misbehaviour::IgnoreOff) {
                    self.drive(NO_FORCE);
                    self.state = State::Off;
                }
                Some(FromDevice::Acknowledge { sequence, done: true })
            }
            FromHost::Hello { .. } => None,
        }
    }

    /// Takes a sample at a time, ns; nothing while it is silent.
    pub fn sample(&mut self, now_ns: u64) -> Option<FromDevice> {
        self.advance(now_ns);
        if self.state == State::Silent {
            return None;
        }
        let sequence = self.sequence;
        self.sequence = sequence.wrapping_add(1);
        let spike = self.spike_counts();
        let (count, second_count) = match self.mechanics.counts() {
            (first, Some(second)) if self.properties.swapped_encoders => (second, Some(first)),
            counts => counts,
        };
        Some(FromDevice::Sample(DeviceSample {
            sequence,
            time_us: self.clock.stamp(self.time_us(now_ns), now_ns / 1000),
            count: count.wrapping_add(spike).wrapping_add(self.count_offset),
            second_count,
            command: if self.does(Misbehaviour::NoEcho) {
                0
            } else {
                self.command
            },
            enabled: self.state == State::Enabled,
            watchdog: self.watchdog,
            buttons: self.pressed,
        }))
    }

    /// This process was kept from running for this long, ns, as no microcontroller is: its watchdog counts none of it.
    pub fn held_up(&mut self, for_ns: u64) {
        self.command_at_ns += for_ns;
        self.received_at_ns += for_ns;
    }

    /// The newest sample was never taken.
    pub fn take_back(&mut self) {
        self.sequence = self.sequence.wrapping_sub(1);
    }

    /// Samples that nobody took here, and that a microcontroller would have sent: they are lost on their way.
    #[expect(clippy::cast_possible_truncation, reason = "the sequence wraps around")]
    pub fn lose(&mut self, samples: u64) {
        if self.state != State::Silent {
            self.sequence = self.sequence.wrapping_add(samples as u32);
        }
    }

    /// Lives until a time, ns, and its watchdog with it.
    pub fn advance(&mut self, now_ns: u64) {
        let watchdog_ns = match self.properties.watchdog_ms {
            0 => u64::MAX,
            ms => u64::from(ms) * 1_000_000,
        };
        let bites_at_ns = self.command_at_ns.saturating_add(watchdog_ns);
        if !self.does(Misbehaviour::StayEnabled) && self.state == State::Enabled && now_ns >= bites_at_ns {
            // It bites when it is due, not when the caller looks.
            self.mechanics.live_until(bites_at_ns);
            self.drive(NO_FORCE);
            self.state = State::Off;
            self.watchdog = true;
        }
        self.mechanics.live_until(now_ns);
        if self.state != State::Silent && now_ns >= self.received_at_ns + DEVICE_SILENCE_NS {
            if self.does(Misbehaviour::StayEnabled) {
                return;
            }
            self.drive(NO_FORCE);
            self.state = State::Silent;
        }
    }

    /// The efforts from now on, N or N m, by motor.
    fn drive(&mut self, efforts: [f64; 2]) {
        let limit = self.properties.force_limit_n;
        let mut efforts = efforts.map(|effort| effort.clamp(-limit, limit));
        if self.properties.swapped_motors {
            efforts.reverse();
        }
        let reversed = self.properties.reversed;
        self.mechanics.drive([0, 1].map(|motor| {
            if reversed[motor] {
                -efforts[motor]
            } else {
                efforts[motor]
            }
        }));
        self.force_n = match &self.mechanics {
            Mechanics::Line(_) | Mechanics::TwoLines(_) => efforts[0],
            Mechanics::Plane(rig) => rig.force().length(),
        };
        self.largest_force_n = self.largest_force_n.max(self.force_n.abs());
    }

    /// Unit of an effort on the line: mN or uN m, in N or N m.
    fn unit(&self) -> f64 {
        if self.mechanics.are_rotary() { 1e-6 } else { 1e-3 }
    }

    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a clock that wraps around"
    )]
    fn time_us(&self, now_ns: u64) -> u32 {
        let true_us = now_ns / 1000;
        let gained_us = (true_us as f64 * self.properties.clock_ppm * 1e-6).round() as i64;
        (true_us as u32)
            .wrapping_add(gained_us as u32)
            .wrapping_add(self.clock_offset_us)
    }

    #[expect(clippy::cast_possible_truncation, reason = "as a desk-top rig would go")]
    fn spike_counts(&mut self) -> i32 {
        (std::mem::take(&mut self.spike) / self.mechanics.count()).round() as i32
    }

    fn hello(&self, nonce: u32) -> DeviceHello {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a plausible limit and resolution"
        )]
        let (counts_per_metre, force_limit_mn) = (
            (1.0 / self.mechanics.count()) as f32,
            (self.properties.force_limit_n / self.unit()).round() as u32,
        );
        DeviceHello {
            nonce,
            counts_per_metre,
            force_limit_mn,
            sample_rate_hz: self.properties.sample_rate_hz,
            watchdog_ms: self.properties.watchdog_ms,
            buttons: self.properties.buttons,
            wide: false,
            firmware: self.properties.name,
            two_axes: self.mechanics.two_axes(counts_per_metre, force_limit_mn),
        }
    }

    /// Number of its axes.
    #[must_use]
    pub fn axes(&self) -> Axes {
        if self.mechanics.has_two_axes() {
            Axes::Two
        } else {
            Axes::One
        }
    }

    /// The force on the handle, N, of two axes by themselves that of the first, in a plane its length: a motor that is
    /// wired the other way inverts the commanded force.
    #[must_use]
    pub fn force_n(&self) -> f64 {
        self.force_n
    }

    /// Largest force of the motor since the last call, N.
    pub fn take_largest_force_n(&mut self) -> f64 {
        std::mem::replace(&mut self.largest_force_n, self.force_n.abs())
    }

    /// Whether its own watchdog has switched the motor off.
    #[must_use]
    pub fn watchdog_has_tripped(&self) -> bool {
        self.watchdog
    }

    fn does(&self, wrong: Misbehaviour) -> bool {
        self.wrong.contains(&wrong)
    }

    /// Begins a misbehaviour at a time, ns; returns the error that it reports, if it is one.
    pub fn misbehave(&mut self, how: Misbehaviour, now_ns: u64) -> Option<FromDevice> {
        self.advance(now_ns);
        match how {
            Misbehaviour::Clock(fault) => self.clock.distort(fault, now_ns / 1000),
            Misbehaviour::PositionSpike(mm) => self.spike = mm * 1e-3,
            Misbehaviour::SequenceJump(by) => self.sequence = self.sequence.wrapping_add(by),
            Misbehaviour::IgnoreOff
            | Misbehaviour::IgnoreCommandOff
            | Misbehaviour::StayEnabled
            | Misbehaviour::KeepMark
            | Misbehaviour::NoEcho => self.wrong.push(how),
            Misbehaviour::Button(number, true) => self.pressed |= 1 << (number.clamp(1, 8) - 1),
            Misbehaviour::Button(number, false) => self.pressed &= !(1 << (number.clamp(1, 8) - 1)),
            Misbehaviour::HandRests(rests) => {
                if let Mechanics::Plane(rig) = &mut self.mechanics {
                    rig.rest(rests);
                }
            }
            Misbehaviour::HandOff(is_off) => match &mut self.mechanics {
                Mechanics::Line(rig) => rig.let_go(is_off),
                Mechanics::TwoLines(rigs) => rigs.iter_mut().for_each(|rig| rig.let_go(is_off)),
                Mechanics::Plane(rig) => rig.let_go(is_off),
            },
            Misbehaviour::ForceLimit(limit_n) => self.properties.force_limit_n = limit_n,
            Misbehaviour::WatchdogMs(ms) => self.properties.watchdog_ms = ms,
            Misbehaviour::Error(code, detail) => return self.report(code, detail),
            Misbehaviour::Honest => {
                self.clock.restore(now_ns / 1000);
                self.wrong.clear();
                self.spike = 0.0;
            }
        }
        None
    }

    fn report(&mut self, code: u8, detail: u32) -> Option<FromDevice> {
        if self.state == State::Silent {
            return None;
        }
        let code = ErrorCode::from_byte(code);
        if code != ErrorCode::BadMessage && !self.does(Misbehaviour::StayEnabled) {
            self.drive(NO_FORCE);
            self.state = State::Off;
        }
        Some(FromDevice::Error { code, detail })
    }

    /// Makes the encoder jump by a number of counts, as from a magnetic disturbance.
    pub fn jump(&mut self, counts: i32) {
        self.count_offset = self.count_offset.wrapping_add(counts);
    }

    /// Sets the clock so that it wraps around a time after `now_ns`, us.
    pub fn wrap_in(&mut self, time_us: u32, now_ns: u64) {
        self.clock_offset_us = 0;
        self.clock_offset_us = 0_u32.wrapping_sub(time_us).wrapping_sub(self.time_us(now_ns));
    }
}
