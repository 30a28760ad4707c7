//! No file panics the reader of recordings, and what it reads it reads up to an end.
#![no_main]

use haptic_lab::recording::{Metadata, Reader, Writer};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(reader) = Reader::new(bytes) {
        drop(reader.into_recording());
    }
    // Most bytes are no recording: behind the head of one they are read on.
    let about = Metadata {
        server: "hapticd".into(),
        device: "fuzz".into(),
        loop_rate_hz: 1000.0,
        rate_hz: 1000.0,
        started_unix_s: 0.0,
        revision: 1,
        scene: haptic_core::Scene::paper(),
        servo: None,
    };
    let mut file = Vec::new();
    drop(Writer::new(&mut file, &about));
    file.extend_from_slice(bytes);
    let mut reader = Reader::new(file.as_slice()).expect("the head is sound");
    while reader.next().is_some() {}
    assert!(reader.ending().is_some());
});
