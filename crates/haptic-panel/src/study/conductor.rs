//! A subject's session at the daemon: which scene the rig changes to, when, and what becomes of a stop, a fault, a lost
//! connection or another client's change. It decides; nothing here waits but [`keep`](Conductor::keep).
//!
//! The scene changes with the hand on the handle: over 200 ms, in which the daemon leaves the force continuous. Nothing
//! engages the rig but the experimenter. A lease has the rig released should the panel be lost.

use super::news::Stage;
use super::subject_screen::SubjectAction;
use crate::intent::Intent;
use crate::stop::report::is_halted;
use crate::update::{Answer, Update};
use crate::words::sentence_case;
use haptic_core::Scene;
use haptic_ipc::{ChangeReply, DaemonMirror, Event, RigState};
use haptic_studies::pace::Pace;
use haptic_studies::perception::Answer as Choice;
use haptic_studies::person::{PersonSession, SessionEvent};
use haptic_studies::session::{Frame, Interruption, Mounting, Phase, View};
use haptic_studies::store::{RigDescription, StoreError};
use std::mem::{Discriminant, discriminant};

/// Time over which a scene changes, ms.
const RAMP_MS: f64 = 200.0;

/// Time after a ramp in which its last step fades in, s.
const FADE_S: f64 = 0.05;

/// Longest silence of the panel, ms. It asks for the status once a second, which renews the lease.
const LEASE_MS: u32 = 3000;

/// Shortest time for which words stay, s: a second click is no wish to go on.
const MIN_WORDS_S: f64 = 0.5;

/// A session, and its progress through the rig's states.
#[derive(Debug)]
pub(super) struct Conductor {
    pub(super) session: PersonSession,
    /// Time of a tick that the session counts with, s.
    pub(super) period_s: f64,
    /// The experimenter has begun, and not paused since.
    is_begun: bool,
    newest_tick: u64,
    /// How fast the subject is.
    pace: Pace,
    /// The phase, and the tick at which it was first seen.
    phase: Option<(Discriminant<Phase>, u64)>,
}

impl Conductor {
    pub(super) fn new(session: PersonSession, period_s: f64) -> Self {
        Self {
            session,
            period_s,
            is_begun: false,
            newest_tick: 0,
            pace: Pace::default(),
            phase: None,
        }
    }

    /// Time that the subject will take, in words.
    pub(super) fn time_left(&self) -> Option<String> {
        let view = self.session.view();
        self.pace.time_left(view.of?.saturating_sub(view.done), self.period_s)
    }

    /// Ends it, once all that became final is on the disk.
    pub(super) fn close(self) -> Result<(), StoreError> {
        self.session.close()
    }

    /// What the subject sees; nothing before the experimenter has begun.
    pub(super) fn view(&self) -> Option<View> {
        self.is_begun.then(|| self.session.view())
    }

    /// Has what became final on the disk, and says what happened since, also before an error.
    pub(super) fn keep(&mut self, happened: &mut Vec<SessionEvent>) -> Result<(), StoreError> {
        let kept = self.session.keep(happened);
        if !self.is_begun || self.session.interruption().is_some() {
            self.pace.interrupt();
        }
        for happening in happened {
            if let SessionEvent::Kept(_) = happening {
                self.pace.done(self.newest_tick);
            }
        }
        kept
    }

    /// Takes a frame that showed the cursor.
    pub(super) fn frame(&mut self, frame: Frame) {
        self.session.frame(frame);
    }

    /// The experimenter's consent: the subject begins, or continues.
    pub(super) fn go_on(&mut self) -> Intent {
        if self.session.interruption().is_some() || (self.is_begun && self.session.mounting().is_some()) {
            self.session.proceed();
        }
        self.is_begun = true;
        Intent::Lease { timeout_ms: LEASE_MS }
    }

    /// Interrupts the session; the trial under way is void.
    pub(super) fn pause(&mut self) {
        self.session.pause();
        self.is_begun = false;
    }

    /// Takes what the subject did, with the newest tick at that time.
    pub(super) fn act(&mut self, action: SubjectAction, tick: u64) {
        if !self.is_begun {
            return;
        }
        match (action, self.session.view().phase) {
            (SubjectAction::Click, Phase::Targets(_)) => self.session.click(tick),
            (SubjectAction::Click, Phase::Instruction(_) | Phase::Rest { .. }) => {
                let since = self.phase.map_or(tick, |(_, since)| since);
                #[expect(clippy::cast_precision_loss, reason = "ticks of a session are far below 2^53")]
                let shown_s = tick.saturating_sub(since) as f64 * self.period_s;
                if shown_s >= MIN_WORDS_S {
                    self.session.proceed();
                }
            }
            (SubjectAction::Answer(1), _) => self.session.answer(Choice::First, tick),
            (SubjectAction::Answer(_), _) => self.session.answer(Choice::Second, tick),
            (SubjectAction::Click, _) => {}
        }
    }

