//! The hand-over under loom: every interleaving and every reordering that the memory model allows,
//! with two threads.
//!
//! `shared.rs` is compiled here a second time, on loom's atomics. The rings are rtrb's; a queue behind
//! loom's lock stands for them.
// By this cargo-mutants knows that it is a test, and does not change `shared.rs` twice.
#![cfg(test)]
#![allow(
    dead_code,
    clippy::duplicate_mod,
    reason = "the same source on other atomics, of which a model uses a part"
)]

#[path = "shared.rs"]
mod shared;

/// Loom's counterparts of `rt::atomic`.
mod atomic {
    pub(crate) use loom::sync::atomic::{AtomicBool, AtomicU64, Ordering};
}

use loom::sync::Mutex;
use shared::{Claim, ClaimState, Shared};
use std::collections::VecDeque;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Runs a body under every interleaving with at most three preemptions: what two threads can do to
/// each other shows with two (CHESS).
fn model(body: impl Fn() + Sync + Send + 'static) {
    let mut builder = loom::model::Builder::new();
    builder.preemption_bound = Some(3);
    let executions = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&executions);
    builder.check(move || {
        counted.fetch_add(1, Ordering::Relaxed);
        body();
    });
    // A model in which the threads never meet shows nothing.
    let executions = executions.load(Ordering::Relaxed);
    assert!(executions > 20, "{executions} executions");
}

/// The words, and the commands in the ring: their serial numbers, and the stops that their sender knew of.
struct HandOver {
    shared: Shared,
    ring: Mutex<VecDeque<(u64, u64)>>,
}

impl HandOver {
    fn new() -> Arc<Self> {
        Arc::new(Self {
            shared: Shared::new(),
            ring: Mutex::new(VecDeque::new()),
        })
    }

    fn send(&self, serial: u64, stops_known: u64) {
        self.ring
            .lock()
            .expect("nobody panics")
            .push_back((serial, stops_known));
    }

    /// The beginning of a tick: the stops so far, and the command that is carried out.
    fn tick(&self) -> (u64, Option<u64>) {
        let stops = self.shared.stops();
        let mut ring = self.ring.lock().expect("nobody panics");
        let sent = std::iter::from_fn(|| ring.pop_front()).find(|(serial, _)| !self.shared.is_withdrawn(*serial));
        let command = sent.filter(|(_, stops_known)| *stops_known == stops);
        (stops, command.map(|(serial, _)| serial))
    }
}

#[test]
fn a_reset_never_clears_a_stop_that_came_after_it() {
    model(|| {
        let both = HandOver::new();
        let (mut is_stopped, mut stops_seen) = (false, 0);
        let mut tick = |both: &HandOver| {
            let (stops, command) = both.tick();
            is_stopped |= stops != std::mem::replace(&mut stops_seen, stops);
            is_stopped &= command.is_none();
            is_stopped
        };
        both.shared.stop();
        assert!(tick(&both));
        let stops_known = both.shared.stops();
        let control = {
            let both = Arc::clone(&both);
            loom::thread::spawn(move || {
                // The reset was asked for before this stop, and waited in a queue.
                both.shared.stop();
                both.send(1, stops_known);
            })
        };
        tick(&both);
        tick(&both);
        control.join().expect("it ends");
        assert!(tick(&both));
    });
}

#[test]
fn a_withdrawn_command_is_carried_out_at_once_or_never() {
    model(|| {
        let both = HandOver::new();
        let control = {
            let both = Arc::clone(&both);
            loom::thread::spawn(move || {
                both.send(1, 0);
                both.shared.withdraw(1);
                both.send(2, 0);
            })
        };
        let before = [both.tick().1, both.tick().1];
        control.join().expect("it ends");
        let after = both.tick().1;
        assert_ne!(after, Some(1), "it was withdrawn by now");
        let carried_out: Vec<u64> = before.into_iter().chain([after]).flatten().collect();
        assert_eq!(carried_out.last(), Some(&2), "the one after it: {before:?}, {after:?}");
    });
}

#[test]
fn scheduled_change_is_either_rendered_or_withdrawn() {
    model(|| {
        let claims = Arc::new([Claim::new(), Claim::new(), Claim::new(), Claim::new()]);
        let ticks = [7, 8, 9, 10];
        let loops = {
            let claims = Arc::clone(&claims);
            // A change in each tick.
            loom::thread::spawn(move || {
                [0, 1, 2, 3].map(|index| claims[index].decide(ClaimState::Rendered(ticks[index])))
            })
        };
        // The last one first: none is rendered whose predecessor was taken back.
        let mut withdrawn = [3, 2, 1, 0].map(|index| claims[index].decide(ClaimState::Withdrawn));
        withdrawn.reverse();
        let rendered = loops.join().expect("it ends");
        assert_eq!(rendered, withdrawn.map(|withdrawn| !withdrawn));
        assert!(withdrawn.is_sorted(), "each builds on the one before it: {withdrawn:?}");
        for (index, withdrawn) in withdrawn.into_iter().enumerate() {
            let state = if withdrawn {
                ClaimState::Withdrawn
            } else {
                ClaimState::Rendered(ticks[index])
            };
            assert_eq!(claims[index].state(), state);
        }
    });
}
