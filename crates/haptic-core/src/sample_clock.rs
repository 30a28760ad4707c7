//! The time between two samples of a device, checked against the host's clock before it is used.
//!
//! Three measures of that time are at hand: the device's time stamps, its sequence numbers times
//! the sampling period, and our own clock. The stamps are the best of them, as neither the link's
//! jitter nor our own is in them, and they are used as they are unless both others contradict them:
//! then the middle one of the three is, so that no single wrong clock is ever rendered. A device
//! whose stamps run backwards, stand still, jump or drift is an error besides.

use crate::snapshot::Archive;
use core::mem::replace;
use thiserror::Error;

/// Time over which the two clocks are compared, ns.
const WINDOW_NS: u64 = 100_000_000;

/// Fewest samples in such a window.
const WINDOW_SAMPLES: u32 = 8;

/// Share by which the device's clock may run faster or slower than ours. A quartz keeps to 1e-4 and
/// a microcontroller's RC oscillator to 3 %; a wrong prescaler is off by a factor.
const MAX_DRIFT: f64 = 0.05;

/// What the quickest samples of two windows may differ by in their time on the way, s.
const JITTER_S: f64 = 0.003;

/// Share by which a stamp may differ from another measure of the same time and still agree with it.
const AGREEMENT: f64 = 0.4;

/// Samples in a row that may have the same stamp: a clock that counts milliseconds gives two the
/// same now and then.
const MAX_EQUAL: u32 = 2;

/// Steps of the sequence up to which the sampling period foretells a time.
const MAX_STEP: u32 = 1000;

/// When a sample was taken and when it came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamp {
    /// Number of the sample; it wraps around.
    pub sequence: u32,
    /// When it was taken, on the device's clock, ns. A clock that runs backwards looks like one
    /// that leaps ahead, because it is taken for one that has wrapped around.
    pub device_ns: u64,
    /// When it was first read, on our clock, ns.
    pub host_ns: u64,
}

/// What is wrong with a device's clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum ClockError {
    /// It ran backwards, jumped, or wrapped around where it should not.
    #[error("its time stamps jump")]
    Jumped,
    /// Samples that follow one another have the same stamp.
    #[error("its time stamps stand still")]
    StoodStill,
    /// It runs faster or slower than ours by more than 5 %.
    #[error("its clock runs too fast or too slow")]
    Drifts,
}

impl ClockError {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Jumped, Self::StoodStill, Self::Drifts];
}

/// How the clocks stood to each other at the quickest sample of a window.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Quickest {
    host_ns: u64,
    /// Our time less the device's, ns.
    offset_ns: i64,
}

/// A window that is being filled.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Window {
    first_sequence: u32,
    samples: u32,
    first_host_ns: u64,
    /// When it may be full, on our clock, ns.
    end_host_ns: u64,
    quickest: Quickest,
}

/// What is known of a clock that has sent a sample.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct Running {
    last_sequence: u32,
    equal: u32,
    last_device_ns: u64,
    last_host_ns: u64,
    window: Window,
    before: Option<Quickest>,
}

/// Compares a device's clock with ours, sample by sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleClock {
    /// The device's time may be off ours by this much at once, ns.
    tolerance_ns: u64,
    running: Option<Running>,
    /// Time between two samples by our clock, s; zero before it is known.
    period_s: f64,
}

/// A time in seconds; beyond 292 years it is negative. From a signed number it is one instruction.
#[expect(clippy::cast_precision_loss, reason = "nanoseconds between two samples")]
pub(crate) fn seconds(ns: u64) -> f64 {
    ns.cast_signed() as f64 * 1e-9
}

impl SampleClock {
    /// One that refuses stamps which are off our clock by more than `tolerance_ns` at once.
    #[must_use]
    pub fn new(tolerance_ns: u64) -> Self {
        Self {
            tolerance_ns,
            running: None,
            period_s: 0.0,
        }
    }

    /// Forgets the device: the next sample is the first of another.
    pub fn reset(&mut self) {
        *self = Self::new(self.tolerance_ns);
    }

    /// Time between two samples by our own clock, s; zero before a tenth of a second has gone by.
    #[must_use]
    pub fn period_s(&self) -> f64 {
        self.period_s
    }

