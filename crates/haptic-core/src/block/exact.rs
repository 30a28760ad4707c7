//! The exact tick: the block between two device samples, solved in closed form.
//!
//! At tick k both ends of the interval from `t_(k-1)` to `t_k` have been measured, so nothing is
//! extrapolated: `K p + B v` is taken linear between the two samples, and the block's motion on that interval,
//! with every stop and breakaway in it, is solved to rounding error. `T` is the time that really elapsed, so jitter and
//! missed ticks are integrated and not ignored. The force `F_k = K (p_k - x_k) + B (v_k - w_k)` goes out in the
//! same tick.
//!
//! * Stuck: the force on the block is linear in time, so the breakaway time is a quotient.
//! * Sliding: the velocity's extrema are closed-form (see the oscillator); between them it is monotone, so the
//!   first one at or below the re-stick level brackets the stop, and a safeguarded Newton iteration finds it.
//! * The velocity threshold DV: a slide is *armed* once it has been faster than DV. An armed slide that falls back to DV
//!   re-sticks if the force on the block at rest is within the static limit, and otherwise goes on, disarmed. An unarmed
//!   slide re-sticks at zero velocity. DV = 0 is the ideal law, and the breakaway force stays at Fs for every DV.
//!
//! A slide goes forwards by construction (a displacement that rounding makes negative is none), so friction only ever opposes the motion,
//! and a stuck block does not move at all: friction creates no energy and the block does not creep. Work per tick is bounded; what is left when the bound is reached is done in one implicit step.

use super::oscillator::{Motion, Oscillator, Response};
use super::{BlockState, Contact, EventSink, Rendered};
use crate::friction::{Directional, Friction};
use crate::parameters::Direction;
use crate::scene::Scene;

/// One direction of sliding, compiled.
#[derive(Clone, Copy, Debug)]
struct Slide {
    oscillator: Oscillator,
    /// Total damping `B + b`, N s/m.
    damping: f64,
    /// `Fd`, N.
    dynamic_force: f64,
    /// The response for the tick length met last: a steady tick finds it here.
    cached_for: f64,
    cached: Response,
}

impl Slide {
    /// The response at `t`: the one kept where the tick is as long as the last, one derived from it where it nearly is.
    fn response(&mut self, t: f64) -> Response {
        #[expect(clippy::float_cmp, reason = "a cache key: the same number or not")]
        if t == self.cached_for {
            return self.cached;
        }
        if let Some(nearby) = self.oscillator.response_near(&self.cached, t - self.cached_for) {
            return nearby;
        }
        self.cached = self.oscillator.response(t);
        self.cached_for = t;
        self.cached
    }
}

/// The exact scheme for one scene.
#[derive(Clone, Copy, Debug)]
pub struct ExactBlock {
    mass: f64,
    stiffness: f64,
    damping: f64,
    breakaway: Directional,
    velocity_threshold: f64,
    positive: Slide,
    negative: Slide,
    state: BlockState,
}

/// How a slide ends, or that it does not.
enum SlideEnd {
    /// It goes on to the end of the interval; whether it is armed there.
    None { armed: bool },
    /// The velocity falls to the re-stick level at this time.
    Falls { at: f64, armed: bool },
    /// The search met more extrema than a tick may work through.
    Exhausted,
}

/// Work that every tick may do, beside two for each half-turn of the free oscillation.
const BASE_WORK: f64 = 16.0;
/// Bound on a tick's events, and on the extrema looked at in it, whatever time has elapsed.
const MAX_WORK: f64 = BASE_WORK + 2.0 * crate::scene::MAX_PHASE_PER_TICK_RAD / core::f64::consts::PI;

impl ExactBlock {
    /// Compiles a scene that [`Scene::validate`] accepts.
    #[must_use]
    pub fn new(scene: &Scene, state: BlockState) -> Self {
        let Friction::Karnopp(law) = &scene.friction;
        let slide = |direction| {
            let damping = scene.coupling.damping + law.viscous.get(direction);
            let oscillator = Oscillator::new(scene.block.mass, damping, scene.coupling.stiffness);
            Slide {
                oscillator,
                damping,
                dynamic_force: law.dynamic_force.get(direction),
                cached_for: 0.0,
                cached: oscillator.response(0.0),
            }
        };
        Self {
            mass: scene.block.mass,
            stiffness: scene.coupling.stiffness,
            damping: scene.coupling.damping,
            breakaway: law.breakaway_force(),
            velocity_threshold: law.velocity_threshold,
            positive: slide(Direction::Positive),
            negative: slide(Direction::Negative),
            state,
        }
    }

    /// The block and the last device sample.
    #[must_use]
    pub fn state(&self) -> &BlockState {
        &self.state
    }

