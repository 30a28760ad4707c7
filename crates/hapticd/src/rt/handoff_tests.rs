//! The hand-over with real threads. Miri runs these too, with many seeds.

use crate::rt::handoff::{ANY_CONNECTION, CommandWord, Outcome, Shared, StopConfirmation, Stopped, state_from};
use crate::rt::outbox::{SCENES, with_capacity};
use haptic_core::servo::{Command, CompiledScene};
use haptic_core::{Renderer, Scene, Scheme};
use haptic_ipc::RigState;
use std::sync::Arc;

fn compiled(revision: u64) -> CompiledScene {
    CompiledScene::at_once(
        Renderer::new(&Scene::paper(), Scheme::Exact, 1e-3).expect("a valid scene"),
        revision,
    )
}

#[test]
fn the_newest_scene_arrives_and_none_is_lost_or_freed_twice() {
    let shared = Arc::new(Shared::new());
    let last = if cfg!(miri) { 50 } else { 20_000 };
    let poster = {
        let shared = Arc::clone(&shared);
        std::thread::spawn(move || {
            for revision in 1..=last {
                shared.scenes.post(compiled(revision));
            }
        })
    };
    let mut current = Box::new(compiled(0));
    let mut seen = 0;
    let mut take = || {
        if let Some(new) = shared.scenes.take_new(&mut seen) {
            assert!(new.revision > current.revision, "never an older scene");
            current = new;
        }
        current.revision
    };
    while !poster.is_finished() {
        take();
        std::thread::yield_now();
    }
    // That it is finished orders nothing; that it has joined does: the last one is there now.
    poster.join().expect("it ends");
    assert_eq!(take(), last);
    assert!(shared.scenes.take().is_none());
}

#[test]
fn command_words_keep_their_parts() {
    for command in [Command::Engage, Command::Release, Command::Reset] {
        let word = CommandWord {
            serial: 0xdead_beef,
            stops_known: 0x00ab_cdef,
            command,
        };
        assert_eq!(CommandWord::unpack(word.pack()), Some(word));
        assert!(!word.overtaken_by(0x5_00ab_cdef));
        assert!(word.overtaken_by(0x00ab_cdf0));
    }
    assert_eq!(CommandWord::unpack(0), None);
}

#[test]
fn states_survive_the_way_through_a_word() {
    for state in RigState::ALL {
        assert_eq!(state_from(state as u64), state);
    }
}

/// Words of all bits set and of none, and the one with nothing but a number of stops in it.
#[test]
fn what_is_not_a_command_word_is_no_command() {
    for word in [4, 0xff, 0x100, u64::MAX, 0x1_0000_0000] {
        assert_eq!(CommandWord::unpack(word), None, "{word:#x}");
    }
    let word = CommandWord {
        serial: 0,
        stops_known: u32::MAX,
        command: Command::Release,
    };
    let unpacked = CommandWord::unpack(word.pack()).expect("a command");
    assert_eq!((unpacked.serial, unpacked.stops_known), (0, 0x00ff_ffff), "modulo 2^24");
}

#[test]
fn untaken_scene_is_replaced_and_none_is_taken_twice() {
    let shared = Shared::new();
    let mut seen = 0;
    assert!(shared.scenes.take_new(&mut seen).is_none());
    shared.scenes.post(compiled(1));
    shared.scenes.post(compiled(2));
    let taken = shared.scenes.take_new(&mut seen).map(|scene| scene.revision);
    assert_eq!((taken, seen), (Some(2), 2));
    assert!(shared.scenes.take_new(&mut seen).is_none());
    shared.scenes.post(compiled(3));
    assert_eq!(shared.scenes.take().map(|scene| scene.revision), Some(3));
    // What nobody takes goes with the mailbox: Miri reports what is not freed.
    shared.scenes.post(compiled(4));
}

#[test]
fn command_stays_until_withdrawn_and_knows_earlier_stops() {
    let shared = Shared::new();
    let command = || CommandWord::unpack(shared.command_word());
    assert_eq!(command(), None);
    assert_eq!([shared.stop(), shared.stop(), shared.stops()], [1, 2, 2]);
    shared.send(7, Command::Reset, shared.stops());
    let word = command().expect("it was sent");
    assert_eq!((word.serial, word.stops_known, word.command), (7, 2, Command::Reset));
    assert!(!word.overtaken_by(shared.stops()));
    assert_eq!(shared.stop(), 3);
    assert!(word.overtaken_by(shared.stops()));
    let (before, sent) = (0, shared.command_word());
    shared.withdraw(7);
    assert_eq!(command(), None);
    assert!(
        ![before, sent].contains(&shared.command_word()),
        "the loop can see that there was one"
    );
}

