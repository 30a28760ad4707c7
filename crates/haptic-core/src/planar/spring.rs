//! Karnopp's friction on the device itself, in the plane: a spring that is anchored where the hand came to rest, and
//! that the hand drags behind it as it slides.
//!
//! Stuck, the force is `Kp` times the displacement from the anchor, up to `Fs` whatever its direction. In a slide the
//! anchor follows at the distance `Fd/Kp`, on a tractrix: on a straight path of length `l` the angle `psi` between the
//! force and the motion falls as `tan(psi/2) = tan(psi0/2) exp(-l Kp/Fd)`. A slide ends where the motion turns back
//! from the anchor's pull, and, with a threshold, where it has become slower than that.

use super::block::{IsotropicKarnopp, SLIDING};
use super::vector::Plane;
use crate::block::Contact;
use crate::contact::Leg;
use crate::directional::Direction;
use crate::math::{exp, sqrt};
use crate::render::TickMotion;
use crate::snapshot::Archive;
use crate::vector::Vector;

/// Most slides of a leg below the threshold, which begin and end one by one.
const MAX_SLIDES: u32 = 512;

/// A spring that is this near its limit, as a share of it, has reached it.
const AT_THE_LIMIT: f64 = 1e-12;

/// Velocities across the path, as a share of all of them, that rounding explains.
const ON_A_LINE: f64 = 1e-9;

/// The contact of the hand with an isotropic surface.
#[derive(Clone, Copy, Debug)]
pub(super) struct DraggedSpring {
    /// `Kp`, N/m.
    stiffness: f64,
    friction: IsotropicKarnopp,
    state: State,
    pub(super) position: Plane,
    pub(super) velocity: Plane,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum State {
    /// The force of the spring, N.
    Stuck { force: Plane },
    /// The direction of the friction's pull, of the length 1: from the anchor to the hand.
    Sliding { away: Plane },
}

/// A straight piece of the hand's path.
#[derive(Clone, Copy, Debug)]
struct Piece {
    /// Its direction, of the length 1.
    along: Plane,
    leg: Leg,
}

impl Piece {
    fn split(&self, distance: f64) -> (Self, Self) {
        let (first, rest) = self.leg.split(distance);
        (Self { leg: first, ..*self }, Self { leg: rest, ..*self })
    }
}

impl DraggedSpring {
    /// At rest at the origin, without force. `stiffness` is `Kp`, N/m (> 0).
    pub(super) fn new(stiffness: f64, friction: IsotropicKarnopp) -> Self {
        Self {
            stiffness,
            friction: IsotropicKarnopp {
                static_force: friction.static_force.max(friction.dynamic_force),
                ..friction
            },
            state: State::Stuck { force: Plane::ZERO },
            position: Plane::ZERO,
            velocity: Plane::ZERO,
        }
    }

    /// The hand is put at a place (m), with a velocity (m/s), and feels this force, N, as far as the spring holds it.
    pub(super) fn put(&mut self, position: Plane, velocity: Plane, force: Plane) {
        (self.position, self.velocity) = (position, velocity);
        self.stick(force);
    }

    /// The hand is put at a place (m), with a velocity (m/s), in a slide that goes along a vector.
    pub(super) fn slide(&mut self, position: Plane, velocity: Plane, along: Plane) {
        (self.position, self.velocity) = (position, velocity);
        self.state = State::Sliding {
            away: along.pointing(1.0),
        };
    }

    /// Goes on with the contact of another one.
    pub(super) fn follow(&mut self, other: &Self) {
        (self.position, self.velocity) = (other.position, other.velocity);
        match other.state {
            State::Stuck { force } => self.stick(force),
            State::Sliding { .. } => self.state = other.state,
        }
    }

    pub(super) fn contact(&self) -> Contact {
        match self.state {
            State::Stuck { .. } => Contact::Stuck,
            State::Sliding { .. } => SLIDING,
        }
    }

