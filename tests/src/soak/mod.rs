//! The soak: daemons in ordinary use for minutes or hours, while one fault after another is brought about in a random
//! order, and what must hold all the while.
//!
//! Two daemons run side by side: one on the fake rig behind a pseudo-terminal, whose own record of its motor judges
//! the force, and one on the fake rig in its process. Each has clients that change its scene and clients that misuse
//! it, a journal that is followed, and recordings that are replayed.

mod ending;
mod faults;
mod health;
mod load;
mod plan;
mod pressure;
mod recordings;
mod report;
mod rig;
mod round;

pub use report::{Claim, Report};

use plan::Plan;
use report::Seen;
use rig::{Place, Rig};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// Where the report is written.
pub const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../target/soak");

/// How much longer than asked for the last round of faults may take before the daemons count as hung.
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

/// Runs a soak and writes its report into [`FOLDER`].
///
/// # Errors
/// A signal has asked it to end before its time: the exit code for that. Its daemons have ended.
pub fn run(options: &Options) -> Result<Report, i32> {
    ending::listen();
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
    let rigs = [Place::Link, Place::InProcess].map(|place| Rig::start(place, plan.seed));
    let seen = thread::scope(|scope| {
        let watched: Vec<_> = rigs
            .into_iter()
            .map(|rig| {
                let plan = plan.for_another();
                scope.spawn(move || soak(&plan, rig))
            })
            .collect();
        watched
            .into_iter()
            .map(|watched| watched.join().expect("it catches what fails"))
            .collect::<Vec<Seen>>()
    });
    if let Some(code) = ending::asked() {
        eprintln!("a signal has ended the soak and its daemons: it has no report");
        return Err(code);
    }
    let report = Report::of(&plan, &seen);
    report.write(&plan.folder);
    Ok(report)
}

/// Soaks one daemon.
fn soak(plan: &Plan, mut rig: Rig) -> Seen {
    let quiet = health::Snapshot::of(plan, &rig.daemon);
    let (pid, place) = (rig.daemon.pid(), rig.name());
    let socket = rig.daemon.socket().to_path_buf();
    let user_over = AtomicBool::new(false);
    let mut broken = Vec::new();
    let (occurrences, mut load, recordings, mut health) = thread::scope(|scope| {
        let (socket, user_over) = (&socket, &user_over);
        let load = load::start(scope, plan, place, socket);
        let recordings = scope.spawn(move || recordings::run(plan, place, socket));
        let health = scope.spawn(move || health::watch(plan, pid));
        // A daemon that hangs for good would hang its clients too.
        scope.spawn(move || end_a_hung_daemon(plan, pid, user_over));
        let mut occurrences = Vec::new();
        let driven = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| {
            round::run(plan, &mut rig, &mut occurrences);
        }));
        if driven.is_err() {
            broken.push("the faults ended in a panic (above)".to_owned());
        }
        plan.over.store(true, Ordering::Relaxed);
        let load = load.join(&mut broken);
        let recordings = recordings.join().unwrap_or_else(|_| {
            broken.push("the recordings ended in a panic (above)".to_owned());
            recordings::Checked::default()
        });
        let health = health.join().unwrap_or_else(|_| {
            broken.push("the look at its memory ended in a panic (above)".to_owned());
            health::History::default()
        });
        user_over.store(true, Ordering::Relaxed);
        (occurrences, load, recordings, health)
    });
    if broken.is_empty() && ending::asked().is_none() {
        health.at_the_end(&quiet, plan, &rig.daemon);
        load.check_the_end(&mut rig);
    }
    Seen {
        rig: place,
        occurrences,
        left_out: rig.left_out(),
        load,
        recordings,
        health,
        force: rig.force_record(),
        broken,
    }
}

/// Kills a daemon whose soak does not end, so that each client that waits for it fails.
fn end_a_hung_daemon(plan: &Plan, pid: u32, ended: &AtomicBool) {
    let latest = plan.length + OVERTIME;
    while !ended.load(Ordering::Relaxed) {
        if plan.began.elapsed() > latest {
            println!("the soak does not end: daemon {pid} is killed");
            crate::process::signal(pid, rustix::process::Signal::KILL);
            return;
        }
        thread::sleep(Duration::from_millis(20));
    }
}
