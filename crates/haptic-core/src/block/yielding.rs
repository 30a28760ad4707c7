//! A block on a contact that gives way before it slides: Dahl, LuGre and the others with a memory
//! of their own.
//!
//! Near its present state such a contact is a spring and a damper beside those of the coupling, so
//! the block is the same oscillator as in the [exact](super::exact) scheme, with other numbers. A
//! tick is cut into pieces, each under the tangent of the law at its start. Where the law is
//! linear, as a stuck spring or a steady slide is, one piece is the exact solution, however stiff
//! the contact.

use super::body::Coupling;
use super::budget::work_budget;
use super::course::{self, CoupledBlock, Course, Outcome, PiecewiseBlock};
use super::moving::{EventSink, Moving, Rendered};
use super::state::BlockState;
use super::tangent_piece::{Bounds, Start};
use crate::contact::{Contact, Stroke, YieldingContact};
use crate::direction::Direction;
use crate::math::sqrt;

/// A correction of the coupling force is accepted up to this share of [`YieldingBlock::holds`].
const TOLERANCE: f64 = 1e-6;
/// Pieces that every tick may be cut into, beside those of its half-turns.
const PIECES: u32 = 160;
/// Secants that find the end of an implicit step, to far less than the step is exact.
const MOST_SECANTS: usize = 24;

/// A block on the contact of a law.
#[derive(Clone, Copy, Debug)]
pub(crate) struct YieldingBlock<C> {
    coupled: CoupledBlock,
    contact: C,
    /// The most that the contact holds, N.
    holds: f64,
    /// Undamped angular frequency while stuck, rad/s.
    fastest: f64,
    /// Length of the piece to try next, s.
    try_s: f64,
}

impl<C: YieldingContact> YieldingBlock<C> {
    /// `contact_stiffness` (N/m) is the greatest that the contact has, `holds` (N) the most that it
    /// holds.
    pub(crate) fn new(mass: f64, coupling: Coupling, contact: C, contact_stiffness: f64, holds: f64) -> Self {
        let mut block = Self {
            coupled: CoupledBlock::new(mass, coupling),
            contact,
            holds,
            fastest: sqrt((coupling.stiffness + contact_stiffness) / mass),
            try_s: f64::INFINITY,
        };
        block.coupled.state.contact = block.at_rest();
        block
    }

    /// Correction of the coupling force, N, up to which a piece is accepted: relaxed in a tick that
    /// takes much work, before it falls back on one implicit step.
    fn tolerance(&self, work: u32, budget: u32) -> f64 {
        let strict = TOLERANCE * self.holds;
        match 4 * work / budget {
            0 | 1 => strict,
            2 => 30.0 * strict,
            _ => 1000.0 * strict,
        }
    }

    /// The direction in which the block moves on; `None` for a block at rest that nothing pulls.
    fn direction(&self, at_rest: f64, slope: f64, rounding: f64) -> Option<Direction> {
        if self.coupled.state.velocity != 0.0 {
            return Some(Direction::of(self.coupled.state.velocity));
        }
        let net = at_rest - self.contact.force_at_rest();
        // A sliding contact that has come to rest holds until the load exceeds it; one that yields
        // has no such band.
        let net = if net.abs() <= rounding { slope } else { net };
        (net != 0.0).then(|| Direction::of(net))
    }

    fn change_contact(&mut self, at_s: f64, sink: &mut (impl EventSink + ?Sized), rendered: &mut Rendered) {
        let from = self.coupled.state.contact;
        let to = self.contact.contact(self.coupled.state.velocity);
        if from != to {
            self.coupled.state.contact = to;
            rendered.events += 1;
            sink.contact_changed(at_s, from, to);
        }
    }

    /// One backward-Euler step to a time at which the load is `at_rest` if the block stands still;
    /// returns the displacement.
    ///
    /// The residual grows with the displacement, so its root is bracketed, and found by secants.
    fn step_implicitly(&mut self, step_s: f64, at_rest: f64, sink: &mut (impl EventSink + ?Sized)) -> f64 {
        let CoupledBlock { mass, coupling, .. } = self.coupled;
        let inertia = mass / (step_s * step_s);
        let push = mass * self.coupled.state.velocity / step_s + at_rest;
        let turned_to = Direction::of(push - self.contact.force_at_rest());
        if matches!(self.contact.contact(turned_to.sign()), Contact::Sliding(direction) if direction != turned_to) {
            // The slide ends in this step, and its friction may not push the block back.
            self.contact.fall(turned_to, 0.0);
        }
        let net = push - self.contact.force_at_rest();
        if net == 0.0 {
            self.coupled.state.velocity = 0.0;
            return 0.0;
        }
        let direction = Direction::of(net);
        let sign = direction.sign();
        let resistance = inertia + coupling.damping / step_s + coupling.stiffness;
        let after = |distance: f64| {
            let speed = distance / step_s;
            let mut contact = self.contact.clone();
            contact.advance(&Stroke {
                direction,
                distance,
                from_speed: speed,
                to_speed: speed,
                elapsed_s: step_s,
            });
            contact
        };
        let residual = |distance: f64| {
            let friction = sign * after(distance).friction(sign * distance / step_s);
            resistance * distance - sign * push + friction
        };
        // Friction helps by what the contact holds at most.
        let (mut near, mut far) = (0.0, (push.abs() + 2.0 * self.holds) / resistance);
        let (mut at_near, mut at_far) = (-net.abs(), residual(far));
        // The Illinois method: a secant that halves the end which does not move, so that both do.
        for _ in 0..MOST_SECANTS {
            if far - near <= 1e-10 * far || at_far <= 0.0 {
                break;
            }
            let secant = far - at_far * (far - near) / (at_far - at_near);
            let middle = if secant > near && secant < far {
                secant
            } else {
                0.5 * (near + far)
            };
            let there = residual(middle);
            if there < 0.0 {
                (near, at_near) = (middle, there);
                at_far *= 0.5;
            } else {
                (far, at_far) = (middle, there);
                at_near *= 0.5;
            }
        }
        let distance = far;
        let before = self.contact.stored_energy();
        self.contact = after(distance);
        // The step has the friction of its end all along.
        let friction = sign * self.contact.force_at_rest();
        sink.dissipated(friction * distance - (self.contact.stored_energy() - before));
        self.coupled.state.velocity = sign * distance / step_s;
        let (_, threshold) = self.contact.fall_level();
        if self.coupled.state.velocity.abs() <= threshold {
            self.contact.fall(direction, self.coupled.state.velocity.abs());
        }
        sign * distance
    }
}