    /// Whether a trial is under way, or the target is shown that a segment begins with.
    fn is_at_work(&self) -> bool {
        matches!(
            self.session.view().phase,
            Phase::Targets(_) | Phase::Wait | Phase::Feel(_) | Phase::Question
        )
    }

    fn is_done(&self) -> bool {
        self.session.view().phase == Phase::Done
    }

    /// Takes an update, which the mirror of the daemon has taken already.
    pub(super) fn take(&mut self, update: &Update) {
        match update {
            Update::Connected { .. } | Update::Disconnected { .. } => self.session.new_link(),
            Update::Event(event) => {
                self.session.event(event);
                match event {
                    Event::Samples(batch) => {
                        self.newest_tick = batch.rows.last().map_or(self.newest_tick, |row| row.tick);
                    }
                    // Where the rig is unplugged no tick may follow that shows it.
                    Event::State(event) if event.state != RigState::Engaged && self.is_at_work() => {
                        self.session
                            .interrupt(Interruption::State(event.state, event.fault.clone()));
                    }
                    _ => {}
                }
            }
            Update::Answered {
                intent: Intent::TrialScene { .. },
                result,
            } => match result {
                Ok(Answer::Changed(reply)) => self.rendered(reply),
                Ok(_) => self.session.refused("the daemon's answer is not that to a change"),
                Err(error) => self.session.refused(&error.message),
            },
            _ => {}
        }
    }

    fn rendered(&mut self, reply: &ChangeReply) {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a twentieth of a second"
        )]
        let fade = (FADE_S / self.period_s).ceil() as u64;
        let whole_tick = match reply.ramp_ends_tick.or(reply.tick) {
            Some(tick) => tick + fade,
            // It was active already.
            None => self.newest_tick,
        };
        self.session.rendered(reply.revision, whole_tick);
    }

    /// What to ask the daemon for now, but a scene.
    pub(super) fn due(&mut self, daemon: &DaemonMirror, scene_before: &mut SceneBefore) -> Vec<Intent> {
        let mut intents = Vec::new();
        let phase = discriminant(&self.session.view().phase);
        let before = self.phase.map(|(before, _)| before);
        if before != Some(phase) {
            self.phase = Some((phase, self.newest_tick));
            // Nobody mounts anything on a handle that has force, nor holds it for nothing when all is done. A subject
            // who had done everything before had no force here.
            let has_ended = self.is_done() && before.is_some();
            let lets_go = self.session.mounting().is_some() || has_ended;
            if lets_go && daemon.rig().is_some_and(|rig| rig.state.is_live()) {
                intents.push(Intent::Release);
            }
            if has_ended {
                intents.extend(scene_before.put_back(daemon));
            }
            if self.is_done() && self.is_begun {
                intents.push(Intent::Lease { timeout_ms: 0 });
            }
        }
        intents
    }

    /// The scene of the next trial, once: the trial before it is on the disk.
    pub(super) fn scene_due(&mut self, daemon: &DaemonMirror, scene_before: &mut SceneBefore) -> Option<Intent> {
        let if_revision = daemon
            .revision()
            .filter(|_| self.is_begun && what_is_missing(daemon).is_none() && !self.is_done())?;
        let scene = scene_before.keep(daemon).then(|| self.session.take_scene())??;
        Some(Intent::TrialScene {
            scene: Box::new(scene),
            if_revision,
            ramp_ms: RAMP_MS,
        })
    }

    /// Keeps the lease while the subject is at work, once a second.
    pub(super) fn lease(&self) -> Option<Intent> {
        (self.is_begun && !self.is_done()).then_some(Intent::Lease { timeout_ms: LEASE_MS })
    }

    /// Where the study is, for the experimenter.
    pub(super) fn stage(&self, daemon: &DaemonMirror) -> Stage {
        let held = |why: &str| Stage::Held {
            why: why.to_owned(),
            is_trouble: false,
        };
        if self.is_done() {
            return Stage::Finished;
        }
        match self.session.interruption() {
            Some(Interruption::Paused) => return held("Paused: the trial that was broken off is done again"),
            Some(why) => {
                let is_live = daemon.rig().is_some_and(|rig| rig.state.is_live());
                let first = if is_live {
                    "Go on".to_owned()
                } else {
                    format!("{} the rig again, then go on", sentence_case(engage(daemon)))
                };
                return Stage::Held {
                    // What to do is first: a narrow window cuts the end.
                    why: format!("{first}: the trial is done again. Interrupted: {why}"),
                    is_trouble: true,
                };
            }
            None => {}
        }
        if !self.is_begun {
            return held(if daemon.rig().is_some_and(|rig| rig.state.is_live()) {
                "Ready: show the subject's screen, then press the button below"
            } else {
                "Ready: show the subject's screen, engage the rig, then press the button below"
            });
        }
        if let Some(mounting) = self.session.mounting() {
            return held(&match mounting {
                Mounting::Mount(resistance) => format!("Mount the block of `{resistance}` on the handle, then go on"),
                Mounting::TakeOff => "Take the mounted block off the handle, then go on".to_owned(),
            });
        }
        if let Some(why) = what_is_missing(daemon) {
            return Stage::Waiting { what: why.to_owned() };
        }
        let what = match self.session.view().phase {
            Phase::GetReady if daemon.rig().is_none_or(|rig| rig.state != RigState::Engaged) => {
                return Stage::Waiting {
                    what: format!("Waiting for the rig: {} it in the top bar", engage(daemon)),
                };
            }
            Phase::GetReady | Phase::Wait => "The scene changes".to_owned(),
            Phase::Instruction(_) => "The subject reads the instructions".to_owned(),
            Phase::Rest { remaining_s } => format!("The subject rests: {remaining_s} s are left"),
            Phase::Targets(targets) if targets.is_start => "A click on the first target begins the segment".to_owned(),
            Phase::Targets(_) => "The subject moves to the target".to_owned(),
            Phase::Feel(surface) => format!("The subject feels surface {surface}"),
            Phase::Question => "The subject is asked".to_owned(),
            Phase::Mounting | Phase::Paused | Phase::Done => String::new(),
        };
        Stage::Running { what }
    }
}

