//! A block on a surface, under each of the schemes.

use super::surface::Surface;
use crate::block::{BlockState, Body, Coupling, EventSink, Moving, PiecewiseContact, Rendered, literal, yielding};
use crate::contact::{Contact, ContactMemory};
use crate::scheme::Scheme;
use crate::snapshot::Archive;
use alloc::boxed::Box;

/// The block that a law is compiled under.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BlockSetup {
    /// kg.
    pub(crate) mass: f64,
    /// Its grip.
    pub(crate) coupling: Coupling,
    /// How it moves from one sample to the next.
    pub(crate) scheme: Scheme,
}

impl BlockSetup {
    /// `block` under the exact and the implicit scheme, and `literal` under the literal one.
    pub(crate) fn by_scheme(&self, block: impl Moving, literal: impl literal::SteppedLaw) -> Box<dyn Surface> {
        match self.scheme {
            Scheme::Exact => Box::new(block),
            Scheme::Implicit => Box::new(ImplicitScheme(block)),
            Scheme::Literal { substeps } => {
                Box::new(literal::LiteralBlock::new(self.mass, self.coupling, literal, substeps))
            }
        }
    }

    /// A block on a contact that gives way: at most with `contact_stiffness` (N/m), and holding at
    /// most `holds` (N).
    pub(crate) fn yielding(
        &self,
        contact: impl PiecewiseContact,
        contact_stiffness: f64,
        holds: f64,
    ) -> Box<dyn Surface> {
        let block = yielding::YieldingBlock::new(self.mass, self.coupling, contact.clone(), contact_stiffness, holds);
        self.by_scheme(block, literal::Yielding(contact))
    }
}

/// Takes one backward-Euler step a tick.
#[derive(Clone, Copy, Debug)]
struct ImplicitScheme<M>(M);

impl<M: Moving> Moving for ImplicitScheme<M> {
    fn advance(&mut self, elapsed_s: f64, position: f64, velocity: f64, sink: &mut impl EventSink) -> Rendered {
        self.0.advance_implicitly(elapsed_s, position, velocity, sink)
    }
}

impl<M: Body> Body for ImplicitScheme<M> {
    fn state(&self) -> BlockState {
        self.0.state()
    }

    fn memory(&self) -> ContactMemory {
        self.0.memory()
    }

    fn set_state(&mut self, state: BlockState) {
        self.0.set_state(state);
    }

    fn at_rest(&self) -> Contact {
        self.0.at_rest()
    }

    fn archive(&mut self, archive: &mut Archive<'_>) {
        self.0.archive(archive);
    }

    fn coupling_force(&self) -> f64 {
        self.0.coupling_force()
    }
}
