//! A block on a contact that gives way before it slides: Dahl, LuGre and the others with a memory of their own.
//!
//! Near its present state such a contact is a spring and a damper beside those of the coupling, so the block is the same oscillator as
//! in the [exact](super::exact) scheme, with other numbers. A tick is cut into pieces; each takes the tangent of the law at its start, solves the oscillator exactly, moves
//! the contact along by the displacement, and puts in what the law really gave at the end as a force that grows with the square of time (the exponential Rosenbrock method of third
//! order of Hochbruck, Ostermann and Schweitzer 2009). That correction measures the error: a piece with too large a one is cut. Where the law is linear, as a stuck spring or a
//! steady slide is, one piece is the exact solution, however stiff the contact.
//!
//! A piece ends early where the block turns round and where the law has a kink; both are found as roots. What is left when the bounded work of a tick is used up
//! is done in one backward-Euler step.

use super::exact::work_budget;
use super::fall::{FallLevel, SlideEnd, first_fall, passes};
use super::load::{Load, rounding};
use super::oscillator::{Motion, Oscillator};
use super::{BlockState, Contact, EventSink, Moving, Rendered};
use crate::friction::contact::{Advanced, Stroke, Tangent, YieldingContact};
use crate::math::{powf, sqrt};
use crate::parameters::Direction;
use crate::scene::Coupling;

/// Corrections of the coupling force up to this share of what the contact holds are accepted.
const TOLERANCE: f64 = 1e-6;
/// How much of the shortest time of the linearised motion a piece may take where damping is negative: the closed forms lose digits beyond.
pub(super) const LONGEST: f64 = 0.9;
/// Pieces that every tick may be cut into, beside those of its half-turns.
const PIECES: u32 = 160;
/// Half-turns of the oscillation that a piece may have.
const HALF_TURNS: f64 = 8.0;
/// Extrema that lie in them at most, and some for rounding.
const MOST_EXTREMA: u32 = 12;
/// Secants that find the end of an implicit step, to far less than the step is exact.
const MOST_SECANTS: usize = 24;
/// Halvings that bracket a root to its last digit.
const MOST_HALVINGS: usize = 64;

/// A block on the contact of a law.
#[derive(Clone, Copy, Debug)]
pub(crate) struct YieldingBlock<C> {
    mass: f64,
    coupling: Coupling,
    contact: C,
    /// What the contact holds at most, N.
    holds: f64,
    /// Undamped angular frequency while stuck, rad/s.
    fastest: f64,
    /// Length of the piece to try next, s.
    try_s: f64,
    state: BlockState,
}

/// One piece, in the coordinate in which it goes forwards.
struct Piece {
    lasted_s: f64,
    distance: f64,
    speed: f64,
    /// Whether it ends because the slide fell to the velocity at which it ends.
    fell: bool,
    /// How far the coupling force had to be corrected, N.
    error: f64,
    /// Energy that the friction took and the contact does not hold, J.
    dissipated: f64,
}

