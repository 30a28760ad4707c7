//! What a client can do to a daemon without its leave: each an attack that lasts until the test ends it.

use serde_json::json;
use std::io::{Read, Write};
use std::net::Shutdown;
use std::os::fd::OwnedFd;
use std::os::unix::net::UnixStream;
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// An attack.
#[derive(Clone, Copy, Debug)]
pub struct Attack {
    /// What is done.
    pub name: &'static str,
    run: fn(&Path, &AtomicBool),
}

impl Attack {
    const fn new(name: &'static str, run: fn(&Path, &AtomicBool)) -> Self {
        Self { name, run }
    }

    /// Attacks a socket until it is over.
    pub fn run(&self, socket: &Path, over: &AtomicBool) {
        (self.run)(socket, over);
    }
}

/// Subscribers that read nothing.
pub const NEVER_READ: Attack = Attack::new("eight subscribers that never read", never_read);

/// Connections of which one end is shut.
pub const HALF_CLOSED: Attack = Attack::new("half-closed connections", half_closed);

/// All that leave the machine to others.
pub const ALL: [Attack; 9] = [
    NEVER_READ,
    Attack::new("eight clients that write a byte a second", a_byte_a_second),
    Attack::new("lines beyond the limit, and one without an end", endless_lines),
    Attack::new("1000 connections a second", connect_again_and_again),
    Attack::new("clients killed in mid-write", killed_in_mid_write),
    Attack::new("garbage", garbage),
    HALF_CLOSED,
    Attack::new(
        "eight clients that ask for much and read nothing",
        ask_for_much_and_never_read,
    ),
    Attack::new("four clients that ask without pause", ask_without_pause),
];

/// As many connections as a client can make: more than the daemon can serve.
pub const CROWD: Attack = Attack::new("connections without pause", connect_without_pause);

/// Crowds that leave no place: of clients that say nothing, that come again whenever they are sent away, and that never
/// end their line.
pub const CROWDS: [Attack; 3] = [
    Attack::new("200 idle clients", idle),
    Attack::new("32 idle clients, and 40 that come again", idle_and_coming_again),
    Attack::new(
        "40 clients with a megabyte and no end of the line",
        a_megabyte_without_an_end,
    ),
];

fn idle(socket: &Path, over: &AtomicBool) {
    let crowd: Vec<_> = (0..200).filter_map(|_| connect(socket)).collect();
    wait(over, Duration::MAX);
    drop(crowd);
}

/// As many threads as that do something until it is over.
fn each_of(many: usize, over: &AtomicBool, act: impl Fn() + Sync) {
    std::thread::scope(|scope| {
        for _ in 0..many {
            scope.spawn(|| {
                while goes_on(over) {
                    act();
                }
            });
        }
    });
}

fn idle_and_coming_again(socket: &Path, over: &AtomicBool) {
    let crowd: Vec<_> = (0..32).filter_map(|_| connect(socket)).collect();
    each_of(40, over, || {
        if let Some(mut stream) = connect(socket) {
            // Until it is sent away.
            while goes_on(over) && swallow(&mut stream) {}
        }
    });
    drop(crowd);
}

fn a_megabyte_without_an_end(socket: &Path, over: &AtomicBool) {
    let crowd: Vec<_> = (0..32).filter_map(|_| connect(socket)).collect();
    let bytes = vec![b'x'; 1 << 20];
    each_of(40, over, || {
        if let Some(mut stream) = connect(socket) {
            send(&mut stream, &bytes);
        }
    });
    drop(crowd);
}

fn goes_on(over: &AtomicBool) -> bool {
    !over.load(Ordering::Relaxed)
}

/// A connection, where there is one to be had: the daemon may have had enough.
fn connect(socket: &Path) -> Option<UnixStream> {
    let stream = UnixStream::connect(socket).ok()?;
    let patience = Some(Duration::from_millis(100));
    stream.set_read_timeout(patience).ok()?;
    stream.set_write_timeout(patience).ok()?;
    Some(stream)
}

/// Whether the daemon took it. An attacker does not mind being cut off.
fn send(stream: &mut UnixStream, bytes: &[u8]) -> bool {
    stream.write_all(bytes).is_ok()
}

fn subscription() -> Vec<u8> {
    let topics = ["state", "timing", "samples", "log"];
    let line = json!({ "id": 1, "op": "subscribe", "topics": topics, "batch_ms": 1 });
    format!("{line}\n").into_bytes()
}

fn never_read(socket: &Path, over: &AtomicBool) {
    let mut deaf: Vec<UnixStream> = Vec::new();
    while goes_on(over) {
        // Whoever was cut off comes again.
        deaf.retain_mut(|stream| send(stream, b"\n"));
        while deaf.len() < 8
            && let Some(mut stream) = connect(socket)
        {
            send(&mut stream, &subscription());
            deaf.push(stream);
        }
        std::thread::sleep(Duration::from_millis(50));
    }
}

