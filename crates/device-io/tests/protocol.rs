//! The link protocol: what is written is read again, what is damaged is not, and the document says
//! what the code does.

use device_io::protocol::frame::{Decoder, Frame, FrameError, MAX_FRAME};
use device_io::protocol::message::{DeviceHello, DeviceSample, ErrorCode, FromDevice, FromHost, MessageError};
use device_io::protocol::view::{Kind, LONGEST_OF_TWO_AXES, View, ViewError};
use proptest::prelude::*;

fn from_device() -> impl Strategy<Value = FromDevice> {
    let hello = (
        any::<u32>(),
        1.0_f32..1e10,
        any::<u32>(),
        10..=100_000_u32,
        any::<u16>(),
        any::<u8>(),
        any::<bool>(),
        any::<[u8; 24]>(),
    )
        .prop_map(
            |(nonce, counts_per_metre, force_limit_mn, sample_rate_hz, watchdog_ms, buttons, wide, firmware)| {
                FromDevice::Hello(DeviceHello {
                    nonce,
                    counts_per_metre,
                    force_limit_mn,
                    sample_rate_hz,
                    watchdog_ms,
                    buttons,
                    wide,
                    firmware,
                })
            },
        );
    let sample = (any::<[u32; 3]>(), any::<i32>(), any::<[bool; 2]>(), any::<u8>()).prop_map(
        |([sequence, time_us, command], count, [enabled, watchdog], buttons)| {
            FromDevice::Sample(DeviceSample {
                sequence,
                time_us,
                count,
                command,
                enabled,
                watchdog,
                buttons,
            })
        },
    );
    let acknowledge = any::<(u32, bool)>().prop_map(|(sequence, done)| FromDevice::Acknowledge { sequence, done });
    let code = prop_oneof![
        Just(ErrorCode::BadMessage),
        Just(ErrorCode::Sensor),
        Just(ErrorCode::Motor),
        Just(ErrorCode::Other)
    ];
    let error = (code, any::<u32>()).prop_map(|(code, detail)| FromDevice::Error { code, detail });
    prop_oneof![hello, sample, acknowledge, error]
}

fn from_host() -> impl Strategy<Value = FromHost> {
    prop_oneof![
        any::<u32>().prop_map(|nonce| FromHost::Hello { nonce }),
        any::<(u32, i32, bool)>().prop_map(|(sequence, force_mn, enabled)| FromHost::Command {
            sequence,
            force_mn,
            enabled
        }),
        any::<(u32, bool)>().prop_map(|(sequence, enabled)| FromHost::Enable { sequence, enabled }),
    ]
}

/// What a decoder makes of bytes: messages and errors.
fn decoded(bytes: &[u8]) -> Vec<Result<Vec<u8>, FrameError>> {
    let mut decoder = Decoder::default();
    bytes
        .iter()
        .filter_map(|byte| decoder.push(*byte).map(|frame| frame.map(<[u8]>::to_vec)))
        .collect()
}

/// Reads bytes as either side would.
fn read(view: Result<View<'_>, ViewError>) {
    if let Ok(view) = view {
        assert!(
            FromDevice::read(view).is_err() || FromHost::read(view).is_err(),
            "it goes one way only"
        );
    }
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_a_device_says_is_heard(message in from_device()) {
        let bytes = message.bytes();
        let view = View::whole(bytes.as_slice()).expect("a message");
        prop_assert_eq!(FromDevice::read(view), Ok(message));
        prop_assert!(FromHost::read(view).is_err(), "it goes one way only");
        // A report is longer than the message.
        let mut report = [0xA5; 64];
        report[..bytes.as_slice().len()].copy_from_slice(bytes.as_slice());
        prop_assert_eq!(View::padded(&report), Ok(view));
    }

    #[test]
    fn what_a_host_says_is_heard(message in from_host()) {
        let bytes = message.bytes();
        let view = View::whole(bytes.as_slice()).expect("a message");
        prop_assert_eq!(FromHost::read(view), Ok(message));
        prop_assert!(FromDevice::read(view).is_err(), "it goes one way only");
    }

    #[test]
    fn frames_come_through_whatever_lies_between_them(
        messages in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..=LONGEST_OF_TWO_AXES), 1..10),
        noise in prop::collection::vec(any::<u8>(), 0..200),
    ) {
        let mut stream = noise;
        stream.push(0);
        let before = decoded(&stream).len();
        for message in &messages {
            let frame = Frame::of(message);
            prop_assert!(frame.as_slice().len() <= MAX_FRAME);
            let (zero, stuffed) = frame.as_slice().split_last().expect("it ends");
            prop_assert!(*zero == 0 && !stuffed.contains(&0));
            stream.extend(frame.as_slice());
        }
        let after: Vec<_> = decoded(&stream).split_off(before).into_iter().collect::<Result<_, _>>().expect("all of them");
        prop_assert_eq!(after, messages);
    }

    #[test]
    fn a_damaged_frame_is_never_taken_for_another(
        message in from_device(),
        damage in prop::collection::vec((any::<prop::sample::Index>(), 1..=255_u8), 1..8),
    ) {
        let good = Frame::of(message.bytes().as_slice()).as_slice().to_vec();
        let mut bad = good.clone();
        for (at, turned) in damage {
            bad[at.index(good.len())] ^= turned;
        }
        bad.push(0);
        for frame in decoded(&bad).into_iter().flatten() {
            // Only where the damage has undone itself.
            prop_assert_eq!(frame, message.bytes().as_slice().to_vec());
        }
    }

    #[test]
    fn nothing_that_comes_is_too_much(bytes in prop::collection::vec(any::<u8>(), 0..2000)) {
        for frame in decoded(&bytes).into_iter().flatten() {
            read(View::whole(&frame));
        }
        read(View::padded(&bytes));
    }
}

