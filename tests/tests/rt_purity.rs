//! The real-time thread of the real daemon, while clients do what they can: facts that no noise of
//! the machine can disturb. They are counted, by the kernel and by the daemon, and not timed.
#![allow(unsafe_code, reason = "ptrace has no safe wrapper")]

use haptic_ipc::{
    ChangeOptions, ChangeReply, Changes, Client, ClientError, ErrorCode, Event, Request, SceneRef, SceneReply,
    StateReply, SubscribeReply, Timing, Topic,
};
use rustix::process::{Pid, Signal, WaitOptions, kill_process, waitpid};
use std::collections::{BTreeMap, BTreeSet};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};
use system_tests::{Daemon, PATIENCE, wait_for};

const PERIOD_NS: i64 = 1_000_000;

const SCENES: [&str; 5] = [
    "simulated-friction",
    "lugre",
    "asymmetric-with-memory",
    "stuck-spring-on-the-device",
    "viscous-drag",
];

fn daemon(scene: &str) -> Daemon {
    let path = format!("{}/../scenes/{scene}.toml", env!("CARGO_MANIFEST_DIR"));
    Daemon::start(&["--scene", &path, "--ramp-ms", "20", "--spin-us", "100"])
}

/// How long the loops are watched altogether.
fn watched() -> Duration {
    Duration::from_secs(test_run::extent(2, 20))
}

/// The real-time thread, as the kernel knows it.
struct RtThread(PathBuf);

#[derive(Debug)]
struct Counters {
    voluntary_switches: u64,
    minor_faults: u64,
    major_faults: u64,
}

impl RtThread {
    fn of(daemon: &Daemon) -> Self {
        std::fs::read_dir(format!("/proc/{}/task", daemon.pid()))
            .expect("it runs")
            .map(|task| task.expect("a thread").path())
            .find(|task| std::fs::read_to_string(task.join("comm")).is_ok_and(|name| name == "rt\n"))
            .map(Self)
            .expect("its real-time thread has a name")
    }

    fn id(&self) -> libc::pid_t {
        let name = self.0.file_name().and_then(|name| name.to_str()).expect("a number");
        name.parse().expect("a number")
    }

    fn counters(&self) -> Counters {
        let read = |name| std::fs::read_to_string(self.0.join(name)).expect("it runs");
        let status = read("status");
        let switches = status
            .lines()
            .find_map(|line| line.strip_prefix("voluntary_ctxt_switches:"));
        let stat = read("stat");
        // After the name, in parentheses, comes the third field; the faults are the tenth and the twelfth.
        let fields: Vec<&str> = stat
            .rsplit(')')
            .next()
            .expect("a name")
            .split_ascii_whitespace()
            .collect();
        let number = |text: &str| text.trim().parse().expect("a number");
        Counters {
            voluntary_switches: number(switches.expect("counted")),
            minor_faults: number(fields[7]),
            major_faults: number(fields[9]),
        }
    }
}

/// A tick, what had been skipped before it, and when it was due.
#[derive(Clone, Copy, Debug)]
struct Moment {
    tick: u64,
    missed: u64,
    due_ns: i64,
}

/// A client that hears of every tick and keeps account.
struct Witness {
    client: Client,
    due_ns: BTreeMap<u64, i64>,
    heard: u64,
    dropped: u64,
}

impl Witness {
    fn new(daemon: &Daemon) -> Self {
        let mut client = daemon.client();
        wait_for(&mut client, "a tick", |status| status.tick > 0);
        let _: SubscribeReply = client
            .request(Request::Subscribe {
                topics: vec![Topic::Samples],
                rate_hz: None,
                batch_ms: None,
            })
            .expect("a subscription");
        Self {
            client,
            due_ns: BTreeMap::new(),
            heard: 0,
            dropped: 0,
        }
    }

    fn listen(&mut self) {
        if let Event::Samples(samples) = self.client.next_event().expect("the daemon serves") {
            self.dropped += samples.dropped;
            for row in &samples.rows {
                self.heard += 1;
                let began_ns = (row.t_s * 1e9).round() as i64;
                let late_ns = i64::try_from(row.wake_latency_ns).expect("less than centuries");
                assert_eq!(
                    self.due_ns.insert(row.tick, began_ns - late_ns),
                    None,
                    "a tick heard twice"
                );
            }
        }
    }

