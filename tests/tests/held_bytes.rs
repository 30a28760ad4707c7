//! What the daemon holds for a client that does not read is bounded in bytes.

use system_tests::{Daemon, status, timed, wait_for};

/// Bytes of events that the daemon holds for a client.
const BACKLOG_BYTES: usize = 512 * 1024;

/// What the socket itself holds, and a line that is half written: by default 208 KiB.
const SOCKET_BYTES: usize = 384 * 1024;

const RATE_HZ: u64 = 5000;

/// Subscribes to every tick in long lines, reads nothing for a while, and then all; returns the bytes that had waited.
fn waited(daemon: &Daemon) -> usize {
    let mut slow = daemon.raw();
    slow.ask(r#"{"id":1,"op":"subscribe","topics":["samples"],"batch_ms":1000}"#);
    let mut client = daemon.client();
    let from = status(&mut client).tick;
    // A client that leaves its lines unread for two seconds is cut off.
    wait_for(&mut client, "1.6 s", |status| status.tick > from + RATE_HZ * 8 / 5);
    let mut bytes = 0;
    // Were nothing ever dropped, there would be no end.
    while bytes <= 2 * (BACKLOG_BYTES + SOCKET_BYTES) {
        let line = slow.line();
        if line["dropped"] != 0 {
            break;
        }
        bytes += line.to_string().len() + 1;
    }
    bytes
}

// hazard: H20
#[test]
fn backlog_of_client_that_does_not_read_is_bounded() {
    let _alone = crate::alone();
    timed("what the daemon holds for a client that does not read", || {
        let daemon = Daemon::start(&["--rate", &RATE_HZ.to_string()]);
        let bytes = waited(&daemon);
        println!("{bytes} bytes had waited, of {BACKLOG_BYTES} and the socket's own");
        assert!(bytes <= BACKLOG_BYTES + SOCKET_BYTES, "{bytes}");
        assert!(bytes > BACKLOG_BYTES / 2, "{bytes}: it never had to wait");
    });
}
