//! Files that anybody may have put where the daemon reads: none keeps it waiting, and none fills its memory.

use haptic_ipc::{ErrorCode, Request, RigState, SceneListReply, SceneRef, SceneSaveReply, StateReply};
use rustix::fs::{CWD, FileType, Mode, mknodat};
use rustix::process::Signal;
use std::fs;
use std::os::unix::fs::symlink;
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::process::Command;
use std::time::{Duration, Instant};
use system_tests::process::size_kib;
use system_tests::{Daemon, binary, ctl, is_refused, refused, stalled, wait_for_state};

/// Each kind of file that is none to read, with what the refusal says of it.
const TRAPS: [(&str, &str); 6] = [
    ("fifo", "a FIFO"),
    ("endless", "a device"),
    ("socket", "a socket"),
    ("folder", "a directory"),
    ("loop", "symbolic links"),
    ("huge", "limit of 1048576 bytes"),
];

/// Lays one of each into a directory, as a scene's file.
fn lay_traps(directory: &Path) -> UnixListener {
    fs::create_dir_all(directory).expect("a directory");
    let at = |name: &str| directory.join(format!("{name}.toml"));
    mknodat(CWD, at("fifo"), FileType::Fifo, Mode::from_raw_mode(0o600), 0).expect("a FIFO");
    symlink("/dev/zero", at("endless")).expect("a link");
    fs::create_dir(at("folder")).expect("a directory");
    symlink(at("loop"), at("loop")).expect("a link");
    // Sparse: it takes no room on the disk.
    fs::File::create(at("huge"))
        .and_then(|file| file.set_len(64 << 30))
        .expect("a file");
    UnixListener::bind(at("socket")).expect("a socket")
}

// hazard: H14
#[test]
fn bad_scene_files_are_refused_at_once() {
    let daemon = Daemon::start(&["--ramp-ms", "20"]);
    let _socket = lay_traps(&daemon.scene_dir());
    let mut client = daemon.client();
    let _: StateReply = client.request(Request::engage()).expect("it is idle");
    wait_for_state(&mut client, RigState::Engaged);
    let resident_kib = || size_kib(daemon.pid(), "VmRSS").expect("it runs");
    let before = resident_kib();
    let began = Instant::now();
    for (name, part) in TRAPS {
        let load = Request::load(SceneRef::Name(name.to_owned()));
        let error = refused(&mut client, load);
        assert_eq!(error.code, ErrorCode::SceneFile, "{error}");
        assert!(
            error.message.contains(part) && error.message.contains(&format!("{name}.toml")),
            "{name}: {error}"
        );
    }
    let list: SceneListReply = client.request(Request::SceneList {}).expect("a list");
    for (name, part) in TRAPS {
        let listed = list.scenes.iter().find(|scene| scene.name == name).expect(name);
        assert!(
            listed.problem.as_ref().is_some_and(|problem| problem.contains(part)),
            "{listed:?}"
        );
    }
    let (grown, took) = (resident_kib().saturating_sub(before), began.elapsed());
    println!("{} refusals and a list took {took:?} and {grown} KiB", TRAPS.len());
    assert!(took < Duration::from_secs(10), "{took:?}");
    assert!(grown < 32 << 10, "{grown} KiB");
    let (ended, printed) = daemon.end(Signal::TERM);
    assert!(ended.success(), "{printed}");
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
        let save = format!("{{\"id\":1,\"op\":\"scene.save\",\"name\":\"mine {index}\"}}\n");
        raw.send(if index % 2 == 0 {
            save
        } else {
            "{\"id\":1,\"op\":\"scene.list\"}\n".to_owned()
        });
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
    let path = path.to_str().expect("a plain path");
    is_refused("load", &daemon.ctl(&["scene", "load", path]), 1, &["300 bytes", "256"]);
    let begun = Command::new(binary("hapticd"))
        .args(["--device", "fake", "--scene", path])
        .output();
    is_refused("begin", &begun.expect("it starts"), 2, &["300 bytes", "256"]);
    let saved: Result<SceneSaveReply, _> = daemon.client().request(Request::SceneSave {
        name: "short".to_owned(),
        scene: None,
        replace: false,
    });
    assert!(saved.is_ok(), "{saved:?}");
    assert!(ctl(daemon.socket(), &["scene", "load", "short"]).status.success());
}
