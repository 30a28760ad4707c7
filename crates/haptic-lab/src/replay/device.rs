//! What a servo knows of its device, found from the rows: the times of its samples, and the state of the
//! estimate of velocity.

use super::clock::{ClockSearch, Time};
use super::skip_reason::SkipReason;
use super::tracker::{TrackerSearch, is_by_rounding};
use haptic_core::sample::{DeviceError, Measurement};
use haptic_core::servo::{DECAY_S, Inputs, SILENT_PERIODS, Servo};
use haptic_ipc::{RigState, Sample};

/// After so long nothing of the servo depends on a time that was in doubt, ns: its effect shows at once, or
/// as the force comes back after a silence, which takes 50 ms.
const DOUBT_NS: u64 = 60_000_000;

/// The device of a recording, and what the servo knows of it.
#[derive(Debug)]
pub(super) struct Device {
    /// Nominal time between two ticks, s.
    step_s: f64,
    stale_ns: u64,
    clocks: ClockSearch,
    sequence: Option<u32>,
    /// Whether the newest row has a new sample.
    is_fresh: bool,
    /// Time since the newest sample, ns.
    silent_ns: u64,
    /// Time from the last sample that was believed to the newest one, while that is held back, s.
    held_s: f64,
    tracker: Option<TrackerSearch>,
    /// Until when on our clock (ns) an output may differ for this reason.
    doubt: Option<(SkipReason, u64)>,
}

impl Device {
    /// The device of a loop with so much time between two ticks (s), which may repeat a sample for so long
    /// (ns).
    pub(super) fn new(step_s: f64, stale_ns: u64) -> Self {
        Self {
            step_s,
            stale_ns,
            clocks: ClockSearch::new(stale_ns),
            sequence: None,
            is_fresh: false,
            silent_ns: 0,
            held_s: 0.0,
            tracker: None,
            doubt: None,
        }
    }

    /// Rows are missing, and with them samples.
    pub(super) fn lose(&mut self) {
        *self = Self::new(self.step_s, self.stale_ns);
    }

    /// Takes the next row, whether a servo is stepped with it or not.
    pub(super) fn take(&mut self, row: &Sample, sample: &Result<Measurement, DeviceError>) {
        self.clocks.take(row, sample);
        let sequence = sample.as_ref().ok().map(|sample| sample.sequence);
        self.is_fresh = sequence.is_some() && self.sequence != sequence;
        self.sequence = sequence;
        self.silent_ns = if self.is_fresh || sequence.is_none() {
            0
        } else {
            self.silent_ns.saturating_add(row.elapsed_ns)
        };
    }

    /// Whether the newest row has a new sample.
    pub(super) fn is_fresh(&self) -> bool {
        self.is_fresh
    }

    /// Whether nothing of the estimate of velocity is left to be found.
    pub(super) fn is_velocity_found(&self) -> bool {
        self.tracker.as_ref().is_none_or(TrackerSearch::is_found)
    }

    /// A servo begins that has been stepped with the newest row.
    pub(super) fn begin(&mut self, row: &Sample, inputs: &Inputs, servo: &mut Servo) {
        self.held_s = 0.0;
        self.doubt = None;
        servo.set_now_ns(self.clocks.now_ns());
        if let Some(clock) = self.clocks.clock() {
            *servo.clock_mut() = clock;
        }
        self.tracker = servo.estimator_mut().tracker_mut().map(|_| {
            let mut search = TrackerSearch::new(self.step_s, row);
            if inputs.sample.is_err() {
                search.end();
            }
            search
        });
    }

    /// Why a row may differ though nothing is wrong with it, if there is a reason.
    pub(super) fn doubt(&self, row: &Sample, computed: &Sample) -> Option<SkipReason> {
        if let Some((why, until_ns)) = self.doubt
            && self.clocks.now_ns() <= until_ns
        {
            return Some(why);
        }
        let is_tracker_known = self.tracker.as_ref().is_none_or(TrackerSearch::is_over);
        let is_other = row.device_velocity_mps.to_bits() != computed.device_velocity_mps.to_bits();
        (!is_tracker_known && is_other && is_by_rounding(self.step_s, row, computed.device_velocity_mps))
            .then_some(SkipReason::Settling)
    }

