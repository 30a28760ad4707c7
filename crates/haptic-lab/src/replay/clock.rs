//! The servo's knowledge of the device's clock, found from the rows.
//!
//! The servo holds the device's clock against its own in windows of a tenth of a second, one after
//! another since the device's first sample, which a recording does not hold. One of these windows begins
//! with a sample of the recording's first tenth of a second. So a clock is begun with each of those
//! samples: after its first window one of them is the servo's. As that window ends it is held against the
//! one before, which the recording does not hold: a clock continues and another one errs there. They agree on
//! the time of nearly every sample; where they do not, the recorded velocities decide, once the estimate of
//! velocity has settled. A fault decides nothing: it may have another reason than the clock.

use haptic_core::sample::{DeviceError, Measurement};
use haptic_core::sample_clock::{ClockError, SampleClock, Stamp};
use haptic_ipc::Sample;
use std::mem::{replace, take};

/// Samples after which clocks that have become equal are merged.
const MERGE_SAMPLES: u32 = 64;

/// A time since the sample before, and a clock that says so.
#[derive(Clone, Copy, Debug)]
pub(super) struct Time {
    /// The time, s, or what is wrong with the stamps.
    pub(super) elapsed: Result<f64, ClockError>,
    /// The clock before the sample.
    pub(super) before: SampleClock,
}

#[derive(Clone, Copy, Debug)]
struct Candidate {
    clock: SampleClock,
    /// Whether it began with the device, as the servo's did.
    is_whole: bool,
    /// Whether it is a possible clock of the servo with the newest sample, and what it made of that.
    newest: (bool, Result<f64, ClockError>),
}

impl Candidate {
    fn new(stale_ns: u64, is_whole: bool) -> Self {
        Self {
            clock: SampleClock::new(stale_ns),
            is_whole,
            newest: (false, Ok(0.0)),
        }
    }

    /// Whether it may be the servo's to the last bit.
    fn is_mature(&self) -> bool {
        self.is_whole || self.clock.period_s() > 0.0
    }

    /// Takes a sample; returns what it makes of its time.
    fn time(&mut self, stamp: Stamp) -> Time {
        let before = self.clock;
        let elapsed = self.clock.elapsed_s(stamp);
        self.newest = (self.is_mature(), elapsed);
        Time { elapsed, before }
    }

    /// The same clock where it errs with a sample, and what that makes of the time.
    fn erring(mut self, stamp: Stamp) -> (Self, Time) {
        self.clock.begin_anew();
        let mut before = self.clock;
        // From the end of all time every clock runs backwards.
        let device_ns = u64::MAX;
        before.elapsed_s(Stamp { device_ns, ..stamp }).unwrap_or_default();
        let elapsed = { before }.elapsed_s(stamp);
        self.newest.1 = elapsed;
        (self, Time { elapsed, before })
    }
}

/// All that the servo may know of the device's clock.
#[derive(Debug)]
pub(super) struct ClockSearch {
    stale_ns: u64,
    now_ns: u64,
    was_live: bool,
    sequence: Option<u32>,
    candidates: Vec<Candidate>,
    is_gathering: bool,
    samples: u32,
    times: Vec<Time>,
    is_open: bool,
}

impl ClockSearch {
    /// Begins with the next row.
    pub(super) fn new(stale_ns: u64) -> Self {
        Self {
            stale_ns,
            now_ns: 0,
            was_live: false,
            sequence: None,
            candidates: Vec::new(),
            is_gathering: true,
            samples: 0,
            times: Vec::new(),
            is_open: false,
        }
    }

    /// Our own clock, ns, from the first row on.
    pub(super) fn now_ns(&self) -> u64 {
        self.now_ns
    }

    /// The times that the servo may have made of the newest row's sample; none where it is not new.
    pub(super) fn times(&self) -> &[Time] {
        &self.times
    }

    /// Whether the servo may have made another time of it, which no clock here says.
    pub(super) fn is_open(&self) -> bool {
        self.is_open
    }

    /// A clock that may be the servo's after the newest row.
    pub(super) fn clock(&self) -> Option<SampleClock> {
        self.candidates.first().map(|candidate| candidate.clock)
    }

    /// The clock whose sampling period, at least `step_s`, is nearest to one (s).
    pub(super) fn nearest(&self, period_s: f64, step_s: f64) -> Option<SampleClock> {
        let distance = |candidate: &Candidate| (candidate.clock.period_s().max(step_s) - period_s).abs();
        let nearest = self
            .candidates
            .iter()
            .min_by(|one, other| distance(one).total_cmp(&distance(other)));
        nearest.map(|candidate| candidate.clock)
    }

