//! What the programs of the fakes share: their options, the priority of their process, and how they end.

use super::fault::TimedFault;
use super::faulty_line::FaultyLine;
use super::hand::{Hand, Motion};
use super::port::Place;
use clap::ValueEnum;
use std::io;
use std::path::PathBuf;
use std::process::ExitCode;

/// The options of every fake, but for its faults: each has its own.
#[derive(Clone, Debug, clap::Args)]
pub struct ProgramOptions {
    /// Hand on the handle
    #[arg(long, value_name = "HAND", default_value = "sine")]
    hand: HandKind,

    /// Amplitude of the hand, m
    #[arg(long, value_name = "M", default_value_t = 0.03)]
    hand_amplitude_m: f64,

    /// Frequency of the hand, Hz
    #[arg(long, value_name = "HZ", default_value_t = 0.5)]
    hand_frequency_hz: f64,

    /// File of faults, one a line; `#` begins a comment
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,

    /// Stay at an ordinary priority [default: a real-time one if permitted, as a microcontroller is
    /// never late]
    #[arg(long)]
    ordinary_priority: bool,

    /// Seed of everything random
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
}

impl ProgramOptions {
    /// The hand that was asked for.
    #[must_use]
    pub fn hand(&self) -> Hand {
        let motion = Motion::Sine {
            amplitude_m: self.hand_amplitude_m,
            frequency_hz: self.hand_frequency_hz,
        };
        match self.hand {
            HandKind::Sine => Hand::Prescribed(motion),
            HandKind::Arm => Hand::Arm {
                stiffness_n_per_m: 500.0,
                damping_ns_per_m: 5.0,
                motion,
            },
            HandKind::Free => Hand::Free,
        }
    }
}

/// Runs a fake on its line, at a place where hosts end frames with a byte, until it is asked to quit; what it fails with goes
/// to standard error.
#[must_use]
pub fn run(
    name: &str,
    options: &ProgramOptions,
    faults: &[TimedFault],
    place: (Place, u8),
    fake: impl FnOnce(FaultyLine) -> io::Result<()>,
) -> ExitCode {
    if !options.ordinary_priority {
        take_priority();
    }
    let line = FaultyLine::new(place, faults, options.script.as_deref(), options.seed);
    match line.and_then(|line| fake(line).map_err(|error| error.to_string())) {
        Ok(()) => ExitCode::SUCCESS,
        Err(why) => {
            eprintln!("{name}: {why}");
            ExitCode::FAILURE
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum HandKind {
    /// Moves to and fro, whatever the force
    Sine,
    /// Pulls to and fro through a spring (500 N/m) and a damper (5 N s/m)
    Arm,
    /// No hand
    Free,
}

/// Below the priority of hapticd's thread.
const PRIORITY: libc::c_int = 60;

/// Takes a real-time priority for this process, if permitted: a microcontroller is never late.
#[expect(unsafe_code, reason = "scheduling has no safe wrapper")]
fn take_priority() {
    let wanted = PRIORITY;
    // SAFETY: reads one number of this frame. Without the right to it the priority stays ordinary.
    unsafe { libc::syscall(libc::SYS_sched_setscheduler, 0, libc::SCHED_FIFO, &raw const wanted) };
}
