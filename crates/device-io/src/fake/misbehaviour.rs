//! Faults of a firmware, on purpose: a wrong clock, a motor that stays on, a wrong sample.

use super::fault::{FaultSyntax, SWITCH};
use Misbehaviour::{
    Button, Clock, Error, ForceLimit, HandOff, HandRests, Honest, IgnoreCommandOff, IgnoreOff, KeepMark, NoEcho,
    PositionSpike, SequenceJump, StayEnabled, WatchdogMs,
};

/// A fault of a device's clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ClockFault {
    /// From now on its speed is multiplied by this: 0 stands still, -1 runs backwards.
    Speed(f64),
    /// It jumps once by this much, ms.
    Jump(f64),
    /// Its stamps have 16 bits: they wrap around each 65.536 ms.
    Wrap16,
    /// Its two halves of 16 bits are read apart: after a carry the first stamp has the old upper
    /// half.
    Torn,
}

/// A fault of a firmware, from now on unless its description says otherwise.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Misbehaviour {
    /// Its clock is wrong.
    Clock(ClockFault),
    /// Error of the next sample of the first axis, mm; of a rotary one, mrad.
    PositionSpike(f64),
    /// Jump of the sequence of its samples.
    SequenceJump(u32),
    /// An enable(off) is acknowledged and not carried out.
    IgnoreOff,
    /// A command without "enabled" leaves the motor enabled, with the force that it had.
    IgnoreCommandOff,
    /// Only a hello switches the motor off, not even its watchdog; the motor gives the last force
    /// that flowed.
    StayEnabled,
    /// Its watchdog's mark stays when the motor is enabled.
    KeepMark,
    /// Its samples no longer name the newest command.
    NoEcho,
    /// A button, from 1, is pressed or let go.
    Button(u8, bool),
    /// The hand in a plane goes back to where the rig was switched on and rests there, or draws again.
    HandRests(bool),
    /// The hand in a plane is off the handle, or on it again.
    HandOff(bool),
    /// Its force limit from the next hello on, N.
    ForceLimit(f64),
    /// The time limit of its watchdog from the next hello on, ms; 0 is never.
    WatchdogMs(u16),
    /// It reports an error, by its code and detail, and switches the motor off where the code is
    /// not 1.
    Error(u8, u32),
    /// Everything is right again but for the values of its hello.
    Honest,
}

/// All of them.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "checked to lie within"
)]
pub(super) static OF_FIRMWARE: [FaultSyntax<Misbehaviour>; 22] = [
    ("clock-backwards", &[], |_, _| speed(-1.0)),
    ("clock-stop", &[], |_, _| speed(0.0)),
    ("clock-half", &[], |_, _| speed(0.5)),
    ("clock-double", &[], |_, _| speed(2.0)),
    ("clock-speed FACTOR", &[(-1e2, 1e2)], |factor, _| speed(factor)),
    ("clock-jump MS", &[(-2e6, 2e6)], |ms, _| Clock(ClockFault::Jump(ms))),
    ("clock-wrap16", &[], |_, _| Clock(ClockFault::Wrap16)),
    ("clock-torn", &[], |_, _| Clock(ClockFault::Torn)),
    ("position-spike MM", &[(-1e6, 1e6)], |mm, _| PositionSpike(mm)),
    ("sequence-jump N", &[(0.0, 4_294_967_295.0)], |by, _| {
        SequenceJump(by as u32)
    }),
    ("ignore-off", &[], |_, _| IgnoreOff),
    ("ignore-command-off", &[], |_, _| IgnoreCommandOff),
    ("stay-enabled", &[], |_, _| StayEnabled),
    ("keep-mark", &[], |_, _| KeepMark),
    ("no-echo", &[], |_, _| NoEcho),
    ("button N on|off", BUTTON, |number, on| Button(number as u8, on > 0.0)),
    ("hand-rests on|off", &[SWITCH], |on, _| HandRests(on > 0.0)),
    ("hand-off on|off", &[SWITCH], |on, _| HandOff(on > 0.0)),
    ("force-limit N", &[(0.0, 1e6)], |limit_n, _| ForceLimit(limit_n)),
    ("watchdog-ms MS", &[(0.0, 65_535.0)], |ms, _| WatchdogMs(ms as u16)),
    ("error CODE DETAIL", ERROR, |code, detail| {
        Error(code as u8, detail as u32)
    }),
    ("honest", &[], |_, _| Honest),
];

