//! The clients of a daemon: one that changes its scene, those that listen, and those that misuse it.

use super::plan::Plan;
use super::rig::Rig;
use haptic_ipc::{
    ChangeOptions, ChangeReply, Client, ClientError, Event, Receiver, Request, Sample, SceneChange, SceneRef,
    ScheduledChange, ServerLine, SubscribeReply, Topic,
};
use serde_json::json;
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufWriter, Read, Write};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::thread::{self, Scope, ScopedJoinHandle};
use std::time::Duration;

/// Time between two changes of the scene.
const CHANGES_EVERY: Duration = Duration::from_millis(80);

/// Time between two clients that come and go.
const VISITS_EVERY: Duration = Duration::from_millis(50);

/// How long a listener waits before it looks whether the soak is over.
const LISTENS: Duration = Duration::from_millis(200);

/// Scenes of the library that pull.
const SCENES: [&str; 6] = [
    "aluminium-on-teflon",
    "asymmetric-with-memory",
    "high-stiction",
    "lugre",
    "stuck-spring-on-the-device",
    "viscous-drag",
];

/// What the clients received and did.
#[derive(Debug, Default)]
pub(super) struct ClientRecord {
    pub(super) changes: Changes,
    pub(super) journal: Journal,
    pub(super) rows: ReceivedRows,
}

/// What was changed.
#[derive(Debug, Default)]
pub(super) struct Changes {
    /// Revisions that the daemon answered.
    pub(super) revisions: Vec<u64>,
}

/// The journal, as a subscriber received it.
#[derive(Debug, Default)]
pub(super) struct Journal {
    /// Number of the first entry and of the newest.
    pub(super) first: Option<u64>,
    pub(super) last: u64,
    /// Entries that did not come after the one before.
    pub(super) missing: u64,
    revisions: BTreeSet<u64>,
    /// Changes that were answered and are in no entry.
    pub(super) unlogged: u64,
}

/// The ticks, as a subscriber received them.
#[derive(Debug, Default)]
pub(super) struct ReceivedRows {
    pub(super) received: u64,
    /// Rows that the daemon reported as lost.
    pub(super) dropped: u64,
    /// Rows that were neither received nor reported as lost.
    pub(super) missing: u64,
    pub(super) largest_n: f64,
    next_tick: Option<u64>,
}

/// The threads of the clients.
#[derive(Debug)]
pub(super) struct Load<'scope> {
    changes: ScopedJoinHandle<'scope, Changes>,
    journal: ScopedJoinHandle<'scope, Journal>,
    rows: ScopedJoinHandle<'scope, ReceivedRows>,
    visits: ScopedJoinHandle<'scope, ()>,
}

/// Starts the clients of a daemon.
pub(super) fn start<'scope>(
    scope: &'scope Scope<'scope, '_>,
    plan: &'scope Plan,
    rig: &'static str,
    socket: &'scope Path,
) -> Load<'scope> {
    Load {
        changes: scope.spawn(move || change(plan, rig, socket)),
        journal: scope.spawn(move || {
            let file = plan.folder.join(format!("journal-{}.txt", rig.replace(' ', "-")));
            let mut file = BufWriter::new(File::create(file).expect("a file of the report"));
            let mut journal = Journal::default();
            listen(plan, socket, Topic::Log, |event| {
                if let Event::Log(entry) = event {
                    journal.entry(entry);
                    writeln!(file, "{} {:.3} s  {entry}", entry.seq, plan.time_s()).expect("a file of the report");
                }
            });
            journal
        }),
        rows: scope.spawn(move || {
            let mut rows = ReceivedRows::default();
            listen(plan, socket, Topic::Samples, |event| rows.take(event));
            rows
        }),
        visits: scope.spawn(move || visit(plan, socket)),
    }
}

impl Load<'_> {
    /// Waits for the ends of the clients; says which ended in a panic.
    pub(super) fn join(self, broken: &mut Vec<String>) -> ClientRecord {
        joined(self.visits, "the client that comes and goes", broken);
        ClientRecord {
            changes: joined(self.changes, "the client that changes the scene", broken),
            journal: joined(self.journal, "the client that hears the journal", broken),
            rows: joined(self.rows, "the client that hears the ticks", broken),
        }
    }
}

fn joined<T: Default>(thread: ScopedJoinHandle<'_, T>, name: &str, broken: &mut Vec<String>) -> T {
    thread.join().unwrap_or_else(|_| {
        broken.push(format!("{name} ended in a panic (above)"));
        T::default()
    })
}

impl ClientRecord {
    /// Compares the entries received of the journal with the whole of it and with the answers.
    pub(super) fn check_the_end(&mut self, rig: &mut Rig) {
        for entry in rig.journal(Some(self.journal.last)) {
            self.journal.entry(&entry);
        }
        let logged = &self.journal.revisions;
        // The first changes may have come before the subscription.
        let unlogged = self
            .changes
            .revisions
            .iter()
            .filter(|revision| logged.first().is_some_and(|first| first < revision) && !logged.contains(revision));
        self.journal.unlogged = unlogged.count() as u64;
    }
}

