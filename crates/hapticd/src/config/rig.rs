//! The rig that the options name.

use super::error::{ConfigError, within};
use super::options::{HandName, Options};
use device_io::fake::Path as PlanarPath;
use device_io::fake::{
    FakeRig, Figure, Hand, HandMotion, PlanarFake, PlanarProperties, PlanarRig, PointerArm, RigProperties,
};
use device_io::kinematics::Kinematics;
use device_io::link::Connector;
use haptic_core::compensation::MAX_SHARE;

/// The rig: simulated, or behind a link.
#[derive(Debug)]
pub(crate) enum RigChoice {
    Fake(Box<FakeRig>),
    /// Simulated, of two axes.
    FakePlane(Box<PlanarFake>),
    Linked(Box<dyn Connector>),
}

/// What the options say of the rig's own friction.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct FrictionOptions {
    /// Coulomb friction, N.
    pub(crate) friction_n: Option<f64>,
    /// Viscous damping, N s/m.
    pub(crate) damping_ns_per_m: Option<f64>,
    /// Share of the identified friction that is compensated; `None` if none is.
    pub(crate) compensate: Option<f64>,
}

/// Viscous damping of the rig in this process, N s/m, unless an option names another: that of a slide with a damper, as
/// an eddy-current brake is. It takes up what sampling makes with the grip of the first scene, `K T/2 + B` = 10.5.
const SLIDE_DAMPING_NS_PER_M: f64 = 12.0;

impl Options {
    pub(super) fn friction(&self) -> Result<FrictionOptions, ConfigError> {
        let checked = |name, given: Option<f64>, max, unit| match given {
            None => Ok(None),
            Some(_) => within(name, given, 0.0, 0.0, max, unit).map(Some),
        };
        let unit = "of the rig's friction";
        Ok(FrictionOptions {
            friction_n: checked("rig-friction-n", self.rig_friction_n, 1000.0, "N")?,
            damping_ns_per_m: checked("rig-damping-ns-per-m", self.rig_damping_ns_per_m, 1e4, "N s/m")?,
            compensate: checked("compensate", self.compensate, MAX_SHARE, unit)?.filter(|share| *share > 0.0),
        })
    }

    pub(super) fn fake_rig(&self) -> Result<FakeRig, ConfigError> {
        let defaults = RigProperties::default();
        let friction = self.friction()?;
        let properties = RigProperties {
            mass_kg: within("rig-mass-kg", self.rig_mass_kg, defaults.mass_kg, 1e-3, 1000.0, "kg")?,
            friction_n: friction.friction_n.unwrap_or(defaults.friction_n),
            damping_ns_per_m: friction.damping_ns_per_m.unwrap_or(SLIDE_DAMPING_NS_PER_M),
            resolution_m: within(
                "encoder-resolution-m",
                self.encoder_resolution_m,
                defaults.resolution_m,
                0.0,
                0.01,
                "m",
            )?,
            ..defaults
        };
        let hand = match self.hand_or(HandName::Sine) {
            HandName::Figure(_) => {
                let why = "circle and eight are for a rig of two axes: --kinematics xy";
                return Err(ConfigError::Hand(why.to_owned()));
            }
            HandName::Free => Hand::Free,
            HandName::Sine => Hand::Prescribed(self.motion()?),
            HandName::Arm => Hand::arm(self.motion()?),
            HandName::Mouse => Hand::Pointer(PointerArm::default()),
        };
        Ok(FakeRig::new(properties, hand))
    }

    fn hand_or(&self, defaults: HandName) -> HandName {
        self.hand.as_ref().map_or(defaults, |name| name.0)
    }

    /// The fake rig of two axes, whose hand draws through its arm.
    pub(super) fn fake_plane(&self, kinematics: Kinematics) -> Result<PlanarFake, ConfigError> {
        let figure = match self.hand_or(HandName::Figure(Figure::Circle)) {
            HandName::Figure(figure) => Some(figure),
            HandName::Free => None,
            _ => {
                let why = "sine, arm and mouse are for a rig of one axis; of two there are circle, eight and free";
                return Err(ConfigError::Hand(why.to_owned()));
            }
        };
        let defaults = PlanarProperties::of(&kinematics);
        let friction = self.friction()?;
        let count = within(
            "encoder-resolution-m",
            self.encoder_resolution_m,
            defaults.count,
            1e-9,
            0.01,
            if kinematics.are_rotary() { "rad" } else { "m" },
        )?;
        let properties = PlanarProperties {
            mass_kg: within("rig-mass-kg", self.rig_mass_kg, defaults.mass_kg, 1e-3, 1000.0, "kg")?,
            friction_n: friction.friction_n.unwrap_or(defaults.friction_n),
            damping_ns_per_m: friction.damping_ns_per_m.unwrap_or(SLIDE_DAMPING_NS_PER_M),
            count,
        };
        let (amplitude_m, frequency_hz) = self.oscillation()?;
        let path = figure.map(|figure| PlanarPath::Figure {
            figure,
            middle: kinematics.middle(),
            amplitude_m,
            frequency_hz,
        });
        PlanarRig::new(properties, kinematics, path)
            .map(PlanarFake::new)
            .map_err(ConfigError::Hand)
    }

    /// Amplitude, m, and frequency, Hz, of the hand.
    fn oscillation(&self) -> Result<(f64, f64), ConfigError> {
        Ok((
            within("hand-amplitude-m", self.hand_amplitude_m, 0.03, 0.0, 1.0, "m")?,
            within("hand-frequency-hz", self.hand_frequency_hz, 0.5, 0.0, 50.0, "Hz")?,
        ))
    }

    fn motion(&self) -> Result<HandMotion, ConfigError> {
        let (amplitude_m, frequency_hz) = self.oscillation()?;
        Ok(HandMotion::Sine {
            amplitude_m,
            frequency_hz,
        })
    }
}

/// Checks of a device that the configuration waives.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct EngageRules {
    /// Engages a rig that was not commissioned.
    pub(crate) uncommissioned: bool,
    /// Engages a device whose watchdog is missing or too long.
    pub(crate) allow_no_watchdog: bool,
}
