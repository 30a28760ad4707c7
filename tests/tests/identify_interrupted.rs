//! A motion of an identification that the link interrupts: the motor lets go, and what comes then is what the person at
//! the terminal has agreed to.

use haptic_ipc::RigState;
use system_tests::commissioning::daemon;
use system_tests::fake_rig::FakeRig;
use system_tests::terminal::Terminal;
use system_tests::{Daemon, ctl_command, status, timed, until};

/// How old a sample may be; and a device that stands still for longer, and for less than the pause before a motion is
/// repeated.
const STALE: [&str; 3] = ["--uncommissioned", "--stale-ms", "300"];
const INTERRUPTION: &str = "stall 0.45";

/// What is asked where a motion is not repeated by itself.
const QUESTION: &str = "repeat the chirp?";

/// `haptic-ctl identify --run` on a terminal, with a chirp that outlasts the test; the person has agreed to the motion.
fn identifying(daemon: &Daemon) -> Terminal {
    let run = ["identify", "--run", "--range-mm=100", "--chirp-s=60", "--resets=1"];
    let mut terminal = Terminal::start(ctl_command(daemon.socket(), &run));
    terminal.wait_for("the first question", |shown| shown.contains("Go on?"));
    terminal.type_in("y\n");
    terminal
}

/// Waits until the motor pulls.
fn pulls(rig: &mut FakeRig, terminal: &mut Terminal) {
    until("no force", || {
        // A program whose terminal nobody reads waits.
        terminal.read();
        rig.force().now_n.abs() >= 0.3
    });
}

/// Waits until the motor has let go: a device that stands still does so once it goes on.
fn lets_go(rig: &mut FakeRig) {
    until("the force stays", || rig.force().now_n == 0.0);
}

/// Whether what is shown ends with the question.
fn question(shown: &str) -> bool {
    shown.trim_end().ends_with(&format!("{QUESTION} [y/N]"))
}

// hazard: F20
#[test]
fn motion_repeats_as_often_as_agreed_then_needs_consent() {
    timed("a motion that the link interrupts", || {
        let mut rig = FakeRig::start(&["--hand", "free"]);
        let (daemon, mut client) = daemon(&rig, &STALE);
        let mut terminal = identifying(&daemon);
        pulls(&mut rig, &mut terminal);
        rig.fail(INTERRUPTION);
        // Once by itself: nobody types.
        terminal.wait_for("the announcement", |shown| shown.contains("In 3 s the rig is reset"));
        lets_go(&mut rig);
        pulls(&mut rig, &mut terminal);
        rig.fail(INTERRUPTION);
        // No further time: nothing moves before a yes.
        terminal.wait_for("the question", question);
        lets_go(&mut rig);
        assert_eq!(status(&mut client).state, RigState::Faulted);
        terminal.type_in("y\n");
        terminal.wait_for("the answer on the screen", |shown| !question(shown));
        pulls(&mut rig, &mut terminal);
        let written = terminal.written();
        assert_eq!(written.matches("In 3 s the rig is reset").count(), 1, "{written}");
        assert!(written.contains(QUESTION), "{written}");
    });
}
