//! The hand-over under loom: every interleaving and every reordering that the memory model allows, with two threads.
//!
//! `handoff.rs` and `outbox.rs` are compiled here a second time, on loom's atomics. crossbeam itself is not built on those, so its two parts that
//! are used are written out again below, step for step; that they were copied right is what Miri and the stall tests, on the real ones, are for.
#![allow(
    unsafe_code,
    reason = "stand-ins for crossbeam's parts, which are built of unsafe code"
)]
#![allow(
    dead_code,
    clippy::duplicate_mod,
    reason = "the same sources on other atomics, of which a model uses a part"
)]

#[path = "handoff.rs"]
mod handoff;
#[path = "outbox.rs"]
mod outbox;

/// Loom's counterparts of `rt/primitives.rs`.
mod primitives {
    use loom::cell::UnsafeCell;
    pub(crate) use loom::sync::atomic::{AtomicBool, AtomicU64, Ordering};
    use loom::sync::atomic::{AtomicPtr, AtomicUsize, fence};
    use std::mem::MaybeUninit;

    #[derive(Debug)]
    pub(crate) struct Guard;

    pub(crate) unsafe fn unprotected() -> &'static Guard {
        &Guard
    }

    #[derive(Debug)]
    pub(crate) struct Owned<T>(Box<T>);

    impl<T> Owned<T> {
        pub(crate) fn new(value: T) -> Self {
            Self(Box::new(value))
        }

        pub(crate) fn into_box(self) -> Box<T> {
            self.0
        }
    }

    #[derive(Debug)]
    pub(crate) struct Pointer<T>(*mut T);

    impl<T> Pointer<T> {
        pub(crate) fn null() -> Self {
            Self(std::ptr::null_mut())
        }

        pub(crate) fn is_null(&self) -> bool {
            self.0.is_null()
        }

        pub(crate) unsafe fn into_owned(self) -> Owned<T> {
            // SAFETY: the caller swapped it out, so it is the only one to hold what an `Owned` gave away.
            Owned(unsafe { Box::from_raw(self.0) })
        }
    }

    impl<T> From<Owned<T>> for Pointer<T> {
        fn from(owned: Owned<T>) -> Self {
            Self(Box::into_raw(owned.0))
        }
    }

    #[derive(Debug)]
    pub(crate) struct Atomic<T>(AtomicPtr<T>);

    impl<T> Atomic<T> {
        pub(crate) fn null() -> Self {
            Self(AtomicPtr::new(std::ptr::null_mut()))
        }

        pub(crate) fn swap(&self, new: impl Into<Pointer<T>>, order: Ordering, _: &Guard) -> Pointer<T> {
            Pointer(self.0.swap(new.into().0, order))
        }
    }

    #[derive(Debug)]
    struct Slot<T> {
        stamp: AtomicUsize,
        value: UnsafeCell<MaybeUninit<T>>,
    }

    /// crossbeam's bounded queue. Its producer must find the slot at the tail free at once: there the real one would spin.
    #[derive(Debug)]
    pub(crate) struct ArrayQueue<T> {
        head: AtomicUsize,
        tail: AtomicUsize,
        slots: Vec<Slot<T>>,
        one_lap: usize,
    }

    // SAFETY: as the real one; loom checks that no two threads are in the same slot at once.
    unsafe impl<T: Send> Send for ArrayQueue<T> {}
    // SAFETY: as above.
    unsafe impl<T: Send> Sync for ArrayQueue<T> {}

    impl<T> ArrayQueue<T> {
        pub(crate) fn new(capacity: usize) -> Self {
            Self {
                head: AtomicUsize::new(0),
                tail: AtomicUsize::new(0),
                slots: (0..capacity)
                    .map(|index| Slot {
                        stamp: AtomicUsize::new(index),
                        value: UnsafeCell::new(MaybeUninit::uninit()),
                    })
                    .collect(),
                one_lap: (capacity + 1).next_power_of_two(),
            }
        }

        pub(crate) fn capacity(&self) -> usize {
            self.slots.len()
        }

        fn after(&self, place: usize) -> usize {
            if self.index(place) + 1 < self.capacity() {
                place + 1
            } else {
                (place & !(self.one_lap - 1)).wrapping_add(self.one_lap)
            }
        }

        fn index(&self, place: usize) -> usize {
            place & (self.one_lap - 1)
        }

        pub(crate) fn len(&self) -> usize {
            let tail = self.tail.load(Ordering::SeqCst);
            let head = self.head.load(Ordering::SeqCst);
            // The real one asks again until the tail stands still.
            assert_eq!(self.tail.load(Ordering::SeqCst), tail, "somebody else pushes");
            match self.index(tail).cmp(&self.index(head)) {
                std::cmp::Ordering::Greater => self.index(tail) - self.index(head),
                std::cmp::Ordering::Less => self.capacity() - self.index(head) + self.index(tail),
                std::cmp::Ordering::Equal if tail == head => 0,
                std::cmp::Ordering::Equal => self.capacity(),
            }
        }

        pub(crate) fn push(&self, value: T) -> Result<(), T> {
            let tail = self.tail.load(Ordering::Relaxed);
            let slot = &self.slots[self.index(tail)];
            assert_eq!(
                slot.stamp.load(Ordering::Acquire),
                tail,
                "the producer would spin: its slot is in flight"
            );
            self.tail
                .compare_exchange(tail, self.after(tail), Ordering::SeqCst, Ordering::Relaxed)
                .expect("nobody else pushes");
            // SAFETY: the slot is free, and this is the only producer.
            slot.value.with_mut(|place| unsafe { (*place).write(value) });
            slot.stamp.store(tail + 1, Ordering::Release);
            Ok(())
        }

        pub(crate) fn pop(&self) -> Option<T> {
            loop {
                let head = self.head.load(Ordering::Relaxed);
                let slot = &self.slots[self.index(head)];
                let stamp = slot.stamp.load(Ordering::Acquire);
                if stamp == head + 1 {
                    self.head
                        .compare_exchange(head, self.after(head), Ordering::SeqCst, Ordering::Relaxed)
                        .expect("nobody else pops");
                    // SAFETY: the stamp says that the value is written, and this is the only consumer.
                    let value = slot.value.with(|place| unsafe { (*place).assume_init_read() });
                    slot.stamp.store(head.wrapping_add(self.one_lap), Ordering::Release);
                    return Some(value);
                }
                if stamp == head {
                    fence(Ordering::SeqCst);
                    if self.tail.load(Ordering::Relaxed) == head {
                        return None;
                    }
                }
                loom::thread::yield_now();
            }
        }
    }

    impl<T> Drop for ArrayQueue<T> {
        fn drop(&mut self) {
            while self.pop().is_some() {}
        }
    }
}

