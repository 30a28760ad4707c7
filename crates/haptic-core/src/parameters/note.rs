//! Consequences of a valid scene that its user may not expect.

use super::parameter::ParameterKey;

/// Something about a valid scene that its user may not expect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Note {
    /// The parameter concerned, with its direction where only one is.
    pub param: ParameterKey,
    /// The consequence, and the value at which it begins.
    pub kind: NoteKind,
}

/// Content of a [`Note`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NoteKind {
    /// The static limit lies below the dynamic one, which then decides when the block lets go.
    BreakawayAtDynamicForce {
        /// The static limit, N.
        static_force: f64,
        /// The dynamic limit, N: the force at which the block really lets go.
        dynamic_force: f64,
    },
    /// A stop creates energy, because the contact begins to hold with the drag of the moment.
    StopCreatesEnergy {
        /// The velocity at which a slide ends, m/s.
        velocity_threshold: f64,
        /// J, at most.
        energy: f64,
    },
}

impl core::fmt::Display for Note {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        match self.kind {
            NoteKind::BreakawayAtDynamicForce {
                static_force,
                dynamic_force,
            } => write!(
                f,
                "{} = {static_force} N is below the dynamic force of {dynamic_force} N: the block lets go at \
                 {dynamic_force} N",
                self.param
            ),
            NoteKind::StopCreatesEnergy {
                velocity_threshold,
                energy,
            } => write!(
                f,
                "{} = {velocity_threshold} m/s ends a slide whose drag the spring then holds: each stop creates up to \
                 {energy:.2e} J",
                self.param
            ),
        }
    }
}
