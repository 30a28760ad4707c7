//! No file panics the reader of recordings, and what it reads it reads up to an end.
#![no_main]

use haptic_lab::recording::{Format, Metadata, Reader, Writer};
use libfuzzer_sys::fuzz_target;
use std::sync::LazyLock;

/// What comes before the first row, in each format that can be cut behind it.
static HEADS: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
    let about = Metadata {
        server: "hapticd".into(),
        device: "fuzz".into(),
        loop_rate_hz: 1000.0,
        rate_hz: 1000.0,
        started_unix_s: 0.0,
        revision: 1,
        scene: haptic_core::Scene::paper(),
        servo: None,
        notes: None,
        configuration: None,
    };
    [Format::Csv]
        .into_iter()
        .map(|format| {
            let path = std::env::temp_dir().join(format!("hapticd-fuzz-{}.{}", std::process::id(), format.ending()));
            drop(Writer::create(&path, &about, true).expect("begun"));
            let head = std::fs::read(&path).expect("it is there");
            drop(std::fs::remove_file(&path));
            head
        })
        .collect()
});

fuzz_target!(|bytes: &[u8]| {
    if let Ok(reader) = Reader::from_bytes(bytes.to_vec()) {
        drop(reader.into_recording());
    }
    // Most bytes are no recording: behind the head of one they are read on.
    for head in &*HEADS {
        let mut reader = Reader::from_bytes([head, bytes].concat()).expect("the head is sound");
        while reader.next().is_some() {}
        assert!(reader.ending().is_some());
    }
});
