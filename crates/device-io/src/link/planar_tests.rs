//! The real-time end of a link to two motors, against a fake firmware without a line between them.

use super::connector::{Connection, LoopTiming};
use super::health::LinkCounters;
use super::link_device::LinkDevice;
use super::planar_link::{Homing, PlanarLink};
use super::session::LinkSession;
use crate::device::{Device, DeviceBounds, DeviceError, Measurement, Written};
use crate::fake::{Figure, Firmware, FirmwareProperties, Mechanics, Misbehaviour, Path, PlanarProperties, PlanarRig};
use crate::kinematics::Kinematics;
use crate::protocol::message::{DeviceHello, ErrorCode, ErrorReport, FromDevice, FromHost};
use haptic_core::planar::Plane;
use rtrb::{Producer, RingBuffer};
use std::mem::take;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::{Arc, Mutex, MutexGuard};

const MS: u64 = 1_000_000;
const MIDDLE: Plane = Plane::new(0.0, 0.095);

const HAPLY: &str = "kinematics = 'five-bar'\nbase_m = 0.038\nproximal_m = 0.07\ndistal_m = 0.09\n\
                     workspace_m = { x = [-0.06, 0.06], y = [0.06, 0.13] }\n";
const RELATIVE: &str = "home_deg = [180, 0]\n";

fn haply(home: &str) -> Kinematics {
    Kinematics::from_toml(&[home, HAPLY].concat()).expect("kinematics")
}

/// A firmware whose motors have this kinematics, with a hand that draws a circle, and its hello.
fn firmware(kinematics: Kinematics) -> (Firmware, DeviceHello) {
    let path = Path::Figure {
        figure: Figure::Circle,
        middle: if kinematics.are_rotary() { MIDDLE } else { Plane::ZERO },
        amplitude_m: 0.03,
        frequency_hz: 0.5,
    };
    let rig = PlanarRig::new(PlanarProperties::of(&kinematics), kinematics, Some(path)).expect("a rig");
    let properties = FirmwareProperties {
        force_limit_n: if kinematics.are_rotary() { 1.0 } else { 20.0 },
        ..FirmwareProperties::default()
    };
    let mut firmware = Firmware::of(Mechanics::Plane(Box::new(rig)), properties);
    let Some(FromDevice::Hello(hello)) = firmware.receive(FromHost::Hello { nonce: 7 }, 0) else {
        panic!("it answers");
    };
    (firmware, hello)
}

/// A device and the conversation with it.
#[derive(Debug)]
struct Conversation {
    firmware: Firmware,
    session: LinkSession,
    now_ns: u64,
    /// What the host has asked of the motors last, N or N m.
    efforts: [f64; 2],
    /// The next reading fails.
    is_broken: bool,
}

/// One end of a conversation that the test looks into.
#[derive(Clone, Debug)]
struct Shared(Arc<Mutex<Conversation>>);

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Conversation> {
        self.0.lock().expect("nobody panics")
    }
}

impl Connection for Shared {
    fn read(&mut self, now_ns: u64) -> Result<Option<Measurement<[f64; 2]>>, DeviceError> {
        let mut conversation = self.lock();
        conversation.now_ns = now_ns;
        if take(&mut conversation.is_broken) {
            return Err(DeviceError::Disconnected);
        }
        let sample = conversation.firmware.sample(now_ns).expect("it is greeted");
        conversation.session.take(Ok(sample), now_ns);
        conversation.session.measurement(now_ns)
    }

    fn write(&mut self, efforts: [f64; 2], enabled: bool, now_ns: u64) -> Result<Written, DeviceError> {
        let mut conversation = self.lock();
        conversation.efforts = efforts;
        for message in conversation.session.command(efforts, enabled, now_ns).messages() {
            if let Some(answer) = conversation.firmware.receive(message, now_ns) {
                conversation.session.take(Ok(answer), now_ns);
            }
        }
        Ok(Written::Taken)
    }
}

struct Pair {
    shared: Shared,
    link: PlanarLink,
    homing: Homing,
    counters: Arc<LinkCounters>,
    to_link: Producer<(Box<dyn Connection>, DeviceBounds)>,
    connections: u64,
    now_ns: u64,
}

