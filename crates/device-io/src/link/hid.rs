//! A rig on USB HID, read and written at its /dev/hidraw node.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

use super::connector::{ConnectError, Connector, GreetedDevice, LoopTiming};
use super::health::{LinkCounters, LinkError};
use super::hid_node::{HidId, choose, nodes, open_node, what};
use super::identity::RigIdentity;
use super::reports::{MAX_REPORT, Reports};
use super::session::{Outgoing, RejectedInput};
use super::wire::{self, Wire};
use super::writer::Writer;
use crate::device::{DeviceError, Written, now_ns};
use crate::protocol::message::{FromDevice, FromHost, MessageError};
use crate::protocol::view::{Axes, Kind, View};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::OwnedFd;
use rustix::io::Errno;
use std::ffi::OsStr;
use std::path::PathBuf;
use std::sync::Arc;

/// Most reports in a tick. The kernel keeps the oldest 63 unread ones, so all of them must be read
/// before the newest. If a device sends faster than that, the rest waits for the next tick.
const MAX_READS: usize = 128;

/// Longest time without room for a report, ns. A real node never says that it has no room: it
/// waits.
const NO_ROOM_NS: i64 = 100_000_000;

/// A node and the reports on it.
#[derive(Debug)]
struct Node {
    node: OwnedFd,
    counters: Arc<LinkCounters>,
    reports: Reports,
}

/// A node, and the thread that writes to it once the device is greeted.
#[derive(Debug)]
pub(super) struct HidWire {
    node: Arc<Node>,
    /// Those of the last hello: in a report no length tells them.
    axes: Axes,
    writer: Option<Writer>,
}

impl Node {
    /// Sends a message as a report. A real node waits until the report has gone.
    fn send(&self, message: FromHost) -> Result<(), DeviceError> {
        // The kernel takes the report's number first, 0 for none, and does not send it.
        let mut bytes = [0; 1 + MAX_REPORT];
        let message = message.bytes();
        let message = message.as_slice();
        bytes[1..=message.len()].copy_from_slice(message);
        loop {
            match rustix::io::write(&self.node, &bytes[..=self.reports.output]) {
                Ok(_) => return Ok(()),
                Err(Errno::INTR) => {}
                Err(Errno::AGAIN) if self.poll(PollFlags::OUT, NO_ROOM_NS) => {}
                Err(error) => return Err(self.fail(LinkError::Write(error.raw_os_error()))),
            }
        }
    }

    fn fail(&self, failure: LinkError) -> DeviceError {
        self.counters.note_error(failure, now_ns());
        DeviceError::Disconnected
    }

    /// Whether the node became ready, or failed, within a time, ns.
    fn poll(&self, flags: PollFlags, timeout_ns: i64) -> bool {
        let timeout = Timespec {
            tv_sec: 0,
            tv_nsec: timeout_ns,
        };
        poll(&mut [PollFd::new(&self.node, flags)], Some(&timeout)) == Ok(1)
    }
}

impl HidWire {
    pub(super) fn new(node: OwnedFd, reports: Reports, counters: &Arc<LinkCounters>) -> Self {
        let counters = Arc::clone(counters);
        let node = Node {
            node,
            counters,
            reports,
        };
        Self {
            node: Arc::new(node),
            axes: Axes::One,
            writer: None,
        }
    }

    /// Starts the thread that writes what a tick sends.
    pub(super) fn start_writer(&mut self, what: &str) -> Result<(), ConnectError> {
        let node = Arc::clone(&self.node);
        let writer = Writer::start(now_ns(), move |message| node.send(message));
        self.writer = Some(writer.map_err(|error| ConnectError::Refused {
            what: what.to_owned(),
            why: format!("the thread that writes to it: {error}"),
            remedy: "end other programs, or raise the limit of processes".to_owned(),
        })?);
        Ok(())
    }
}

impl Wire for HidWire {
    fn send_hello(&mut self, hello: FromHost) -> Result<(), DeviceError> {
        self.node.send(hello)
    }

    fn wait(&self, timeout_ns: u64) {
        // The read that follows shows the result.
        self.node
            .poll(PollFlags::IN, i64::try_from(timeout_ns.min(999_999_999)).unwrap_or(0));
    }

    fn receive(&mut self, mut each: impl FnMut(Result<FromDevice, RejectedInput>)) -> Result<usize, DeviceError> {
        if let Some(writer) = &self.writer {
            writer.check()?;
        }
        let Self { node, axes, .. } = self;
        let Node { node: file, .. } = &**node;
        let mut received = 0;
        for _ in 0..MAX_READS {
            let mut report = [0; MAX_REPORT];
            match rustix::io::read(file, &mut report) {
                Ok(0) => return Err(node.fail(LinkError::HungUp)),
                Ok(count) => {
                    received += count;
                    let message = View::padded(&report[..count], *axes)
                        .map_err(MessageError::from)
                        .and_then(FromDevice::read);
                    if let Ok(FromDevice::Hello(hello)) = &message {
                        *axes = hello.axes();
                    }
                    each(message.map_err(RejectedInput::Message));
                }
                Err(Errno::AGAIN) => break,
                Err(Errno::INTR) => {}
                Err(error) => return Err(node.fail(LinkError::Read(error.raw_os_error()))),
            }
        }
        Ok(received)
    }

    fn send(
        &mut self,
        outgoing: Outgoing,
        now_ns: u64,
        counters: &LinkCounters,
    ) -> Result<Option<Written>, DeviceError> {
        let writer = self.writer.as_mut().ok_or(DeviceError::Disconnected)?;
        writer.post(outgoing, now_ns, counters).map(Some)
    }
}

/// Finds and greets a rig on USB HID.
#[derive(Debug)]
pub(crate) struct HidConnector {
    pub(crate) id: HidId,
}

impl Connector for HidConnector {
    fn address(&self) -> String {
        what(&self.id)
    }

    fn folder(&self) -> PathBuf {
        PathBuf::from("/dev")
    }

    fn concerns(&self, node: &OsStr) -> bool {
        node.as_encoded_bytes().starts_with(b"hidraw")
    }

    fn connect(&mut self, timing: LoopTiming, counters: &Arc<LinkCounters>) -> Result<GreetedDevice, ConnectError> {
        let (node, reports) = choose(nodes(), &self.id)?;
        let what = what(&self.id);
        let mut wire = HidWire::new(open_node(&node.path, &self.id)?, reports, counters);
        let _asking = counters.ask(now_ns());
        let hello = wire::greet(&mut wire, &what, |received_bytes| match received_bytes {
            0 => "nothing answers; does its firmware speak the link protocol?".to_owned(),
            _ => "reports came and no answer; does its firmware speak the link protocol?".to_owned(),
        })?;
        let needed = Kind::Command.length(hello.axes());
        if reports.output < needed {
            let carries = reports.output;
            let problem = format!("its reports carry {carries} bytes down, and its commands need {needed}");
            return Err(ConnectError::Protocol { what, problem });
        }
        wire.start_writer(&what)?;
        let rig = RigIdentity::of_usb(self.id.vendor, self.id.product, node.id.serial.as_deref());
        Ok(wire::greeted(wire, &hello, rig, timing, counters))
    }
}
