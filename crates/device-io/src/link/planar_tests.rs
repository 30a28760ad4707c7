//! The real-time end of a link to two motors, against a fake firmware without a line between them.

use super::connector::Connection;
use super::link_device::LinkDevice;
use super::planar_link::{Homing, PlanarLink};
use super::session::tests::Pair;
use crate::device::{Device, DeviceBounds, DeviceError, Measurement, Written};
use crate::fake::{Figure, Firmware, FirmwareProperties, Mechanics, Misbehaviour, Path, PlanarProperties, PlanarRig};
use crate::kinematics::Kinematics;
use crate::kinematics::tests::{absolute_five_bar, five_bar};
use crate::protocol::message::{ErrorCode, ErrorReport, FromDevice, FromHost};
use haptic_core::planar::Plane;
use rtrb::{Producer, RingBuffer};
use std::mem::take;
use std::sync::{Arc, Mutex, MutexGuard};

const MS: u64 = 1_000_000;

/// What a hand draws on a rig with this kinematics.
fn circle(kinematics: &Kinematics) -> Path {
    Path::Figure {
        figure: Figure::Circle,
        middle: kinematics.middle(),
        amplitude_m: 0.03,
        frequency_hz: 0.5,
    }
}

/// A conversation with a rig of this kinematics.
fn pair(kinematics: Kinematics) -> Pair {
    let path = Some(circle(&kinematics));
    let rig = PlanarRig::new(PlanarProperties::of(&kinematics), kinematics, path).expect("a rig");
    let properties = FirmwareProperties {
        force_limit_n: if kinematics.are_rotary() { 1.0 } else { 20.0 },
        ..FirmwareProperties::default()
    };
    let mut firmware = Firmware::of(Mechanics::Plane(Box::new(rig)), properties);
    let Some(FromDevice::Hello(hello)) = firmware.receive(FromHost::Hello { nonce: 7 }, 0) else {
        panic!("it answers");
    };
    Pair::of((firmware, hello), 0)
}

/// A device and the conversation with it.
#[derive(Debug)]
struct Conversation {
    pair: Pair,
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
        conversation.pair.now_ns = now_ns;
        if take(&mut conversation.is_broken) {
            return Err(DeviceError::Disconnected);
        }
        conversation.pair.measured()
    }

    fn write(&mut self, efforts: [f64; 2], enabled: bool, _: u64) -> Result<Written, DeviceError> {
        let mut conversation = self.lock();
        conversation.efforts = efforts;
        conversation.pair.send(efforts, enabled);
        Ok(Written::Taken)
    }
}

struct TestRig {
    shared: Shared,
    link: PlanarLink,
    homing: Homing,
    to_link: Producer<(Box<dyn Connection>, DeviceBounds)>,
    connections: u64,
    now_ns: u64,
}

