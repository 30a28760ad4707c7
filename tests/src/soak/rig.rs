//! The daemon of a soak with its rig, and the client that brings its faults about.

use crate::fake_rig::FakeRig;
use crate::{Daemon, PATIENCE, binary, pull_until, status, try_to_engage, wait_for, wait_for_state};
use haptic_ipc::{Client, JournalEntry, LogReply, Request, RigState, Status, Timing};
use std::process::Command;
use std::time::{Duration, Instant};

/// Largest force that the daemon is configured to allow, N: less than the scenes give, so that it is reached.
pub(super) const FORCE_LIMIT_N: f64 = 3.0;

/// Half of the link's unit of force, N.
pub(super) const FORCE_UNIT_N: f64 = 0.5e-3;

/// Force that counts as pulling, N.
const PULLS_N: f64 = 0.5;

/// Time in which the motor gives no force before that counts as zero force: the force of a scene passes through zero.
const STAYS_ZERO: Duration = Duration::from_millis(100);

/// Time after which a force that goes on does so for good.
const STAYS_FORCE: Duration = Duration::from_secs(10);

/// The daemon's options beside those of its place.
const OPTIONS: &[&str] = &[
    "--uncommissioned",
    "--stop-button=1",
    "--ramp-ms",
    "20",
    "--stale-ms",
    "100",
    "--control-timeout-ms",
    "1000",
];

/// A daemon and its rig.
#[derive(Debug)]
pub(super) struct Rig {
    pub(super) daemon: Daemon,
    pub(super) fake: FakeRig,
    pub(super) client: Client,
    /// Largest force of all by the motor's own record, N.
    pub(super) largest_n: f64,
    /// Largest force while the daemon reported none, N.
    pub(super) largest_at_rest_n: f64,
    _directory: tempfile::TempDir,
}

impl Rig {
    /// Starts a daemon, with its rig connected.
    pub(super) fn start(seed: u64) -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        let at = directory.path();
        let fake = FakeRig::start(&["--buttons=1", "--watchdog-ms=50", &format!("--seed={seed}")]);
        // It ends with the soak, by whatever that is ended.
        let mut command = Command::new("setpriv");
        command.arg("--pdeathsig=TERM").arg(binary("hapticd"));
        command.args(["--device", &fake.address()]).args(OPTIONS);
        command.arg(format!("--force-limit-n={FORCE_LIMIT_N}"));
        for (option, name) in [
            ("--scene-dir", "scenes"),
            ("--state-dir", "state"),
            ("--metrics-file", "metrics.prom"),
        ] {
            command.arg(option).arg(at.join(name));
        }
        // Nobody reads what it says: the pipe fills up, and takes nothing more.
        let daemon = Daemon::spawn(command, &at.join("run/control.sock"));
        let mut client = daemon.client();
        wait_for_state(&mut client, RigState::Idle);
        Self {
            daemon,
            client,
            fake,
            largest_n: 0.0,
            largest_at_rest_n: 0.0,
            _directory: directory,
        }
    }

    /// The motor's force now, N, by its own record.
    pub(super) fn motor_n(&mut self) -> f64 {
        let force = self.fake.force();
        self.largest_n = self.largest_n.max(force.largest_n);
        force.now_n
    }

    /// Engages until it pulls; false if it faults before.
    pub(super) fn pull(&mut self) -> bool {
        // A clock that has lied is in doubt for a second.
        wait_for(&mut self.client, "a rig that may be engaged", |status| {
            status.device.engage_refused.is_empty()
        });
        if try_to_engage(&mut self.client).state != RigState::Engaged {
            return false;
        }
        pull_until(&mut self.client, |_| {
            let force = self.fake.force();
            self.largest_n = self.largest_n.max(force.largest_n);
            force.now_n.abs() > PULLS_N
        });
        true
    }

    /// Watches the motor until it gives no force; returns the time since `began` until then. A force that goes on for
    /// good is an error.
    pub(super) fn watch_until_zero(&mut self, began: Instant) -> Result<Duration, String> {
        let mut zero_since: Option<Instant> = None;
        loop {
            if let Some(since) = zero_since
                && since.elapsed() > STAYS_ZERO
            {
                return Ok(since.duration_since(began));
            }
            if began.elapsed() > STAYS_FORCE {
                return Err(format!("the motor still pulls after {STAYS_FORCE:?}"));
            }
            if self.motor_n() == 0.0 {
                zero_since.get_or_insert_with(Instant::now);
            } else {
                zero_since = None;
            }
            crate::pause();
        }
    }

    /// Waits for so many ticks.
    pub(super) fn wait_ticks(&mut self, ticks: u64) -> Status {
        let from = status(&mut self.client).tick;
        wait_for(&mut self.client, "ticks", |status| status.tick >= from + ticks)
    }

    /// Periods that the loop has missed so far, and samples that came late.
    pub(super) fn held_up(&mut self) -> u64 {
        let timing: Timing = self.client.request(Request::Timing {}).expect("the timing");
        let late = timing.link.map_or(0, |link| link.counts.late);
        timing.since_start.missed_periods + late
    }

    /// Number of the newest entry of the journal.
    pub(super) fn newest_entry(&mut self) -> u64 {
        self.journal(None, 1).last().map_or(0, |entry| entry.seq)
    }

    /// The entries of the journal after one of them, or the newest.
    pub(super) fn journal(&mut self, after: Option<u64>, limit: usize) -> Vec<JournalEntry> {
        let limit = Some(limit);
        let reply: LogReply = self.client.request(Request::Log { after, limit }).expect("the journal");
        reply.entries
    }

    /// Brings it to rest, and sees that its motor gives nothing there.
    pub(super) fn rest(&mut self) {
        let began = Instant::now();
        loop {
            let next = match status(&mut self.client).state {
                RigState::Idle => break,
                RigState::Stopped | RigState::Faulted => Request::Reset {},
                RigState::Engaged | RigState::Engaging => Request::Release {},
                _ => Request::Status {},
            };
            // Its state may have changed since.
            drop(self.client.request::<serde_json::Value>(next));
            assert!(began.elapsed() < PATIENCE, "waited in vain for idle");
            crate::pause();
        }
        // The zero force has been taken by the motor some ticks later.
        self.wait_ticks(20);
        self.motor_n();
        if self.wait_ticks(20).state == RigState::Idle {
            self.largest_at_rest_n = self.largest_at_rest_n.max(self.fake.force().largest_n);
        }
    }
}
