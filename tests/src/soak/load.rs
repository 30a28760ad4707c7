//! The clients of a daemon: one that changes its scene, and one that listens.

use super::Plan;
use crate::{Daemon, Raw};
use haptic_ipc::{Client, Event, JournalEntry, Request, Sample, SubscribeReply, Topic};
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::Path;
use std::thread;
use std::time::Duration;

/// Time between two changes of the scene.
const CHANGES_EVERY: Duration = Duration::from_millis(80);

/// Scenes of the library that pull.
const SCENES: [&str; 6] = [
    "aluminium-on-teflon",
    "asymmetric-with-memory",
    "high-stiction",
    "lugre",
    "stuck-spring-on-the-device",
    "viscous-drag",
];

/// The journal and the ticks, as a subscriber received them.
#[derive(Debug, Default)]
pub(super) struct Heard {
    /// Number of the first entry and of the newest.
    pub(super) first_entry: Option<u64>,
    pub(super) last_entry: u64,
    /// Entries that did not come after the one before.
    pub(super) missing_entries: u64,
    revisions: BTreeSet<u64>,
    pub(super) rows: u64,
    /// Rows that the daemon reported as lost.
    pub(super) dropped_rows: u64,
    /// Rows that were neither received nor reported as lost.
    pub(super) missing_rows: u64,
    pub(super) largest_n: f64,
    next_tick: Option<u64>,
}

impl Heard {
    pub(super) fn entry(&mut self, entry: &JournalEntry) {
        if self.first_entry.is_none() {
            self.first_entry = Some(entry.seq);
        } else {
            self.missing_entries += entry.seq.saturating_sub(self.last_entry + 1);
        }
        self.last_entry = entry.seq;
        self.revisions.insert(entry.revision);
    }

    /// How many of these revisions, which the daemon answered, are in no entry. The first may have come before the
    /// subscription.
    pub(super) fn unlogged(&self, answered: &[u64]) -> usize {
        let first = self.revisions.first();
        let unlogged = answered
            .iter()
            .filter(|revision| first.is_some_and(|first| first < revision) && !self.revisions.contains(revision));
        unlogged.count()
    }

    fn row(&mut self, row: &Sample, announced: &mut u64) {
        self.rows += 1;
        self.largest_n = self.largest_n.max(row.command_force_n.abs());
        if let Some(next) = self.next_tick {
            self.missing_rows += row.tick.saturating_sub(next + std::mem::take(announced));
        }
        self.next_tick = Some(row.tick + 1);
    }
}

/// Hears the journal, which it writes into a file, and the ticks until the soak is over.
pub(super) fn listen(plan: &Plan, socket: &Path) -> Heard {
    let file = File::create(plan.folder.join("journal.txt")).expect("a file of the report");
    let mut file = BufWriter::new(file);
    let mut client = Client::connect(socket).expect("the daemon serves");
    let subscribe = Request::Subscribe {
        topics: vec![Topic::Log, Topic::Samples],
        rate_hz: None,
        batch_ms: Some(50),
    };
    let _: SubscribeReply = client.request(subscribe).expect("a subscription");
    let mut heard = Heard::default();
    while !plan.is_over() {
        match client.next_event().expect("the daemon goes on") {
            Event::Log(entry) => {
                heard.entry(&entry);
                writeln!(file, "{} {:.3} s  {entry}", entry.seq, plan.time_s()).expect("a file of the report");
            }
            Event::Samples(batch) => {
                heard.dropped_rows += batch.dropped;
                let mut announced = batch.dropped;
                batch.rows.iter().for_each(|row| heard.row(row, &mut announced));
            }
            _ => {}
        }
    }
    heard
}

/// Changes the scene in every way that there is until the soak is over; returns the revisions that the daemon answered.
pub(super) fn change(plan: &Plan, socket: &Path) -> Vec<u64> {
    let mut random = plan.random(1);
    let mut client = Raw::connect(socket);
    client.line();
    let mut revisions = Vec::new();
    while !plan.is_over() {
        let next = next_change(&mut random, &mut client);
        let answer = client.ask(&next.to_string());
        // A refusal has none, nor has the answer to a schedule.
        if answer["ok"]["changed"] == true {
            revisions.extend(answer["ok"]["revision"].as_u64());
        }
        thread::sleep(CHANGES_EVERY);
    }
    revisions
}

/// A change at random.
fn next_change(random: &mut fastrand::Rng, client: &mut Raw) -> Value {
    let mass = |random: &mut fastrand::Rng| json!({ "M": 0.2 + 1.8 * random.f64() });
    match random.u32(..20) {
        0..=9 => {
            let (params, ramp_ms) = (mass(random), if random.bool() { 50 } else { 0 });
            json!({ "id": 1, "op": "set", "params": params, "merge": random.bool(), "ramp_ms": ramp_ms })
        }
        10..=13 => json!({ "id": 1, "op": "scene.load", "scene": SCENES[random.usize(..SCENES.len())] }),
        14 | 15 => json!({ "id": 1, "op": "undo" }),
        16 => json!({ "id": 1, "op": "redo" }),
        _ => {
            // Each of them is tried on the rig first.
            let status = client.ask(r#"{"id":1,"op":"status"}"#);
            let first = status["ok"]["tick"].as_u64().expect("a tick") + 1000;
            let at = |step: u64| json!({ "at_tick": first + 15 * step, "params": mass(random) });
            json!({ "id": 1, "op": "schedule", "changes": (0..10).map(at).collect::<Vec<_>>() })
        }
    }
}

/// Compares what was heard of the journal with the rest of it.
pub(super) fn hear_the_rest(heard: &mut Heard, daemon: &Daemon) {
    let after = Request::Log {
        after: Some(heard.last_entry),
        limit: Some(10_000),
    };
    let rest: haptic_ipc::LogReply = daemon.client().request(after).expect("the journal");
    rest.entries.iter().for_each(|entry| heard.entry(entry));
}