impl TestRig {
    fn new(kinematics: Kinematics) -> Self {
        let conversation = Conversation {
            pair: pair(kinematics),
            efforts: [0.0; 2],
            is_broken: false,
        };
        let (to_link, greeted) = RingBuffer::new(4);
        let (failed, _) = RingBuffer::new(4);
        let homing = Homing::default();
        let device = LinkDevice::new("a rig".to_owned(), greeted, failed);
        let mut rig = Self {
            shared: Shared(Arc::new(Mutex::new(conversation))),
            link: PlanarLink::new(device, kinematics, homing.clone()),
            homing,
            to_link,
            connections: 0,
            now_ns: 0,
        };
        rig.connect(kinematics.home().is_none());
        rig
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

    /// A second and a half, after which the hand has left the singular home pose and draws.
    fn until_it_draws(&mut self, force: Plane) {
        for _ in 0..1500 {
            self.tick(force);
        }
    }

    fn clipped(&self) -> u64 {
        self.shared.lock().pair.counter(|counters| &counters.clipped)
    }

    fn malformed(&self) -> u64 {
        self.shared.lock().pair.counter(|counters| &counters.malformed)
    }

    /// Where the hand is, m, and the force of the motors on it, N.
    fn hand(&self) -> (Plane, Plane) {
        match &self.shared.lock().pair.firmware.mechanics {
            Mechanics::Plane(rig) => (rig.position(), rig.force()),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn position_and_force_are_those_of_the_hand() {
    let linear = ["xy", "h-belt"].map(|name| name.parse().expect("kinematics"));
    for kinematics in [linear[0], linear[1], five_bar(38.0), absolute_five_bar()] {
        let mut rig = TestRig::new(kinematics);
        assert_eq!(rig.homing.is_homed(), kinematics.home().is_none(), "{kinematics}");
        rig.homing.tell();
        let mut origin = Plane::ZERO;
        for k in 0..4000 {
            let force = Plane::new(0.3, -0.4);
            let (there, reported) = rig.tick(force);
            // A linear rig's own origin is its first sample.
            if k == 0 && !kinematics.are_rotary() {
                origin = there;
            }
            let apart = (reported + origin - there).length();
            assert!(apart < 1e-4, "{kinematics}: {reported:?} for {there:?} at {k} ms");
            // The home pose is singular, so the hand is drawn from it without force. Then it draws its circle, pushed
            // aside from it by the force at 500 N/m, and it lags by its mass and friction.
            if k > 1500 {
                let given = rig.hand().1;
                assert!((given - force).length() < 0.01, "{kinematics}: {given:?}");
                let aim = circle(&kinematics).at(f64::from(k) * 1e-3).0 + force * (1.0 / 500.0);
                assert!((there - aim).length() < 2e-3, "{kinematics}: {there:?} for {aim:?}");
            }
        }
        assert!(rig.homing.is_homed());
        assert_eq!((rig.malformed(), rig.clipped()), (0, 0));
    }
}

#[test]
fn home_pose_is_of_its_connection_and_may_be_withdrawn() {
    let mut rig = TestRig::new(five_bar(38.0));
    rig.homing.tell();
    rig.homing.withdraw();
    rig.tick(Plane::ZERO);
    assert!(!rig.homing.is_homed());
    rig.homing.tell();
    assert!(!rig.homing.is_taken());
    rig.tick(Plane::ZERO);
    assert!(rig.homing.is_taken() && rig.homing.is_homed());
    rig.homing.connected(2, false);
    assert!(!rig.homing.is_homed(), "its encoders may have begun elsewhere");
}

#[test]
fn counts_where_the_home_pose_is_told_are_its_own() {
    let kinematics = five_bar(38.0);
    let home = kinematics.home().expect("it has one");
    let mut rig = TestRig::new(kinematics);
    // The hand has left the place where the counts began.
    rig.until_it_draws(Plane::ZERO);
    rig.homing.tell();
    let mut told_at = None;
    for _ in 0..20 {
        let (there, reported) = rig.tick(Plane::ZERO);
        let motors = kinematics.motors(there).expect("within reach");
        let from = *told_at.get_or_insert(motors);
        let turned = [0, 1].map(|motor| home[motor] + motors[motor] - from[motor]);
        let expected = kinematics.reading(turned).parts().0;
        assert!((reported - expected).length() < 1e-3, "{reported:?} for {expected:?}");
    }
    // Those of another connection have begun in the home pose, as these had.
    rig.shared.lock().is_broken = true;
    assert!(rig.link.read(rig.now_ns).is_err());
    rig.connect(false);
    let (there, reported) = rig.tick(Plane::ZERO);
    assert!((reported - there).length() < 1e-3, "{reported:?} for {there:?}");
    assert_eq!(rig.link.bounds().connection, 2, "those of the connection");
}

// hazard: H37
#[test]
fn a_singular_pose_gets_no_effort() {
    let mut rig = TestRig::new(five_bar(38.0));
    rig.homing.tell();
    rig.shared.lock().efforts = [1.0; 2];
    for _ in 0..10 {
        rig.tick(Plane::new(5.0, 5.0));
        assert_eq!(rig.shared.lock().efforts, [0.0; 2]);
    }
}

// hazard: H31
#[test]
fn what_a_motor_cannot_give_leaves_the_direction() {
    let mut rig = TestRig::new(five_bar(38.0));
    rig.homing.tell();
    rig.until_it_draws(Plane::ZERO);
    assert_eq!(rig.clipped(), 0);
    let wanted = Plane::new(-30.0, 40.0);
    rig.tick(wanted);
    let (_, force) = rig.hand();
    assert!(rig.clipped() == 1 && force.length() < 40.0, "{force:?}");
    let across = force.cross(wanted).abs();
    assert!(across < 1e-3 * force.length() * wanted.length(), "{force:?}");
}

// hazard: H36
#[test]
fn samples_of_another_number_of_axes_are_dropped() {
    let mut rig = TestRig::new("xy".parse().expect("kinematics"));
    rig.tick(Plane::ZERO);
    let mut conversation = rig.shared.lock();
    let pair = &mut conversation.pair;
    let now_ns = pair.now_ns + MS;
    let Some(FromDevice::Sample(mut sample)) = pair.firmware.sample(now_ns) else {
        panic!("a sample");
    };
    sample.second_count = None;
    pair.session.take(Ok(FromDevice::Sample(sample)), now_ns);
    assert!(!pair.session.has_news());
    drop(conversation);
    assert_eq!(rig.malformed(), 1);
}

/// An encoder that the board finds unplugged, or a motor that hangs: of whichever axis, it is an error of the device.
// hazard: H32, H39
#[test]
fn error_of_one_axis_ends_the_force_of_both() {
    for code in [ErrorCode::Sensor, ErrorCode::Motor] {
        let mut rig = TestRig::new(absolute_five_bar());
        let force = Plane::new(3.0, -2.0);
        rig.until_it_draws(force);
        assert!(rig.hand().1.length() > 3.0, "{:?}", rig.hand());
        let mut conversation = rig.shared.lock();
        let pair = &mut conversation.pair;
        let error = pair.firmware.misbehave(Misbehaviour::Error(code as u8, 2), pair.now_ns);
        pair.session.take(Ok(error.expect("it reports it")), pair.now_ns);
        drop(conversation);
        // The board ends it by itself, and the host in its next tick, in which the servo has no sample to go by.
        assert_eq!(rig.hand().1, Plane::ZERO);
        rig.now_ns += MS;
        let read = rig.link.read(rig.now_ns);
        assert_eq!(read, Err(DeviceError::Failed(ErrorReport { code, detail: 2 })));
        rig.link.write(force, true).expect("it is there");
        assert_eq!(rig.shared.lock().efforts, [0.0; 2]);
        assert_eq!(rig.hand().1, Plane::ZERO);
    }
}
