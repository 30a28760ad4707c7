//! The positions of a controller that neither stamps nor numbers them, but answers questions in
//! their order.
//!
//! A position's time is the time of its question. The time of its reading would be worse: answers
//! are read once a tick, so an answer that comes a little later than the others would seem a whole
//! tick late, and that would make a wrong velocity.

use device_io::link::{LinkCounters, LinkError, add};
use device_io::{DeviceError, Measurement};
use std::sync::Arc;
use std::sync::atomic::Ordering::Relaxed;

/// Most questions without an answer. On a line that is too slow for the rate this sets the pace:
/// its buffers hold this many commands and no more.
const WINDOW: usize = 4;

/// Age at which questions without an answer count as lost, ns, where no other answer has shown it
/// before ([`Feedback::answered_until`]).
const LOST_AFTER_NS: u64 = 50_000_000;

/// Age at which a question is overdue, ns: then another question is asked, whose answer shows which
/// are lost.
const OVERDUE_AFTER_NS: u64 = 10_000_000;

/// Longest time without a position, ns; after it the controller is greeted again.
const SILENCE_NS: u64 = 500_000_000;

/// Fastest hand, m/s: a position that needs a faster one was damaged on its way. Both protocols can
/// let that through, one without a checksum and one with a checksum of eight bits.
const FASTEST_MPS: f64 = 10.0;

/// Largest jump of a position in no time, m.
const SLACK_M: f64 = 1e-3;

/// The positions of one axis.
#[derive(Debug)]
pub(crate) struct Feedback {
    counters: Arc<LinkCounters>,
    metres_per_unit: f64,
    /// First position of the handle, in the controller's unit.
    origin: f64,
    newest: Measurement,
    used: u32,
    received_at_ns: u64,
    period_ns: u64,
    /// Times of the questions without an answer, the oldest first, ns.
    asked_at_ns: [u64; WINDOW],
    under_way: usize,
}

impl Feedback {
    /// Begins with a first position, in the controller's unit (m each), at a time of ours.
    pub(crate) fn new(
        first: f64,
        metres_per_unit: f64,
        period_ns: u64,
        now_ns: u64,
        counters: Arc<LinkCounters>,
    ) -> Self {
        counters.begin_conversation();
        add(&counters.samples, 1);
        Self {
            counters,
            metres_per_unit,
            origin: first,
            newest: Measurement::new(0, now_ns, 0.0),
            used: 0,
            received_at_ns: now_ns,
            period_ns,
            asked_at_ns: [0; WINDOW],
            under_way: 0,
        }
    }

    /// Whether a question may be asked now. Lost questions make room.
    pub(crate) fn may_ask(&mut self, now_ns: u64) -> bool {
        if self.under_way > 0 && now_ns.saturating_sub(self.asked_at_ns[0]) > LOST_AFTER_NS {
            add(&self.counters.lost, self.under_way as u64);
            self.under_way = 0;
        }
        self.under_way < WINDOW
    }

    /// Whether there has been no room for such a time that answers are likely lost.
    pub(crate) fn is_overdue(&self, now_ns: u64) -> bool {
        self.under_way == WINDOW && now_ns.saturating_sub(self.asked_at_ns[0]) > OVERDUE_AFTER_NS
    }

    /// A question goes out.
    pub(crate) fn ask(&mut self, now_ns: u64) {
        if let Some(slot) = self.asked_at_ns.get_mut(self.under_way) {
            *slot = now_ns;
            self.under_way += 1;
        }
    }

    /// A position came, in the controller's unit.
    pub(crate) fn take(&mut self, units: f64, now_ns: u64) {
        if self.under_way == 0 {
            add(&self.counters.out_of_sequence, 1);
            return;
        }
        let asked_at_ns = self.asked_at_ns[0];
        let round_trip_ns = now_ns.saturating_sub(asked_at_ns);
        self.answered();
        let position_m = (units - self.origin) * self.metres_per_unit;
        #[expect(clippy::cast_precision_loss, reason = "half a second at most")]
        let elapsed_s = (asked_at_ns.saturating_sub(self.newest.time_ns) + self.period_ns) as f64 * 1e-9;
        if (position_m - self.newest.position_m).abs() > FASTEST_MPS * elapsed_s + SLACK_M {
            add(&self.counters.malformed, 1);
            return;
        }
        add(&self.counters.samples, 1);
        self.counters.note_round_trip(round_trip_ns);
        // The answer to the question of one tick is there in the next.
        if round_trip_ns > 2 * self.period_ns + self.period_ns / 2 {
            add(&self.counters.late, 1);
        }
        self.newest = Measurement::new(self.newest.sequence.wrapping_add(1), asked_at_ns, position_m);
    }

