//! The device's side of the link protocol, on the fake rig: what a firmware does, in a few hundred lines of Rust. It has no clock of its own; whoever runs it says what time it is.

use super::{FakeRig, Hand, RigProperties};
use crate::protocol::message::{DeviceHello, DeviceSample, FromDevice, FromHost, is_newer};

/// The motor is off after so long without a command, ns.
const WATCHDOG_NS: u64 = 50_000_000;
/// Nothing is sent after so long without a valid message, ns.
const SILENCE_NS: u64 = 1_000_000_000;

/// What a fake firmware says of itself.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirmwareProperties {
    /// Samples a second, Hz.
    pub sample_rate_hz: u32,
    /// Largest force, N.
    pub force_limit_n: f64,
    /// How much faster than the true one its clock runs, parts in 1e6.
    pub clock_ppm: f64,
}

impl Default for FirmwareProperties {
    fn default() -> Self {
        Self {
            sample_rate_hz: 1000,
            force_limit_n: 20.0,
            clock_ppm: 0.0,
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    Silent,
    Off,
    Enabled,
}

/// A fake rig with its firmware.
#[derive(Debug)]
pub struct Firmware {
    rig: FakeRig,
    properties: FirmwareProperties,
    state: State,
    watchdog: bool,
    /// Sequence of the next sample.
    sequence: u32,
    /// Sequence of the newest message of the host's.
    heard: u32,
    /// Sequence of the newest command.
    command: u32,
    command_at_ns: u64,
    heard_at_ns: u64,
    /// What is added to the clock, us, and to the encoder, counts.
    clock_offset_us: u32,
    count_offset: i32,
    /// The largest force that the motor gave since this was last asked, N.
    largest_force_n: f64,
    force_n: f64,
}

impl Firmware {
    /// A rig, switched on.
    #[must_use]
    pub fn new(rig: RigProperties, hand: Hand, properties: FirmwareProperties) -> Self {
        Self {
            rig: FakeRig::new(rig, hand),
            properties,
            state: State::Silent,
            watchdog: false,
            sequence: 0,
            heard: 0,
            command: 0,
            command_at_ns: 0,
            heard_at_ns: 0,
            clock_offset_us: 0,
            count_offset: 0,
            largest_force_n: 0.0,
            force_n: 0.0,
        }
    }

    /// Takes a message at a time, ns; returns the answer, if there is one.
    pub fn receive(&mut self, message: FromHost, now_ns: u64) -> Option<FromDevice> {
        self.advance(now_ns);
        let sequence = match message {
            FromHost::Hello { nonce } => {
                self.drive(0.0);
                self.state = State::Off;
                self.watchdog = false;
                (self.sequence, self.heard, self.command) = (0, 0, 0);
                self.heard_at_ns = now_ns;
                return Some(FromDevice::Hello(self.hello(nonce)));
            }
            FromHost::Command { sequence, .. } | FromHost::Enable { sequence, .. } => sequence,
        };
        if self.state == State::Silent || !is_newer(sequence, self.heard) {
            return None;
        }
        self.heard = sequence;
        self.heard_at_ns = now_ns;
        match message {
            FromHost::Command { force_mn, enabled, .. } => {
                self.command = sequence;
                self.command_at_ns = now_ns;
                if !enabled {
                    self.state = State::Off;
                }
                self.drive(if self.state == State::Enabled {
                    f64::from(force_mn) * 1e-3
                } else {
                    0.0
                });
                None
            }
            FromHost::Enable { enabled, .. } => {
                self.drive(0.0);
                self.state = if enabled { State::Enabled } else { State::Off };
                self.watchdog = false;
                self.command_at_ns = now_ns;
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
        let position_m = self.rig.plant().position_m();
        let sequence = self.sequence;
        self.sequence = sequence.wrapping_add(1);
        #[expect(
            clippy::cast_possible_truncation,
            reason = "a desk-top rig goes far less than 2^31 counts"
        )]
        let count = (position_m / self.resolution_m()).round() as i32;
        Some(FromDevice::Sample(DeviceSample {
            sequence,
            time_us: self.time_us(now_ns),
            count: count.wrapping_add(self.count_offset),
            command: self.command,
            enabled: self.state == State::Enabled,
            watchdog: self.watchdog,
            buttons: 0,
            wide: None,
        }))
    }

    /// Lets time go by, and the watchdog with it.
    fn advance(&mut self, now_ns: u64) {
        let bites_at_ns = self.command_at_ns + WATCHDOG_NS;
        if self.state == State::Enabled && now_ns >= bites_at_ns {
            // In the fake as in a real one it bites when it is due, whenever somebody looks.
            self.rig.live_until(bites_at_ns);
            self.drive(0.0);
            self.state = State::Off;
            self.watchdog = true;
        }
        self.rig.live_until(now_ns);
        if self.state != State::Silent && now_ns >= self.heard_at_ns + SILENCE_NS {
            self.drive(0.0);
            self.state = State::Silent;
        }
    }

    fn drive(&mut self, force_n: f64) {
        let limit = self.properties.force_limit_n;
        self.force_n = force_n.clamp(-limit, limit);
        self.largest_force_n = self.largest_force_n.max(self.force_n.abs());
        self.rig.drive(self.force_n);
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

    fn resolution_m(&self) -> f64 {
        let resolution = self.rig.properties().resolution_m;
        if resolution > 0.0 { resolution } else { 1e-9 }
    }

    fn hello(&self, nonce: u32) -> DeviceHello {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a plausible limit and resolution"
        )]
        let (counts_per_metre, force_limit_mn) = (
            (1.0 / self.resolution_m()) as f32,
            (self.properties.force_limit_n * 1000.0) as u32,
        );
        DeviceHello {
            nonce,
            counts_per_metre,
            force_limit_mn,
            sample_rate_hz: self.properties.sample_rate_hz,
            watchdog_ms: 50,
            buttons: 0,
            wide: false,
            firmware: DeviceHello::firmware_of(concat!("fake-rig ", env!("CARGO_PKG_VERSION"))),
        }
    }

    /// The force that the motor gives, N.
    #[must_use]
    pub fn force_n(&self) -> f64 {
        self.force_n
    }

    /// The largest force that the motor gave since this was last asked, N.
    pub fn take_largest_force_n(&mut self) -> f64 {
        std::mem::replace(&mut self.largest_force_n, self.force_n.abs())
    }

    /// Whether its own watchdog has switched the motor off.
    #[must_use]
    pub fn watchdog_has_bitten(&self) -> bool {
        self.watchdog
    }

    /// What it measures and drives.
    #[must_use]
    pub fn rig(&self) -> &FakeRig {
        &self.rig
    }

    /// The encoder jumps by so many counts, as from a magnetic disturbance.
    pub fn jump(&mut self, counts: i32) {
        self.count_offset = self.count_offset.wrapping_add(counts);
    }

    /// Sets the clock so that it wraps around so much later than `now_ns`, us.
    pub fn wrap_in(&mut self, time_us: u32, now_ns: u64) {
        self.clock_offset_us = 0;
        self.clock_offset_us = 0_u32.wrapping_sub(time_us).wrapping_sub(self.time_us(now_ns));
    }
}
