//! The virtual calls of a tick: one moves the block, one shows it.

use crate::block::{Body, EventSink, Moving, Rendered};
use crate::contact::Contact;
use crate::vector::Vector;
use alloc::boxed::Box;

/// What a tick shows of the block: a part of its [`BlockState`](crate::block::BlockState), which costs less to hand over.
#[derive(Clone, Copy, Debug)]
pub struct VisibleState<V = f64> {
    /// Position of the block, m.
    pub position: V,
    /// Velocity of the block, m/s.
    pub velocity: V,
    /// Contact with the surface.
    pub contact: Contact,
}

impl VisibleState {
    /// The same of a motion along a line in a space, whose direction is a vector of the length 1.
    pub(crate) fn along<V: Vector>(self, direction: V) -> VisibleState<V> {
        VisibleState {
            position: direction * self.position,
            velocity: direction * self.velocity,
            contact: self.contact,
        }
    }
}

/// A compiled scene of any kind: [`Moving`], in a form that a box can hold.
pub(crate) trait Surface: Body {
    /// Moves on and hears nothing.
    fn tick(&mut self, elapsed_s: f64, position: f64, velocity: f64) -> Rendered;
    /// Moves on and reports each change of contact to `sink`.
    fn tick_with_events(&mut self, elapsed_s: f64, position: f64, velocity: f64, sink: &mut dyn EventSink) -> Rendered;
    /// The part of the state that every tick shows.
    fn shown(&self) -> VisibleState;
    /// A copy.
    fn boxed(&self) -> Box<dyn Surface>;
}

impl Clone for Box<dyn Surface> {
    fn clone(&self) -> Self {
        (**self).boxed()
    }
}

/// A sink whose type is not known.
struct Listener<'a>(&'a mut dyn EventSink);

impl EventSink for Listener<'_> {
    fn contact_changed(&mut self, at_s: f64, from: Contact, to: Contact) {
        self.0.contact_changed(at_s, from, to);
    }

    fn dissipated(&mut self, energy_j: f64) {
        self.0.dissipated(energy_j);
    }

    fn listens(&self) -> bool {
        self.0.listens()
    }
}

impl<M: Moving> Surface for M {
    fn tick(&mut self, elapsed_s: f64, position: f64, velocity: f64) -> Rendered {
        self.advance(elapsed_s, position, velocity, &mut ())
    }

    fn tick_with_events(&mut self, elapsed_s: f64, position: f64, velocity: f64, sink: &mut dyn EventSink) -> Rendered {
        self.advance(elapsed_s, position, velocity, &mut Listener(sink))
    }

    fn shown(&self) -> VisibleState {
        let state = self.state();
        VisibleState {
            position: state.position,
            velocity: state.velocity,
            contact: state.contact,
        }
    }

    fn boxed(&self) -> Box<dyn Surface> {
        Box::new(self.clone())
    }
}
