//! How a daemon comes and goes: sockets, configuration, privileges, signals.

use haptic_ipc::{Request, RigState, StateReply};
use rustix::process::Signal;
use std::os::unix::process::CommandExt;
use std::path::Path;
use std::process::{Command, Stdio};
use system_tests::{
    Daemon, be_patient, binary, copy_binary, process, real_time_thread, status, stderr, wait_for, wait_for_state,
};

/// Runs hapticd with arguments with which it cannot run; returns its exit code and its message.
fn refused(arguments: &[&str]) -> (Option<i32>, String) {
    let output = Command::new(binary("hapticd"))
        .args(arguments)
        .stdin(Stdio::null())
        .output()
        .expect("hapticd starts");
    (output.status.code(), stderr(&output))
}

#[test]
fn a_socket_in_use_is_refused_and_a_stale_one_is_replaced() {
    let directory = tempfile::tempdir().expect("a directory");
    let socket = directory.path().join("rig/control.sock");
    let path = socket.to_str().expect("a plain path");
    let first = Daemon::start_at(&socket, &[]);
    let (code, message) = refused(&["--device", "fake", "--socket", path]);
    assert_eq!(code, Some(1), "{message}");
    assert!(message.contains(path) && message.contains("in use"), "{message}");
    assert_eq!(
        status(&mut first.client()).state,
        RigState::Idle,
        "the first is unharmed"
    );

    // Killed, it cannot clean up.
    drop(first);
    assert!(socket.exists());
    let second = Daemon::start_at(&socket, &[]);
    assert_eq!(status(&mut second.client()).state, RigState::Idle);
    let (ended, _) = second.end(Signal::TERM);
    assert!(ended.success());
    let left: Vec<_> = std::fs::read_dir(directory.path().join("rig"))
        .expect("a directory")
        .collect();
    assert!(left.is_empty(), "a daemon that ends in order leaves nothing: {left:?}");

    // Its lock does not reach another's file.
    let lock = directory.path().join("rig/control.sock.lock");
    std::os::unix::fs::symlink(directory.path().join("made"), &lock).expect("a link");
    let (code, message) = refused(&["--device", "fake", "--socket", path]);
    assert_eq!(code, Some(1), "{message}");
    assert!(!directory.path().join("made").exists(), "{message}");
    std::fs::remove_file(&lock).expect("it is ours");

    std::fs::write(&socket, "precious").expect("a file");
    let (code, message) = refused(&["--device", "fake", "--socket", path]);
    assert_eq!(code, Some(1), "{message}");
    assert!(message.contains("not a socket"), "{message}");
    assert_eq!(std::fs::read_to_string(&socket).expect("it is still there"), "precious");
}

// hazard: F19
#[test]
fn every_signal_that_can_end_it_lets_the_force_down_first() {
    // Each whose action is to end a process, but SIGKILL, SIGPIPE, which Rust ignores, and those of a thread's own
    // fault.
    let signals = [
        "HUP", "INT", "QUIT", "USR1", "USR2", "ALRM", "TERM", "STKFLT", "XCPU", "XFSZ", "VTALRM", "PROF", "IO", "PWR",
        "RTMIN", "RTMIN+1", "RTMAX-1", "RTMAX",
    ];
    for signal in signals {
        let daemon = Daemon::start(&["--ramp-ms", "50"]);
        let mut client = daemon.client();
        system_tests::engage(&mut client);
        if signal == "HUP" && std::fs::File::open("/dev/tty").is_err() {
            // To a service it asks for something else.
            continue;
        }
        let (ended, printed) = daemon.end_by(signal);
        assert!(ended.success(), "{signal}: {ended} {printed}");
        assert!(!printed.contains("panic"), "{signal}: {printed}");
        assert!(
            printed.contains("release"),
            "{signal}: it is released along its ramp: {printed}"
        );
    }
}

#[test]
fn what_cannot_be_run_is_refused_by_its_name() {
    let directory = tempfile::tempdir().expect("a directory");
    let file = |name: &str, text: &str| {
        let path = directory.path().join(name);
        std::fs::write(&path, text).expect("written");
        path.to_str().expect("a plain path").to_owned()
    };
    let unknown = file("unknown.toml", "colour = \"red\"\n");
    let heavy = file(
        "heavy.toml",
        &include_str!("../../scenes/simulated-friction.toml").replace("mass = 0.5", "mass = 500"),
    );
    let nan = file(
        "nan.toml",
        &include_str!("../../scenes/simulated-friction.toml").replace("mass = 0.5", "mass = nan"),
    );
    for (arguments, parts) in [
        (vec![], vec!["--device fake", "--demo"]),
        (
            vec!["--device", "fake", "--rate", "50"],
            vec!["rate", "50", "100", "20000", "Hz"],
        ),
        (vec!["--config", &unknown], vec!["unknown.toml", "colour"]),
        (
            vec!["--device", "fake", "--scene", &heavy],
            vec!["heavy.toml", "mass", "500", "100", "kg"],
        ),
        (
            vec!["--device", "fake", "--scene", &nan],
            vec!["nan.toml", "mass", "NaN", "kg"],
        ),
    ] {
        let (code, message) = refused(&arguments);
        assert_eq!(code, Some(2), "{arguments:?}: {message}");
        for part in parts {
            assert!(message.contains(part), "{arguments:?}: {message} lacks {part}");
        }
        assert!(!message.contains("panicked"), "{message}");
    }
}

