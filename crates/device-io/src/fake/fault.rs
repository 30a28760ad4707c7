//! Faults of a link, on purpose.
//!
//! A fault is a line of text, from the command line, a script or standard input: its name and a
//! number. A fault at a later time begins with `at` and that time in seconds.
//!
//! ```text
//! loss 0.05          from now on one frame in twenty is lost, each way
//! at 2.5 hang-up 0.3 at 2.5 s the line is hung up for 0.3 s
//! clock-half         from now on the device's clock runs at half its speed
//! ```

use super::misbehaviour::{Misbehaviour, OF_FIRMWARE};
use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::str::FromStr;

/// One thing that goes wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// Additional delay of every frame, ms.
    Delay(f64),
    /// Largest random delay of a frame, ms; no frame overtakes another.
    Jitter(f64),
    /// Share of frames that are lost.
    Loss(f64),
    /// Share of frames that come twice.
    Double(f64),
    /// Share of frames with a few inverted bits.
    Corrupt(f64),
    /// Share of frames that are overtaken by the next.
    Reorder(f64),
    /// The device takes so many bytes a second, and what comes faster waits.
    Carry(f64),
    /// The firmware, but not its watchdog, stands still for this time, s.
    Stall(f64),
    /// The line is hung up for this time, s.
    HangUp(f64),
    /// The firmware says that it speaks this version.
    Version(u8),
    /// The encoder jumps, counts.
    Jump(i32),
    /// The clock wraps around this much later, s.
    Wrap(f64),
    /// The firmware does something wrong.
    Firmware(Misbehaviour),
}

/// A line of text, as a help text has it, the least and the most of its numbers, and the fault that it makes.
pub(super) type FaultSyntax<F> = (&'static str, &'static [(f64, f64)], fn(f64, f64) -> F);

const SHARE: &[(f64, f64)] = &[(0.0, 1.0)];

/// In place of a number's range: on or off, as 1 or 0.
pub(super) const SWITCH: (f64, f64) = (f64::NEG_INFINITY, f64::INFINITY);

/// The faults of the line.
#[expect(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "checked to lie within"
)]
static OF_LINE: [FaultSyntax<Fault>; 12] = [
    ("delay MS", &[(0.0, 1e4)], |ms, _| Fault::Delay(ms)),
    ("jitter MS", &[(0.0, 1e4)], |ms, _| Fault::Jitter(ms)),
    ("loss SHARE", SHARE, |share, _| Fault::Loss(share)),
    ("double SHARE", SHARE, |share, _| Fault::Double(share)),
    ("corrupt SHARE", SHARE, |share, _| Fault::Corrupt(share)),
    ("reorder SHARE", SHARE, |share, _| Fault::Reorder(share)),
    ("carry BYTES_PER_S", &[(1.0, 1e9)], |bytes, _| Fault::Carry(bytes)),
    ("stall S", &[(0.0, 3600.0)], |s, _| Fault::Stall(s)),
    ("hang-up S", &[(0.0, 3600.0)], |s, _| Fault::HangUp(s)),
    ("version N", &[(0.0, 255.0)], |n, _| Fault::Version(n as u8)),
    ("jump COUNTS", &[(-2e9, 2e9)], |counts, _| Fault::Jump(counts as i32)),
    ("wrap S", &[(0.0, 4294.0)], |s, _| Fault::Wrap(s)),
];

impl Fault {
    /// The lines of the faults of the line, and of those of the firmware, for a help text.
    #[must_use]
    pub fn help() -> [String; 2] {
        [help(&OF_LINE), help(&OF_FIRMWARE)]
    }
}

fn help<F>(lines: &[FaultSyntax<F>]) -> String {
    lines.iter().map(|(usage, ..)| *usage).collect::<Vec<_>>().join(", ")
}

/// Reads the words of a line; nothing if it is none of these.
fn read<F>(lines: &[FaultSyntax<F>], words: &[&str]) -> Option<Result<F, String>> {
    let (&name, values) = words.split_first()?;
    let (usage, ranges, make) = lines.iter().find(|(usage, ..)| usage.split(' ').next() == Some(name))?;
    let other = || format!("`{}` is not like `{usage}`", words.join(" "));
    let numbers = || {
        let mut numbers = [0.0; 2];
        for (index, value) in values.iter().enumerate() {
            let range = ranges.get(index).ok_or_else(other)?;
            numbers[index] = match *value {
                "on" | "off" if range == &SWITCH => f64::from(*value == "on"),
                _ if range == &SWITCH => return Err(other()),
                number_of => within(name, number(number_of)?, *range)?,
            };
        }
        if values.len() == ranges.len() {
            Ok(numbers)
        } else {
            Err(other())
        }
    };
    Some(numbers().map(|[first, second]| make(first, second)))
}