    pub(super) fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.vector("device_position_m", &mut self.position);
        archive.vector("device_velocity_mps", &mut self.velocity);
        let (mut slides, mut pull) = match self.state {
            State::Stuck { force } => (false, force),
            State::Sliding { away } => (true, away),
        };
        archive.flag("slides", &mut slides);
        archive.vector("spring_force_N", &mut pull);
        self.state = if slides {
            State::Sliding { away: pull }
        } else {
            State::Stuck { force: pull }
        };
    }

    /// The friction against the hand, N, as the force of a coupling would be on a block.
    pub(super) fn force(&self) -> Plane {
        match self.state {
            State::Stuck { force } => force,
            State::Sliding { away } => away * self.friction.dynamic_force + self.velocity * self.friction.viscous,
        }
    }

    /// Moves on by `elapsed_s` seconds, in which the hand went to a position (m) and a velocity (m/s).
    pub(super) fn advance(&mut self, elapsed_s: f64, position: Plane, velocity: Plane) {
        if elapsed_s > 0.0 {
            let moved = position - self.position;
            let distance = moved.length();
            let along = if distance > 0.0 {
                moved * (1.0 / distance)
            } else if velocity != Plane::ZERO {
                velocity.pointing(1.0)
            } else {
                Plane::ZERO
            };
            let leg = Leg {
                direction: Direction::Positive,
                distance,
                from_speed: self.velocity.length(),
                to_speed: velocity.length(),
                duration_s: elapsed_s,
            };
            let motion = TickMotion {
                by: distance,
                from_velocity: self.velocity.dot(along),
                to_velocity: velocity.dot(along),
                elapsed_s,
            };
            let across = self.velocity.cross(along).abs() + velocity.cross(along).abs();
            let turns = motion.from_velocity * motion.to_velocity < 0.0;
            if turns && across <= ON_A_LINE * (leg.from_speed + leg.to_speed) {
                // To and fro on a line: as there.
                let (to_turn, last) = motion.turn(|| Direction::Positive);
                for leg in to_turn.into_iter().chain([last]) {
                    let along = along * leg.direction.sign();
                    self.follow_piece(Piece { along, leg });
                }
            } else {
                self.follow_piece(Piece { along, leg });
            }
        }
        (self.position, self.velocity) = (position, velocity);
    }

    fn follow_piece(&mut self, mut piece: Piece) {
        if let State::Sliding { away } = self.state {
            if piece.leg.distance == 0.0 {
                // The positions say where it went, as a velocity is late: without a displacement a slide goes on.
                piece.along = away;
            } else if away.dot(piece.along) <= 0.0 {
                // It turned back: the slide ended at rest, and what follows unloads the spring.
                self.end_slide(away, 0.0);
            }
        }
        let threshold = self.friction.velocity_threshold;
        let ends_slow = piece.leg.to_speed < threshold;
        let Some(distance) = piece.leg.passes(threshold).filter(|_| threshold > 0.0) else {
            return if ends_slow {
                self.go_slowly(&piece);
            } else {
                self.go(&piece);
            };
        };
        let (first, last) = piece.split(distance);
        if ends_slow {
            self.go(&first);
            self.go_slowly(&last);
        } else {
            self.go_slowly(&first);
            self.go(&last);
        }
    }

    /// Goes on where a slide lasts.
    fn go(&mut self, piece: &Piece) {
        let sliding = match self.state {
            State::Stuck { force } => self.go_stuck(force, piece),
            State::Sliding { away } => Some((away, *piece)),
        };
        if let Some((away, piece)) = sliding {
            let away = self.dragged(away, &piece, self.friction.dynamic_force);
            self.state = State::Sliding { away };
        }
    }

