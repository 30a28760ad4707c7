//! How well the real-time thread keeps time: against cyclictest, against a bare loop, and against
//! itself while clients do what they can.
//!
//! ```sh
//! cargo bench -p system-tests --bench realtime            # all but the hour, some ten minutes
//! cargo bench -p system-tests --bench realtime -- wake    # a part: wake, tick, rates, clients, panel, recording, memory=MINUTES
//! ```
//!
//! What is compared runs in turns on the same processor at the same priority, five turns of ten
//! seconds each, and the medians of the turns stand side by side: a turn in which the host took the
//! processor away does not decide. The rest of the machine should be quiet.

use haptic_ipc::{ChangeReply, Changes, Request, TimingWindow};
use rustix::process::Signal;
use std::fs;
use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::{Duration, Instant};
use system_tests::measure::{TURN_S, TURNS, last_turn, median, turn, us};
use system_tests::process::{end, size_kib};
use system_tests::screen::Screen;
use system_tests::{Daemon, binary, engage, processors, wait_for};

/// Turns against cyclictest: here the machine's mood changes faster than the turns.
const WAKE_TURNS: usize = 9;

fn main() {
    // Cargo adds `--bench`.
    let named: Vec<String> = std::env::args().skip(1).filter(|name| name != "--bench").collect();
    let wanted = |part: &str| named.is_empty() || named.iter().any(|name| name == part);
    let parts: [(&str, fn()); 6] = [
        ("wake", wake),
        ("tick", tick),
        ("rates", rates),
        ("clients", clients),
        ("panel", panel),
        ("recording", recording),
    ];
    for (name, run) in parts {
        if wanted(name) {
            run();
        }
    }
    for minutes in named.iter().filter_map(|name| name.strip_prefix("memory=")) {
        memory(minutes.parse().expect("minutes"));
    }
}

/// The last processor, which hapticd takes by default, for cyclictest as well.
fn processor() -> usize {
    *processors().last().expect("at least one")
}

/// A column of the table: a name, and p50, p99, p99.9 and the longest of each turn, us.
type Column<'a> = (&'a str, Vec<[f64; 4]>);

fn table(title: &str, columns: &[Column<'_>]) {
    println!("\n## {title}\n");
    print!("| us, medians of {} turns |", columns[0].1.len());
    for (name, _) in columns {
        print!(" {name} |");
    }
    println!("\n|---|{}", "---|".repeat(columns.len()));
    for (row, name) in ["p50", "p99", "p99.9", "max"].into_iter().enumerate() {
        print!("| {name} |");
        for (_, turns) in columns {
            print!(" {:.2} |", median(turns.iter().map(|turn| turn[row]).collect()));
        }
        println!();
    }
}

fn ratio_of(ours: &[[f64; 4]], theirs: &[[f64; 4]]) -> String {
    let of = |row: usize| [ours, theirs].map(|turns| median(turns.iter().map(|turn| turn[row]).collect()));
    let [[ours_p50, theirs_p50], [ours_p99, theirs_p99]] = [of(0), of(1)];
    format!("p50 x {:.3}, p99 x {:.3}", ours_p50 / theirs_p50, ours_p99 / theirs_p99)
}

fn row(percentiles: haptic_ipc::Percentiles) -> [f64; 4] {
    [percentiles.p50, percentiles.p99, percentiles.p999, percentiles.max].map(us)
}

/// A turn of a daemon that nobody asks for anything.
fn turn_of_daemon(arguments: &[&str]) -> TimingWindow {
    let daemon = Daemon::start(arguments);
    turn(&mut daemon.client())
}

/// A turn of cyclictest: wake-up latencies, us.
fn turn_of_cyclictest() -> [f64; 4] {
    let directory = tempfile::tempdir().expect("a directory");
    let json = directory.path().join("cyclictest.json");
    let done = Command::new("cyclictest")
        .args(["-m", "-q", "-N", "-p", "80", "-i", "1000", "-h", "900000"])
        .args([
            "-a",
            &processor().to_string(),
            "-D",
            &TURN_S.to_string(),
            &format!("--json={}", json.display()),
        ])
        .stdout(Stdio::null())
        .status()
        .expect("cyclictest starts");
    assert!(done.success());
    let report: serde_json::Value =
        serde_json::from_slice(&fs::read(json).expect("it writes its histogram")).expect("JSON");
    let thread = &report["thread"]["0"];
    let mut histogram: Vec<(u64, u64)> = thread["histogram"]
        .as_object()
        .expect("a histogram")
        .iter()
        .map(|(ns, count)| (ns.parse().expect("ns"), count.as_u64().expect("a count")))
        .collect();
    histogram.sort_unstable();
    let cycles = thread["cycles"].as_u64().expect("a count");
    let longest = thread["max"].as_u64().expect("ns");
    let at = |share: f64| {
        #[expect(
            clippy::cast_precision_loss,
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a count"
        )]
        let wanted = (cycles as f64 * share).ceil() as u64;
        let mut seen = 0;
        histogram
            .iter()
            .find_map(|(ns, count)| {
                seen += count;
                (seen >= wanted).then_some(*ns)
            })
            // What is longer than the histogram reaches is not in it.
            .unwrap_or(longest)
    };
    [at(0.5), at(0.99), at(0.999), longest].map(us)
}