    /// A recent tick of which everything is known.
    fn moment(&mut self) -> Moment {
        let began = Instant::now();
        loop {
            let timing: Timing = self.client.request(Request::Timing {}).expect("the timing");
            let tick = timing.since_start.ticks - 1;
            while self.due_ns.last_key_value().is_none_or(|(newest, _)| *newest < tick) {
                self.listen();
            }
            if let Some(&due_ns) = self.due_ns.get(&tick) {
                return Moment {
                    tick,
                    missed: timing.since_start.missed_periods,
                    due_ns,
                };
            }
            assert!(began.elapsed() < PATIENCE, "every tick asked for was dropped");
        }
    }

    fn check_every_tick_is_heard_or_counted(&self) {
        let (first, last) = (self.due_ns.first_key_value(), self.due_ns.last_key_value());
        let (Some((first, _)), Some((last, _))) = (first, last) else {
            panic!("nothing was heard");
        };
        assert_eq!(
            self.heard + self.dropped,
            last - first + 1,
            "heard and dropped are the ticks"
        );
    }
}

/// Ticks and skipped periods make up the time, to the period.
fn check_grid(from: Moment, to: Moment) {
    let periods = i64::try_from((to.tick - from.tick) + (to.missed - from.missed)).expect("few");
    let elapsed_ns = to.due_ns - from.due_ns;
    // Times come as seconds in floating point.
    assert!(
        (elapsed_ns - periods * PERIOD_NS).abs() <= 2,
        "{elapsed_ns} ns are not {periods} periods: {from:?}, {to:?}"
    );
}

/// A change that takes a while: back a step, or to another law and home again.
fn slowly(name: &str) -> Request {
    let options = ChangeOptions {
        ramp_ms: Some(20.0),
        ..ChangeOptions::default()
    };
    let load = |name: &str| Request::SceneLoad {
        scene: SceneRef::Name(name.to_owned()),
        options,
    };
    match name {
        "mass" => load("viscous-drag"),
        "damping" => load("simulated-friction"),
        _ => Request::Undo { options },
    }
}

/// Clients that do all they can until they are told to end.
struct Load {
    over: AtomicBool,
    /// The loop may be held by a tracer that a busy machine lets wait: then it does not answer in time.
    traced: bool,
    sets: AtomicU64,
    states: AtomicU64,
}

