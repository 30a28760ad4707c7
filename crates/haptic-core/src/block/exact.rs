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
//! * Rising static friction: the limit is a concave function of the time at rest, so the breakaway is found by Newton's method from the right.
//! * Stribeck's curve is no oscillator: its slides are cut into pieces that nearly are. Only they are not exact, but to a tolerance.
//! * The velocity threshold DV: a slide is *armed* once it has been faster than DV. An armed slide that falls back to DV
//!   re-sticks if the force on the block at rest is within the static limit, and otherwise goes on, disarmed. An unarmed
//!   slide re-sticks at zero velocity. DV = 0 is the ideal law, and the breakaway force stays at Fs for every DV.
//!
//! A slide goes forwards by construction (a displacement that rounding makes negative is none), so friction only ever opposes the motion,
//! and a stuck block does not move at all: friction creates no energy and the block does not creep. Work per tick is bounded; what is left when the bound is reached is done in one implicit step.

use super::fall::FallLevel;
use super::load::{Load, rounding};
use super::oscillator::Motion;
use super::slide::{Each, LinearSlide, PieceEnd, Same, Sides, Slide};
use super::stribeck_slide::{StribeckParts, StribeckSlide};
use super::{BlockState, Contact, EventSink, Moving, Rendered};
use crate::friction::Karnopp;
use crate::friction::static_limit::StaticLimit;
use crate::parameters::Direction;
use crate::scene::Coupling;

/// The exact scheme for one scene: `S` is how its slides differ by direction, `R` how its static limit goes with the time at rest.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ExactBlock<S, R> {
    mass: f64,
    coupling: Coupling,
    velocity_threshold: f64,
    slides: S,
    static_limit: R,
    state: BlockState,
}

/// Work that every tick may do, beside two for each half-turn of the free oscillation.
const BASE_WORK: f64 = 16.0;
/// Bound on a tick's events, and on the extrema looked at in it, whatever time has elapsed.
const MAX_WORK: f64 = BASE_WORK + 2.0 * crate::scene::MAX_PHASE_PER_TICK_RAD / core::f64::consts::PI;

/// The work that a tick may do.
pub(super) fn work_budget(half_turns: f64, extra: u32) -> u32 {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 16 to 271")]
    let budget = (BASE_WORK + 2.0 * half_turns).min(MAX_WORK) as u32;
    budget + extra
}

impl Same<LinearSlide> {
    /// The slides of a law that is the same either way.
    pub(crate) fn linear(mass: f64, coupling: &Coupling, law: &Karnopp) -> Self {
        Self(linear(mass, coupling, law, Direction::Positive))
    }
}

impl Each<LinearSlide> {
    /// The slides of a law that differs by direction.
    pub(crate) fn linear(mass: f64, coupling: &Coupling, law: &Karnopp) -> Self {
        Self {
            positive: linear(mass, coupling, law, Direction::Positive),
            negative: linear(mass, coupling, law, Direction::Negative),
        }
    }
}

fn linear(mass: f64, coupling: &Coupling, law: &Karnopp, direction: Direction) -> LinearSlide {
    LinearSlide::new(
        mass,
        coupling.damping + law.viscous.get(direction),
        coupling.stiffness,
        law.breakaway_force().get(direction),
        law.dynamic_force.get(direction),
    )
}

impl Each<StribeckSlide> {
    /// The slides of a law with Stribeck's curve.
    pub(crate) fn stribeck(mass: f64, coupling: &Coupling, law: &Karnopp) -> Self {
        let slide = |direction| {
            StribeckSlide::new(&StribeckParts {
                mass,
                stiffness: coupling.stiffness,
                coupling_damping: coupling.damping,
                viscous: law.viscous.get(direction),
                static_force: law.static_force.get(direction),
                dynamic_force: law.dynamic_force.get(direction),
                velocity: law.stribeck_velocity,
            })
        };
        Self {
            positive: slide(Direction::Positive),
            negative: slide(Direction::Negative),
        }
    }
}

