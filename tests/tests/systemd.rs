//! The packaged unit under a real systemd as PID 1.

use haptic_ipc::{Request, RigState, SceneSaveReply, StateReply};
use rustix::process::Signal;
use rustix::time::{ClockId, clock_gettime};
use std::collections::HashMap;
use std::fs;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::time::Duration;
use system_tests::pid1::{CONFIGURATION, Machine};
use system_tests::{HeldThread, process, pull_until, status, stderr, timed, wait_for, wait_for_state};

/// A machine on which the unit is up.
fn machine_with_unit(configuration: &str) -> Option<Machine> {
    let machine = Machine::boot(configuration)?;
    // Returns once the unit has reported that it is ready.
    machine.run_ok(&["systemctl", "start", "hapticd"]);
    assert_eq!(machine.property("ActiveState"), "active");
    Some(machine)
}

/// Engages the rig and waits until it pulls.
fn pull(machine: &Machine) {
    let mut client = machine.client();
    pull_until(&mut client, |status| status.command_force_n.abs() > 3.0);
}

/// It is up again, idle, and does not pull.
fn is_back_without_force(machine: &Machine, restarts: u32) {
    machine.wait_for_restart(restarts);
    let mut client = machine.client();
    let began = wait_for(&mut client, "ticks", |status| status.tick > 0);
    let later = wait_for(&mut client, "300 more", |status| status.tick > began.tick + 300);
    for status in [began, later] {
        assert_eq!((status.state, status.command_force_n), (RigState::Idle, 0.0));
    }
}

#[test]
fn the_unit_grants_what_the_loop_needs_and_no_more() {
    let _one = crate::one_of_two();
    let Some(machine) = machine_with_unit("") else { return };
    let daemon = machine.daemon();
    let of_process = fs::read_to_string(format!("/proc/{daemon}/status")).expect("it runs");
    let of_process: HashMap<&str, &str> = of_process
        .lines()
        .filter_map(|line| line.split_once(':'))
        .map(|(name, value)| (name, value.trim()))
        .collect();

    // That what it claims is so, `real_time_claims` shows.
    let client_sees = status(&mut machine.client()).real_time;
    assert!(
        client_sees.fifo_priority == Some(80) && client_sees.memory_locked,
        "{client_sees:?}"
    );
    if machine.path("/dev/cpu_dma_latency").exists() {
        assert!(client_sees.cpus_kept_awake, "{client_sees:?}");
        assert!(client_sees.problems.is_empty(), "{client_sees:?}");
    }

    // Shorter, it would kill the daemon of a machine that wakes up: its devices take seconds.
    assert_eq!(machine.property("WatchdogUSec"), "10s");
    let own = fs::read_to_string(format!("/proc/{daemon}/oom_score_adj")).expect("it runs");
    if machine.raises_limits() {
        assert_eq!(own.trim(), "-900");
    } else {
        println!(
            "NOTE: without CAP_SYS_RESOURCE oom_score_adj cannot be lowered; it is {}",
            own.trim()
        );
    }
    assert!(CONFIGURATION.lines().any(|line| line == "late-policy = \"fault:20\""));

    // The user: a plain one, with nothing beyond what the limits give.
    let user = machine.run_ok(&["id", "-u", "hapticd"]);
    let uids: Vec<&str> = of_process["Uid"].split_whitespace().collect();
    assert_eq!(uids, [user.trim(); 4]);
    assert_ne!(user.trim(), "0");
    if machine.raises_limits() {
        assert_eq!(of_process["CapPrm"], "0000000000000000");
    }
    assert_eq!((of_process["NoNewPrivs"], of_process["Seccomp"]), ("1", "2"));

    let directory = fs::metadata(machine.path("/run/hapticd")).expect("it is made");
    assert_eq!(directory.permissions().mode() & 0o777, 0o750);
    assert_eq!(directory.uid().to_string(), user.trim());

    // What systemd does not understand it skips, with a word on standard error, and still calls the
    // unit good.
    let unit = "/usr/lib/systemd/system/hapticd.service";
    let verify = || {
        let verified = machine.run(&["systemd-analyze", "verify", "--man=no", "--recursive-errors=no", unit]);
        let complaints = stderr(&verified);
        assert!(
            !complaints.contains("hapticd") && verified.status.success(),
            "{complaints}"
        );
    };
    verify();
    // And with the drop-in for one rig.
    let drop_in = machine.path("/etc/systemd/system/hapticd.service.d/rig.conf");
    fs::create_dir_all(drop_in.parent().expect("a folder")).expect("made");
    fs::write(
        &drop_in,
        include_str!("../../packaging/hapticd.service.d/rig.conf.example"),
    )
    .expect("written");
    verify();
    machine.run_ok(&["systemctl", "daemon-reload"]);
    let allowed = machine.property("DeviceAllow");
    assert!(
        allowed.contains("usb-Example_Rig") && !allowed.contains("char-ttyACM"),
        "{allowed}"
    );
    fs::remove_file(&drop_in).expect("it was written");
}

