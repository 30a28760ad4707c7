//! What `status` claims of the real-time thread, held against what the kernel says of the process.

use haptic_ipc::{RealTimeStatus, Request, SceneRef};
use rustix::process::Pid;
use std::fs;
use std::os::unix::process::CommandExt;
use std::process::Command;
use system_tests::process::size_kib;
use system_tests::{Daemon, copy_binary, processors, processors_of, real_time_thread, status, until};

const SCHED_OTHER: u32 = 0;
const SCHED_FIFO: u32 = 1;
const SCHED_DEADLINE: u32 = 6;
const NOBODY: u32 = 65_534;

/// A thread, as the kernel has it.
#[derive(Debug)]
struct Thread {
    policy: u32,
    priority: u32,
    cpus: Vec<usize>,
    /// Times that it gave its processor away.
    waits: u32,
    page_faults: u32,
}

impl Thread {
    fn of(daemon: &Daemon, thread: u32) -> Self {
        let read =
            |file: &str| fs::read_to_string(format!("/proc/{}/task/{thread}/{file}", daemon.pid())).expect("it runs");
        let (stat, status) = (read("stat"), read("status"));
        // Its name, the second field, may have spaces in it; faults are the tenth and the twelfth, priority and policy
        // the 40th and 41st.
        let (_, after_name) = stat.rsplit_once(") ").expect("a name");
        let field = |number: usize| {
            after_name
                .split(' ')
                .nth(number - 3)
                .expect("so many")
                .parse()
                .expect("a number")
        };
        let waits = status
            .lines()
            .find_map(|line| line.strip_prefix("voluntary_ctxt_switches:"));
        Self {
            priority: field(40),
            policy: field(41),
            cpus: processors_of(i32::try_from(thread).ok().and_then(Pid::from_raw)),
            waits: waits
                .and_then(|waits| waits.trim().parse().ok())
                .expect("it is counted"),
            page_faults: field(10) + field(12),
        }
    }
}

/// While a client changes scene and state. That a tick makes no system call but its sleep, and allocates nothing, the
/// loop's own tests show.
#[test]
fn the_loop_waits_once_a_tick_and_takes_no_page_fault() {
    let _alone = crate::alone();
    let daemon = Daemon::start(&["--ramp-ms", "20", "--spin-us", "100"]);
    let mut client = daemon.client();
    let mut disturb = |times: u32| {
        for k in 0..times {
            for request in [
                Request::set([("mass", 1.0 + 0.01 * f64::from(k % 90))].into_iter().collect()),
                Request::load(SceneRef::Name("viscous-drag".to_owned())),
                Request::undo(),
                Request::engage(),
                Request::Stop {},
                Request::Reset {},
            ] {
                client
                    .request::<serde_json::Value>(request)
                    .expect("nobody else commands");
            }
        }
        status(&mut client)
    };
    // The first scenes and commands touch what no tick has touched before.
    disturb(50);
    let thread = real_time_thread(daemon.pid());
    let from = disturb(1).tick;
    let before = Thread::of(&daemon, thread);
    let locked = disturb(test_run::extent(50, 500)).real_time.memory_locked;
    let after = Thread::of(&daemon, thread);
    let ticks = disturb(1).tick - from;
    let waits = after.waits - before.waits;
    assert!(u64::from(waits) <= ticks + 1, "{waits} waits in {ticks} ticks");
    if locked {
        assert_eq!(after.page_faults, before.page_faults);
    } else {
        test_run::skip("locked memory", "CAP_IPC_LOCK; page faults were not checked");
    }
}

/// Mappings of a process that may be paged out: readable, its own, and not locked.
fn unlocked(daemon: &Daemon) -> Vec<String> {
    let maps = fs::read_to_string(format!("/proc/{}/smaps", daemon.pid())).expect("it runs");
    let mut unlocked = Vec::new();
    let mut mapping = "";
    for line in maps.lines() {
        let Some(flags) = line.strip_prefix("VmFlags:") else {
            // Sizes are `Name: value`; the line of a mapping begins with its addresses.
            if !line.split(' ').next().unwrap_or_default().ends_with(':') {
                mapping = line;
            }
            continue;
        };
        let has = |flag: &str| flags.split_whitespace().any(|each| each == flag);
        // What the kernel itself puts into every process (vdso, vvar) cannot be paged out and is
        // never marked.
        let kernels = mapping.ends_with(']') && mapping.contains("[v");
        if has("rd") && !has("lo") && !kernels {
            unlocked.push(mapping.to_owned());
        }
    }
    unlocked
}