/// A daemon of a user without rights, on a socket in a directory, with one more variable.
fn without_privileges(directory: &Path, variable: (&str, &str)) -> Daemon {
    let mut command = Command::new(binary("hapticd"));
    if rustix::process::geteuid().is_root() {
        const NOBODY: u32 = 65534;
        std::os::unix::fs::chown(directory, Some(NOBODY), Some(NOBODY)).expect("root can");
        // The binary may lie where only root can go.
        let copy = directory.join("hapticd");
        copy_binary("hapticd", &copy);
        command = Command::new(copy);
        command.uid(NOBODY).gid(NOBODY);
    }
    command.args(["--device", "fake"]).env(variable.0, variable.1);
    Daemon::spawn(command, &directory.join("control.sock"))
}

#[test]
fn advice_on_limits_fits_a_user_or_a_unit() {
    for (variable, fits) in [
        (("LANG", "C"), ["limits.d", "setfacl"]),
        (("NOTIFY_SOCKET", "/nonexistent"), ["in its unit", "in its unit"]),
    ] {
        let directory = tempfile::tempdir().expect("a directory");
        let daemon = without_privileges(directory.path(), variable);
        for problem in status(&mut daemon.client()).real_time.problems {
            let remedy = &problem.remedy;
            let is_of_any = ["--cpu", "nothing: this kernel"].iter().any(|any| remedy.contains(any));
            assert!(
                is_of_any || fits.iter().any(|part| remedy.contains(part)),
                "{variable:?}: {problem:?}"
            );
        }
    }
}

/// The scheduling policy of a thread, as the kernel has it.
fn policy_of(process: u32, thread: u32) -> u32 {
    let text = std::fs::read_to_string(format!("/proc/{process}/task/{thread}/stat")).expect("it runs");
    // Its name, the second field, may have spaces in it; the policy is the 41st.
    let (_, after_name) = text.rsplit_once(") ").expect("a name");
    let policy = after_name.split(' ').nth(41 - 3).expect("so many fields");
    policy.parse().expect("a number")
}

#[test]
fn scheduled_by_deadline_the_loop_renders_or_says_why_it_is_not() {
    const SCHED_DEADLINE: u32 = 6;
    let daemon = Daemon::start(&["--policy", "deadline", "--ramp-ms", "20"]);
    let mut client = daemon.client();
    let real_time = status(&mut client).real_time;
    let policy = policy_of(daemon.pid(), real_time_thread(daemon.pid()));
    assert_eq!(policy == SCHED_DEADLINE, real_time.deadline_scheduled, "{real_time:?}");
    assert!(
        real_time.fifo_priority.is_none() && real_time.cpu.is_none(),
        "{real_time:?}"
    );
    if !real_time.deadline_scheduled {
        let refused = real_time
            .problems
            .iter()
            .find(|problem| problem.what.contains("by deadline"));
        let refused = refused.expect("it says why");
        assert!(refused.remedy.contains("cap_sys_nice"), "{refused:?}");
        test_run::skip("SCHED_DEADLINE", &refused.what);
    }
    let _: StateReply = client.request(Request::engage()).expect("it is idle");
    let engaged = wait_for_state(&mut client, RigState::Engaged);
    let later = wait_for(&mut client, "a second of it", |status| {
        status.tick > engaged.tick + 1000
    });
    assert_eq!(later.state, RigState::Engaged, "{:?}", later.fault);
    let (ended, printed) = daemon.end(Signal::TERM);
    assert!(ended.success(), "{printed}");
}

#[test]
fn a_daemon_that_ends_lets_force_out_and_not_in() {
    // Long enough for all that is tried while it lets the force out.
    let daemon = Daemon::start(&["--ramp-ms", "10000"]);
    let mut client = daemon.client();
    let _: StateReply = client.request(Request::engage()).expect("it is idle");
    wait_for_state(&mut client, RigState::Engaged);
    process::signal(daemon.pid(), Signal::TERM);
    wait_for_state(&mut client, RigState::Releasing);
    let refused = client
        .request::<StateReply>(Request::engage())
        .expect_err("it is ending");
    assert!(refused.to_string().contains("ending"), "{refused}");
    // Whoever comes now can still stop it.
    let stopped: StateReply = daemon.client().request(Request::Stop {}).expect("it still serves");
    assert_eq!(stopped.state, RigState::Stopped);
    let (ended, printed) = daemon.end(Signal::TERM);
    assert!(ended.success(), "{printed}");
}

#[test]
fn a_demo_whose_output_nobody_reads_goes_on_and_ends_in_order() {
    let directory = tempfile::tempdir().expect("a directory");
    let socket = directory.path().join("control.sock");
    let mut command = Command::new(binary("hapticd"));
    be_patient(&mut command);
    let mut demo = command
        .args(["--demo", "--socket"])
        .arg(&socket)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("hapticd starts");
    let mut shown = std::io::BufReader::new(demo.stdout.take().expect("it is piped"));
    let mut line = String::new();
    std::io::BufRead::read_line(&mut shown, &mut line).expect("a status line");
    assert!(line.contains("Hz") && line.contains("overruns"), "{line}");
    drop(shown);
    let mut client = haptic_ipc::Client::connect(&socket).expect("it serves");
    // Long enough for further status lines.
    wait_for(&mut client, "2500 ticks", |status| status.tick > 2500);
    assert_eq!(status(&mut client).state, RigState::Engaged);
    let output = process::end(demo, Signal::INT);
    let message = stderr(&output);
    assert!(output.status.success() && !message.contains("panicked"), "{message}");
}
