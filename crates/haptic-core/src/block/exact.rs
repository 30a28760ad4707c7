//! The exact tick: the block between two device samples, solved in closed form.
//!
//! At tick k both ends of the interval from `t_(k-1)` to `t_k` have been measured, so nothing is
//! extrapolated: `K p + B v` is taken linear between the two samples, and the block's motion on
//! that interval, with every stop and breakaway in it, is solved to rounding error. `T` is the time
//! that really elapsed, so jitter and missed ticks are integrated and not ignored. The force `F_k =
//! K (p_k - x_k) + B (v_k - w_k)` goes out in the same tick.
//!
//! * Stuck: the force on the block is linear in time, so the breakaway time is a quotient.
//! * Sliding: the velocity's extrema are closed-form (see the oscillator); between them it is
//!   monotone, so the first one at or below the re-stick level brackets the stop, and a safeguarded
//!   Newton iteration finds it.
//! * Rising static friction: the limit is a concave function of the time at rest, so the breakaway
//!   is found by Newton's method from the right.
//! * Stribeck's curve is not an oscillator: its slides are power series of the motion. Only they are
//!   not exact, but to a tolerance.
//! * The velocity threshold DV: a slide is *armed* once it has been faster than DV. An armed slide
//!   that falls back to DV re-sticks if the force on the block at rest is within the static limit,
//!   and otherwise continues, disarmed. An unarmed slide re-sticks at zero velocity. DV = 0 is the
//!   ideal law, and the breakaway force stays at Fs for every DV.
//!
//! A slide goes forwards by construction (a displacement that rounding makes negative is none), so
//! friction only ever opposes the motion, and a stuck block does not move at all: friction creates
//! no energy and the block does not creep. Work per tick is bounded; what is left when the bound is
//! reached is done in a few implicit steps.

use super::body::{BlockState, Body, Coupling, EventSink, Load, Rendered};
use super::course::{CoupledBlock, Course, Outcome, PiecewiseBlock, under, work_budget};
use super::expansion::Piece;
use super::linear_slide::FallLevel;
use super::oscillator::InitialState;
use crate::contact::{Contact, ContactMemory, StaticLimit};
use crate::directional::Direction;
use crate::snapshot::Archive;
use core::fmt::Debug;

/// The exact scheme for one scene: `S` is its slide, of which there are `N`, `R` how its static limit goes with the
/// time at rest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ExactBlock<S, R, const N: usize> {
    coupled: CoupledBlock,
    velocity_threshold: f64,
    slides: Slides<S, N>,
    static_limit: R,
}

impl<S: Slide, R: StaticLimit, const N: usize> ExactBlock<S, R, N> {
    /// `velocity_threshold` is `DV`, m/s; `slides` and `static_limit` are those of a law that
    /// [`Scene::validate`](crate::Scene::validate) accepts.
    pub(crate) fn new(
        mass: f64,
        coupling: Coupling,
        velocity_threshold: f64,
        slides: Slides<S, N>,
        static_limit: R,
    ) -> Self {
        let mut block = Self {
            coupled: CoupledBlock::new(mass, coupling),
            velocity_threshold,
            slides,
            static_limit,
        };
        block.coupled.state.contact = block.at_rest();
        block
    }

    /// Moves the block on from the origin, with a velocity (m/s), for `elapsed_s` under what a coupling would do to it
    /// if it stood still there: a force, N, and its slope, N/s.
    pub(crate) fn advance_from_origin(
        &mut self,
        velocity: f64,
        elapsed_s: f64,
        (at_start, slope): (f64, f64),
        sink: &mut impl EventSink,
    ) -> (Rendered, BlockState) {
        self.set_state(BlockState::new(0.0, velocity, 0.0, 0.0));
        let rendered = under(self, elapsed_s, Load { at_start, slope }, sink);
        (rendered, self.coupled.state)
    }

    /// The static limit now, N.
    fn limit(&self, direction: Direction) -> f64 {
        self.limit_after(direction, 0.0)
    }

    fn limit_after(&self, direction: Direction, wait_s: f64) -> f64 {
        let slide = self.slides.get(direction);
        self.static_limit
            .after(slide.static_force(), slide.dynamic_force(), wait_s)
    }

    fn frictionless(&self) -> bool {
        let none = |direction| self.slides.get(direction).static_force() == 0.0;
        none(Direction::Positive) && none(Direction::Negative)
    }

    /// Whether it is faster than the threshold: a slide that is found so is armed.
    fn is_fast(&self) -> bool {
        self.coupled.state.velocity.abs() > self.velocity_threshold
    }

