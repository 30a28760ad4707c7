//! No bytes make the link protocol's reader panic, nothing passes with a wrong CRC, and what is
//! read is written back the same.
#![no_main]

use device_io::protocol::frame::{Decoder, Frame};
use device_io::protocol::message::{FromDevice, FromHost};
use device_io::protocol::view::{Axes, View, ViewError};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|bytes: &[u8]| {
    // As a stream: what comes out of it is what a sender of those messages would have sent.
    let mut decoder = Decoder::default();
    let mut raw = Vec::new();
    for &byte in bytes {
        raw.push(byte);
        if let Some(Ok(message)) = decoder.push(byte) {
            assert!(raw.ends_with(Frame::of(message).as_slice()), "another frame was sent than was read");
            read(View::whole(message));
        }
        if byte == 0 {
            raw.clear();
        }
    }
    // As a message: the fuzzer does not find CRCs by itself.
    read(View::whole(bytes));
    read(View::padded(bytes, Axes::One));
    read(View::padded(bytes, Axes::Two));
});

fn read(view: Result<View<'_>, ViewError>) {
    let Ok(view) = view else { return };
    let (device, host) = (FromDevice::read(view), FromHost::read(view));
    assert!(device.is_err() || host.is_err(), "a message goes one way");
    if let Ok(message) = device {
        let bytes = message.bytes();
        let again = FromDevice::read(View::whole(bytes.as_slice()).expect("a message"));
        assert_eq!(again, Ok(message));
    }
    if let Ok(message) = host {
        let bytes = message.bytes();
        let again = FromHost::read(View::whole(bytes.as_slice()).expect("a message"));
        assert_eq!(again, Ok(message));
    }
}
