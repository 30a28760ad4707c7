//! The servo as a value: all that it remembers from step to step, and what may be set or asked between two steps.

use super::rig::Rig;
use super::sensing::Sensing;
use super::state::{Fault, RigState};
use super::transition::{CompiledScene, FadingScene, ForceOffset};
use crate::compensation::{Compensation, Compensator};
use crate::limiter::{Limits, SafetyLimiter};
use crate::own_motion::OwnMotion;
use crate::passivity::{PassivityObserver, RigLosses};
use crate::planar::Workspace;
use crate::sample::Motor;
use crate::sample_clock::ClockError;
use crate::snapshot::{Archive, FieldValue, Snapshot, SnapshotError};
use crate::vector::Vector;
use crate::velocity;
use alloc::boxed::Box;

/// Along a ramp a step counts for this many periods at most: a stall does not skip the ramp.
const MAX_RAMP_STEP_PERIODS: f64 = 5.0;

/// The whole state between a measurement and a force.
#[derive(Debug)]
pub struct Servo<V: Vector = f64> {
    pub(super) settings: Settings,
    /// Our own clock, from the first step on, ns.
    pub(super) now_ns: u64,
    pub(super) scene: Box<CompiledScene<V>>,
    /// What is rendered instead of the scene.
    pub(super) own_motion: Option<OwnMotion>,
    /// The direction of that motion, as a vector of the length 1, and where it began, m.
    pub(super) motion_along: V,
    pub(super) motion_from: V,
    /// The scene before, while its force fades out.
    pub(super) fading: Option<FadingScene<V>>,
    /// Scenes that are no longer rendered. They are freed elsewhere: a step frees nothing.
    pub(super) retired: [Option<Box<CompiledScene<V>>>; 2],
    pub(super) rig: Rig,
    /// Whether force flowed in the step before.
    pub(super) was_live: bool,
    pub(super) sensing: Sensing<V>,
    pub(super) limiter: SafetyLimiter<V>,
    pub(super) passivity: PassivityObserver<V>,
    /// On a line alone: in the plane a rig's friction is not compensated.
    pub(super) compensator: Option<Compensator>,
    pub(super) offset: ForceOffset<V>,
    /// Since when the device has been commanded to have its motor off, ns.
    pub(super) off_since_ns: Option<u64>,
}

impl<V: Vector> Servo<V> {
    /// A servo without force, of a device that is there.
    #[must_use]
    pub fn new(settings: Settings, scene: Box<CompiledScene<V>>) -> Self {
        Self {
            settings,
            now_ns: 0,
            scene,
            own_motion: None,
            motion_along: V::ZERO,
            motion_from: V::ZERO,
            fading: None,
            retired: [None, None],
            rig: Rig::new(settings.ramp_s, MAX_RAMP_STEP_PERIODS * settings.period_s),
            was_live: false,
            sensing: Sensing::new(settings.velocity, settings.period_s, settings.stale_ns),
            limiter: SafetyLimiter::new(settings.limits),
            passivity: PassivityObserver::new(settings.losses, settings.passivity_control_n),
            compensator: Self::compensator(settings.compensation),
            offset: ForceOffset::default(),
            off_since_ns: None,
        }
    }

    /// The device cannot be written, or is yet to be found.
    pub fn disconnect(&mut self) {
        self.rig.device_present(false);
    }

    /// The next sample is the first of another device.
    pub fn forget_device(&mut self) {
        self.sensing.forget();
    }

    /// Another rig is there, or more is known of it. While force flows nothing changes.
    pub fn set_rig(&mut self, losses: RigLosses, compensation: Option<Compensation>) {
        if self.rig.is_live() {
            return;
        }
        self.settings.losses = losses;
        self.settings.compensation = compensation;
        self.passivity = PassivityObserver::new(losses, self.settings.passivity_control_n);
        self.compensator = Self::compensator(compensation);
    }

    fn compensator(compensation: Option<Compensation>) -> Option<Compensator> {
        compensation.filter(|_| V::AXES == 1).map(Compensator::new)
    }

    /// Continues with other limits, also while force flows: [`SafetyLimiter::set_limits`], over the ramp of engaging.
    pub fn set_limits(&mut self, limits: Limits) {
        self.settings.limits = limits;
        self.limiter.set_limits(limits, self.settings.ramp_s);
    }

    /// However long the loop stands still, that is not a fault from now on.
    pub fn disregard_stalls(&mut self) {
        self.settings.stale_ns = u64::MAX;
    }

    /// What stays the same from step to step.
    #[must_use]
    pub fn settings(&self) -> &Settings {
        &self.settings
    }

    /// Its state after the step before, from which a [`restored`](Self::restored) one goes on; `None` while a motion of
    /// the rig's own takes the place of a scene.
    pub fn snapshot(&mut self) -> Option<Snapshot> {
        if self.own_motion.is_some() {
            return None;
        }
        let mut snapshot = Snapshot::EMPTY;
        snapshot.revision = self.scene.revision;
        snapshot.fading_revision = self.fading.as_ref().map(FadingScene::revision);
        self.archive(&mut Archive::saving(&mut snapshot));
        Some(snapshot)
    }