    /// Saves or loads what is known of the device's clock.
    pub(crate) fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.option(
            "clock_runs",
            &mut self.running,
            Running::default(),
            |archive, running| {
                archive.count_u32("clock_sequence", &mut running.last_sequence);
                archive.count_u32("clock_equal", &mut running.equal);
                archive.count("clock_device_ns", &mut running.last_device_ns, u64::MAX);
                archive.count("clock_host_ns", &mut running.last_host_ns, u64::MAX);
                let window = &mut running.window;
                archive.count_u32("clock_window_sequence", &mut window.first_sequence);
                archive.count_u32("clock_window_samples", &mut window.samples);
                archive.count("clock_window_host_ns", &mut window.first_host_ns, u64::MAX);
                archive.count("clock_window_end_ns", &mut window.end_host_ns, u64::MAX);
                archive.count("clock_quickest_ns", &mut window.quickest.host_ns, u64::MAX);
                archive.difference("clock_quickest_offset_ns", &mut window.quickest.offset_ns);
                let blank = Quickest::default();
                archive.option("clock_had_window", &mut running.before, blank, |archive, before| {
                    archive.count("clock_before_ns", &mut before.host_ns, u64::MAX);
                    archive.difference("clock_before_offset_ns", &mut before.offset_ns);
                });
            },
        );
        archive.number("clock_period_s", &mut self.period_s);
    }

    /// Whether the sampling period bears a sample's stamps out: it may have come late, and its clock is right.
    #[must_use]
    pub fn is_borne_out(&self, stamp: Stamp) -> bool {
        self.running.as_ref().is_some_and(|last| {
            let device_ns = stamp.device_ns.saturating_sub(last.last_device_ns);
            let steps = stamp.sequence.wrapping_sub(last.last_sequence);
            let predicted_s = f64::from(steps) * self.period_s;
            predicted_s > 0.0 && steps <= MAX_STEP && agree(seconds(device_ns), predicted_s)
        })
    }

    /// The time since the sample before, s; zero at the first.
    ///
    /// # Errors
    /// The stamps cannot be those of a clock. The next sample begins again, with what is known of the period.
    #[inline(always)]
    pub fn elapsed_s(&mut self, stamp: Stamp) -> Result<f64, ClockError> {
        let Some(running) = &mut self.running else {
            self.running = Some(Running::new(stamp));
            return Ok(0.0);
        };
        let judged = running.judge(stamp, self.tolerance_ns, &mut self.period_s);
        if judged.is_err() {
            // The next sample begins again, with what is known of the period.
            self.running = None;
        }
        judged
    }
}

impl Running {
    fn new(first: Stamp) -> Self {
        Self {
            last_sequence: first.sequence,
            equal: 0,
            last_device_ns: first.device_ns,
            last_host_ns: first.host_ns,
            window: Window::new(first),
            before: None,
        }
    }

    #[inline(always)]
    fn judge(&mut self, stamp: Stamp, tolerance_ns: u64, period_s: &mut f64) -> Result<f64, ClockError> {
        let host_ns = stamp
            .host_ns
            .saturating_sub(replace(&mut self.last_host_ns, stamp.host_ns));
        let steps = stamp
            .sequence
            .wrapping_sub(replace(&mut self.last_sequence, stamp.sequence));
        let device_ns = stamp
            .device_ns
            .checked_sub(replace(&mut self.last_device_ns, stamp.device_ns))
            .ok_or(ClockError::Jumped)?;
        if device_ns.abs_diff(host_ns) > tolerance_ns {
            return Err(ClockError::Jumped);
        }
        if device_ns > 0 {
            self.equal = 0;
        } else {
            self.equal += 1;
            if self.equal > MAX_EQUAL {
                return Err(ClockError::StoodStill);
            }
        }
        self.window.add(stamp);
        if self.window.is_full(stamp) {
            self.end_window(stamp, period_s)?;
        }
        let (device_s, host_s) = (seconds(device_ns), seconds(host_ns));
        if agree(device_s, host_s) {
            return Ok(device_s);
        }
        Ok(believed_s(device_s, host_s, steps, *period_s))
    }