fn within(name: &str, value: f64, (least, most): (f64, f64)) -> Result<f64, String> {
    if (least..=most).contains(&value) {
        return Ok(value);
    }
    Err(format!(
        "{name} = {value} is out of range: it must be from {least} to {most}"
    ))
}

fn number(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|value: &f64| value.is_finite());
    value.ok_or_else(|| format!("`{text}` is not a number"))
}

/// A fault and its time, s since the start; at once without a time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TimedFault {
    /// Its time, s.
    pub at_s: Option<f64>,
    /// The fault.
    pub fault: Fault,
}

impl FromStr for TimedFault {
    type Err = String;

    fn from_str(line: &str) -> Result<Self, String> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let (at_s, words) = match &words[..] {
            ["at", at, words @ ..] => (Some(number(at)?), words),
            words => (None, words),
        };
        let of_firmware = || Some(read(&OF_FIRMWARE, words)?.map(Fault::Firmware));
        let fault = read(&OF_LINE, words).or_else(of_firmware).unwrap_or_else(|| {
            Err(format!(
                "unknown fault `{line}`: expected {}, or one of the firmware (fake-rig --help)",
                help(&OF_LINE)
            ))
        })?;
        Ok(Self { at_s, fault })
    }
}

/// The quality of a link. Shares are of frames.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quality {
    /// Delay of every frame, ms.
    pub delay_ms: f64,
    /// Largest random delay beyond that, ms.
    pub jitter_ms: f64,
    /// Lost.
    pub loss: f64,
    /// Sent twice.
    pub double: f64,
    /// Damaged.
    pub corrupt: f64,
    /// Overtaken by the next.
    pub reorder: f64,
    /// Time that a byte takes, ns.
    pub ns_per_byte: f64,
}

impl Quality {
    /// Takes on a fault of the link itself.
    ///
    /// # Errors
    /// The fault, if it is not one of the link.
    pub fn take(&mut self, fault: Fault) -> Result<(), Fault> {
        match fault {
            Fault::Delay(ms) => self.delay_ms = ms,
            Fault::Jitter(ms) => self.jitter_ms = ms,
            Fault::Loss(share) => self.loss = share,
            Fault::Double(share) => self.double = share,
            Fault::Corrupt(share) => self.corrupt = share,
            Fault::Reorder(share) => self.reorder = share,
            Fault::Carry(bytes_per_s) => self.ns_per_byte = 1e9 / bytes_per_s,
            other => return Err(other),
        }
        Ok(())
    }
}

/// One direction of a link, which treats its frames by its quality.
#[derive(Debug)]
pub struct Channel {
    random: fastrand::Rng,
    under_way: BinaryHeap<Reverse<(u64, u64, Vec<u8>)>>,
    sent: u64,
    last_due_ns: u64,
    /// A frame that waits to be overtaken.
    held: Option<Vec<u8>>,
}

