//! The block in the plane: from one device sample to the next, stops and breakaways included.

use super::landing::reaches;
use super::series::{PieceMotion, Pull, Sliding};
use super::vector::Plane;
use crate::block::{BlockState, Contact, Coupling, EventSink, ExactBlock, LinearSlide, Rendered, Slides};
use crate::contact::ConstantLimit;
use crate::directional::Direction;
use crate::math::flush;
use crate::snapshot::Archive;
use crate::vector::Vector;

/// Below this speed, m/s, a block within its static limit is at rest: the ideal law is discontinuous where the pull is
/// between the dynamic and the static limit.
const FLOOR_MPS: f64 = 1e-12;

/// Pieces of a tick, after which one implicit step does the rest.
const MAX_PIECES: u32 = 400;

/// A slide is slow where the rest of the tick is longer than so many times that in which it turns.
const SLOW_TURNS: f64 = 60.0;

/// Of such times a series covers so many.
const SERIES_TURNS: f64 = 8.0;

/// A slide's contact. A plane has no direction of its own, so there is only one.
pub(super) const SLIDING: Contact = Contact::Sliding(Direction::Positive);

/// A contact on a line, as one in the plane.
fn of_plane(contact: Contact) -> Contact {
    if contact == Contact::Stuck { contact } else { SLIDING }
}

/// Karnopp friction of a surface that is alike in all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct IsotropicKarnopp {
    /// `Fs`, N: the pull that a block at rest withstands; at least `Fd` counts.
    pub static_force: f64,
    /// `Fd`, N, against a slide.
    pub dynamic_force: f64,
    /// `b`, N s/m.
    pub viscous: f64,
    /// `DV`, m/s: a slide that has been faster re-sticks when it falls back to it.
    pub velocity_threshold: f64,
}

/// The block and the last device sample that moved it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlanarState {
    /// Block position, m.
    pub position: Plane,
    /// Block velocity, m/s.
    pub velocity: Plane,
    /// [`Contact::Stuck`], or sliding in the positive sense.
    pub contact: Contact,
    /// Whether the slide has been faster than DV.
    pub armed: bool,
    /// Device position at the last tick, m.
    pub device_position: Plane,
    /// Device velocity at the last tick, m/s.
    pub device_velocity: Plane,
    /// What the position leaves out of the place, below its last digit, m.
    residue: Plane,
}

/// A block on an isotropic surface, dragged through a virtual coupling.
#[derive(Clone, Debug)]
pub struct PlanarBlock {
    coupling: Coupling,
    friction: IsotropicKarnopp,
    sliding: Sliding,
    /// The same block on a line.
    line: ExactBlock<LinearSlide, ConstantLimit, 1>,
    state: PlanarState,
}

/// How far a tick has come.
struct Course {
    elapsed_s: f64,
    /// Force at the start of the tick if the block stood still, and its slope.
    load: Pull,
    /// Within this, N, a force equals another.
    rounding: f64,
    /// Within this, N, a force lies on a line.
    collinear: f64,
    time: f64,
    moved: Plane,
    /// Length of the pull of a slide that sets off, after an event that fixes it better than subtraction can.
    limit: Option<f64>,
    pieces: u32,
    /// The longest step, s, that is tried for a slow slide.
    stiff_step_s: f64,
    rendered: Rendered<Plane>,
}

impl Course {
    fn remaining(&self) -> f64 {
        self.elapsed_s - self.time
    }

    /// What the coupling would do now to a block that stands still.
    fn pull(&self, stiffness: f64) -> Pull {
        Pull {
            force: self.load.force + self.load.slope * self.time - self.moved * stiffness,
            slope: self.load.slope,
        }
    }
}

