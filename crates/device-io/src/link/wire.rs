//! What every link of the link protocol has in common: the greeting, and a tick's reading.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

use super::connector::{ConnectError, DeviceFacts};
use super::identity::RigIdentity;
use super::session::{RejectedInput, Session};
use crate::clock;
use crate::device::{DeviceError, Measurement};
use crate::protocol::message::{DeviceHello, FromDevice, FromHost, MessageError};
use crate::protocol::view::ViewError;
use std::time::{Duration, Instant};

/// Longest wait for an answer to a hello.
const ANSWER_TIMEOUT: Duration = Duration::from_millis(250);

/// Most hellos in one attempt: boards that are reset by the opening of their port need a second or
/// two before they hear anything.
const HELLOS: u32 = 10;

/// A carrier of messages: a serial line, a HID node.
pub(super) trait Wire {
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
    let mut heard_bytes = 0;
    let mut heard = None;
    for _ in 0..HELLOS {
        let nonce = clock::nonce();
        wire.send_hello(FromHost::Hello { nonce }).map_err(gone)?;
        let asked = Instant::now();
        while asked.elapsed() < ANSWER_TIMEOUT {
            wire.wait(20_000_000);
            let mut answer = None;
            heard_bytes += wire
                .receive(|came| match came {
                    Ok(FromDevice::Hello(hello)) if hello.nonce == nonce => answer = Some(hello),
                    Ok(_) => {}
                    // A device of another version, or with two axes, must be named as one, whatever else comes.
                    Err(RejectedInput::Message(
                        error @ MessageError::View(ViewError::Version(_) | ViewError::TwoAxes),
                    )) => {
                        heard = Some(error.to_string());
                    }
                    Err(RejectedInput::Message(error)) if heard.is_none() => heard = Some(error.to_string()),
                    Err(_) => {}
                })
                .map_err(gone)?;
            if let Some(hello) = answer {
                return Ok(hello);
            }
        }
        if heard.is_some() {
            break;
        }
    }
    Err(ConnectError::Protocol {
        what: what.to_owned(),
        heard: heard.unwrap_or_else(|| unanswered(heard_bytes)),
    })
}

/// The facts in a hello of a rig.
pub(super) fn facts(hello: &DeviceHello, rig: RigIdentity) -> DeviceFacts {
    let (firmware, rig) = rig.on_chip(&hello.firmware_name());
    DeviceFacts {
        firmware,
        force_limit_n: f64::from(hello.force_limit_mn) * 1e-3,
        sample_rate_hz: f64::from(hello.sample_rate_hz),
        resolution_m: 1.0 / f64::from(hello.counts_per_metre),
        watchdog_ms: hello.watchdog(),
        buttons: hello.buttons,
        rig,
    }
}

/// Takes in all messages that have come; returns the newest sample. If the device's clock drifts
/// past ours, a tick waits for a sample that is about to come, for `wait_ns` at most, rather than
/// rendering the old one again.
///
/// # Errors
/// As [`Session::measurement`], or the device is gone.
pub(super) fn measurement(
    wire: &mut impl Wire,
    session: &mut Session,
    wait_ns: u64,
    now_ns: u64,
) -> Result<Option<Measurement>, DeviceError> {
    wire.receive(|came| session.take(came, now_ns))?;
    if !session.has_news() {
        wire.wait(wait_ns);
        let later_ns = clock::now_ns();
        wire.receive(|came| session.take(came, later_ns))?;
    }
    session.measurement(now_ns)
}