    fn answered(&mut self) {
        self.asked_at_ns.copy_within(1.., 0);
        self.under_way = self.under_way.saturating_sub(1);
    }

    /// Another question, asked at a time of ours, was answered. Answers come in the order of the
    /// questions, so those that were asked earlier have lost theirs.
    pub(crate) fn answered_until(&mut self, asked_at_ns: u64) {
        while self.under_way > 0 && self.asked_at_ns[0] < asked_at_ns {
            add(&self.counters.lost, 1);
            self.answered();
        }
    }

    /// The newest sample, at a time of ours.
    ///
    /// # Errors
    /// The controller has been silent for too long.
    pub(crate) fn measurement(&mut self, now_ns: u64) -> Result<Measurement, DeviceError> {
        if self.newest.sequence != self.used {
            self.used = self.newest.sequence;
            self.received_at_ns = now_ns;
        } else if now_ns.saturating_sub(self.received_at_ns) > SILENCE_NS {
            self.counters.note_error(LinkError::Silent, now_ns);
            return Err(DeviceError::Disconnected);
        }
        let age_ns = now_ns.saturating_sub(self.newest.time_ns);
        let usual_ns = self.counters.usual_round_trip_ns.load(Relaxed);
        self.counters.note_age(age_ns, age_ns.saturating_sub(usual_ns));
        Ok(self.newest)
    }

    /// The counters of the link.
    pub(crate) fn counters(&self) -> &LinkCounters {
        &self.counters
    }
}

/// The target for a force on the hand, N, in the controller's unit of so many newtons. It is cut to
/// a limit in that unit, and zero for a force that is not a number.
pub(crate) fn target(force_n: f64, newtons_per_unit: f64, limit: f64, counters: &LinkCounters) -> f64 {
    let wanted = force_n / newtons_per_unit;
    if wanted.is_nan() {
        return 0.0;
    }
    if wanted.abs() > limit {
        add(&counters.clipped, 1);
    }
    wanted.clamp(-limit, limit)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MS: u64 = 1_000_000;

    fn feedback() -> Feedback {
        Feedback::new(100.0, 0.01, MS, 0, Arc::new(LinkCounters::default()))
    }

    #[test]
    fn lost_answers_make_room_for_new_questions() {
        let mut feedback = feedback();
        for k in 0..WINDOW as u64 {
            assert!(feedback.may_ask(k * MS));
            feedback.ask(k * MS);
        }
        assert!(!feedback.may_ask(5 * MS));
        feedback.take(100.0, 6 * MS);
        assert!(feedback.may_ask(6 * MS));
        assert_eq!(feedback.counters.late.load(Relaxed), 1);
        assert_eq!(feedback.counters.lost.load(Relaxed), 0);
        feedback.answered_until(2 * MS);
        assert_eq!(
            feedback.counters.lost.load(Relaxed),
            1,
            "that of the second millisecond is under way"
        );
        assert!(feedback.may_ask(103 * MS));
        assert_eq!(feedback.counters.lost.load(Relaxed), 3);
        // An answer to no question is old.
        feedback.take(100.1, 104 * MS);
        assert_eq!(feedback.counters.out_of_sequence.load(Relaxed), 1);
    }

    #[test]
    fn a_jump_that_no_hand_makes_is_not_a_position() {
        let mut feedback = feedback();
        for (at, units) in [(1, 105.0), (2, 100.5)] {
            feedback.ask(at * MS);
            feedback.take(units, at * MS);
        }
        let sample = feedback.measurement(2 * MS).expect("it is there");
        assert!((sample.position_m - 0.005).abs() < 1e-12, "{sample:?}");
        assert_eq!(feedback.counters.malformed.load(Relaxed), 1);
    }

    #[test]
    fn a_silent_controller_is_gone() {
        let mut feedback = feedback();
        assert!(feedback.measurement(500 * MS).is_ok());
        assert_eq!(feedback.measurement(501 * MS), Err(DeviceError::Disconnected));
    }

    #[test]
    fn a_force_is_cut_and_nonsense_is_zero() {
        let counters = LinkCounters::default();
        assert_eq!(target(3.0, -2.0, 9.0, &counters), -1.5);
        assert_eq!(target(f64::NAN, 2.0, 9.0, &counters), 0.0);
        assert_eq!(counters.clipped.load(Relaxed), 0);
        assert_eq!(target(f64::INFINITY, 2.0, 9.0, &counters), 9.0);
        assert_eq!(counters.clipped.load(Relaxed), 1);
    }
}
