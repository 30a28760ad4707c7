//! A block on a contact that gives way before it slides: Dahl, LuGre and the others with a memory
//! of their own.
//!
//! A tick is cut into pieces, each of which goes one way and under one regime of the law. Where the
//! law is a straight line, as a stuck spring or a steady slide is, the block is the same oscillator
//! as in the [exact](super::exact) scheme, with other numbers: one piece is the exact solution,
//! however stiff the contact. Where it is curved, a piece is a power series of the motion.

use super::body::{BlockState, Body, Coupling, EventSink, Rendered};
use super::course::{CoupledBlock, Course, Outcome, PiecewiseBlock, work_budget};
use super::expansion::{CoupledMass, Piece, Start};
use super::straight::straight_piece;
use crate::contact::{Contact, ContactMemory, Leg, SpringContact, StaticLimit, YieldingContact};
use crate::directional::{Direction, Directional};
use crate::math::sqrt;
use crate::snapshot::Archive;

/// Pieces that every tick may be cut into, beside those of its half-turns.
const PIECES: u32 = 128;
/// And that each of these may take.
const PIECES_OF_HALF_TURN: f64 = 8.0;
/// Within this share of the forces at rest, their difference is none.
const BALANCE: f64 = 1e-13;
/// Within this share of its length the end of an implicit step is found: far less than the step is
/// exact.
const STEP_ACCURACY: f64 = 1e-10;
/// Most secants that look for it.
const MAX_SECANTS: usize = 64;

/// A contact under a block, which is moved on piece by piece.
pub(crate) trait PiecewiseContact: YieldingContact {
    /// Moves on by the next piece: up to where the law goes over into another regime, the block
    /// comes to rest or turns, the series ends, or the tick does.
    fn piece(&mut self, start: &Start) -> Piece;
}

impl<R: StaticLimit> PiecewiseContact for SpringContact<Directional, R> {
    fn piece(&mut self, start: &Start) -> Piece {
        straight_piece(self, start)
    }
}

/// A block on the contact of a law.
#[derive(Clone, Copy, Debug)]
pub(crate) struct YieldingBlock<C> {
    coupled: CoupledBlock,
    contact: C,
    held: CoupledMass,
    /// The most that the contact holds, N.
    holds: f64,
    /// Undamped angular frequency while stuck, rad/s.
    fastest: f64,
}

impl<C: PiecewiseContact> YieldingBlock<C> {
    /// `contact_stiffness` (N/m) is the greatest that the contact has, `holds` (N) the most that it
    /// holds.
    pub(crate) fn new(mass: f64, coupling: Coupling, contact: C, contact_stiffness: f64, holds: f64) -> Self {
        let mut block = Self {
            coupled: CoupledBlock::new(mass, coupling),
            contact,
            held: CoupledMass::new(mass, coupling, holds),
            holds,
            fastest: sqrt((coupling.stiffness + contact_stiffness) / mass),
        };
        block.coupled.state.contact = block.at_rest();
        block
    }

    /// The direction in which the block moves on, and the net force where it is known better than
    /// by subtraction; `None` for a block at rest that nothing pulls.
    fn direction(&self, at_rest: f64, slope: f64, rounding: f64) -> Option<(Direction, Option<f64>)> {
        if self.coupled.state.velocity != 0.0 {
            return Some((Direction::of(self.coupled.state.velocity), None));
        }
        let held = self.contact.force_at_rest();
        let net = at_rest - held;
        // A sliding contact that has come to rest holds until the load exceeds it; one that yields
        // has no such band.
        if net.abs() <= rounding + BALANCE * (at_rest.abs() + held.abs()) {
            return (slope != 0.0).then(|| (Direction::of(slope), Some(0.0)));
        }
        Some((Direction::of(net), Some(net.abs())))
    }