impl Journal {
    fn entry(&mut self, entry: &haptic_ipc::JournalEntry) {
        if self.first.is_none() {
            self.first = Some(entry.seq);
        } else {
            self.missing += entry.seq.saturating_sub(self.last + 1);
        }
        self.last = entry.seq;
        self.revisions.insert(entry.revision);
    }
}

impl ReceivedRows {
    fn take(&mut self, event: &Event) {
        let Event::Samples(batch) = event else { return };
        self.dropped += batch.dropped;
        let mut announced = batch.dropped;
        for row in &batch.rows {
            self.row(row, &mut announced);
        }
    }

    fn row(&mut self, row: &Sample, announced: &mut u64) {
        self.received += 1;
        self.largest_n = self.largest_n.max(row.command_force_n.abs());
        if let Some(next) = self.next_tick {
            self.missing += row.tick.saturating_sub(next + std::mem::take(announced));
        }
        self.next_tick = Some(row.tick + 1);
    }
}

/// Changes the scene in every way that there is.
fn change(plan: &Plan, rig: &'static str, socket: &Path) -> Changes {
    let mut random = plan.random(rig, 1);
    let mut client = Client::connect(socket).expect("the daemon serves");
    let mut changes = Changes::default();
    while !plan.is_over() {
        let next = next_change(&mut random, &mut client);
        let asked = client.request::<serde_json::Value>(next);
        match asked {
            // The answer to a schedule has no revision.
            Ok(answer) => {
                let changed = serde_json::from_value::<ChangeReply>(answer)
                    .ok()
                    .filter(|reply| reply.changed);
                changes.revisions.extend(changed.map(|reply| reply.revision));
            }
            Err(ClientError::Refused(_)) => {}
            Err(error) => panic!("a change: {error}"),
        }
        thread::sleep(CHANGES_EVERY);
    }
    changes
}

/// A change at random.
fn next_change(random: &mut fastrand::Rng, client: &mut Client) -> Request {
    let mass =
        |random: &mut fastrand::Rng| -> haptic_ipc::Changes { [("M", 0.2 + 1.8 * random.f64())].into_iter().collect() };
    match random.u32(..20) {
        0..=9 => Request::Set {
            params: mass(random),
            merge: random.bool(),
            options: ChangeOptions {
                ramp_ms: random.bool().then_some(50.0),
                ..ChangeOptions::default()
            },
        },
        10..=13 => Request::SceneLoad {
            scene: SceneRef::Name(SCENES[random.usize(..SCENES.len())].to_owned()),
            options: ChangeOptions::default(),
        },
        14 | 15 => Request::undo(),
        16 => Request::redo(),
        _ => {
            // Each of them is tried on the rig first.
            let first = crate::status(client).tick + 1000;
            let changes = (0..10).map(|step| ScheduledChange {
                at_tick: first + 15 * step,
                change: SceneChange::Params(mass(random)),
                ramp_ms: None,
            });
            Request::Schedule {
                changes: changes.collect(),
                name: None,
                keep: false,
                if_revision: None,
                dry_run: false,
                anyway: false,
            }
        }
    }
}

/// Hears a topic until the soak is over.
fn listen(plan: &Plan, socket: &Path, topic: Topic, mut take: impl FnMut(&Event)) {
    let mut client = Client::connect(socket).expect("the daemon serves");
    let subscribe = Request::Subscribe {
        topics: vec![topic],
        rate_hz: None,
        batch_ms: Some(50),
    };
    let _: SubscribeReply = client.request(subscribe).expect("a subscription");
    let (_sender, mut receiver) = client.split();
    receiver.set_timeout(Some(LISTENS)).expect("a socket");
    while !plan.is_over() {
        if let Some(event) = next_event(&mut receiver) {
            take(&event);
        }
    }
}

fn next_event(receiver: &mut Receiver) -> Option<Event> {
    match receiver.receive() {
        Ok(ServerLine::Event(event)) => Some(event),
        Ok(_) => None,
        Err(ClientError::Io(error)) if error.kind() == std::io::ErrorKind::WouldBlock => None,
        Err(error) => panic!("an event: {error}"),
    }
}

/// Comes and goes: clients that ask, that send what is no request, that subscribe and hang up, and one that never
/// reads.
fn visit(plan: &Plan, socket: &Path) {
    let subscription = json!({ "id": 1, "op": "subscribe", "topics": ["state", "samples", "log"] });
    let mut deaf = UnixStream::connect(socket).expect("the daemon serves");
    writeln!(deaf, "{subscription}").expect("a subscription");
    let mut visits = 0_u64;
    while !plan.is_over() {
        let line = match visits % 4 {
            0 => json!({ "id": 1, "op": "status" }).to_string(),
            1 => subscription.to_string(),
            2 => "{\"id\":1,\"op\":".to_owned(),
            _ => json!({ "id": 1, "op": "log", "limit": 1000 }).to_string(),
        };
        // A daemon that stands still, or is full, has these wait or turns them away.
        if let Ok(mut stream) = UnixStream::connect(socket) {
            drop(stream.set_read_timeout(Some(LISTENS)));
            drop(writeln!(stream, "{line}"));
            let mut answer = [0; 256];
            drop(stream.read(&mut answer));
            visits += 1;
        }
        thread::sleep(VISITS_EVERY);
    }
}