impl<C: YieldingContact> YieldingBlock<C> {
    /// `contact_stiffness` (N/m) is the greatest that the contact has, `holds` (N) the most that it holds.
    pub(crate) fn new(mass: f64, coupling: Coupling, contact: C, contact_stiffness: f64, holds: f64) -> Self {
        let mut block = Self {
            mass,
            coupling,
            contact,
            holds,
            fastest: sqrt((coupling.stiffness + contact_stiffness) / mass),
            try_s: f64::INFINITY,
            state: BlockState::new(0.0, 0.0, 0.0, 0.0),
        };
        block.state.contact = block.at_rest();
        block
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
            if !(self.state.position.is_finite()
                && self.state.velocity.is_finite()
                && self.contact.force_at_rest().is_finite())
            {
                self.state = BlockState::new(position, 0.0, position, velocity);
                self.contact.seat(0.0);
            }
        }
        self.state.device_position = position;
        self.state.device_velocity = velocity;
        rendered.coupling_force = self.felt();
        rendered
    }

    fn in_pieces(
        &mut self,
        elapsed_s: f64,
        load: &Load,
        sink: &mut (impl EventSink + ?Sized),
        rendered: &mut Rendered,
    ) {
        let budget = work_budget(self.fastest * elapsed_s / core::f64::consts::PI, PIECES);
        let start = self.state.position;
        let rounding = rounding(&self.coupling, &self.state);
        let mut work = 0;
        let (mut time, mut moved) = (0.0, 0.0);
        while time < elapsed_s {
            let remaining = elapsed_s - time;
            if work >= budget {
                moved += self.implicit_step(remaining, load.at(elapsed_s) - self.coupling.stiffness * moved, sink);
                self.change_contact(elapsed_s, sink, rendered);
                rendered.work_exhausted = true;
                break;
            }
            let at_rest = load.at(time) - self.coupling.stiffness * moved;
            let Some(direction) = self.direction(at_rest, load.slope, rounding) else {
                // At rest, and nothing moves it.
                break;
            };
            let (piece, contact, looked_at) = self.piece(
                direction,
                at_rest,
                load.slope,
                remaining,
                budget - work,
                self.tolerance(work, budget),
                sink.listens(),
            );
            work += looked_at;
            self.contact = contact;
            let sign = direction.sign();
            moved += sign * piece.distance;
            time += piece.lasted_s;
            self.state.velocity = sign * piece.speed;
            if piece.fell {
                self.contact.fall(direction, piece.speed);
            }
            sink.dissipated(piece.dissipated);
            self.change_contact(time, sink, rendered);
            if piece.lasted_s >= remaining {
                break;
            }
        }
        self.state.position = start + moved;
    }

    /// Correction of the coupling force, N, up to which a piece is accepted. A tick that takes much work is let be less exact before it is let end in one step.
    fn tolerance(&self, work: u32, budget: u32) -> f64 {
        let strict = TOLERANCE * self.holds;
        match 4 * work / budget {
            0 | 1 => strict,
            2 => 30.0 * strict,
            _ => 1000.0 * strict,
        }
    }

    /// Which way the block moves on; `None` where it rests and nothing pulls it.
    fn direction(&self, at_rest: f64, slope: f64, rounding: f64) -> Option<Direction> {
        if self.state.velocity != 0.0 {
            return Some(Direction::of(self.state.velocity));
        }
        let net = at_rest - self.contact.force_at_rest();
        // A sliding contact that has come to rest holds until the load exceeds it; one that yields has no such band.
        let net = if net.abs() <= rounding { slope } else { net };
        (net != 0.0).then(|| Direction::of(net))
    }

    /// One piece, its contact afterwards, and the work that it took.
    #[expect(clippy::too_many_arguments, reason = "the whole state of the loop over the pieces")]
    fn piece(
        &mut self,
        direction: Direction,
        at_rest: f64,
        slope: f64,
        remaining_s: f64,
        most_work: u32,
        tolerance: f64,
        listens: bool,
    ) -> (Piece, C, u32) {
        let sign = direction.sign();
        let w0 = sign * self.state.velocity;
        let mut tangent = self.contact.tangent(direction, w0);
        tangent.stiffness = tangent.stiffness.max(-self.coupling.stiffness);
        let oscillator = Oscillator::new(
            self.mass,
            self.coupling.damping + tangent.damping,
            self.coupling.stiffness + tangent.stiffness,
        );
        let net = sign * at_rest - tangent.force;
        let motion = Motion {
            w0,
            // From rest it goes the way it was found to go, whatever rounding says.
            f0: if w0 == 0.0 { net.max(0.0) } else { net },
            g1: sign * slope,
        };
        // A few half-turns at a time, so that the search for a fall is bounded as well.
        let mut length = oscillator.within_half_turns(self.try_s.min(remaining_s), HALF_TURNS);
        if self.coupling.damping + tangent.damping < 0.0 {
            length = length.min(LONGEST * oscillator.shortest_time());
        }
        let mut work = 0;
        loop {
            let (piece, contact, looked_at) =
                self.try_piece(direction, &tangent, &oscillator, &motion, length, listens);
            work += looked_at;
            let next = next_length(piece.lasted_s, piece.error, tolerance);
            if piece.error > tolerance && work < most_work && piece.lasted_s > 0.0 {
                length = next;
                continue;
            }
            // A piece that was cut short by an event says nothing against longer ones.
            if next < self.try_s || piece.lasted_s >= self.try_s.min(remaining_s) {
                self.try_s = next;
            }
            return (piece, contact, work);
        }
    }

    fn try_piece(
        &self,
        direction: Direction,
        tangent: &Tangent,
        oscillator: &Oscillator,
        motion: &Motion,
        length: f64,
        listens: bool,
    ) -> (Piece, C, u32) {
        let (armed, threshold) = self.contact.fall_level();
        let level = FallLevel { armed, threshold };
        let mut r = oscillator.response(length);
        let (mut lasted_s, mut fell, mut extrema) = (length, false, 0);
        let (mut y, mut w) = passes(oscillator, motion, &r, length, level).unwrap_or_else(|| {
            let (end, looked_at) = first_fall(oscillator, motion, length, level, MOST_EXTREMA);
            extrema = looked_at;
            if let SlideEnd::Falls { at, .. } = end {
                (lasted_s, fell) = (at, true);
                r = oscillator.response(at);
            }
            oscillator.advance(motion, &r)
        });
        if y > tangent.kink {
            lasted_s = arrival(oscillator, motion, tangent.kink, lasted_s);
            r = oscillator.response(lasted_s);
            w = oscillator.advance(motion, &r).1;
            y = tangent.kink;
            fell = false;
        }
        let mut contact = self.contact.clone();
        let Advanced { uncertain, work } = contact.advance(&Stroke {
            direction,
            distance: y.max(0.0),
            from_speed: motion.w0,
            to_speed: w.max(0.0),
            elapsed_s: lasted_s,
        });
        let missed = if tangent.linear {
            // Also where it jumps at the kink: up to there it gave what its tangent did.
            0.0
        } else {
            let given = direction.sign() * contact.friction(direction.sign() * w.max(0.0));
            given - (tangent.force + tangent.stiffness * y + tangent.damping * w)
        };
        let (dy, dw) = oscillator.late_force(-missed, lasted_s, &r);
        let Coupling { stiffness, damping } = self.coupling;
        let (dy_unsure, dw_unsure) = oscillator.late_force(uncertain, lasted_s, &r);
        let felt = |dy: f64, dw: f64| (stiffness * (dy.abs() + dw.abs() * lasted_s)).max(damping * dw.abs());
        let error = felt(dy, dw).max(felt(dy_unsure, dw_unsure)).max(0.1 * uncertain);
        if dy != 0.0 {
            contact = self.contact.clone();
            contact.advance(&Stroke {
                direction,
                distance: (y + dy).max(0.0),
                from_speed: motion.w0,
                to_speed: (w + dw).max(0.0),
                elapsed_s: lasted_s,
            });
        }
        let speed = if fell { level_speed(level) } else { (w + dw).max(0.0) };
        let dissipated = if listens {
            self.dissipated(&contact, tangent, oscillator, motion, lasted_s, (dy, dw), speed)
        } else {
            0.0
        };
        let piece = Piece {
            lasted_s,
            distance: (y + dy).max(0.0),
            speed,
            fell,
            error,
            dissipated,
        };
        (piece, contact, work + extrema)
    }

    /// What the friction of a piece took: the work of the coupling, less what the block and the contact now hold more of. By Simpson's rule.
    #[expect(clippy::too_many_arguments, reason = "a whole piece")]
    fn dissipated(
        &self,
        contact: &C,
        tangent: &Tangent,
        oscillator: &Oscillator,
        motion: &Motion,
        lasted_s: f64,
        (dy, dw): (f64, f64),
        speed: f64,
    ) -> f64 {
        let Coupling { stiffness, damping } = self.coupling;
        let pull = |t: f64, y: f64, w: f64| motion.f0 + tangent.force + motion.g1 * t - stiffness * y - damping * w;
        let power = |share: f64| {
            let t = share * lasted_s;
            let (y, w) = oscillator.advance(motion, &oscillator.response(t));
            // The correction grew with the fourth power of time in displacement, and with the third in velocity.
            let cube = share * share * share;
            let (y, w) = (y + dy * cube * share, w + dw * cube);
            pull(t, y, w) * w
        };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 2 to 1602")]
        let panels = 2 + 2 * (2.0 * (self.fastest * lasted_s).min(400.0)) as u32;
        let mut sum = 0.0;
        for panel in 0..panels {
            let at = |k: f64| (f64::from(panel) + k) / f64::from(panels);
            sum += power(at(0.0)) + 4.0 * power(at(0.5)) + power(at(1.0));
        }
        let work = lasted_s / (6.0 * f64::from(panels)) * sum;
        let gained = 0.5 * self.mass * (speed * speed - motion.w0 * motion.w0);
        work - gained - (contact.stored_energy() - self.contact.stored_energy())
    }

    fn change_contact(&mut self, at_s: f64, sink: &mut (impl EventSink + ?Sized), rendered: &mut Rendered) {
        let from = self.state.contact;
        let to = self.contact.contact(self.state.velocity);
        if from != to {
            self.state.contact = to;
            rendered.events += 1;
            sink.contact_changed(at_s, from, to);
        }
    }

    /// One backward-Euler step to a time at which the load is `at_rest` if the block stands still; returns the displacement.
    ///
    /// The residual grows with the displacement, so its root is bracketed, and found by secants.
    fn implicit_step(&mut self, step_s: f64, at_rest: f64, sink: &mut (impl EventSink + ?Sized)) -> f64 {
        let inertia = self.mass / (step_s * step_s);
        let push = self.mass * self.state.velocity / step_s + at_rest;
        let turned_to = Direction::of(push - self.contact.force_at_rest());
        if matches!(self.contact.contact(turned_to.sign()), Contact::Sliding(direction) if direction != turned_to) {
            // The slide ends in this step, and its friction may not push the block back.
            self.contact.fall(turned_to, 0.0);
        }
        let net = push - self.contact.force_at_rest();
        if net == 0.0 {
            self.state.velocity = 0.0;
            return 0.0;
        }
        let direction = Direction::of(net);
        let sign = direction.sign();
        let resistance = inertia + self.coupling.damping / step_s + self.coupling.stiffness;
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
        self.state.velocity = sign * distance / step_s;
        let (_, threshold) = self.contact.fall_level();
        if self.state.velocity.abs() <= threshold {
            self.contact.fall(direction, self.state.velocity.abs());
        }
        sign * distance
    }
}

