//! A rig on USB HID: found by vendor, product and serial number, since the numbers of the nodes move; read and written at its /dev/hidraw node.
// The real-time thread comes through here: no locks (clippy.toml).
#![cfg_attr(not(test), deny(clippy::disallowed_types, clippy::disallowed_methods))]

use super::health::{LinkCounters, LinkError};
use super::identity::RigIdentity;
use super::keeper::{ConnectError, Connector, Greeted};
use super::reports::{LONGEST_REPORT, Reports};
use super::session::{Refused, Session};
use super::wire::{self, Wire};
use super::writer::Writer;
use super::{Connection, clock};
use crate::device::{DeviceError, Measurement, Written};
use crate::protocol::message::{FromDevice, FromHost, MessageError};
use crate::protocol::view::View;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::OwnedFd;
use rustix::fs::{FlockOperation, Mode, OFlags, flock, open};
use rustix::io::Errno;
use std::ffi::OsStr;
use std::fmt;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;

/// Reports read in a tick, at most. The kernel keeps the oldest 63 that nobody has read, so all of them must be read to come to the newest; a device that sends faster than they
/// are read has gone mad, and the rest waits for the next tick.
const MOST_READS: usize = 128;

/// A node that takes no report for so long does not work, ns. A true one never says that it has no room: it waits.
const NO_ROOM_NS: i64 = 100_000_000;

/// Which HID device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct HidId {
    /// USB vendor.
    pub vendor: u16,
    /// USB product.
    pub product: u16,
    /// Its serial number; where nothing is said, there must be only one of its kind.
    pub serial: Option<String>,
}

impl fmt::Display for HidId {
    /// As in an address: `VID:PID[:SERIAL]`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:04x}:{:04x}", self.vendor, self.product)?;
        match &self.serial {
            Some(serial) => write!(f, ":{serial}"),
            None => Ok(()),
        }
    }
}

/// A HID device that is there.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct HidNode {
    pub(crate) path: PathBuf,
    pub(crate) id: HidId,
    pub(crate) manufacturer: Option<String>,
    pub(crate) name: Option<String>,
    /// Why it cannot be a rig, or how long its reports are.
    pub(crate) reports: Result<Reports, String>,
}

/// Those that are there.
pub(crate) fn nodes() -> Vec<HidNode> {
    // It reads the kernel's tables in /sys and opens no device; where there are none of these, there are no devices.
    let Ok(found) = hidapi::HidApi::new() else {
        return Vec::new();
    };
    let text = |text: Option<&str>| text.filter(|text| !text.is_empty()).map(str::to_owned);
    let mut nodes: Vec<HidNode> = Vec::new();
    for device in found.device_list() {
        let path = PathBuf::from(device.path().to_string_lossy().into_owned());
        // One with several collections is named once for each.
        if nodes.iter().any(|node| node.path == path) {
            continue;
        }
        nodes.push(HidNode {
            id: HidId {
                vendor: device.vendor_id(),
                product: device.product_id(),
                serial: text(device.serial_number()),
            },
            manufacturer: text(device.manufacturer_string()),
            name: text(device.product_string()),
            reports: reports(&path),
            path,
        });
    }
    nodes
}

/// From the descriptor that the kernel has read.
fn reports(node: &Path) -> Result<Reports, String> {
    let name = node.file_name().unwrap_or_default();
    let path = Path::new("/sys/class/hidraw")
        .join(name)
        .join("device/report_descriptor");
    let descriptor = std::fs::read(&path).map_err(|error| format!("{}: {error}", path.display()))?;
    Reports::of(&descriptor).map_err(|unfit| unfit.to_string())
}

/// The node of a device, among those that there are. A device may have several interfaces, of which only one can carry the protocol.
fn choose(nodes: Vec<HidNode>, id: &HidId) -> Result<(PathBuf, Reports), ConnectError> {
    let matching: Vec<HidNode> = nodes
        .into_iter()
        .filter(|node| (node.id.vendor, node.id.product) == (id.vendor, id.product))
        .filter(|node| id.serial.is_none() || id.serial == node.id.serial)
        .collect();
    let mut fit = Vec::new();
    let mut unfit = None;
    for node in matching {
        match node.reports {
            Ok(reports) => fit.push((node.path, reports)),
            Err(why) => unfit = Some(why),
        }
    }
    match (fit.as_slice(), unfit) {
        ([_], _) => Ok(fit.remove(0)),
        ([], None) => Err(ConnectError::Absent { what: what(id) }),
        ([], Some(why)) => Err(ConnectError::Protocol {
            what: what(id),
            heard: why,
        }),
        (several, _) => {
            let paths: Vec<String> = several.iter().map(|(path, _)| path.display().to_string()).collect();
            Err(ConnectError::Refused {
                what: what(id),
                why: format!("there are {}: {}", paths.len(), paths.join(", ")),
                remedy: format!(
                    "name one by its serial number, hid:{:04x}:{:04x}:SERIAL, or unplug the others",
                    id.vendor, id.product
                ),
            })
        }
    }
}