    pub(crate) fn set_state(&mut self, state: BlockState) {
        self.state = state.consistent();
        // The threshold may not be the one under which the slide was armed.
        self.state.armed &= self.state.velocity.abs() > self.velocity_threshold;
    }

    fn slide(&mut self, direction: Direction) -> &mut Slide {
        match direction {
            Direction::Positive => &mut self.positive,
            Direction::Negative => &mut self.negative,
        }
    }

    /// Moves the block on by `elapsed_s` seconds, in which the device went to `position` and `velocity`.
    ///
    /// With `elapsed_s` of zero or less the block stands still and only the force is new.
    pub fn tick(&mut self, elapsed_s: f64, position: f64, velocity: f64, sink: &mut impl EventSink) -> Rendered {
        let from = self.state;
        self.state.device_position = position;
        self.state.device_velocity = velocity;
        let mut rendered = Rendered {
            coupling_force: 0.0,
            events: 0,
            work_exhausted: false,
        };
        if elapsed_s > 0.0 {
            // Differences, not K p: at a large offset the products would drown the deflection.
            let load = Load {
                // The coupling force if the block stood still at its start position.
                at_start: self.stiffness * (from.device_position - from.position) + self.damping * from.device_velocity,
                slope: (self.stiffness * (position - from.device_position)
                    + self.damping * (velocity - from.device_velocity))
                    / elapsed_s,
                // Rounding of K p + B v: within it a force equals the static limit.
                rounding: 4.0
                    * f64::EPSILON
                    * (2.0 * self.stiffness * from.position.abs() + (self.damping * from.device_velocity).abs()),
            };
            if !self.steady(elapsed_s, &load, sink) {
                self.with_events(elapsed_s, &load, sink, &mut rendered);
            }
            if !(self.state.position.is_finite() && self.state.velocity.is_finite()) {
                // Forces beyond the range of numbers: start over from rest at the device.
                self.state = BlockState::new(position, 0.0, position, velocity);
            }
        }
        rendered.coupling_force = self.coupling_force();
        rendered
    }

    fn coupling_force(&self) -> f64 {
        let s = &self.state;
        self.stiffness * (s.device_position - s.position) + self.damping * (s.device_velocity - s.velocity)
    }

    /// The common tick: stuck to its end, or sliding to its end. Returns false, with nothing changed, when an
    /// event may lie in it.
    fn steady(&mut self, elapsed_s: f64, load: &Load, sink: &mut impl EventSink) -> bool {
        match self.state.contact {
            Contact::Stuck => {
                let at_end = load.at_start + load.slope * elapsed_s;
                let (least, most) = (load.at_start.min(at_end), load.at_start.max(at_end));
                most < self.breakaway.positive && least > -self.breakaway.negative
            }
            Contact::Sliding(direction) => {
                let threshold = self.velocity_threshold;
                let armed = self.state.armed;
                let sign = direction.sign();
                let w0 = sign * self.state.velocity;
                let slide = self.slide(direction);
                let motion = slide.motion(sign, w0, load.at_start, load.slope);
                let r = slide.response(elapsed_s);
                let (y, w) = slide.oscillator.advance(&motion, &r);
                let y = y.max(0.0);
                let (a0, beta) = slide.oscillator.acceleration(&motion);
                let a = a0 * r.dh + beta * r.h;
                let one_extremum_at_most = slide.oscillator.half_turns(elapsed_s) < 1.0;
                let dips = a0 < 0.0 && a > 0.0;
                let level = if armed { threshold } else { 0.0 };
                // A peak inside could arm the slide and be fallen from.
                let may_arm_unseen = threshold > 0.0 && !armed && a0 > 0.0 && a < 0.0;
                // At exactly zero velocity and acceleration the direction is for the full search to decide.
                let sure = one_extremum_at_most && w > level && (w0 > 0.0 || a0 > 0.0) && !dips && !may_arm_unseen;
                if sure {
                    sink.slid(sign * slide.dynamic_force, sign * y);
                    self.state.position += sign * y;
                    self.state.velocity = sign * w;
                    self.state.armed = armed || w > threshold;
                }
                sure
            }
        }
    }

