//! How fast the control plane is, and that nobody on its socket slows the loop.
//!
//! ```sh
//! cargo bench -p system-tests --bench control               # all, some forty minutes
//! cargo bench -p system-tests --bench control -- attacks    # a part: set, get, stream, subscribers, attacks, stops
//! HAPTICD_STOPS=50 cargo bench -p system-tests --bench control -- stops    # 50 stops a row in
//! place of 1000, to see whether it works
//! ```

mod stops;

use haptic_ipc::{ChangeReply, Changes, Event, Request, SceneReply, ServerLine, TimingWindow, Topic};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use system_tests::attack::{self, Attack};
use system_tests::measure::{TURN_S, TURNS, median, percentile, turn, us};
use system_tests::process::processor_time_s;
use system_tests::{Daemon, engage, status, subscribe};

fn main() {
    // Cargo adds `--bench`.
    let named: Vec<String> = std::env::args().skip(1).filter(|name| name != "--bench").collect();
    let parts: [(&str, fn()); 6] = [
        ("set", set),
        ("get", get),
        ("stream", stream),
        ("subscribers", subscribers),
        ("attacks", attacks),
        ("stops", stops::stops),
    ];
    for (name, run) in parts {
        if named.is_empty() || named.iter().any(|wanted| wanted == name) {
            run();
        }
    }
}

fn ns(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).expect("short")
}

fn engaged() -> Daemon {
    let daemon = Daemon::start(&[]);
    engage(&mut daemon.client());
    daemon
}

fn change(turn: u64) -> Request {
    // The first differs from the active value: setting that would be a no-op.
    let mass = if turn.is_multiple_of(2) { 0.6 } else { 0.5 };
    Request::set([("M", mass)].into_iter().collect::<Changes>())
}

/// Prints a distribution of times.
fn times(what: &str, mut times_ns: Vec<u64>) {
    times_ns.sort_unstable();
    let [p50, p99, p999, longest] = [500, 990, 999, 1000].map(|per_mille| us(percentile(&times_ns, per_mille)));
    println!(
        "{what}: {p50:.0} us (p50), {p99:.0} us (p99), {p999:.0} us (p99.9), {longest:.0} us (longest) of {}",
        times_ns.len()
    );
}

/// From a change being sent to the tick that renders it, and to its answer.
fn set() {
    let daemon = engaged();
    let (mut client, mut ticks, mut took) = (daemon.client(), vec![], vec![]);
    for turn in 0..5000 {
        let before = status(&mut client).tick;
        let asked = Instant::now();
        let reply: ChangeReply = client.request(change(turn)).expect("a valid change");
        took.push(ns(asked.elapsed()));
        ticks.push(reply.tick.expect("it was applied") - before);
    }
    ticks.sort_unstable();
    println!("\n## set, one after the other\n");
    println!(
        "from the newest tick known to the tick that renders it: {} (p50), {} (p99), {} (most) ticks",
        percentile(&ticks, 500),
        percentile(&ticks, 990),
        percentile(&ticks, 1000)
    );
    times("to its answer", took);
}

/// The round trip of the smallest useful request, in a line of 64 bytes.
fn get() {
    const LINE_BYTES: usize = 64;
    let daemon = engaged();
    let mut raw = daemon.raw();
    let mut line = r#"{"id":1,"op":"get"}"#.to_owned();
    line.push_str(&" ".repeat(LINE_BYTES - 1 - line.len()));
    let took = (0..20_000)
        .map(|_| {
            let asked = Instant::now();
            let answer = raw.ask(&line);
            let took = ns(asked.elapsed());
            assert_eq!(answer["id"], 1);
            took
        })
        .collect();
    println!("\n## get, a request of {LINE_BYTES} bytes\n");
    times("round trip", took);
}

/// 1000 changes a second from one client, which does not wait for the answers; none may be lost.
fn stream() {
    const CHANGES: u64 = 10_000;
    let daemon = engaged();
    let mut asker = daemon.client();
    let first: SceneReply = asker.request(Request::get()).expect("the scene");
    let (mut sender, mut receiver) = daemon.client().split();
    let began = Instant::now();
    let due = move |turn: u64| began + Duration::from_millis(turn);
    let took: Vec<u64> = std::thread::scope(|scope| {
        scope.spawn(move || {
            for turn in 0..CHANGES {
                std::thread::sleep(due(turn).saturating_duration_since(Instant::now()));
                sender.send(change(turn)).expect("the daemon reads");
            }
        });
        let mut revisions = first.revision..;
        revisions.next();
        (0..CHANGES)
            .map(|turn| {
                let ServerLine::Answer { result, .. } = receiver.receive().expect("the daemon answers") else {
                    panic!("nothing else was asked for");
                };
                let took = due(turn).elapsed();
                let reply: ChangeReply = serde_json::from_value(result.expect("a valid change")).expect("a change");
                assert_eq!(Some(reply.revision), revisions.next(), "one of them is lost");
                assert!(reply.tick.is_some());
                ns(took)
            })
            .collect()
    });
    let after: SceneReply = asker.request(Request::get()).expect("the scene");
    println!("\n## 1000 changes a second from one client, pipelined\n");
    println!(
        "{CHANGES} sent and answered in {:.2} s; the revision went from {} to {}",
        began.elapsed().as_secs_f64(),
        first.revision,
        after.revision
    );
    times("from when it was due to its answer", took);
}