fn what(id: &HidId) -> String {
    format!("HID device {id}")
}

/// How to be allowed to open a device of a kind.
pub(crate) fn permission_remedy(id: &HidId) -> String {
    format!(
        "put this line into /etc/udev/rules.d/70-hapticd.rules: SUBSYSTEM==\"hidraw\", ATTRS{{idVendor}}==\"{:04x}\", ATTRS{{idProduct}}==\"{:04x}\", \
         GROUP=\"hapticd\", MODE=\"0660\"; then run `sudo udevadm control --reload && sudo udevadm trigger` as a user of that group",
        id.vendor, id.product
    )
}

/// Opens a node for this process alone, as far as others respect that.
fn open_node(path: &Path, id: &HidId) -> Result<OwnedFd, ConnectError> {
    let refused = |error: Errno, remedy: String| ConnectError::Refused {
        what: path.display().to_string(),
        why: error.to_string(),
        remedy,
    };
    let flags = OFlags::RDWR | OFlags::NONBLOCK | OFlags::CLOEXEC;
    let node = open(path, flags, Mode::empty()).map_err(|error| match error {
        Errno::NOENT | Errno::NODEV | Errno::NXIO => ConnectError::Absent { what: what(id) },
        Errno::ACCESS | Errno::PERM => refused(error, permission_remedy(id)),
        _ => refused(error, "unplug it and plug it in again".to_owned()),
    })?;
    // The kernel lets anybody with the right open it once more; two hosts would take each other's words for their own.
    flock(&node, FlockOperation::NonBlockingLockExclusive).map_err(|error| {
        refused(
            error,
            format!("another program has it open: `fuser -v {}` names it", path.display()),
        )
    })?;
    Ok(node)
}

/// A node and the reports on it.
#[derive(Clone, Debug)]
struct HidWire {
    node: Arc<OwnedFd>,
    counters: Arc<LinkCounters>,
    reports: Reports,
}

impl HidWire {
    /// Sends a message as a report. A true node waits until it has gone.
    fn send(&self, message: FromHost) -> Result<(), DeviceError> {
        // The kernel takes the report's number first, 0 where it has none, and does not send that.
        let mut bytes = [0; 1 + LONGEST_REPORT];
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
        self.counters.note_error(failure, clock::now_ns());
        DeviceError::Disconnected
    }

    /// Whether it became ready, or an error, in so long, ns.
    fn poll(&self, flags: PollFlags, timeout_ns: i64) -> bool {
        let timeout = Timespec {
            tv_sec: 0,
            tv_nsec: timeout_ns,
        };
        poll(&mut [PollFd::new(&*self.node, flags)], Some(&timeout)) == Ok(1)
    }
}

impl Wire for HidWire {
    fn say_hello(&mut self, hello: FromHost) -> Result<(), DeviceError> {
        self.send(hello)
    }

    fn wait(&self, timeout_ns: u64) {
        // Whatever it says, the read that follows knows more.
        self.poll(PollFlags::IN, i64::try_from(timeout_ns.min(999_999_999)).unwrap_or(0));
    }

    fn hear(&mut self, mut each: impl FnMut(Result<FromDevice, Refused>)) -> Result<usize, DeviceError> {
        let mut heard = 0;
        for _ in 0..MOST_READS {
            let mut report = [0; LONGEST_REPORT];
            match rustix::io::read(&self.node, &mut report) {
                Ok(0) => return Err(self.fail(LinkError::HungUp)),
                Ok(count) => {
                    heard += count;
                    each(
                        View::padded(&report[..count])
                            .map_err(MessageError::from)
                            .and_then(FromDevice::read)
                            .map_err(Refused::Message),
                    );
                }
                Err(Errno::AGAIN) => break,
                Err(Errno::INTR) => {}
                Err(error) => return Err(self.fail(LinkError::Read(error.raw_os_error()))),
            }
        }
        Ok(heard)
    }
}

/// Finds and greets a rig on USB HID.
#[derive(Debug)]
pub struct HidConnector {
    id: HidId,
}

impl HidConnector {
    /// A device by what it says of itself.
    #[must_use]
    pub fn new(id: HidId) -> Self {
        Self { id }
    }
}

