//! The faults, each with the state in which it ends by docs/safety.md and the time by which the motor gives no force.

use super::rig::Rig;
use crate::HeldThread;
use crate::process::signal;
use rustix::process::Signal;
use std::time::{Duration, Instant};

/// What a fault ends in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Ending {
    /// Force goes on.
    GoesOn,
    /// A fault of this code, until a reset.
    Faulted(&'static str),
    /// A stop, until a reset.
    Stopped,
    /// The rig is let go of along a ramp.
    Released,
    /// The device is gone, and idle when it is back.
    Disconnected,
}

impl std::fmt::Display for Ending {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::GoesOn => f.write_str("engaged, as before"),
            Self::Faulted(code) => write!(f, "faulted: {code}"),
            Self::Stopped => f.write_str("stopped"),
            Self::Released => f.write_str("released, then idle"),
            Self::Disconnected => f.write_str("disconnected, then idle"),
        }
    }
}

/// Watches the rig while a fault lasts.
pub(super) type Watch<'a> = &'a mut dyn FnMut(&mut Rig);

/// Something that goes wrong.
#[derive(Clone, Copy)]
pub(super) struct Fault {
    pub(super) name: &'static str,
    /// Its rows in docs/safety.md.
    pub(super) rows: &'static str,
    pub(super) on: On,
    pub(super) ends_in: Ending,
    /// Time by which the motor gives no force, ms; none where force goes on.
    pub(super) zero_within_ms: Option<u64>,
    /// Begins it on a rig that pulls, watches, and ends it.
    pub(super) act: fn(&mut Rig, Watch<'_>),
}

/// The rigs on which a fault can be brought about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum On {
    /// Every one.
    Any,
    /// Those behind a link.
    Link,
    /// Those whose memory can be taken.
    ScarceMemory,
}

impl Fault {
    /// Whether it can be brought about on a rig.
    pub(super) fn is_for(&self, rig: &Rig) -> bool {
        match self.on {
            On::Any => true,
            On::Link => rig.is_on_link(),
            On::ScarceMemory => rig.memory.is_ok(),
        }
    }
}

