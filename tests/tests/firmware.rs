//! The reference firmware, as it runs on its microcontroller: the real machine code on a simulated
//! ATmega328P, whose PWM pin pulls a handle. All times are the microcontroller's own, and forces
//! are what its pins give, so a busy machine changes nothing but how long the test takes.

use device_io::protocol::frame::{Decoder, Frame};
use device_io::protocol::message::{DeviceSample, ErrorCode, FromDevice, FromHost};
use device_io::protocol::view::View;
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use serde_json::Value;
use std::fs::File;
use std::io::{Read, Write};
use std::time::{Duration, Instant};
use system_tests::PATIENCE;
use system_tests::simulated_rig::{Encoder, SimulatedRig, WATCHDOG_S, conforms, number};

const TMP: &str = env!("CARGO_TARGET_TMPDIR");
/// Nobody holds the handle, so that nothing but the motor moves it.
const LEFT_ALONE: [&str; 6] = ["--amplitude", "0", "--arm-stiffness", "100", "--arm-damping", "5"];
/// A turn of the PWM, and what reading a pin's time by whole instructions may be off, s.
const PIN_S: f64 = 40e-6;

/// The builds of the firmware.
const ENCODERS: [Encoder; 2] = [Encoder::Quadrature, Encoder::Magneto];

/// A host that answers each sample with a command, so that its rate is the device's.
struct Host {
    line: File,
    decoder: Decoder,
    sequence: u32,
    others: Vec<FromDevice>,
}

impl Host {
    fn greet(rig: &SimulatedRig) -> Self {
        let line = File::options()
            .read(true)
            .write(true)
            .open(rig.line())
            .expect("the line is there");
        let mut host = Self {
            line,
            decoder: Decoder::default(),
            sequence: 0,
            others: Vec::new(),
        };
        for nonce in 0..100 {
            host.say(FromHost::Hello { nonce });
            // It may not have come up yet.
            while host.has_news(Duration::from_millis(250)) {
                for message in host.receive() {
                    if let FromDevice::Hello(hello) = message
                        && hello.nonce == nonce
                    {
                        return host;
                    }
                }
            }
        }
        panic!("it does not answer");
    }

    fn has_news(&self, patience: Duration) -> bool {
        let patience = Timespec {
            tv_sec: patience.as_secs().try_into().expect("a short time"),
            tv_nsec: patience.subsec_nanos().into(),
        };
        poll(&mut [PollFd::new(&self.line, PollFlags::IN)], Some(&patience)).expect("it can be waited for") > 0
    }

    fn say(&mut self, message: FromHost) {
        self.line
            .write_all(Frame::of(message.bytes().as_slice()).as_slice())
            .expect("the line takes it");
    }

    fn next(&mut self) -> u32 {
        self.sequence += 1;
        self.sequence
    }

    /// Reads what has come, and waits for it.
    fn receive(&mut self) -> Vec<FromDevice> {
        assert!(self.has_news(PATIENCE), "the device is silent");
        let mut bytes = [0; 4096];
        let read = self.line.read(&mut bytes).expect("the line is there");
        let mut messages = Vec::new();
        for &byte in &bytes[..read] {
            if let Some(message) = self.decoder.push(byte) {
                let message = message.expect("no frame is damaged");
                messages.push(FromDevice::read(View::whole(message).expect("a message")).expect("a device's"));
            }
        }
        messages
    }

    fn wait_for<T>(&mut self, what: &str, mut wanted: impl FnMut(&FromDevice) -> Option<T>) -> T {
        let began = Instant::now();
        loop {
            let messages = self.receive();
            if let Some(found) = messages.iter().find_map(&mut wanted) {
                return found;
            }
            assert!(began.elapsed() < PATIENCE, "waited in vain for {what}");
        }
    }

    fn enable(&mut self) {
        let asked = self.next();
        self.say(FromHost::Enable {
            sequence: asked,
            enabled: true,
        });
        let done = self.wait_for("the acknowledge", |message| match message {
            FromDevice::Acknowledge { sequence, done } if *sequence == asked => Some(*done),
            _ => None,
        });
        assert!(done, "it refuses");
    }