/// Greets what is at an opened node.
fn greet(
    node: OwnedFd,
    reports: Reports,
    what: &str,
    period_ns: u64,
    counters: &Arc<LinkCounters>,
) -> Result<Greeted, ConnectError> {
    let mut wire = HidWire {
        node: Arc::new(node),
        counters: Arc::clone(counters),
        reports,
    };
    let _asking = counters.ask(clock::now_ns());
    let hello = wire::greet(&mut wire, what, |heard_bytes| match heard_bytes {
        0 => "nothing answers; does its firmware speak the link protocol?".to_owned(),
        _ => "reports came and no answer; does its firmware speak the link protocol?".to_owned(),
    })?;
    let writing = wire.clone();
    let writer = Writer::start(clock::now_ns(), move |message| writing.send(message)).map_err(|error| {
        ConnectError::Refused {
            what: what.to_owned(),
            why: format!("the thread that writes to it: {error}"),
            remedy: "end other programs, or raise the limit of processes".to_owned(),
        }
    })?;
    Ok(Greeted {
        firmware: hello.firmware_name(),
        force_limit_n: f64::from(hello.force_limit_mn) * 1e-3,
        sample_rate_hz: f64::from(hello.sample_rate_hz),
        watchdog_ms: hello.watchdog(),
        rig: RigIdentity::default(),
        connection: Box::new(HidConnection {
            wire,
            writer,
            session: Session::new(&hello, period_ns, clock::now_ns(), Arc::clone(counters)),
            counters: Arc::clone(counters),
            wait_ns: period_ns / 4,
        }),
    })
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

    fn connect(&mut self, period_ns: u64, counters: &Arc<LinkCounters>) -> Result<Greeted, ConnectError> {
        let nodes = nodes();
        let (path, reports) = choose(nodes.clone(), &self.id)?;
        let serial = nodes.into_iter().find(|node| node.path == path);
        let serial = serial.and_then(|node| node.id.serial);
        let node = open_node(&path, &self.id)?;
        let greeted = greet(node, reports, &what(&self.id), period_ns, counters)?;
        Ok(Greeted {
            rig: RigIdentity::of_usb(self.id.vendor, self.id.product, serial.as_deref()),
            ..greeted
        })
    }
}

/// A rig on USB HID, greeted.
#[derive(Debug)]
struct HidConnection {
    wire: HidWire,
    writer: Writer,
    session: Session,
    counters: Arc<LinkCounters>,
    /// For a sample that is about to come, ns.
    wait_ns: u64,
}

impl Connection for HidConnection {
    fn read(&mut self, now_ns: u64) -> Result<Option<Measurement>, DeviceError> {
        self.writer.check()?;
        wire::measurement(&mut self.wire, &mut self.session, self.wait_ns, now_ns)
    }

    fn write(&mut self, force_n: f64, enabled: bool, now_ns: u64) -> Result<Written, DeviceError> {
        let (enable, command) = self.session.command(force_n, enabled, now_ns);
        self.writer.post(enable, command, now_ns, &self.counters)
    }

    fn resolution_m(&self) -> f64 {
        self.session.resolution_m()
    }
}

