//! A session against samples and errors that a test makes, and what it puts on the wire, read from the bytes.

use super::*;
use crate::fake::{Firmware, FirmwareProperties, Hand, HandMotion, RigProperties};
use crate::protocol::view::Kind;

const MS: u64 = 1_000_000;

/// A fake firmware whose hand moves 30 mm to and fro once a second.
pub(in crate::link) fn firmware() -> Firmware {
    let motion = HandMotion::Sine {
        amplitude_m: 0.03,
        frequency_hz: 1.0,
    };
    let (rig, properties) = (RigProperties::default(), FirmwareProperties::default());
    Firmware::new(rig, Hand::Prescribed(motion), properties)
}

/// The same, and its answer to a hello at a time of ours, ns.
pub(in crate::link) fn greeted_firmware(now_ns: u64) -> (Firmware, DeviceHello) {
    let mut firmware = firmware();
    let Some(FromDevice::Hello(hello)) = firmware.receive(FromHost::Hello { nonce: 7 }, now_ns) else {
        panic!("it answers");
    };
    (firmware, hello)
}

/// Whether a message is that no force is to be and the motor off.
pub(in crate::link) fn is_off(message: &FromHost) -> bool {
    matches!(
        message,
        FromHost::Command {
            force_mn: 0,
            enabled: false,
            ..
        }
    )
}

/// A session with a fake firmware, without a link between them.
#[derive(Debug)]
pub(in crate::link) struct Pair {
    pub(in crate::link) session: LinkSession,
    pub(in crate::link) firmware: Firmware,
    pub(in crate::link) now_ns: u64,
}

impl Pair {
    fn new() -> Self {
        Self::of(greeted_firmware(1000 * MS), 1000 * MS)
    }

    pub(in crate::link) fn of((firmware, hello): (Firmware, DeviceHello), now_ns: u64) -> Self {
        let session = LinkSession::new(&hello, LoopTiming::default(), now_ns, Arc::new(LinkCounters::default()));
        Self {
            session,
            firmware,
            now_ns,
        }
    }

    /// Some milliseconds, each with a sample up and a command down; what was measured last.
    fn ticks(&mut self, count: u32, force_n: f64, enabled: bool) -> Measurement<[f64; 2]> {
        let mut tick = || {
            self.now_ns += MS;
            let measured = self.measured();
            self.send([force_n, 0.0], enabled);
            measured.expect("it is there").expect("a sample")
        };
        (0..count).map(|_| tick()).last().expect("a tick")
    }

    /// A sample that comes now, and what the session makes of it.
    pub(in crate::link) fn measured(&mut self) -> Result<Option<Measurement<[f64; 2]>>, DeviceError> {
        if let Some(sample) = self.firmware.sample(self.now_ns) {
            self.session.take(Ok(sample), self.now_ns);
        }
        self.session.measurement(self.now_ns)
    }

    pub(in crate::link) fn send(&mut self, efforts: [f64; 2], enabled: bool) {
        for message in self.session.command(efforts, enabled, self.now_ns).messages() {
            if let Some(answer) = self.firmware.receive(message, self.now_ns) {
                self.session.take(Ok(answer), self.now_ns);
            }
        }
    }

    pub(in crate::link) fn counter(&self, of: impl Fn(&LinkCounters) -> &std::sync::atomic::AtomicU64) -> u64 {
        of(&self.session.counters).load(Relaxed)
    }
}

#[test]
fn force_flows_while_enabled_and_the_position_begins_at_zero() {
    let mut pair = Pair::new();
    let first = pair.ticks(1, 0.0, false);
    assert_eq!((first.position_m, first.sequence), ([0.0; 2], 0));
    pair.ticks(1, 3.0, false);
    assert_eq!(pair.firmware.force_n(), 0.0, "not enabled");
    pair.ticks(300, 3.0, true);
    assert_eq!(pair.firmware.force_n(), 3.0);
    let measured = pair.ticks(1, -99.0, true);
    assert_eq!(measured.time_ns, 302 * MS);
    // From -cos(0) to -cos(0.6 pi), of 30 mm.
    assert!((measured.position_m[0] - 0.0393).abs() < 1e-3, "{measured:?}");
    assert_eq!(pair.firmware.force_n(), -20.0, "cut to the device's limit");
    assert_eq!(pair.counter(|counters| &counters.clipped), 1);
    assert_eq!(pair.counter(|counters| &counters.lost), 0);
    pair.ticks(1, 3.0, false);
    assert_eq!(pair.firmware.force_n(), 0.0);
}