    /// Goes on slower than the threshold, where each slide ends as it begins.
    fn go_slowly(&mut self, piece: &Piece) {
        let limit = self.friction.static_force;
        let mut left = *piece;
        for slide in 0..=MAX_SLIDES {
            if let State::Sliding { away } = self.state {
                self.end_slide(away, left.leg.from_speed);
                left = self.without_whole_rounds(&left, slide == MAX_SLIDES);
            }
            let State::Stuck { force } = self.state else {
                return;
            };
            let size = force.length();
            if left.leg.distance > 0.0 && size >= limit * (1.0 - AT_THE_LIMIT) && force.dot(left.along) > 0.0 {
                // What a slide would hold is the limit already.
                let away = self.dragged(force * (1.0 / size), &left, size);
                self.state = State::Stuck { force: away * size };
                return;
            }
            match self.go_stuck(force, &left) {
                Some((away, rest)) => {
                    self.state = State::Sliding { away };
                    left = rest;
                }
                None => return,
            }
        }
        if let State::Sliding { away } = self.state {
            self.end_slide(away, left.leg.to_speed);
        }
    }

    /// Where a slide has just ended: from the friction of a slide to the limit and back is a round, which leaves the
    /// force as it is where each slide is like the next, or counts as such (`anyway`).
    fn without_whole_rounds(&self, piece: &Piece, anyway: bool) -> Piece {
        let State::Stuck { force } = self.state else {
            return *piece;
        };
        let (limit, along) = (self.friction.static_force, force.dot(piece.along));
        let is_alike = force.cross(piece.along).abs() <= AT_THE_LIMIT * limit && self.friction.viscous == 0.0;
        let (round, distance) = ((limit - along) / self.stiffness, piece.leg.distance);
        if !(is_alike || anyway) || along < 0.0 || round <= 0.0 || distance < round {
            return *piece;
        }
        piece.split(distance - distance % round).1
    }

    /// Goes on as a stuck spring; returns the direction of the friction and what is left of the path after it broke
    /// loose.
    fn go_stuck(&mut self, force: Plane, piece: &Piece) -> Option<(Plane, Piece)> {
        let limit = self.friction.static_force;
        let (along, size) = (force.dot(piece.along), force.length());
        let room = (limit - size) * (limit + size);
        // Where |force + Kp s along| is the limit.
        let root = sqrt((along * along + room).max(0.0));
        let stretch = if room <= 0.0 && along >= 0.0 {
            0.0
        } else if along > 0.0 {
            room / (along + root)
        } else {
            root - along
        };
        let distance = stretch / self.stiffness;
        if distance > piece.leg.distance || piece.leg.distance == 0.0 {
            let force = (force + piece.along * (self.stiffness * piece.leg.distance)).flushed();
            self.state = State::Stuck { force };
            return None;
        }
        let pull = force + piece.along * stretch;
        let size = pull.length();
        let away = if size > 0.0 { pull * (1.0 / size) } else { piece.along };
        Some((away, piece.split(distance).1))
    }

    /// The direction of the friction after a piece of a slide, whose anchor follows at the distance of a force, N.
    fn dragged(&self, away: Plane, piece: &Piece, force: f64) -> Plane {
        let (cosine, sine) = (piece.along.dot(away), piece.along.cross(away));
        if sine == 0.0 || force == 0.0 {
            return piece.along;
        }
        let tangent = sine / (1.0 + cosine) * exp(-piece.leg.distance * self.stiffness / force);
        let whole = 1.0 + tangent * tangent;
        piece.along * ((1.0 - tangent * tangent) / whole) + piece.along.turned_left() * (2.0 * tangent / whole)
    }

    /// A slide ends at a speed, m/s.
    fn end_slide(&mut self, away: Plane, speed: f64) {
        self.stick(away * (self.friction.dynamic_force + self.friction.viscous * speed));
    }

    /// Holds on to where it is, with a force, N, as far as that goes.
    fn stick(&mut self, force: Plane) {
        let size = force.length();
        let limit = self.friction.static_force;
        let force = if size > limit { force * (limit / size) } else { force };
        self.state = State::Stuck { force: force.flushed() };
    }
}
