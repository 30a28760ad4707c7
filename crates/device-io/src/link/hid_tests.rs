//! A rig on HID over a pair of sockets in place of a node, with the fake firmware at the other end.

use super::connector::{Connection, LoopTiming};
use super::health::LinkCounters;
use super::hid::HidWire;
use super::identity::RigIdentity;
use super::reports::{MAX_REPORT, Reports};
use super::session::tests::{greeted_firmware, is_off};
use super::wire::{Wire, greeted};
use crate::device::{DeviceError, Measurement, Written, now_ns};
use crate::fake::Firmware;
use crate::protocol::message::{DeviceHello, DeviceSample, FromDevice, FromHost, TwoAxes};
use crate::protocol::view::{Axes, View};
use rustix::fd::OwnedFd;
use rustix::fs::{OFlags, fcntl_setfl};
use rustix::net::{AddressFamily, SocketFlags, SocketType, socketpair};
use std::sync::Arc;
use std::time::{Duration, Instant};

const REPORTS: Reports = Reports { input: 64, output: 64 };

struct TestRig {
    connection: Option<Box<dyn Connection>>,
    device: OwnedFd,
    firmware: Firmware,
    /// Every message that it has received.
    received: Vec<FromHost>,
}

/// A node and the device behind it. In sockets of this kind reports stay whole, and reading one that is not there says
/// so.
fn sockets() -> (OwnedFd, OwnedFd) {
    let (host, device) =
        socketpair(AddressFamily::UNIX, SocketType::SEQPACKET, SocketFlags::CLOEXEC, None).expect("two sockets");
    for end in [&host, &device] {
        fcntl_setfl(end, OFlags::NONBLOCK).expect("a socket");
    }
    (host, device)
}

fn send(device: &OwnedFd, message: &FromDevice) {
    let mut report = [0; MAX_REPORT];
    let bytes = message.bytes();
    report[..bytes.as_slice().len()].copy_from_slice(bytes.as_slice());
    rustix::io::write(device, &report).expect("there is room");
}

impl TestRig {
    /// A greeted rig.
    fn new() -> Self {
        let (host, device) = sockets();
        let counters = Arc::new(LinkCounters::default());
        let (firmware, hello) = greeted_firmware(now_ns());
        let mut wire = HidWire::new(host, REPORTS, &counters);
        wire.start_writer("the rig").expect("a thread");
        let (rig, timing) = (RigIdentity::default(), LoopTiming::default());
        Self {
            connection: Some(greeted(wire, &hello, rig, timing, &counters).connection),
            device,
            firmware,
            received: Vec::new(),
        }
    }

    /// The firmware takes what has come.
    fn receive(&mut self) {
        let mut bytes = [0; 128];
        while let Ok(count @ 1..) = rustix::io::read(&self.device, &mut bytes) {
            assert_eq!((count, bytes[0]), (1 + REPORTS.output, 0), "a whole report, number 0");
            let view = View::padded(&bytes[1..count], Axes::One).expect("a message");
            let message = FromHost::read(view).expect("from a host");
            self.received.push(message);
            if let Some(answer) = self.firmware.receive(message, now_ns()) {
                send(&self.device, &answer);
            }
        }
    }

    /// Sends a sample; returns its number.
    fn sample(&mut self) -> u32 {
        let sample = self.firmware.sample(now_ns()).expect("it is open");
        send(&self.device, &sample);
        match sample {
            FromDevice::Sample(sample) => sample.sequence,
            other => panic!("{other:?}"),
        }
    }

    /// Ticks until something is so.
    fn tick_until(
        &mut self,
        force_n: f64,
        enabled: bool,
        mut done: impl FnMut(&Firmware, Measurement<[f64; 2]>, Written) -> bool,
    ) {
        let began = Instant::now();
        loop {
            self.receive();
            self.sample();
            let connection = self.connection.as_mut().expect("it is there");
            let measured = connection.read(now_ns());
            // Where this thread waited for a processor longer than the rig's watchdog or the writer's
            // waits for it, it lets go, and begins again.
            let written = connection.write([force_n, 0.0], enabled && measured.is_ok(), now_ns());
            if let (Ok(Some(measured)), Ok(written)) = (measured, written)
                && done(&self.firmware, measured, written)
            {
                return;
            }
            let is_soon = began.elapsed() < Duration::from_secs(30);
            assert!(is_soon, "in vain: {measured:?}, {written:?}");
            std::thread::yield_now();
        }
    }
}

#[test]
fn reports_of_two_axes_are_read_once_the_hello_says_so() {
    let (host, device) = sockets();
    let mut wire = HidWire::new(host, REPORTS, &Arc::default());
    let two_axes = Some(TwoAxes {
        second_counts: 1000.0,
        second_limit: 100,
        are_rotary: true,
        are_absolute: false,
    });
    let (_, one) = greeted_firmware(0);
    let sample = |second_count| {
        let mut sample = DeviceSample::default();
        (sample.count, sample.second_count) = (-2, second_count);
        FromDevice::Sample(sample)
    };
    let sent = [
        FromDevice::Hello(DeviceHello { two_axes, ..one }),
        sample(Some(9)),
        FromDevice::Hello(one),
        sample(None),
    ];
    for message in &sent {
        send(&device, message);
    }
    let mut received = Vec::new();
    wire.receive(|came| received.push(came.expect("a message")))
        .expect("it is there");
    assert_eq!(received, sent);
}

#[test]
fn a_rig_is_driven_and_left_without_force() {
    let mut rig = TestRig::new();
    rig.tick_until(3.0, true, |firmware, measured, _| {
        measured.position_m[0] > 1e-3 && firmware.force_n() == 3.0
    });
    // The transfer of a command that switches it off has ended.
    rig.tick_until(0.0, false, |firmware, _, written| {
        firmware.force_n() == 0.0 && written == Written::Taken
    });
    rig.tick_until(-2.0, true, |firmware, _, _| firmware.force_n() == -2.0);
    // Its end waits until the last word has gone. The watchdog would take the force away too, but says nothing.
    drop(rig.connection.take());
    rig.receive();
    assert!(rig.received.last().is_some_and(is_off), "{:?}", rig.received.last());
    assert_eq!(rig.firmware.force_n(), 0.0);
}

#[test]
fn the_newest_of_many_waiting_reports_is_used() {
    let mut rig = TestRig::new();
    // The kernel's queue of 63, and more that came while it was read.
    let last = (0..100).map(|_| rig.sample()).last();
    let connection = rig.connection.as_mut().expect("it is there");
    let newest = connection.read(now_ns()).expect("there").expect("a sample");
    assert_eq!(Some(newest.sequence), last);
}

#[test]
fn a_device_that_is_unplugged_is_reported_as_disconnected() {
    let mut rig = TestRig::new();
    rig.tick_until(1.0, true, |firmware, _, _| firmware.force_n() == 1.0);
    let TestRig { connection, device, .. } = rig;
    drop(device);
    let read = connection.expect("it is there").read(now_ns());
    assert_eq!(read, Err(DeviceError::Disconnected));
}
