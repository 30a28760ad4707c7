//! `haptic-ctl wait`, and the waiting of `engage` and `release`.

use haptic_ipc::{Client, quoted};
use rustix::process::Signal;
use std::process::Child;
use system_tests::terminal::Terminal;
use system_tests::{Daemon, ctl_command, plain, process, status, stderr, text, until_some, wait_for};

/// Waits in the background; returns when the daemon serves it.
fn waiting(daemon: &Daemon, client: &mut Client, condition: &str) -> Child {
    begun(daemon, client, &["wait", "--timeout", "30s", "--until", condition])
}

/// A subcommand in the background, once the daemon serves it.
fn begun(daemon: &Daemon, client: &mut Client, arguments: &[&str]) -> Child {
    let before = status(client).clients;
    let socket = ["--socket", plain(daemon.socket())];
    let child = daemon.start_ctl(&[arguments, &socket].concat());
    wait_for(client, "the client that waits", |status| status.clients > before);
    child
}

fn ended(child: Child) -> (Option<i32>, String) {
    let output = child.wait_with_output().expect("it ends");
    (output.status.code(), text(&output.stdout) + &stderr(&output))
}

#[test]
fn a_wait_ends_with_what_it_waits_for_or_why_it_cannot() {
    let daemon = Daemon::start(&["--ramp-ms", "10"]);
    let mut client = daemon.client();
    let engaged = waiting(&daemon, &mut client, "state=engaged");
    let heavier = waiting(&daemon, &mut client, "revision>=2 and mass=1.5kg");
    let moving = waiting(&daemon, &mut client, "device_velocity_mps!=0 and state=engaged");
    let stopped = waiting(&daemon, &mut client, "state=stopped");
    let pulled = waiting(&daemon, &mut client, "command_force_N>100N");
    let faulted = waiting(&daemon, &mut client, "state=faulted");
    let light = waiting(&daemon, &mut client, "mass=0.25");
    daemon.ctl_ok(&["engage"]);
    daemon.ctl_ok(&["set", "mass=1.5"]);
    let (code, printed) = ended(engaged);
    assert_eq!(code, Some(0), "{printed}");
    assert!(printed.contains("state=engaged: engaged, revision"), "{printed}");
    assert_eq!(ended(heavier).0, Some(0));
    assert_eq!(ended(moving).0, Some(0));
    daemon.ctl_ok(&["stop"]);
    assert_eq!(ended(stopped).0, Some(0), "a stop is what was waited for");
    for other in [pulled, faulted] {
        let (code, printed) = ended(other);
        assert_eq!(code, Some(6), "{printed}");
        let remedy = format!("--socket {} reset", quoted(daemon.socket()));
        assert!(
            printed.contains("the rig is stopped") && printed.contains(&remedy),
            "{printed}"
        );
    }
    // Also where the rig is stopped already.
    let late = ["wait", "--until", "command_force_N<-1"];
    daemon.ctl_refused(&late, 6, "the rig is stopped");
    // A stopped rig can still get a lighter block.
    daemon.ctl_ok(&["set", "mass=0.25"]);
    assert_eq!(ended(light).0, Some(0));
    daemon.ctl_ok(&["reset"]);
    wait_for(&mut client, "the end of the others", |status| status.clients == 1);
    let engaged = waiting(&daemon, &mut client, "state=engaged");
    let late = ["wait", "--until", "state=engaged", "--timeout", "1s"];
    daemon.ctl_refused(&late, 5, "within 1 s; the rig is idle");
    drop(daemon);
    assert_eq!(ended(engaged).0, Some(3));
}

// hazard: H4
#[test]
fn whoever_waits_on_a_hung_daemon_is_told() {
    let daemon = Daemon::start(&[]);
    let mut client = daemon.client();
    // First, so that it has all that it asked for when the daemon hangs.
    let within = ["wait", "--until", "state=engaged", "--timeout", "3s"];
    let briefly = begun(&daemon, &mut client, &within);
    let forever = [
        begun(&daemon, &mut client, &["wait", "--until", "state=engaged"]),
        begun(&daemon, &mut client, &["log", "--follow"]),
    ];
    process::signal(daemon.pid(), Signal::STOP);
    let (code, said) = ended(briefly);
    assert_eq!(code, Some(5), "{said}");
    // A busy machine may have it ask when nobody answers any more.
    let is_told = said.contains("within 3 s; the daemon does not answer: if the motor pulls")
        || said.contains("has not answered");
    assert!(is_told, "{said}");
    for mut child in forever {
        until_some("it waits on", || child.try_wait().expect("it is ours"));
        let (code, said) = ended(child);
        assert!(code == Some(5) && said.contains("has not answered"), "{code:?} {said}");
    }
    process::signal(daemon.pid(), Signal::CONT);
}

#[test]
fn engage_and_release_wait_for_the_end_of_their_ramps() {
    // Long enough that none is over before haptic-ctl waits for its end.
    let daemon = Daemon::start(&["--ramp-ms", "1000"]);
    assert!(daemon.ctl_ok(&["engage", "--wait"]).starts_with("engaged at tick"));
    assert!(daemon.ctl_ok(&["release", "--wait"]).starts_with("idle at tick"));
    daemon.ctl_refused(&["engage", "--wait", "--timeout", "1ms"], 5, "");
    daemon.ctl_ok(&["stop"]);
    daemon.ctl_refused(&["engage", "--wait"], 6, "");
}

#[test]
fn whoever_waits_at_a_terminal_sees_for_what() {
    let daemon = Daemon::start(&[]);
    let wait = ["wait", "--until", "mass=1.5"];
    let mut terminal = Terminal::start(ctl_command(daemon.socket(), &wait));
    terminal.wait_for("what is waited for", |screen| screen.contains("waiting for mass=1.5"));
    daemon.ctl_ok(&["set", "mass=1.5"]);
    terminal.wait_for("the end", |screen| {
        screen.contains("mass=1.5: idle, revision 2") && !screen.contains("waiting for")
    });
}
