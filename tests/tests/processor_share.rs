//! Two daemons whose loops are on one processor know of each other, and say so.

use haptic_ipc::{Client, Request, Status, Timing};
use rustix::process::Signal;
use system_tests::{Daemon, status, text, wait_for};

/// A processor that this process may use: the first, as daemons take the last one by themselves.
fn processor() -> String {
    let status = std::fs::read_to_string("/proc/self/status").expect("it is there");
    let allowed = status.lines().find_map(|line| line.strip_prefix("Cpus_allowed_list:"));
    let allowed = allowed.expect("the kernel says it").trim();
    let first: String = allowed.chars().take_while(char::is_ascii_digit).collect();
    assert!(!first.is_empty(), "{allowed}");
    first
}

fn reports_sharing(status: &Status) -> bool {
    status
        .real_time
        .problems
        .iter()
        .any(|problem| problem.what.contains("too: each can delay the other's ticks"))
}

fn pinned(client: &mut Client, cpu: &str) -> bool {
    status(client).real_time.cpu.map(|cpu| cpu.to_string()).as_deref() == Some(cpu)
}

// hazard: H11
#[test]
fn two_daemons_on_one_processor_say_so_while_both_are_there() {
    let _alone = crate::alone();
    let cpu = processor();
    let first = Daemon::start(&["--cpu", &cpu]);
    let mut client = first.client();
    if !pinned(&mut client, &cpu) {
        test_run::skip("SCHED_FIFO", "a loop pinned to a processor: ulimit -r, or CAP_SYS_NICE");
        return;
    }
    // Another test's daemon may be about to end.
    wait_for(&mut client, "a processor of its own", |status| !reports_sharing(status));

    let second = Daemon::start(&["--cpu", &cpu]);
    // The first learns it from its own status, though it began alone.
    wait_for(&mut client, "the second daemon", reports_sharing);
    wait_for(&mut second.client(), "the first daemon", reports_sharing);
    for daemon in [&first, &second] {
        let doctor = daemon.ctl(&["doctor"]);
        let found = text(&doctor.stdout);
        assert!(found.contains(&format!("on processor {cpu} too")), "{found}");
        assert!(found.contains("with --cpu"), "it says what helps: {found}");
    }
    let ticks = |client: &mut Client| -> Timing { client.request(Request::Timing {}).expect("timing") };
    let (here, there) = (ticks(&mut client), ticks(&mut second.client()));
    println!(
        "wake-up of the first {:?}, of the second {:?}",
        here.last_10_s.wake_latency_ns, there.last_10_s.wake_latency_ns
    );

    // However it ends, its share goes with it.
    let (ended, printed) = second.end(Signal::KILL);
    assert!(!ended.success());
    assert!(
        printed.contains(&format!("on processor {cpu} too")),
        "it says so as it starts: {printed}"
    );
    wait_for(&mut client, "a processor of its own again", |status| {
        !reports_sharing(status)
    });
}
