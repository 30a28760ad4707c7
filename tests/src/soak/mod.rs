//! The soak: a daemon in ordinary use for minutes or hours, while one fault after another is brought about in a random
//! order, and what must hold all the while.
//!
//! Its rig is the fake one behind a pseudo-terminal, whose own record of its motor judges the force. It has a client
//! that changes its scene and some that misuse it, a journal that is followed, and recordings that are replayed.

mod faults;
mod health;
mod load;
mod recordings;
mod report;
mod rig;
mod round;

use crate::attack;
use crate::process::{descriptors, signal};
use report::Seen;
use rig::Rig;
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{self, ScopedJoinHandle};
use std::time::{Duration, Instant};

/// Where the report is written.
const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../target/soak");

/// How much longer than asked for the last round of faults may take before the daemon counts as hung.
const OVERTIME: Duration = Duration::from_secs(600);

/// What is asked for on the command line.
#[derive(Clone, Debug, clap::Args)]
pub struct Options {
    /// Length, as in 90s, 2m or 1h; every fault comes at least once, however short it is
    #[arg(long = "for", value_name = "TIME", value_parser = length)]
    pub length: Duration,

    /// Seed of the order of the faults and of the clients' changes [default: another one in every run]
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
}

/// Reads a length: a number with its unit, and not zero.
fn length(text: &str) -> Result<Duration, String> {
    let refused = || "expected a time above zero with its unit, as in 90s, 2m or 1h".to_owned();
    let length: jiff::SignedDuration = text.parse().map_err(|_| refused())?;
    Duration::try_from(length)
        .ok()
        .filter(|length| !length.is_zero())
        .ok_or_else(refused)
}

/// What a soak has shown.
#[derive(Debug)]
pub struct Report {
    /// In Markdown.
    pub markdown: String,
    /// The claims that do not hold, with what was seen.
    pub failed: Vec<String>,
}

/// What every thread of a soak knows.
#[derive(Debug)]
struct Plan {
    seed: u64,
    length: Duration,
    began: Instant,
    /// Where the report and the recordings are.
    folder: PathBuf,
    /// No fault is brought about any more: the clients end.
    over: AtomicBool,
}

impl Plan {
    fn is_over(&self) -> bool {
        self.over.load(Ordering::Relaxed)
    }

    /// Time since it began, s.
    fn time_s(&self) -> f64 {
        self.began.elapsed().as_secs_f64()
    }

    /// A source of random numbers of its own for each user.
    fn random(&self, user: u64) -> fastrand::Rng {
        fastrand::Rng::with_seed(self.seed.wrapping_mul(1_000_003).wrapping_add(user))
    }
}

/// Runs a soak and writes its report, target/soak/report.md.
pub fn run(options: &Options) -> Report {
    let folder = PathBuf::from(FOLDER);
    std::fs::create_dir_all(&folder).expect("a folder for the report");
    let plan = Plan {
        seed: options.seed.unwrap_or_else(|| fastrand::u64(..1_000_000)),
        length: options.length,
        began: Instant::now(),
        folder,
        over: AtomicBool::new(false),
    };
    println!(
        "soak of {:?} with --seed {}; its report comes to {FOLDER}",
        plan.length, plan.seed
    );
    let seen = soak(&plan, Rig::start(plan.seed));
    let report = Report::of(&plan, &seen);
    std::fs::write(plan.folder.join("report.md"), &report.markdown).expect("the report");
    report
}

fn soak(plan: &Plan, mut rig: Rig) -> Seen {
    let (pid, socket) = (rig.daemon.pid(), rig.daemon.socket().to_owned());
    let socket = socket.as_path();
    let descriptors_before = descriptors(pid);
    let mut seen = Seen::default();
    let clients_over = AtomicBool::new(false);
    thread::scope(|scope| {
        let changes = scope.spawn(|| load::change(plan, socket));
        let heard = scope.spawn(|| load::listen(plan, socket));
        let misuse = [attack::HALF_CLOSED, attack::NEVER_READ]
            .map(|attack| (attack.name, scope.spawn(move || attack.run(socket, &plan.over))));
        let recordings = scope.spawn(|| recordings::run(plan, socket));
        let health = scope.spawn(|| health::watch(plan, pid));
        // A daemon that hangs for good would hang its clients too.
        scope.spawn(|| end_a_hung_daemon(plan, pid, &clients_over));
        let driven = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            round::run(plan, &mut rig, &mut seen.occurrences);
        }));
        plan.over.store(true, Ordering::Relaxed);
        let broken = &mut seen.broken;
        if driven.is_err() {
            broken.push("the faults ended in a panic (above)".to_owned());
        }
        for (name, thread) in misuse {
            joined(thread, name, broken);
        }
        seen.revisions = joined(changes, "the client that changes the scene", broken);
        seen.heard = joined(heard, "the client that listens", broken);
        seen.recordings = joined(recordings, "the recordings", broken);
        seen.health = joined(health, "the look at its memory", broken);
        clients_over.store(true, Ordering::Relaxed);
    });
    if seen.broken.is_empty() {
        load::hear_the_rest(&mut seen.heard, &rig.daemon);
    }
    seen.largest_n = [rig.largest_n, rig.largest_at_rest_n];
    // The daemon closes a connection when it has noticed its end.
    let began = Instant::now();
    while descriptors(pid) > descriptors_before && began.elapsed() < crate::PATIENCE {
        crate::pause();
    }
    seen.descriptors_without_clients = [descriptors_before, descriptors(pid)];
    seen
}

fn joined<T: Default>(thread: ScopedJoinHandle<'_, T>, name: &str, broken: &mut Vec<String>) -> T {
    thread.join().unwrap_or_else(|_| {
        broken.push(format!("{name} ended in a panic (above)"));
        T::default()
    })
}

/// Kills a daemon whose soak does not end, so that each client that waits for it fails.
fn end_a_hung_daemon(plan: &Plan, pid: u32, ended: &AtomicBool) {
    let latest = plan.length + OVERTIME;
    while !ended.load(Ordering::Relaxed) {
        if plan.began.elapsed() > latest {
            println!("the soak does not end: daemon {pid} is killed");
            signal(pid, rustix::process::Signal::KILL);
            return;
        }
        thread::sleep(Duration::from_millis(20));
    }
}
