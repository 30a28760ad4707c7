//! The faults, each with the state in which it ends by docs/safety.md and the time by which the motor gives no force.

use super::rig::Rig;
use crate::process::signal;
use crate::{HeldThread, Raw};
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
        f.write_str(match self {
            Self::GoesOn => "engaged, as before",
            Self::Faulted(code) => return write!(f, "faulted: {code}"),
            Self::Stopped => "stopped",
            Self::Released => "released, then idle",
            Self::Disconnected => "disconnected, then idle",
        })
    }
}

/// Watches the rig while a fault lasts.
pub(super) type Watch<'a> = &'a mut dyn FnMut(&mut Rig);

/// Something that goes wrong.
#[derive(Clone, Copy)]
pub(super) struct Fault {
    pub(super) name: &'static str,
    pub(super) documented: Documented,
    cause: Cause,
}

/// What a row of docs/safety.md says.
#[derive(Clone, Copy)]
pub(super) struct Documented {
    pub(super) row: &'static str,
    pub(super) end: Ending,
    /// Time by which the motor gives no force, ms; none where force goes on.
    pub(super) zero_within_ms: Option<u64>,
}

#[derive(Clone, Copy)]
enum Cause {
    /// What the fake rig is told, and what it is told afterwards.
    Rig(&'static [&'static str], &'static [&'static str]),
    /// What is done to the daemon.
    Daemon(fn(&mut Rig, Watch<'_>)),
}

impl Fault {
    /// Begins it on a rig that pulls, watches, and ends it.
    pub(super) fn act(&self, rig: &mut Rig, watch: Watch<'_>) {
        match self.cause {
            Cause::Rig(begin, end) => {
                begin.iter().for_each(|fault| rig.fake.fail(fault));
                watch(rig);
                end.iter().for_each(|fault| rig.fake.fail(fault));
            }
            Cause::Daemon(act) => act(rig, watch),
        }
    }
}

const fn rig(
    name: &'static str,
    documented: Documented,
    begin: &'static [&'static str],
    end: &'static [&'static str],
) -> Fault {
    Fault {
        name,
        documented,
        cause: Cause::Rig(begin, end),
    }
}

const fn daemon(name: &'static str, documented: Documented, act: fn(&mut Rig, Watch<'_>)) -> Fault {
    Fault {
        name,
        documented,
        cause: Cause::Daemon(act),
    }
}

const fn ends(row: &'static str, end: Ending, zero_within_ms: u64) -> Documented {
    Documented {
        row,
        end,
        zero_within_ms: Some(zero_within_ms),
    }
}

const fn goes_on(row: &'static str) -> Documented {
    Documented {
        row,
        end: Ending::GoesOn,
        zero_within_ms: None,
    }
}

/// `stale-ms` of the daemon, ms.
const STALE_MS: u64 = 100;

/// The firmware's watchdog and a tick, ms.
const WATCHDOG_MS: u64 = 52;

/// Longest release of a client's lease, ms.
const RELEASE_MS: u64 = 200;

/// The lease of a client that hangs, ms.
const LEASE_MS: u64 = 200;

/// What is seen in a sample, ms.
const AT_ONCE_MS: u64 = 5;

const UNPLUGGED: Documented = ends("F2", Ending::Disconnected, WATCHDOG_MS);
const STALE: Documented = ends("H16", Ending::Faulted("stale"), STALE_MS + 5);
const CLOCK: Documented = ends("H3", Ending::Faulted("device_clock"), 205);
const JUMP: Documented = ends("F9", Ending::Faulted("jump"), AT_ONCE_MS);
const FAILED: Documented = ends("F7", Ending::Faulted("device"), AT_ONCE_MS);
const STALLED: Documented = ends("H7", Ending::Faulted("stalled"), WATCHDOG_MS);
const HUNG: Documented = ends("H2", Ending::Faulted("control_lost"), 1050);

/// The rig tells the time again.
const HONEST: &[&str] = &["honest"];

/// All faults.
pub(super) const ALL: &[Fault] = &[
    rig("line hung up", UNPLUGGED, &["hang-up 0.3"], &[]),
    rig("garbage on the line", STALE, &["corrupt 1"], &["corrupt 0"]),
    rig("silent device", STALE, &["stall 0.3"], &[]),
    rig("clock runs backwards", CLOCK, &["clock-backwards"], HONEST),
    rig("clock stands still", CLOCK, &["clock-stop"], HONEST),
    rig("clock at half speed", CLOCK, &["clock-half"], HONEST),
    rig("clock a fifth fast", CLOCK, &["clock-speed 1.2"], HONEST),
    rig("clock jumps 60 ms", CLOCK, &["clock-jump 60"], HONEST),
    rig("stamps of 16 bits", CLOCK, &["clock-wrap16"], HONEST),
    rig("encoder jumps", JUMP, &["jump 4000"], &[]),
    rig("device reports a fault", FAILED, &["error 2 7"], &[]),
    rig(
        "stop button of the rig",
        ends("H19", Ending::Stopped, AT_ONCE_MS),
        &["button 1 on"],
        &["button 1 off"],
    ),
    rig("one wrong sample", goes_on("H6"), &["position-spike 1"], &[]),
    rig(
        "bad line",
        goes_on("H16"),
        &["loss 0.03", "double 0.05", "corrupt 0.03"],
        &["loss 0", "double 0", "corrupt 0"],
    ),
    daemon("SIGSTOP and SIGCONT", STALLED, |rig, watch| {
        let pid = rig.daemon.pid();
        signal(pid, Signal::STOP);
        let began = Instant::now();
        watch(rig);
        // Longer than a sample may be old, as it must be to be noticed.
        while began.elapsed() < Duration::from_millis(2 * STALE_MS) {
            crate::pause();
        }
        signal(pid, Signal::CONT);
    }),
    daemon("control thread hangs", HUNG, |rig, watch| {
        let held = HeldThread::control(rig.daemon.pid());
        watch(rig);
        drop(held);
    }),
    daemon(
        "stop by a client",
        ends("H12", Ending::Stopped, AT_ONCE_MS),
        |rig, watch| {
            // One that is not confirmed in time has acted all the same: the motor's own record is looked at.
            drop(rig.client.request::<serde_json::Value>(haptic_ipc::Request::Stop {}));
            watch(rig);
        },
    ),
    daemon(
        "client with a lease dies",
        ends("F4", Ending::Released, RELEASE_MS),
        |rig, watch| {
            drop(leased(rig, 10 * LEASE_MS));
            watch(rig);
        },
    ),
    daemon(
        "client with a lease hangs",
        ends("F4", Ending::Released, LEASE_MS + RELEASE_MS),
        |rig, watch| {
            let _holder = leased(rig, LEASE_MS);
            watch(rig);
        },
    ),
];

/// A client that has taken a lease.
fn leased(rig: &Rig, timeout_ms: u64) -> Raw {
    let mut holder = rig.daemon.raw();
    let answer = holder.ask(&format!(r#"{{"id":1,"op":"lease","timeout_ms":{timeout_ms}}}"#));
    assert!(answer["ok"].is_object(), "{answer}");
    holder
}
