//! The control socket in a hostile world: who can connect, and what those who do cannot bring about.

use haptic_ipc::{ChangeReply, Changes, Client, ClientError, ErrorCode, Request, RigState, SceneReply, StateReply};
use rustix::process::{Gid, Uid, geteuid};
use rustix::thread::{set_thread_groups, set_thread_res_gid, set_thread_res_uid};
use std::fs::{self, Permissions};
use std::io::{Read, Write};
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::Command;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use system_tests::attack::{self, Attack};
use system_tests::process::size_kib;
use system_tests::{
    Daemon, LIGHT_BLOCK, binary, plain, refused, status, stderr, until, until_some, wait_for, wait_for_state,
};

const NOBODY: u32 = 65_534;
/// A group that every Debian has, and of which nobody is a member by himself.
const GROUP: (&str, u32) = ("daemon", 1);

/// Somewhere that other users can reach.
fn public_directory() -> tempfile::TempDir {
    let directory = tempfile::tempdir().expect("a directory");
    open(directory.path(), 0o755);
    directory
}

fn open(path: &Path, mode: u32) {
    fs::set_permissions(path, Permissions::from_mode(mode)).expect("it is ours");
}

fn mode(path: &Path) -> u32 {
    fs::metadata(path).expect("it is there").mode() & 0o7777
}

/// Whether this process may become other users; says so aloud where it may not.
fn is_root() -> bool {
    if !geteuid().is_root() {
        test_run::skip("root", "to become another user");
    }
    geteuid().is_root()
}

/// Does something as another user: on Linux every thread has an identity of its own, and the kernel
/// tells the daemon that of the one that connects.
fn as_user<T: Send>(uid: u32, gid: u32, groups: &[u32], act: impl FnOnce() -> T + Send) -> T {
    let (uid, gid) = (Uid::from_raw(uid), Gid::from_raw(gid));
    let groups: Vec<Gid> = groups.iter().copied().map(Gid::from_raw).collect();
    std::thread::scope(|scope| {
        let other = scope.spawn(move || {
            set_thread_groups(&groups).expect("root may");
            set_thread_res_gid(gid, gid, gid).expect("root may");
            set_thread_res_uid(uid, uid, uid).expect("root may");
            act()
        });
        other.join().expect("it ends")
    })
}

fn as_nobody<T: Send>(act: impl FnOnce() -> T + Send) -> T {
    as_user(NOBODY, NOBODY, &[], act)
}

fn of_mass(mass_kg: f64) -> Request {
    Request::set([("mass", mass_kg)].into_iter().collect::<Changes>())
}

fn heavier() -> Request {
    of_mass(1.5)
}

fn code(refused: ClientError) -> ErrorCode {
    match refused {
        ClientError::Refused(error) => error.code,
        other => panic!("{other}"),
    }
}

#[test]
fn another_user_is_kept_out_by_the_mode_and_by_the_kernels_word() {
    let _alone = crate::alone();
    if !is_root() {
        return;
    }
    let directory = public_directory();
    let socket = directory.path().join("run/control.sock");
    let daemon = Daemon::start_at(&socket, &[]);
    assert_eq!((mode(socket.parent().expect("run")), mode(&socket)), (0o700, 0o600));
    let refused = as_nobody(|| Client::connect(&socket)).expect_err("the directory is closed");
    assert!(matches!(refused, ClientError::Permission { .. }), "{refused}");
    // Somebody has changed the modes.
    open(socket.parent().expect("run"), 0o777);
    open(&socket, 0o777);
    let refused = as_nobody(|| Client::connect(&socket)).expect_err("another user");
    assert_eq!(code(refused), ErrorCode::NotPermitted);
    // By group he is no better off: no group was named.
    let refused = as_user(NOBODY, 0, &[GROUP.1], || Client::connect(&socket)).expect_err("another user");
    assert_eq!(code(refused), ErrorCode::NotPermitted);
    let _: SceneReply = daemon.client().request(Request::get()).expect("we are served");
}