    fn fall_level(&self) -> FallLevel {
        FallLevel {
            armed: self.coupled.state.armed,
            threshold: self.velocity_threshold,
        }
    }

    /// Rests until the contact lets go, or until the end of the tick.
    fn rest(&mut self, course: &mut Course, sink: &mut impl EventSink) -> Outcome {
        let (remaining, at_rest) = (course.remaining(), course.at_rest(&self.coupled.coupling));
        let breakaway = self.breakaway(at_rest, course.load.slope, course.rounding);
        let Some((delay, direction)) = breakaway.filter(|(delay, _)| *delay < remaining) else {
            self.static_limit.rest(remaining);
            return Outcome::TickEnds;
        };
        let limit = self.limit_after(direction, delay);
        // At the limit the pull is the limit; beyond it already, as after a change of parameters,
        // it is what it is.
        let pull = if delay > 0.0 {
            limit
        } else {
            (direction.sign() * at_rest).max(limit)
        };
        course.time += delay;
        let slide = self.slides.get_mut(direction);
        slide.set_off(limit);
        course.net_force = Some(pull - slide.friction_at(0.0));
        self.change_contact(Contact::Sliding(direction), course, sink);
        Outcome::NextPiece
    }

    /// Slides until the slide has fallen, until its piece ends, or until the end of the tick.
    fn slide(&mut self, direction: Direction, course: &mut Course, sink: &mut impl EventSink) -> Outcome {
        let (remaining, at_rest) = (course.remaining(), course.at_rest(&self.coupled.coupling));
        let sign = direction.sign();
        let level = self.fall_level();
        let w0 = sign * self.coupled.state.velocity;
        let slide = self.slides.get_mut(direction);
        let motion = InitialState {
            w0,
            f0: course
                .net_force
                .take()
                .unwrap_or_else(|| sign * at_rest - slide.friction_at(0.0)),
            g1: sign * course.load.slope,
        };
        let Some(SlidePiece { piece, armed, falls }) = slide.piece(&motion, level, course, sink.listens()) else {
            return Outcome::Exhausted;
        };
        sink.dissipated(piece.dissipated);
        course.work += piece.work;
        course.moved += sign * piece.distance;
        course.time += piece.lasted_s;
        if falls {
            course.net_force = self.fall(direction, armed, course, sink);
            return Outcome::NextPiece;
        }
        self.coupled.state.velocity = sign * piece.speed;
        self.coupled.state.armed = armed;
        if piece.lasted_s >= remaining {
            Outcome::TickEnds
        } else {
            Outcome::NextPiece
        }
    }

    /// When and in which direction a stuck block lets go.
    fn breakaway(&self, at_rest: f64, slope: f64, rounding: f64) -> Option<(f64, Direction)> {
        let pulled = Direction::of(at_rest);
        if at_rest.abs() > self.limit(pulled) + rounding {
            return Some((0.0, pulled));
        }
        if slope == 0.0 {
            return None;
        }
        let towards = Direction::of(slope);
        let slide = self.slides.get(towards);
        let delay = self.static_limit.delay(
            slide.static_force(),
            slide.dynamic_force(),
            towards.sign() * at_rest,
            slope.abs(),
        );
        Some((delay, towards))
    }

    /// The slide has fallen to its re-stick level: it sticks, turns round, or continues disarmed.
    ///
    /// Returns the net force of the slide that follows, where it is known.
    fn fall(
        &mut self,
        direction: Direction,
        armed: bool,
        course: &mut Course,
        sink: &mut impl EventSink,
    ) -> Option<f64> {
        let (rounding, slope) = (course.rounding, course.load.slope);
        let at_rest = course.at_rest(&self.coupled.coupling);
        let slide = self.slides.get(direction);
        // It comes to rest with the friction of its end, which is more than a fresh contact's
        // where a curve rises towards rest.
        self.static_limit
            .begin_at(slide.static_force(), slide.dynamic_force(), slide.friction_at(0.0));
        let limit = self.limit(Direction::of(at_rest));
        if at_rest.abs() <= limit + rounding && !(self.frictionless() && slope != 0.0) {
            self.change_contact(Contact::Stuck, course, sink);
            return None;
        }
        if armed && self.velocity_threshold > 0.0 {
            self.coupled.state.velocity = direction.sign() * self.velocity_threshold;
            self.coupled.state.armed = false;
            course.rendered.events += 1; // work done, although the contact is the same
            return None;
        }
        let pull = if at_rest.abs() <= rounding { slope } else { at_rest };
        let towards = Direction::of(pull);
        let limit = self.limit(towards);
        let slide = self.slides.get_mut(towards);
        slide.set_off(limit);
        let friction = slide.friction_at(0.0);
        self.change_contact(Contact::Sliding(towards), course, sink);
        // Within rounding the slope decides the direction, and the force may point the other way by
        // as much.
        Some((towards.sign() * at_rest - friction).max(0.0))
    }

