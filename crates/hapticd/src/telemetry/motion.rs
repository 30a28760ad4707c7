//! The motion of the handle while a rig is commissioned, from the records of all ticks.

use super::pulse_mass::{Seen, mass_within};
use crate::rt::outbox::TickRecord;
use crate::rt::space::FIRST_AXIS;
use crate::telemetry::rest::{REST, Rest, Wait};
use haptic_core::planar::Plane;
use haptic_core::{MotionEnd, PulseShape};
use haptic_ipc::{PulseEnd, PulseReport, SampleY};
use std::time::Duration;

/// Time without a change of position after which the handle is at rest, ns.
const REST_NS: u64 = 30_000_000;

/// Time after which a handle that still moves is moved by something other than the pulse, ns.
const MAX_NS: u64 = 5_000_000_000;

/// Time for which a distance is taken as speed, ns; time after the force in which the handle may still gain speed, as a
/// device acts late; and largest ratio of its speed from then on to that before: a handle that coasts gains none.
const COAST_WINDOW_NS: u64 = 20_000_000;
const LATE_NS: u64 = 30_000_000;
const COAST: f64 = 1.25;

/// Least travel from which friction is estimated, in counts and m: over less, the encoder's steps
/// dominate.
const MIN_TRAVEL: (f64, f64) = (20.0, 5e-4);

/// Least travel that shows the direction of a force, in counts and m.
const MIN_SIGN: (f64, f64) = (4.0, 2e-4);

/// Distance over which it is seen which motor of a linkage carries the hand, m: farther away it is another linkage, and
/// the hand coasts as its friction lets it.
const NEAR_M: f64 = 5e-3;

/// Largest ratio of the path to the travel: a handle with a longer path has turned round, because
/// it has bounced or something else moves it.
const STRAIGHT: f64 = 1.1;

#[derive(Clone, Debug)]
pub(crate) struct HandleMotion {
    resolution_m: f64,
    /// The direction that is observed, on a rig of two axes.
    along: Plane,
    last: Option<TickRecord>,
    least_m: f64,
    greatest_m: f64,
    /// The greatest common divisor of all changes of position, in counts; 0 before the first.
    step_counts: u64,
    /// Where the hand is, m, on a line too.
    hand: Plane,
    rest: Rest,
    pulse: Option<ObservedPulse>,
}

/// The observed motion during a pulse.
#[derive(Clone, Debug)]
struct ObservedPulse {
    shape: PulseShape,
    /// Where the hand of a rig of two axes was first, and last until it went farther than the linkage stays alike, m.
    hand: Option<[Plane; 2]>,
    is_far: bool,
    /// The handle's first position, m, and its time, ns.
    from: Option<(f64, u64)>,
    first_force_ns: Option<u64>,
    last_force_ns: u64,
    last_moved_ns: u64,
    now_ns: u64,
    position_m: f64,
    end: Option<MotionEnd>,
    /// Least travel that shows the direction, m, by the rest before the force; infinite without one.
    least_travel_m: f64,
    /// Whether the handle has rested without force for as long as the pulse takes.
    rests_for_long: bool,
    /// The beginning of a window, ns and m, and the largest travel in one while the handle is pushed, and later, m.
    coast: Option<(u64, f64)>,
    pushed_m: f64,
    coasted_m: f64,
    largest_force_n: f64,
    /// Largest travel with the force while it flows, m.
    forward_m: f64,
    backward_m: f64,
    largest_speed_mps: f64,
    work_j: f64,
    path_m: f64,
    has_gaps: bool,
    ticks: Vec<Seen>,
}

impl HandleMotion {
    /// Begins to observe, on an encoder of this resolution, m.
    pub(crate) fn new(resolution_m: f64) -> Self {
        Self {
            resolution_m,
            along: FIRST_AXIS,
            last: None,
            least_m: f64::INFINITY,
            greatest_m: f64::NEG_INFINITY,
            step_counts: 0,
            hand: Plane::new(0.0, 0.0),
            rest: Rest::default(),
            pulse: None,
        }
    }

