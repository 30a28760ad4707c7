//! What a session puts on the wire, read from the bytes. A rig that cuts forces itself, as the fake
//! one does, would hide a host that does not.

use super::connector::LoopTiming;
use super::health::LinkCounters;
use super::session::{Outgoing, Session};
use super::test_firmware::greeted_firmware;
use crate::protocol::message::DeviceHello;
use crate::protocol::view::Kind;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;

const MS: u64 = 1_000_000;

/// The limit of the device, mN: no round number, so that no other constant is taken for it.
const LIMIT_MN: u32 = 1237;

/// Offsets and bits of docs/device-protocol.md.
const FLAGS: usize = 2;
const ENABLED: u8 = 1;
const FORCE: usize = 8;

fn session() -> (Session, Arc<LinkCounters>) {
    let (_, hello) = greeted_firmware(0);
    let hello = DeviceHello {
        force_limit_mn: LIMIT_MN,
        ..hello
    };
    let counters = Arc::new(LinkCounters::default());
    (
        Session::new(&hello, LoopTiming::default(), 0, Arc::clone(&counters)),
        counters,
    )
}

/// Force, mN, and whether the motor is enabled, as they stand in the frame of a command.
fn in_the_frame(session: &mut Session, force_n: f64, enabled: bool, now_ns: u64) -> (i32, bool) {
    let Outgoing::Sent { command, .. } = session.command(force_n, enabled, now_ns) else {
        panic!("it is sent");
    };
    let bytes = command.bytes();
    let bytes = bytes.as_slice();
    assert_eq!(Kind::from_byte(bytes[0]), Some(Kind::Command), "{bytes:?}");
    let force = bytes[FORCE..FORCE + 4].try_into().expect("four bytes");
    (i32::from_le_bytes(force), bytes[FLAGS] & ENABLED != 0)
}

/// Forces, N, up to far beyond any limit, and values that are not numbers.
const FORCES_N: [f64; 18] = [
    0.0,
    -0.0,
    0.0004,
    0.5,
    -0.5,
    1.236,
    -1.236,
    1.237,
    -1.237,
    1.2376,
    -1.2376,
    20.0,
    -20.0,
    3e6,
    -3e6,
    f64::MAX,
    f64::INFINITY,
    f64::NEG_INFINITY,
];

// hazard: P10
#[test]
fn no_frame_carries_more_than_the_devices_own_limit() {
    let (mut session, counters) = session();
    let limit_mn = i32::try_from(LIMIT_MN).expect("small");
    let mut beyond = 0;
    for (k, force_n) in (1..).zip(FORCES_N) {
        let (force_mn, enabled) = in_the_frame(&mut session, force_n, true, k * MS);
        let wanted_mn = force_n * 1000.0;
        let expected = if wanted_mn.abs() >= f64::from(limit_mn) {
            if wanted_mn > 0.0 { limit_mn } else { -limit_mn }
        } else {
            #[expect(clippy::cast_possible_truncation, reason = "within the limit")]
            let rounded = wanted_mn.round() as i32;
            rounded
        };
        beyond += u64::from(wanted_mn.round().abs() > f64::from(limit_mn));
        assert_eq!((force_mn, enabled), (expected, true), "{force_n} N");
        assert_eq!(counters.clipped.load(Relaxed), beyond, "each is counted: {force_n} N");
    }
    let (force_mn, _) = in_the_frame(&mut session, f64::NAN, true, 100 * MS);
    assert_eq!(force_mn, 0, "no number is no force");
}

// hazard: P10
#[test]
fn a_frame_that_does_not_enable_the_motor_carries_no_force() {
    for force_n in FORCES_N.into_iter().chain([f64::NAN]) {
        let (mut session, _) = session();
        // Before it is enabled, so that a force of before cannot stay.
        in_the_frame(&mut session, force_n, true, MS);
        assert_eq!(
            in_the_frame(&mut session, force_n, false, 2 * MS),
            (0, false),
            "{force_n} N"
        );
    }
}
