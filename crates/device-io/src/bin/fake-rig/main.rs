//! The fake rig behind a link: the plant of the daemon's own fake rig, a firmware that speaks the
//! link protocol, and a link that fails on request.

mod messages;
mod plant;

use clap::Parser;
use device_io::fake::{
    self, Fault, FaultyLine, Firmware, FirmwareProperties, Order, Place, ProgramOptions, TimedFault,
};
use device_io::now_ns;
use device_io::protocol::message::{DeviceHello, ErrorCode, FromDevice, FromHost};
use messages::{Messages, Received};
use plant::PlantOptions;
use std::fs::File;
use std::io::{self, Write as _};
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Duration;

/// A fake rig behind a pseudo-terminal, for `hapticd --device serial:LINK`, or on the device's side
/// of a USB function.
///
/// It speaks the link protocol as a microcontroller does. Faults are lines such as `loss 0.05` or
/// `at 2.5 hang-up 0.3`, from --fault, from a script, or on standard input while it runs.
#[derive(Debug, Parser)]
#[command(name = "fake-rig", version, max_term_width = 80)]
struct Options {
    #[command(flatten)]
    place: PlaceOptions,

    /// Samples a second, Hz, from 10 to 20000
    #[arg(long, value_name = "HZ", default_value_t = 1000, value_parser = clap::value_parser!(u32).range(10..=20_000))]
    sample_rate_hz: u32,

    /// Time without a command after which the firmware's watchdog switches the motor off, ms; 0 for
    /// no watchdog
    #[arg(long, value_name = "MS", default_value_t = 50)]
    watchdog_ms: u16,

    /// Number of buttons, up to 8
    #[arg(long, value_name = "N", default_value_t = 0, value_parser = clap::value_parser!(u8).range(0..=8))]
    buttons: u8,

    /// Drift of the device's clock, parts in a million, positive if it is fast
    #[arg(long, value_name = "PPM", default_value_t = 0.0, allow_hyphen_values = true)]
    clock_ppm: f64,

    /// Name of the firmware, up to 24 letters, as in `mine 1.0#a1b2` with its chip's number
    #[arg(long, value_name = "NAME")]
    firmware_name: Option<String>,

    /// File for every command, as it acts: time of the monotonic clock, us, sequence, force, mN, of
    /// two axes the second force, and whether the motor may be driven, 0 or 1
    #[arg(long, value_name = "FILE")]
    commands: Option<PathBuf>,

    /// Wire a motor the other way round, or all [default with the option: all]
    #[arg(long, value_name = "MOTOR", num_args = 0..=1, default_missing_value = "all")]
    reversed: Option<Reversed>,

    /// Swap the plugs of two encoders or motors [default with the option: encoders]
    #[arg(long, value_name = "PLUGS", num_args = 0..=1, default_missing_value = "encoders")]
    swapped: Option<Swapped>,

    #[command(flatten)]
    plant: PlantOptions,

