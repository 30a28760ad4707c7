//! How old a command may become in the queues between the loop and a device, and when a stop is there: the host's
//! session and the fake firmware at the two ends of a line that carries so much and no more, in a time of their own.

use super::connector::LoopTiming;
use super::health::{Delivery, LinkCounters};
use super::session::LinkSession;
use super::session::tests::greeted_firmware;
use crate::device::DeviceError;
use crate::fake::Firmware;
use crate::protocol::frame::Frame;
use crate::protocol::message::{FromDevice, FromHost};
use proptest::prelude::*;
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;

const MS: u64 = 1_000_000;
const WATCHDOG_MS: u64 = 50;

/// How a line and a loop are.
#[derive(Clone, Copy, Debug)]
struct Setup {
    /// Bytes that come through in a second; 0 for a device that takes nothing.
    bytes_per_s: u64,
    period_ns: u64,
    stale_ns: u64,
    /// Time for which samples are collected on their way up, ns: 16 ms with an FTDI as the system sets it.
    collected_ns: u64,
}

impl Setup {
    const GOOD: Self = Self {
        bytes_per_s: 100_000,
        period_ns: MS,
        stale_ns: 20 * MS,
        collected_ns: 0,
    };
}

/// A loop, a line and a rig.
struct TestRig {
    setup: Setup,
    session: LinkSession,
    counters: Arc<LinkCounters>,
    firmware: Firmware,
    /// What is on its way down, when it was sent, and when it is through, ns.
    down: VecDeque<(FromHost, u64, u64)>,
    /// The samples on their way up.
    up: Vec<FromDevice>,
    now_ns: u64,
    /// Age of the oldest command that drove the motor, ns.
    oldest_ns: u64,
    /// The first fault, and when it came, ns.
    fault: Option<(u64, DeviceError)>,
}

impl TestRig {
    fn new(setup: Setup) -> Self {
        let now_ns = 1000 * MS;
        let (firmware, hello) = greeted_firmware(now_ns);
        assert_eq!(u64::from(hello.watchdog_ms), WATCHDOG_MS);
        let counters = Arc::new(LinkCounters::default());
        let timing = LoopTiming {
            period_ns: setup.period_ns,
            stale_ns: setup.stale_ns,
        };
        Self {
            setup,
            session: LinkSession::new(&hello, timing, now_ns, Arc::clone(&counters)),
            counters,
            firmware,
            down: VecDeque::new(),
            up: Vec::new(),
            now_ns,
            oldest_ns: 0,
            fault: None,
        }
    }

    /// Runs for a time, ns, with a force that changes with every tick, N, or without a host.
    fn run(&mut self, for_ns: u64, order: Option<(f64, bool)>) {
        let until_ns = self.now_ns + for_ns;
        while self.now_ns < until_ns {
            self.now_ns += MS / 20;
            self.deliver();
            if self.now_ns.is_multiple_of(MS) {
                self.up.extend(self.firmware.sample(self.now_ns));
            }
            if self.setup.collected_ns == 0 || self.now_ns.is_multiple_of(self.setup.collected_ns) {
                for sample in self.up.drain(..) {
                    self.session.take(Ok(sample), self.now_ns);
                }
            }
            if let Some((force_n, enabled)) = order
                && self.now_ns.is_multiple_of(self.setup.period_ns)
            {
                if let Err(error) = self.session.measurement(self.now_ns) {
                    self.fault.get_or_insert((self.now_ns, error));
                }
                // No two forces are the same.
                let ripple_n = force_n * 0.001 * (self.now_ns / self.setup.period_ns % 100) as f64;
                self.send(force_n + ripple_n, enabled);
            }
        }
    }

    fn deliver(&mut self) {
        while let Some((message, sent_ns, through_ns)) = self.down.front().copied()
            && through_ns <= self.now_ns
        {
            self.down.pop_front();
            self.firmware.receive(message, self.now_ns);
            if matches!(message, FromHost::Command { enabled: true, force_mn, .. } if force_mn != 0) {
                self.oldest_ns = self.oldest_ns.max(self.now_ns - sent_ns);
            }
        }
    }

    fn send(&mut self, force_n: f64, enabled: bool) {
        for message in self.session.command([force_n, 0.0], enabled, self.now_ns).messages() {
            let before_ns = self.down.back().map_or(0, |(.., through_ns)| *through_ns);
            let begins_ns = before_ns.max(self.now_ns);
            let bytes = Frame::of(message.bytes().as_slice()).as_slice().len() as u64;
            let through_ns = (bytes * 1_000_000_000)
                .checked_div(self.setup.bytes_per_s)
                .map_or(u64::MAX, |takes_ns| begins_ns + takes_ns);
            self.down.push_back((message, self.now_ns, through_ns));
        }
    }

