//! What the programs of the fakes share: their options, the priority of their process, and how they end.

use super::fault::TimedFault;
use super::faulty_line::FaultyLine;
use super::hand::{Hand, HandMotion};
use super::path::{Figure, Path, motion_of};
use super::port::Place;
use haptic_core::planar::Plane;
use std::io;
use std::path::PathBuf;
use std::process::ExitCode;
use std::str::FromStr;

/// The options of every fake, but for its faults: each has its own.
#[derive(Clone, Debug, clap::Args)]
pub struct ProgramOptions {
    /// Hand on the handle: sine, arm, free or a file; in the plane circle, eight, zigzag, free or a file
    /// [default: sine, circle]
    ///
    /// `sine` moves to and fro, whatever the force, and a file of one axis likewise. `arm` does so through a spring
    /// (500 N/m) and a damper (5 N s/m), as all hands of a plane do. `free` is no hand. A file has the columns
    /// t_s,position_m, in the plane t_s,x,y, in s and m, and repeats.
    #[arg(long, value_name = "HAND")]
    hand: Option<HandName>,

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
    /// The hand that was asked for, on a line.
    ///
    /// # Errors
    /// It is the hand of a plane, or its file cannot be read.
    pub fn hand(&self) -> Result<Hand, String> {
        let motion = HandMotion::Sine {
            amplitude_m: self.hand_amplitude_m,
            frequency_hz: self.hand_frequency_hz,
        };
        match &self.hand {
            Some(HandName::Sine) | None => Ok(Hand::Prescribed(motion)),
            Some(HandName::Arm) => Ok(Hand::arm(motion)),
            Some(HandName::Free) => Ok(Hand::Free),
            Some(HandName::File(file)) => motion_of(file).map(Hand::Prescribed),
            Some(HandName::Figure(_)) => Err("--hand of a rig on a line is sine, arm, free or a file".to_owned()),
        }
    }

    /// The path of the hand that was asked for, in the plane, around a place, m; `None` without a hand.
    ///
    /// # Errors
    /// It is the hand of a line, or its file cannot be read.
    pub fn path(&self, middle: Plane) -> Result<Option<Path>, String> {
        let figure = match &self.hand {
            Some(HandName::Free) => return Ok(None),
            Some(HandName::File(file)) => return Path::open(file).map(Some),
            Some(HandName::Sine | HandName::Arm) => {
                return Err("--hand of a rig in the plane is circle, eight, zigzag, free or a file".to_owned());
            }
            Some(HandName::Figure(figure)) => *figure,
            None => Figure::Circle,
        };
        Ok(Some(Path::Figure {
            figure,
            middle,
            amplitude_m: self.hand_amplitude_m,
            frequency_hz: self.hand_frequency_hz,
        }))
    }
}

/// Runs a fake on its line, at a place where hosts end frames with a byte, until it is asked to quit; what it fails
/// with goes to standard error.
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

#[derive(Clone, Debug)]
enum HandName {
    Sine,
    Arm,
    Free,
    Figure(Figure),
    File(PathBuf),
}

impl FromStr for HandName {
    type Err = String;

    fn from_str(name: &str) -> Result<Self, String> {
        Ok(match name {
            "sine" => Self::Sine,
            "arm" => Self::Arm,
            "free" => Self::Free,
            "circle" => Self::Figure(Figure::Circle),
            "eight" => Self::Figure(Figure::Eight),
            "zigzag" => Self::Figure(Figure::Zigzag),
            file if std::path::Path::new(file).is_file() => Self::File(file.into()),
            _ => return Err("neither sine, arm, free, circle, eight or zigzag nor a file".to_owned()),
        })
    }
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