const fn goes_on(name: &'static str, rows: &'static str, on: On, act: fn(&mut Rig, Watch<'_>)) -> Fault {
    Fault {
        name,
        rows,
        on,
        ends_in: Ending::GoesOn,
        zero_within_ms: None,
        act,
    }
}

const fn ends(
    name: &'static str,
    rows: &'static str,
    on: On,
    ends_in: Ending,
    zero_within_ms: u64,
    act: fn(&mut Rig, Watch<'_>),
) -> Fault {
    Fault {
        name,
        rows,
        on,
        ends_in,
        zero_within_ms: Some(zero_within_ms),
        act,
    }
}

/// `stale-ms` of the daemons, ms.
const STALE_MS: u64 = 100;

/// The firmware's watchdog and a tick, ms.
const WATCHDOG_MS: u64 = 52;

/// Longest release of a client's lease, ms.
const RELEASE_MS: u64 = 200;

/// The lease of a client that hangs, ms.
const LEASE_MS: u64 = 200;

/// All faults.
pub(super) const ALL: &[Fault] = &[
    ends(
        "line hung up",
        "F2",
        On::Link,
        Ending::Disconnected,
        WATCHDOG_MS,
        |rig, watch| {
            fake(rig, "hang-up 0.3");
            watch(rig);
        },
    ),
    ends(
        "garbage on the line",
        "H16",
        On::Link,
        Ending::Faulted("stale"),
        STALE_MS + 5,
        |rig, watch| {
            fake(rig, "corrupt 1");
            watch(rig);
            fake(rig, "corrupt 0");
        },
    ),
    ends(
        "silent device",
        "H16",
        On::Link,
        Ending::Faulted("stale"),
        STALE_MS + 5,
        |rig, watch| {
            fake(rig, "stall 0.3");
            watch(rig);
        },
    ),
    lying("clock runs backwards", |rig, watch| lie(rig, "clock-backwards", watch)),
    lying("clock stands still", |rig, watch| lie(rig, "clock-stop", watch)),
    lying("clock at half speed", |rig, watch| lie(rig, "clock-half", watch)),
    lying("clock a fifth fast", |rig, watch| lie(rig, "clock-speed 1.2", watch)),
    lying("clock jumps 60 ms", |rig, watch| lie(rig, "clock-jump 60", watch)),
    lying("stamps of 16 bits", |rig, watch| lie(rig, "clock-wrap16", watch)),
    ends(
        "encoder jumps",
        "F9",
        On::Link,
        Ending::Faulted("jump"),
        5,
        |rig, watch| {
            fake(rig, "jump 4000");
            watch(rig);
        },
    ),
    ends(
        "device reports a fault",
        "F7",
        On::Link,
        Ending::Faulted("device"),
        5,
        |rig, watch| {
            fake(rig, "error 2 7");
            watch(rig);
        },
    ),
    ends(
        "stop button of the rig",
        "H19",
        On::Link,
        Ending::Stopped,
        5,
        |rig, watch| {
            fake(rig, "button 1 on");
            watch(rig);
            fake(rig, "button 1 off");
        },
    ),
    goes_on("one wrong sample", "H6", On::Link, |rig, watch| {
        fake(rig, "position-spike 1");
        watch(rig);
    }),
    goes_on("bad line", "H16", On::Link, |rig, watch| {
        for fault in ["loss 0.03", "double 0.05", "corrupt 0.03"] {
            fake(rig, fault);
        }
        watch(rig);
        for fault in ["loss 0", "double 0", "corrupt 0"] {
            fake(rig, fault);
        }
    }),
    ends(
        "SIGSTOP and SIGCONT",
        "H7",
        On::Any,
        Ending::Faulted("stalled"),
        WATCHDOG_MS,
        |rig, watch| {
            let pid = rig.daemon.pid();
            signal(pid, Signal::STOP);
            let began = Instant::now();
            watch(rig);
            // Longer than a sample may be old, as it must be to be noticed.
            while began.elapsed() < Duration::from_millis(2 * STALE_MS) {
                crate::pause();
            }
            signal(pid, Signal::CONT);
        },
    ),
    ends(
        "control thread hangs",
        "H2",
        On::Any,
        Ending::Faulted("control_lost"),
        1050,
        |rig, watch| {
            let held = HeldThread::control(rig.daemon.pid());
            watch(rig);
            drop(held);
        },
    ),
    ends("stop by a client", "H12", On::Any, Ending::Stopped, 5, |rig, watch| {
        rig.stop();
        watch(rig);
    }),
    ends(
        "client with a lease dies",
        "F4",
        On::Any,
        Ending::Released,
        RELEASE_MS,
        |rig, watch| {
            let mut holder = rig.daemon.raw();
            let answer = holder.ask(r#"{"id":1,"op":"lease","timeout_ms":2000}"#);
            assert!(answer["ok"].is_object(), "{answer}");
            drop(holder);
            watch(rig);
        },
    ),
    ends(
        "client with a lease hangs",
        "F4",
        On::Any,
        Ending::Released,
        LEASE_MS + RELEASE_MS,
        |rig, watch| {
            let mut holder = rig.daemon.raw();
            let answer = holder.ask(&format!(r#"{{"id":1,"op":"lease","timeout_ms":{LEASE_MS}}}"#));
            assert!(answer["ok"].is_object(), "{answer}");
            watch(rig);
        },
    ),
    goes_on("no memory left", "F5", On::ScarceMemory, |rig, watch| {
        let pid = rig.daemon.pid();
        let Ok(group) = &rig.memory else { return };
        group.take(pid);
        group.exhaust();
        group.release(pid);
        watch(rig);
    }),
];

const fn lying(name: &'static str, act: fn(&mut Rig, Watch<'_>)) -> Fault {
    ends(name, "H3", On::Link, Ending::Faulted("device_clock"), 205, act)
}

fn fake(rig: &mut Rig, fault: &str) {
    if let Some(fake) = &mut rig.fake {
        fake.fail(fault);
    }
}

fn lie(rig: &mut Rig, lie: &str, watch: Watch<'_>) {
    fake(rig, lie);
    watch(rig);
    fake(rig, "honest");
}
