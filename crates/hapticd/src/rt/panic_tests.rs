//! The end of a real loop that panics with force on the hand.

use super::purity_tests::{hand, start};
use crate::rt::thread::{self, End, FinalZero};
use device_io::fake::{FakeRig, RigProperties};
use device_io::{Device, DeviceBounds, DeviceError, Measurement, Written};
use haptic_core::Scene;
use haptic_core::servo::Command;
use std::sync::Arc;
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::SeqCst;
use std::time::Instant;

/// A rig that panics while force flows.
struct Panicking {
    rig: FakeRig,
    reads: u64,
    written: Arc<AtomicU64>,
    panicked_at: Arc<AtomicU64>,
    /// Commands after the panic that its link has no room for.
    refusals: u64,
}

impl Device for Panicking {
    fn description(&self) -> String {
        self.rig.description()
    }

    fn bounds(&self) -> DeviceBounds {
        self.rig.bounds()
    }

    fn read(&mut self, now_ns: u64) -> Result<Measurement, DeviceError> {
        self.reads += 1;
        let force_n = f64::from_bits(self.written.load(SeqCst));
        if self.reads > 50 && force_n != 0.0 {
            self.panicked_at.store(self.reads, SeqCst);
            panic!("planted, with {force_n} N on the hand");
        }
        self.rig.read(now_ns)
    }

    fn write(&mut self, force_n: f64, _enabled: bool) -> Result<Written, DeviceError> {
        if self.panicked_at.load(SeqCst) > 0 && self.refusals > 0 {
            self.refusals -= 1;
            return Ok(Written::Later);
        }
        self.written.store(force_n.to_bits(), SeqCst);
        Ok(Written::Taken)
    }
}

/// Has the loop panic with force on the hand, on a link that then has no room for so many commands.
/// How it ended, and what was written last, N.
fn panic_with_force(refusals: u64) -> (End, f64) {
    let (written, panicked_at) = (Arc::new(AtomicU64::new(0)), Arc::new(AtomicU64::new(0)));
    let device: Box<dyn Device> = Box::new(Panicking {
        rig: FakeRig::new(RigProperties::default(), hand()),
        reads: 0,
        written: Arc::clone(&written),
        panicked_at: Arc::clone(&panicked_at),
        refusals,
    });
    thread::keep_panics();
    let (mut running, mut control) = start(device, &Scene::paper());
    let began = Instant::now();
    // A busy machine's late ticks may be a fault before there is force. What is written after the panic is the last
    // word.
    let mut commands = (1..).zip([Command::Engage, Command::Reset].into_iter().cycle());
    let mut asked = 0;
    while panicked_at.load(SeqCst) == 0 {
        assert!(began.elapsed().as_secs() < 30, "there was no force");
        while control.records.pop().is_some() {}
        if asked == 0 || control.records.answers().command(asked).is_some() {
            let (serial, command) = commands.next().expect("they do not end");
            assert!(control.inbox.command(serial, command, 0));
            asked = serial;
        }
        std::thread::yield_now();
    }
    let end = running.end().expect("it ends");
    (end, f64::from_bits(written.load(SeqCst)))
}

#[test]
fn the_last_command_of_a_loop_that_panics_is_zero_force() {
    let (End { panic, final_zero }, written_n) = panic_with_force(3);
    assert_eq!((final_zero, written_n), (FinalZero::Confirmed, 0.0));
    let message = panic.expect("it panicked").to_string();
    assert!(message.contains("panic_tests.rs:"), "{message}");
    assert!(
        message.contains("planted, with ") && message.ends_with(" N on the hand"),
        "{message}"
    );
}

#[test]
fn a_final_zero_that_the_device_does_not_take_is_reported() {
    let (End { panic, final_zero }, written_n) = panic_with_force(u64::MAX);
    assert!(panic.is_some() && written_n != 0.0);
    assert_eq!(final_zero, FinalZero::Unconfirmed);
}