impl Pair {
    fn new(kinematics: Kinematics) -> Self {
        let (firmware, hello) = firmware(kinematics);
        let counters = Arc::new(LinkCounters::default());
        let session = LinkSession::new(&hello, LoopTiming::default(), 0, Arc::clone(&counters));
        let now_ns = 0;
        let shared = Shared(Arc::new(Mutex::new(Conversation {
            firmware,
            session,
            now_ns,
            efforts: [0.0; 2],
            is_broken: false,
        })));
        let (to_link, greeted) = RingBuffer::new(4);
        let (failed, _) = RingBuffer::new(4);
        let homing = Homing::default();
        let link = PlanarLink::new(
            LinkDevice::new("a rig".to_owned(), greeted, failed),
            kinematics,
            homing.clone(),
        );
        let mut pair = Self {
            shared,
            link,
            homing,
            counters,
            to_link,
            connections: 0,
            now_ns,
        };
        pair.connect(kinematics.home().is_none());
        pair
    }

    /// Hands a connection over, as the keeper does.
    fn connect(&mut self, needs_no_home: bool) {
        self.connections += 1;
        let bounds = DeviceBounds {
            connection: self.connections,
            ..DeviceBounds::default()
        };
        self.homing.connected(self.connections, needs_no_home);
        let connection = Box::new(self.shared.clone());
        assert!(self.to_link.push((connection, bounds)).is_ok(), "there is room");
    }

    /// A millisecond with a sample up and a command down; where the hand is, and where it is reported to be, m.
    fn tick(&mut self, force: Plane) -> (Plane, Plane) {
        self.now_ns += MS;
        let measured = self.link.read(self.now_ns).expect("it is there");
        self.link.write(force, true).expect("it is there");
        (self.hand().0, measured.position_m)
    }