    /// The shortest and the longest sampling period that the servo may know, s, each at least `step_s`;
    /// `None` where it may know any.
    pub(super) fn periods(&self, step_s: f64) -> Option<[f64; 2]> {
        if self.candidates.is_empty() || !self.candidates.iter().all(Candidate::is_mature) {
            return None;
        }
        let periods = self
            .candidates
            .iter()
            .map(|candidate| candidate.clock.period_s().max(step_s));
        Some(periods.fold([f64::INFINITY, 0.0], |[least, most], period_s| {
            [period_s.min(least), period_s.max(most)]
        }))
    }

    /// Takes the next row.
    pub(super) fn take(&mut self, row: &Sample, sample: &Result<Measurement, DeviceError>) {
        self.times.clear();
        self.is_open = false;
        self.now_ns = self.now_ns.saturating_add(row.elapsed_ns);
        // An error faults a rig with force on; otherwise the estimate of velocity begins again.
        let may_err = if replace(&mut self.was_live, row.state.is_live()) {
            !row.state.is_live()
        } else {
            row.device_velocity_mps == 0.0
        };
        let Ok(sample) = sample else {
            // The servo forgets the device, and so begins its clock again with the next sample.
            self.sequence = None;
            self.is_gathering = false;
            self.candidates = vec![Candidate::new(self.stale_ns, true)];
            return;
        };
        if self.sequence == Some(sample.sequence) || !sample.position_m.is_finite() {
            return;
        }
        let is_begun = self.sequence.is_some() || !self.candidates.is_empty();
        self.sequence = Some(sample.sequence);
        if !is_begun {
            // It may be the repetition of a sample that came before the recording.
            return;
        }
        let stamp = Stamp {
            sequence: sample.sequence,
            device_ns: sample.time_ns,
            host_ns: self.now_ns,
        };
        self.time(stamp, may_err);
    }

    fn time(&mut self, stamp: Stamp, may_err: bool) {
        let is_contradicted = self
            .candidates
            .first()
            .is_none_or(|candidate| candidate.clock.is_contradicted(stamp));
        self.is_open = is_contradicted && (self.is_gathering || !self.candidates.iter().all(Candidate::is_mature));
        for mut candidate in take(&mut self.candidates) {
            let was_mature = candidate.is_mature();
            self.add(candidate.time(stamp));
            self.candidates.push(candidate);
            if may_err && !was_mature && candidate.is_mature() {
                let (erring, time) = candidate.erring(stamp);
                self.add(time);
                self.candidates.push(erring);
            }
        }
        if may_err && self.is_gathering {
            // A window that began before the recording may end here.
            let (_, time) = Candidate::new(self.stale_ns, false).erring(stamp);
            self.add(time);
        }
        if self.is_gathering {
            // A window that began before the recording is full no later than the first one here.
            self.is_gathering = !self.candidates.first().is_some_and(Candidate::is_mature);
            if self.is_gathering {
                let mut candidate = Candidate::new(self.stale_ns, false);
                candidate.newest.1 = candidate.clock.elapsed_s(stamp);
                self.candidates.push(candidate);
            }
        }
        self.samples = self.samples.wrapping_add(1);
        if self.samples.is_multiple_of(MERGE_SAMPLES) {
            self.merge();
        }
    }

    fn add(&mut self, time: Time) {
        if self.times.iter().all(|other| other.elapsed != time.elapsed) {
            self.times.push(time);
        }
    }

    /// Keeps the clocks whose time of the newest sample may be the servo's.
    pub(super) fn keep(&mut self, may_be: impl Fn(Result<f64, ClockError>) -> bool) {
        self.candidates.retain(|candidate| {
            let (is_mature, elapsed) = candidate.newest;
            !is_mature || may_be(elapsed)
        });
    }

    /// Merges clocks that have become equal.
    fn merge(&mut self) {
        let mut unlike: Vec<Candidate> = Vec::new();
        for candidate in &self.candidates {
            if unlike.iter().all(|other| other.clock != candidate.clock) {
                unlike.push(*candidate);
            }
        }
        self.candidates = unlike;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// No window of such a clock is ever full, so that none of the search is decided.
    #[test]
    fn a_clock_that_stands_still_is_searched_for_with_a_few_clocks() {
        let mut search = ClockSearch::new(100_000_000);
        for sequence in 0..20_000 {
            let row = Sample {
                elapsed_ns: 1_000_000,
                ..Sample::default()
            };
            search.take(&row, &Ok(Measurement::new(sequence, 5, 0.0)));
            assert!(search.candidates.len() < 2 * MERGE_SAMPLES as usize);
        }
        assert!(search.is_gathering);
    }
}