/// What a person does so that force flows.
fn engage(daemon: &DaemonMirror) -> &'static str {
    if daemon.rig().is_some_and(|rig| is_halted(rig.state)) {
        "reset, then engage"
    } else {
        "engage"
    }
}

/// What a session waits for: a daemon that has reported what it needs, and a rig that moves along a line.
pub(super) fn what_is_missing(daemon: &DaemonMirror) -> Option<&'static str> {
    let status = daemon.status.as_ref();
    let is_known = daemon.revision().is_some() && daemon.rate_hz.is_some();
    match status.filter(|_| is_known).map(|status| status.device.axes) {
        None => Some("Waiting for the daemon"),
        Some(1) => None,
        Some(_) => Some("Waiting for a rig of one axis: a study is along a line, and this rig has two"),
    }
}

/// The rig as a study's files need it; none before the daemon has described its parts.
pub(super) fn description(daemon: &DaemonMirror) -> Option<RigDescription> {
    let status = daemon.status.as_ref().filter(|_| daemon.is_connected())?;
    Some(RigDescription {
        server: status.server.clone(),
        device: status.device.description.clone(),
        loop_rate_hz: daemon.rate_hz?,
        servo: daemon.servo.clone(),
        configuration: serde_json::to_value(status).ok(),
        click_buttons: click_buttons(daemon),
    })
}

/// The rig's buttons that click, a bit each: all but those that stop and enable.
fn click_buttons(daemon: &DaemonMirror) -> u8 {
    let settings = daemon.servo.as_ref().map(|servo| &servo.settings);
    let taken = settings
        .into_iter()
        .flat_map(|settings| [settings.stop_button, settings.enable_button]);
    let bit = |button: u8| 1_u8.checked_shl(button.into()).unwrap_or(0);
    !taken.flatten().fold(0, |taken, button| taken | bit(button))
}

/// The scene before the study's first change, and the revision of the study's newest.
#[derive(Debug, Default)]
pub(super) struct SceneBefore {
    kept: Option<Scene>,
    own_revision: Option<u64>,
}

impl SceneBefore {
    /// Keeps the active scene, unless one is kept; returns whether one is.
    pub(super) fn keep(&mut self, daemon: &DaemonMirror) -> bool {
        if self.kept.is_none() {
            self.kept = daemon.active_scene().cloned();
        }
        self.kept.is_some()
    }

    /// Takes an update: the revisions of the study's own changes.
    pub(super) fn take(&mut self, update: &Update) {
        if let Update::Answered {
            intent: Intent::TrialScene { .. },
            result: Ok(Answer::Changed(reply)),
        } = update
            && self.kept.is_some()
        {
            self.own_revision = Some(reply.revision);
        }
    }

    /// The change back, once; none where the study has changed nothing, or another client has changed the scene since.
    pub(super) fn put_back(&mut self, daemon: &DaemonMirror) -> Option<Intent> {
        let (kept, own_revision) = (self.kept.take(), self.own_revision.take());
        let if_revision = own_revision.filter(|own| daemon.revision() == Some(*own))?;
        Some(Intent::TrialScene {
            scene: Box::new(kept?),
            if_revision,
            ramp_ms: RAMP_MS,
        })
    }
}
