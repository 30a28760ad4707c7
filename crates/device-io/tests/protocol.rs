//! The link protocol: what is written is read again, what is damaged is not, and the document says
//! what the code does.

use device_io::protocol::frame::{BadFrame, Decoder, Frame, MAX_FRAME};
use device_io::protocol::message::{DeviceHello, DeviceSample, ErrorCode, FromDevice, FromHost, MessageError, TwoAxes};
use device_io::protocol::view::{Axes, Kind, MAX_MESSAGE, View, ViewError};
use proptest::prelude::*;

fn two_axes() -> impl Strategy<Value = TwoAxes> {
    (1.0_f32..1e10, any::<(u32, bool, bool)>()).prop_map(|(second_counts, (second_limit, are_rotary, are_absolute))| {
        TwoAxes {
            second_counts,
            second_limit,
            are_rotary,
            are_absolute,
        }
    })
}

fn from_device() -> impl Strategy<Value = FromDevice> {
    let numbers = any::<(u32, u32, u16, u8, bool, [u8; 24])>();
    let hello = (numbers, 1.0_f32..1e10, 10..=100_000_u32, prop::option::of(two_axes()));
    let hello = hello.prop_map(|(numbers, counts_per_metre, sample_rate_hz, two_axes)| {
        let (nonce, force_limit_mn, watchdog_ms, buttons, wide, firmware) = numbers;
        FromDevice::Hello(DeviceHello {
            nonce,
            counts_per_metre,
            force_limit_mn,
            sample_rate_hz,
            watchdog_ms,
            buttons,
            wide,
            firmware,
            two_axes,
        })
    });
    let sample = any::<([u32; 3], (i32, Option<i32>), [bool; 2], u8)>();
    let sample = sample.prop_map(|(words, (count, second_count), flags, buttons)| {
        let ([sequence, time_us, command], [enabled, watchdog]) = (words, flags);
        FromDevice::Sample(DeviceSample {
            sequence,
            time_us,
            count,
            second_count,
            command,
            enabled,
            watchdog,
            buttons,
        })
    });
    let acknowledge = any::<(u32, bool)>().prop_map(|(sequence, done)| FromDevice::Acknowledge { sequence, done });
    let codes = [
        ErrorCode::BadMessage,
        ErrorCode::Sensor,
        ErrorCode::Motor,
        ErrorCode::Other,
    ];
    let error = (prop::sample::select(codes.to_vec()), any::<u32>())
        .prop_map(|(code, detail)| FromDevice::Error { code, detail });
    prop_oneof![hello, sample, acknowledge, error]
}

fn from_host() -> impl Strategy<Value = FromHost> {
    prop_oneof![
        any::<u32>().prop_map(|nonce| FromHost::Hello { nonce }),
        any::<(u32, i32, Option<i32>, bool)>().prop_map(|(sequence, force_mn, second_mn, enabled)| FromHost::Command {
            sequence,
            force_mn,
            second_mn,
            enabled
        }),
        any::<(u32, bool)>().prop_map(|(sequence, enabled)| FromHost::Enable { sequence, enabled }),
    ]
}