impl Channel {
    /// An empty direction. The same seed gives the same faults.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self {
            random: fastrand::Rng::with_seed(seed),
            under_way: BinaryHeap::new(),
            sent: 0,
            last_due_ns: 0,
            held: None,
        }
    }

    /// Puts a frame on it at a time, ns.
    pub fn send(&mut self, mut frame: Vec<u8>, quality: &Quality, now_ns: u64) {
        if self.random.f64() < quality.loss {
            return;
        }
        if self.random.f64() < quality.corrupt && !frame.is_empty() {
            for _ in 0..self.random.usize(1..=8) {
                let at = self.random.usize(..frame.len());
                frame[at] ^= 1 << self.random.u8(..8);
            }
        }
        if self.held.is_none() && self.random.f64() < quality.reorder {
            self.held = Some(frame);
            return;
        }
        let double = self.random.f64() < quality.double;
        let overtaken = self.held.take();
        let frames = [Some(frame.clone()), double.then_some(frame), overtaken];
        for frame in frames.into_iter().flatten() {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "a delay, positive and short"
            )]
            let delay_ns = ((quality.delay_ms + quality.jitter_ms * self.random.f64()) * 1e6) as u64;
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                clippy::cast_precision_loss,
                reason = "a time, positive and short"
            )]
            let takes_ns = (quality.ns_per_byte * frame.len() as f64) as u64;
            // A line keeps the order of what is on it.
            self.last_due_ns = self.last_due_ns.max(now_ns + delay_ns) + takes_ns;
            self.sent += 1;
            self.under_way.push(Reverse((self.last_due_ns, self.sent, frame)));
        }
    }

    /// When the next frame comes out, ns.
    #[must_use]
    pub fn next_due_ns(&self) -> Option<u64> {
        self.under_way.peek().map(|Reverse((due_ns, _, _))| *due_ns)
    }

    /// The next frame that has come out by a time, ns.
    pub fn receive(&mut self, now_ns: u64) -> Option<Vec<u8>> {
        if self.next_due_ns()? > now_ns {
            return None;
        }
        self.under_way.pop().map(|Reverse((_, _, frame))| frame)
    }

    /// Everything on it is lost.
    pub fn clear(&mut self) {
        self.under_way.clear();
        self.held = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fake::ClockFault;

    #[test]
    fn lines_say_what_goes_wrong_and_when() {
        let read = |line: &str| line.parse::<TimedFault>();
        let clock = Misbehaviour::Clock(ClockFault::Speed(0.5));
        let error = Misbehaviour::Error(255, 4_000_000_000);
        for (line, at_s, fault) in [
            ("loss 0.05", None, Fault::Loss(0.05)),
            ("at 2.5 hang-up 0.3", Some(2.5), Fault::HangUp(0.3)),
            ("at 1 ignore-off", Some(1.0), Fault::Firmware(Misbehaviour::IgnoreOff)),
            ("button 3 on", None, Fault::Firmware(Misbehaviour::Button(3, true))),
            ("clock-half", None, Fault::Firmware(clock)),
            ("error 255 4000000000", None, Fault::Firmware(error)),
        ] {
            assert_eq!(read(line), Ok(TimedFault { at_s, fault }));
        }
        for wrong in [
            "",
            "loss",
            "loss 2",
            "loss nan",
            "lose 0.1",
            "at x loss 0.1",
            "version 256",
            "at 1 loss 0.1 2",
            "at 1",
            "at 1 clock-half 2",
            "button 0 on",
            "button 1",
            "button 1 1",
            "error 3",
            "position-spike x",
        ] {
            let error = read(wrong).expect_err(wrong);
            assert!(error.len() > 10, "{wrong}: {error}");
        }
    }

    #[test]
    fn a_channel_does_what_its_quality_says() {
        let with = |set: fn(&mut Quality)| {
            let (mut quality, mut channel) = (Quality::default(), Channel::new(7));
            set(&mut quality);
            let mut came = Vec::new();
            for k in 0..10_000_u64 {
                channel.send(k.to_le_bytes().to_vec(), &quality, k * 1_000_000);
                while let Some(frame) = channel.receive(k * 1_000_000) {
                    came.push((k, frame));
                }
            }
            came
        };
        let perfect = with(|_| {});
        assert!(perfect.len() == 10_000 && perfect.iter().all(|(k, frame)| k.to_le_bytes() == frame[..]));
        let lossy = with(|quality| quality.loss = 0.1);
        assert!((8800..9200).contains(&lossy.len()), "{}", lossy.len());
        let doubled = with(|quality| quality.double = 0.1);
        assert!((10_800..11_200).contains(&doubled.len()), "{}", doubled.len());
        let of = |frame: &[u8]| frame.first_chunk().map(|bytes| u64::from_le_bytes(*bytes));
        let reordered = with(|quality| quality.reorder = 0.1);
        let is_back = |pair: &&[(u64, Vec<u8>)]| of(&pair[1].1) < of(&pair[0].1);
        let back = reordered.windows(2).filter(is_back).count();
        assert!((700..1000).contains(&back), "{back}");
        let jittery = with(|quality| (quality.delay_ms, quality.jitter_ms) = (2.0, 5.0));
        let late: Vec<u64> = jittery.iter().filter_map(|(k, frame)| Some(k - of(frame)?)).collect();
        assert!(late.iter().all(|late| (2..=8).contains(late)) && late.contains(&3) && late.contains(&7));
        // A line keeps its order.
        assert!(jittery.windows(2).all(|pair| of(&pair[0].1) < of(&pair[1].1)));
    }
}