    /// Time until the motor gives no force any more, ns, with these commands or without a host; nothing if it gives
    /// force after a second still.
    fn until_zero_ns(&mut self, order: Option<(f64, bool)>) -> Option<u64> {
        let began_ns = self.now_ns;
        while self.firmware.force_n() != 0.0 {
            self.run(MS / 20, order);
            if self.now_ns - began_ns > 1000 * MS {
                return None;
            }
        }
        Some(self.now_ns - began_ns)
    }
}

proptest! {
    // hazard: H23
    /// On every line that may be opened, at every rate, whenever it comes: a stop, and the end of the daemon.
    #[test]
    fn stop_reaches_device_within_50_ms_on_any_line(
        bytes_per_s in 10_000..120_000_u64, periods in 1..40_u64, for_ms in 60..400_u64, collected_ms in 0..17_u64,
        zero_and_enabled in any::<bool>(),
    ) {
        let setup = Setup {
            bytes_per_s, period_ns: periods * MS / 20, stale_ns: 1000 * MS, collected_ns: collected_ms * MS,
        };
        let mut rig = TestRig::new(setup);
        rig.run(100 * MS, Some((0.0, false)));
        rig.run(for_ms * MS, Some((5.0, true)));
        prop_assert!(rig.oldest_ns <= 45 * MS, "a command was {} us old", rig.oldest_ns / 1000);
        let stopped_ns = rig.until_zero_ns(Some((0.0, zero_and_enabled)));
        prop_assert!(stopped_ns.is_some_and(|ns| ns <= 50 * MS), "{stopped_ns:?} on {setup:?}");
        // A confirmed zero force stays.
        rig.run(200 * MS, Some((0.0, zero_and_enabled)));
        prop_assert_eq!(rig.firmware.force_n(), 0.0);
        rig.run(20 * MS, Some((0.0, false)));
        rig.run(for_ms * MS, Some((5.0, true)));
        let died_ns = rig.until_zero_ns(None);
        prop_assert!(died_ns.is_some_and(|ns| ns <= (WATCHDOG_MS + 50) * MS), "{died_ns:?} on {setup:?}");
    }
}

// hazard: H23
#[test]
fn line_too_slow_for_commands_is_reported_as_fault() {
    let fault = |setup: Setup| {
        let mut rig = TestRig::new(setup);
        rig.run(300 * MS, Some((0.0, false)));
        let idle = rig.counters.delivery();
        let began_ns = rig.now_ns;
        rig.run(1000 * MS, Some((5.0, true)));
        let not_sent = rig.counters.not_sent.load(Relaxed);
        let fault = rig.fault.map(|(at_ns, error)| ((at_ns - began_ns) / MS, error));
        (fault, idle, not_sent)
    };
    let (mut ftdi, mut slow, mut deaf) = (Setup::GOOD, Setup::GOOD, Setup::GOOD);
    ftdi.collected_ns = 16 * MS;
    // 18 kB/s are sent.
    slow.bytes_per_s = 14_000;
    deaf.bytes_per_s = 0;
    for setup in [Setup::GOOD, ftdi] {
        assert_eq!(fault(setup), (None, Delivery::InTime, 0), "{setup:?}");
    }
    let (reported, idle, _) = fault(slow);
    assert!(
        matches!(reported, Some((at_ms, DeviceError::CommandsLate)) if at_ms < 100),
        "{reported:?}"
    );
    assert_eq!(idle, Delivery::Late, "seen while idle");
    // Half as many come through, and so do all where a sample may be older.
    let (mut half_as_many, mut older) = (slow, slow);
    half_as_many.period_ns = 2 * MS;
    older.stale_ns = 30 * MS;
    for setup in [half_as_many, older] {
        let (reported, idle, _) = fault(setup);
        assert_eq!((reported, idle), (None, Delivery::InTime), "{setup:?}");
    }
    let (reported, idle, _) = fault(deaf);
    assert!(
        matches!(reported, Some((at_ms, DeviceError::CommandsIgnored)) if at_ms < 60),
        "ignored: {reported:?}"
    );
    assert_eq!(idle, Delivery::Ignored, "seen while idle");
}