    /// A servo that goes on from a [`snapshot`](Self::snapshot), whose fields `find` gives by their names. The
    /// scenes are those of its revisions, compiled as the other servo's were.
    ///
    /// # Errors
    /// A field is missing, or has a value that it cannot have.
    pub fn restored(
        settings: Settings,
        scene: Box<CompiledScene<V>>,
        fading: Option<Box<CompiledScene<V>>>,
        find: &dyn Fn(&str) -> Option<FieldValue>,
    ) -> Result<Self, SnapshotError> {
        let mut servo = Self::new(settings, scene);
        servo.fading = fading.map(|scene| FadingScene::new(scene, 0.0));
        let mut archive = Archive::loading(find);
        servo.archive(&mut archive);
        archive.end()?;
        Ok(servo)
    }

    fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.count("now_ns", &mut self.now_ns, u64::MAX);
        archive.flag("was_live", &mut self.was_live);
        archive.option("is_switching_off", &mut self.off_since_ns, 0, |archive, since_ns| {
            archive.count("off_since_ns", since_ns, u64::MAX);
        });
        archive.part("rig", |archive| self.rig.archive(archive));
        archive.part("sensing", |archive| self.sensing.archive(archive));
        archive.part("limiter", |archive| self.limiter.archive(archive));
        archive.part("passivity", |archive| self.passivity.archive(archive));
        archive.part("offset", |archive| self.offset.archive(archive));
        // What is known of a rig may have changed since; it holds with the next force.
        let mut compensates = self.compensator.is_some();
        archive.flag("compensates", &mut compensates);
        if let Some(compensator) = self.compensator.as_mut().filter(|_| compensates) {
            archive.part("compensation", |archive| compensator.archive(archive));
        }
        archive.part("scene", |archive| self.scene.archive(archive));
        if let Some(fading) = &mut self.fading {
            archive.part("fading", |archive| fading.archive(archive));
        }
    }

    /// State of the rig.
    #[must_use]
    pub fn state(&self) -> RigState {
        self.rig.state()
    }

    /// Why the rig is faulted, or stopped by its own button.
    #[must_use]
    pub fn fault(&self) -> Option<Fault> {
        self.rig.fault()
    }

    /// What is wrong with the device's clock, for who wants to engage.
    #[must_use]
    pub fn clock_error(&self) -> Option<ClockError> {
        self.sensing.clock_error(self.now_ns)
    }

    /// What the device says of its motor.
    #[must_use]
    pub fn motor(&self) -> Motor {
        self.sensing.motor
    }

    /// Samples so far that no hand can have made, and that were not rendered.
    #[must_use]
    pub fn samples_forgotten(&self) -> u64 {
        self.sensing.forgotten()
    }

    /// The scene that is rendered, or was before a motion of the rig's own.
    #[must_use]
    pub fn scene(&self) -> &CompiledScene<V> {
        &self.scene
    }

    /// The motion of the rig's own that is rendered instead of the scene.
    #[must_use]
    pub fn own_motion(&self) -> Option<&OwnMotion> {
        self.own_motion.as_ref()
    }

    /// Whether there is a scene that is no longer rendered.
    #[must_use]
    pub fn has_retired(&self) -> bool {
        self.retired.iter().any(Option::is_some)
    }

    /// A scene that is no longer rendered, for a thread that may free it.
    pub fn take_retired(&mut self) -> Option<Box<CompiledScene<V>>> {
        self.retired.iter_mut().find_map(Option::take)
    }

    pub(super) fn retire(&mut self, scene: Box<CompiledScene<V>>) {
        match self.retired.iter_mut().find(|slot| slot.is_none()) {
            Some(slot) => *slot = Some(scene),
            // The caller did not take what was retired: a leak is better than freeing here.
            None => core::mem::forget(scene),
        }
    }
}

/// What stays the same from step to step.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Settings {
    /// Nominal time between two steps, s (> 0).
    pub period_s: f64,
    /// Duration of engaging and releasing, s (> 0).
    pub ramp_s: f64,
    /// The limits.
    pub limits: Limits,
    /// Losses of the rig itself.
    pub losses: RigLosses,
    /// Largest force of passivity control, N (>= 0); 0 only observes.
    #[cfg_attr(feature = "serde", serde(rename = "passivity_control_N"))]
    pub passivity_control_n: f64,
    /// How velocity is estimated.
    pub velocity: velocity::Method,
    /// Longest time without a new sample or, while force flows, without a tick, ns.
    pub stale_ns: u64,
    /// The stop button's bit.
    pub stop_button: Option<u8>,
    /// The enable button's bit.
    pub enable_button: Option<u8>,
    /// Where force may flow on a rig of two axes; everywhere without.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub workspace: Option<Workspace>,
    /// What is compensated of the rig's own friction.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub compensation: Option<Compensation>,
}
