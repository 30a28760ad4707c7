//! No line makes the protocol's parser panic, and what it reads it writes back the same.
#![no_main]

use haptic_ipc::{Envelope, ServerLine};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    let text = String::from_utf8_lossy(bytes);
    if let Ok(envelope) = Envelope::parse(&text) {
        let written = serde_json_line(&envelope);
        assert_eq!(Envelope::parse(&written), Ok(envelope));
    }
    drop(ServerLine::parse(&text));
});

fn serde_json_line(envelope: &Envelope) -> String {
    serde_json::to_string(envelope).expect("requests can be written")
}