    /// Observes a tick, and what it has of a second axis: of both what is along the observed direction.
    pub(crate) fn take(&mut self, record: &TickRecord, y: Option<SampleY>) {
        let (y_m, y_n) = y.map_or((0.0, 0.0), |y| (y.device_position_m, y.command_force_n));
        let has_force = record.command_force != 0.0 || y_n != 0.0;
        if let Some(pulse) = self.pulse.as_mut().filter(|_| has_force) {
            pulse.begin_force(&self.rest, self.resolution_m);
        }
        self.hand = Plane::new(record.device_position, y_m);
        self.rest.take(self.hand, record.began_ns, has_force);
        let Some(y) = y else { return self.take_along(record) };
        if let Some(pulse) = &mut self.pulse {
            pulse.see(Plane::new(record.device_position, y.device_position_m));
        }
        let along = |x: f64, y: f64| self.along.dot(Plane::new(x, y));
        self.take_along(&TickRecord {
            device_position: along(record.device_position, y.device_position_m),
            device_velocity: along(record.device_velocity, y.device_velocity_mps),
            command_force: along(record.command_force, y.command_force_n),
            ..*record
        });
    }

    fn take_along(&mut self, record: &TickRecord) {
        let position_m = record.device_position;
        self.least_m = self.least_m.min(position_m);
        self.greatest_m = self.greatest_m.max(position_m);
        let last = self.last.replace(*record);
        let moved_m = last.map_or(0.0, |last| position_m - last.device_position);
        if self.resolution_m > 0.0 {
            #[expect(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "counts, and the cast saturates"
            )]
            let counts = (moved_m.abs() / self.resolution_m).round() as u64;
            self.step_counts = greatest_common_divisor(self.step_counts, counts);
        }
        if let Some(pulse) = &mut self.pulse {
            let range_m = self.rest.range_m(pulse.shape.duration_s());
            pulse.rests_for_long = range_m.is_some_and(|range_m| range_m <= at_least(REST, self.resolution_m));
            pulse.take(record, last.as_ref(), moved_m);
        }
    }

    /// The newest position, m.
    pub(crate) fn position_m(&self) -> f64 {
        self.last.map_or(0.0, |last| last.device_position)
    }

    /// The smallest and the largest position so far, m.
    pub(crate) fn range_m(&self) -> (f64, f64) {
        if self.least_m <= self.greatest_m {
            (self.least_m, self.greatest_m)
        } else {
            (0.0, 0.0)
        }
    }

    /// The step in which the position changes, m.
    pub(crate) fn step_m(&self) -> Option<f64> {
        #[expect(clippy::cast_precision_loss, reason = "a few counts")]
        (self.step_counts > 0).then_some(self.step_counts as f64 * self.resolution_m)
    }

    /// Begins to observe a pulse along a direction.
    pub(crate) fn begin_pulse(&mut self, shape: PulseShape, along: Plane) {
        if along != self.along {
            // Positions along another direction are other ones.
            self.along = along;
            (self.last, self.least_m, self.greatest_m) = (None, f64::INFINITY, f64::NEG_INFINITY);
        }
        self.pulse = Some(ObservedPulse {
            shape,
            hand: None,
            is_far: false,
            from: None,
            first_force_ns: None,
            last_force_ns: 0,
            last_moved_ns: 0,
            now_ns: 0,
            position_m: 0.0,
            end: None,
            least_travel_m: f64::INFINITY,
            rests_for_long: false,
            coast: None,
            pushed_m: 0.0,
            coasted_m: 0.0,
            largest_force_n: 0.0,
            forward_m: 0.0,
            backward_m: 0.0,
            largest_speed_mps: 0.0,
            work_j: 0.0,
            path_m: 0.0,
            has_gaps: false,
            ticks: Vec::new(),
        });
    }

    /// Whether the handle has rested before a pulse for as long as a wait asks.
    ///
    /// # Errors
    /// It does not come to rest.
    pub(crate) fn rests_for(&self, wait: &mut Wait) -> Result<bool, String> {
        let most_m = at_least(REST, self.resolution_m);
        wait.take(self.hand, &self.rest, most_m, self.least_travel_m())
    }

    /// Whether the pulse has ended and the handle rests again.
    pub(crate) fn pulse_is_over(&self) -> bool {
        self.pulse.as_ref().is_some_and(ObservedPulse::is_over)
    }

    /// Where a pulse began to push the hand of a rig of two axes, and how far it pushed it, m, while the linkage stayed
    /// alike.
    pub(crate) fn pushed_hand(&self) -> Option<[Plane; 2]> {
        self.pulse.as_ref()?.hand
    }

    /// Ends the observation of a pulse, whose force acted this long at most after its command; returns its report, and
    /// whether the pulse has moved the handle in its own direction, from a rest to a rest, and so that nothing else can
    /// have moved it.
    pub(crate) fn end_pulse(&mut self, was_interrupted: bool, delay: Duration) -> Option<(PulseReport, bool)> {
        let pulse = self.pulse.take()?;
        self.rest.begin_alone(self.hand);
        let (least_travel_m, rests_for_long) = (pulse.least_travel_m, pulse.rests_for_long);
        let coasts = pulse.coasted_m > COAST * pulse.pushed_m + at_least(REST, self.resolution_m);
        let report = pulse.report(self.resolution_m, was_interrupted, delay);
        let is_confirmed = matches!(report.end, PulseEnd::Time | PulseEnd::Travel | PulseEnd::Speed)
            && report.moved_m * report.force_n.signum() >= self.least_travel_m()
            && report.forward_m >= least_travel_m
            && rests_for_long
            && !coasts;
        Some((report, is_confirmed))
    }

    /// Least travel that shows the direction of a force, m.
    pub(crate) fn least_travel_m(&self) -> f64 {
        at_least(MIN_SIGN, self.resolution_m)
    }
}