impl Load {
    fn run<T>(daemon: &Daemon, traced: bool, watch: impl FnOnce() -> T) -> T {
        let load = Self {
            over: AtomicBool::new(false),
            traced,
            sets: AtomicU64::new(0),
            states: AtomicU64::new(0),
        };
        // However the watch ends, the clients end with it.
        struct Over<'a>(&'a AtomicBool);
        impl Drop for Over<'_> {
            fn drop(&mut self) {
                self.0.store(true, Ordering::SeqCst);
            }
        }
        let watched = std::thread::scope(|scope| {
            let _over = Over(&load.over);
            scope.spawn(|| load.set(daemon));
            scope.spawn(|| load.command(daemon));
            scope.spawn(|| load.disturb(daemon));
            watch()
        });
        let (sets, states) = (load.sets.into_inner(), load.states.into_inner());
        println!("{sets} scenes set, {states} changes of state");
        assert!(sets > 0 && states > 0, "the clients did nothing");
        watched
    }

    fn goes_on(&self) -> bool {
        !self.over.load(Ordering::SeqCst)
    }

    /// Every parameter of the scene, up and down.
    fn set(&self, daemon: &Daemon) {
        let mut client = daemon.client();
        let before: SceneReply = client.request(Request::get()).expect("the scene");
        let values: Vec<(String, f64)> = before
            .params
            .iter()
            .map(|(name, value)| (name.clone(), value.positive))
            .collect();
        for turn in 0.. {
            for (name, value) in &values {
                if !self.goes_on() {
                    return;
                }
                let factor = if turn % 2 == 0 { 1.1 } else { 0.95 };
                let params: Changes = [(name.as_str(), value * factor)].into_iter().collect();
                // Some values do not go with the others; that is refused, and others follow.
                for change in [Request::set(params), slowly(name)] {
                    if client.request::<ChangeReply>(change).is_ok() {
                        self.sets.fetch_add(1, Ordering::SeqCst);
                    }
                }
            }
        }
    }

    fn command(&self, daemon: &Daemon) {
        let mut client = daemon.client();
        // Until the next reset it is not known whether a command without an answer has been carried out.
        let mut in_step = true;
        while self.goes_on() {
            for request in [
                Request::Reset {},
                Request::engage(),
                Request::Release {},
                Request::engage(),
                Request::Stop {},
            ] {
                let resets = request == Request::Reset {};
                let done: StateReply = match client.request(request) {
                    Ok(done) => done,
                    Err(ClientError::Refused(error))
                        if self.traced && (!in_step || error.code == ErrorCode::NotResponding) =>
                    {
                        in_step = false;
                        continue;
                    }
                    Err(error) => panic!("nobody else commands: {error}"),
                };
                in_step |= resets;
                self.states.fetch_add(1, Ordering::SeqCst);
                // Long enough for a ramp, and for force to flow.
                let until = done.tick + 40;
                wait_for(&mut client, "force", |status| status.tick >= until);
            }
        }
    }

    /// A subscriber that never reads, and clients that come, talk nonsense and go.
    fn disturb(&self, daemon: &Daemon) {
        let mut deaf = daemon.raw();
        deaf.send("{\"id\":1,\"op\":\"subscribe\",\"topics\":[\"samples\",\"state\",\"timing\"]}\n");
        while self.goes_on() {
            let answer = daemon.raw().ask("nonsense");
            assert_eq!(answer["error"]["code"], "bad_json", "{answer}");
        }
    }
}

#[test]
fn loop_sleeps_once_a_tick_and_accounts_for_every_period() {
    let _alone = crate::alone();
    let each = watched() / u32::try_from(SCENES.len()).expect("few");
    for scene in SCENES {
        let daemon = daemon(scene);
        let thread = RtThread::of(&daemon);
        let locked = system_tests::status(&mut daemon.client()).real_time.memory_locked;
        let mut witness = Witness::new(&daemon);
        Load::run(&daemon, false, || {
            // The first scenes and commands touch what no tick has touched before.
            let warm = witness.moment().tick + 300;
            while witness.moment().tick < warm {}
            // Counted after the first tick and before the last: nothing is counted that does not
            // lie between the two.
            let from = witness.moment();
            let before = thread.counters();
            let end = Instant::now() + each;
            while Instant::now() < end {
                witness.listen();
            }
            let after = thread.counters();
            let to = witness.moment();
            println!("{scene}: {from:?} {before:?} to {to:?} {after:?}");
            check_grid(from, to);
            let switches = after.voluntary_switches - before.voluntary_switches;
            assert!(
                switches <= to.tick - from.tick + 1,
                "{scene}: {switches} waits in {} ticks",
                to.tick - from.tick
            );
            if locked {
                assert_eq!(after.minor_faults, before.minor_faults, "{scene}: page faults");
                assert_eq!(after.major_faults, before.major_faults, "{scene}: page faults");
            } else {
                test_run::skip("locked memory", "CAP_IPC_LOCK; page faults were not checked");
            }
        });
        witness.check_every_tick_is_heard_or_counted();
    }
}