#[test]
fn samples_that_are_farther_apart_than_the_hello_says_are_seen() {
    let mut pair = Pair::new();
    pair.ticks(1, 0.0, false);
    let mut sample = pair.session.newest.expect("there is one");
    for apart_ms in [1, 10] {
        for _ in 0..2 * PERIODS {
            pair.now_ns += u64::from(apart_ms) * MS;
            sample.sequence += 1;
            sample.time_us += apart_ms * 1000;
            pair.session.take(Ok(FromDevice::Sample(sample)), pair.now_ns);
        }
        let period_ns = pair.counter(|counters| &counters.period_ns);
        assert_eq!(period_ns, u64::from(apart_ms) * MS);
    }
}

#[test]
fn measurement_includes_buttons_and_reported_motor_state() {
    let mut pair = Pair::new();
    pair.ticks(5, 0.0, true);
    let measured = |pair: &mut Pair, buttons: u8, command_lost: bool| {
        pair.now_ns += MS;
        let Some(FromDevice::Sample(sample)) = pair.firmware.sample(pair.now_ns) else {
            panic!("a sample");
        };
        // A device whose motor went off by itself has not received the order.
        let command = sample.command - u32::from(command_lost);
        let sample = DeviceSample {
            buttons,
            command,
            ..sample
        };
        pair.session.take(Ok(FromDevice::Sample(sample)), pair.now_ns);
        let measured = pair.session.measurement(pair.now_ns).expect("it is there");
        let measured = measured.expect("a sample");
        (measured.motor, measured.buttons)
    };
    assert_eq!(measured(&mut pair, 0b101, false), (ReportedMotor::Enabled, 0b101));
    pair.send([0.0; 2], false);
    assert_eq!(measured(&mut pair, 0, true), (ReportedMotor::Unconfirmed, 0));
    assert_eq!(measured(&mut pair, 0b10, false), (ReportedMotor::Off, 0b10));
}

#[test]
fn old_and_duplicate_samples_are_dropped_and_counted() {
    let mut pair = Pair::new();
    let mut samples: Vec<FromDevice> = (1..=10)
        .filter_map(|k| pair.firmware.sample(pair.now_ns + k * MS))
        .collect();
    assert_eq!(samples.len(), 10);
    samples.swap(3, 4);
    samples.remove(7);
    samples.insert(2, samples[1]);
    for sample in samples {
        pair.session.take(Ok(sample), pair.now_ns + 10 * MS);
    }
    let measured = pair.session.measurement(pair.now_ns + 10 * MS);
    let measured = measured.expect("there").expect("a sample");
    assert_eq!((measured.sequence, measured.time_ns), (9, 9 * MS));
    // Number 3 came after 4, and 7 not at all; 1 came twice.
    assert_eq!(pair.counter(|counters| &counters.lost), 2);
    assert_eq!(pair.counter(|counters| &counters.out_of_sequence), 2);
}

#[test]
fn a_jump_of_the_sequence_is_one_jump_and_nothing_is_lost_by_it() {
    let mut pair = Pair::new();
    for jump in [1, 70_000, 2_000_000_000, 3_000_000_000] {
        pair.ticks(1, 0.0, false);
        pair.firmware
            .misbehave(crate::fake::Misbehaviour::SequenceJump(jump), pair.now_ns);
    }
    pair.ticks(1, 0.0, false);
    assert_eq!(pair.counter(|counters| &counters.lost), 1);
    assert_eq!(pair.counter(|counters| &counters.sequence_jumps), 2);
    // That one looks like an old sample.
    assert_eq!(pair.counter(|counters| &counters.out_of_sequence), 1);
}

#[test]
fn a_motor_that_is_off_though_it_should_be_on_is_reported() {
    let mut pair = Pair::new();
    pair.ticks(10, 1.0, true);
    // The host's commands do not come through any more: the watchdog bites.
    let mut reported = None;
    for k in 1..=60 {
        pair.now_ns += MS;
        if let Err(error) = pair.measured() {
            reported.get_or_insert((k, error));
        }
    }
    assert_eq!(reported, Some((50, DeviceError::MotorOff { watchdog: true })));
    assert_eq!(pair.firmware.force_n(), 0.0);
    // Released and enabled again it is well.
    pair.send([0.0; 2], false);
    pair.ticks(10, 1.0, true);
    assert_eq!(pair.firmware.force_n(), 1.0);
}