/// What a decoder makes of bytes: messages and errors.
fn decoded(bytes: &[u8]) -> Vec<Result<Vec<u8>, BadFrame>> {
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
    fn messages_of_a_device_are_read(message in from_device()) {
        let bytes = message.bytes();
        let view = View::whole(bytes.as_slice()).expect("a message");
        prop_assert_eq!(FromDevice::read(view), Ok(message));
        prop_assert!(FromHost::read(view).is_err(), "it goes one way only");
        // A report is longer than the message.
        let mut report = [0xA5; 64];
        report[..bytes.as_slice().len()].copy_from_slice(bytes.as_slice());
        let axes = if view.has_second_axis() { Axes::Two } else { Axes::One };
        prop_assert_eq!(View::padded(&report, axes), Ok(view));
    }

    /// The fields of a second axis come behind, and leave the others as they are, but for the hello's flags.
    #[test]
    fn a_second_axis_is_appended(message in from_device(), command in any::<(u32, i32, i32, bool)>()) {
        let mut one = message;
        match &mut one {
            FromDevice::Hello(hello) => hello.two_axes = None,
            FromDevice::Sample(sample) => sample.second_count = None,
            FromDevice::Acknowledge { .. } | FromDevice::Error { .. } => {}
        }
        let (one, both) = (one.bytes(), message.bytes());
        let (one, both) = (one.as_slice(), both.as_slice());
        prop_assert_eq!(&both[..2], &one[..2]);
        prop_assert_eq!(both[2] & !0b1110, one[2] & !0b1110);
        prop_assert_eq!(&both[3..one.len()], &one[3..]);
        let (sequence, force_mn, second, enabled) = command;
        let command = |second_mn| FromHost::Command { sequence, force_mn, second_mn, enabled }.bytes();
        let appended = [command(None).as_slice(), &second.to_le_bytes()].concat();
        let both = command(Some(second));
        prop_assert_eq!(both.as_slice(), &appended[..]);
    }

    #[test]
    fn messages_of_a_host_are_read(message in from_host()) {
        let bytes = message.bytes();
        let view = View::whole(bytes.as_slice()).expect("a message");
        prop_assert_eq!(FromHost::read(view), Ok(message));
        prop_assert!(FromDevice::read(view).is_err(), "it goes one way only");
    }

    #[test]
    fn frames_come_through_whatever_lies_between_them(
        messages in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..=MAX_MESSAGE), 1..10),
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
        read(View::padded(&bytes, Axes::One));
        read(View::padded(&bytes, Axes::Two));
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
    let (kind, axes) = (Kind::HostHello, Axes::One);
    assert_eq!(View::whole(&longer), Err(ViewError::Length { kind, axes, got }));
    assert!(View::whole(&good[..5]).is_err() && View::padded(&good[..5], Axes::One).is_err());
    assert_eq!(View::whole(&[]), Err(ViewError::Empty));
    let impossible = FromDevice::Hello(DeviceHello {
        counts_per_metre: f32::NAN,
        ..hello()
    });
    let bytes = impossible.bytes();
    let view = View::whole(bytes.as_slice()).expect("a message");
    let error = FromDevice::read(view).expect_err("no such device");
    assert!(error.to_string().contains("invalid counts_per_metre: NaN"), "{error}");
}

fn device(message: FromDevice) -> Vec<u8> {
    message.bytes().as_slice().to_vec()
}

fn host(message: FromHost) -> Vec<u8> {
    message.bytes().as_slice().to_vec()
}

/// The hello of the document's vectors, of a device with one axis.
fn hello() -> DeviceHello {
    DeviceHello {
        nonce: 0x0102_0304,
        counts_per_metre: 100_000.0,
        force_limit_mn: 20_000,
        sample_rate_hz: 1000,
        watchdog_ms: 50,
        buttons: 1,
        wide: false,
        firmware: DeviceHello::firmware_of("demo 1.0"),
        two_axes: None,
    }
}

/// The sample of the document's vectors, and the same as of a device with more sensors, whose channels nothing here
/// reads.
fn sample(second_count: Option<i32>, channels: &[i32]) -> [Vec<u8>; 2] {
    let sample = FromDevice::Sample(DeviceSample {
        sequence: 258,
        time_us: 4_000_000_000,
        count: -2,
        second_count,
        command: 256,
        enabled: true,
        watchdog: false,
        buttons: 0b10,
    });
    let narrow = device(sample);
    let mut wide = narrow[..20].to_vec();
    wide[0] = Kind::WideMeasurement as u8;
    wide.extend(channels.iter().flat_map(|channel| channel.to_le_bytes()));
    let read = View::whole(&wide).map_err(MessageError::from);
    assert_eq!(read.and_then(FromDevice::read), Ok(sample));
    [narrow, wide]
}