    /// The tick with stops and breakaways in it.
    fn with_events(&mut self, elapsed_s: f64, load: &Load, sink: &mut impl EventSink, rendered: &mut Rendered) {
        let budget = self.work_budget(elapsed_s);
        let mut looked_at = 0;
        let mut time = 0.0;
        // Displacement since the start of the tick: small, so that it keeps its digits.
        let mut moved = 0.0;
        // Set where an event fixes the net force better than subtraction can.
        let mut net_force: Option<f64> = None;
        let start = self.state.position;
        while time < elapsed_s {
            let remaining = elapsed_s - time;
            if rendered.events >= budget {
                moved = self.implicit_step(elapsed_s, remaining, load, moved, sink);
                rendered.work_exhausted = true;
                break;
            }
            let at_rest = load.at(time) - self.stiffness * moved;
            match self.state.contact {
                Contact::Stuck => {
                    let Some((delay, direction, net)) = self.breakaway(at_rest, load) else {
                        break;
                    };
                    if delay >= remaining {
                        break;
                    }
                    time += delay;
                    net_force = Some(net);
                    self.change_contact(Contact::Sliding(direction), time, sink, rendered);
                }
                Contact::Sliding(direction) => {
                    let sign = direction.sign();
                    let w0 = sign * self.state.velocity;
                    let armed = self.state.armed;
                    let threshold = self.velocity_threshold;
                    let slide = self.slide(direction);
                    let mut motion = slide.motion(sign, w0, at_rest, load.slope);
                    if let Some(net) = net_force.take() {
                        motion.f0 = net;
                    }
                    let oscillator = slide.oscillator;
                    let friction = sign * slide.dynamic_force;
                    let (end, extrema) =
                        first_fall(&oscillator, &motion, remaining, armed, threshold, budget - looked_at);
                    looked_at += extrema;
                    match end {
                        SlideEnd::None { armed } => {
                            let (y, w) = oscillator.advance(&motion, &oscillator.response(remaining));
                            let y = y.max(0.0);
                            sink.slid(friction, sign * y);
                            moved += sign * y;
                            // Rounding may leave a hair of backward motion at the end of the interval.
                            self.state.velocity = sign * w.max(0.0);
                            self.state.armed = armed;
                            break;
                        }
                        SlideEnd::Falls { at, armed } => {
                            let (y, _) = oscillator.advance(&motion, &oscillator.response(at));
                            let y = y.max(0.0);
                            sink.slid(friction, sign * y);
                            moved += sign * y;
                            time += at;
                            net_force = self.fall(direction, armed, load, time, moved, sink, rendered);
                        }
                        SlideEnd::Exhausted => {
                            moved = self.implicit_step(elapsed_s, remaining, load, moved, sink);
                            rendered.work_exhausted = true;
                            break;
                        }
                    }
                }
            }
        }
        self.state.position = start + moved;
    }

    fn dynamic_force(&self, direction: Direction) -> f64 {
        match direction {
            Direction::Positive => self.positive.dynamic_force,
            Direction::Negative => self.negative.dynamic_force,
        }
    }

    fn work_budget(&self, elapsed_s: f64) -> u32 {
        let half_turns = self
            .positive
            .oscillator
            .half_turns(elapsed_s)
            .max(self.negative.oscillator.half_turns(elapsed_s));
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 16 to 271")]
        let budget = (BASE_WORK + 2.0 * half_turns).min(MAX_WORK) as u32;
        budget
    }

    /// When and in which direction a stuck block lets go, and with which net force in that direction.
    fn breakaway(&self, at_rest: f64, load: &Load) -> Option<(f64, Direction, f64)> {
        let pulled = Direction::of(at_rest);
        if at_rest.abs() > self.breakaway.get(pulled) + load.rounding {
            // Beyond the limit already, as after a change of parameters.
            return Some((0.0, pulled, at_rest.abs() - self.dynamic_force(pulled)));
        }
        if load.slope == 0.0 {
            return None;
        }
        let towards = Direction::of(load.slope);
        let limit = self.breakaway.get(towards);
        let delay = ((limit - towards.sign() * at_rest) / load.slope.abs()).max(0.0);
        Some((delay, towards, limit - self.dynamic_force(towards)))
    }

    /// The slide has fallen to its re-stick level: it sticks, turns round, or goes on disarmed.
    ///
    /// Returns the net force of the slide that follows, where it is known.
    #[expect(clippy::too_many_arguments, reason = "the whole state of the event loop")]
    fn fall(
        &mut self,
        direction: Direction,
        armed: bool,
        load: &Load,
        time: f64,
        moved: f64,
        sink: &mut impl EventSink,
        rendered: &mut Rendered,
    ) -> Option<f64> {
        let at_rest = load.at(time) - self.stiffness * moved;
        let forward = self.breakaway.get(Direction::of(at_rest));
        let frictionless = self.breakaway.positive == 0.0 && self.breakaway.negative == 0.0;
        if at_rest.abs() <= forward + load.rounding && !(frictionless && load.slope != 0.0) {
            self.change_contact(Contact::Stuck, time, sink, rendered);
            return None;
        }
        if armed && self.velocity_threshold > 0.0 {
            self.state.velocity = direction.sign() * self.velocity_threshold;
            self.state.armed = false;
            rendered.events += 1; // work done, although the contact is the same
            return None;
        }
        let pull = if at_rest.abs() <= load.rounding {
            load.slope
        } else {
            at_rest
        };
        let towards = Direction::of(pull);
        let dynamic_force = self.dynamic_force(towards);
        self.change_contact(Contact::Sliding(towards), time, sink, rendered);
        // Within rounding the slope decides the direction, and the force may point the other way by as much.
        Some((towards.sign() * at_rest - dynamic_force).max(0.0))
    }