impl PlanarBlock {
    /// At rest at the origin, of `mass` kg. The numbers are as [`Scene::validate`](crate::Scene::validate) accepts
    /// them.
    #[must_use]
    pub fn new(mass: f64, coupling: Coupling, friction: IsotropicKarnopp) -> Self {
        let friction = IsotropicKarnopp {
            static_force: friction.static_force.max(friction.dynamic_force),
            ..friction
        };
        let damping = coupling.damping + friction.viscous;
        let slide = LinearSlide::new(
            mass,
            damping,
            coupling.stiffness,
            friction.static_force,
            friction.dynamic_force,
        );
        let line = ExactBlock::new(
            mass,
            coupling,
            friction.velocity_threshold,
            Slides::new(|_| slide),
            ConstantLimit,
        );
        let mut block = Self {
            coupling,
            friction,
            sliding: Sliding::new(mass, coupling.stiffness, damping, friction.dynamic_force),
            line,
            state: PlanarState::new(Plane::ZERO, Plane::ZERO, Plane::ZERO, Plane::ZERO),
        };
        block.state.contact = block.at_rest();
        block
    }

    /// Where the block and the device are.
    #[must_use]
    pub fn state(&self) -> PlanarState {
        self.state
    }

    /// Puts it somewhere, without a tick.
    pub fn set_state(&mut self, state: PlanarState) {
        self.state = state;
        if state.velocity != Plane::ZERO || self.frictionless() {
            self.state.contact = SLIDING;
        }
        self.state.armed = state.velocity.length() > self.friction.velocity_threshold;
    }

    /// Moves the block on by `elapsed_s` seconds, in which the device went to `position` (m) and `velocity` (m/s). With
    /// `elapsed_s` of zero or less the block stands still and only the force is new.
    pub fn tick(
        &mut self,
        elapsed_s: f64,
        position: Plane,
        velocity: Plane,
        sink: &mut (impl EventSink + ?Sized),
    ) -> Rendered<Plane> {
        let mut rendered = Rendered::default();
        if elapsed_s > 0.0 {
            let course = self.course(elapsed_s, position, velocity);
            rendered = self.advance(course, sink);
            self.state.position = self.state.position.flushed();
            self.state.velocity = self.state.velocity.flushed();
            if !(self.state.position.is_finite() && self.state.velocity.is_finite()) {
                // Forces beyond the range of numbers.
                self.state = PlanarState::new(position, Plane::ZERO, position, velocity);
                self.state.contact = self.at_rest();
            }
        }
        self.state.device_position = position;
        self.state.device_velocity = velocity;
        rendered.coupling_force = self.coupling_force();
        rendered
    }

    /// Coupling force on the block, N.
    #[must_use]
    pub fn coupling_force(&self) -> Plane {
        let state = &self.state;
        state.deflection() * self.coupling.stiffness + (state.device_velocity - state.velocity) * self.coupling.damping
    }

    /// Saves or loads the block and the last sample.
    pub(super) fn archive(&mut self, archive: &mut Archive<'_>) {
        let state = &mut self.state;
        archive.vector("position_m", &mut state.position);
        archive.vector("residue_m", &mut state.residue);
        archive.vector("velocity_mps", &mut state.velocity);
        state.contact.archive(archive);
        archive.flag("armed", &mut state.armed);
        archive.vector("device_position_m", &mut state.device_position);
        archive.vector("device_velocity_mps", &mut state.device_velocity);
    }

    fn frictionless(&self) -> bool {
        self.friction.static_force == 0.0
    }

    /// The contact of a block at rest: sliding where no friction can hold it.
    #[must_use]
    pub fn at_rest(&self) -> Contact {
        if self.frictionless() { SLIDING } else { Contact::Stuck }
    }

    /// A tick to a sample of the device, at its beginning.
    fn course(&self, elapsed_s: f64, position: Plane, velocity: Plane) -> Course {
        let Coupling { stiffness, damping } = self.coupling;
        let state = &self.state;
        let place = state.device_position.sum().max(position.sum()) + state.position.sum();
        let speed = state.device_velocity.sum().max(velocity.sum());
        Course {
            elapsed_s,
            load: Pull {
                force: state.deflection() * stiffness + state.device_velocity * damping,
                slope: ((position - state.device_position) * stiffness + (velocity - state.device_velocity) * damping)
                    * (1.0 / elapsed_s),
            },
            rounding: f64::EPSILON * (2.0 * stiffness * state.position.sum() + 4.0 * damping * speed),
            collinear: 16.0 * f64::EPSILON * (stiffness * place + damping * speed),
            time: 0.0,
            moved: Plane::ZERO,
            limit: None,
            pieces: 0,
            stiff_step_s: elapsed_s.min(self.sliding.longest_stiff_step()),
            rendered: Rendered::default(),
        }
    }