    fn change_contact(&mut self, to: Contact, course: &mut Course, sink: &mut impl EventSink) {
        let state = &mut self.coupled.state;
        let from = state.contact;
        state.contact = to;
        state.velocity = 0.0;
        state.armed = false;
        course.rendered.events += 1;
        if from != to {
            sink.contact_changed(course.time, from, to);
        }
    }
}

impl<S: Slide, R: StaticLimit, const N: usize> PiecewiseBlock for ExactBlock<S, R, N> {
    fn coupled(&self) -> &CoupledBlock {
        &self.coupled
    }

    fn coupled_mut(&mut self) -> &mut CoupledBlock {
        &mut self.coupled
    }

    fn budget(&self, elapsed_s: f64) -> u32 {
        let half_turns = |direction| self.slides.get(direction).half_turns(elapsed_s);
        let half_turns = half_turns(Direction::Positive).max(half_turns(Direction::Negative));
        work_budget(half_turns, 2.0, S::EXTRA_WORK)
    }

    /// Stuck to its end, or sliding to its end.
    fn steady(&mut self, elapsed_s: f64, load: &Load, sink: &mut impl EventSink) -> bool {
        match self.coupled.state.contact {
            Contact::Stuck => {
                let at_end = load.at_start + load.slope * elapsed_s;
                let (least, most) = (load.at_start.min(at_end), load.at_start.max(at_end));
                // A limit only grows while it rests.
                let stays = most < self.limit(Direction::Positive) && least > -self.limit(Direction::Negative);
                if stays {
                    self.static_limit.rest(elapsed_s);
                }
                stays
            }
            Contact::Sliding(direction) => {
                let sign = direction.sign();
                let level = self.fall_level();
                let motion = InitialState {
                    w0: sign * self.coupled.state.velocity,
                    f0: sign * load.at_start - self.slides.get(direction).friction_at(0.0),
                    g1: sign * load.slope,
                };
                let slide = self.slides.get_mut(direction);
                let Some((y, w)) = slide.steady(&motion, elapsed_s, level) else {
                    return false;
                };
                sink.dissipated(slide.dynamic_force() * y);
                self.coupled.state.advance(sign * y);
                self.coupled.state.velocity = sign * w;
                self.coupled.state.armed = level.armed || w > level.threshold;
                true
            }
        }
    }

    fn piece(&mut self, course: &mut Course, sink: &mut impl EventSink) -> Outcome {
        match self.coupled.state.contact {
            Contact::Stuck => self.rest(course, sink),
            Contact::Sliding(direction) => self.slide(direction, course, sink),
        }
    }

    fn implicit_step(&mut self, course: &mut Course, step_s: f64, sink: &mut impl EventSink) {
        let CoupledBlock { mass, coupling, .. } = self.coupled;
        let at_rest = course.at_rest_after(step_s, &coupling);
        let impulse = mass * self.coupled.state.velocity / step_s + at_rest;
        let direction = Direction::of(impulse);
        let from = self.coupled.state.contact;
        let displacement = if impulse.abs() <= self.limit(direction) {
            if from == Contact::Stuck {
                self.static_limit.rest(step_s);
            } else {
                self.static_limit.begin(0.0);
            }
            self.coupled.state.contact = Contact::Stuck;
            self.coupled.state.velocity = 0.0;
            0.0
        } else {
            if from == Contact::Stuck {
                let limit = self.limit(direction);
                self.slides.get_mut(direction).set_off(limit);
            }
            let slide = self.slides.get(direction);
            let friction = slide.friction_at(self.coupled.state.velocity.abs());
            let net = (impulse.abs() - friction).max(0.0);
            let speed = net / (mass / step_s + slide.damping() + coupling.stiffness * step_s);
            self.coupled.state.contact = Contact::Sliding(direction);
            self.coupled.state.velocity = direction.sign() * speed;
            sink.dissipated(friction * step_s * speed);
            step_s * self.coupled.state.velocity
        };
        self.coupled.state.armed = self.is_fast();
        course.moved += displacement;
        course.time += step_s;
        if from != self.coupled.state.contact {
            sink.contact_changed(course.time, from, self.coupled.state.contact);
        }
    }
}

impl<S: Slide, R: StaticLimit, const N: usize> Body for ExactBlock<S, R, N> {
    fn state(&self) -> BlockState {
        self.coupled.state
    }

