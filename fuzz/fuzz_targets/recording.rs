//! No file panics the reader of recordings, in any format, and what it reads it reads up to an end.
#![no_main]
#![expect(
    clippy::disallowed_types,
    reason = "no real-time thread comes here, and none waits for it"
)]

use haptic_ipc::{Sample, SampleY};
use haptic_recording::{Format, Metadata, Reader, Writer};
use libfuzzer_sys::fuzz_target;
use std::sync::{LazyLock, Once};

/// A recording in each format, of one axis and of two, to be damaged.
static SOUND: LazyLock<Vec<Vec<u8>>> = LazyLock::new(|| {
    let about = Metadata {
        server: "hapticd".into(),
        device: "fuzz".into(),
        axes: 1,
        loop_rate_hz: 1000.0,
        rate_hz: 1000.0,
        started_unix_s: 0.0,
        revision: 1,
        scene: haptic_core::Scene::paper(),
        servo: None,
        recorded_by: None,
        notes: None,
        configuration: None,
    };
    let write = |format: Format, axes: u8| {
        let name = format!("hapticd-fuzz-{}.{}", std::process::id(), format.ending());
        let path = std::env::temp_dir().join(name);
        let about = Metadata { axes, ..about.clone() };
        let mut writer = Writer::create(&path, &about, true).expect("begun");
        let rows_y = vec![SampleY::default(); if axes == 2 { 3 } else { 0 }];
        writer.rows(&[Sample::default(); 3], &rows_y).expect("written");
        writer.finish().expect("written");
        let bytes = std::fs::read(&path).expect("it is there");
        drop(std::fs::remove_file(&path));
        bytes
    };
    let each = Format::ALL.into_iter().flat_map(|format| [(format, 1), (format, 2)]);
    each.map(|(format, axes)| write(format, axes)).collect()
});

fuzz_target!(|bytes: &[u8]| {
    static QUIET: Once = Once::new();
    // The Parquet library panics on some files, which the reader makes an error of. The fuzzer ends at
    // a panic that goes beyond it all the same.
    QUIET.call_once(|| std::panic::set_hook(Box::new(|_| {})));
    read(bytes.to_vec());
    // Most bytes are no recording: they are put over a part of one.
    let Some((&[format, high, low], bytes)) = bytes.split_first_chunk() else {
        return;
    };
    let mut damaged = SOUND[usize::from(format) % SOUND.len()].clone();
    let place = usize::from(u16::from_be_bytes([high, low])) % damaged.len();
    let end = (place + bytes.len()).min(damaged.len());
    damaged[place..end].copy_from_slice(&bytes[..end - place]);
    read(damaged.clone());
    // Or what comes behind its beginning.
    damaged.truncate(place);
    damaged.extend_from_slice(bytes);
    read(damaged);
});

fn read(bytes: Vec<u8>) {
    if let Ok(mut reader) = Reader::from_bytes(bytes) {
        while reader.next().is_some() {}
        assert!(reader.ending().is_some());
    }
}
