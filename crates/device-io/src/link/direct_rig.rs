//! The fake firmware and the host's side of the link protocol with no line between them, in the time that the caller
//! passes: what a rig behind a link does, the same in every run.

use super::connector::LoopTiming;
use super::health::LinkCounters;
use super::session::{LinkSession, Outgoing};
use crate::device::{Device, DeviceBounds, DeviceError, Measurement, Written};
use crate::fake::Firmware;
use crate::protocol::message::{FromDevice, FromHost};
use std::sync::Arc;

/// A fake rig that speaks the link protocol, as a device.
#[derive(Debug)]
pub struct DirectRig {
    firmware: Firmware,
    timing: LoopTiming,
    session: Option<LinkSession>,
    bounds: DeviceBounds,
    sample_period_ns: u64,
    next_sample_ns: u64,
    now_ns: u64,
}

impl DirectRig {
    /// A rig that is plugged in at a time, ns.
    #[must_use]
    pub fn new(firmware: Firmware, timing: LoopTiming, now_ns: u64) -> Self {
        let mut rig = Self {
            firmware,
            timing,
            session: None,
            bounds: DeviceBounds::default(),
            sample_period_ns: 0,
            next_sample_ns: 0,
            now_ns,
        };
        rig.plug_in();
        rig
    }

    /// Greets the firmware, as after it was plugged in: another connection begins.
    pub fn plug_in(&mut self) {
        let now_ns = self.now_ns;
        let Some(FromDevice::Hello(hello)) = self.firmware.receive(FromHost::Hello { nonce: 7 }, now_ns) else {
            return;
        };
        self.session = Some(LinkSession::new(
            &hello,
            self.timing,
            now_ns,
            Arc::new(LinkCounters::default()),
        ));
        self.bounds = DeviceBounds {
            connection: self.bounds.connection + 1,
            // No time passes between reading and writing.
            is_linked: false,
            resolution_m: 1.0 / f64::from(hello.counts_per_metre),
            force_limit_n: f64::from(hello.force_limit_mn) * 1e-3,
        };
        self.sample_period_ns = 1_000_000_000 / u64::from(hello.sample_rate_hz.max(1));
        self.next_sample_ns = now_ns;
    }

    /// Pulls the cable out: nothing comes through, either way.
    pub fn unplug(&mut self) {
        self.session = None;
    }

    /// The firmware, as it is at the newest time.
    pub fn firmware(&mut self) -> &mut Firmware {
        self.firmware.advance(self.now_ns);
        &mut self.firmware
    }
}

impl Device for DirectRig {
    fn description(&self) -> String {
        "fake rig behind the link protocol, without a line".to_owned()
    }

    fn bounds(&self) -> DeviceBounds {
        self.bounds
    }

    fn read(&mut self, now_ns: u64) -> Result<Measurement, DeviceError> {
        self.now_ns = now_ns;
        let session = self.session.as_mut().ok_or(DeviceError::Disconnected)?;
        while self.next_sample_ns <= now_ns {
            if let Some(sample) = self.firmware.sample(self.next_sample_ns) {
                session.take(Ok(sample), now_ns);
            }
            self.next_sample_ns += self.sample_period_ns;
        }
        let measured = session.measurement(now_ns)?.ok_or(DeviceError::Disconnected)?;
        Ok(measured.at(measured.position_m[0]))
    }

    fn write(&mut self, force_n: f64, enabled: bool) -> Result<Written, DeviceError> {
        let session = self.session.as_mut().ok_or(DeviceError::Disconnected)?;
        let outgoing = session.command([force_n, 0.0], enabled, self.now_ns);
        for message in outgoing.messages() {
            if let Some(answer) = self.firmware.receive(message, self.now_ns) {
                session.take(Ok(answer), self.now_ns);
            }
        }
        Ok(if outgoing == (Outgoing::Withheld { repeats: false }) {
            Written::Later
        } else {
            Written::Taken
        })
    }
}