#[test]
fn lease_lapses_on_time_and_silence_counts_from_last_beat() {
    let shared = Shared::new();
    assert!(!shared.has_lapsed(u64::MAX), "nobody has a lease");
    shared.lease_until(1000);
    assert_eq!(
        [999, 1000, 1001].map(|now_ns| shared.has_lapsed(now_ns)),
        [false, false, true]
    );
    assert_eq!(shared.silent_ns(5000), 0, "the control thread has not begun");
    shared.heartbeat(2000);
    assert_eq!(
        [1999, 2000, 2001, 5000].map(|now_ns| shared.silent_ns(now_ns)),
        [0, 0, 1, 3000]
    );
}

#[test]
fn engagement_is_admitted_for_any_or_the_named_device() {
    let shared = Shared::new();
    assert!(shared.is_admitted(3), "nobody has named one");
    shared.admit(3);
    assert_eq!(
        [2, 3, 4].map(|connection| shared.is_admitted(connection)),
        [false, true, false]
    );
    shared.admit(ANY_CONNECTION);
    assert!(shared.is_admitted(4));
}

#[test]
fn the_loop_ends_when_it_is_asked_to() {
    let shared = Shared::new();
    assert!(!shared.quitting());
    shared.quit();
    assert!(shared.quitting());
}

#[test]
fn a_command_is_answered_under_its_own_number_alone() {
    let shared = Shared::new();
    for (serial, refused) in [(1, false), (2, true)] {
        let outcome = Outcome {
            tick: 70 + u64::from(serial),
            state: RigState::Releasing,
            refused,
        };
        assert_eq!(shared.answers.command(serial), None);
        shared.answers.command_done(serial, outcome);
        assert_eq!(shared.answers.command(serial), Some(outcome));
        assert_eq!(shared.answers.command(serial - 1), None);
    }
}

#[test]
fn answer_to_a_stop_also_answers_earlier_stops() {
    let shared = Shared::new();
    assert_eq!(shared.answers.stop(1), None);
    for (stop, confirmation) in [
        (1, StopConfirmation::Confirmed),
        (2, StopConfirmation::Unconfirmed),
        (4, StopConfirmation::NoDevice),
    ] {
        let stopped = Stopped {
            tick: 10 * stop,
            state: RigState::Stopped,
            confirmation,
            written_ns: 100 * stop,
            confirmed_ns: 1000 * stop,
        };
        shared.answers.stopped(stop, stopped);
        assert_eq!(shared.answers.stop(stop), Some(stopped));
        assert_eq!(
            shared.answers.stop(stop - 1),
            Some(stopped),
            "it has overtaken that one"
        );
        assert_eq!(shared.answers.stop(stop + 1), None);
    }
}

#[test]
fn scene_counts_as_rendered_from_its_tick_on() {
    let shared = Shared::new();
    assert_eq!(shared.answers.applied(1), None);
    shared.answers.scene_applied(5, 77);
    assert_eq!(
        [4, 5, 6].map(|revision| shared.answers.applied(revision)),
        [Some(77), Some(77), None]
    );
    assert_eq!(shared.answers.steps(), 0);
    shared.answers.set_ramp_step(3);
    assert_eq!(shared.answers.steps(), 3);
    assert_eq!(shared.answers.samples_forgotten(), 0);
    shared.answers.set_samples_forgotten(9);
    assert_eq!(shared.answers.samples_forgotten(), 9);
}

#[test]
fn scenes_are_handed_back_while_room_lasts() {
    let (mut producer, mut consumer) = with_capacity(1);
    for left in (1..=SCENES).rev() {
        assert!(producer.has_room_for_scenes(left) && !producer.has_room_for_scenes(left + 1));
        producer.retire(Box::new(compiled(1)));
    }
    assert!(producer.has_room_for_scenes(0) && !producer.has_room_for_scenes(1));
    consumer.drop_retired();
    assert!(producer.has_room_for_scenes(SCENES) && !producer.has_room_for_scenes(SCENES + 1));
}