    fn advance(&mut self, mut course: Course, sink: &mut (impl EventSink + ?Sized)) -> Rendered<Plane> {
        while course.time < course.elapsed_s {
            if course.pieces == MAX_PIECES {
                self.implicit_step(&mut course, sink);
                course.rendered.work_exhausted = true;
                break;
            }
            course.pieces += 1;
            if self.frictionless() {
                self.glide(&mut course);
            } else if self.state.contact == Contact::Stuck {
                self.rest(&mut course, sink);
            } else {
                self.slide(&mut course, sink);
            }
        }
        self.state.advance(course.moved);
        course.rendered
    }

    /// Rests until the contact lets go, or until the end of the tick.
    fn rest(&mut self, course: &mut Course, sink: &mut (impl EventSink + ?Sized)) {
        let pull = course.pull(self.coupling.stiffness);
        let limit = self.friction.static_force;
        let delay = if pull.force.length() > limit + course.rounding {
            0.0
        } else {
            reaches(&pull, limit).unwrap_or(f64::INFINITY).max(0.0)
        };
        // What lets go within a few digits of the end waits for the next tick.
        if course.time + delay >= course.elapsed_s * (1.0 - 8.0 * f64::EPSILON) {
            course.time = course.elapsed_s;
            return;
        }
        course.time += delay;
        course.limit = (delay > 0.0).then_some(limit);
        self.change_contact(SLIDING, course, sink);
    }

    /// Slides for one piece.
    fn slide(&mut self, course: &mut Course, sink: &mut (impl EventSink + ?Sized)) {
        let (static_force, dynamic_force) = (self.friction.static_force, self.friction.dynamic_force);
        let remaining = course.remaining();
        let mut pull = course.pull(self.coupling.stiffness);
        let velocity = self.state.velocity;
        let speed = velocity.length();
        if speed <= FLOOR_MPS && course.limit.is_none() && pull.force.length() <= static_force + course.rounding {
            self.change_contact(Contact::Stuck, course, sink);
            return;
        }
        if speed <= FLOOR_MPS {
            if let Some(limit) = course.limit.take() {
                pull.force = pull.force * (limit / pull.force.length());
            }
            let excess = pull.force.length() - dynamic_force;
            let motion = if excess > 1e-9 * dynamic_force {
                self.sliding.sets_off(&pull, remaining)
            } else {
                self.sliding.begins_to_slide(&pull, remaining)
            };
            self.follow(&motion, course, sink);
            return;
        }
        if velocity.cross(pull.force).abs() <= speed * course.collinear
            && velocity.cross(pull.slope).abs() * remaining <= speed * course.collinear
        {
            self.follow_line(course, sink);
            return;
        }
        let falls_before = self.friction.velocity_threshold > 0.0 && self.state.armed;
        if !falls_before
            && let Some(landing) = self.sliding.lands(velocity, &pull)
            && landing.after_s < remaining
        {
            course.time += landing.after_s;
            course.moved += landing.displacement;
            if sink.listens() {
                sink.dissipated(dynamic_force * landing.displacement.length());
            }
            self.change_contact(Contact::Stuck, course, sink);
            return;
        }
        if self.follow_slowly(&pull, course, sink) {
            return;
        }
        let mut motion = PieceMotion::at_rest(self.step_for(speed, &pull, remaining));
        self.sliding.goes_on(velocity, &pull, &mut motion);
        self.follow(&motion, course, sink);
    }