    /// A fault, now or `at` a time in seconds; may be given again
    #[arg(long, value_name = "FAULT", long_help = format!(
        "A fault, now or `at` a time in seconds; may be given again: {}",
        Fault::help().join("; and of the firmware: ")
    ))]
    fault: Vec<TimedFault>,

    #[command(flatten)]
    program: ProgramOptions,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Reversed {
    #[value(name = "1")]
    First,
    #[value(name = "2")]
    Second,
    All,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Swapped {
    Encoders,
    Motors,
}

#[derive(Debug, clap::Args)]
#[group(required = true, multiple = false)]
struct PlaceOptions {
    /// Path of a symbolic link to a new pseudo-terminal; removed at the end
    #[arg(long, value_name = "LINK")]
    pty: Option<PathBuf>,

    /// Terminal to speak on while it exists, such as /dev/ttyGS0 of a USB gadget
    #[arg(long, value_name = "PATH")]
    tty: Option<PathBuf>,

    /// Node of a USB gadget to speak on while it exists, in reports of 64 bytes, such as /dev/hidg0
    #[arg(long, value_name = "PATH")]
    hid: Option<PathBuf>,
}

impl PlaceOptions {
    fn place(&self) -> Place {
        let places = [
            self.pty.clone().map(Place::Pty),
            self.tty.clone().map(Place::Tty),
            self.hid.clone().map(Place::Hid),
        ];
        // The group requires one of them.
        places
            .into_iter()
            .flatten()
            .next()
            .unwrap_or(Place::Pty(PathBuf::new()))
    }
}

fn main() -> ExitCode {
    let options = Options::parse();
    let place = options.place.place();
    fake::run("fake-rig", &options.program, &options.fault, (place, 0), |line| {
        SimulatedRig::new(&options, line)?.run()
    })
}

/// A line of the file of commands, of a message at a time, ns.
fn line_of(message: FromHost, now_ns: u64) -> Option<String> {
    let (sequence, force_mn, second_mn, enabled) = match message {
        FromHost::Hello { .. } => return None,
        FromHost::Command {
            sequence,
            force_mn,
            second_mn,
            enabled,
        } => (sequence, force_mn, second_mn, enabled),
        FromHost::Enable { sequence, enabled } => (sequence, 0, None, enabled),
    };
    let second_mn = second_mn.map_or(String::new(), |second_mn| format!("{second_mn} "));
    Some(format!(
        "{} {sequence} {force_mn} {second_mn}{}\n",
        now_ns / 1000,
        u8::from(enabled)
    ))
}

/// Time after which a sample that is not on its way was held up, ns: less than a period, so that the next one does not
/// seem to come too early by its stamp.
const HELD_UP_NS: u64 = 300_000;

/// Time without samples from which on they are lost, and the firmware's watchdog waits, ns: by their sequence and
/// stamps together the time since is known.
const LONG_HELD_UP_NS: u64 = 20_000_000;

struct SimulatedRig {
    messages: Messages,
    firmware: Firmware,
    version: Option<u8>,
    commands: Option<File>,
    line: FaultyLine,
    period_ns: u64,
    next_sample_ns: u64,
    /// When it wanted to run again.
    due_ns: u64,
}

impl SimulatedRig {
    fn new(options: &Options, line: FaultyLine) -> io::Result<Self> {
        let (mechanics, force_limit_n) = options.plant.mechanics(&options.program).map_err(io::Error::other)?;
        let properties = FirmwareProperties {
            sample_rate_hz: options.sample_rate_hz,
            force_limit_n,
            clock_ppm: options.clock_ppm,
            watchdog_ms: options.watchdog_ms,
            buttons: u8::try_from((1_u16 << options.buttons) - 1).unwrap_or(u8::MAX),
            name: match &options.firmware_name {
                Some(name) => DeviceHello::firmware_of(name),
                None => FirmwareProperties::default().name,
            },
            reversed: [Reversed::First, Reversed::Second]
                .map(|motor| options.reversed.is_some_and(|is| is == motor || is == Reversed::All)),
            swapped_encoders: options.swapped == Some(Swapped::Encoders),
            swapped_motors: options.swapped == Some(Swapped::Motors),
        };
        let began_ns = now_ns();
        Ok(Self {
            messages: Messages::new(options.place.hid.is_some()),
            firmware: Firmware::of(mechanics, properties),
            version: None,
            commands: options.commands.as_ref().map(File::create).transpose()?,
            line,
            period_ns: 1_000_000_000 / u64::from(options.sample_rate_hz),
            next_sample_ns: began_ns,
            due_ns: began_ns,
        })
    }

    /// Until standard input says `quit`, or for ever.
    fn run(&mut self) -> io::Result<()> {
        self.line.announce("fake-rig")?;
        loop {
            let now = now_ns();
            let late_ns = now.saturating_sub(self.due_ns);
            if late_ns > LONG_HELD_UP_NS {
                self.firmware.held_up(late_ns);
            }
            if self.take_orders(now) {
                return Ok(());
            }
            self.line.listen(now)?;
            while let Some(frame) = self.line.receive(now) {
                self.receive(&frame, now);
            }
            if now >= self.next_sample_ns {
                let missed = (now - self.next_sample_ns) / self.period_ns;
                self.next_sample_ns += (1 + missed) * self.period_ns;
                if !self.line.is_stalled(now) {
                    // A few that were missed are not made up for.
                    if missed * self.period_ns > LONG_HELD_UP_NS {
                        self.firmware.lose(missed);
                    }
                    self.sample();
                }
            }
            self.due_ns = self.line.flush_and_wait(self.next_sample_ns);
        }
    }

    /// Takes a sample and sends it at once.
    fn sample(&mut self) {
        let taken_ns = now_ns();
        let sample = self.firmware.sample(taken_ns);
        // A microcontroller is not held up between its stamp and its line, as this process is on a busy machine: what
        // would come late would belie its clock, and was never taken.
        match sample {
            Some(_) if now_ns() > taken_ns + HELD_UP_NS => self.firmware.take_back(),
            Some(sample) => self.send(&sample, taken_ns),
            None => {}
        }
    }

    /// Carries out all orders that are due; returns whether one of them ends the program.
    fn take_orders(&mut self, now: u64) -> bool {
        while let Some(order) = self.line.next_order(now) {
            match order {
                Order::Fail(fault) => self.fail(fault, now),
                Order::TellForce => {
                    // Its watchdog has bitten by now, even if the rest of it stands still.
                    self.firmware.advance(now);
                    println!(
                        "force {} largest {} watchdog {}",
                        self.firmware.force_n(),
                        self.firmware.take_largest_force_n(),
                        u8::from(self.firmware.watchdog_has_tripped())
                    );
                }
                Order::Quit => return true,
            }
        }
        false
    }

    fn fail(&mut self, fault: Fault, now: u64) {
        match fault {
            Fault::Version(version) => self.version = Some(version),
            Fault::Jump(counts) => self.firmware.jump(counts),
            Fault::Wrap(seconds) => {
                let in_us = u32::try_from(Duration::from_secs_f64(seconds).as_micros()).unwrap_or(u32::MAX);
                self.firmware.wrap_in(in_us, now);
            }
            Fault::Firmware(misbehaviour) => {
                if let Some(error) = self.firmware.misbehave(misbehaviour, now) {
                    self.send(&error, now);
                }
            }
            // The line's own.
            _ => {}
        }
    }

    fn receive(&mut self, frame: &[u8], now: u64) {
        for received in self.messages.decode(frame, self.firmware.axes()) {
            let answer = match received {
                Received::Message(message) => {
                    if let (Some(file), Some(line)) = (&mut self.commands, line_of(message, now))
                        && let Err(error) = file.write_all(line.as_bytes())
                    {
                        eprintln!("fake-rig: a command was not written down: {error}");
                    }
                    self.firmware.receive(message, now)
                }
                Received::Bad(detail) => Some(FromDevice::Error {
                    code: ErrorCode::BadMessage,
                    detail,
                }),
            };
            if let Some(answer) = answer {
                self.send(&answer, now);
            }
        }
    }

    fn send(&mut self, message: &FromDevice, now: u64) {
        let mut bytes = message.bytes().as_slice().to_vec();
        if let Some(version) = self.version {
            bytes[1] = version;
        }
        self.line.send(self.messages.encode(&bytes), now);
    }
}