#[test]
fn a_stall_is_counted_to_the_period() {
    let _alone = crate::alone();
    let daemon = daemon(SCENES[0]);
    let pid = Pid::from_raw(i32::try_from(daemon.pid()).expect("a process")).expect("not zero");
    let mut witness = Witness::new(&daemon);
    let mut from = witness.moment();
    for stall_ms in [5, 1, 12, 5, 3, 80, 5, 2, 5, 5] {
        kill_process(pid, Signal::STOP).expect("it runs");
        let (_, stopped) = waitpid(Some(pid), WaitOptions::UNTRACED)
            .expect("it is ours")
            .expect("waited");
        assert!(stopped.stopped(), "{stopped:?}");
        let began = Instant::now();
        // The stall itself.
        std::thread::sleep(Duration::from_millis(stall_ms));
        let lasted = began.elapsed();
        kill_process(pid, Signal::CONT).expect("it runs");
        // The answer may come before the late tick, which does not know yet what it cost; the one
        // after it does.
        let known = witness.moment().tick + 3;
        let mut to = witness.moment();
        while to.tick < known {
            to = witness.moment();
        }
        check_grid(from, to);
        // Of the deadlines in the stall the first is only met late.
        let least = lasted.as_millis().saturating_sub(1);
        let missed = u128::from(to.missed - from.missed);
        println!("{lasted:?}: {missed} periods skipped");
        assert!(missed >= least, "{missed} periods skipped in {lasted:?}");
        from = to;
    }
    witness.check_every_tick_is_heard_or_counted();
}

/// A request to ptrace about a thread.
fn ptrace(request: libc::c_uint, thread: libc::pid_t, address: usize, data: usize) -> Result<(), std::io::Error> {
    // SAFETY: the requests used here read no memory of this process, but for the one whose buffer
    // lives where it is made.
    let result = unsafe { libc::ptrace(request, thread, address, data) };
    if result < 0 {
        return Err(std::io::Error::last_os_error());
    }
    Ok(())
}

/// Waits until a traced thread stops; returns why.
fn stopped(thread: libc::pid_t) -> libc::c_int {
    let mut status = 0;
    // SAFETY: a plain system call that writes to `status`.
    assert_eq!(unsafe { libc::waitpid(thread, &raw mut status, libc::__WALL) }, thread);
    assert!(libc::WIFSTOPPED(status), "the thread ended");
    libc::WSTOPSIG(status)
}

#[test]
fn the_loop_makes_no_system_call_but_its_sleep() {
    let _alone = crate::alone();
    const SYSTEM_CALL: libc::c_int = libc::SIGTRAP | 0x80;
    let daemon = daemon("lugre");
    let thread = RtThread::of(&daemon).id();
    let options = usize::try_from(libc::PTRACE_O_TRACESYSGOOD).expect("a flag");
    if let Err(error) = ptrace(libc::PTRACE_SEIZE, thread, 0, options) {
        test_run::skip("ptrace", &format!("CAP_SYS_PTRACE: {error}"));
        return;
    }
    let mut calls = BTreeMap::new();
    Load::run(&daemon, true, || {
        ptrace(libc::PTRACE_INTERRUPT, thread, 0, 0).expect("it is traced");
        // Each call stops the thread twice, and there is one in a millisecond.
        let enough = watched().as_millis() / 4 * 2;
        let mut stops = 0;
        while stops < enough {
            if stopped(thread) == SYSTEM_CALL {
                stops += 1;
                // SAFETY: a structure of numbers, for which zeros are valid.
                let mut info: libc::ptrace_syscall_info = unsafe { std::mem::zeroed() };
                let room = size_of::<libc::ptrace_syscall_info>();
                ptrace(libc::PTRACE_GET_SYSCALL_INFO, thread, room, (&raw mut info) as usize).expect("it is stopped");
                if info.op == libc::PTRACE_SYSCALL_INFO_ENTRY {
                    // SAFETY: at an entry this is the variant that the kernel wrote.
                    *calls.entry(unsafe { info.u.entry.nr }).or_insert(0_u64) += 1;
                }
            }
            ptrace(libc::PTRACE_SYSCALL, thread, 0, 0).expect("it is stopped");
        }
        stopped(thread);
        ptrace(libc::PTRACE_DETACH, thread, 0, 0).expect("it is stopped");
    });
    println!("calls by number: {calls:?}");
    let allowed =
        [libc::SYS_clock_nanosleep, libc::SYS_clock_gettime].map(|call| u64::try_from(call).expect("a number"));
    let made: BTreeSet<u64> = calls.keys().copied().collect();
    assert!(made.contains(&allowed[0]), "it never slept");
    assert!(
        made.iter().all(|call| allowed.contains(call)),
        "it made the calls {made:?}"
    );
}