#[test]
fn members_of_the_group_tune_and_all_others_watch_and_stop() {
    let _one = crate::one_of_two();
    const CONTROL: &str = "/run/hapticd/control.sock";
    const WATCH: &str = "/run/hapticd-watch/watch.sock";
    let Some(machine) = machine_with_unit(&format!("watch-socket = \"{WATCH}\"")) else {
        return;
    };
    let nobody = |groups: &str, socket: &str, arguments: &[&str]| {
        let identity = ["setpriv", "--reuid=nobody", "--regid=nogroup", groups];
        let client = ["haptic-ctl", "--socket", socket];
        machine.run(&[&identity, &client[..], arguments].concat()).status.code()
    };
    // The exit codes of haptic-ctl: 0 done, 1 refused, 4 no permission.
    assert_eq!(nobody("--groups=haptic", CONTROL, &["set", "mass=1.5"]), Some(0));
    assert_eq!(nobody("--clear-groups", CONTROL, &["get"]), Some(4));
    assert_eq!(nobody("--clear-groups", WATCH, &["get"]), Some(0));
    assert_eq!(nobody("--clear-groups", WATCH, &["set", "mass=1"]), Some(4));
    assert_eq!(nobody("--clear-groups", WATCH, &["stop"]), Some(0));
    let mut client = machine.client();
    wait_for_state(&mut client, RigState::Stopped);
    let save = Request::SceneSave {
        name: "mine".to_owned(),
        scene: None,
        replace: false,
    };
    let saved: SceneSaveReply = client.request(save).expect("there is room for scenes");
    assert_eq!(saved.path, "/var/lib/hapticd/scenes/mine.toml");
}

/// The time since the machine was booted, ms, as systemd counts it.
fn monotonic_ms() -> u128 {
    let now = clock_gettime(ClockId::Monotonic);
    Duration::try_from(now).expect("since boot").as_millis()
}

/// From `since_ms` until the unit was ready again, ms.
fn away_ms(machine: &Machine, since_ms: u128) -> u128 {
    let ready_us = machine.property("ActiveEnterTimestampMonotonic");
    ready_us.parse::<u128>().expect("a time") / 1000 - since_ms
}

#[test]
fn killed_it_comes_back_idle_and_without_force_in_under_2_s() {
    let _one = crate::one_of_two();
    timed("how soon a unit that was killed is back", killed_it_comes_back);
}

fn killed_it_comes_back() {
    let Some(machine) = machine_with_unit("") else { return };
    pull(&machine);
    let killed = machine.daemon();
    let began_ms = monotonic_ms();
    process::signal(killed, Signal::KILL);
    is_back_without_force(&machine, 1);
    assert_ne!(machine.daemon(), killed);
    let took_ms = away_ms(&machine, began_ms);
    println!("killed while it pulls, the daemon is back, idle, after {took_ms} ms");
    assert!(took_ms < 2000, "{took_ms} ms");
    assert!(machine.journal().contains("status=9/KILL"), "{}", machine.journal());
}

#[test]
fn a_real_time_thread_that_hangs_is_restarted_by_the_watchdog() {
    let _one = crate::one_of_two();
    let Some(machine) = machine_with_unit("") else { return };
    pull(&machine);
    let mut client = machine.client();
    let began_ms = monotonic_ms();
    let held = HeldThread::real_time(machine.daemon());
    let stood = status(&mut client).tick;
    assert_eq!(status(&mut client).tick, stood, "only the control thread goes on");
    machine.eventually("the watchdog", || held.is_killed().then_some(()));
    is_back_without_force(&machine, 1);
    println!(
        "with a loop that hangs, the daemon is killed by the watchdog and back, idle, after {} ms",
        away_ms(&machine, began_ms)
    );
    let count = |what| machine.journal().matches(what).count();
    assert_eq!(count("Watchdog request"), 1, "{}", machine.journal());

    // And so when the whole process stands still, after the manager's own time.
    pull(&machine);
    process::signal(machine.daemon(), Signal::STOP);
    is_back_without_force(&machine, 2);
    assert_eq!(count("Watchdog timeout"), 1, "{}", machine.journal());
}

