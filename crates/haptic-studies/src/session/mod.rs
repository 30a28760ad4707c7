//! A subject's session: the [targeting task](super::fitts) or the [perception tests](super::perception) with everything
//! around the trials. It is fed with the daemon's ticks, and knows no daemon, no file and no screen.
//!
//! ```text
//! Instruction, Rest, Mounting --proceed--> GetReady --scene rendered, rig engaged--> trials --segment over--> Rest ... Done
//!                                             ^                                        |
//!                                             +------- proceed ------- Paused <--------+
//!                                                   pause, stop, fault, lost tick, foreign change of the scene
//! ```
//!
//! The caller gives it every tick ([`row`](Session::row)), clicks and answers with the tick at which they came,
//! renders the scenes that it asks for ([`take_scene`](Session::take_scene), [`rendered`](Session::rendered)), shows
//! its [`View`], and puts what becomes final on the disk ([`take_news`](Session::take_news)) before the next batch of ticks.

use crate::trial::{FittsTrial, Operator, PerceptionTrial, VoidedTrial};
mod active_scene;
mod stage;
mod task;
mod ticks;
mod view;

pub use stage::Interruption;
pub use task::Task;
pub use ticks::{Frame, Ticks};
pub use view::{Feedback, Instruction, Phase, View};

use super::fitts::Event;
pub use super::fitts::Targets;
use super::perception::Answer;
use super::subject::Subject;
use active_scene::ActiveScene;
use haptic_core::Scene;
use haptic_ipc::{RigState, Sample, ServoSetup};
use haptic_recording::Mark;
use stage::{Stage, stages};
use std::collections::VecDeque;
use ticks::{RecentTicks, buttons};

/// A longer trial is void, s: a person has turned away, and its recording would fill the memory.
const MAX_TRIAL_S: f64 = 120.0;

/// Time after a rig's force has ended within which it says why, s.
const REASON_S: f64 = 0.05;

/// How long feedback is shown, s.
const FEEDBACK_S: f64 = 0.3;

/// A session's circumstances.
#[derive(Clone, Debug)]
pub struct Settings {
    /// Who does it.
    pub operator: Operator,
    /// Time of a tick, s.
    pub period_s: f64,
    /// The rig's buttons that click, a bit each.
    pub click_buttons: u8,
    /// The servo's settings, where they are known.
    pub servo: Option<ServoSetup>,
    /// Attempts at the first trial that were voided before.
    pub voided: u32,
}

/// What the experimenter does at the handle before the session continues.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Mounting {
    /// Mount the real block of this resistance.
    Mount(String),
    /// Take it off.
    TakeOff,
}

/// A subject's session.
#[derive(Debug)]
pub struct Session {
    task: Task,
    subject: Subject,
    settings: Settings,
    stage: Stage,
    /// The stages after this one, up to the next trial.
    coming: VecDeque<Stage>,
    is_mounted: bool,
    active: ActiveScene,
    recent: RecentTicks,
    ticks: Option<Ticks>,
    /// The frames of the trial under way.
    frames: Vec<Frame>,
    /// And for how many ticks more.
    feedback: Option<(Feedback, f64)>,
    news: VecDeque<News>,
    /// The newest state that the rig reported, and its fault.
    reported: Option<(RigState, Option<String>)>,
    /// The reason of the interruption may still come, within so many ticks once the force has ended: a rig that
    /// releases into a fault names it at the end. A void attempt waits for it.
    open_reason: Option<f64>,
}

impl Session {
    /// A session that continues where the task is.
    #[must_use]
    pub fn new(task: Task, subject: &Subject, settings: Settings) -> Self {
        let mut session = Self {
            task,
            subject: subject.clone(),
            settings,
            stage: Stage::Done,
            coming: VecDeque::new(),
            is_mounted: false,
            active: ActiveScene::Unknown,
            recent: RecentTicks::default(),
            ticks: None,
            frames: Vec::new(),
            feedback: None,
            news: VecDeque::new(),
            reported: None,
            open_reason: None,
        };
        session.plan_stages(None);
        session
    }

    /// The task, for the experimenter.
    #[must_use]
    pub fn task(&self) -> &Task {
        &self.task
    }

    /// What the experimenter does at the handle, while the view's phase is [`Phase::Mounting`].
    #[must_use]
    pub fn mounting(&self) -> Option<Mounting> {
        let is_due = self.stage == Stage::Mounting;
        let mounting = || match self.task.mounted() {
            Some(resistance) => Mounting::Mount(resistance.to_owned()),
            None => Mounting::TakeOff,
        };
        is_due.then(mounting)
    }

    /// Why it is interrupted, while it is.
    #[must_use]
    pub fn interruption(&self) -> Option<&Interruption> {
        match &self.stage {
            Stage::Paused(why) => Some(why),
            _ => None,
        }
    }