/// Wake-up latency against cyclictest, with and without the spin tail.
fn wake() {
    if !test_run::is_there("cyclictest") {
        println!("SKIPPED: wake: cyclictest is missing (Debian: apt install rt-tests)");
        return;
    }
    let (mut theirs, mut plain, mut spinning) = (vec![], vec![], vec![]);
    for _ in 0..WAKE_TURNS {
        theirs.push(turn_of_cyclictest());
        plain.push(row(turn_of_daemon(&["--spin-us", "0"]).wake_latency_ns));
        spinning.push(row(turn_of_daemon(&[]).wake_latency_ns));
    }
    let ratio = ratio_of(&plain, &theirs);
    println!("hapticd without spin tail against cyclictest: {ratio}");
    table(
        "Wake-up latency at 1 kHz",
        &[
            ("cyclictest", theirs),
            ("hapticd, --spin-us 0", plain),
            ("hapticd, spin tail", spinning),
        ],
    );
}

/// Changes the scene until it is told to end; returns how often.
fn change_scene(daemon: &Daemon, over: &AtomicBool, pause: Duration) -> u64 {
    let mut client = daemon.client();
    let began = Instant::now();
    let mut sets = 0;
    while !over.load(Ordering::SeqCst) {
        let mass = if sets % 2 == 0 { 0.5 } else { 0.6 };
        let params: Changes = [("M", mass)].into_iter().collect();
        let _: ChangeReply = client.request(Request::set(params)).expect("a valid change");
        sets += 1;
        // By the clock, so that answers that take long do not make for fewer changes.
        let due = began + pause * u32::try_from(sets).expect("few");
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
    }
    sets
}

/// What a tick takes, the fake rig included, while it renders and its scene changes 50 times a second.
fn tick() {
    let turns = (0..TURNS).map(|_| {
        let daemon = engaged();
        let over = AtomicBool::new(false);
        std::thread::scope(|scope| {
            scope.spawn(|| change_scene(&daemon, &over, Duration::from_millis(20)));
            let turn = turn(&mut daemon.client());
            over.store(true, Ordering::SeqCst);
            row(turn.tick_ns)
        })
    });
    table(
        "Whole tick, fake rig included, in the running loop, on the paper's scene with 50 changes of it a second",
        &[("tick", turns.collect())],
    );
}

