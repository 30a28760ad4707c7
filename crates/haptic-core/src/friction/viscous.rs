//! Viscous friction: `F = b w`, and nothing that holds.

use super::karnopp::Karnopp;
use super::law::{Law, LawKind};
use crate::block::LinearBlock;
use crate::contact::ConstantLimit;
use crate::directional::{Direction, Directional};
use crate::parameters::{Parameter, Slot};
use crate::render::{BlockSetup, Surface, ViscousSurface};
use alloc::boxed::Box;

/// Drag of a surface that had none, N s/m: enough to be felt by a hand.
const DEFAULT_DRAG_NSPM: f64 = 2.0;

/// Drag in proportion to velocity. 35 N s/m is the paper's.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Viscous {
    /// `b`, N s/m.
    #[cfg_attr(feature = "serde", serde(alias = "b", alias = "sigma2"))]
    pub viscous: Directional,
}

impl LawKind for Viscous {
    const NAME: &'static str = "viscous";
    const SUMMARY: &'static str = "Drag in proportion to velocity; holds nothing";

    fn defaults() -> Self {
        Self {
            viscous: Directional::both(DEFAULT_DRAG_NSPM),
        }
    }
}

impl Law for Viscous {
    fn slot(&mut self, parameter: Parameter, _on_device: bool) -> Option<Slot<'_>> {
        (parameter == Parameter::Viscous).then_some(Slot::Two(&mut self.viscous))
    }

    /// A drag of nothing is not a surface.
    fn adopts(&self, parameter: Parameter, value: Directional) -> bool {
        parameter != Parameter::Viscous || value.greatest() > 0.0
    }

    fn holding_force(&self) -> Directional {
        Directional::both(0.0)
    }

    fn steady_friction(&self, direction: Direction, speed: f64) -> f64 {
        self.viscous.get(direction) * speed
    }

    fn contact_stiffness(&self, _on_device: bool) -> f64 {
        0.0
    }

    fn behind_block(&self, block: &BlockSetup) -> Box<dyn Surface> {
        // Karnopp's law without its forces.
        let drag = Karnopp {
            viscous: self.viscous,
            ..Karnopp::new(0.0, 0.0)
        };
        if self.viscous.is_symmetric() {
            let linear = LinearBlock::new(block.mass, block.coupling, self.viscous.positive);
            block.by_scheme(linear, drag.stepped(drag.dynamic_force, ConstantLimit))
        } else {
            drag.behind_block(block)
        }
    }

    fn on_device(&self) -> Box<dyn Surface> {
        Box::new(ViscousSurface::new(self.viscous))
    }
}
