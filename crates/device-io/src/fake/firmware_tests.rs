//! The fake rig's firmware by itself: its watchdog, what it does wrong on purpose, its second axis.

use super::{
    FakeRig, Firmware, FirmwareProperties, Hand, Mechanics, Misbehaviour, PlanarProperties, PlanarRig, RigProperties,
};
use crate::kinematics::Reading;
use crate::kinematics::tests::five_bar;
use crate::protocol::message::{DeviceSample, ErrorCode, FromDevice, FromHost};
use haptic_core::planar::Plane;

const MS: u64 = 1_000_000;

/// An enabled firmware that gives 3 N, and what time it is.
fn pulling() -> (Firmware, u64) {
    let mut firmware = Firmware::new(RigProperties::default(), Hand::Free, FirmwareProperties::default());
    let now_ns = 1000 * MS;
    firmware.receive(FromHost::Hello { nonce: 1 }, now_ns);
    firmware.receive(enable(1, true), now_ns);
    firmware.receive(command(2, 3000, true), now_ns);
    assert_eq!(firmware.force_n(), 3.0);
    (firmware, now_ns)
}

fn enable(sequence: u32, enabled: bool) -> FromHost {
    FromHost::Enable { sequence, enabled }
}

fn command(sequence: u32, force_mn: i32, enabled: bool) -> FromHost {
    commanded(sequence, force_mn, None, enabled)
}

fn command_two(sequence: u32, [force_mn, second_mn]: [i32; 2], enabled: bool) -> FromHost {
    commanded(sequence, force_mn, Some(second_mn), enabled)
}

fn commanded(sequence: u32, force_mn: i32, second_mn: Option<i32>, enabled: bool) -> FromHost {
    FromHost::Command {
        sequence,
        force_mn,
        second_mn,
        enabled,
    }
}

fn sample(firmware: &mut Firmware, now_ns: u64) -> DeviceSample {
    match firmware.sample(now_ns) {
        Some(FromDevice::Sample(sample)) => sample,
        other => panic!("{other:?}"),
    }
}

#[test]
fn only_an_enable_on_takes_the_watchdogs_mark_away() {
    let (mut firmware, now_ns) = pulling();
    let now_ns = now_ns + 60 * MS;
    let bitten = sample(&mut firmware, now_ns);
    assert!(bitten.watchdog && !bitten.enabled, "{bitten:?}");
    firmware.receive(enable(3, false), now_ns);
    assert!(sample(&mut firmware, now_ns).watchdog);
    firmware.receive(enable(4, true), now_ns);
    assert!(!sample(&mut firmware, now_ns).watchdog);
}

#[test]
fn a_second_enable_begins_at_zero_force_with_a_fresh_watchdog() {
    let (mut firmware, now_ns) = pulling();
    firmware.receive(enable(3, true), now_ns + 40 * MS);
    let enabled = sample(&mut firmware, now_ns + 80 * MS);
    assert!(enabled.enabled, "{enabled:?}");
    assert_eq!(firmware.force_n(), 0.0);
    assert!(!sample(&mut firmware, now_ns + 91 * MS).enabled);
}

#[test]
fn a_misbehaving_one_stays_on_until_it_is_honest() {
    let (mut firmware, now_ns) = pulling();
    firmware.misbehave(Misbehaviour::StayEnabled, now_ns);
    firmware.receive(command(3, 0, false), now_ns);
    firmware.receive(enable(4, false), now_ns);
    assert!(sample(&mut firmware, now_ns + 5000 * MS).enabled);
    assert_eq!(firmware.force_n(), 3.0);
    firmware.misbehave(Misbehaviour::Honest, now_ns + 5001 * MS);
    assert_eq!(firmware.sample(now_ns + 5001 * MS), None, "off, and silent");
    assert_eq!(firmware.force_n(), 0.0);
}

#[test]
fn a_spike_is_of_one_sample_and_an_error_switches_the_motor_off() {
    let (mut firmware, now_ns) = pulling();
    let before = sample(&mut firmware, now_ns).count;
    firmware.misbehave(Misbehaviour::PositionSpike(1.0), now_ns);
    assert_eq!(sample(&mut firmware, now_ns).count - before, 100);
    assert_eq!(sample(&mut firmware, now_ns).count, before);
    let error = firmware.misbehave(Misbehaviour::Error(3, 17), now_ns);
    let (code, detail) = (ErrorCode::Motor, 17);
    assert_eq!(error, Some(FromDevice::Error { code, detail }));
    assert_eq!(firmware.force_n(), 0.0);
}