fn at_least((counts, least_m): (f64, f64), resolution_m: f64) -> f64 {
    (counts * resolution_m).max(least_m)
}

fn greatest_common_divisor(mut a: u64, mut b: u64) -> u64 {
    while b > 0 {
        (a, b) = (b, a % b);
    }
    a
}

impl ObservedPulse {
    /// Sees the hand at a place, m.
    fn see(&mut self, hand: Plane) {
        let [from, to] = self.hand.get_or_insert([hand; 2]);
        self.is_far |= (hand - *from).length() > NEAR_M;
        if !self.is_far {
            *to = hand;
        }
    }

    /// A force flows now, after a rest.
    fn begin_force(&mut self, rest: &Rest, resolution_m: f64) {
        if self.first_force_ns.is_none() {
            let travel_m = rest.least_travel_m(self.shape.duration_s(), resolution_m);
            self.least_travel_m = travel_m.unwrap_or(f64::INFINITY);
        }
    }

    /// Takes in how far the handle goes in a short time, while it is pushed and while it coasts.
    fn coast(&mut self, position_m: f64) {
        let (from_ns, from_m) = *self.coast.get_or_insert((self.now_ns, position_m));
        if self.now_ns - from_ns < COAST_WINDOW_NS {
            return;
        }
        self.coast = Some((self.now_ns, position_m));
        let coasts = self.first_force_ns.is_some() && from_ns > self.last_force_ns + LATE_NS;
        let most_m = if coasts {
            &mut self.coasted_m
        } else {
            &mut self.pushed_m
        };
        *most_m = most_m.max((position_m - from_m).abs());
    }