#[test]
fn a_member_of_the_group_tunes_and_nobody_else_does() {
    let _alone = crate::alone();
    if !is_root() {
        return;
    }
    let directory = public_directory();
    let socket = directory.path().join("a/run/control.sock");
    let _daemon = Daemon::start_at(&socket, &["--socket-group", GROUP.0]);
    for (path, wanted) in [("a", 0o750), ("a/run", 0o750), ("a/run/control.sock", 0o660)] {
        let found = fs::metadata(directory.path().join(path)).expect("it is there");
        assert_eq!((found.mode() & 0o7777, found.gid()), (wanted, GROUP.1), "{path}");
    }
    let change = || Client::connect(&socket)?.request::<ChangeReply>(heavier());
    as_user(NOBODY, GROUP.1, &[], change).expect("his first group");
    as_user(NOBODY, NOBODY, &[4, GROUP.1, 7], change).expect("one of his further groups");
    let refused = as_nobody(|| Client::connect(&socket)).expect_err("no member");
    assert!(matches!(refused, ClientError::Permission { .. }), "{refused}");
    open(&directory.path().join("a"), 0o755);
    open(socket.parent().expect("run"), 0o755);
    open(&socket, 0o666);
    let refused = as_user(NOBODY, NOBODY, &[2, 3], || Client::connect(&socket)).expect_err("no member");
    assert!(refused.to_string().contains(GROUP.0), "{refused}");
    assert_eq!(code(refused), ErrorCode::NotPermitted);

    // A daemon says whom the directories keep from its socket.
    let closed = tempfile::tempdir().expect("a directory");
    open(closed.path(), 0o700);
    let daemon = Daemon::start_at(&closed.path().join("run/control.sock"), &["--socket-group", GROUP.0]);
    let (printed, (group, _), closed) = (daemon.printed().join(""), GROUP, closed.path().display());
    for part in [
        format!("open to the group {group}, but the directory {closed} is not"),
        format!("chgrp {group} {closed}"),
    ] {
        assert!(printed.contains(&part), "{printed}");
    }
}

#[test]
fn a_watcher_may_look_and_stop_and_takes_nobodys_place() {
    let _alone = crate::alone();
    let directory = public_directory();
    let [control, watch] = ["run/control.sock", "watch/watch.sock"].map(|path| directory.path().join(path));
    let daemon = Daemon::start_at(&control, &["--watch-socket", plain(&watch)]);
    assert_eq!((mode(watch.parent().expect("watch")), mode(&watch)), (0o755, 0o666));
    assert_eq!((mode(control.parent().expect("run")), mode(&control)), (0o700, 0o600));
    let looks_and_stops = || {
        let mut watcher = Client::connect(&watch).expect("anybody may watch");
        let _: SceneReply = watcher.request(Request::get()).expect("the scene");
        let (release, reset) = (Request::Release {}, Request::Reset {});
        for request in [heavier(), Request::engage(), release, reset, Request::undo()] {
            assert_eq!(refused(&mut watcher, request).code, ErrorCode::ReadOnly);
        }
        let stopped: StateReply = watcher.request(Request::Stop {}).expect("anybody may stop");
        assert_eq!(stopped.state, RigState::Stopped);
    };
    if is_root() {
        as_nobody(looks_and_stops);
    } else {
        looks_and_stops();
    }
    assert_eq!(daemon.ctl(&["reset"]).status.code(), Some(0));
    let watchers: Vec<Client> = (0..40)
        .map(|_| Client::connect(&watch).expect("a place, or one to stop from"))
        .collect();
    let tuners: Vec<Client> = (0..31).map(|_| daemon.client()).collect();
    let mut last = daemon.client();
    let _: ChangeReply = last.request(heavier()).expect("the 32nd tuner is served");
    drop((watchers, tuners));
}

/// What a daemon has taken of the system: descriptors, its memory now and the most that it ever had, KiB.
#[derive(Clone, Copy, Debug)]
struct Held {
    descriptors: usize,
    resident_kib: u64,
    peak_kib: u64,
}

/// Nine of ten stops take less while somebody attacks. The loop needs a millisecond; the rest is the machine's time, so
/// only the long run asks for it.
const SLOW_STOP: Duration = Duration::from_millis(100);

/// Says how long stops took; the median, nine of ten and the longest.
fn taken(what: &str, mut stops: Vec<Duration>) -> [Duration; 3] {
    stops.sort_unstable();
    let [median, most, longest] = [500, 900, 1000].map(|per_mille| stops[(stops.len() - 1) * per_mille / 1000]);
    eprintln!(
        "{what}: {} stops, {median:?} (median), {most:?} (nine of ten), {longest:?} (longest)",
        stops.len()
    );
    [median, most, longest]
}

/// Attacks for a while, and goes on using the daemon meanwhile.
fn survives(daemon: &Daemon, attack: Attack, time: Duration) {
    let mut user = daemon.client();
    let over = AtomicBool::new(false);
    let mut stops = Vec::new();
    std::thread::scope(|scope| {
        let attacking = scope.spawn(|| attack.run(daemon.socket(), &over));
        let began = Instant::now();
        while began.elapsed() < time || stops.is_empty() {
            let _: StateReply = user.request(Request::engage()).expect("it is idle");
            for change in [of_mass(1.0), heavier()] {
                let _: ChangeReply = user.request(change).expect("a valid change");
            }
            let asked = Instant::now();
            let stopped: StateReply = user.request(Request::Stop {}).expect("a stop always works");
            stops.push(asked.elapsed());
            assert_eq!(stopped.state, RigState::Stopped, "{}", attack.name);
            let idle: StateReply = user.request(Request::Reset {}).expect("it is stopped");
            assert_eq!(idle.state, RigState::Idle, "{}", attack.name);
        }
        over.store(true, Ordering::Relaxed);
        attacking.join().expect("it ends");
    });
    let [_, most, _] = taken(attack.name, stops);
    if test_run::is_long_for("how long a stop takes in an attack") {
        assert!(most < SLOW_STOP, "{}", attack.name);
    }
    wait_for(&mut user, "the attackers to be gone", |status| status.clients == 1);
    let scene: SceneReply = daemon.client().request(Request::get()).expect("others are served");
    let mass = scene.params["mass"].positive;
    assert_eq!(mass, 1.5, "{}: nobody else changed it", attack.name);
}