    /// Whether all trials are done.
    #[must_use]
    pub fn is_done(&self) -> bool {
        self.stage == Stage::Done
    }

    /// Whether an attempt at a trial is under way, which an interruption voids.
    #[must_use]
    pub fn is_in_trial(&self) -> bool {
        self.stage == Stage::Running && self.task.is_in_trial()
    }

    /// What the subject's screen shows.
    #[must_use]
    pub fn view(&self) -> View {
        let (done, of) = self.task.progress();
        let phase = match self.stage {
            Stage::Instruction(instruction) => Phase::Instruction(instruction),
            Stage::Mounting => Phase::Mounting,
            Stage::Rest(ticks) => Phase::Rest {
                remaining_s: whole_seconds(ticks * self.settings.period_s),
            },
            Stage::GetReady => Phase::GetReady,
            Stage::Paused(_) => Phase::Paused,
            Stage::Done => Phase::Done,
            Stage::Running => Phase::of(&self.task),
        };
        View {
            phase,
            is_practice: self.task.is_practice(),
            done,
            of,
            feedback: self.feedback.map(|(feedback, _)| feedback),
        }
    }

    /// Whether it continues by [`proceed`](Self::proceed) alone.
    #[must_use]
    pub fn waits_for_consent(&self) -> bool {
        !matches!(self.stage, Stage::Running | Stage::GetReady | Stage::Done)
    }

    /// Goes on: from instructions, from a break, after mounting, after an interruption.
    pub fn proceed(&mut self) {
        if !self.waits_for_consent() {
            return;
        }
        self.close_reason();
        if self.stage == Stage::Mounting {
            self.is_mounted = self.task.mounted().is_some();
        }
        self.stage = self.coming.pop_front().unwrap_or(Stage::GetReady);
    }

    /// Pauses. A trial under way is void.
    pub fn pause(&mut self) {
        self.interrupt(Interruption::Paused);
    }

    /// Interrupts where a trial, or the wait for one, is under way.
    pub fn interrupt(&mut self, why: Interruption) {
        if !matches!(self.stage, Stage::Running | Stage::GetReady) {
            return;
        }
        if self.is_in_trial() {
            let is_practice = self.task.is_practice();
            self.settings.voided += 1;
            self.news.push_back(News::Voided(VoidedTrial {
                operator: self.settings.operator,
                subject: self.subject.code.clone(),
                session: self.subject.session,
                practice: is_practice,
                row: self.task.rows(is_practice) + 1,
                tick: self.recent.newest().map_or(0, |row| row.tick),
                reason: why.to_string(),
            }));
        }
        self.task.pause();
        self.forget_trial();
        self.ticks = None;
        if let Interruption::State(RigState::Releasing | RigState::Stopped | RigState::Faulted, None) = &why {
            self.open_reason = Some(REASON_S / self.settings.period_s);
        }
        self.stage = Stage::Paused(why);
        self.tell_reason();
    }

    /// Puts the reported fault in place of an open reason.
    fn tell_reason(&mut self) {
        if self.open_reason.is_some()
            && let Some((state @ (RigState::Stopped | RigState::Faulted), fault)) = &self.reported
        {
            let why = Interruption::State(*state, fault.clone());
            if let Some(News::Voided(voided)) = self.news.back_mut() {
                voided.reason = why.to_string();
            }
            self.stage = Stage::Paused(why);
            self.open_reason = None;
        }
    }

    /// Ends the wait for the reason of an interruption.
    pub fn close_reason(&mut self) {
        self.open_reason = None;
    }

    /// Says that the daemon was started again, or the connection to it re-established: ticks and revisions begin again.
    pub fn new_link(&mut self) {
        // At the start target, too: the rig may render another scene by now.
        if self.stage == Stage::Running {
            self.interrupt(Interruption::NewLink);
        }
        self.close_reason();
        self.active = ActiveScene::Unknown;
        self.recent = RecentTicks::default();
        self.ticks = None;
    }

    /// The scene that the rig is to change to, once; none where it is active, or on its way. Not for the subject.
    pub fn take_scene(&mut self) -> Option<Scene> {
        if !matches!(self.stage, Stage::Running | Stage::GetReady) {
            return None;
        }
        let scene = self.task.scene()?;
        self.active.request(&scene).then_some(scene)
    }

    /// Says that the scene that was taken is active with this revision, and from this tick on rendered alone: no ramp
    /// from the scene before is under way any more.
    pub fn rendered(&mut self, revision: u64, whole_tick: u64) {
        self.active.rendered(revision, whole_tick);
    }

