//! The limits of the force, as lines: that of the device and the daemon, and those of the law.

use super::chart::{Ink, Overlay};
use super::scope::Scope;
use crate::daemon::Daemon;
use crate::tape::signal::Signal;
use crate::tapes::{AT_THE_LIMIT, Tapes};
use haptic_core::{Parameter, Scene};

/// Width of a limit's line, points.
const WIDTH: f32 = 1.0;

/// Radius of a moment at which the force was clipped, points.
const CLIPPED_RADIUS: f32 = 2.5;

/// The limit of the force on the hand, N, of the rig or of the opened recording.
pub(super) fn force_limit_n(daemon: &Daemon, tapes: &Tapes, scope: &Scope) -> Option<f64> {
    let limit_n = if scope.is_of_rig() {
        Some(daemon.force_limit_n())
    } else {
        let servo = tapes.opened().and_then(|opened| opened.metadata.servo.as_ref());
        servo.map(|servo| servo.settings.limits.force_n)
    };
    limit_n.filter(|limit_n| limit_n.is_finite())
}

/// The limits of what is seen.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Limits {
    /// Of the force on the hand, N.
    force_n: Option<f64>,
    /// Static and dynamic force of the scene, with their symbols, N; below zero those of the other direction.
    friction_n: Vec<(&'static str, f64)>,
}

impl Limits {
    /// Those of the rig or of the opened recording, and of a scene.
    pub(crate) fn of(daemon: &Daemon, tapes: &Tapes, scope: &Scope, scene: Option<&Scene>) -> Self {
        let friction = [("Fs", Parameter::StaticForce), ("Fd", Parameter::DynamicForce)];
        let friction_n = friction.into_iter().flat_map(|(symbol, parameter)| {
            let value = scene.and_then(|scene| scene.value(parameter));
            let both = value.map(|value| [(symbol, value.positive), (symbol, -value.negative)]);
            both.into_iter().flatten().filter(|(_, force_n)| *force_n != 0.0)
        });
        Self {
            force_n: force_limit_n(daemon, tapes, scope),
            friction_n: friction_n.collect(),
        }
    }

    /// The lines in a plot of these signals, or of their lengths.
    pub(crate) fn levels(&self, signals: &[Signal], as_length: bool) -> Vec<Overlay> {
        let mut levels = Vec::new();
        let [of_block, of_hand] =
            [Signal::COUPLING_FORCE, Signal::COMMAND_FORCE].map(|signal| signals.contains(&signal));
        // The force on the hand points against the one that drives the block; a length has no direction.
        let side = if of_block || as_length { 1.0 } else { -1.0 };
        let is_seen = |value: &f64| !as_length || *value > 0.0;
        if of_block || of_hand {
            let ink = Ink {
                opacity: 0.8,
                ..Ink::solid(|palette| palette.law, WIDTH)
            };
            let values = self.friction_n.iter().filter(|(_, value)| is_seen(value));
            levels.extend(values.map(|(symbol, value)| Overlay::Level {
                value: side * value,
                label: (*symbol).into(),
                // Lines of both may be close: each name stands on the far side of the other line.
                is_inward: *symbol == "Fd",
                ink,
            }));
        }
        if let Some(force_n) = self.force_n.filter(|_| of_hand) {
            let values = [force_n, -force_n].into_iter().filter(is_seen);
            levels.extend(values.map(|value| Overlay::Level {
                value,
                label: "force limit".into(),
                is_inward: false,
                ink: Ink::solid(|palette| palette.error_text, WIDTH),
            }));
        }
        levels
    }

    /// The moments at which the force on the hand, of two axes its length, was at its limit.
    pub(crate) fn clipped(&self, force: &[[f64; 2]]) -> Option<Overlay> {
        let limit_n = self.force_n?;
        let at_limit = force.iter().filter(|[_, value]| value.abs() >= AT_THE_LIMIT * limit_n);
        let at: Vec<[f64; 2]> = at_limit.copied().collect();
        (!at.is_empty()).then_some(Overlay::Dots {
            name: "clipped by the force limit",
            at,
            radius: CLIPPED_RADIUS,
            color: |palette| palette.error_text,
        })
    }
}
