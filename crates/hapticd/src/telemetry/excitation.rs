//! The motion of the handle under an excitation, from the records of all ticks.

use crate::rt::outbox::TickRecord;
use haptic_core::{Excitation, MotionEnd};
use haptic_ipc::{ExcitationEnd, ExcitationReport};

/// Time without a change of position after which the handle is at rest, ns.
const REST_NS: u64 = 30_000_000;

/// Time after which a handle that still moves is moved by something other than the excitation, ns.
const MAX_REST_NS: u64 = 2_000_000_000;

/// Time without its first tick after which an excitation counts as blocked, ns.
const NEVER_BEGUN_NS: u64 = 500_000_000;

/// Share of the lag's limit below which the handle had not come to it in the last tick with force: the loop stood still
/// then, and the reference was out of reach at once.
const REACHED: f64 = 0.9;

/// The observed motion during an excitation.
#[derive(Clone, Debug)]
pub(crate) struct ObservedExcitation {
    excitation: Excitation,
    /// The record before, where there is none missing.
    last: Option<TickRecord>,
    /// Time of the first record, ns.
    from_ns: Option<u64>,
    course: Option<Course>,
}

/// What was seen of it since its first tick.
#[derive(Clone, Debug)]
struct Course {
    first: TickRecord,
    /// The last tick that it rendered, and the first one after its end.
    newest: TickRecord,
    ended: Option<TickRecord>,
    last_moved_ns: u64,
    now_ns: u64,
    least_m: f64,
    greatest_m: f64,
    largest_speed_mps: f64,
    largest_force_n: f64,
    has_gaps: bool,
}

impl ObservedExcitation {
    /// Begins to observe, after a record.
    pub(crate) fn new(excitation: Excitation, last: Option<TickRecord>) -> Self {
        Self {
            excitation,
            last,
            from_ns: None,
            course: None,
        }
    }

    /// Observes a tick.
    pub(crate) fn take(&mut self, record: &TickRecord) {
        self.from_ns.get_or_insert(record.began_ns);
        let last = self.last.replace(*record);
        match &mut self.course {
            Some(course) => course.take(record, last.as_ref()),
            None if record.input_word.is_motion() && record.input_word.new_scene() => {
                let origin_m = last.map_or(record.device_position, |last| last.device_position);
                self.course = Some(Course::new(record, origin_m));
            }
            None => {}
        }
    }

    /// Time since its first tick, s.
    pub(crate) fn gone_s(&self) -> f64 {
        self.course.as_ref().map_or(0.0, Course::duration_s)
    }

    /// Whether the excitation has ended and the handle rests again.
    pub(crate) fn is_over(&self) -> bool {
        match (&self.course, &self.last, self.from_ns) {
            (Some(course), ..) => course.rests(),
            (None, Some(last), Some(from_ns)) => last.began_ns - from_ns > NEVER_BEGUN_NS,
            _ => false,
        }
    }

    /// What was observed; nothing of one that never began.
    pub(crate) fn report(&self, was_interrupted: bool) -> Option<ExcitationReport> {
        let course = self.course.as_ref()?;
        Some(ExcitationReport {
            end: course.end(&self.excitation, was_interrupted),
            duration_s: course.duration_s(),
            first_tick: course.first.tick,
            last_tick: course.newest.tick,
            least_m: course.least_m,
            greatest_m: course.greatest_m,
            largest_speed_mps: course.largest_speed_mps,
            largest_force_n: course.largest_force_n,
        })
    }
}

impl Course {
    fn new(first: &TickRecord, origin_m: f64) -> Self {
        Self {
            first: *first,
            newest: *first,
            ended: None,
            last_moved_ns: first.began_ns,
            now_ns: first.began_ns,
            least_m: origin_m,
            greatest_m: origin_m,
            largest_speed_mps: 0.0,
            largest_force_n: 0.0,
            has_gaps: false,
        }
    }

    fn take(&mut self, record: &TickRecord, last: Option<&TickRecord>) {
        let before = last.unwrap_or(&self.newest);
        self.now_ns = record.began_ns;
        self.has_gaps |= before.tick + 1 != record.tick;
        let moved_m = record.device_position - before.device_position;
        if moved_m != 0.0 {
            self.last_moved_ns = record.began_ns;
        }
        if self.ended.is_some() {
            return;
        }
        self.least_m = self.least_m.min(record.device_position);
        self.greatest_m = self.greatest_m.max(record.device_position);
        self.largest_speed_mps = self.largest_speed_mps.max(record.device_velocity.abs());
        // What is not a motion any more, or another one, was taken away.
        if record.motion_end.is_some() || !record.input_word.is_motion() || record.input_word.new_scene() {
            self.ended = Some(*record);
            return;
        }
        self.newest = *record;
        if record.command_force.abs() > self.largest_force_n.abs() {
            self.largest_force_n = record.command_force;
        }
    }

    #[expect(clippy::cast_precision_loss, reason = "nanoseconds of an excitation")]
    fn duration_s(&self) -> f64 {
        (self.newest.began_ns - self.first.began_ns) as f64 * 1e-9
    }

    fn rests(&self) -> bool {
        let Some(ended) = &self.ended else { return false };
        let since_ns = ended.began_ns.max(self.last_moved_ns);
        self.now_ns - since_ns >= REST_NS || self.now_ns - ended.began_ns > MAX_REST_NS
    }

    fn end(&self, excitation: &Excitation, was_interrupted: bool) -> ExcitationEnd {
        let end = self.ended.and_then(|ended| ended.motion_end);
        let lag_m = self
            .ended
            .map_or(0.0, |ended| self.newest.block_position - ended.device_position);
        match end {
            // Against the force is against the force, whatever else happened.
            Some(MotionEnd::WrongWay) => ExcitationEnd::WrongWay,
            None | Some(MotionEnd::Interrupted) => ExcitationEnd::Interrupted,
            Some(_) if was_interrupted => ExcitationEnd::Interrupted,
            Some(_) if self.has_gaps => ExcitationEnd::Unrecorded,
            Some(MotionEnd::Lag) if lag_m.abs() <= REACHED * excitation.lag_limit_m => ExcitationEnd::Interrupted,
            Some(MotionEnd::Lag) => ExcitationEnd::Lag,
            Some(MotionEnd::Travel) => ExcitationEnd::Travel,
            Some(MotionEnd::Speed) => ExcitationEnd::Speed,
            Some(MotionEnd::Time) => ExcitationEnd::Time,
        }
    }
}