#[test]
fn enabling_again_at_once_is_not_taken_for_a_failure() {
    let mut pair = Pair::new();
    pair.ticks(10, 1.0, true);
    let enabled_before = pair.firmware.sample(pair.now_ns + MS).expect("a sample");
    pair.send([0.0; 2], false);
    let off = pair.firmware.sample(pair.now_ns + 2 * MS).expect("a sample");
    pair.send([1.0, 0.0], true);
    pair.session.take(Ok(enabled_before), pair.now_ns + 2 * MS);
    pair.session.measurement(pair.now_ns + 2 * MS).expect("well");
    pair.session.take(Ok(off), pair.now_ns + 3 * MS);
    pair.session.measurement(pair.now_ns + 3 * MS).expect("well");
}

#[test]
fn a_silent_device_is_given_up_and_a_failing_one_says_why() {
    let mut pair = Pair::new();
    pair.ticks(1, 0.0, false);
    let (code, detail) = (ErrorCode::Sensor, 17);
    pair.session.take(Ok(FromDevice::Error { code, detail }), pair.now_ns);
    let report = ErrorReport { code, detail };
    assert_eq!(pair.session.measurement(pair.now_ns), Err(DeviceError::Failed(report)));
    assert_eq!(
        pair.session.counters.last_error(),
        Some((LinkError::Device(report), pair.now_ns))
    );
    assert_eq!(
        DeviceError::Failed(report).to_string(),
        "its position sensor fails, or the handle moved faster than its encoder can follow (code 2, detail 17 = 0x11)"
    );
    let silent_ns = pair.now_ns + SILENCE_NS;
    assert!(pair.session.measurement(silent_ns).is_ok(), "reported once");
    assert_eq!(pair.session.measurement(silent_ns + 1), Err(DeviceError::Disconnected));
    let last = |pair: &Pair| pair.session.counters.last_error().map(|(error, _)| error);
    assert_eq!(last(&pair), Some(LinkError::Silent));
    // It was not the device that kept silent first.
    let mut pair = Pair::new();
    pair.ticks(1, 0.0, false);
    let awake_ns = pair.now_ns + 2500 * MS;
    let sample = pair.firmware.sample(pair.now_ns + MS).expect("one that waited");
    pair.session.take(Ok(sample), awake_ns);
    assert!(
        pair.session.measurement(awake_ns).is_ok(),
        "what had come before is read"
    );
    let lost = pair.session.measurement(awake_ns + SILENCE_NS + 3);
    assert_eq!(
        (lost, last(&pair)),
        (Err(DeviceError::Disconnected), Some(LinkError::Standstill(2500)))
    );
    // One that went on after it keeps silent by itself.
    let lost = pair.session.measurement(awake_ns + 2 * SILENCE_NS + 1);
    assert_eq!(
        (lost, last(&pair)),
        (Err(DeviceError::Disconnected), Some(LinkError::Silent))
    );
}

#[test]
fn sample_is_late_beyond_loop_plus_sample_period() {
    let mut pair = Pair::new();
    pair.ticks(20, 0.0, false);
    let late = |pair: &Pair| pair.counter(|counters| &counters.late);
    assert_eq!(late(&pair), 0, "each came at once");
    for (took_ms, counted) in [(2, 0), (3, 1)] {
        pair.now_ns += MS;
        let sample = pair.firmware.sample(pair.now_ns).expect("a sample");
        pair.now_ns += took_ms * MS;
        pair.session.take(Ok(sample), pair.now_ns);
        assert_eq!(late(&pair), counted, "after {took_ms} ms");
    }
}

#[test]
fn a_motor_may_take_its_time_to_be_enabled() {
    let mut pair = Pair::new();
    pair.ticks(1, 0.0, false);
    // The order to enable goes nowhere.
    let asked_ns = pair.now_ns;
    let mut enables = |now_ns| {
        let mut messages = pair.session.command([1.0, 0.0], true, now_ns).messages();
        messages.any(|message| matches!(message, FromHost::Enable { .. }))
    };
    assert!(enables(asked_ns));
    assert!(!enables(asked_ns + MS), "it is asked for once");
    assert!(pair.session.measurement(asked_ns + ENABLE_TIMEOUT_NS).is_ok());
    assert_eq!(
        pair.session.measurement(asked_ns + ENABLE_TIMEOUT_NS + 1),
        Err(DeviceError::MotorOff { watchdog: false })
    );
}

