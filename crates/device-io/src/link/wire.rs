//! What every link of the link protocol has in common: the greeting, and the connection that follows.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

use super::connector::{ConnectError, Connection, DeviceInfo, GreetedDevice, LoopTiming, TwoMotors};
use super::health::{LinkCounters, add};
use super::identity::RigIdentity;
use super::session::{LinkSession, Outgoing, RejectedInput};
use crate::device::{self, DeviceError, Measurement, Written};
use crate::protocol::message::{DeviceHello, FromDevice, FromHost, MessageError};
use crate::protocol::view::ViewError;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;
use std::time::{Duration, Instant};

/// Longest wait for an answer to a hello.
const ANSWER_TIMEOUT: Duration = Duration::from_millis(250);

/// Most hellos in one attempt: boards that are reset by the opening of their port need a second or
/// two before they hear anything.
const HELLOS: u32 = 10;

/// A number for a hello: not that of any hello of this machine before, as far as a clock of nanoseconds can show.
fn nonce() -> u32 {
    let [a, b, c, d, ..] = device::now_ns().wrapping_mul(0x9E37_79B9_7F4A_7C15).to_be_bytes();
    u32::from_be_bytes([a, b, c, d])
}

/// A carrier of messages: a serial line, a HID node.
pub(super) trait Wire: Send + std::fmt::Debug {
    /// Sends a hello. May wait until it has gone.
    ///
    /// # Errors
    /// The device is gone.
    fn send_hello(&mut self, hello: FromHost) -> Result<(), DeviceError>;

    /// Waits for bytes, for a timeout at most, ns.
    fn wait(&self, timeout_ns: u64);

    /// Passes on all messages that have come, without waiting; returns the number of their bytes.
    ///
    /// # Errors
    /// The device is gone.
    fn receive(&mut self, each: impl FnMut(Result<FromDevice, RejectedInput>)) -> Result<usize, DeviceError>;

    /// Sends a tick's messages, without waiting; nothing where there was no room for them: the next command is another
    /// one.
    ///
    /// # Errors
    /// The device is gone.
    fn send(
        &mut self,
        outgoing: Outgoing,
        now_ns: u64,
        counters: &LinkCounters,
    ) -> Result<Option<Written>, DeviceError>;

    /// Notes the last failure in the counters, where it has not done so itself.
    fn note_failure(&mut self, _counters: &LinkCounters, _now_ns: u64) {}
}

/// Asks until the device answers. `unanswered` says what a number of bytes without an
/// answer means.
///
/// # Errors
/// It has gone, or does not speak the protocol.
pub(super) fn greet(
    wire: &mut impl Wire,
    what: &str,
    unanswered: impl FnOnce(usize) -> String,
) -> Result<DeviceHello, ConnectError> {
    let gone = |_| ConnectError::Absent { what: what.to_owned() };
    let mut received_bytes = 0;
    let mut problem = None;
    for _ in 0..HELLOS {
        let nonce = nonce();
        wire.send_hello(FromHost::Hello { nonce }).map_err(gone)?;
        let asked = Instant::now();
        while asked.elapsed() < ANSWER_TIMEOUT {
            wire.wait(20_000_000);
            let mut answer = None;
            received_bytes += wire
                .receive(|came| match came {
                    Ok(FromDevice::Hello(hello)) if hello.nonce == nonce => answer = Some(hello),
                    Ok(_) => {}
                    // A device of another version must be named as one, whatever else comes.
                    Err(RejectedInput::Message(error @ MessageError::View(ViewError::Version(_)))) => {
                        problem = Some(error.to_string());
                    }
                    Err(RejectedInput::Message(error)) if problem.is_none() => problem = Some(error.to_string()),
                    Err(_) => {}
                })
                .map_err(gone)?;
            if let Some(hello) = answer {
                return Ok(hello);
            }
        }
        if problem.is_some() {
            break;
        }
    }
    Err(ConnectError::Protocol {
        what: what.to_owned(),
        problem: problem.unwrap_or_else(|| unanswered(received_bytes)),
    })
}

