//! Files that anybody may have put where the daemon reads: none keeps it waiting, and none fills its memory.

use haptic_ipc::{ErrorCode, Request, RigState, SceneListReply, SceneRef, StateReply};
use rustix::fs::{CWD, FileType, Mode, mknodat};
use rustix::process::Signal;
use std::fs;
use std::process::Command;
use std::time::{Duration, Instant};
use system_tests::{Daemon, binary, is_refused, plain, refused, stalled, wait_for_state};

// hazard: H14
#[test]
fn bad_scene_files_are_refused_at_once() {
    let daemon = Daemon::start(&[]);
    let folder = daemon.scene_dir();
    fs::create_dir_all(&folder).expect("a directory");
    // Of the kinds that are none to read, the one that would keep a reader waiting for ever.
    let (fifo, mode) = (folder.join("fifo.toml"), Mode::from_raw_mode(0o600));
    mknodat(CWD, fifo, FileType::Fifo, mode, 0).expect("a FIFO");
    let mut client = daemon.client();
    let error = refused(&mut client, Request::load(SceneRef::Name("fifo".to_owned())));
    assert_eq!(error.code, ErrorCode::SceneFile, "{error}");
    assert!(
        error.message.contains("a FIFO") && error.message.contains("fifo.toml"),
        "{error}"
    );
    let list: SceneListReply = client.request(Request::SceneList {}).expect("a list");
    let listed = list.scenes.iter().find(|scene| scene.name == "fifo");
    let problem = listed.and_then(|scene| scene.problem.as_deref());
    assert!(problem.is_some_and(|problem| problem.contains("a FIFO")), "{listed:?}");
}

// hazard: H14
#[test]
fn stalled_disk_delays_neither_stop_nor_shutdown() {
    let Some(daemon) = stalled::daemon(&["--ramp-ms", "20"]) else {
        return;
    };
    let mut client = daemon.client();
    let _: StateReply = client.request(Request::engage()).expect("it is idle");
    wait_for_state(&mut client, RigState::Engaged);
    // More of them than it has threads for.
    let mut waiting: Vec<_> = (0..6).map(|_| daemon.raw()).collect();
    for (index, raw) in waiting.iter_mut().enumerate() {
        let save = format!(r#""scene.save","name":"mine {index}""#);
        let op = if index % 2 == 0 { &save } else { r#""scene.list""# };
        raw.send(format!("{{\"id\":1,\"op\":{op}}}\n"));
    }
    let asked = Instant::now();
    let stopped: StateReply = client.request(Request::Stop {}).expect("a stop");
    let stop_took = asked.elapsed();
    assert_eq!(stopped.state, RigState::Stopped);
    // Each answer reports that the disk does not respond, which also shows that it did not.
    for raw in &mut waiting {
        let answer = raw.line();
        assert_eq!(answer["error"]["code"], "scene_file", "{answer}");
        let message = answer["error"]["message"].as_str().expect("a message");
        assert!(
            message.contains("no answer for 2 s") && message.contains("scenes"),
            "{message}"
        );
    }
    let _: StateReply = client.request(Request::Reset {}).expect("it is stopped");
    let _: StateReply = client.request(Request::engage()).expect("it is idle");
    wait_for_state(&mut client, RigState::Engaged);
    let asked = Instant::now();
    let (ended, printed) = daemon.end(Signal::TERM);
    let end_took = asked.elapsed();
    println!("with the disk stalled: stop confirmed after {stop_took:?}, ended after {end_took:?}");
    assert!(ended.success(), "{printed}");
    assert!(stop_took < Duration::from_secs(2), "{stop_took:?}");
    assert!(end_took < Duration::from_secs(5), "{end_took:?}");
}

// hazard: H20
#[test]
fn a_name_longer_than_the_history_may_hold_is_refused() {
    let daemon = Daemon::start(&[]);
    let scene = include_str!("../../scenes/viscous-drag.toml");
    let directory = tempfile::tempdir().expect("a directory");
    let path = directory.path().join("long.toml");
    let name = scene
        .lines()
        .find(|line| line.starts_with("name"))
        .expect("it has a name");
    let long = format!("name = \"{}\"", "x".repeat(300));
    fs::write(&path, scene.replace(name, &long)).expect("a file");
    let path = plain(&path);
    is_refused("load", &daemon.ctl(&["scene", "load", path]), 1, &["300 bytes", "256"]);
    let begun = Command::new(binary("hapticd"))
        .args(["--device", "fake", "--scene", path])
        .output();
    is_refused("begin", &begun.expect("it starts"), 2, &["300 bytes", "256"]);
    daemon.ctl_ok(&["scene", "save", "short"]);
    daemon.ctl_ok(&["scene", "load", "short"]);
}
