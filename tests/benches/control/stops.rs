//! How long a stop takes, from a client's line to the answer that it is confirmed, on each kind of
//! rig and with everything against it that the program knows of.

use crate::ns;
use haptic_ipc::{Client, Request, ServerLine};
use serde_json::Value;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};
use system_tests::attack::{self, Attack};
use system_tests::blocked::{Blocked, Mute};
use system_tests::fake_rig::FakeRig;
use system_tests::measure::{percentile, us};
use system_tests::screen::Screen;
use system_tests::{engage, wait_for};

/// Stops in each row; fewer only look whether it works.
fn stops_each() -> usize {
    std::env::var("HAPTICD_STOPS").map_or(1000, |text| text.parse().expect("a count"))
}

/// A stop that was not answered for so long never will be.
const PATIENCE: Duration = Duration::from_secs(5);

/// What goes on meanwhile.
enum Meanwhile {
    Nothing,
    Attack(Attack),
    /// Standard output and error are pipes that nobody reads, full to the last byte.
    BlockedOutput,
    /// The panel is open and draws.
    Panel,
}

impl Meanwhile {
    fn name(&self) -> &'static str {
        match self {
            Self::Nothing => "left alone",
            Self::Attack(attack) => attack.name,
            Self::BlockedOutput => "standard output and error full pipes",
            Self::Panel => "the panel open",
        }
    }
}

/// What a number of stops took.
struct Taken {
    confirmed_ns: Vec<u64>,
    /// Answers that the device has not confirmed it.
    unconfirmed: usize,
    unanswered: usize,
    /// What the daemon says of the same stops.
    timing: Value,
}

/// Stops as another client does: how long it took and whether the device has confirmed it; none without an answer.
fn stop(client: Client) -> Option<(Duration, bool)> {
    let (mut sender, mut receiver) = client.split();
    receiver.set_timeout(Some(PATIENCE)).ok()?;
    let asked = Instant::now();
    sender.send(Request::Stop {}).ok()?;
    loop {
        if let ServerLine::Answer { result, .. } = receiver.receive().ok()? {
            return Some((asked.elapsed(), result.is_ok()));
        }
    }
}

fn take(daemon: &Mute) -> Taken {
    let mut taken = Taken {
        confirmed_ns: vec![],
        unconfirmed: 0,
        unanswered: 0,
        timing: Value::Null,
    };
    let mut client = daemon.client();
    for _ in 0..stops_each() {
        engage(&mut client);
        // Force has begun to flow, and the client is idle: a person's stop does not come at a
        // moment of the loop's choosing either.
        let from = system_tests::status(&mut client).tick;
        wait_for(&mut client, "force", |status| status.tick > from + 2);
        match stop(daemon.client()) {
            Some((took, true)) => taken.confirmed_ns.push(ns(took)),
            Some((_, false)) => taken.unconfirmed += 1,
            None => {
                taken.unanswered += 1;
                return taken;
            }
        }
        // A rig behind a line may have faulted meanwhile, or be gone for a moment: `engage` sees to it.
        drop(client.request::<Value>(Request::Reset {}));
    }
    taken.timing = client.request(Request::Timing {}).unwrap_or_default();
    taken
}

fn row(rig: &str, meanwhile: &str, mut taken: Taken) {
    taken.confirmed_ns.sort_unstable();
    let ms = |ns: u64| us(ns) * 1e-3;
    let times = if taken.confirmed_ns.is_empty() {
        "- | - | -".to_owned()
    } else {
        let [p50, p99, longest] = [500, 990, 1000].map(|per_mille| ms(percentile(&taken.confirmed_ns, per_mille)));
        format!("{p50:.2} | {p99:.2} | {longest:.2}")
    };
    let daemon = |name: &str| {
        let ns = taken.timing["stops"]["to_confirmed_ns"][name].as_u64();
        ns.map_or("-".to_owned(), |ns| format!("{:.2}", ms(ns)))
    };
    println!(
        "| {rig} | {meanwhile} | {} | {times} | {} | {} | {} | {} |",
        taken.confirmed_ns.len(),
        daemon("p99"),
        daemon("max"),
        taken.unconfirmed,
        taken.unanswered
    );
}

/// Stops on each rig, under each attack, with outputs that take nothing, and with the panel.
pub(crate) fn stops() {
    println!("\n## Stops: from a client's line to the confirmation, ms\n");
    println!(
        "| rig | meanwhile | confirmed | p50 | p99 | longest | p99, daemon's own | longest, daemon's own | not confirmed | not answered |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|");
    let screen = Screen::open();
    let rows = std::env::var("HAPTICD_STOPS_ROWS").unwrap_or_default();
    for (name, serial) in [("fake, in process", false), ("serial, a pseudo-terminal", true)] {
        let attacks = attack::ALL.into_iter().chain([attack::CROWD]).map(Meanwhile::Attack);
        let all = [Meanwhile::Nothing, Meanwhile::BlockedOutput]
            .into_iter()
            .chain(screen.is_some().then_some(Meanwhile::Panel))
            .chain(attacks);
        for meanwhile in all.filter(|meanwhile| meanwhile.name().contains(&rows)) {
            let line = serial.then(|| FakeRig::start(&[]));
            let device = line.as_ref().map_or("fake".to_owned(), FakeRig::address);
            let mut arguments = vec![
                "--uncommissioned",
                "--ramp-ms",
                "5",
                "--stale-ms",
                "200",
                "--device",
                &device,
            ];
            let output = matches!(meanwhile, Meanwhile::BlockedOutput).then(Blocked::pipe);
            // A demo, which writes to it ten times a second, runs on the rig in the process alone.
            arguments.extend((output.is_some() && !serial).then_some("--demo"));
            let daemon = Mute::start(&arguments, output.as_ref());
            row(name, meanwhile.name(), under(&daemon, &meanwhile, screen.as_ref()));
        }
    }
    println!(
        "| HID | left alone | - | - | - | - | - | - | - | - |\n\n\
         HID: there is no /dev/hidraw without a true USB stack; tests/qemu/run.sh has one, in an emulated machine whose times tell nothing. What a stop adds there is the writer's thread and one transfer \
         (0.2 to 5 ms), and then the device's next report."
    );
}

fn under(daemon: &Mute, meanwhile: &Meanwhile, screen: Option<&Screen>) -> Taken {
    match (meanwhile, screen) {
        (Meanwhile::Attack(attack), _) => {
            let over = AtomicBool::new(false);
            std::thread::scope(|scope| {
                scope.spawn(|| attack.run(&daemon.socket, &over));
                let taken = take(daemon);
                over.store(true, Ordering::Relaxed);
                taken
            })
        }
        (Meanwhile::Panel, Some(screen)) => {
            let _panel = screen.panel(&daemon.socket, &[]);
            wait_for(&mut daemon.client(), "the panel", |status| status.clients == 3);
            take(daemon)
        }
        _ => take(daemon),
    }
}