    /// Compares a full window with the one before, and begins the next with a sample.
    #[cold]
    fn end_window(&mut self, stamp: Stamp, period_s: &mut f64) -> Result<(), ClockError> {
        let window = replace(&mut self.window, Window::new(stamp));
        let (steps, quickest) = (stamp.sequence.wrapping_sub(window.first_sequence), window.quickest);
        if (1..=MAX_STEP * WINDOW_SAMPLES).contains(&steps) {
            *period_s = seconds(stamp.host_ns.saturating_sub(window.first_host_ns)) / f64::from(steps);
        }
        let Some(before) = self.before.replace(quickest) else {
            return Ok(());
        };
        let between_s = seconds(quickest.host_ns.saturating_sub(before.host_ns));
        let gained_s = seconds(quickest.offset_ns.abs_diff(before.offset_ns));
        if gained_s > MAX_DRIFT * between_s + JITTER_S {
            return Err(ClockError::Drifts);
        }
        Ok(())
    }
}

/// Whether a time by the stamps agrees with another measure of it, s.
fn agree(device_s: f64, other_s: f64) -> bool {
    (device_s - other_s).abs() <= AGREEMENT * other_s
}

/// Of a time that our clock contradicts the middle one of the three measures, unless the sampling
/// period bears the stamps out.
#[cold]
fn believed_s(device_s: f64, host_s: f64, steps: u32, period_s: f64) -> f64 {
    let predicted_s = f64::from(steps) * period_s;
    if period_s <= 0.0 || steps > MAX_STEP || agree(device_s, predicted_s) {
        return device_s;
    }
    device_s.clamp(predicted_s.min(host_s), predicted_s.max(host_s))
}

impl Window {
    fn new(first: Stamp) -> Self {
        Self {
            first_sequence: first.sequence,
            samples: 0,
            first_host_ns: first.host_ns,
            end_host_ns: first.host_ns.saturating_add(WINDOW_NS),
            quickest: Quickest::of(first),
        }
    }

    fn add(&mut self, stamp: Stamp) {
        self.samples += 1;
        let seen = Quickest::of(stamp);
        if seen.offset_ns < self.quickest.offset_ns {
            self.quickest = seen;
        }
    }

    /// Whether it is long enough with this sample.
    fn is_full(&self, stamp: Stamp) -> bool {
        stamp.host_ns >= self.end_host_ns && self.samples >= WINDOW_SAMPLES
    }
}

