//! The interface of a friction law: all that the rest of the crate asks of one. Only the law's own
//! file knows more.
//!
//! Beside it default values that several laws share: the paper's forces, and those of the ready scenes.

use crate::block::PiecewiseContact;
use crate::directional::{Direction, Directional};
use crate::parameters::{NotApplicable, Note, Parameter, SceneError, Slot};
use crate::render::{BlockSetup, Surface};
use alloc::boxed::Box;
use alloc::vec::Vec;
use core::fmt::Debug;

/// A friction law with the values of its parameters.
pub(crate) trait Law: Debug {
    /// The place of a parameter's value; `None` where the law lacks the parameter. `on_device`
    /// where the scene has no block.
    fn slot(&mut self, parameter: Parameter, on_device: bool) -> Option<Slot<'_>>;

    /// Why the law lacks a parameter; `None` where no setting has it.
    fn why_lacking(&self, _parameter: Parameter) -> Option<NotApplicable> {
        None
    }

    /// A parameter that has a value in a setting in which the law lacks the parameter.
    fn misplaced(&self, _on_device: bool) -> Option<Parameter> {
        None
    }

    /// Checks the law's demands on its values beyond their ranges.
    ///
    /// # Errors
    /// The first demand that is not met.
    fn validate(&self, _on_device: bool) -> Result<(), SceneError> {
        Ok(())
    }

    /// Changes what [`validate`](Self::validate) would refuse, as little as possible: after the
    /// values of another law were adopted.
    fn comply(&mut self) {}

    /// Whether to adopt the value that a scene had under another law.
    fn adopts(&self, _parameter: Parameter, _value: Directional) -> bool {
        true
    }

    /// Consequences of these values that a user may not expect.
    fn notes(&self) -> Vec<Note> {
        Vec::new()
    }

    /// Limit of static friction by direction, N; zero where nothing holds.
    fn holding_force(&self) -> Directional;

    /// Friction of a steady slide against its direction, N, at a speed in m/s (>= 0).
    fn steady_friction(&self, direction: Direction, speed: f64) -> f64;

    /// Greatest stiffness with which the contact gives way, N/m; 0 for a contact that is rigid or
    /// holds nothing.
    fn contact_stiffness(&self, on_device: bool) -> f64;

    /// Kinetic friction of a contact that is rigid behind a block, N: the literal scheme makes it
    /// tremble about rest.
    fn rigid_friction(&self) -> Option<Directional> {
        None
    }

    /// Viscous friction, N s/m, below which the law can give out energy; `None` for a law that
    /// never does.
    fn passive_from(&self, _direction: Direction) -> Option<f64> {
        None
    }

    /// Under a block, the most damping (N s/m) that the law adds to the coupling's, where it is curved and
    /// so followed by series; `None` where it is made of straight lines.
    fn damping_of_curve(&self) -> Option<f64> {
        None
    }

    /// A block on a contact of the law, which gives way.
    fn yielding(&self, block: &BlockSetup, contact: impl PiecewiseContact) -> Box<dyn Surface>
    where
        Self: Sized,
    {
        let (stiffness, holds) = (self.contact_stiffness(false), self.holding_force().greatest());
        block.yielding(contact, stiffness, holds)
    }

    /// Compiles the law under a block.
    fn behind_block(&self, block: &BlockSetup) -> Box<dyn Surface>;

    /// Compiles the law on the device itself.
    fn on_device(&self) -> Box<dyn Surface>;
}

/// The part of a law that needs no values.
pub(crate) trait LawKind: Law + Sized {
    /// Its name in scene files and on the wire: the type's name in kebab case.
    const NAME: &'static str;

    /// Its idea in one line, and its source, for people who choose a law.
    const SUMMARY: &'static str;

    /// The law with the paper's forces, and default values for its other parameters.
    fn defaults() -> Self;
}

/// `Fs`, N.
pub(super) const STATIC_FORCE: f64 = 4.0;

/// `Fd`, N.
pub(super) const DYNAMIC_FORCE: f64 = 3.5;

/// `Kp`, N/m: as stiff as small rigs render without buzzing. On the device Karnopp's law has it
/// unless a scene says otherwise.
pub const DEFAULT_CONTACT_STIFFNESS: f64 = 5000.0;

/// `sigma1`, N s/m: as much as keeps a bristle of this stiffness from ringing under half a
/// kilogram.
pub(super) const CONTACT_DAMPING: f64 = 10.0;

/// `ws`, m/s: that of the ready scene with LuGre friction.
pub(super) const STRIBECK_VELOCITY_MPS: f64 = 0.01;

/// `zba` and `zs`.
pub(super) const ELASTIC_FRACTION: f64 = 0.7;

/// [`ELASTIC_FRACTION`], as serde asks for a default.
#[cfg(feature = "serde")]
pub(super) fn elastic_fraction() -> f64 {
    ELASTIC_FRACTION
}