/// What a daemon has taken after each attack went on for a while, once it has noticed the last
/// hang-up: the descriptors are at most so many again.
fn after_all_attacks(daemon: &Daemon, descriptors: usize, time: impl Fn(&Attack) -> Duration) -> Held {
    for attack in attack::ALL {
        survives(daemon, attack, time(&attack));
    }
    let kib = |name: &str| size_kib(daemon.pid(), name).expect("it runs");
    until_some(&format!("more than {descriptors} descriptors"), || {
        let held = Held {
            descriptors: system_tests::process::descriptors(daemon.pid()),
            resident_kib: kib("VmRSS"),
            peak_kib: kib("VmHWM"),
        };
        (held.descriptors <= descriptors).then_some(held)
    })
}

#[test]
fn attacks_leave_others_served_and_nothing_behind() {
    let _alone = crate::alone();
    let daemon = Daemon::start(&[]);
    // What is taken once stays: places for clients, the runtime's and the allocator's.
    let before = after_all_attacks(&daemon, usize::MAX, |_| Duration::from_millis(300));
    let time = |attack: &Attack| {
        let is_rate = attack.name.starts_with("1000 connections");
        let at_length = Duration::from_secs(if is_rate { 10 } else { 2 });
        test_run::extent(Duration::from_millis(100), at_length)
    };
    // The allocator keeps what a busy moment once needed, so the first rounds may still take
    // memory. A leak takes some in every round.
    let mut rounds = vec![before];
    let after = loop {
        let after = after_all_attacks(&daemon, before.descriptors, time);
        let grown_kib = after.resident_kib.saturating_sub(rounds[rounds.len() - 1].resident_kib);
        rounds.push(after);
        if grown_kib < 1024 {
            break after;
        }
        assert!(rounds.len() < 8, "it takes more in every round: {rounds:?}");
    };
    println!("{rounds:?}");
    // Not even for a while: a client's questions and answers have room for so much, and no more.
    assert!(after.peak_kib < before.resident_kib + 64 * 1024, "{rounds:?}");
}

#[test]
fn a_stop_is_obeyed_though_its_sender_hangs_up_at_once() {
    let _alone = crate::alone();
    let daemon = Daemon::start(&["--ramp-ms", "10"]);
    let mut user = daemon.client();
    for before in [0, 1, 2, 5, 40] {
        for greeted in [true, false].repeat(5) {
            let _: StateReply = user.request(Request::engage()).expect("it is idle");
            let mut sender = UnixStream::connect(daemon.socket()).expect("there is a place");
            if greeted {
                let greeting = sender.read(&mut [0; 1024]).expect("a greeting");
                assert_ne!(greeting, 0);
            }
            let asked = "{\"id\":1,\"op\":\"status\"}\n".repeat(before) + "{\"id\":2,\"op\":\"stop\"}\n";
            sender.write_all(asked.as_bytes()).expect("it is taken");
            drop(sender);
            wait_for_state(&mut user, RigState::Stopped);
            let _: StateReply = user.request(Request::Reset {}).expect("it is stopped");
        }
    }
}