/// 16 subscribers of every tick at 1 kHz: rows received and lost.
fn subscribers() {
    const SUBSCRIBERS: usize = 16;
    const TIME: Duration = Duration::from_secs(10);
    let daemon = engaged();
    let (began, before) = (Instant::now(), processor_time_s(daemon.pid()));
    let counted: Vec<(u64, u64, u64)> = std::thread::scope(|scope| {
        let each: Vec<_> = (0..SUBSCRIBERS)
            .map(|_| {
                scope.spawn(|| {
                    let mut client = daemon.client();
                    subscribe(&mut client, &[Topic::Samples]);
                    let (mut rows, mut dropped, mut gaps, mut next) = (0, 0, 0, None);
                    while began.elapsed() < TIME {
                        let Event::Samples(batch) = client.next_event().expect("the daemon serves") else {
                            continue;
                        };
                        dropped += batch.dropped;
                        for row in batch.rows {
                            gaps += u64::from(next.is_some_and(|next| next != row.tick));
                            next = Some(row.tick + 1);
                            rows += 1;
                        }
                    }
                    (rows, dropped, gaps)
                })
            })
            .collect();
        each.into_iter().map(|one| one.join().expect("it listens")).collect()
    });
    let used = (processor_time_s(daemon.pid()) - before) / began.elapsed().as_secs_f64();
    let sum = |of: fn(&(u64, u64, u64)) -> u64| counted.iter().map(of).sum::<u64>();
    let fewest = counted.iter().map(|one| one.0).min().expect("some");
    println!("\n## {SUBSCRIBERS} subscribers of every tick at 1 kHz\n");
    println!(
        "{} rows received in {} s, {fewest} by the one that received fewest; {} dropped, {} gaps; the daemon used {:.0} % of a processor, its loop and the spinning of that included",
        sum(|one| one.0),
        TIME.as_secs(),
        sum(|one| one.1),
        sum(|one| one.2),
        100.0 * used
    );
}

/// The loop under every attack beside the same loop left alone, in turns; and how long an answer to somebody else takes
/// meanwhile.
fn attacks() {
    let daemon = engaged();
    println!("\n## Attacks: medians of {TURNS} turns of {TURN_S} s, alone -> under attack\n");
    println!(
        "| attack | tick p50, us | tick p99, us | wake-up p50, us | wake-up p99, us | overruns | periods missed | status, us |"
    );
    println!("|---|---|---|---|---|---|---|---|");
    for attack in attack::ALL.into_iter().chain([attack::CROWD]) {
        let (mut alone, mut attacked, mut answers) = (vec![], vec![], vec![]);
        for _ in 0..TURNS {
            alone.push(turn(&mut daemon.client()));
            let (turn, answer_us) = under(&daemon, attack);
            attacked.push(turn);
            answers.push(answer_us);
        }
        let count = |periods: u64| f64::from(u32::try_from(periods).expect("few"));
        let cell = |of: &dyn Fn(&TimingWindow) -> f64| {
            let each = |turns: &[TimingWindow]| median(turns.iter().map(of).collect());
            format!("{:.1} -> {:.1}", each(&alone), each(&attacked))
        };
        println!(
            "| {} | {} | {} | {} | {} | {} | {} | {:.0} |",
            attack.name,
            cell(&|turn| us(turn.tick_ns.p50)),
            cell(&|turn| us(turn.tick_ns.p99)),
            cell(&|turn| us(turn.wake_latency_ns.p50)),
            cell(&|turn| us(turn.wake_latency_ns.p99)),
            cell(&|turn| count(turn.overruns)),
            cell(&|turn| count(turn.missed_periods)),
            median(answers)
        );
    }
}

/// A turn under attack, and the median time of an answer to somebody else, us.
fn under(daemon: &Daemon, attack: Attack) -> (TimingWindow, f64) {
    // All places may be taken later.
    let (mut client, mut asker) = (daemon.client(), daemon.client());
    let over = AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| attack.run(daemon.socket(), &over));
        let asking = scope.spawn(|| {
            let mut took = vec![];
            while !over.load(Ordering::Relaxed) {
                let asked = Instant::now();
                let _ = status(&mut asker);
                took.push(us(ns(asked.elapsed())));
                std::thread::sleep(Duration::from_millis(10));
            }
            median(took)
        });
        let turn = turn(&mut client);
        over.store(true, Ordering::Relaxed);
        (turn, asking.join().expect("it asks"))
    })
}