    /// Says that the scene that was taken could not be set. It is asked for again after [`proceed`](Self::proceed).
    pub fn refused(&mut self, why: &str) {
        self.active = ActiveScene::Unknown;
        self.interrupt(Interruption::SceneRefused(why.to_owned()));
    }

    /// Takes a change of scene, state or settings for the recording.
    pub fn mark(&mut self, mark: Mark) {
        match &mark {
            Mark::Servo { servo, .. } => self.settings.servo = Some((**servo).clone()),
            Mark::State { state, fault, .. } => {
                self.reported = Some((*state, fault.clone()));
                self.tell_reason();
            }
            _ => {}
        }
        if let Some(ticks) = &mut self.ticks {
            ticks.marks.push(mark);
        }
    }

    /// Takes a frame that showed the cursor.
    pub fn frame(&mut self, frame: Frame) {
        if self.is_in_trial() {
            self.frames.push(frame);
        }
    }

    /// Takes what the caller shall put on the disk, oldest first. Give no other batch of ticks before it is there.
    pub fn take_news(&mut self) -> Option<News> {
        let waits = self.open_reason.is_some() && matches!(self.news.front(), Some(News::Voided(_)));
        if waits { None } else { self.news.pop_front() }
    }

    /// Takes a tick.
    pub fn row(&mut self, row: &Sample) {
        let before = self.recent.newest().copied();
        if let Some(why) = self.wrong(before.as_ref(), row) {
            self.interrupt(why);
        }
        if before.is_some_and(|before| before.tick >= row.tick) {
            self.new_link();
        }
        if self.active.is_foreign(row) {
            self.active = ActiveScene::Unknown;
        }
        self.recent.push(row);
        self.record(row);
        if row.state != RigState::Releasing {
            let left = self.open_reason.map(|ticks| ticks - 1.0);
            self.open_reason = left.filter(|ticks| *ticks > 0.0);
        }
        if let Stage::Rest(ticks) = &mut self.stage {
            *ticks = (*ticks - 1.0).max(0.0);
        }
        self.feedback = self
            .feedback
            .and_then(|(feedback, ticks)| (ticks > 1.0).then_some((feedback, ticks - 1.0)));
        if self.stage == Stage::GetReady && row.state == RigState::Engaged && self.is_rendered(row) {
            self.task.begin(row.tick);
            self.stage = Stage::Running;
        }
        if self.stage == Stage::Running {
            // A surface that is late makes the gap before it longer.
            let is_late = self.task.is_between_surfaces() && !self.is_rendered(row);
            if let Task::Perception(task) = &mut self.task
                && !is_late
            {
                task.step(row.tick);
            }
            let pressed = buttons(row) & !before.as_ref().map_or(0, buttons);
            let is_clicked = self.recent.take_click();
            if is_clicked || pressed & self.settings.click_buttons != 0 {
                self.click_in(row.tick);
            }
        }
    }

    /// Whether a tick renders the task's scene alone.
    fn is_rendered(&self, row: &Sample) -> bool {
        self.task.scene().is_some_and(|scene| self.active.is_whole(&scene, row))
    }

    /// What is wrong with a tick for the trial under way, or for the target that a segment starts from.
    fn wrong(&self, before: Option<&Sample>, row: &Sample) -> Option<Interruption> {
        if self.stage != Stage::Running {
            return None;
        }
        let missing = before.map_or(0, |before| row.tick.saturating_sub(before.tick).saturating_sub(1));
        if self.task.is_in_trial() && missing > 0 {
            return Some(Interruption::LostTicks(missing));
        }
        if before.is_some_and(|before| before.tick >= row.tick) {
            return Some(Interruption::NewLink);
        }
        if row.state != RigState::Engaged {
            return Some(Interruption::State(row.state, None));
        }
        if self.active.is_foreign(row) {
            let revision = row.revision;
            return Some(Interruption::SceneChanged { revision });
        }
        let is_long = |ticks: &Ticks| ticks.rows.len() as f64 * self.settings.period_s > MAX_TRIAL_S;
        let is_too_long = self.task.is_in_trial() && self.ticks.as_ref().is_some_and(is_long);
        is_too_long.then_some(Interruption::TooLong { limit_s: MAX_TRIAL_S })
    }

    /// Keeps a tick for the recording of the trial that is under way or comes next. A recording begins once the scene
    /// is active, so that what holds at its beginning is known.
    fn record(&mut self, row: &Sample) {
        if !matches!(self.stage, Stage::Running | Stage::GetReady) {
            self.ticks = None;
            return;
        }
        if self.ticks.is_none()
            && let Some((scene, revision)) = self.active.whole(row)
        {
            self.ticks = Some(Ticks::new(scene.clone(), revision, self.settings.servo.clone()));
        }
        let Some(ticks) = &mut self.ticks else { return };
        ticks.rows.push(*row);
        // Nobody knows how long a subject waits before a segment: the last half of a minute is enough.
        if !self.task.is_in_trial() && ticks.rows.len() as f64 * self.settings.period_s > 60.0 {
            let middle = ticks.rows[ticks.rows.len() / 2].tick;
            drop(ticks.split_after(middle));
        }
    }