const BUTTON: &[(f64, f64)] = &[(1.0, 8.0), SWITCH];
const ERROR: &[(f64, f64)] = &[(1.0, 255.0), (0.0, 4_294_967_295.0)];

fn speed(factor: f64) -> Misbehaviour {
    Clock(ClockFault::Speed(factor))
}

/// The clock of a device: a true one, falsified.
#[derive(Clone, Copy, Debug)]
pub(super) struct FaultyClock {
    speed: f64,
    /// The offset at the last change of speed, and the time of that change, us.
    added_us: f64,
    since_us: u64,
    wrap16: bool,
    torn: bool,
    /// The stamp before, for its upper half.
    last_us: u32,
}

impl Default for FaultyClock {
    fn default() -> Self {
        Self {
            speed: 1.0,
            added_us: 0.0,
            since_us: 0,
            wrap16: false,
            torn: false,
            last_us: 0,
        }
    }
}

impl FaultyClock {
    /// Begins a fault at a true time, us.
    pub(super) fn distort(&mut self, fault: ClockFault, true_us: u64) {
        self.added_us = self.added_at_us(true_us);
        self.since_us = true_us;
        match fault {
            ClockFault::Speed(speed) => self.speed = speed,
            ClockFault::Jump(ms) => self.added_us += ms * 1000.0,
            ClockFault::Wrap16 => self.wrap16 = true,
            ClockFault::Torn => self.torn = true,
        }
    }

    /// Ends all faults at a true time, us; the clock continues from its present value.
    pub(super) fn restore(&mut self, true_us: u64) {
        *self = Self {
            added_us: self.added_at_us(true_us),
            since_us: true_us,
            ..Self::default()
        };
    }

    #[expect(clippy::cast_precision_loss, reason = "microseconds of a run are far below 2^53")]
    fn added_at_us(&self, true_us: u64) -> f64 {
        self.added_us + (self.speed - 1.0) * true_us.saturating_sub(self.since_us) as f64
    }

    /// The false stamp for an honest one at a true time, both us.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a clock that wraps around"
    )]
    pub(super) fn stamp(&mut self, honest_us: u32, true_us: u64) -> u32 {
        let false_us = honest_us.wrapping_add(self.added_at_us(true_us).round() as i64 as u32);
        let upper_us = if self.torn { self.last_us } else { false_us } & 0xFFFF_0000;
        self.last_us = false_us;
        if self.wrap16 {
            false_us & 0xFFFF
        } else {
            upper_us | false_us & 0xFFFF
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_is_distorted_as_its_fault_says() {
        let stamps = |fault: ClockFault| {
            let mut clock = FaultyClock::default();
            assert_eq!(clock.stamp(65_000, 65_000), 65_000);
            clock.distort(fault, 65_000);
            [66_000, 67_000].map(|us| clock.stamp(us, u64::from(us)))
        };
        assert_eq!(stamps(ClockFault::Speed(-1.0)), [64_000, 63_000]);
        assert_eq!(stamps(ClockFault::Speed(0.0)), [65_000, 65_000]);
        assert_eq!(stamps(ClockFault::Speed(0.5)), [65_500, 66_000]);
        assert_eq!(stamps(ClockFault::Speed(2.0)), [67_000, 69_000]);
        assert_eq!(stamps(ClockFault::Jump(-20.0)), [46_000, 47_000]);
        assert_eq!(stamps(ClockFault::Wrap16), [464, 1464]);
        assert_eq!(stamps(ClockFault::Torn), [464, 67_000]);
        let mut clock = FaultyClock::default();
        clock.distort(ClockFault::Speed(2.0), 0);
        clock.restore(1000);
        assert_eq!(clock.stamp(1500, 1500), 2500, "it continues from where it was");
    }
}
