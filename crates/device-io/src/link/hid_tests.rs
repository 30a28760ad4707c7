//! A rig on HID over a pair of sockets in place of a node, with the fake firmware at the other end.

use super::connector::{ConnectError, Connection, GreetedDevice, LoopTiming};
use super::health::LinkCounters;
use super::hid::greet;
use super::identity::RigIdentity;
use super::reports::{MAX_REPORT, Reports};
use super::test_firmware::firmware;
use crate::clock;
use crate::device::{DeviceError, Measurement, Written};
use crate::fake::Firmware;
use crate::protocol::message::{FromDevice, FromHost};
use crate::protocol::view::{View, ViewError};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::OwnedFd;
use rustix::fs::{OFlags, fcntl_setfl};
use rustix::net::{AddressFamily, SocketFlags, SocketType, socketpair};
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

const MS: u64 = 1_000_000;
const REPORTS: Reports = Reports { input: 64, output: 64 };

/// Both ends of what stands in for a node: reports stay whole, and reading one that is not there
/// says so.
fn pair() -> (OwnedFd, OwnedFd) {
    let (host, device) =
        socketpair(AddressFamily::UNIX, SocketType::SEQPACKET, SocketFlags::CLOEXEC, None).expect("two sockets");
    for end in [&host, &device] {
        fcntl_setfl(end, OFlags::NONBLOCK).expect("a socket");
    }
    (host, device)
}

fn report(message: &FromDevice) -> [u8; MAX_REPORT] {
    let mut report = [0; MAX_REPORT];
    let bytes = message.bytes();
    report[..bytes.as_slice().len()].copy_from_slice(bytes.as_slice());
    report
}

/// A message to the device, if there is one.
fn receive(device: &OwnedFd) -> Option<FromHost> {
    let mut bytes = [0; 128];
    let count = rustix::io::read(device, &mut bytes).ok().filter(|count| *count > 0)?;
    assert_eq!((count, bytes[0]), (1 + REPORTS.output, 0), "a whole report, number 0");
    let view = View::padded(&bytes[1..count]).expect("a message");
    Some(FromHost::read(view).expect("from a host"))
}

/// A firmware at the other end, on a thread of its own.
struct Rig {
    firmware: Arc<Mutex<(Firmware, Vec<FromHost>)>>,
    version: u8,
    quit: Arc<AtomicBool>,
    thread: Option<std::thread::JoinHandle<()>>,
}

impl Rig {
    fn start(device: OwnedFd, version: u8) -> Self {
        let firmware = Arc::new(Mutex::new((firmware(), Vec::new())));
        let quit = Arc::new(AtomicBool::new(false));
        let (told, shared) = (Arc::clone(&quit), Arc::clone(&firmware));
        let thread = std::thread::spawn(move || {
            let mut sample_at_ns = clock::now_ns();
            while !told.load(Relaxed) {
                let now = clock::now_ns();
                let mut shared = shared.lock().expect("nobody panicked");
                let mut out = Vec::new();
                while let Some(message) = receive(&device) {
                    shared.1.push(message);
                    out.extend(shared.0.receive(message, now));
                }
                if now >= sample_at_ns {
                    sample_at_ns = now + MS;
                    out.extend(shared.0.sample(now));
                }
                drop(shared);
                for message in out {
                    let mut report = report(&message);
                    report[1] = version;
                    if rustix::io::write(&device, &report).is_err() {
                        // What nobody reads is lost.
                    }
                }
                let timeout = Timespec {
                    tv_sec: 0,
                    tv_nsec: 300_000,
                };
                if poll(&mut [PollFd::new(&device, PollFlags::IN)], Some(&timeout)).is_err() {
                    // Interrupted: it looks again.
                }
            }
        });
        Self {
            firmware,
            version,
            quit,
            thread: Some(thread),
        }
    }

    fn force_n(&self) -> f64 {
        self.firmware.lock().expect("nobody panicked").0.force_n()
    }

    /// Everything it has been told.
    fn heard(&self) -> Vec<FromHost> {
        self.firmware.lock().expect("nobody panicked").1.clone()
    }
}

impl Drop for Rig {
    fn drop(&mut self) {
        assert_ne!(self.version, 0);
        self.quit.store(true, Relaxed);
        if let Some(thread) = self.thread.take() {
            drop(thread.join());
        }
    }
}

fn connect(node: OwnedFd) -> Result<GreetedDevice, ConnectError> {
    greet(
        node,
        REPORTS,
        "HID device 1209:0001",
        RigIdentity::default(),
        LoopTiming::default(),
        &Arc::new(LinkCounters::default()),
    )
}

/// Ticks until something is so.
fn tick_until(
    connection: &mut dyn Connection,
    force_n: f64,
    enabled: bool,
    mut done: impl FnMut(Option<Measurement>) -> bool,
) {
    let began = Instant::now();
    loop {
        let now_ns = clock::now_ns();
        let measured = connection.read(now_ns);
        // Where a thread waited for a processor longer than the rig's watchdog or the writer's
        // waits for it, it lets go, and begins again.
        let written = connection.write(force_n, enabled && measured.is_ok(), now_ns);
        if let (Ok(measured), Ok(_)) = (measured, written)
            && done(measured)
        {
            return;
        }
        assert!(
            began.elapsed() < Duration::from_secs(30),
            "in vain: {measured:?}, {written:?}"
        );
        let next = Duration::from_nanos((now_ns + MS).saturating_sub(clock::now_ns()));
        std::thread::sleep(next);
    }
}

