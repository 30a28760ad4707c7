//! Pieces that the laws of a bristle share: what a bristle under a block does where its law has
//! nothing of its own.

use crate::block::{Expansion, LineEnd, Piece, Start};
use crate::contact::{Bristle, BristleForce, FrictionLine, LawContact, Level, Plasticity, SETTLED_N, YieldingContact};
use crate::math::flush;

impl<L: Level, P: Plasticity> Bristle<L, P> {
    fn set_force(&mut self, start: &Start, along: f64) {
        self.deflection = flush(start.direction.sign() * along / self.stiffness);
    }

    /// Whether the bristle's force along the motion is the steady one of a fast slide, N.
    pub(super) fn is_settled(&self, along: f64, kinetic: f64) -> bool {
        (along - kinetic).abs() < SETTLED_N
    }

    /// Nothing holds this way: whatever the bristle held is gone at once, and the block may go the
    /// other way.
    pub(super) fn let_go(&mut self, start: &Start) -> Piece {
        let dissipated = self.stored_energy();
        self.deflection = 0.0;
        start.no_distance(dissipated)
    }

    /// A slide with the kinetic force, down to a speed, m/s.
    pub(super) fn slide(&mut self, start: &Start, falls_to: f64) -> Piece {
        let kinetic = self.level.kinetic(start.direction);
        self.set_force(start, kinetic);
        start.slide(kinetic, self.viscous.get(start.direction), falls_to).0
    }

    /// A motion that the bristle takes up whole, until it has a force along it, N, or falls to a
    /// speed, m/s.
    pub(super) fn stretch(&mut self, start: &Start, until_force: f64, falls_to: f64) -> Piece {
        let along = start.direction.sign() * self.force_at_rest();
        let line = FrictionLine {
            force: along,
            stiffness: self.stiffness,
            damping: self.damping + self.viscous.get(start.direction),
            kink: (until_force - along) / self.stiffness,
        };
        let (piece, end) = start.on_line(&line, falls_to);
        let along = if end == LineEnd::Kink {
            until_force
        } else {
            along + self.stiffness * piece.distance
        };
        self.set_force(start, along);
        piece
    }

    /// The end of a piece by its series. `speed` is that of the event that ended it, m/s.
    pub(super) fn bend<const DAMPED: bool>(
        &mut self,
        start: &Start,
        expansion: &Expansion,
        speed: Option<f64>,
        bristle: &BristleForce<DAMPED>,
    ) -> Piece {
        self.set_force(start, bristle.at(expansion.end));
        let dissipated = if start.listens {
            bristle.dissipated(&expansion.path, expansion.end)
        } else {
            0.0
        };
        expansion.piece(speed, dissipated)
    }
}