// hazard: H23
#[test]
fn zero_force_goes_at_once_though_no_other_command_may_be_sent() {
    let mut pair = Pair::new();
    pair.ticks(1, 0.0, false);
    let now_ns = pair.now_ns + MS;
    let mut is_sent = |force_n: f64, enabled: bool, now_ns: u64| {
        let outgoing = pair.session.command([force_n, 0.0], enabled, now_ns);
        outgoing.messages().next().is_some()
    };
    // Nothing is confirmed, and all of it in one moment.
    let sent = (1..100).filter(|k| is_sent(f64::from(*k) * 0.01, true, now_ns)).count();
    assert!((15..=20).contains(&sent), "{sent}");
    assert!(is_sent(0.0, true, now_ns), "zero force");
    assert!(!is_sent(0.0, true, now_ns), "and not once more");
    assert!(is_sent(0.0, false, now_ns), "a motor that is to be off");
    assert!(!is_sent(0.0, false, now_ns + SEND_AGAIN_NS - 1));
    assert!(
        is_sent(0.0, false, now_ns + SEND_AGAIN_NS),
        "again, until it is confirmed"
    );
    let not_sent = pair.counter(|counters| &counters.not_sent);
    assert_eq!(not_sent, 99 - sent as u64, "what repeats is not counted");
    // Where the line had no room for it, it is tried again in the next tick.
    pair.session.forget_order();
    let again = pair.session.command([0.0; 2], false, now_ns + SEND_AGAIN_NS + MS);
    assert!(again.messages().next().is_some());
}

/// The limit of the device, mN: no round number, so that no other constant is taken for it.
const LIMIT_MN: i32 = 1237;

/// A session with a device of that limit. A rig that cuts forces itself, as the fake one does, would hide a host that
/// does not.
fn limited_session() -> LinkSession {
    let hello = DeviceHello {
        force_limit_mn: LIMIT_MN.unsigned_abs(),
        ..greeted_firmware(0).1
    };
    LinkSession::new(&hello, LoopTiming::default(), 0, Arc::default())
}

/// Force, mN, and whether the motor is enabled, as they stand in the frame of a command, at the offsets of
/// docs/device-protocol.md.
fn in_the_frame(session: &mut LinkSession, force_n: f64, enabled: bool, now_ns: u64) -> (i32, bool) {
    let Outgoing::Sent { command, .. } = session.command([force_n, 0.0], enabled, now_ns) else {
        panic!("it is sent");
    };
    let bytes = command.bytes();
    let bytes = bytes.as_slice();
    assert_eq!(Kind::from_byte(bytes[0]), Some(Kind::Command), "{bytes:?}");
    let force = bytes[8..12].try_into().expect("four bytes");
    (i32::from_le_bytes(force), bytes[2] & 1 != 0)
}

/// Forces, N, up to far beyond any limit, fewer than may be unconfirmed.
fn forces_n() -> impl Iterator<Item = f64> {
    let near = [
        0.0, -0.0, 0.0004, 0.5, -0.5, 1.236, -1.236, 1.237, -1.237, 1.2376, -1.2376,
    ];
    let beyond = [20.0, -20.0, 3e6, -3e6, f64::MAX];
    let infinite = [f64::INFINITY, f64::NEG_INFINITY];
    near.into_iter().chain(beyond).chain(infinite)
}

// hazard: P10
#[test]
fn no_frame_carries_more_than_the_devices_own_limit() {
    let mut session = limited_session();
    let mut beyond = 0;
    for (k, force_n) in (1..).zip(forces_n()) {
        let (force_mn, enabled) = in_the_frame(&mut session, force_n, true, k * MS);
        let wanted_mn = force_n * 1000.0;
        let expected = if wanted_mn.abs() >= f64::from(LIMIT_MN) {
            if wanted_mn > 0.0 { LIMIT_MN } else { -LIMIT_MN }
        } else {
            #[expect(clippy::cast_possible_truncation, reason = "within the limit")]
            let rounded = wanted_mn.round() as i32;
            rounded
        };
        beyond += u64::from(wanted_mn.round().abs() > f64::from(LIMIT_MN));
        assert_eq!((force_mn, enabled), (expected, true), "{force_n} N");
        let clipped = session.counters.clipped.load(Relaxed);
        assert_eq!(clipped, beyond, "each is counted: {force_n} N");
    }
    let (force_mn, _) = in_the_frame(&mut session, f64::NAN, true, 100 * MS);
    assert_eq!(force_mn, 0, "no number is no force");
}

// hazard: P10
#[test]
fn a_frame_that_does_not_enable_the_motor_carries_no_force() {
    for force_n in forces_n().chain([f64::NAN]) {
        let mut session = limited_session();
        // Before it is enabled, so that a force of before cannot stay.
        in_the_frame(&mut session, force_n, true, MS);
        let off = in_the_frame(&mut session, force_n, false, 2 * MS);
        assert_eq!(off, (0, false), "{force_n} N");
    }
}