    /// A step of a slide whose direction follows the pull at once; false where it is not one, or not a smooth one.
    fn follow_slowly(&mut self, pull: &Pull, course: &mut Course, sink: &mut (impl EventSink + ?Sized)) -> bool {
        let turns_s = self.sliding.mass * self.state.velocity.length() / self.friction.dynamic_force;
        let remaining = course.remaining();
        if remaining <= SLOW_TURNS * turns_s {
            return false;
        }
        let step_s = course.stiff_step_s.min(remaining);
        if step_s <= SERIES_TURNS * turns_s {
            course.stiff_step_s *= 2.0;
            return false;
        }
        let halves = self.sliding.follows_pull(self.state.velocity, pull, step_s);
        // Between its nodes the speed is not known well enough for the time of a fall.
        let Some(halves) = halves.filter(|halves| halves.iter().all(|half| self.falls_in(half).is_none())) else {
            course.stiff_step_s = 0.25 * step_s;
            return false;
        };
        course.stiff_step_s = (2.0 * step_s).min(self.sliding.longest_stiff_step());
        for motion in halves {
            if self.state.contact != Contact::Stuck {
                self.follow(&motion, course, sink);
            }
        }
        true
    }

    /// A step, s, whose series has some prospect to converge: a slide that stops soon is not expanded beyond its stop.
    fn step_for(&self, speed: f64, pull: &Pull, remaining: f64) -> f64 {
        let force = pull.force.length() + self.friction.dynamic_force + self.sliding.damping * speed;
        remaining.min(SERIES_TURNS * self.sliding.mass * speed / force)
    }

    /// When in a piece a slide that has been faster than the velocity threshold falls to it.
    fn falls_in(&self, motion: &PieceMotion) -> Option<f64> {
        let threshold = self.friction.velocity_threshold;
        if threshold == 0.0 {
            None
        } else if self.state.armed {
            motion.falls_to(threshold)
        } else if motion.velocity(motion.until).length() <= threshold {
            motion.rises_above_and_falls_to(threshold)
        } else {
            None
        }
    }

    /// Takes one piece of a slide, up to where it falls to the velocity threshold.
    fn follow(&mut self, motion: &PieceMotion, course: &mut Course, sink: &mut (impl EventSink + ?Sized)) {
        let threshold = self.friction.velocity_threshold;
        let falls_at = self.falls_in(motion);
        let until = falls_at.unwrap_or(motion.until);
        if sink.listens() {
            sink.dissipated(self.friction.dynamic_force * motion.path(until));
        }
        course.moved += motion.displacement(until);
        self.state.velocity = motion.velocity(until);
        course.time = if until == 1.0 && motion.step_s == course.remaining() {
            course.elapsed_s
        } else {
            course.time + until * motion.step_s
        };
        if falls_at.is_some() {
            let pull = course.pull(self.coupling.stiffness).force.length();
            if pull <= self.friction.static_force + course.rounding {
                self.change_contact(Contact::Stuck, course, sink);
            } else {
                self.state.armed = false;
                course.rendered.events += 1;
            }
        } else if self.state.velocity.length() > threshold {
            self.state.armed = true;
        }
    }

    /// The rest of the tick on the line of the motion, in closed form.
    fn follow_line(&mut self, course: &mut Course, sink: &mut (impl EventSink + ?Sized)) {
        let along = self.state.velocity * (1.0 / self.state.velocity.length());
        let mut shifted = Shifted {
            sink,
            after_s: course.time,
        };
        let (rendered, end) = self.on_line(along, course, &mut shifted);
        course.moved += along * end.position;
        course.time = course.elapsed_s;
        course.rendered.events += rendered.events;
        course.rendered.work_exhausted |= rendered.work_exhausted;
        self.state.velocity = along * end.velocity;
        self.state.armed = end.armed;
        self.state.contact = of_plane(end.contact);
    }

