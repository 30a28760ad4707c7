//! The hand-over with real threads. Miri runs these too, with many seeds.

use crate::rt::handoff::{CommandWord, Shared, state_from};
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
    while current.revision < last {
        if let Some(new) = shared.scenes.take_new(&mut seen) {
            assert!(new.revision > current.revision, "never an older scene");
            current = new;
        }
        std::thread::yield_now();
    }
    poster.join().expect("it ends");
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
