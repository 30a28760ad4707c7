//! Faults of a firmware, on purpose: a wrong clock, a motor that stays on, a wrong sample.

use std::fmt;

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
    /// Error of the next sample, mm.
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

impl Misbehaviour {
    /// All lines, for a help text.
    pub const HELP: &'static str = "clock-backwards, clock-stop, clock-half, clock-double, clock-speed FACTOR, \
        clock-jump MS, clock-wrap16, clock-torn, position-spike MM, sequence-jump N, ignore-off, ignore-command-off, \
        stay-enabled, keep-mark, no-echo, button N on|off, force-limit N, watchdog-ms MS, error CODE DETAIL, honest";

    /// Reads the words of a line; nothing for a line that is not a misbehaviour.
    ///
    /// # Errors
    /// A number is out of range or not a number, or there are too many words or too few.
    pub fn read(words: &[&str]) -> Option<Result<Self, String>> {
        let (&name, values) = words.split_first()?;
        let clock = |fault| Ok(Self::Clock(fault));
        let one = |least: f64, most: f64| match values {
            [value] => within(name, value, least, most),
            _ => Err(format!("{name} takes one number")),
        };
        let without = match name {
            "clock-backwards" => Some(Self::Clock(ClockFault::Speed(-1.0))),
            "clock-stop" => Some(Self::Clock(ClockFault::Speed(0.0))),
            "clock-half" => Some(Self::Clock(ClockFault::Speed(0.5))),
            "clock-double" => Some(Self::Clock(ClockFault::Speed(2.0))),
            "clock-wrap16" => Some(Self::Clock(ClockFault::Wrap16)),
            "clock-torn" => Some(Self::Clock(ClockFault::Torn)),
            "ignore-off" => Some(Self::IgnoreOff),
            "ignore-command-off" => Some(Self::IgnoreCommandOff),
            "stay-enabled" => Some(Self::StayEnabled),
            "keep-mark" => Some(Self::KeepMark),
            "no-echo" => Some(Self::NoEcho),
            "honest" => Some(Self::Honest),
            _ => None,
        };
        if let Some(without) = without {
            return Some(if values.is_empty() {
                Ok(without)
            } else {
                Err(format!("{name} takes nothing else"))
            });
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "checked to lie within"
        )]
        Some(match name {
            "clock-speed" => one(-100.0, 100.0).and_then(|speed| clock(ClockFault::Speed(speed))),
            "clock-jump" => one(-2e6, 2e6).and_then(|ms| clock(ClockFault::Jump(ms))),
            "position-spike" => one(-1e6, 1e6).map(Self::PositionSpike),
            "sequence-jump" => one(0.0, f64::from(u32::MAX)).map(|by| Self::SequenceJump(by as u32)),
            "force-limit" => one(0.0, 1e6).map(Self::ForceLimit),
            "watchdog-ms" => one(0.0, 65_535.0).map(|ms| Self::WatchdogMs(ms as u16)),
            "button" => match values {
                [number, state @ ("on" | "off")] => {
                    within(name, number, 1.0, 8.0).map(|number| Self::Button(number as u8, *state == "on"))
                }
                _ => Err("button takes a number from 1 to 8, and on or off".to_owned()),
            },
            "error" => match values {
                [code, detail] => within("error's code", code, 1.0, 255.0).and_then(|code| {
                    let detail = within("error's detail", detail, 0.0, f64::from(u32::MAX))?;
                    Ok(Self::Error(code as u8, detail as u32))
                }),
                _ => Err("error takes a code and a detail".to_owned()),
            },
            _ => return None,
        })
    }
}

fn within(name: impl fmt::Display, text: &str, least: f64, most: f64) -> Result<f64, String> {
    let value: f64 = text
        .parse()
        .ok()
        .filter(|value: &f64| value.is_finite())
        .ok_or_else(|| format!("`{text}` is not a number"))?;
    if (least..=most).contains(&value) {
        Ok(value)
    } else {
        Err(format!(
            "{name} = {value} is out of range: it must be from {least} to {most}"
        ))
    }
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
        let told_us = honest_us.wrapping_add(self.added_at_us(true_us).round() as i64 as u32);
        let upper_us = if self.torn { self.last_us } else { told_us } & 0xFFFF_0000;
        self.last_us = told_us;
        if self.wrap16 {
            told_us & 0xFFFF
        } else {
            upper_us | told_us & 0xFFFF
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_lies_as_it_is_told() {
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

    #[test]
    fn words_say_what_a_firmware_does_wrong() {
        let read = |line: &str| Misbehaviour::read(&line.split(' ').collect::<Vec<_>>());
        assert_eq!(
            read("clock-half"),
            Some(Ok(Misbehaviour::Clock(ClockFault::Speed(0.5))))
        );
        assert_eq!(read("button 3 on"), Some(Ok(Misbehaviour::Button(3, true))));
        assert_eq!(
            read("error 255 4000000000"),
            Some(Ok(Misbehaviour::Error(255, 4_000_000_000)))
        );
        assert_eq!(read("loss 0.1"), None);
        for wrong in [
            "clock-half 2",
            "button 0 on",
            "button 1",
            "error 3",
            "position-spike",
            "position-spike x",
        ] {
            assert!(read(wrong).is_some_and(|read| read.is_err()), "{wrong}");
        }
        // Each of the help text is one.
        for line in Misbehaviour::HELP.split(", ") {
            let line = line
                .replace("on|off", "on")
                .replace("CODE DETAIL", "2 7")
                .replace(" N", " 1")
                .replace(" MS", " 1")
                .replace(" MM", " 1")
                .replace(" FACTOR", " 1");
            assert!(matches!(read(&line), Some(Ok(_))), "{line}");
        }
    }
}