    /// Where the hand is, m, and the force of the motors on it, N.
    fn hand(&self) -> (Plane, Plane) {
        match &self.shared.lock().firmware.mechanics {
            Mechanics::Plane(rig) => (rig.position(), rig.force()),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn position_and_force_are_those_of_the_hand() {
    let linear = ["xy", "h-belt"].map(|name| name.parse().expect("kinematics"));
    for kinematics in [linear[0], linear[1], haply(RELATIVE), haply("")] {
        let mut pair = Pair::new(kinematics);
        assert_eq!(pair.homing.is_homed(), kinematics.home().is_none(), "{kinematics}");
        pair.homing.tell();
        let mut origin = Plane::ZERO;
        for k in 0..4000 {
            let force = Plane::new(0.3, -0.4);
            let (there, reported) = pair.tick(force);
            // A linear rig's own origin is its first sample.
            if k == 0 && !kinematics.are_rotary() {
                origin = there;
            }
            let apart = (reported + origin - there).length();
            assert!(apart < 1e-4, "{kinematics}: {reported:?} for {there:?} at {k} ms");
            // The home pose is singular, so the hand is drawn from it without force.
            if k > 1000 {
                let given = pair.hand().1;
                assert!((given - force).length() < 0.01, "{kinematics}: {given:?}");
            }
        }
        assert!(pair.homing.is_homed());
        assert_eq!(
            pair.counters.malformed.load(Relaxed) + pair.counters.clipped.load(Relaxed),
            0
        );
    }
}

#[test]
fn home_pose_is_of_its_connection_and_may_be_withdrawn() {
    let mut pair = Pair::new(haply(RELATIVE));
    pair.homing.tell();
    pair.homing.withdraw();
    pair.tick(Plane::ZERO);
    assert!(!pair.homing.is_homed());
    pair.homing.tell();
    pair.tick(Plane::ZERO);
    assert!(pair.homing.is_homed());
    pair.homing.connected(2, false);
    assert!(!pair.homing.is_homed(), "its encoders may have begun elsewhere");
}

#[test]
fn counts_where_the_home_pose_is_told_are_its_own() {
    let kinematics = haply(RELATIVE);
    let home = kinematics.home().expect("it has one");
    let mut pair = Pair::new(kinematics);
    // The hand has left the place where the counts began.
    for _ in 0..1500 {
        pair.tick(Plane::ZERO);
    }
    pair.homing.tell();
    let mut told_at = None;
    for _ in 0..20 {
        let (there, reported) = pair.tick(Plane::ZERO);
        let motors = kinematics.motors(there).expect("within reach");
        let from = *told_at.get_or_insert(motors);
        let turned = [0, 1].map(|motor| home[motor] + motors[motor] - from[motor]);
        let expected = kinematics.reading(turned).parts().0;
        assert!((reported - expected).length() < 1e-3, "{reported:?} for {expected:?}");
    }
    // Those of another connection have begun in the home pose, as these had.
    pair.shared.lock().is_broken = true;
    assert!(pair.link.read(pair.now_ns).is_err());
    pair.connect(false);
    let (there, reported) = pair.tick(Plane::ZERO);
    assert!((reported - there).length() < 1e-3, "{reported:?} for {there:?}");
}

// hazard: H37
#[test]
fn a_singular_pose_gets_no_effort() {
    let mut pair = Pair::new(haply(RELATIVE));
    pair.homing.tell();
    pair.shared.lock().efforts = [1.0; 2];
    for _ in 0..10 {
        pair.tick(Plane::new(5.0, 5.0));
        assert_eq!(pair.shared.lock().efforts, [0.0; 2]);
    }
}

// hazard: H31
#[test]
fn what_a_motor_cannot_give_leaves_the_direction() {
    let mut pair = Pair::new(haply(RELATIVE));
    pair.homing.tell();
    for _ in 0..1500 {
        pair.tick(Plane::ZERO);
    }
    assert_eq!(pair.counters.clipped.load(Relaxed), 0);
    let wanted = Plane::new(-30.0, 40.0);
    pair.tick(wanted);
    let (_, force) = pair.hand();
    assert!(
        pair.counters.clipped.load(Relaxed) == 1 && force.length() < 40.0,
        "{force:?}"
    );
    assert!(
        force.cross(wanted).abs() < 1e-3 * force.length() * wanted.length(),
        "{force:?}"
    );
}

// hazard: H36
#[test]
fn samples_of_another_number_of_axes_are_dropped() {
    let mut pair = Pair::new("xy".parse().expect("kinematics"));
    pair.tick(Plane::ZERO);
    let mut conversation = pair.shared.lock();
    let now_ns = conversation.now_ns + MS;
    let Some(FromDevice::Sample(mut sample)) = conversation.firmware.sample(now_ns) else {
        panic!("a sample");
    };
    sample.second_count = None;
    conversation.session.take(Ok(FromDevice::Sample(sample)), now_ns);
    assert!(!conversation.session.has_news());
    assert_eq!(pair.counters.malformed.load(Relaxed), 1);
}

/// An encoder that the board finds unplugged, or a motor that hangs: of whichever axis, it is an error of the device.
// hazard: H32, H39
#[test]
fn error_of_one_axis_ends_the_force_of_both() {
    for code in [ErrorCode::Sensor, ErrorCode::Motor] {
        let mut pair = Pair::new(haply(""));
        let force = Plane::new(3.0, -2.0);
        for _ in 0..1500 {
            pair.tick(force);
        }
        assert!(pair.hand().1.length() > 3.0, "{:?}", pair.hand());
        let mut conversation = pair.shared.lock();
        let now_ns = conversation.now_ns;
        let error = conversation
            .firmware
            .misbehave(Misbehaviour::Error(code as u8, 2), now_ns);
        conversation.session.take(Ok(error.expect("it reports it")), now_ns);
        drop(conversation);
        // The board ends it by itself, and the host in its next tick, in which the servo has no sample to go by.
        assert_eq!(pair.hand().1, Plane::ZERO);
        pair.now_ns += MS;
        let read = pair.link.read(pair.now_ns);
        assert_eq!(read, Err(DeviceError::Failed(ErrorReport { code, detail: 2 })));
        pair.link.write(force, true).expect("it is there");
        assert_eq!(pair.shared.lock().efforts, [0.0; 2]);
        assert_eq!(pair.hand().1, Plane::ZERO);
    }
}