    fn take(&mut self, record: &TickRecord, last: Option<&TickRecord>, moved_m: f64) {
        let now_ns = record.began_ns;
        let (from_m, _) = *self.from.get_or_insert((record.device_position, now_ns));
        self.has_gaps |= last.is_some_and(|last| last.tick + 1 != record.tick);
        self.now_ns = now_ns;
        self.position_m = record.device_position;
        self.end = self.end.or(record.motion_end);
        if moved_m != 0.0 {
            self.last_moved_ns = now_ns;
        }
        // The force of a tick acts until the next tick.
        let force_n = last.map_or(0.0, |last| last.command_force);
        self.work_j += force_n * moved_m;
        self.path_m += moved_m.abs();
        self.ticks.push(Seen {
            began_ns: now_ns,
            device_ns: record.device_time_ns,
            moved_m,
            force_n: record.command_force,
        });
        if record.command_force != 0.0 {
            self.first_force_ns.get_or_insert(now_ns);
            self.last_force_ns = now_ns;
        }
        self.coast(record.device_position);
        if record.command_force.abs() > self.largest_force_n.abs() {
            self.largest_force_n = record.command_force;
        }
        if record.command_force != 0.0 || force_n != 0.0 {
            let forward_m = (record.device_position - from_m) * self.shape.force_n.signum();
            self.forward_m = self.forward_m.max(forward_m);
            self.backward_m = self.backward_m.max(-forward_m);
            self.largest_speed_mps = self.largest_speed_mps.max(record.device_velocity.abs());
        }
    }

    fn is_over(&self) -> bool {
        let Some((_, from_ns)) = self.from else { return false };
        // A pulse that has moved nothing shows nothing, and needs no rest.
        let rests = self.rests() && (self.forward_m < self.least_travel_m || self.rests_for_long);
        self.end.is_some() && (rests || self.now_ns - from_ns > MAX_NS)
    }

    fn rests(&self) -> bool {
        let since_ns = self.last_force_ns.max(self.last_moved_ns);
        self.now_ns - since_ns >= REST_NS
    }