    fn change_contact(&mut self, to: Contact, at_s: f64, sink: &mut impl EventSink, rendered: &mut Rendered) {
        let from = self.state.contact;
        self.state.contact = to;
        self.state.velocity = 0.0;
        self.state.armed = false;
        rendered.events += 1;
        if from != to {
            sink.contact_changed(at_s, from, to);
        }
    }

    /// One backward-Euler step of the remaining time: stable and dissipative whatever its length. Returns the
    /// displacement since the start of the tick.
    fn implicit_step(
        &mut self,
        elapsed_s: f64,
        remaining: f64,
        load: &Load,
        moved: f64,
        sink: &mut impl EventSink,
    ) -> f64 {
        let at_rest = load.at(elapsed_s) - self.stiffness * moved;
        let impulse = self.mass * self.state.velocity / remaining + at_rest;
        let direction = Direction::of(impulse);
        let from = self.state.contact;
        self.state.armed = false;
        let displacement = if impulse.abs() <= self.breakaway.get(direction) {
            self.state.contact = Contact::Stuck;
            self.state.velocity = 0.0;
            0.0
        } else {
            let slide = *self.slide(direction);
            let net = (impulse.abs() - slide.dynamic_force).max(0.0);
            let speed = net / (self.mass / remaining + slide.damping + self.stiffness * remaining);
            self.state.contact = Contact::Sliding(direction);
            self.state.velocity = direction.sign() * speed;
            let displacement = remaining * self.state.velocity;
            sink.slid(direction.sign() * slide.dynamic_force, displacement);
            displacement
        };
        if from != self.state.contact {
            sink.contact_changed(elapsed_s, from, self.state.contact);
        }
        moved + displacement
    }
}

impl Slide {
    /// The motion in the coordinate in which this slide goes forwards.
    fn motion(&self, sign: f64, w0: f64, at_rest: f64, slope: f64) -> Motion {
        Motion {
            w0,
            f0: sign * at_rest - self.dynamic_force,
            g1: sign * slope,
        }
    }
}

/// `K p + B v` between two samples, less `K` times the block's position at the start of the tick.
struct Load {
    at_start: f64,
    slope: f64,
    rounding: f64,
}

impl Load {
    fn at(&self, time: f64) -> f64 {
        self.at_start + self.slope * time
    }
}

/// The first time in `(0, remaining]` at which a forward slide falls to its re-stick level, and the number of
/// velocity extrema looked at to find it.
fn first_fall(
    oscillator: &Oscillator,
    motion: &Motion,
    remaining: f64,
    mut armed: bool,
    threshold: f64,
    most_extrema: u32,
) -> (SlideEnd, u32) {
    if motion.w0 == 0.0 && oscillator.acceleration(motion) == (0.0, 0.0) {
        // At rest and without load: nothing falls.
        return (SlideEnd::None { armed }, 0);
    }
    let (mut extremum, distance) = oscillator.extrema(motion);
    let mut extrema = 0;
    let mut from = 0.0;
    let mut w_from = motion.w0;
    loop {
        let to = extremum.min(remaining);
        let (w_to, _) = oscillator.velocity(motion, to);
        if w_to > w_from {
            armed = armed || w_to > threshold;
        } else {
            let level = if armed { threshold } else { 0.0 };
            if w_to <= level && w_from >= level {
                // Touching the end of the interval from above is for the next tick to see.
                let at = find_fall(oscillator, motion, level, from, to, remaining);
                return (SlideEnd::Falls { at, armed }, extrema);
            }
        }
        if to >= remaining {
            return (SlideEnd::None { armed }, extrema);
        }
        if extrema >= most_extrema {
            return (SlideEnd::Exhausted, extrema);
        }
        extrema += 1;
        from = to;
        w_from = w_to;
        extremum += distance;
    }
}

/// The root of `w - level` in an interval on which `w` falls from above the level to or below it.
fn find_fall(oscillator: &Oscillator, motion: &Motion, level: f64, from: f64, to: f64, scale: f64) -> f64 {
    let (mut above, mut below) = (from, to);
    let mut at = 0.5 * (from + to);
    // Newton from the middle; each step that leaves the bracket is replaced by a bisection, so that 64 always suffice.
    for _ in 0..64 {
        let (w, a) = oscillator.velocity(motion, at);
        if w > level {
            above = at;
        } else {
            below = at;
        }
        let newton = at - (w - level) / a;
        let next = if newton > above && newton < below {
            newton
        } else {
            0.5 * (above + below)
        };
        // Newton's error is then that of rounding; asking for less would chase noise.
        if (next - at).abs() <= 1e-14 * scale {
            return next;
        }
        at = next;
    }
    at
}