fn a_byte_a_second(socket: &Path, over: &AtomicBool) {
    let mut slow: Vec<UnixStream> = (0..8).filter_map(|_| connect(socket)).collect();
    let mut bytes = br#"{"id":1,"op":"set","params":{"mass":9"#.iter().cycle();
    while goes_on(over) {
        if let Some(byte) = bytes.next() {
            slow.retain_mut(|stream| send(stream, &[*byte]));
        }
        wait(over, Duration::from_secs(1));
    }
}

/// Waits, and no longer than the attack goes on.
fn wait(over: &AtomicBool, time: Duration) {
    let began = Instant::now();
    while goes_on(over) && began.elapsed() < time {
        std::thread::sleep(Duration::from_millis(10));
    }
}

fn endless_lines(socket: &Path, over: &AtomicBool) {
    let mut long = vec![b' '; haptic_ipc::MAX_LINE_BYTES + 1];
    long.push(b'\n');
    let mut without_end = connect(socket);
    while goes_on(over) {
        if let Some(mut stream) = connect(socket) {
            for _ in 0..8 {
                send(&mut stream, &long);
                swallow(&mut stream);
            }
        }
        if !without_end
            .as_mut()
            .is_some_and(|stream| send(stream, &long[..haptic_ipc::MAX_LINE_BYTES]))
        {
            without_end = connect(socket);
        }
    }
}

/// Reads what is there.
fn swallow(stream: &mut UnixStream) -> bool {
    let mut buffer = [0; 1 << 16];
    stream.read(&mut buffer).is_ok_and(|read| read > 0)
}

fn connect_again_and_again(socket: &Path, over: &AtomicBool) {
    let began = Instant::now();
    let mut connections: u32 = 0;
    while goes_on(over) {
        drop(connect(socket));
        connections += 1;
        // By the clock, so that the rate is kept.
        let due = began + Duration::from_millis(1) * connections;
        std::thread::sleep(due.saturating_duration_since(Instant::now()));
    }
}

fn connect_without_pause(socket: &Path, over: &AtomicBool) {
    while goes_on(over) {
        drop(UnixStream::connect(socket));
    }
}

fn killed_in_mid_write(socket: &Path, over: &AtomicBool) {
    while goes_on(over) {
        let Some(mut stream) = connect(socket) else { continue };
        send(&mut stream, br#"{"id":1,"op":"set","params":{"mass":9"#);
        let writing = Command::new("cat")
            .arg("/dev/zero")
            .stdin(Stdio::null())
            .stdout(OwnedFd::from(stream))
            .stderr(Stdio::null())
            .spawn();
        let Ok(mut writing) = writing else { continue };
        std::thread::sleep(Duration::from_millis(20));
        // SIGKILL, while it waits in the middle of a write.
        if writing.kill().is_ok() && writing.wait().is_err() {
            return;
        }
    }
}

fn garbage(socket: &Path, over: &AtomicBool) {
    // The same bytes in every run.
    let mut random = fastrand::Rng::with_seed(1);
    let mut bytes = vec![0; 4096];
    while goes_on(over) {
        let Some(mut stream) = connect(socket) else { continue };
        for _ in 0..16 {
            random.fill(&mut bytes);
            send(&mut stream, &bytes);
            swallow(&mut stream);
        }
    }
}

fn half_closed(socket: &Path, over: &AtomicBool) {
    while goes_on(over) {
        let mut held = Vec::new();
        for which in [Shutdown::Write, Shutdown::Read].into_iter().cycle().take(8) {
            let Some(mut stream) = connect(socket) else { break };
            send(&mut stream, &subscription());
            if stream.shutdown(which).is_ok() {
                held.push(stream);
            }
        }
        wait(over, Duration::from_millis(100));
    }
}

fn ask_for_much_and_never_read(socket: &Path, over: &AtomicBool) {
    // Long answers to short requests, and long requests that take a while to be refused.
    let mut requests = format!("{}\n", json!({ "id": 1, "op": "log", "limit": 100_000 })).repeat(100);
    let names: serde_json::Map<String, serde_json::Value> =
        (0..6000).map(|name| (name.to_string(), 1.into())).collect();
    requests.push_str(&format!("{}\n", json!({ "id": 2, "op": "set", "params": names })).repeat(100));
    each_of(8, over, || {
        if let Some(mut stream) = connect(socket) {
            send(&mut stream, requests.as_bytes());
            wait(over, Duration::from_millis(500));
        }
    });
}

fn ask_without_pause(socket: &Path, over: &AtomicBool) {
    let mut request = String::new();
    for op in ["describe", "get", "status", "timing", "advise", "scene.list", "log"] {
        request.push_str(&format!("{}\n", json!({ "id": 1, "op": op })));
    }
    each_of(4, over, || {
        if let Some(mut stream) = connect(socket) {
            while goes_on(over) && send(&mut stream, request.as_bytes()) && swallow(&mut stream) {}
        }
    });
}