#[test]
fn a_rig_is_greeted_driven_and_left_without_force() {
    let (host, device) = pair();
    let rig = Rig::start(device, 1);
    let mut greeted = connect(host).expect("it answers");
    assert!(
        greeted.device.firmware.starts_with("fake-rig"),
        "{}",
        greeted.device.firmware
    );
    assert_eq!(
        (greeted.device.force_limit_n, greeted.device.sample_rate_hz),
        (20.0, 1000.0)
    );
    assert!((greeted.device.resolution_m - 10e-6).abs() < 1e-9);
    let connection = &mut *greeted.connection;
    let mut moved = false;
    tick_until(connection, 3.0, true, |measured| {
        moved |= measured.is_some_and(|measured| measured.position_m > 1e-3);
        moved && rig.force_n() == 3.0
    });
    tick_until(connection, 0.0, false, |_| rig.force_n() == 0.0);
    let began = Instant::now();
    while connection.write(0.0, false, clock::now_ns()) != Ok(Written::Taken) {
        assert!(began.elapsed() < Duration::from_secs(10), "its transfer has ended");
        std::thread::yield_now();
    }
    tick_until(connection, -2.0, true, |_| rig.force_n() == -2.0);
    drop(greeted);
    // The writer has ended; what it said last may still lie in the socket. The watchdog would take
    // the force away too, but says nothing.
    let began = Instant::now();
    loop {
        let heard = rig.heard();
        let last_word = matches!(
            heard.last(),
            Some(FromHost::Command {
                force_mn: 0,
                enabled: false,
                ..
            })
        );
        if last_word {
            break;
        }
        assert!(began.elapsed() < Duration::from_secs(10), "{:?}", heard.last());
        std::thread::yield_now();
    }
    assert_eq!(rig.force_n(), 0.0);
}

#[test]
fn the_newest_of_many_waiting_reports_is_used() {
    let (host, device) = pair();
    let rig = Rig::start(device.try_clone().expect("a second handle"), 1);
    let mut greeted = connect(host).expect("it answers");
    while greeted.connection.read(clock::now_ns()).expect("there").is_none() {}
    drop(rig);
    let before = greeted
        .connection
        .read(clock::now_ns())
        .expect("there")
        .expect("a sample");
    let mut firmware = firmware();
    firmware.receive(FromHost::Hello { nonce: 1 }, 0);
    // The kernel's queue of 63 and more that came while it was read.
    let last = before.sequence + 100;
    for sequence in 0..=last {
        let Some(sample) = firmware.sample(u64::from(sequence) * MS) else {
            panic!("it is open");
        };
        if sequence > before.sequence {
            rustix::io::write(&device, &report(&sample)).expect("there is room");
        }
    }
    let newest = greeted
        .connection
        .read(clock::now_ns())
        .expect("there")
        .expect("a sample");
    assert_eq!(newest.sequence, last);
}

#[test]
fn a_device_of_another_version_is_named_as_one() {
    let (host, device) = pair();
    let _rig = Rig::start(device, 2);
    let Err(error) = connect(host) else {
        panic!("it speaks another version");
    };
    assert_eq!(
        error,
        ConnectError::Protocol {
            what: "HID device 1209:0001".to_owned(),
            heard: ViewError::Version(2).to_string(),
        }
    );
}

#[test]
fn a_device_that_is_unplugged_is_told_as_such() {
    let (host, device) = pair();
    let rig = Rig::start(device, 1);
    let mut greeted = connect(host).expect("it answers");
    tick_until(&mut *greeted.connection, 1.0, true, |_| rig.force_n() == 1.0);
    drop(rig);
    let began = Instant::now();
    while greeted.connection.read(clock::now_ns()) != Err(DeviceError::Disconnected) {
        assert!(began.elapsed() < Duration::from_secs(10));
    }
}

#[test]
fn a_device_that_takes_no_reports_is_given_up() {
    let (host, device) = pair();
    let rig = Rig::start(device.try_clone().expect("a second handle"), 1);
    let full = host.try_clone().expect("a second handle");
    let mut greeted = connect(host).expect("it answers");
    tick_until(&mut *greeted.connection, 1.0, true, |_| rig.force_n() == 1.0);
    // Nobody takes what comes any more, and there is no room.
    drop(rig);
    while rustix::io::write(&full, &[0; 1 + MAX_REPORT]).is_ok() {}
    let began = Instant::now();
    // Where twenty commands are unconfirmed already none is written, and the next read says that they are ignored.
    while greeted.connection.write(1.0, true, clock::now_ns()).is_ok()
        && greeted.connection.read(clock::now_ns()).is_ok()
    {
        assert!(began.elapsed() < Duration::from_secs(10));
    }
    // Nor does the end of it wait for long.
    let began = Instant::now();
    drop(greeted);
    assert!(began.elapsed() < Duration::from_secs(10));
}