    #[expect(clippy::cast_precision_loss, reason = "nanoseconds of a pulse")]
    fn report(&self, resolution_m: f64, was_interrupted: bool, delay: Duration) -> PulseReport {
        let shape = &self.shape;
        let moved_m = self.from.map_or(0.0, |(from_m, _)| self.position_m - from_m);
        let end = match self.end {
            // Against the force is against the force, whatever else happened.
            Some(MotionEnd::WrongWay) => PulseEnd::WrongWay,
            None | Some(MotionEnd::Interrupted | MotionEnd::Lag) => PulseEnd::Interrupted,
            Some(_) if was_interrupted || self.first_force_ns.is_none() => PulseEnd::Interrupted,
            Some(_) if self.has_gaps => PulseEnd::Unrecorded,
            Some(MotionEnd::Travel) => PulseEnd::Travel,
            Some(MotionEnd::Speed) => PulseEnd::Speed,
            Some(MotionEnd::Time) => PulseEnd::Time,
        };
        let is_sound = matches!(end, PulseEnd::Time | PulseEnd::Travel | PulseEnd::Speed)
            && self.rests()
            && moved_m.abs() >= at_least(MIN_TRAVEL, resolution_m)
            && self.path_m <= STRAIGHT * moved_m.abs();
        let friction_n = is_sound.then(|| self.work_j / self.path_m);
        let mass = friction_n.and_then(|_| {
            let delay_ns = delay.as_nanos().try_into().unwrap_or(u64::MAX);
            mass_within(&self.ticks, delay_ns, resolution_m)
        });
        let force_ns = self.first_force_ns.map_or(0, |first_ns| self.last_force_ns - first_ns);
        PulseReport {
            motors_moved: None,
            force_n: shape.force_n,
            largest_force_n: self.largest_force_n,
            end,
            duration_ms: force_ns as f64 * 1e-6,
            moved_m,
            forward_m: self.forward_m,
            backward_m: self.backward_m,
            largest_speed_mps: self.largest_speed_mps,
            friction_n,
            mass_kg: mass.map(|(kg, _)| kg),
            mass_within_kg: mass.map(|(_, half_width_kg)| half_width_kg),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rt::outbox::tests::record;

    const SHAPE: PulseShape = PulseShape {
        force_n: 2.0,
        rise_s: 0.05,
        hold_s: 0.1,
        fall_s: 0.05,
        travel_limit_m: 0.02,
        speed_limit_mps: 0.3,
        wrong_way_limit_m: 1e-4,
    };

    /// A handle of 1 kg with 0.5 N of friction that 2 N push for 0.2 s; what was found and whether it was over in time.
    fn pushed(gap: bool) -> (HandleMotion, PulseReport, bool) {
        let mut motion = HandleMotion::new(1e-5);
        motion.begin_pulse(SHAPE, FIRST_AXIS);
        let mut over = None;
        for tick in 0..3000_u64 {
            let gone_s = 1e-3 * (tick as f64 - 510.0);
            let (pushed_s, coasts_s) = (gone_s.clamp(0.0, 0.2), (gone_s - 0.2).clamp(0.0, 0.6));
            let position = 0.75 * pushed_s * pushed_s + 0.3 * coasts_s - 0.25 * coasts_s * coasts_s;
            let mut seen = record(tick);
            seen.device_position = (position / 1e-5).round() * 1e-5;
            seen.device_velocity = 1.5 * pushed_s - 0.5 * coasts_s;
            seen.command_force = if (510..710).contains(&tick) { 2.0 } else { 0.0 };
            seen.motion_end = (tick >= 710).then_some(MotionEnd::Time);
            if !gap || tick != 600 {
                motion.take(&seen, None);
            }
            if motion.pulse_is_over() {
                over.get_or_insert(tick);
            }
        }
        assert!(over.is_some_and(|tick| tick > 710), "{over:?}");
        let (report, is_confirmed) = motion.end_pulse(false, Duration::ZERO).expect("it was watched");
        (motion, report, is_confirmed)
    }

    #[test]
    fn friction_is_the_work_by_the_distance() {
        let (motion, report, is_confirmed) = pushed(false);
        let friction_n = report.friction_n.expect("it moved");
        assert!((friction_n - 0.5).abs() < 0.01, "{report:?}");
        let mass_kg = report.mass_kg.expect("it was fast");
        assert!((mass_kg - 1.0).abs() < 0.03, "{report:?}");
        assert!(is_confirmed);
        assert_eq!(motion.step_m(), Some(1e-5));
        assert!((motion.range_m().1 - report.moved_m).abs() < 1e-12);
        assert!((report.duration_ms - 199.0).abs() < 1e-9);
    }

    #[test]
    fn a_gap_shows_nothing() {
        let (_, report, is_confirmed) = pushed(true);
        assert_eq!((report.end, report.friction_n), (PulseEnd::Unrecorded, None));
        assert!(!is_confirmed);
    }

    #[test]
    fn hand_of_two_axes_is_seen_until_it_is_5_mm_away() {
        let mut motion = HandleMotion::new(1e-5);
        motion.begin_pulse(SHAPE, FIRST_AXIS);
        assert_eq!(motion.pushed_hand(), None);
        // It goes 9 mm, and comes back.
        for (tick, mm) in [0.0, 3.0, 9.0, 4.0].into_iter().enumerate() {
            let mut seen = record(tick as u64);
            seen.device_position = 0.01;
            let y = SampleY {
                device_position_m: mm * 1e-3,
                ..SampleY::default()
            };
            motion.take(&seen, Some(y));
        }
        assert_eq!(
            motion.pushed_hand(),
            Some([Plane::new(0.01, 0.0), Plane::new(0.01, 0.003)])
        );
    }

    #[test]
    fn an_encoder_that_counts_in_fours_is_seen_through() {
        let mut motion = HandleMotion::new(1e-5);
        for (tick, counts) in [0.0, 12.0, 20.0, 16.0, 16.0, 40.0].into_iter().enumerate() {
            let mut seen = record(tick as u64);
            seen.device_position = counts * 1e-5;
            motion.take(&seen, None);
        }
        assert!((motion.step_m().expect("it moved") - 4e-5).abs() < 1e-12);
    }
}
