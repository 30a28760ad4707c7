//! The fake rig's firmware by itself: its watchdog, what it does wrong on purpose, its second axis.

use super::{Firmware, FirmwareProperties, Hand, Misbehaviour, RigProperties};
use crate::protocol::message::{DeviceSample, ErrorCode, FromDevice, FromHost};

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
    FromHost::Command {
        sequence,
        force_mn,
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
    assert_eq!(
        firmware.misbehave(Misbehaviour::Error(3, 17), now_ns),
        Some(FromDevice::Error {
            code: ErrorCode::Motor,
            detail: 17
        })
    );
    assert_eq!(firmware.force_n(), 0.0);
}

#[test]
fn each_axis_is_pulled_and_counted_by_itself() {
    let properties = FirmwareProperties {
        has_second_axis: true,
        ..FirmwareProperties::default()
    };
    let mut firmware = Firmware::new(RigProperties::default(), Hand::Free, properties);
    let mut now_ns = 1000 * MS;
    firmware.receive(FromHost::Hello { nonce: 1 }, now_ns);
    firmware.receive(enable(1, true), now_ns);
    for sequence in 2..32 {
        firmware.receive_for_two(command(sequence, 0, true), -3000, now_ns);
        now_ns += MS;
    }
    let sample = FromDevice::Sample(sample(&mut firmware, now_ns));
    let mut bytes = sample.bytes().as_slice().to_vec();
    firmware.append_second_axis(&sample, &mut bytes);
    let counts = [12, 20].map(|at| i32::from_le_bytes(bytes[at..at + 4].try_into().expect("four bytes")));
    assert_eq!(bytes.len(), 24);
    assert_eq!(counts[0], 0);
    assert!(counts[1] < -20, "{counts:?}");
    firmware.receive_for_two(command(32, 0, false), -3000, now_ns);
    assert!(!self::sample(&mut firmware, now_ns).enabled);
}
