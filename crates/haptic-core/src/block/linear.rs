//! A block that nothing holds: drag alone, the same either way. One oscillator, solved exactly,
//! without an event to look for.

use super::body::{BlockState, Body, Coupling, EventSink, Load, Moving, Rendered};
use super::oscillator::{InitialState, Oscillator, Propagator};
use crate::contact::Contact;
use crate::directional::Direction;
use crate::series::halve;
use crate::snapshot::Archive;

/// The block of a viscous scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LinearBlock {
    mass: f64,
    coupling: Coupling,
    viscous: f64,
    oscillator: Oscillator,
    propagator: Propagator,
    state: BlockState,
}

impl LinearBlock {
    /// `viscous` is `b`, N s/m.
    pub(crate) fn new(mass: f64, coupling: Coupling, viscous: f64) -> Self {
        let oscillator = Oscillator::new(mass, coupling.damping + viscous, coupling.stiffness);
        let mut state = BlockState::new(0.0, 0.0, 0.0, 0.0);
        state.contact = Contact::Sliding(Direction::Positive);
        Self {
            mass,
            coupling,
            viscous,
            oscillator,
            propagator: Propagator::new(&oscillator),
            state,
        }
    }

    /// The new sample, and the contact that fits the new velocity.
    fn arrive(
        &mut self,
        elapsed_s: f64,
        sample: (f64, f64),
        motion: Option<&InitialState>,
        sink: &mut impl EventSink,
    ) -> Rendered {
        self.state = self.state.flushed();
        (self.state.device_position, self.state.device_velocity) = sample;
        if !self.state.is_finite() {
            self.set_state(BlockState::new(sample.0, 0.0, sample.0, sample.1));
        }
        let from = self.state.contact;
        let to = Contact::Sliding(Direction::of(self.state.velocity));
        let turned = from != to && self.state.velocity != 0.0;
        if turned {
            self.state.contact = to;
            let at_s = motion
                .filter(|_| sink.listens())
                .map_or(elapsed_s, |motion| self.turning_time(motion, elapsed_s));
            sink.contact_changed(at_s, from, to);
        }
        Rendered {
            coupling_force: self.coupling.force(&self.state),
            events: u32::from(turned),
            work_exhausted: false,
        }
    }

    /// When the velocity passed zero, by halving; only a listener asks for it.
    fn turning_time(&self, motion: &InitialState, elapsed_s: f64) -> f64 {
        let ends = Direction::of(self.state.velocity);
        let turns_later = |time: f64| Direction::of(self.oscillator.velocity(motion, time).0) != ends;
        halve(0.0, elapsed_s, 60, turns_later).1
    }
}

impl Moving for LinearBlock {
    fn advance(&mut self, elapsed_s: f64, position: f64, velocity: f64, sink: &mut impl EventSink) -> Rendered {
        if elapsed_s <= 0.0 {
            return self.arrive(0.0, (position, velocity), None, sink);
        }
        let load = Load::new(&self.coupling, &self.state, elapsed_s, position, velocity);
        let motion = InitialState {
            w0: self.state.velocity,
            f0: load.at_start,
            g1: load.slope,
        };
        let r = self.propagator.at(&self.oscillator, elapsed_s);
        let (y, w) = self.oscillator.advance(&motion, &r);
        self.state.advance(y);
        self.state.velocity = w;
        self.arrive(elapsed_s, (position, velocity), Some(&motion), sink)
    }

    fn advance_implicitly(
        &mut self,
        elapsed_s: f64,
        position: f64,
        velocity: f64,
        sink: &mut impl EventSink,
    ) -> Rendered {
        if elapsed_s > 0.0 {
            let load = Load::new(&self.coupling, &self.state, elapsed_s, position, velocity);
            let impulse = self.mass * self.state.velocity / elapsed_s + load.at(elapsed_s);
            let resistance =
                self.mass / elapsed_s + self.coupling.damping + self.viscous + self.coupling.stiffness * elapsed_s;
            self.state.velocity = impulse / resistance;
            self.state.advance(elapsed_s * self.state.velocity);
        }
        self.arrive(elapsed_s, (position, velocity), None, sink)
    }
}

impl Body for LinearBlock {
    fn state(&self) -> BlockState {
        self.state
    }

    fn set_state(&mut self, state: BlockState) {
        self.propagator.rest(&self.oscillator);
        self.state = state.consistent();
        if self.state.contact == Contact::Stuck {
            self.state.contact = self.at_rest();
        }
    }

    fn archive(&mut self, archive: &mut Archive<'_>) {
        self.state.archive(archive);
        self.propagator.archive("tick_s", &self.oscillator, archive);
    }

    fn coupling_force(&self) -> f64 {
        self.coupling.force(&self.state)
    }
}
