//! What the daemon holds for a client that does not read is bounded in bytes.

use std::time::Instant;
use system_tests::{Daemon, status, until_some, wait_for};

/// Bytes of events that the daemon holds for a client.
const BACKLOG_BYTES: usize = 512 * 1024;

/// What the socket itself holds, and a line that is half written: by default 208 KiB.
const SOCKET_BYTES: usize = 384 * 1024;

const RATE_HZ: u64 = 5000;

/// Subscribes to every tick in long lines, reads nothing for a while, and then all; returns the
/// bytes that had waited, unless the machine was so busy that the client was cut off meanwhile.
fn waited(daemon: &Daemon) -> Option<usize> {
    let began = Instant::now();
    let mut slow = daemon.raw();
    slow.ask(r#"{"id":1,"op":"subscribe","topics":["samples"],"batch_ms":1000}"#);
    let mut client = daemon.client();
    let from = status(&mut client).tick;
    // A client that leaves its lines unread for two seconds is cut off.
    wait_for(&mut client, "1.6 s", |status| status.tick > from + RATE_HZ * 8 / 5);
    println!("{:?}: it has read nothing so far", began.elapsed());
    let mut bytes = 0;
    loop {
        let line = slow.try_line()?;
        if line["dropped"] != 0 {
            return Some(bytes);
        }
        bytes += line.to_string().len() + 1;
        if bytes > 2 * (BACKLOG_BYTES + SOCKET_BYTES) {
            // Nothing is ever dropped.
            return Some(bytes);
        }
    }
}

// hazard: H20
#[test]
fn events_that_wait_for_a_client_that_does_not_read_are_bounded_in_bytes() {
    let _alone = crate::alone();
    let daemon = Daemon::start(&["--rate", &RATE_HZ.to_string()]);
    let bytes = until_some("it is cut off again and again", || waited(&daemon));
    println!("{bytes} bytes had waited, of {BACKLOG_BYTES} and the socket's own");
    assert!(bytes <= BACKLOG_BYTES + SOCKET_BYTES, "{bytes}");
    assert!(bytes > BACKLOG_BYTES / 2, "{bytes}: it never had to wait");
}