    /// Has the servo time the device as the recorded one did, as far as the rows show. Before the servo is settled its
    /// velocities say nothing of the recorded clock.
    pub(super) fn before(&mut self, row: &Sample, inputs: &Inputs, servo: &mut Servo, is_settled: bool) {
        if inputs.sample.is_err() {
            self.held_s = 0.0;
            if let Some(search) = &mut self.tracker {
                search.end();
            }
        } else if let Some(time) = self.time(row, servo, is_settled) {
            *servo.clock_mut() = time.before;
            self.track(row, time, servo);
        } else {
            self.time_silence(row, servo);
        }
    }

    /// The time of a new sample, as the recorded velocity has it where there is more than one.
    fn time(&mut self, row: &Sample, servo: &mut Servo, is_settled: bool) -> Option<Time> {
        let first = *self.clocks.times().first()?;
        if self.clocks.times().len() == 1 && !self.clocks.is_open() {
            return Some(first);
        }
        let (estimator, is_live, held_s) = (*servo.estimator_mut(), servo.state().is_live(), self.held_s);
        let search = self.tracker.as_ref();
        let faults = is_live && row.state == RigState::Faulted;
        let distance = |elapsed| match elapsed {
            // What faults a rig is not made use of: neither its time nor its position.
            _ if faults => 0.0,
            Ok(elapsed_s) => {
                let elapsed_s = held_s + elapsed_s;
                let velocity = { estimator }.update(elapsed_s, row.sample_position_m);
                let own = (velocity - row.device_velocity_mps).abs();
                let searched = search.and_then(|search| search.distance_mps(elapsed_s, row));
                searched.map_or(own, |searched| searched.min(own))
            }
            Err(_) if is_live => f64::INFINITY,
            // The estimate begins again.
            Err(_) => row.device_velocity_mps.abs(),
        };
        let times = self.clocks.times().iter();
        let chosen = *times.min_by(|one, other| distance(one.elapsed).total_cmp(&distance(other.elapsed)))?;
        let fits = |elapsed| distance(elapsed) == 0.0;
        let fitting = self.clocks.times().iter().filter(|time| fits(time.elapsed)).count();
        // Before that a wrong time may give the recorded velocity by chance.
        if fitting > 0 && is_settled {
            self.clocks.keep(fits);
        }
        // A hand at rest has the same velocity whatever the time.
        if fitting != 1 || row.device_velocity_mps == 0.0 {
            self.doubt_for(SkipReason::ClockUnknown);
        }
        Some(chosen)
    }

    /// Sets the tracker to the state that it had before a new sample, as far as that is known.
    fn track(&mut self, row: &Sample, time: Time, servo: &mut Servo) {
        let Ok(elapsed_s) = time.elapsed else {
            self.held_s = 0.0;
            if let Some(search) = &mut self.tracker {
                search.end();
            }
            return;
        };
        self.held_s += elapsed_s;
        if row.sample_position_m.to_bits() != row.device_position_m.to_bits() {
            // It is held back, and the next sample's time counts from the one before.
            return;
        }
        let elapsed_s = std::mem::take(&mut self.held_s);
        if let Some(state) = self.tracker.as_mut().and_then(|search| search.before(elapsed_s, row))
            && let Some(tracker) = servo.estimator_mut().tracker_mut()
        {
            tracker.set_state(state);
        }
    }

    /// Gives the servo the sampling period that the recorded force has while the device is silent: the
    /// force then decays by it.
    fn time_silence(&mut self, row: &Sample, servo: &mut Servo) {
        if !servo.state().is_live() || self.is_fresh {
            return;
        }
        let step_s = self.step_s;
        #[expect(clippy::cast_precision_loss, reason = "nanoseconds of a session")]
        let silent_s = self.silent_ns as f64 * 1e-9;
        let [least_s, most_s] = self.clocks.periods(step_s).unwrap_or([step_s, f64::INFINITY]);
        let is_exact = least_s == most_s || silent_s < SILENT_PERIODS * least_s;
        if is_exact {
            return;
        }
        let share = (-row.command_force_n / row.coupling_force_n).clamp(0.0, 1.0);
        let period_s = (silent_s - (1.0 - share) * DECAY_S) / SILENT_PERIODS;
        if let Some(clock) = self.clocks.nearest(period_s, step_s) {
            *servo.clock_mut() = clock;
        }
        self.doubt_for(SkipReason::DeviceSilent);
    }

    fn doubt_for(&mut self, why: SkipReason) {
        self.doubt = Some((why, self.clocks.now_ns().saturating_add(DOUBT_NS)));
    }
}
