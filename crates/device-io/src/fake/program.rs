//! The hand and the priority of the fakes' programs.

use super::hand::Hand;
use super::motion::Motion;
use clap::ValueEnum;

/// The hand's options on the command line.
#[derive(Clone, Copy, Debug, clap::Args)]
pub struct HandOptions {
    /// Hand on the handle
    #[arg(long, value_name = "HAND", default_value = "sine")]
    hand: HandKind,

    /// Amplitude of the hand, m
    #[arg(long, value_name = "M", default_value_t = 0.03)]
    hand_amplitude_m: f64,

    /// Frequency of the hand, Hz
    #[arg(long, value_name = "HZ", default_value_t = 0.5)]
    hand_frequency_hz: f64,
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

impl HandOptions {
    /// The hand of these options.
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

/// Below the priority of hapticd's thread.
const PRIORITY: libc::c_int = 60;

/// Takes a real-time priority for this process, if permitted: a microcontroller is never late.
#[expect(unsafe_code, reason = "scheduling has no safe wrapper")]
pub fn take_priority() {
    let wanted = libc::sched_param {
        sched_priority: PRIORITY,
    };
    // SAFETY: reads one structure of this frame. Without the right to it the priority stays ordinary.
    unsafe { libc::sched_setscheduler(0, libc::SCHED_FIFO, &raw const wanted) };
}
