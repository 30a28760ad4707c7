//! What the tests of the commissioning share: a rig of somebody's own, and a client that commissions it.

use crate::fake_rig::FakeRig;
use crate::{Daemon, PATIENCE, engage, status, subscribe, until, until_some, wait_for_state};
use haptic_ipc::{Client, CommissionReply, Event, LeaseReply, Request, RigState, Sample, SceneReply, Topic};
use serde_json::Value;
use std::path::Path;
use std::sync::mpsc;
use std::time::{Duration, Instant};

/// A firmware that nobody has commissioned, and a handle that nobody holds.
pub const OWN: [&str; 4] = ["--firmware-name", "mine 1.0", "--hand", "free"];

/// A ramp that does not take long.
const SHORT_RAMP: [&str; 2] = ["--ramp-ms", "20"];

/// A pulse of the fake rig's 1.4 kg against its 0.8 N, N.
pub const PUSH_N: f64 = 2.0;

/// A daemon on a rig, with a ramp that does not take long; the rig is idle.
pub fn daemon(rig: &FakeRig, arguments: &[&str]) -> (Daemon, Client) {
    let daemon = Daemon::start_strictly_on(&rig.address(), &[&SHORT_RAMP, arguments].concat());
    let mut client = daemon.client();
    wait_for_state(&mut client, RigState::Idle);
    (daemon, client)
}

/// A daemon whose state outlives it.
pub fn daemon_at(rig: &FakeRig, directory: &Path, arguments: &[&str]) -> (Daemon, Client) {
    let daemon = Daemon::start_in(directory, &rig.address(), &[&SHORT_RAMP, arguments].concat());
    let mut client = daemon.client();
    wait_for_state(&mut client, RigState::Idle);
    (daemon, client)
}

/// Runs `haptic-ctl commission` to its end; returns what it printed.
pub fn commission(daemon: &Daemon, arguments: &[&str]) -> Value {
    daemon.ctl_json(&[&["commission", "--yes"], arguments].concat())
}

/// Takes a lease.
pub fn lease(client: &mut Client) {
    let _: LeaseReply = client.request(Request::Lease { timeout_ms: 2000 }).expect("a lease");
}

/// A client with a lease that has begun.
pub fn begun(daemon: &Daemon) -> Client {
    let mut client = daemon.client();
    lease(&mut client);
    let _: CommissionReply = client.request(Request::commission(None)).expect("the rig is idle");
    client
}

/// Asks for a pulse of so much force and time.
pub fn pulse(force_n: f64, duration_ms: f64) -> Request {
    Request::CommissionPulse {
        force_n,
        duration_ms: Some(duration_ms),
    }
}

/// Asks until a pulse has ended.
pub fn after_the_pulse(client: &mut Client) -> CommissionReply {
    until_some("the pulse does not end", || {
        let reply: CommissionReply = client.request(Request::CommissionStatus {}).expect("it is ours");
        (!reply.pulsing).then_some(reply)
    })
}

/// Every tick from now on, until it is dropped.
#[derive(Debug)]
pub struct Ticks {
    rows: mpsc::Receiver<Sample>,
}

impl Ticks {
    /// Those of a daemon.
    pub fn of(daemon: &Daemon) -> Self {
        let mut client = daemon.client();
        subscribe(&mut client, &[Topic::Samples]);
        let (queue, rows) = mpsc::channel();
        std::thread::spawn(move || {
            while let Ok(event) = client.next_event() {
                if let Event::Samples(samples) = event {
                    for row in samples.rows {
                        if queue.send(row).is_err() {
                            return;
                        }
                    }
                }
            }
        });
        Self { rows }
    }

    /// Those up to the first that is as wanted, which is the last of them.
    pub fn until(&self, what: &str, wanted: impl Fn(&Sample) -> bool) -> Vec<Sample> {
        let began = Instant::now();
        let mut rows = Vec::new();
        while began.elapsed() < PATIENCE {
            if let Ok(row) = self.rows.recv_timeout(Duration::from_millis(100)) {
                rows.push(row);
                if wanted(&row) {
                    return rows;
                }
            }
        }
        panic!("waited in vain for {what}: {:?}", rows.last());
    }

    /// Those that have come and were not asked for yet.
    pub fn come_so_far(&self) -> Vec<Sample> {
        self.rows.try_iter().collect()
    }
}

/// Until the rig is idle, from any state.
pub fn let_go(client: &mut Client) {
    until("waited in vain for idle", || {
        let next = match status(client).state {
            RigState::Idle => return true,
            RigState::Engaging | RigState::Engaged => Request::Release {},
            RigState::Stopped | RigState::Faulted => Request::Reset {},
            RigState::Releasing | RigState::Disconnected => Request::Status {},
        };
        // Its state may have changed since.
        drop(client.request::<Value>(next));
        false
    });
}

/// Engaged, a block at rest is stuck in the paper's scene; where a pulse was left in its place,
/// nothing would hold it.
pub fn renders_the_scene(daemon: &Daemon, client: &mut Client) {
    let scene: SceneReply = client.request(Request::get()).expect("a scene");
    assert_eq!(scene.revision, 1, "it is the one of before");
    let ticks = Ticks::of(daemon);
    engage(client);
    let rows = ticks.until("an engaged tick", |row| row.state == RigState::Engaged);
    assert_eq!(rows.last().map(|row| row.contact), Some(0), "the scene is not back");
    let_go(client);
}
