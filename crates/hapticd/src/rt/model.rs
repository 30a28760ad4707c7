//! The hand-over under loom: every interleaving and every reordering that the memory model allows,
//! with two threads.
//!
//! `handoff.rs` and `claim.rs` are compiled here a second time, on loom's atomics.
// By this cargo-mutants knows that it is a test, and does not change `handoff.rs` twice.
#![cfg(test)]
#![allow(
    dead_code,
    clippy::duplicate_mod,
    reason = "the same source on other atomics, of which a model uses a part"
)]

#[path = "claim.rs"]
mod claim;
#[path = "handoff.rs"]
mod handoff;

/// Loom's counterparts of `rt/atomic.rs`.
mod atomic {
    pub(crate) use loom::sync::atomic::{AtomicBool, AtomicPtr, AtomicU64, Ordering};
}

use claim::{Claim, ClaimState};
use handoff::{CommandWord, Outcome, Shared, Stopped};
use haptic_core::servo::{Command, CompiledScene};
use haptic_core::{Renderer, Scene, Scheme};
use haptic_ipc::RigState;
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

fn compiled(renderer: &Renderer, revision: u64) -> CompiledScene {
    CompiledScene::at_once(renderer.clone(), revision)
}

#[test]
fn the_last_scene_posted_is_the_one_that_the_loop_comes_to() {
    let renderer = Renderer::new(&Scene::paper(), Scheme::Exact, 1e-3).expect("a valid scene");
    model(move || {
        let shared = Arc::new(Shared::new());
        let control = {
            let (shared, renderer) = (Arc::clone(&shared), renderer.clone());
            loom::thread::spawn(move || {
                shared.scenes.post(compiled(&renderer, 1));
                shared.scenes.post(compiled(&renderer, 2));
            })
        };
        let mut current = Box::new(compiled(&renderer, 0));
        let mut seen = 0;
        let mut tick = || {
            if let Some(new) = shared.scenes.take_new(&mut seen) {
                assert!(new.revision > current.revision, "never an older scene");
                current = new;
            }
            current.revision
        };
        tick();
        tick();
        control.join().expect("it ends");
        assert_eq!(tick(), 2);
    });
}

#[test]
fn a_reset_never_clears_a_stop_that_came_after_it() {
    model(|| {
        let shared = Arc::new(Shared::new());
        let mut state = RigState::Idle;
        let (mut stops_seen, mut last_command) = (0, 0);
        // The beginning of every tick.
        let mut tick = |shared: &Shared| {
            let stops = shared.stops();
            if stops != stops_seen {
                stops_seen = stops;
                state = RigState::Stopped;
            }
            let word = std::mem::replace(&mut last_command, shared.command_word());
            if let Some(word) = CommandWord::unpack(last_command).filter(|_| word != last_command)
                && !word.overtaken_by(stops)
                && word.command == Command::Reset
            {
                state = RigState::Idle;
            }
            state
        };
        shared.stop();
        tick(&shared);
        let stops_known = shared.stops();
        let control = {
            let shared = Arc::clone(&shared);
            loom::thread::spawn(move || {
                // The reset was asked for before this stop, and waited in a queue.
                shared.stop();
                shared.send(1, Command::Reset, stops_known);
            })
        };
        tick(&shared);
        tick(&shared);
        control.join().expect("it ends");
        assert_eq!(tick(&shared), RigState::Stopped);
    });
}

#[test]
fn an_answer_is_seen_whole_or_not_at_all() {
    let outcome = Outcome {
        tick: 7,
        state: RigState::Engaging,
        refused: true,
    };
    let stopped = Stopped {
        tick: 7,
        state: RigState::Stopped,
        confirmation: handoff::StopConfirmation::Confirmed,
        written_ns: 8,
        confirmed_ns: 9,
    };
    model(move || {
        let shared = Arc::new(Shared::new());
        let loops = {
            let shared = Arc::clone(&shared);
            loom::thread::spawn(move || {
                shared.answers.scene_applied(3, 7);
                shared.answers.command_done(5, outcome);
                shared.answers.stopped(2, stopped);
            })
        };
        let answers = &shared.answers;
        assert!(answers.applied(3).is_none_or(|tick| tick == 7));
        assert!(answers.command(5).is_none_or(|seen| seen == outcome));
        assert!(answers.stop(2).is_none_or(|seen| seen == stopped));
        loops.join().expect("it ends");
        assert_eq!(answers.command(5), Some(outcome));
        assert_eq!(answers.stop(2), Some(stopped));
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