    fn command(&mut self, force_mn: i32) {
        let sequence = self.next();
        self.say(FromHost::Command {
            sequence,
            force_mn,
            second_mn: None,
            enabled: true,
        });
    }

    /// Answers so many samples with a force; returns them.
    fn hold(&mut self, force_mn: i32, samples: usize) -> Vec<DeviceSample> {
        let mut had = Vec::new();
        while had.len() < samples {
            for message in self.receive() {
                if let FromDevice::Sample(sample) = message {
                    had.push(sample);
                    self.command(force_mn);
                } else {
                    self.others.push(message);
                }
            }
        }
        had
    }
}

/// The microcontroller has taken every byte, and was never reset.
fn nothing_was_lost(stats: &Value) {
    for count in ["/uart/overruns", "/processor/resets"] {
        assert_eq!(number(stats, count), 0.0, "{count}: {stats}");
    }
}

/// A rig whose motor pulls with 3 N.
fn pulling(encoder: Encoder) -> Option<(SimulatedRig, Host)> {
    let mut rig = SimulatedRig::start(encoder, TMP, &LEFT_ALONE)?;
    let mut host = Host::greet(&rig);
    rig.order("patience 5");
    host.enable();
    host.hold(3000, 100);
    let force_n = number(&rig.stats(), "/motor/force_n");
    assert!((force_n - 3.0).abs() < 0.1, "{force_n} N");
    Some((rig, host))
}

#[test]
fn both_builds_pass_the_conformance_check() {
    for encoder in ENCODERS {
        let Some(mut rig) = SimulatedRig::start(encoder, TMP, &LEFT_ALONE) else {
            return;
        };
        println!("{}", encoder.name());
        if !conforms(rig.line(), "2") {
            return;
        }
        let stats = rig.stats();
        nothing_was_lost(&stats);
    }
}

#[test]
fn it_keeps_time_while_commands_come_in_bursts() {
    for encoder in ENCODERS {
        let Some(mut rig) = SimulatedRig::start(encoder, TMP, &["--amplitude", "0.05", "--frequency", "1"]) else {
            return;
        };
        let mut host = Host::greet(&rig);
        rig.order("patience 5");
        host.enable();
        host.hold(0, 1500);
        rig.clear();
        let before = rig.stats();
        let once_each = host.hold(2000, 1000);
        let stats = rig.stats();
        println!("{}, a command to each sample: {stats}", encoder.name());
        assert!(number(&stats, "/processor/load") < 0.6, "{stats}");

        // Three times as many, and most of them back to back, as from a host that was held up.
        let mut all = once_each;
        for _ in 0..50 {
            for _ in 0..20 {
                host.command(2000);
            }
            all.extend(host.hold(2000, 10));
        }
        let last = host.sequence;
        while all.last().is_some_and(|sample| sample.command != last) {
            for message in host.receive() {
                if let FromDevice::Sample(sample) = message {
                    all.push(sample);
                }
            }
        }
        for pair in all.windows(2) {
            assert_eq!(pair[1].sequence, pair[0].sequence + 1);
            let period_us = pair[1].time_us - pair[0].time_us;
            assert!(period_us.abs_diff(1000) < 20, "{period_us} us: {pair:?}");
            assert!(pair[1].enabled, "{pair:?}");
        }
        let stats = rig.stats();
        println!("{}, in bursts: {stats}", encoder.name());
        nothing_was_lost(&stats);
        // The UART holds two bytes, of 160 cycles each, while it takes in a third.
        assert!(
            number(&stats, "/interrupts/uart received/longest_wait_cycles") < 320.0,
            "{stats}"
        );
        assert!(number(&stats, "/processor/memory_never_used") > 1000.0, "{stats}");
        // A sample leaves within 0.3 ms of its tick.
        assert!(number(&stats, "/uart/longest_to_frame_cycles") < 4800.0, "{stats}");
        assert!(number(&stats, "/handle/travel_m") > 0.05, "{before} {stats}");
    }
}