    /// A tick without friction: each axis for itself.
    fn glide(&mut self, course: &mut Course) {
        let (_, x) = self.on_line(Plane::new(1.0, 0.0), course, &mut ());
        let (_, y) = self.on_line(Plane::new(0.0, 1.0), course, &mut ());
        course.moved += Plane::new(x.position, y.position);
        self.state.velocity = Plane::new(x.velocity, y.velocity);
        course.time = course.elapsed_s;
    }

    /// The rest of the tick of the block on a line through it. Its place is what it has moved from here.
    fn on_line(&mut self, along: Plane, course: &Course, sink: &mut impl EventSink) -> (Rendered, BlockState) {
        let (pull, remaining) = (course.pull(self.coupling.stiffness), course.remaining());
        let load = (flush(along.dot(pull.force)), flush(along.dot(pull.slope)));
        let velocity = along.dot(self.state.velocity);
        self.line.advance_from_origin(velocity, remaining, load, sink)
    }

    /// One backward-Euler step to the end of the tick (Moreau 1988): stable and dissipative whatever its length.
    fn implicit_step(&mut self, course: &mut Course, sink: &mut (impl EventSink + ?Sized)) {
        let step_s = course.remaining();
        let held = self.sliding;
        course.time = course.elapsed_s;
        let impulse = self.state.velocity * (held.mass / step_s) + course.pull(held.stiffness).force;
        let length = impulse.length();
        if length <= self.friction.static_force {
            if self.state.contact != Contact::Stuck {
                self.change_contact(Contact::Stuck, course, sink);
            }
            return;
        }
        if self.state.contact == Contact::Stuck {
            self.change_contact(SLIDING, course, sink);
        }
        let speed = (length - held.dynamic_force) / (held.mass / step_s + held.damping + held.stiffness * step_s);
        self.state.velocity = impulse * (speed / length);
        course.moved += self.state.velocity * step_s;
        sink.dissipated(held.dynamic_force * step_s * speed);
        self.state.armed = speed > self.friction.velocity_threshold;
    }

    fn change_contact(&mut self, to: Contact, course: &mut Course, sink: &mut (impl EventSink + ?Sized)) {
        let from = self.state.contact;
        self.state.contact = to;
        self.state.velocity = Plane::ZERO;
        self.state.armed = false;
        course.rendered.events += 1;
        sink.contact_changed(course.time, from, to);
    }
}

impl PlanarState {
    /// A block at `position` (m) with `velocity` (m/s), held by a device at `device_position` with `device_velocity`. A
    /// block that moves slides; one at rest is stuck.
    #[must_use]
    pub fn new(position: Plane, velocity: Plane, device_position: Plane, device_velocity: Plane) -> Self {
        Self {
            position,
            velocity,
            contact: if velocity == Plane::ZERO {
                Contact::Stuck
            } else {
                SLIDING
            },
            armed: false,
            device_position,
            device_velocity,
            residue: Plane::ZERO,
        }
    }

    /// The device's position less the block's, m.
    pub(super) fn deflection(&self) -> Plane {
        (self.device_position - self.position) - self.residue
    }

    /// Moves the block to a place, m.
    pub(super) fn put(&mut self, position: Plane) {
        (self.position, self.residue) = (position, Plane::ZERO);
    }

    fn advance(&mut self, by: Plane) {
        let by = by + self.residue;
        let position = self.position + by;
        self.residue = (self.position - position) + by;
        self.position = position;
    }
}

/// Passes on events of a part of the tick.
struct Shifted<'a, S: ?Sized> {
    sink: &'a mut S,
    after_s: f64,
}

impl<S: EventSink + ?Sized> EventSink for Shifted<'_, S> {
    fn contact_changed(&mut self, at_s: f64, from: Contact, to: Contact) {
        let (from, to) = (of_plane(from), of_plane(to));
        // On a line a slide may turn round; in the plane it goes on.
        if from != to {
            self.sink.contact_changed(self.after_s + at_s, from, to);
        }
    }

    fn dissipated(&mut self, energy_j: f64) {
        self.sink.dissipated(energy_j);
    }

    fn listens(&self) -> bool {
        self.sink.listens()
    }
}