#[test]
fn each_axis_is_pulled_and_counted_by_itself() {
    let rig = || FakeRig::new(RigProperties::default(), Hand::Free);
    let mechanics = Mechanics::TwoLines(Box::new([rig(), rig()]));
    let mut firmware = Firmware::of(mechanics, FirmwareProperties::default());
    let mut now_ns = 1000 * MS;
    firmware.receive(FromHost::Hello { nonce: 1 }, now_ns);
    firmware.receive(enable(1, true), now_ns);
    for sequence in 2..32 {
        firmware.receive(command_two(sequence, [0, -3000], true), now_ns);
        now_ns += MS;
    }
    let moved = sample(&mut firmware, now_ns);
    assert_eq!(moved.count, 0);
    assert!(moved.second_count.is_some_and(|count| count < -20), "{moved:?}");
    // One for a single axis is no command, and leaves the motors as they are.
    let answer = firmware.receive(command(32, 0, false), now_ns);
    let detail = 0x12 | 1 << 8 | 12 << 16;
    let code = ErrorCode::BadMessage;
    assert_eq!(answer, Some(FromDevice::Error { code, detail }));
    assert!(sample(&mut firmware, now_ns).enabled);
    firmware.receive(command_two(32, [0, -3000], false), now_ns);
    assert!(!sample(&mut firmware, now_ns).enabled);
}

/// Without a hand it goes where it is pulled, whatever the wiring says that is to be right.
#[test]
fn motors_of_a_five_bar_pull_its_hand() {
    let kinematics = five_bar(38.0);
    let home = kinematics.home().expect("a home pose");
    let pulled = |reversed, force: Plane| {
        let mut rig = PlanarRig::new(PlanarProperties::of(&kinematics), kinematics, None).expect("a rig");
        rig.put(kinematics.middle());
        let properties = FirmwareProperties {
            force_limit_n: 1.0,
            reversed,
            ..FirmwareProperties::default()
        };
        let mut firmware = Firmware::of(Mechanics::Plane(Box::new(rig)), properties);
        let Some(FromDevice::Hello(hello)) = firmware.receive(FromHost::Hello { nonce: 1 }, 0) else {
            panic!("it does not answer");
        };
        let two = hello.two_axes.expect("two axes");
        assert!(two.are_rotary && !two.are_absolute);
        assert_eq!((hello.force_limit_mn, two.second_limit), (1_000_000, 1_000_000));
        firmware.receive(enable(1, true), 0);
        for k in 0..30 {
            let sample = sample(&mut firmware, u64::from(k) * MS);
            let counts = [sample.count, sample.second_count.expect("two axes")];
            let motors = [0, 1].map(|motor| home[motor] + f64::from(counts[motor]) / f64::from(hello.counts_per_metre));
            let Reading::Position(pose) = kinematics.reading(motors) else {
                panic!("{sample:?}")
            };
            #[expect(clippy::cast_possible_truncation, reason = "less than the limit")]
            let efforts = pose.jacobian.efforts(force).map(|effort| (effort * 1e6).round() as i32);
            firmware.receive(command_two(k + 2, efforts, true), u64::from(k) * MS);
            let given_n = firmware.force_n();
            assert!((given_n - force.length()).abs() < 0.1, "{given_n} N");
        }
        let Mechanics::Plane(rig) = &firmware.mechanics else {
            panic!("a plane")
        };
        rig.position() - kinematics.middle()
    };
    for force in [Plane::new(1.0, 0.0), Plane::new(-0.6, 0.8), Plane::new(0.0, -1.0)] {
        // (1 - 0.1) N on 0.3 kg for 29 ms.
        let moved = pulled([false; 2], force);
        let expected = force * (0.5 * 3.0 * 0.029 * 0.029);
        assert!((moved - expected).length() < 5e-5, "{moved:?}");
        assert!(pulled([true; 2], force).dot(force) < 0.0);
    }
}