impl<S: Sides, R: StaticLimit> ExactBlock<S, R> {
    /// `law` is one that [`Scene::validate`](crate::Scene::validate) accepts, `slides` are its own.
    pub(crate) fn new(mass: f64, coupling: Coupling, law: &Karnopp, slides: S, static_limit: R) -> Self {
        let mut block = Self {
            mass,
            coupling,
            velocity_threshold: law.velocity_threshold,
            slides,
            static_limit,
            state: BlockState::new(0.0, 0.0, 0.0, 0.0),
        };
        block.state.contact = block.at_rest();
        block
    }

    /// What the contact holds now, N.
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

    fn coupling_force(&self) -> f64 {
        self.coupling.force(&self.state)
    }

    /// The common tick: stuck to its end, or sliding to its end. Returns false, with nothing changed, when an
    /// event may lie in it.
    fn steady(&mut self, elapsed_s: f64, load: &Load, sink: &mut (impl EventSink + ?Sized)) -> bool {
        match self.state.contact {
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
                let motion = Motion {
                    w0: sign * self.state.velocity,
                    f0: sign * load.at_start - self.slides.get(direction).friction_at(0.0),
                    g1: sign * load.slope,
                };
                let slide = self.slides.get_mut(direction);
                let Some((y, w)) = slide.steady(&motion, elapsed_s, level) else {
                    return false;
                };
                sink.dissipated(slide.dynamic_force() * y);
                self.state.position += sign * y;
                self.state.velocity = sign * w;
                self.state.armed = level.armed || w > level.threshold;
                true
            }
        }
    }

    fn fall_level(&self) -> FallLevel {
        FallLevel {
            armed: self.state.armed,
            threshold: self.velocity_threshold,
        }
    }

    /// The tick with stops and breakaways in it.
    fn with_events(
        &mut self,
        elapsed_s: f64,
        load: &Load,
        sink: &mut (impl EventSink + ?Sized),
        rendered: &mut Rendered,
    ) {
        let half_turns = |direction| self.slides.get(direction).half_turns(elapsed_s);
        let half_turns = half_turns(Direction::Positive).max(half_turns(Direction::Negative));
        let budget = work_budget(half_turns, S::Slide::EXTRA_WORK);
        let rounding = rounding(&self.coupling, &self.state);
        let mut looked_at = 0;
        let mut time = 0.0;
        // Displacement since the start of the tick: small, so that it keeps its digits.
        let mut moved = 0.0;
        // Set where an event fixes the net force better than subtraction can.
        let mut net_force: Option<f64> = None;
        let start = self.state.position;
        while time < elapsed_s {
            let remaining = elapsed_s - time;
            if rendered.events >= budget || looked_at >= budget {
                moved = self.implicit_step(elapsed_s, remaining, load, moved, sink);
                rendered.work_exhausted = true;
                break;
            }
            let at_rest = load.at(time) - self.coupling.stiffness * moved;
            match self.state.contact {
                Contact::Stuck => {
                    let Some((delay, direction)) = self.breakaway(at_rest, load.slope, rounding) else {
                        self.static_limit.rest(remaining);
                        break;
                    };
                    if delay >= remaining {
                        self.static_limit.rest(remaining);
                        break;
                    }
                    let limit = self.limit_after(direction, delay);
                    // At the limit the pull is the limit; beyond it already, as after a change of parameters, it is what it is.
                    let pull = if delay > 0.0 {
                        limit
                    } else {
                        (direction.sign() * at_rest).max(limit)
                    };
                    time += delay;
                    let slide = self.slides.get_mut(direction);
                    slide.set_off(limit);
                    net_force = Some(pull - slide.friction_at(0.0));
                    self.change_contact(Contact::Sliding(direction), time, sink, rendered);
                }
                Contact::Sliding(direction) => {
                    let sign = direction.sign();
                    let level = self.fall_level();
                    let w0 = sign * self.state.velocity;
                    let slide = self.slides.get_mut(direction);
                    let motion = Motion {
                        w0,
                        f0: net_force
                            .take()
                            .unwrap_or_else(|| sign * at_rest - slide.friction_at(0.0)),
                        g1: sign * load.slope,
                    };
                    let (end, work) = slide.piece(&motion, remaining, level, budget - looked_at);
                    looked_at += work;
                    match end {
                        PieceEnd::Lasts {
                            lasted_s,
                            moved: y,
                            speed,
                            armed,
                            friction,
                        } => {
                            sink.dissipated(friction * y);
                            moved += sign * y;
                            self.state.velocity = sign * speed;
                            self.state.armed = armed;
                            if lasted_s >= remaining {
                                break;
                            }
                            time += lasted_s;
                        }
                        PieceEnd::Falls {
                            at_s,
                            moved: y,
                            armed,
                            friction,
                        } => {
                            sink.dissipated(friction * y);
                            moved += sign * y;
                            time += at_s;
                            net_force = self.fall(direction, armed, load, rounding, time, moved, sink, rendered);
                        }
                        PieceEnd::Exhausted => {
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

    /// The slide has fallen to its re-stick level: it sticks, turns round, or goes on disarmed.
    ///
    /// Returns the net force of the slide that follows, where it is known.
    #[expect(clippy::too_many_arguments, reason = "the whole state of the event loop")]
    fn fall(
        &mut self,
        direction: Direction,
        armed: bool,
        load: &Load,
        rounding: f64,
        time: f64,
        moved: f64,
        sink: &mut (impl EventSink + ?Sized),
        rendered: &mut Rendered,
    ) -> Option<f64> {
        let at_rest = load.at(time) - self.coupling.stiffness * moved;
        let slide = self.slides.get(direction);
        // It comes to rest with the friction that it has then, which is more than a fresh contact's where a curve rises towards rest.
        self.static_limit
            .begin_at(slide.static_force(), slide.dynamic_force(), slide.friction_at(0.0));
        let limit = self.limit(Direction::of(at_rest));
        if at_rest.abs() <= limit + rounding && !(self.frictionless() && load.slope != 0.0) {
            self.change_contact(Contact::Stuck, time, sink, rendered);
            return None;
        }
        if armed && self.velocity_threshold > 0.0 {
            self.state.velocity = direction.sign() * self.velocity_threshold;
            self.state.armed = false;
            rendered.events += 1; // work done, although the contact is the same
            return None;
        }
        let pull = if at_rest.abs() <= rounding { load.slope } else { at_rest };
        let towards = Direction::of(pull);
        let limit = self.limit(towards);
        let slide = self.slides.get_mut(towards);
        slide.set_off(limit);
        let friction = slide.friction_at(0.0);
        self.change_contact(Contact::Sliding(towards), time, sink, rendered);
        // Within rounding the slope decides the direction, and the force may point the other way by as much.
        Some((towards.sign() * at_rest - friction).max(0.0))
    }

    fn change_contact(
        &mut self,
        to: Contact,
        at_s: f64,
        sink: &mut (impl EventSink + ?Sized),
        rendered: &mut Rendered,
    ) {
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
        sink: &mut (impl EventSink + ?Sized),
    ) -> f64 {
        let at_rest = load.at(elapsed_s) - self.coupling.stiffness * moved;
        let impulse = self.mass * self.state.velocity / remaining + at_rest;
        let direction = Direction::of(impulse);
        let from = self.state.contact;
        self.state.armed = false;
        let displacement = if impulse.abs() <= self.limit(direction) {
            if from == Contact::Stuck {
                self.static_limit.rest(remaining);
            } else {
                self.static_limit.begin(0.0);
            }
            self.state.contact = Contact::Stuck;
            self.state.velocity = 0.0;
            0.0
        } else {
            if from == Contact::Stuck {
                let limit = self.limit(direction);
                self.slides.get_mut(direction).set_off(limit);
            }
            let slide = self.slides.get(direction);
            let friction = slide.friction_at(self.state.velocity.abs());
            let net = (impulse.abs() - friction).max(0.0);
            let speed = net / (self.mass / remaining + slide.damping() + self.coupling.stiffness * remaining);
            self.state.contact = Contact::Sliding(direction);
            self.state.velocity = direction.sign() * speed;
            sink.dissipated(friction * remaining * speed);
            remaining * self.state.velocity
        };
        if from != self.state.contact {
            sink.contact_changed(elapsed_s, from, self.state.contact);
        }
        moved + displacement
    }

    /// A tick moved on by `motion`, with what holds for every tick around it.
    fn tick(
        &mut self,
        elapsed_s: f64,
        position: f64,
        velocity: f64,
        motion: impl FnOnce(&mut Self, &Load, &mut Rendered),
    ) -> Rendered {
        let mut rendered = Rendered::default();
        if elapsed_s > 0.0 {
            let load = Load::new(&self.coupling, &self.state, elapsed_s, position, velocity);
            motion(self, &load, &mut rendered);
            if !(self.state.position.is_finite() && self.state.velocity.is_finite()) {
                // Forces beyond the range of numbers: start over from rest at the device.
                self.state = BlockState::new(position, 0.0, position, velocity);
            }
        }
        self.state.device_position = position;
        self.state.device_velocity = velocity;
        rendered.coupling_force = self.coupling_force();
        rendered
    }
}

impl<S: Sides, R: StaticLimit> Moving for ExactBlock<S, R> {
    /// With `elapsed_s` of zero or less the block stands still and only the force is new.
    fn advance(
        &mut self,
        elapsed_s: f64,
        position: f64,
        velocity: f64,
        sink: &mut (impl EventSink + ?Sized),
    ) -> Rendered {
        self.tick(elapsed_s, position, velocity, |block, load, rendered| {
            if !block.steady(elapsed_s, load, sink) {
                block.with_events(elapsed_s, load, sink, rendered);
            }
        })
    }

    fn advance_implicitly(
        &mut self,
        elapsed_s: f64,
        position: f64,
        velocity: f64,
        sink: &mut (impl EventSink + ?Sized),
    ) -> Rendered {
        self.tick(elapsed_s, position, velocity, |block, load, rendered| {
            let from = block.state.contact;
            let moved = block.implicit_step(elapsed_s, elapsed_s, load, 0.0, sink);
            block.state.position += moved;
            rendered.events = u32::from(from != block.state.contact);
        })
    }

    fn state(&self) -> BlockState {
        BlockState {
            dwell_s: self.static_limit.dwell_s(),
            ..self.state
        }
    }

    fn set_state(&mut self, state: BlockState) {
        self.static_limit.begin(state.dwell_s);
        self.state = state.consistent();
        // The threshold may not be the one under which the slide was armed.
        self.state.armed &= self.state.velocity.abs() > self.velocity_threshold;
    }

    fn at_rest(&self) -> Contact {
        if self.frictionless() {
            Contact::Sliding(Direction::Positive)
        } else {
            Contact::Stuck
        }
    }

    fn felt(&self) -> f64 {
        self.coupling_force()
    }

    fn friction(&self) -> f64 {
        match self.state.contact {
            Contact::Stuck => self.coupling_force(),
            Contact::Sliding(direction) => {
                let slide = self.slides.get(direction);
                let viscous = slide.damping() - self.coupling.damping;
                direction.sign() * slide.friction_at(self.state.velocity.abs()) + viscous * self.state.velocity
            }
        }
    }

    fn seat(&mut self, _force: f64) {
        // A rigid contact holds whatever there is.
    }
}