impl<C: YieldingContact> PiecewiseBlock for YieldingBlock<C> {
    fn coupled(&self) -> &CoupledBlock {
        &self.coupled
    }

    fn coupled_mut(&mut self) -> &mut CoupledBlock {
        &mut self.coupled
    }

    fn budget(&self, elapsed_s: f64) -> u32 {
        work_budget(self.fastest * elapsed_s / core::f64::consts::PI, PIECES)
    }

    fn piece(&mut self, course: &mut Course, sink: &mut (impl EventSink + ?Sized)) -> Outcome {
        let CoupledBlock { mass, coupling, state } = self.coupled;
        let (remaining, at_rest) = (course.remaining(), course.at_rest(&coupling));
        let Some(direction) = self.direction(at_rest, course.load.slope, course.rounding) else {
            return Outcome::TickEnds;
        };
        let sign = direction.sign();
        let bounds = Bounds {
            remaining_s: remaining,
            most_work: course.budget - course.work,
            tolerance: self.tolerance(course.work, course.budget),
        };
        let start = Start {
            mass,
            coupling,
            contact: &self.contact,
            direction,
            speed: sign * state.velocity,
            at_rest: sign * at_rest,
            slope: sign * course.load.slope,
            fastest: self.fastest,
            listens: sink.listens(),
        };
        let piece = start.piece(&bounds, &mut self.try_s);
        course.work += piece.work;
        self.contact = piece.contact;
        course.moved += sign * piece.distance;
        course.time += piece.lasted_s;
        self.coupled.state.velocity = sign * piece.speed;
        if piece.fell {
            self.contact.fall(direction, piece.speed);
        }
        sink.dissipated(piece.dissipated);
        self.change_contact(course.time, sink, &mut course.rendered);
        if piece.lasted_s >= remaining {
            Outcome::TickEnds
        } else {
            Outcome::NextPiece
        }
    }

    fn implicit_step(&mut self, course: &mut Course, sink: &mut (impl EventSink + ?Sized)) {
        let at_rest = course.at_rest_at_end(&self.coupled.coupling);
        course.moved += self.step_implicitly(course.remaining(), at_rest, sink);
        self.change_contact(course.elapsed_s, sink, &mut course.rendered);
    }

    fn has_finite_contact(&self) -> bool {
        self.contact.force_at_rest().is_finite()
    }

    fn restarted(&mut self) {
        self.contact.seat(0.0);
    }
}

impl<C: YieldingContact> Moving for YieldingBlock<C> {
    fn advance(
        &mut self,
        elapsed_s: f64,
        position: f64,
        velocity: f64,
        sink: &mut (impl EventSink + ?Sized),
    ) -> Rendered {
        course::advance(self, elapsed_s, (position, velocity), sink)
    }

    fn advance_implicitly(
        &mut self,
        elapsed_s: f64,
        position: f64,
        velocity: f64,
        sink: &mut (impl EventSink + ?Sized),
    ) -> Rendered {
        course::advance_implicitly(self, elapsed_s, (position, velocity), sink)
    }

    fn state(&self) -> BlockState {
        self.coupled.state
    }

    fn set_state(&mut self, state: BlockState) {
        self.contact.seat(0.0);
        if state.velocity != 0.0 {
            self.contact.slide(Direction::of(state.velocity), state.velocity.abs());
        }
        self.coupled.state = state;
        self.coupled.state.contact = self.contact.contact(state.velocity);
        self.try_s = f64::INFINITY;
    }

    fn at_rest(&self) -> Contact {
        self.contact.contact(0.0)
    }

    fn felt(&self) -> f64 {
        self.coupled.coupling_force()
    }

    fn friction(&self) -> f64 {
        self.contact.friction(self.coupled.state.velocity)
    }

    fn seat(&mut self, force: f64) {
        self.contact.seat(force);
        self.coupled.state.contact = self.contact.contact(self.coupled.state.velocity);
    }
}