/// A device that has sent a hello, and the connection to it.
pub(super) fn greeted(
    wire: impl Wire + 'static,
    hello: &DeviceHello,
    rig: RigIdentity,
    timing: LoopTiming,
    counters: &Arc<LinkCounters>,
) -> GreetedDevice {
    let (firmware, rig) = rig.on_chip(&hello.firmware_name());
    let motors = two_motors(hello);
    // Of rotary motors the hand has neither before there are kinematics.
    let of_line = |value: f64| {
        if motors.is_some_and(|motors| motors.are_rotary) {
            0.0
        } else {
            value
        }
    };
    GreetedDevice {
        device: DeviceInfo {
            connection: 0,
            firmware,
            force_limit_n: of_line(f64::from(hello.force_limit_mn) * 1e-3),
            sample_rate_hz: f64::from(hello.sample_rate_hz),
            resolution_m: of_line(1.0 / f64::from(hello.counts_per_metre)),
            watchdog_ms: hello.watchdog(),
            buttons: hello.buttons,
            rig,
            motors,
        },
        connection: Box::new(WireConnection {
            wire,
            session: LinkSession::new(hello, timing, device::now_ns(), Arc::clone(counters)),
            counters: Arc::clone(counters),
            wait_ns: timing.period_ns / 4,
        }),
    }
}

fn two_motors(hello: &DeviceHello) -> Option<TwoMotors> {
    let two = hello.two_axes?;
    let limit = |units: u32| f64::from(units) * if two.are_rotary { 1e-6 } else { 1e-3 };
    Some(TwoMotors {
        counts: [hello.counts_per_metre, two.second_counts].map(|counts| 1.0 / f64::from(counts)),
        limits: [hello.force_limit_mn, two.second_limit].map(limit),
        are_rotary: two.are_rotary,
        are_absolute: two.are_absolute,
    })
}

/// A carrier and the session on it.
#[derive(Debug)]
pub(super) struct WireConnection<W: Wire> {
    pub(super) wire: W,
    pub(super) session: LinkSession,
    pub(super) counters: Arc<LinkCounters>,
    /// Longest wait in a tick for a sample that is about to come, ns.
    pub(super) wait_ns: u64,
}

impl<W: Wire> WireConnection<W> {
    /// Takes in all messages that have come. If the device's clock drifts past ours, a tick waits for a sample that is
    /// about to come rather than rendering the old one again.
    fn receive(&mut self, now_ns: u64) -> Result<(), DeviceError> {
        let Self {
            wire, session, wait_ns, ..
        } = self;
        wire.receive(|came| session.take(came, now_ns))?;
        if !session.has_news() {
            wire.wait(*wait_ns);
            let later_ns = device::now_ns();
            wire.receive(|came| session.take(came, later_ns))?;
        }
        Ok(())
    }
}

impl<W: Wire> Connection for WireConnection<W> {
    fn read(&mut self, now_ns: u64) -> Result<Option<Measurement<[f64; 2]>>, DeviceError> {
        let received = self.receive(now_ns);
        self.wire.note_failure(&self.counters, now_ns);
        received.and_then(|()| self.session.measurement(now_ns))
    }

    fn write(&mut self, efforts: [f64; 2], enabled: bool, now_ns: u64) -> Result<Written, DeviceError> {
        let outgoing = self.session.command(efforts, enabled, now_ns);
        let sent = self.wire.send(outgoing, now_ns, &self.counters);
        self.wire.note_failure(&self.counters, now_ns);
        Ok(sent?.unwrap_or_else(|| {
            add(&self.counters.not_sent, 1);
            self.session.forget_order();
            Written::Later
        }))
    }
}

impl<W: Wire> Drop for WireConnection<W> {
    /// The last command is that the motor is off. A writer, dropped after this, sends it before it ends.
    fn drop(&mut self) {
        let now_ns = device::now_ns();
        let outgoing = self.session.command([0.0; 2], false, now_ns);
        if self.wire.send(outgoing, now_ns, &self.counters).is_err() {
            // The device does not hear it; its own watchdog does the rest.
        }
        self.counters.age_ns.store(0, Relaxed);
    }
}