use crate::rig_state::{Command, Rig};
use handoff::{CompiledScene, Outcome, Shared, Stopped};
use haptic_core::{Renderer, Scene, Scheme};
use haptic_ipc::RigState;
use outbox::Outbox;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Runs a body under every interleaving with at most three preemptions: what two threads can do to each other shows with two (CHESS).
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
    assert!(executions > 50, "{executions} executions");
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
                shared.drop_retired();
            })
        };
        let mut current = Box::new(compiled(&renderer, 0));
        let mut seen = 0;
        let mut tick = || {
            if let Some(new) = shared.new_scene(&mut seen) {
                assert!(new.revision > current.revision, "never an older scene");
                shared.retire(std::mem::replace(&mut current, new));
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
fn the_producer_of_an_outbox_never_meets_a_slot_in_flight() {
    model(|| {
        let outbox = Arc::new(Outbox::new(3));
        let control = {
            let outbox = Arc::clone(&outbox);
            loom::thread::spawn(move || [outbox.pop(), outbox.pop()].into_iter().flatten().collect::<Vec<_>>())
        };
        // Into the second lap, where slots are used again. (Loom must not find the queue filled: it then sees no choices.)
        let pushed: Vec<u64> = (0..5).filter(|&value| outbox.push(value).is_ok()).collect();
        let mut got = control.join().expect("it ends");
        got.extend(std::iter::from_fn(|| outbox.pop()));
        assert_eq!(got, pushed);
    });
}

#[test]
fn a_reset_never_clears_a_stop_that_came_after_it() {
    model(|| {
        let shared = Arc::new(Shared::new());
        let mut rig = Rig::new(0.2, 0.005);
        let (mut stops_seen, mut last_command) = (0, 0);
        // The beginning of every tick.
        let mut tick = |shared: &Shared| {
            let stops = shared.stops();
            if stops != stops_seen {
                stops_seen = stops;
                rig.stop();
            }
            if let Some(word) = shared.command().filter(|word| word.serial != last_command) {
                last_command = word.serial;
                if !word.overtaken_by(stops) {
                    rig.command(word.command).expect("a reset is never refused");
                }
            }
            rig.state()
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
        heard: handoff::Heard::Confirmed,
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