/// The document's test vectors, in its order.
fn vectors() -> Vec<(&'static str, Vec<u8>)> {
    let [narrow, wide] = sample(None, &[2500, -9810]);
    let (sequence, enabled, done) = (1, true, true);
    vec![
        (
            "host hello, nonce 0x01020304",
            host(FromHost::Hello { nonce: 0x0102_0304 }),
        ),
        (
            "device hello to it: 100000 counts/m, 20 N, 1000 Hz, 50 ms, one button, \"demo 1.0\"",
            device(FromDevice::Hello(hello())),
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
                second_mn: None,
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

/// Those of two axes, in its order.
fn vectors_of_two_axes() -> Vec<(&'static str, Vec<u8>)> {
    let [narrow, wide] = sample(Some(9), &[2500, -9810, 9, -100, 40]);
    let hello = DeviceHello {
        firmware: DeviceHello::firmware_of("demo 2.0"),
        two_axes: Some(TwoAxes {
            second_counts: 50_000.0,
            second_limit: 10_000,
            are_rotary: false,
            are_absolute: false,
        }),
        ..hello()
    };
    let command = FromHost::Command {
        sequence: 256,
        force_mn: -1500,
        second_mn: Some(700),
        enabled: true,
    };
    vec![
        (
            "device hello to nonce 0x01020304: the one above, two axes, \"demo 2.0\"; second axis 50000 counts/m, 10 N",
            device(FromDevice::Hello(hello)),
        ),
        ("command of -1.5 N and 0.7 N, enabled, sequence 256", host(command)),
        ("sample 258 as above, counts -2 and 9", narrow),
        (
            "the same, wide: 2.5 N, -9810 mm/s², and of the second axis -0.1 N, 40 mm/s²",
            wide,
        ),
    ]
}

#[test]
fn a_hello_whose_flags_and_length_differ_is_refused() {
    let message = &vectors_of_two_axes()[0].1;
    let mut unflagged = message.clone();
    unflagged[2] = 0;
    let kind = Kind::DeviceHello;
    for (bytes, axes) in [(&message[..48], Axes::Two), (&unflagged, Axes::One)] {
        let got = bytes.len();
        assert_eq!(View::whole(bytes), Err(ViewError::Length { kind, axes, got }));
    }
    // In a report that is too short.
    assert!(View::padded(&message[..48], Axes::One).is_err());
    let mut impossible = message.clone();
    impossible[48..52].copy_from_slice(&0.5_f32.to_le_bytes());
    let read = View::whole(&impossible).map_err(MessageError::from);
    let (field, value) = ("counts_per_metre", 0.5);
    assert_eq!(
        read.and_then(FromDevice::read),
        Err(MessageError::Value { field, value })
    );
}

#[test]
fn the_documents_vectors_are_those_of_the_code() {
    let digits = |group: &[u8]| group.iter().map(|byte| format!("{byte:02x}")).collect::<String>();
    let hex = |bytes: &[u8]| bytes.chunks(4).map(digits).collect::<Vec<_>>().join(" ");
    let document = include_str!("../../../docs/device-protocol.md");
    for (vectors, axes) in [(vectors(), ""), (vectors_of_two_axes(), " of two axes")] {
        let written = vectors.iter().map(|(what, message)| {
            let frame = hex(Frame::of(message).as_slice());
            format!("{what}\n\n```text\nmessage {}\nframe   {frame}\n```\n\n", hex(message))
        });
        let written: String = written.collect();
        let (begin, end) = (
            format!("<!-- vectors{axes} -->\n"),
            format!("<!-- end of vectors{axes} -->"),
        );
        let (_, rest) = document.split_once(&begin).expect("its place");
        let (there, _) = rest.split_once(&end).expect("its end");
        assert!(there.trim() == written.trim(), "the document is to say:\n{written}");
    }
}