impl Quickest {
    fn of(stamp: Stamp) -> Self {
        Self {
            host_ns: stamp.host_ns,
            offset_ns: stamp.host_ns.wrapping_sub(stamp.device_ns).cast_signed(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use alloc::vec::Vec;

    const MS: u64 = 1_000_000;

    fn at(sequence: u64, device_ns: u64, host_ns: u64) -> Stamp {
        Stamp {
            sequence: u32::try_from(sequence).expect("a short run"),
            device_ns,
            host_ns,
        }
    }

    /// Stamps of a device at 1 kHz whose clock shows, at a time of ours in ns, what `clock` says,
    /// in us as 32 bits.
    fn run(ticks: u64, clock: impl Fn(u64) -> u32) -> Vec<Result<f64, ClockError>> {
        let mut compared = SampleClock::new(20 * MS);
        let (mut last_us, mut device_ns) = (clock(0), 0);
        (0..ticks)
            .map(|k| {
                let now_us = clock(k * MS);
                device_ns += u64::from(now_us.wrapping_sub(last_us)) * 1000;
                last_us = now_us;
                // The link's jitter: up to 0.3 ms.
                let late_ns = (k * 7919) % 300_000;
                compared.elapsed_s(at(k, device_ns, 5_000 * MS + k * MS + late_ns))
            })
            .collect()
    }

    fn us(ns: u64) -> u32 {
        u32::try_from(ns / 1000 % (1 << 32)).expect("32 bits")
    }

    /// Ticks of an honest clock before it begins to lie.
    const HONEST: u64 = 500;

    /// From a moment on the clock shows that moment and so many ns more or less, by how long it has
    /// been lying.
    fn lie(ns: u64, by: impl Fn(i64) -> i64) -> u32 {
        let began = HONEST * MS;
        us(match ns.checked_sub(began) {
            Some(lying) => began.saturating_add_signed(by(lying.cast_signed())),
            None => ns,
        })
    }

    #[test]
    fn an_honest_clock_is_believed_to_the_nanosecond() {
        for clock in [
            |ns| us(ns),
            // Wrapping around in the middle of the run.
            |ns| us(ns).wrapping_add(u32::MAX - 250_000),
            // Three percent fast.
            |ns| us(ns + ns / 33),
        ] {
            let run = run(1000, clock);
            assert_eq!(run[0], Ok(0.0));
            for (k, elapsed) in run.iter().enumerate().skip(1) {
                let ns = k as u64 * MS;
                let exact = f64::from(clock(ns).wrapping_sub(clock(ns - MS))) * 1e-6;
                let elapsed = elapsed.expect("an honest clock");
                assert!((elapsed - exact).abs() < 1e-15, "{k}: {elapsed} for {exact}");
            }
        }
    }

    // hazard: H3
    #[test]
    fn lying_clock_errors_before_any_wrong_time_is_believed() {
        let counts = 65_536_000;
        type Lie<'a> = (&'a str, ClockError, u64, &'a dyn Fn(u64) -> u32);
        let lies: [Lie<'_>; 9] = [
            ("backwards", ClockError::Jumped, 2, &|ns| lie(ns, |lied| -lied)),
            ("a jump ahead", ClockError::Jumped, 1, &|ns| {
                lie(ns, |lied| lied + 50_000_000)
            }),
            ("16 bits", ClockError::Jumped, 70, &|ns| lie(ns, |lied| lied % counts)),
            ("torn", ClockError::Jumped, 10, &|ns| {
                lie(ns, |lied| if lied == 7_000_000 { lied + counts } else { lied })
            }),
            ("it stands still", ClockError::StoodStill, 4, &|ns| lie(ns, |_| 0)),
            ("half speed", ClockError::Drifts, 310, &|ns| lie(ns, |lied| lied / 2)),
            ("double speed", ClockError::Drifts, 310, &|ns| lie(ns, |lied| lied * 2)),
            ("ten percent fast", ClockError::Drifts, 310, &|ns| {
                lie(ns, |lied| lied + lied / 10)
            }),
            ("ten percent slow", ClockError::Drifts, 310, &|ns| {
                lie(ns, |lied| lied - lied / 10)
            }),
        ];
        for (name, error, within, clock) in lies {
            let run = run(1200, clock);
            let seen = run
                .iter()
                .position(Result::is_err)
                .unwrap_or_else(|| panic!("{name} is seen"));
            assert_eq!(run[seen], Err(error), "{name} at {seen}");
            let lied = seen as u64;
            assert!((HONEST..=HONEST + within).contains(&lied), "{name}: only at {seen}");
            for (k, elapsed) in run[..seen].iter().enumerate().skip(1) {
                let elapsed = elapsed.expect("before the error");
                assert!(
                    (0.0004..0.0016).contains(&elapsed),
                    "{name}: {elapsed} s believed at {k}"
                );
            }
        }
    }

    #[test]
    fn late_and_lost_samples_are_no_lies() {
        let mut clock = SampleClock::new(20 * MS);
        let mut taken = 0_u64;
        for k in 0..3000_u64 {
            // Every 97th sample is 4 ms late, with those behind it; every 50th is lost.
            let late = if k % 97 < 4 { (4 - k % 97) * MS } else { 0 };
            if k % 50 == 0 {
                continue;
            }
            let elapsed = clock.elapsed_s(at(k, k * MS, 1000 * MS + k * MS + late));
            let exact = if taken == 0 { 0.0 } else { (k - taken) as f64 * 1e-3 };
            assert!(
                (elapsed.expect("honest") - exact).abs() < 1e-12,
                "{k}: {elapsed:?} for {exact}"
            );
            taken = k;
        }
    }

    #[test]
    fn a_clock_of_milliseconds_is_no_lie() {
        let honest = run(2000, |ns| us((ns + 350_000) / MS * MS));
        assert!(honest.iter().all(Result::is_ok), "{honest:?}");
    }

    /// A sample of a device whose clock runs as ours does, which comes late by a time.
    fn stamp(sequence: u64, period_ns: u64, late_ns: u64) -> Stamp {
        let device_ns = sequence * period_ns;
        at(sequence, device_ns, 5_000 * MS + device_ns + late_ns)
    }

    // hazard: H3
    #[test]
    fn three_samples_may_have_one_stamp_and_a_fourth_may_not() {
        let mut clock = SampleClock::new(20 * MS);
        let elapsed = [0, 1, 2, 3].map(|k| clock.elapsed_s(at(k, 7 * MS, k * MS)));
        assert_eq!(elapsed[..3], [Ok(0.0); 3]);
        assert_eq!(elapsed[3], Err(ClockError::StoodStill));
    }

    #[test]
    fn period_is_known_after_100_ms_and_8_samples() {
        // Period of the device and of reading, ns; the sample with which the period is known.
        for (period_ns, every, known) in [
            (MS, 1, 100_u64),
            (20 * MS, 1, 8),
            // A device at 20 kHz, read at 1 kHz.
            (MS / 20, 20, 2000),
        ] {
            let mut clock = SampleClock::new(50 * MS);
            for k in (0..=known).step_by(every) {
                assert_eq!(clock.period_s(), 0.0, "{period_ns} ns, before sample {k}");
                clock.elapsed_s(stamp(k, period_ns, 0)).expect("an honest clock");
            }
            let period_s = seconds(period_ns);
            assert!((clock.period_s() / period_s - 1.0).abs() < 1e-9, "{period_ns} ns");
            clock.reset();
            assert_eq!(clock.period_s(), 0.0);
            // Another device, with another time.
            assert_eq!(clock.elapsed_s(stamp(7, 900 * MS, 0)), Ok(0.0));
        }
    }

    #[test]
    fn period_predicts_time_over_at_most_1000_samples() {
        for (steps, believed_s) in [(1000, 0.02), (1001, 0.005)] {
            let mut clock = SampleClock::new(20 * MS);
            for k in 0..=100 {
                clock.elapsed_s(stamp(k, MS, 0)).expect("an honest clock");
            }
            let last = stamp(100, MS, 0);
            // The stamp says 5 ms, our clock 20 ms, the sequence a second.
            let elapsed = clock.elapsed_s(Stamp {
                sequence: last.sequence + steps,
                device_ns: last.device_ns + 5 * MS,
                host_ns: last.host_ns + 20 * MS,
            });
            assert!(
                elapsed.is_ok_and(|elapsed_s| (elapsed_s - believed_s).abs() < 1e-12),
                "{elapsed:?}"
            );
        }
    }

    // hazard: H3
    #[test]
    fn a_burst_of_late_samples_is_not_a_drift() {
        let mut clock = SampleClock::new(20 * MS);
        for k in 0..1000 {
            // 18 ms late where a window ends and the next begins, and those behind it.
            let late_ms = if (200..218).contains(&k) { 218 - k } else { 0 };
            let elapsed = clock.elapsed_s(stamp(k, MS, late_ms * MS));
            assert!(elapsed.is_ok(), "{k}: {elapsed:?}");
        }
    }

    // hazard: H3
    #[test]
    fn a_sample_that_came_late_is_borne_out_by_its_sequence() {
        let mut clock = SampleClock::new(20 * MS);
        for k in 0..300 {
            assert!(clock.elapsed_s(stamp(k, MS, 0)).is_ok(), "{k}");
        }
        let late = stamp(300, MS, 50 * MS);
        assert!(clock.is_borne_out(late));
        let wrong = Stamp {
            device_ns: late.device_ns + 65 * MS,
            ..late
        };
        assert!(!clock.is_borne_out(wrong));
        assert_eq!(
            clock.elapsed_s(late),
            Err(ClockError::Jumped),
            "for a hand it is wrong all the same"
        );
    }

    #[test]
    fn after_an_error_it_begins_anew() {
        let mut clock = SampleClock::new(20 * MS);
        let elapsed = [(1, 1), (2, 900), (3, 901), (4, 902)].map(|(k, ms)| clock.elapsed_s(at(k, ms * MS, k * MS)));
        assert_eq!(elapsed, [Ok(0.0), Err(ClockError::Jumped), Ok(0.0), Ok(1e-3)]);
    }
}