#[test]
fn a_last_line_needs_no_end() {
    let _alone = crate::alone();
    let daemon = Daemon::start(&[]);
    daemon.ctl_ok(&["engage", "--wait"]);
    let mut raw = daemon.raw();
    raw.send(r#"{"id":7,"op":"stop"}"#);
    raw.hang_up();
    let answer = raw.line();
    assert_eq!(
        (&answer["id"], &answer["ok"]["state"]),
        (&7.into(), &"stopped".into()),
        "{answer}"
    );
    let mut raw = daemon.raw();
    raw.send(r#"{"id":8,"op":"set","params":{"mass":1"#);
    raw.hang_up();
    assert_eq!(raw.line()["error"]["code"], "bad_json", "half a line is none");
}

#[test]
fn a_stop_does_not_wait_behind_what_its_client_asked_before() {
    let _alone = crate::alone();
    // Each of these takes a tick of 10 ms.
    let daemon = Daemon::start(&["--rate", "100", "--scene", LIGHT_BLOCK]);
    let mut raw = daemon.raw();
    let engage = |id: u32| format!("{{\"id\":{id},\"op\":\"engage\"}}\n");
    let asked: String = (1..=1000).map(engage).collect();
    raw.send(asked + "{\"id\":1001,\"op\":\"stop\"}\n");
    let engaged = (0..1000)
        .take_while(|_| raw.line()["error"]["code"] != "stopped")
        .count();
    assert!(engaged < 500, "the stop came after {engaged} of 1000 requests");
}

/// A daemon that may have so many descriptors, as the shell's `ulimit` takes them.
fn with_descriptors(most: &str, socket: &Path) -> Daemon {
    let mut command = Command::new("sh");
    command
        .args(["-c", &format!("ulimit -n {most}; exec \"$0\" \"$@\"")])
        .arg(binary("hapticd"))
        .args(["--device", "fake"]);
    Daemon::spawn(command, socket)
}

// hazard: H24
#[test]
fn a_newcomers_stop_finds_its_way_through_every_crowd() {
    let _alone = crate::alone();
    for crowd in &attack::CROWDS {
        for descriptors in ["1024", "64", "40"] {
            stops_in_a_crowd(crowd, descriptors);
        }
    }
}

fn stops_in_a_crowd(crowd: &Attack, descriptors: &str) {
    let directory = tempfile::tempdir().expect("a directory");
    let socket = directory.path().join("run/control.sock");
    let daemon = with_descriptors(descriptors, &socket);
    let mut user = daemon.client();
    let _: StateReply = user.request(Request::engage()).expect("it is idle");
    let over = AtomicBool::new(false);
    let mut stops = Vec::new();
    std::thread::scope(|scope| {
        let attacking = scope.spawn(|| crowd.run(&socket, &over));
        // The house is full, and as full as it may be.
        std::thread::sleep(Duration::from_millis(300));
        for _ in 0..test_run::extent(10, 100) {
            let asked = Instant::now();
            let stopped = daemon.ctl(&["stop"]);
            stops.push(asked.elapsed());
            assert!(
                stopped.status.success(),
                "{}, {descriptors} descriptors: {}",
                crowd.name,
                stderr(&stopped)
            );
        }
        over.store(true, Ordering::Relaxed);
        attacking.join().expect("it ends");
    });
    let what = format!("{}, {descriptors} descriptors", crowd.name);
    let [_, _, longest] = taken(&what, stops);
    if test_run::is_long_for("how long a newcomer's stop takes in a crowd") {
        assert!(longest < SLOW_STOP, "{what}");
    }
    let state = status(&mut user).state;
    assert_eq!(state, RigState::Stopped, "who was there before is served");
    wait_for(&mut user, "the crowd to be gone", |status| status.clients == 1);
    let _: SceneReply = daemon.client().request(Request::get()).expect("there is room again");
}

// hazard: H24
#[test]
fn lost_socket_is_rebound_and_taken_socket_ends_the_force() {
    let _alone = crate::alone();
    let directory = tempfile::tempdir().expect("a directory");
    let socket = directory.path().join("run/control.sock");
    let lock = directory.path().join("run/control.sock.lock");
    let daemon = with_descriptors("1024", &socket);
    let mut user = daemon.client();
    let stops = |user: &mut Client| {
        daemon.ctl_ok(&["stop"]);
        let _: StateReply = user.request(Request::Reset {}).expect("it is stopped");
    };
    let is_there = || UnixStream::connect(&socket).is_ok();
    for lost in [vec![&socket], vec![&socket, &lock]] {
        system_tests::engage(&mut user);
        for path in lost {
            fs::remove_file(path).expect("it was there");
        }
        until("the socket is there again", is_there);
        assert_eq!((status(&mut user).state, mode(&socket)), (RigState::Engaged, 0o600));
        stops(&mut user);
    }
    system_tests::engage(&mut user);
    fs::remove_dir_all(socket.parent().expect("a directory")).expect("it was there");
    until("the directory is there again", is_there);
    stops(&mut user);
    // What somebody else has put there stays, and nobody could stop the rig.
    system_tests::engage(&mut user);
    fs::remove_file(&socket).expect("it was there");
    let other = std::os::unix::net::UnixListener::bind(&socket);
    if other.is_ok() {
        let faulted = wait_for_state(&mut user, RigState::Faulted);
        let fault = faulted.fault.unwrap_or_default();
        assert!(fault.starts_with("control_lost"), "{fault}");
        assert_eq!(faulted.command_force_n, 0.0);
        drop(other);
        assert!(socket.exists(), "it is left alone");
        fs::remove_file(&socket).expect("it was there");
        until("the socket is there again", is_there);
    }
    stops(&mut user);
    assert_eq!(status(&mut user).state, RigState::Idle);
}