impl Drop for HidConnection {
    /// The last word is that the motor is off. The writer, dropped after this, sends it before it ends.
    fn drop(&mut self) {
        if self.write(0.0, false, clock::now_ns()).is_err() {
            // Nobody hears the last word; the device's own watchdog does the rest.
        }
        self.counters.age_ns.store(0, Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::{Firmware, FirmwareProperties, Hand, Motion, RigProperties};
    use crate::protocol::view::ViewError;
    use rustix::fs::fcntl_setfl;
    use rustix::net::{AddressFamily, SocketFlags, SocketType, socketpair};
    use std::sync::Mutex;
    use std::sync::atomic::AtomicBool;
    use std::time::{Duration, Instant};

    const MS: u64 = 1_000_000;
    const REPORTS: Reports = Reports { input: 64, output: 64 };

    /// Both ends of what stands in for a node: reports stay whole, and reading one that is not there says so.
    fn pair() -> (OwnedFd, OwnedFd) {
        let (host, device) =
            socketpair(AddressFamily::UNIX, SocketType::SEQPACKET, SocketFlags::CLOEXEC, None).expect("two sockets");
        for end in [&host, &device] {
            fcntl_setfl(end, OFlags::NONBLOCK).expect("a socket");
        }
        (host, device)
    }

    fn firmware() -> Firmware {
        let motion = Motion::Sine {
            amplitude_m: 0.03,
            frequency_hz: 1.0,
        };
        Firmware::new(
            RigProperties::default(),
            Hand::Prescribed(motion),
            FirmwareProperties::default(),
        )
    }

    fn report(message: &FromDevice) -> [u8; LONGEST_REPORT] {
        let mut report = [0; LONGEST_REPORT];
        let bytes = message.bytes();
        report[..bytes.as_slice().len()].copy_from_slice(bytes.as_slice());
        report
    }

    /// A message to the device, if there is one.
    fn hear(device: &OwnedFd) -> Option<FromHost> {
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
                    while let Some(message) = hear(&device) {
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

    fn connect(node: OwnedFd) -> Result<Greeted, ConnectError> {
        greet(
            node,
            REPORTS,
            "HID device 1209:0001",
            MS,
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
            // Where a thread waited for a processor longer than the rig's watchdog or the writer's waits for it, it lets go, and begins anew.
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
        assert!(greeted.firmware.starts_with("fake-rig"), "{}", greeted.firmware);
        assert_eq!((greeted.force_limit_n, greeted.sample_rate_hz), (20.0, 1000.0));
        assert!((greeted.connection.resolution_m() - 10e-6).abs() < 1e-9);
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
        // The writer has ended; what it said last may still lie in the socket. The watchdog would take the force away too, but says nothing.
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
        let mut greeted = connect(host).expect("it answers");
        tick_until(&mut *greeted.connection, 1.0, true, |_| rig.force_n() == 1.0);
        // Nobody takes what comes any more.
        drop(rig);
        let began = Instant::now();
        while greeted.connection.write(1.0, true, clock::now_ns()).is_ok() {
            assert!(began.elapsed() < Duration::from_secs(10));
        }
        // Nor does the end of it wait for long.
        let began = Instant::now();
        drop(greeted);
        assert!(began.elapsed() < Duration::from_secs(10));
    }

    fn node(path: &str, serial: Option<&str>, reports: Result<Reports, &str>) -> HidNode {
        HidNode {
            path: path.into(),
            id: HidId {
                vendor: 0x1209,
                product: 0x0001,
                serial: serial.map(str::to_owned),
            },
            manufacturer: None,
            name: None,
            reports: reports.map_err(str::to_owned),
        }
    }

    #[test]
    fn a_device_is_chosen_by_what_it_says_of_itself() {
        let id = |serial: Option<&str>| node("", serial, Ok(REPORTS)).id;
        let mut other = node("/dev/hidraw9", None, Ok(REPORTS));
        other.id.product = 2;
        let keyboard = node("/dev/hidraw0", Some("A"), Err("too short"));
        let nodes = vec![
            keyboard.clone(),
            node("/dev/hidraw1", Some("A"), Ok(REPORTS)),
            other.clone(),
        ];
        let chosen = Ok((PathBuf::from("/dev/hidraw1"), REPORTS));
        assert_eq!(
            choose(nodes.clone(), &id(None)),
            chosen,
            "its other interface is not meant"
        );
        assert_eq!(choose(nodes.clone(), &id(Some("A"))), chosen);
        let absent = |id: &HidId| ConnectError::Absent { what: what(id) };
        assert_eq!(choose(nodes.clone(), &id(Some("B"))), Err(absent(&id(Some("B")))));
        assert_eq!(choose(vec![other], &id(None)), Err(absent(&id(None))));
        assert!(
            matches!(choose(vec![keyboard], &id(None)), Err(ConnectError::Protocol { heard, .. }) if heard == "too short")
        );
        let mut two = nodes;
        two.push(node("/dev/hidraw2", Some("B"), Ok(REPORTS)));
        assert_eq!(choose(two.clone(), &id(Some("A"))), chosen);
        let Err(ConnectError::Refused { why, remedy, .. }) = choose(two, &id(None)) else {
            panic!("which one?");
        };
        assert!(why.contains("/dev/hidraw1, /dev/hidraw2"), "{why}");
        assert!(remedy.contains("hid:1209:0001:SERIAL"), "{remedy}");
    }

    #[test]
    fn a_node_is_opened_for_one_alone_and_a_refusal_says_how_to_mend_it() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("hidraw0");
        let id = node("", None, Ok(REPORTS)).id;
        assert_eq!(
            open_node(&path, &id).map(drop),
            Err(ConnectError::Absent { what: what(&id) })
        );
        std::fs::write(&path, "").expect("a file");
        let first = open_node(&path, &id).expect("it is there");
        let Err(ConnectError::Refused { remedy, .. }) = open_node(&path, &id) else {
            panic!("it is in use");
        };
        assert!(remedy.contains("fuser -v"), "{remedy}");
        drop(first);
        open_node(&path, &id).expect("nobody has it any more");
        assert!(permission_remedy(&id).contains(
            r#"SUBSYSTEM=="hidraw", ATTRS{idVendor}=="1209", ATTRS{idProduct}=="0001", GROUP="hapticd", MODE="0660""#
        ));
    }
}