    /// Takes a click by a mouse or a key at a tick, which may be one that has not come yet. It is judged by the
    /// handle's position in that tick.
    pub fn click(&mut self, tick: u64) {
        if self.recent.click(tick) && self.stage == Stage::Running {
            self.click_in(tick);
        }
    }

    fn click_in(&mut self, tick: u64) {
        let Task::Fitts(task) = &mut self.task else { return };
        let Some(row) = self.recent.at(tick) else { return };
        let tick = row.tick;
        let is_practice = task.segment().is_some_and(|segment| segment.is_practice);
        let feedback = match task.click(tick, row.device_position_m, row.revision) {
            None => return,
            Some(Event::Missed) => Feedback::Missed,
            Some(Event::Started) => {
                self.frames.clear();
                Feedback::Hit
            }
            Some(Event::Hit(mut trial)) => {
                trial.voided = self.settings.voided;
                (trial.cursor_latency_s, trial.cursor_latency_p95_s) = Frame::median_and_p95_s(&self.frames);
                trial.frame_rate_hz = Frame::rate_hz(&self.frames);
                self.finish(TrialRow::Fitts(trial), is_practice, tick);
                Feedback::Hit
            }
        };
        self.show(feedback);
    }

    /// Takes an answer at a tick; without effect where no question is open.
    pub fn answer(&mut self, answer: Answer, tick: u64) {
        let is_practice = self.task.is_practice();
        let Task::Perception(task) = &mut self.task else { return };
        if self.stage != Stage::Running {
            return;
        }
        let Some(mut trial) = task.answer(answer, tick) else {
            return;
        };
        trial.voided = self.settings.voided;
        let feedback = match (is_practice, trial.correct) {
            (false, _) => Feedback::Answered,
            (true, true) => Feedback::Right,
            (true, false) => Feedback::Wrong,
        };
        self.finish(TrialRow::Perception(Box::new(trial)), is_practice, tick);
        self.show(feedback);
    }

    fn show(&mut self, feedback: Feedback) {
        self.feedback = Some((feedback, FEEDBACK_S / self.settings.period_s));
    }

    fn finish(&mut self, row: TrialRow, is_practice: bool, tick: u64) {
        let ticks = self.ticks.as_mut().map(|ticks| ticks.split_after(tick));
        self.news.push_back(News::Finished(Box::new(FinishedTrial {
            row,
            is_practice,
            ticks,
        })));
        self.settings.voided = 0;
        self.forget_trial();
        if self.task.is_ready() || self.task.is_finished() {
            self.plan_stages(Some(is_practice));
        }
    }

    fn forget_trial(&mut self) {
        self.frames.clear();
        self.recent.forget_clicks();
    }

    /// Goes to what comes before the next trial, after one of practice or not; at the beginning after none.
    fn plan_stages(&mut self, after: Option<bool>) {
        self.coming = stages(&self.task, self.is_mounted, after, self.settings.period_s);
        self.stage = self.coming.pop_front().unwrap_or(Stage::Done);
    }

    /// The targeting task, to go back to the beginning of a segment, as a simulated operator does.
    pub(super) fn restart_segment(&mut self) {
        if let Task::Fitts(task) = &mut self.task {
            task.restart_segment();
            self.plan_stages(None);
        }
    }
}

#[expect(clippy::cast_sign_loss, reason = "a break of minutes, and none below 0")]
fn whole_seconds(time_s: f64) -> u32 {
    // Ticks are not a whole number of binary fractions of a second.
    (time_s - 1e-6).ceil() as u32
}

/// The row of a trial.
#[derive(Clone, Debug, PartialEq)]
pub enum TrialRow {
    /// Of the targeting task.
    Fitts(Box<FittsTrial>),
    /// Of the perception tests.
    Perception(Box<PerceptionTrial>),
}

/// A trial that is done.
#[derive(Clone, Debug, PartialEq)]
pub struct FinishedTrial {
    /// Its row.
    pub row: TrialRow,
    /// Whether it is for practice.
    pub is_practice: bool,
    /// Its ticks; none where nobody knows which scene they rendered.
    pub ticks: Option<Ticks>,
}

/// What the disk must get.
#[derive(Clone, Debug, PartialEq)]
pub enum News {
    /// A trial is done.
    Finished(Box<FinishedTrial>),
    /// An attempt at a trial is void.
    Voided(VoidedTrial),
}