#[test]
fn hung_main_loop_releases_motor_in_promised_time() {
    for encoder in ENCODERS {
        // The hardware watchdog after 32 ms, whether interrupts still come or not; and where the
        // loop that hangs kicks it, the interrupt's after 50.
        for (how, resets, promised_s) in [
            ("loop", 1.0, 0.033),
            ("deaf", 1.0, 0.033),
            ("clock", 1.0, 0.033),
            ("kicking", 0.0, WATCHDOG_S),
        ] {
            let Some((mut rig, _host)) = pulling(encoder) else {
                return;
            };
            let before = rig.stats();
            rig.order(&format!("hang {how}"));
            rig.order("patience 0");
            let hung_s = number(&rig.stats(), "/time_s");
            let stats = rig.live(0.2);
            let off_s = number(&stats, "/motor/last_on_s");
            assert!(off_s > number(&before, "/time_s"), "{how}: it was on");
            let after_s = off_s - hung_s;
            assert!(after_s <= promised_s + PIN_S, "{how}: {after_s} s after");
            let ended = ["/processor/resets", "/motor/force_n"].map(|name| number(&stats, name).abs());
            assert_eq!(ended, [resets, 0.0], "{how}: {stats}");
        }
    }
}

#[test]
fn a_reset_leaves_no_force_whatever_the_host_commands() {
    for encoder in ENCODERS {
        let Some((mut rig, mut host)) = pulling(encoder) else {
            return;
        };
        rig.order("patience 0");
        let reset_s = number(&rig.stats(), "/time_s");
        rig.order("reset");
        for _ in 0..100 {
            host.command(3000);
            rig.live(0.001);
        }
        let stats = rig.stats();
        let off_s = number(&stats, "/motor/last_on_s");
        // Orders are taken between two slices of simulated time.
        assert!(off_s - reset_s < 0.001, "{} s after: {stats}", off_s - reset_s);
        assert_eq!(number(&stats, "/motor/force_n").abs(), 0.0, "{stats}");
    }
}

#[test]
fn a_host_that_falls_silent_is_noticed_by_the_firmware_alone() {
    for encoder in ENCODERS {
        let Some((mut rig, mut host)) = pulling(encoder) else {
            return;
        };
        rig.order("patience 0");
        let bitten = host.wait_for("the watchdog", |message| match message {
            FromDevice::Sample(sample) if sample.watchdog => Some(*sample),
            _ => None,
        });
        assert!(!bitten.enabled);
        // And stays off.
        let stats = rig.live(0.1);
        let after_s = number(&stats, "/motor/last_on_s") - number(&stats, "/motor/last_frame_s");
        // It counts whole ticks, and the command takes a moment to be read.
        assert!(
            (WATCHDOG_S - 0.002..=WATCHDOG_S + 0.0005).contains(&after_s),
            "{after_s} s: {stats}"
        );
    }
}

#[test]
fn a_sensor_whose_wire_is_off_takes_the_motor_away() {
    let Some((mut rig, mut host)) = pulling(Encoder::Magneto) else {
        return;
    };
    rig.order("cut");
    let cut_s = number(&rig.stats(), "/time_s");
    let is_sensor_error = |message: &FromDevice| {
        matches!(
            message,
            FromDevice::Error {
                code: ErrorCode::Sensor,
                ..
            }
        )
    };
    // On a busy machine samples from before the cut are still on the line.
    let began = Instant::now();
    while !host.others.iter().any(is_sensor_error) {
        assert!(began.elapsed() < PATIENCE, "{:?}", host.others);
        host.hold(3000, 20);
    }
    let off_s = number(&rig.stats(), "/motor/last_on_s");
    assert!(off_s - cut_s < 0.0015, "{} s after", off_s - cut_s);
}