fn level_speed(level: FallLevel) -> f64 {
    if level.armed { level.threshold } else { 0.0 }
}

/// The length to try after a piece of a length that had an error: of third order.
pub(super) fn next_length(length: f64, error: f64, tolerance: f64) -> f64 {
    let ratio = tolerance / error;
    if ratio >= 64.0 {
        4.0 * length
    } else {
        // The root of the third, and a little less.
        (0.85 * powf(ratio, 1.0 / 3.0)).clamp(0.1, 4.0) * length
    }
}

/// When a forward motion has gone a distance, which it has after `latest`.
fn arrival(oscillator: &Oscillator, motion: &Motion, distance: f64, latest: f64) -> f64 {
    let (mut early, mut late) = (0.0, latest);
    let mut at = 0.5 * latest;
    for _ in 0..MOST_HALVINGS {
        let (y, w) = oscillator.advance(motion, &oscillator.response(at));
        if y < distance {
            early = at;
        } else {
            late = at;
        }
        let newton = at - (y - distance) / w;
        if (newton - at).abs() <= 1e-14 * latest {
            return newton.max(0.0).min(latest);
        }
        let next = if newton > early && newton < late {
            newton
        } else {
            0.5 * (early + late)
        };
        if (next - at).abs() <= 1e-14 * latest {
            return next;
        }
        at = next;
    }
    at
}