#[test]
fn a_wrong_configuration_is_not_tried_again() {
    let _one = crate::one_of_two();
    let Some(machine) = Machine::boot("rate = 1") else {
        return;
    };
    assert!(!machine.run(&["systemctl", "start", "hapticd"]).status.success());
    for (property, value) in [("ActiveState", "failed"), ("ExecMainStatus", "2"), ("NRestarts", "0")] {
        assert_eq!(machine.property(property), value, "{property}: {}", machine.journal());
    }
    let journal = machine.journal();
    let lines = journal.lines().filter(|line| line.contains("rate = 1 Hz"));
    let lines: Vec<&str> = lines.collect();
    println!("a wrong configuration: {lines:?}, and no restart");
    assert_eq!(lines.len(), 1, "{journal}");

    // Nor is it taken while the daemon runs.
    let write = |more: &str| {
        let file = machine.path("/etc/hapticd/hapticd.toml");
        fs::write(file, format!("{CONFIGURATION}{more}\n")).expect("written");
    };
    let reload = || machine.run(&["systemctl", "reload", "hapticd"]).status.success();
    write("");
    machine.run_ok(&["systemctl", "reset-failed", "hapticd"]);
    machine.run_ok(&["systemctl", "start", "hapticd"]);
    let daemon = machine.daemon();
    write("force-limit-n = 5000");
    assert!(!reload(), "{}", machine.journal());
    assert_eq!(machine.property("ActiveState"), "active");
    machine.eventually("the refusal in the status", || {
        let status = machine.property("StatusText");
        status.contains("the last reload was refused").then_some(())
    });
    assert!(
        machine.journal().contains("force-limit-n = 5000 N"),
        "{}",
        machine.journal()
    );
    // What can be taken is, while it pulls, by the same process.
    pull(&machine);
    write("force-limit-n = 5.1");
    assert!(reload(), "{}", machine.journal());
    let reloaded = status(&mut machine.client());
    assert_eq!((reloaded.device.force_limit_n, machine.daemon()), (5.1, daemon));
    assert_eq!(reloaded.state, RigState::Engaged, "{}", machine.journal());
    let _: StateReply = machine.client().request(Request::Release {}).expect("it is engaged");
    machine.eventually("the status", || {
        (machine.property("StatusText") == "idle").then_some(())
    });
}

#[test]
fn hardened_unit_serves_metrics_only_with_its_drop_in() {
    let _one = crate::one_of_two();
    let Some(machine) = Machine::boot("metrics = \"127.0.0.1:0\"") else {
        return;
    };
    assert!(!machine.run(&["systemctl", "start", "hapticd"]).status.success());
    let journal = machine.journal();
    assert!(journal.contains("cannot serve metrics on 127.0.0.1:0"), "{journal}");
    assert!(
        journal.contains("install /usr/share/doc/hapticd/examples/metrics.conf"),
        "{journal}"
    );
    assert_eq!(machine.property("NRestarts"), "0", "{journal}");

    let drop_in = machine.path("/etc/systemd/system/hapticd.service.d/metrics.conf");
    fs::create_dir_all(drop_in.parent().expect("a folder")).expect("made");
    let text = include_str!("../../packaging/hapticd.service.d/metrics.conf.example");
    fs::write(&drop_in, text).expect("written");
    machine.run_ok(&["systemctl", "daemon-reload"]);
    machine.run_ok(&["systemctl", "reset-failed", "hapticd"]);
    machine.run_ok(&["systemctl", "start", "hapticd"]);
    let port = machine.eventually("the address", || {
        let journal = machine.journal();
        let (_, address) = journal.rsplit_once("http://127.0.0.1:")?;
        Some(address.split_once('/')?.0.to_owned())
    });
    let ask = "GET /metrics HTTP/1.1\\r\\nHost: rig\\r\\nConnection: close\\r\\n\\r\\n";
    let scrape = format!("exec 3<>/dev/tcp/127.0.0.1/{port}; printf '{ask}' >&3; cat <&3");
    let scraped = machine.run_ok(&["bash", "-c", &scrape]);
    assert!(scraped.contains("hapticd_state{state=\"idle\"} 1"), "{scraped}");
}

// hazard: H18
#[test]
fn system_journal_gives_author_and_urgency_of_a_stop() {
    let _one = crate::one_of_two();
    let Some(machine) = machine_with_unit("") else { return };
    pull(&machine);
    let mut client = machine.client();
    let _: StateReply = client.request(Request::Stop {}).expect("a stop");
    let journal = |least: &str| {
        machine.run_ok(&["journalctl", "--sync"]);
        let read = [
            "journalctl",
            "--no-pager",
            "--output=cat",
            "--unit=hapticd",
            "--priority",
            least,
        ];
        machine.run_ok(&read)
    };
    let warned = machine.eventually("the stop in the journal", || {
        Some(journal("warning")).filter(|journal| journal.contains("stop  "))
    });
    let stop = warned
        .lines()
        .find(|line| line.contains("stop  "))
        .expect("it is there");
    // Its process is one of another namespace and has no name here.
    assert!(stop.contains("root  stop  "), "{stop}");
    assert!(stop.contains("engaged -> stopped  tick "), "{stop}");
    assert!(
        !warned.contains("engage  "),
        "to engage is nothing to be warned of: {warned}"
    );
    let all = journal("info");
    assert!(all.contains("engage  idle -> engaging  tick "), "{all}");
    // By the id of its message, with who did it and in which tick.
    let id = "MESSAGE_ID=ea3655defd275b8483515d962788a55e";
    let found = machine.run_ok(&["journalctl", "--no-pager", "--output=json", id]);
    let found: serde_json::Value = serde_json::from_str(found.lines().last().expect("an entry")).expect("JSON");
    assert_eq!(
        (&found["HAPTICD_OP"], &found["HAPTICD_BY"]),
        (&"stop".into(), &"root".into()),
        "{found}"
    );
    assert!(
        found["HAPTICD_TICK"]
            .as_str()
            .is_some_and(|tick| tick.parse::<u64>().is_ok()),
        "{found}"
    );
}
