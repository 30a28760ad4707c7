//! One daemon of a soak with its rig, and the client that brings its faults about.

use super::pressure::Group;
use crate::fake_rig::FakeRig;
use crate::{Daemon, PATIENCE, pull_until, status, try_to_engage, wait_for, wait_for_state};
use haptic_ipc::{Client, JournalEntry, LogReply, Request, RigState, StateReply, Status, Timing};
use std::process::Command;
use std::time::{Duration, Instant};

/// Largest force that the daemons are configured to allow, N: less than the scenes give, so that it is reached.
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
    "--ramp-ms",
    "20",
    "--stale-ms",
    "100",
    "--control-timeout-ms",
    "1000",
];

/// Where the rig of a daemon is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// Behind a pseudo-terminal, in a program of its own.
    Link,
    /// In the daemon's process.
    InProcess,
}

/// What the fake rig says of its own motor.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ForceRecord {
    /// Whether it is outside of the daemon.
    pub(super) is_independent: bool,
    /// Largest force of all, N.
    pub(super) largest_n: f64,
    /// Largest force while the daemon reported none, N.
    pub(super) largest_at_rest_n: f64,
}

/// A daemon and its rig.
#[derive(Debug)]
pub(super) struct Rig {
    place: Place,
    pub(super) daemon: Daemon,
    pub(super) fake: Option<FakeRig>,
    pub(super) client: Client,
    pub(super) memory: Result<Group, String>,
    force: ForceRecord,
    /// When what takes the force away began.
    began: Instant,
    _directory: tempfile::TempDir,
}

impl Rig {
    /// Starts a daemon, with its rig connected.
    pub(super) fn start(place: Place, seed: u64) -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        let at = directory.path();
        let fake = (place == Place::Link)
            .then(|| FakeRig::start(&["--buttons=1", "--watchdog-ms=50", &format!("--seed={seed}")]));
        let mut command = Command::new(crate::binary("hapticd"));
        let device = fake.as_ref().map_or_else(|| "fake".to_owned(), FakeRig::address);
        command.args(["--device", &device]);
        for (option, name) in [
            ("--scene-dir", "scenes"),
            ("--state-dir", "state"),
            ("--metrics-file", "metrics.prom"),
        ] {
            command.arg(option).arg(at.join(name));
        }
        command.arg(format!("--force-limit-n={FORCE_LIMIT_N}")).args(OPTIONS);
        if place == Place::Link {
            command.arg("--stop-button=1");
        }
        // Nobody reads what it says: the pipe fills up, and takes nothing more.
        let daemon = Daemon::spawn(command, &at.join("run/control.sock"));
        let mut client = daemon.client();
        wait_for_state(&mut client, RigState::Idle);
        Self {
            place,
            memory: Group::new(name(place)),
            daemon,
            client,
            force: ForceRecord {
                is_independent: fake.is_some(),
                ..ForceRecord::default()
            },
            fake,
            began: Instant::now(),
            _directory: directory,
        }
    }

    /// As the report calls it.
    pub(super) const fn name(&self) -> &'static str {
        name(self.place)
    }

    pub(super) const fn is_on_link(&self) -> bool {
        matches!(self.place, Place::Link)
    }

    /// What cannot be brought about here, and why.
    pub(super) fn left_out(&self) -> Vec<String> {
        let why = self.memory.as_ref().err();
        why.map(|why| format!("memory pressure, {}: {}", self.name(), why.trim()))
            .into_iter()
            .collect()
    }

    /// What its motor did, by its own record.
    pub(super) const fn force_record(&self) -> ForceRecord {
        self.force
    }

    /// The motor's force now, N, by its own record; nothing of a rig in the daemon's process.
    pub(super) fn motor_n(&mut self) -> Option<f64> {
        let force = self.fake.as_mut()?.force();
        self.force.largest_n = self.force.largest_n.max(force.largest_n);
        Some(force.now_n)
    }

    /// Engages until it pulls; false if it faults before.
    pub(super) fn pull(&mut self) -> bool {
        let Self {
            client, fake, force, ..
        } = self;
        // A clock that has lied is in doubt for a second.
        wait_for(client, "a rig that may be engaged", |status| {
            status.device.engage_refused.is_empty()
        });
        if try_to_engage(client).state != RigState::Engaged {
            return false;
        }
        pull_until(client, |status| match fake {
            Some(fake) => {
                let now = fake.force();
                force.largest_n = force.largest_n.max(now.largest_n);
                now.now_n.abs() > PULLS_N
            }
            None => status.command_force_n.abs() > PULLS_N,
        });
        true
    }

    /// What takes the force away begins now.
    pub(super) fn begin(&mut self) {
        self.began = Instant::now();
    }

    /// Watches the motor until it gives no force; returns the time since [`Self::begin`] until then. A force that
    /// goes on for good is an error. A motor in the daemon cannot be seen: there it waits for the time that is
    /// documented.
    pub(super) fn watch_until_zero(&mut self, documented: Duration) -> Result<Option<Duration>, String> {
        let began = self.began;
        if !self.is_on_link() {
            while began.elapsed() < documented + STAYS_ZERO {
                crate::pause();
            }
            return Ok(None);
        }
        let mut zero_since: Option<Instant> = None;
        loop {
            if let Some(since) = zero_since
                && since.elapsed() > STAYS_ZERO
            {
                return Ok(Some(since.duration_since(began)));
            }
            if began.elapsed() > STAYS_FORCE {
                return Err(format!("the motor still pulls after {STAYS_FORCE:?}"));
            }
            if self.motor_n() == Some(0.0) {
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
        self.journal(None).last().map_or(0, |entry| entry.seq)
    }

    /// The entries of the journal after one of them, or the newest.
    pub(super) fn journal(&mut self, after: Option<u64>) -> Vec<JournalEntry> {
        let limit = Some(if after.is_some() { 10_000 } else { 1 });
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
        if let Some(fake) = &mut self.fake {
            fake.force();
        }
        let rested = self.wait_ticks(20);
        if rested.state == RigState::Idle
            && let Some(fake) = &mut self.fake
        {
            let largest_n = fake.force().largest_n;
            self.force.largest_at_rest_n = self.force.largest_at_rest_n.max(largest_n);
        }
    }

    /// Stops the rig, as a person does.
    pub(super) fn stop(&mut self) {
        // One that the device does not confirm in time has acted all the same: the motor's own record is looked at.
        drop(self.client.request::<StateReply>(Request::Stop {}));
    }
}

const fn name(place: Place) -> &'static str {
    match place {
        Place::Link => "serial link",
        Place::InProcess => "in process",
    }
}