impl<C: YieldingContact> Moving for YieldingBlock<C> {
    fn advance(
        &mut self,
        elapsed_s: f64,
        position: f64,
        velocity: f64,
        sink: &mut (impl EventSink + ?Sized),
    ) -> Rendered {
        self.tick(elapsed_s, position, velocity, |block, load, rendered| {
            block.in_pieces(elapsed_s, load, sink, rendered);
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
            block.state.position += block.implicit_step(elapsed_s, load.at(elapsed_s), sink);
            block.change_contact(elapsed_s, sink, rendered);
        })
    }

    fn state(&self) -> BlockState {
        self.state
    }

    fn set_state(&mut self, state: BlockState) {
        self.contact.seat(0.0);
        if state.velocity != 0.0 {
            self.contact.slide(Direction::of(state.velocity), state.velocity.abs());
        }
        self.state = state;
        self.state.contact = self.contact.contact(state.velocity);
        self.try_s = f64::INFINITY;
    }

    fn at_rest(&self) -> Contact {
        self.contact.contact(0.0)
    }

    fn felt(&self) -> f64 {
        self.coupling.force(&self.state)
    }

    fn friction(&self) -> f64 {
        self.contact.friction(self.state.velocity)
    }

    fn seat(&mut self, force: f64) {
        self.contact.seat(force);
        self.state.contact = self.contact.contact(self.state.velocity);
    }
}