#[test]
fn another_version_kind_or_length_is_refused_by_name() {
    let bytes = FromHost::Hello { nonce: 1 }.bytes();
    let good = bytes.as_slice();
    let mut other = good.to_vec();
    other[1] = 2;
    assert_eq!(View::whole(&other), Err(ViewError::Version(2)));
    other[1] = 1;
    other[0] = 0x77;
    assert_eq!(View::whole(&other), Err(ViewError::Kind(0x77)));
    let got = good.len() + 1;
    let longer = [good, &[0]].concat();
    assert_eq!(
        View::whole(&longer),
        Err(ViewError::Length {
            kind: Kind::HostHello,
            got
        })
    );
    assert!(View::whole(&good[..5]).is_err() && View::padded(&good[..5]).is_err());
    assert_eq!(View::whole(&[]), Err(ViewError::Empty));
    let impossible = FromDevice::Hello(DeviceHello {
        nonce: 0,
        counts_per_metre: f32::NAN,
        force_limit_mn: 0,
        sample_rate_hz: 1000,
        watchdog_ms: 50,
        buttons: 0,
        wide: false,
        firmware: [0; 24],
    });
    let bytes = impossible.bytes();
    let view = View::whole(bytes.as_slice()).expect("a message");
    let error = FromDevice::read(view).expect_err("no such device");
    assert!(error.to_string().contains("invalid counts_per_metre: NaN"), "{error}");
}

/// The document's test vectors, in its order.
fn vectors() -> Vec<(&'static str, Vec<u8>)> {
    let device = |message: FromDevice| message.bytes().as_slice().to_vec();
    let host = |message: FromHost| message.bytes().as_slice().to_vec();
    let sample = DeviceSample {
        sequence: 258,
        time_us: 4_000_000_000,
        count: -2,
        command: 256,
        enabled: true,
        watchdog: false,
        buttons: 0b10,
    };
    let narrow = device(FromDevice::Sample(sample));
    // As of a device with more sensors, whose channels nothing here reads.
    let channels = [2500_i32, -9810].map(i32::to_le_bytes).concat();
    let wide = [&[Kind::WideMeasurement as u8], &narrow[1..], &channels].concat();
    let read = View::whole(&wide)
        .map_err(MessageError::from)
        .and_then(FromDevice::read);
    assert_eq!(read, Ok(FromDevice::Sample(sample)));
    let (sequence, enabled, done) = (1, true, true);
    vec![
        (
            "host hello, nonce 0x01020304",
            host(FromHost::Hello { nonce: 0x0102_0304 }),
        ),
        (
            "device hello to it: 100000 counts/m, 20 N, 1000 Hz, 50 ms, one button, \"demo 1.0\"",
            device(FromDevice::Hello(DeviceHello {
                nonce: 0x0102_0304,
                counts_per_metre: 100_000.0,
                force_limit_mn: 20_000,
                sample_rate_hz: 1000,
                watchdog_ms: 50,
                buttons: 1,
                wide: false,
                firmware: DeviceHello::firmware_of("demo 1.0"),
            })),
        ),
        ("enable on, sequence 1", host(FromHost::Enable { sequence, enabled })),
        (
            "acknowledge of it, done",
            device(FromDevice::Acknowledge { sequence, done }),
        ),
        (
            "command of -1.5 N, enabled, sequence 256",
            host(FromHost::Command {
                sequence: 256,
                force_mn: -1500,
                enabled,
            }),
        ),
        (
            "sample 258 at 4000 s, count -2, enabled, button 1 pressed, knows command 256",
            narrow,
        ),
        ("the same, wide: 2.5 N, -9810 mm/s²", wide),
        (
            "error: position sensor, detail 7",
            device(FromDevice::Error {
                code: ErrorCode::Sensor,
                detail: 7,
            }),
        ),
    ]
}

/// The first frame of the document's vectors of two axes.
#[test]
fn a_device_with_two_axes_is_refused_by_name() {
    let document = include_str!("../../../docs/device-protocol.md");
    let (_, vectors) = document.split_once("<!-- vectors of two axes -->").expect("its place");
    let frame = vectors
        .lines()
        .find_map(|line| line.strip_prefix("frame"))
        .expect("a frame");
    let digits: Vec<char> = frame.chars().filter(|letter| !letter.is_whitespace()).collect();
    let frame: Vec<u8> = digits
        .chunks(2)
        .map(|byte| u8::from_str_radix(&byte.iter().collect::<String>(), 16).expect("a byte"))
        .collect();
    let [Ok(message)] = &decoded(&frame)[..] else {
        panic!("one message");
    };
    assert_eq!(
        View::whole(message).expect_err("two axes").to_string(),
        "the device has two axes, and hapticd renders one"
    );
}

#[test]
fn the_documents_vectors_are_those_of_the_code() {
    let digits = |group: &[u8]| group.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    let hex = |bytes: &[u8]| bytes.chunks(4).map(digits).collect::<Vec<_>>().join(" ");
    let written: String = vectors()
        .iter()
        .map(|(what, message)| {
            format!(
                "{what}\n\n```text\nmessage {}\nframe   {}\n```\n\n",
                hex(message),
                hex(Frame::of(message).as_slice())
            )
        })
        .collect();
    let document = include_str!("../../../docs/device-protocol.md");
    let (_, rest) = document.split_once("<!-- vectors -->\n").expect("its place");
    let (there, _) = rest.split_once("<!-- end of vectors -->").expect("its end");
    assert!(there.trim() == written.trim(), "the document is to say:\n{written}");
}