    fn change_contact(&mut self, at_s: f64, sink: &mut impl EventSink, rendered: &mut Rendered) {
        let from = self.coupled.state.contact;
        let to = self.contact.contact_at(self.coupled.state.velocity);
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
    fn step_implicitly(&mut self, step_s: f64, at_rest: f64, sink: &mut impl EventSink) -> f64 {
        let CoupledBlock { mass, coupling, .. } = self.coupled;
        let inertia = mass / (step_s * step_s);
        let push = mass * self.coupled.state.velocity / step_s + at_rest;
        let turned_to = Direction::of(push - self.contact.force_at_rest());
        if matches!(self.contact.contact(turned_to, 1.0), Contact::Sliding(direction) if direction != turned_to) {
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
            contact.advance(&Leg {
                direction,
                distance,
                from_speed: speed,
                to_speed: speed,
                duration_s: step_s,
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
        for _ in 0..MAX_SECANTS {
            if far - near <= STEP_ACCURACY * far || at_far <= 0.0 {
                break;
            }
            // Reckoned from the near end: the far one may be a million times as far as the root.
            let secant = near - at_near * (far - near) / (at_far - at_near);
            // Never on an end itself, so that one which is the root as it is rounded ends the search.
            let margin = 0.5 * STEP_ACCURACY * far;
            let middle = secant.max(near + margin).min(far - margin);
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

impl<C: PiecewiseContact> PiecewiseBlock for YieldingBlock<C> {
    fn coupled(&self) -> &CoupledBlock {
        &self.coupled
    }

    fn coupled_mut(&mut self) -> &mut CoupledBlock {
        &mut self.coupled
    }

    fn budget(&self, elapsed_s: f64) -> u32 {
        work_budget(
            self.fastest * elapsed_s / core::f64::consts::PI,
            PIECES_OF_HALF_TURN,
            PIECES,
        )
    }

    fn piece(&mut self, course: &mut Course, sink: &mut impl EventSink) -> Outcome {
        let CoupledBlock { coupling, state, .. } = self.coupled;
        let (remaining_s, at_rest) = (course.remaining(), course.at_rest(&coupling));
        let Some((direction, net)) = self.direction(at_rest, course.load.slope, course.rounding) else {
            return Outcome::TickEnds;
        };
        let sign = direction.sign();
        let piece = self.contact.piece(&Start {
            held: self.held,
            direction,
            speed: sign * state.velocity,
            at_rest: sign * at_rest,
            slope: sign * course.load.slope,
            net,
            remaining_s,
            listens: sink.listens(),
        });
        course.work += piece.work;
        course.moved += sign * piece.distance;
        course.time += piece.lasted_s;
        self.coupled.state.velocity = sign * piece.speed;
        sink.dissipated(piece.dissipated);
        self.change_contact(course.time, sink, &mut course.rendered);
        if piece.lasted_s >= remaining_s {
            Outcome::TickEnds
        } else {
            Outcome::NextPiece
        }
    }

    fn implicit_step(&mut self, course: &mut Course, step_s: f64, sink: &mut impl EventSink) {
        let at_rest = course.at_rest_after(step_s, &self.coupled.coupling);
        course.moved += self.step_implicitly(step_s, at_rest, sink);
        course.time += step_s;
        self.change_contact(course.time, sink, &mut course.rendered);
    }

    fn has_finite_contact(&self) -> bool {
        self.contact.force_at_rest().is_finite()
    }

    fn restarted(&mut self) {
        self.contact.recall(&ContactMemory::RESTED, 0.0);
    }
}

impl<C: PiecewiseContact> Body for YieldingBlock<C> {
    fn state(&self) -> BlockState {
        self.coupled.state
    }

    fn coupling_force(&self) -> f64 {
        self.coupled.coupling_force()
    }

    fn memory(&self) -> ContactMemory {
        self.contact.memory()
    }

    fn set_state(&mut self, state: BlockState) {
        self.contact.recall(&state.memory, state.velocity.abs());
        self.coupled.state = state;
        self.coupled.state.contact = self.contact.contact_at(state.velocity);
    }

    fn at_rest(&self) -> Contact {
        self.contact.contact_at(0.0)
    }

    fn archive(&mut self, archive: &mut Archive<'_>) {
        self.coupled.state.archive(archive);
        self.contact.archive(archive);
    }
}