/// Whether all that is claimed is so, and nothing else.
fn hold_against_the_kernel(daemon: &Daemon, claimed: &RealTimeStatus) {
    let thread = Thread::of(daemon, real_time_thread(daemon.pid()));
    let expected = match (claimed.fifo_priority, claimed.deadline_scheduled) {
        (Some(priority), false) => (SCHED_FIFO, u32::from(priority)),
        (None, true) => (SCHED_DEADLINE, 0),
        (None, false) => (SCHED_OTHER, 0),
        both @ (Some(_), true) => panic!("{both:?}"),
    };
    assert_eq!((thread.policy, thread.priority), expected, "{claimed:?}");
    match claimed.cpu {
        Some(cpu) => assert_eq!(thread.cpus, [cpu], "{claimed:?}"),
        None => assert_ne!(thread.cpus.len(), 0),
    }
    let locked = size_kib(daemon.pid(), "VmLck").expect("it runs");
    if claimed.memory_locked {
        assert!(locked > 1024, "only {locked} KiB are locked: {claimed:?}");
        let unlocked = unlocked(daemon);
        assert!(unlocked.is_empty(), "these may be paged out: {unlocked:#?}");
    } else {
        assert_eq!(locked, 0, "{claimed:?}");
    }
    let holds_latency = fs::read_dir(format!("/proc/{}/fd", daemon.pid()))
        .expect("it runs")
        .filter_map(|descriptor| fs::read_link(descriptor.ok()?.path()).ok())
        .any(|open| open.ends_with("cpu_dma_latency"));
    assert_eq!(holds_latency, claimed.cpus_kept_awake, "{claimed:?}");
    // Whatever it has not got it tells.
    let silent = claimed.problems.is_empty();
    assert!(
        !silent || (claimed.memory_locked && (claimed.fifo_priority.is_some() || claimed.deadline_scheduled)),
        "{claimed:?}"
    );
}

// hazard: P15
#[test]
fn priority_processor_and_locked_memory_are_what_status_claims() {
    let _alone = crate::alone();
    for arguments in [
        &[][..],
        &["--priority", "37"],
        &["--policy", "deadline"],
        &["--cpu", "0"],
    ] {
        let daemon = Daemon::start(arguments);
        // Asked more than once: the memory of clients and histograms comes later than the locking.
        let mut client = daemon.client();
        until("it does not tick", || status(&mut client).tick >= 200);
        let claimed = status(&mut client).real_time;
        println!(
            "{arguments:?}: {}, {}, {}",
            claimed.scheduling(),
            claimed.place(),
            claimed.memory()
        );
        hold_against_the_kernel(&daemon, &claimed);
        if !claimed.memory_locked || (claimed.fifo_priority.is_none() && !claimed.deadline_scheduled) {
            test_run::skip(
                "SCHED_FIFO",
                &format!("only the claim of less was seen: {:?}", claimed.problems),
            );
        }
    }
}

// hazard: P15
#[test]
fn a_daemon_without_privileges_claims_none() {
    let _alone = crate::alone();
    if !rustix::process::geteuid().is_root() {
        test_run::skip("root", "to start it as another user");
        return;
    }
    let directory = tempfile::tempdir().expect("a directory");
    std::os::unix::fs::chown(directory.path(), Some(NOBODY), Some(NOBODY)).expect("root can");
    // The binary may lie where only root can go.
    let copy = directory.path().join("hapticd");
    copy_binary("hapticd", &copy);
    // Of a service, which has them by its unit; a person has them by the limits.
    for (variable, fits) in [
        (("LANG", "C"), ["limits.d", "setfacl"]),
        (("NOTIFY_SOCKET", "/nonexistent"), ["in its unit", "in its unit"]),
    ] {
        let mut command = Command::new("sh");
        command
            .args(["-c", "ulimit -l 64; ulimit -r 0; exec \"$0\" \"$@\""])
            .arg(&copy)
            .args(["--device", "fake"])
            .env(variable.0, variable.1)
            .uid(NOBODY)
            .gid(NOBODY);
        let daemon = Daemon::spawn(command, &directory.path().join("control.sock"));
        let claimed = status(&mut daemon.client()).real_time;
        assert!(
            claimed.fifo_priority.is_none() && !claimed.memory_locked && !claimed.deadline_scheduled,
            "{claimed:?}"
        );
        hold_against_the_kernel(&daemon, &claimed);
        for problem in claimed.problems {
            let remedy = &problem.remedy;
            let is_of_any = ["--cpu", "nothing: this kernel"].iter().any(|any| remedy.contains(any));
            let is_apt = is_of_any || fits.iter().any(|part| remedy.contains(part));
            assert!(is_apt, "{variable:?}: {problem:?}");
        }
    }
}

// hazard: P13
#[test]
fn the_control_thread_keeps_off_the_loops_processor() {
    let _alone = crate::alone();
    if processors().len() < 2 {
        test_run::skip("two processors", "all threads share the one");
        return;
    }
    let daemon = Daemon::start(&[]);
    let mut client = daemon.client();
    let claimed = status(&mut client).real_time;
    let cpu = claimed.cpu.expect("where there are two it takes one");
    let main = Thread::of(&daemon, daemon.pid());
    assert!(
        !main.cpus.contains(&cpu),
        "the control thread may run on {cpu}: {main:?}"
    );
}
