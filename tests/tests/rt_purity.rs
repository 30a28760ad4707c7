//! The real-time thread of the real daemon, while clients do what they can: facts that no noise of
//! the machine can disturb. They are counted, by the kernel and by the daemon, and not timed.

use haptic_ipc::{
    ChangeOptions, ChangeReply, Changes, Client, Event, Request, SceneRef, SceneReply, StateReply, Timing, Topic,
};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};
use system_tests::{Daemon, PATIENCE, subscribe, wait_for};

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

/// A client that receives every tick and keeps account.
struct Witness {
    client: Client,
    due_ns: BTreeMap<u64, i64>,
    received: u64,
    dropped: u64,
}

impl Witness {
    fn new(daemon: &Daemon) -> Self {
        let mut client = daemon.client();
        wait_for(&mut client, "a tick", |status| status.tick > 0);
        subscribe(&mut client, &[Topic::Samples]);
        Self {
            client,
            due_ns: BTreeMap::new(),
            received: 0,
            dropped: 0,
        }
    }

    fn listen(&mut self) {
        if let Event::Samples(samples) = self.client.next_event().expect("the daemon serves") {
            self.dropped += samples.dropped;
            for row in &samples.rows {
                self.received += 1;
                let began_ns = (row.t_s * 1e9).round() as i64;
                let late_ns = i64::try_from(row.wake_latency_ns).expect("less than centuries");
                assert_eq!(
                    self.due_ns.insert(row.tick, began_ns - late_ns),
                    None,
                    "a tick received twice"
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

    fn check_every_tick_is_received_or_counted(&self) {
        let (first, last) = (self.due_ns.first_key_value(), self.due_ns.last_key_value());
        let (Some((first, _)), Some((last, _))) = (first, last) else {
            panic!("nothing was received");
        };
        assert_eq!(
            self.received + self.dropped,
            last - first + 1,
            "received and dropped are the ticks"
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
    sets: AtomicU64,
    states: AtomicU64,
}

impl Load {
    fn run(daemon: &Daemon, watch: impl FnOnce()) {
        let load = Self {
            over: AtomicBool::new(false),
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
        std::thread::scope(|scope| {
            let _over = Over(&load.over);
            scope.spawn(|| load.set(daemon));
            scope.spawn(|| load.command(daemon));
            scope.spawn(|| load.disturb(daemon));
            watch();
        });
        let (sets, states) = (load.sets.into_inner(), load.states.into_inner());
        println!("{sets} scenes set, {states} changes of state");
        assert!(sets > 0 && states > 0, "the clients did nothing");
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
        while self.goes_on() {
            for request in [
                Request::Reset {},
                Request::engage(),
                Request::Release {},
                Request::engage(),
                Request::Stop {},
            ] {
                let done: StateReply = client.request(request).expect("nobody else commands");
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
    let each = Duration::from_millis(test_run::extent(400, 4000));
    for scene in SCENES {
        let daemon = daemon(scene);
        let thread = RtThread::of(&daemon);
        let locked = system_tests::status(&mut daemon.client()).real_time.memory_locked;
        let mut witness = Witness::new(&daemon);
        Load::run(&daemon, || {
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
        witness.check_every_tick_is_received_or_counted();
    }
}