    fn coupling_force(&self) -> f64 {
        self.coupled.coupling_force()
    }

    fn memory(&self) -> ContactMemory {
        let state = &self.coupled.state;
        let mut memory = ContactMemory {
            dwell_s: self.static_limit.dwell_s(),
            ..ContactMemory::RESTED
        };
        match state.contact {
            Contact::Stuck => memory.force = self.coupled.coupling_force(),
            Contact::Sliding(direction) => {
                let slide = self.slides.get(direction);
                memory.force = direction.sign() * slide.friction_at(state.velocity.abs());
                memory.slide = Some(direction);
                memory.set_off = ContactMemory::share_of(slide.peak(), slide.static_force(), slide.dynamic_force());
            }
        }
        memory
    }

    fn set_state(&mut self, state: BlockState) {
        for direction in Direction::BOTH {
            self.slides.get_mut(direction).rest();
        }
        self.static_limit.begin(state.memory.dwell_s);
        self.coupled.state = state.consistent();
        if let Contact::Sliding(direction) = self.coupled.state.contact {
            let slide = self.slides.get_mut(direction);
            slide.set_off(state.memory.set_off_limit(slide.static_force(), slide.dynamic_force()));
        }
        // The threshold may not be the one under which the slide was armed, or was not.
        self.coupled.state.armed = self.is_fast();
    }

    fn at_rest(&self) -> Contact {
        if self.frictionless() {
            Contact::Sliding(Direction::Positive)
        } else {
            Contact::Stuck
        }
    }

    fn archive(&mut self, archive: &mut Archive<'_>) {
        self.coupled.state.archive(archive);
        for direction in Direction::BOTH {
            self.slides.get_mut(direction).archive(direction, archive);
        }
        self.static_limit.archive(archive);
    }
}

/// A piece of a slide, in the coordinate in which it goes forwards. The viscous part is not in its energy.
pub(crate) struct SlidePiece {
    pub(crate) piece: Piece,
    /// Whether it is armed at the end.
    pub(crate) armed: bool,
    /// Whether it fell to the velocity at which it ends.
    pub(crate) falls: bool,
}

/// One direction of sliding, compiled.
pub(crate) trait Slide: Clone + Debug + Send + Sync + 'static {
    /// Work that a tick may do for it beside that of its events.
    const EXTRA_WORK: u32;

    /// Static limit after a long rest, N.
    fn static_force(&self) -> f64;
    /// Friction of a fast slide without its viscous part, N.
    fn dynamic_force(&self) -> f64;
    /// The same at a speed, m/s.
    fn friction_at(&self, speed: f64) -> f64;
    /// Total damping `B + b`, N s/m.
    fn damping(&self) -> f64;
    /// Half-turns of the free oscillation in a time.
    fn half_turns(&self, time_s: f64) -> f64;
    /// Forgets the ticks before.
    fn rest(&mut self);
    /// Saves or loads what it keeps from tick to tick, under names that end in a direction.
    fn archive(&mut self, direction: Direction, archive: &mut Archive<'_>);
    /// The contact lets go at a limit, N.
    fn set_off(&mut self, _limit: f64) {}
    /// The limit at which it did, N, where that matters to the slide.
    fn peak(&self) -> f64 {
        self.static_force()
    }

    /// A whole tick of sliding, where it is sure that nothing happens in it: displacement and speed
    /// at its end.
    ///
    /// `motion.f0` is the force on the block at rest, less the friction at no speed.
    fn steady(&mut self, motion: &InitialState, elapsed_s: f64, level: FallLevel) -> Option<(f64, f64)>;

    /// The next piece of a slide, with its energy if a listener wants that; `None` where it met more extrema than a
    /// tick may work through.
    fn piece(&mut self, motion: &InitialState, level: FallLevel, course: &Course, listens: bool) -> Option<SlidePiece>;
}

/// The slides by direction: one where the surface is the same either way, else two.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Slides<S, const N: usize>([S; N]);

impl<S: Slide, const N: usize> Slides<S, N> {
    /// The slides that `slide` makes.
    pub(crate) fn new(slide: impl Fn(Direction) -> S) -> Self {
        Self(core::array::from_fn(|place| slide(Direction::BOTH[place])))
    }

    fn place(direction: Direction) -> usize {
        usize::from(N > 1 && direction == Direction::Negative)
    }

    fn get(&self, direction: Direction) -> &S {
        &self.0[Self::place(direction)]
    }

    fn get_mut(&mut self, direction: Direction) -> &mut S {
        &mut self.0[Self::place(direction)]
    }
}
