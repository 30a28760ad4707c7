//! What a study knows of the daemon and its rig.

use crate::update::Update;
use haptic_core::Scene;
use haptic_ipc::{Event, RigState, SceneReply, ServoSetup, Status};
use haptic_studies::store::RigDescription;

/// What a study knows of the daemon and its rig.
#[derive(Debug, Default)]
pub(super) struct RigFacts {
    is_connected: bool,
    /// Time of a tick, s, once the daemon has reported it.
    pub(super) period_s: Option<f64>,
    pub(super) state: Option<RigState>,
    pub(super) revision: Option<u64>,
    /// The scene that was asked for last, with its revision.
    scene: Option<Box<SceneReply>>,
    pub(super) servo: Option<ServoSetup>,
    status: Option<Box<Status>>,
}

impl RigFacts {
    /// Whether the daemon is there, and has reported what a session needs.
    pub(super) fn is_known(&self) -> bool {
        self.is_connected && self.period_s.is_some() && self.revision.is_some() && self.status.is_some()
    }

    /// The active scene, where it is known.
    pub(super) fn scene(&self) -> Option<&Scene> {
        let known = self.scene.as_ref();
        let known = known.filter(|known| Some(known.revision) == self.revision);
        known.map(|known| &known.scene)
    }

    /// The rig's buttons that click, a bit each: all but those that stop and enable.
    fn click_buttons(&self) -> u8 {
        let settings = self.servo.as_ref().map(|servo| &servo.settings);
        let taken = settings
            .into_iter()
            .flat_map(|settings| [settings.stop_button, settings.enable_button]);
        let taken = taken
            .flatten()
            .fold(0, |taken, button| taken | 1_u8.checked_shl(button.into()).unwrap_or(0));
        !taken
    }

    /// Takes an update.
    pub(super) fn take(&mut self, update: &Update) {
        match update {
            Update::Connected { .. } => {
                *self = Self {
                    is_connected: true,
                    ..Self::default()
                };
            }
            Update::Disconnected { .. } => *self = Self::default(),
            Update::Subscribed(reply) => {
                self.period_s = Some(reply.rate_hz.recip());
                self.servo.clone_from(&reply.servo);
            }
            Update::Status(Ok(status)) => self.status = Some(status.clone()),
            Update::Event(Event::State(event)) => {
                (self.state, self.revision) = (Some(event.state), Some(event.revision));
            }
            Update::Scene(Ok(scene)) => self.scene = Some(scene.clone()),
            Update::Event(Event::Servo(event)) => self.servo = Some(event.servo.clone()),
            _ => {}
        }
    }

    /// The rig as a study's files need it; none before the daemon has described its parts.
    pub(super) fn description(&self) -> Option<RigDescription> {
        let status = self.status.as_ref().filter(|_| self.is_connected)?;
        Some(RigDescription {
            server: status.server.clone(),
            device: status.device.description.clone(),
            loop_rate_hz: self.period_s?.recip(),
            servo: self.servo.clone(),
            configuration: serde_json::to_value(status).ok(),
            click_buttons: self.click_buttons(),
        })
    }
}
