//! Entries for the journal of systemd, in its own protocol: a datagram of lines `FIELD=value`
//! (systemd.io/JOURNAL_NATIVE_PROTOCOL).
//!
//! A library would write from the thread that logs, or bring a subscriber with ten crates; here an entry goes through
//! the same bounded queue and the same thread as a line on standard error.

use haptic_core::servo::Fault;
use std::fmt::Write;
use std::os::unix::net::UnixDatagram;

/// Where the journal listens.
const SOCKET: &str = "/run/systemd/journal/socket";

/// Message ids of the other events, by their operations.
const EVENTS: [(&str, &str); 9] = [
    ("stop", "ea3655defd275b8483515d962788a55e"),
    ("lease_lapsed", "50c173776bb95685ade6696de98de399"),
    ("disconnected", "541cce63752d5b308652c048f4aa40a7"),
    ("connected", "6e2d8541c8d454b996a4374b5f475516"),
    ("engage", "248c1741ac985b6dbd0a8fcc7bc7d810"),
    ("release", "5dcbc2acc7d0565f9d8790b43f314471"),
    ("reset", "3a28d18f4f13503a97cf86ae6ba7aac7"),
    ("reload", "fa9383f54f364915be711610f030f6f3"),
    ("reload_refused", "fb3b80ffa3f1485ebbc764c36586d04a"),
];

/// Message id of any other event.
const OTHER: &str = "acd976872dd7564fbe0d43b8dda0f269";

/// A socket that leads to the journal.
pub(super) fn connect() -> std::io::Result<UnixDatagram> {
    let socket = UnixDatagram::unbound()?;
    socket.connect(SOCKET)?;
    Ok(socket)
}

/// The message id of an event: that of its fault, if it is one.
pub(super) fn message_id(op: &str, fault: Option<&str>) -> &'static str {
    let of_event = || EVENTS.iter().find(|(listed, _)| *listed == op).map(|(_, id)| *id);
    fault.and_then(Fault::message_id).or_else(of_event).unwrap_or(OTHER)
}

/// An entry. A value is one line: the lines of a message are joined.
pub(super) fn entry(priority: u8, message: &str, fields: &[(&str, &str)]) -> String {
    let mut text = format!("PRIORITY={priority}\nSYSLOG_IDENTIFIER=hapticd\n");
    for (name, value) in [("MESSAGE", message)].iter().chain(fields) {
        let value = value.trim_end().replace('\n', " | ");
        writeln!(text, "{name}={value}").unwrap_or_default();
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_id_is_one_of_its_own_and_in_the_documents() {
        let faults = Fault::KINDS.map(|fault| (fault.code(), Fault::message_id(fault.code()).unwrap_or_default()));
        let ids: Vec<&str> = faults.iter().chain(&EVENTS).map(|(_, id)| *id).chain([OTHER]).collect();
        assert_eq!(ids.iter().collect::<BTreeSet<_>>().len(), ids.len());
        let page = include_str!("../../../../docs/reference/faults.md");
        let has_row = |name: &str, id: &str| {
            let is_of_both =
                |line: &str| line.starts_with(&format!("| `{name}` |")) && line.ends_with(&format!("| `{id}` |"));
            page.lines().any(is_of_both)
        };
        for (name, id) in faults.iter().chain(&EVENTS) {
            assert!(id.len() == 32 && id.chars().all(|c| c.is_ascii_hexdigit()), "{id}");
            assert!(has_row(name, id), "docs/reference/faults.md lacks {name}");
        }
    }

    #[test]
    fn an_entry_is_a_line_for_each_field_whatever_a_value_holds() {
        let text = entry(
            3,
            "one\ntwo\n",
            &[("HAPTICD_OP", "fault"), ("HAPTICD_BY", "a\nPRIORITY=0")],
        );
        let expected =
            "PRIORITY=3\nSYSLOG_IDENTIFIER=hapticd\nMESSAGE=one | two\nHAPTICD_OP=fault\nHAPTICD_BY=a | PRIORITY=0\n";
        assert_eq!(text, expected);
    }
}