/// Missed periods beside a bare loop's.
fn rates() {
    for rate in ["1000", "4000", "10000", "20000"] {
        println!("\n## {rate} Hz\n");
        let output = Command::new(binary("hapticd"))
            .args([&format!("--self-test={TURN_S}"), "--rate", rate])
            .output()
            .expect("hapticd starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        println!("```text\n{}```", String::from_utf8_lossy(&output.stdout));
    }
}

fn engaged() -> Daemon {
    let daemon = Daemon::start(&[]);
    engage(&mut daemon.client());
    daemon
}

const CLIENTS: usize = 32;

/// What 31 subscribers of every tick and one client that makes 100 changes a second do to the loop,
/// against the same daemon left alone.
fn clients() {
    let daemon = engaged();
    let (mut idle, mut busy) = (vec![], vec![]);
    let (mut sets, mut received) = (0, 0);
    for _ in 0..TURNS {
        idle.push(turn(&mut daemon.client()));
        let (over, bytes) = (AtomicBool::new(false), AtomicU64::new(0));
        std::thread::scope(|scope| {
            for _ in 0..CLIENTS - 1 {
                scope.spawn(|| bytes.fetch_add(swallow(daemon.socket(), &over), Ordering::SeqCst));
            }
            let setting = scope.spawn(|| change_scene(&daemon, &over, Duration::from_millis(10)));
            std::thread::sleep(Duration::from_secs(TURN_S));
            over.store(true, Ordering::SeqCst);
            sets += setting.join().expect("it sets");
        });
        // All places were taken until now.
        busy.push(last_turn(&mut daemon.client()));
        received += bytes.into_inner();
    }
    println!(
        "\n{CLIENTS} clients: {sets} changes in {} s, {} MB received",
        TURNS as u64 * TURN_S,
        received / 1_000_000
    );
    beside("with clients", &idle, &busy);
}

/// What the panel, open on a screen and drawing, does to the loop of the daemon that it watches.
fn panel() {
    let Some(screen) = Screen::open() else {
        return;
    };
    let daemon = engaged();
    let (mut idle, mut busy) = (vec![], vec![]);
    for _ in 0..TURNS {
        idle.push(turn(&mut daemon.client()));
        let panel = screen.panel(daemon.socket(), &[]);
        // What it takes to come up is not of interest.
        wait_for(&mut daemon.client(), "the panel", |status| status.clients == 3);
        let second = Duration::from_secs(1);
        std::thread::sleep(second);
        busy.push(turn(&mut daemon.client()));
        drop(panel);
    }
    beside("with the panel", &idle, &busy);
}

/// What a recording of every tick does to the loop, in each format.
fn recording() {
    let daemon = engaged();
    let directory = tempfile::tempdir().expect("a directory");
    for ending in ["mcap", "csv", "parquet"] {
        let (mut idle, mut busy) = (vec![], vec![]);
        for number in 0..TURNS {
            idle.push(turn(&mut daemon.client()));
            let recorder = daemon.recorder(&directory.path().join(format!("{number}.{ending}")), &[]);
            wait_for(&mut daemon.client(), "the recorder", |status| status.clients == 2);
            busy.push(turn(&mut daemon.client()));
            assert!(end(recorder, Signal::INT).status.success());
        }
        beside(&format!("recording to {ending}"), &idle, &busy);
    }
}

/// The loop left alone beside the loop with somebody at work.
fn beside(who: &str, idle: &[TimingWindow], busy: &[TimingWindow]) {
    let show = |what: &str, of: fn(&TimingWindow) -> [f64; 4]| {
        let [idle, busy] = [idle, busy].map(|turns| turns.iter().map(of).collect::<Vec<_>>());
        let ratio = ratio_of(&busy, &idle);
        table(&format!("{what}, {who}"), &[("left alone", idle), (who, busy)]);
        println!("\n{who} against left alone: {ratio}");
    };
    show("Wake-up latency", |turn| row(turn.wake_latency_ns));
    show("Tick, fake rig included", |turn| row(turn.tick_ns));
    let count = |what: &str, of: fn(&TimingWindow) -> u64| {
        let [idle, busy] = [idle, busy].map(|turns| turns.iter().map(of).sum::<u64>());
        println!("{what}: {idle} left alone, {busy} {who}");
    };
    count("periods missed", |turn| turn.missed_periods);
    count("overruns", |turn| turn.overruns);
}

/// Reads whatever a subscriber is sent; returns how many bytes.
fn swallow(socket: &Path, over: &AtomicBool) -> u64 {
    let mut stream = std::os::unix::net::UnixStream::connect(socket).expect("the daemon serves");
    let line = serde_json::json!({ "id": 1, "op": "subscribe", "topics": ["state", "timing", "samples"] });
    std::io::Write::write_all(&mut stream, format!("{line}\n").as_bytes()).expect("the daemon reads");
    let (mut buffer, mut bytes) = (vec![0; 1 << 16], 0);
    while !over.load(Ordering::SeqCst) {
        bytes += stream.read(&mut buffer).expect("the daemon writes") as u64;
    }
    bytes
}

/// Resident memory over many minutes, with a subscriber of every tick and ten changes a second.
fn memory(minutes: u64) {
    let daemon = engaged();
    let over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| change_scene(&daemon, &over, Duration::from_millis(100)));
        scope.spawn(|| swallow(daemon.socket(), &over));
        println!("\n## Resident memory, with a subscriber of every tick and ten changes a second\n");
        for minute in 0..=minutes {
            println!(
                "{minute:4} min {} kB",
                size_kib(daemon.pid(), "VmRSS").expect("it runs")
            );
            if minute < minutes {
                // What is measured is the passing of time.
                std::thread::sleep(Duration::from_secs(60));
            }
        }
        over.store(true, Ordering::SeqCst);
    });
}
