//! Scheduled changes: checked and sent as one, kept until the loop says what became of them, and
//! taken back.
//!
//! All that wait belong to one client, each built on the one before it. So no other change may come
//! between, and taking one back takes back those after it.

use super::RigHandle;
use super::scenes::Compiled;
use crate::control::history::Move;
use crate::control::journal::Completion;
use crate::control::peer::Requester;
use crate::rt::inbox::ToLoop;
use crate::rt::schedule::ScheduledScene;
use crate::rt::shared::{Claim, ClaimState};
use haptic_core::Scene;
use haptic_ipc::quantity::number;
use haptic_ipc::{ErrorCode, JournalEntry, MAX_SCHEDULED_CHANGES, Peer, SceneRamp, ScheduleStatus, WireError};
use std::collections::VecDeque;
use std::rc::Rc;
use std::sync::Arc;

/// Most compiled scenes that wait, in all: a ramp has up to 250, and one takes up to 11 KB.
const MAX_COMPILED: usize = 2000;

/// How long before its tick a change must be asked for, s: until then the loop has surely seen it.
const LEAD_S: f64 = 0.01;

/// How long ahead a change may be scheduled, s.
const FURTHEST_S: f64 = 3600.0;

/// A change to be scheduled.
#[derive(Debug)]
pub(in crate::control) struct NewChange {
    pub(in crate::control) at_tick: u64,
    pub(in crate::control) scene: Rc<Scene>,
    pub(in crate::control) compiled: Compiled,
    /// What it does to the history.
    pub(in crate::control) step: Move,
    /// Its entry in the journal, once it is rendered.
    pub(in crate::control) entry: JournalEntry,
}

impl NewChange {
    /// The first tick after it and its ramp.
    fn over_tick(&self) -> u64 {
        self.at_tick + self.compiled.ramp_ticks.unwrap_or(0).max(1)
    }

    /// Compiled scenes that it holds: itself, and those on the way to it.
    fn count(&self) -> usize {
        1 + self.compiled.steps()
    }

    /// For the loop, and to be kept until the loop has rendered it.
    fn split(self, revision: u64) -> (ToLoop, WaitingChange) {
        let (over_tick, steps, claim) = (self.over_tick(), self.compiled.steps(), Arc::new(Claim::new()));
        let (scene, ramp) = self.compiled.into_parts(revision);
        let sent = ToLoop::Scheduled(ScheduledScene {
            at_tick: self.at_tick,
            scene: Some(scene),
            claim: Arc::clone(&claim),
        });
        let waiting = WaitingChange {
            at_tick: self.at_tick,
            over_tick,
            revision,
            scene: self.scene,
            ramp,
            steps,
            step: self.step,
            entry: self.entry,
            claim,
        };
        (sent, waiting)
    }
}

/// A scheduled change that the loop has not rendered, as far as is known here.
#[derive(Debug)]
struct WaitingChange {
    at_tick: u64,
    over_tick: u64,
    revision: u64,
    scene: Rc<Scene>,
    ramp: Option<SceneRamp>,
    /// Steps of its ramp.
    steps: usize,
    step: Move,
    entry: JournalEntry,
    claim: Arc<Claim>,
}

/// What became of changes that waited.
#[derive(Debug)]
enum Outcome {
    /// The first one is rendered from a tick on.
    Rendered(u64, Box<WaitingChange>),
    /// All of them were dropped, and why.
    Dropped(usize, &'static str),
}

/// The changes that wait.
#[derive(Debug, Default)]
pub(in crate::control) struct Schedule {
    /// Changes that were sent to the loop so far.
    sent: usize,
    waiting: VecDeque<WaitingChange>,
    /// The client whose changes wait.
    session: u64,
    by: Peer,
    /// Whether they stay when that client ends.
    keep: bool,
}

impl Schedule {
    /// The changes that wait for their tick.
    pub(in crate::control) fn status(&self) -> Option<ScheduleStatus> {
        let (first, last) = (self.waiting.front()?, self.waiting.back()?);
        let names = self.waiting.iter().filter_map(|waiting| waiting.entry.schedule.clone());
        let mut names: Vec<String> = names.collect();
        names.dedup();
        Some(ScheduleStatus {
            by: self.by.clone(),
            names,
            waiting: self.waiting.len(),
            next_tick: first.at_tick,
            last_tick: last.at_tick,
        })
    }

    /// Refuses what would come between scheduled changes.
    ///
    /// # Errors
    /// Changes wait for their tick.
    pub(in crate::control) fn refuse(&self, what: &str) -> Result<(), WireError> {
        let Some(ScheduleStatus {
            by,
            waiting,
            next_tick,
            last_tick,
            ..
        }) = self.status()
        else {
            return Ok(());
        };
        let message = format!(
            "cannot {what}: scheduled changes of {by} wait for their tick ({waiting}, from tick {next_tick} to \
             {last_tick}); wait for the last one, or take them back with `haptic-ctl schedule cancel`"
        );
        Err(WireError::new(ErrorCode::Scheduled, message).about("state"))
    }

    /// Checks the ticks of changes, at a tick of a loop of this period, s; the ramp under way takes `ramp_left_s` more.
    fn check_ticks(&self, changes: &[NewChange], now: u64, ramp_left_s: f64, period_s: f64) -> Result<(), WireError> {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "at most an hour of ticks"
        )]
        let ticks = |time_s: f64| (time_s / period_s).ceil() as u64;
        let latest = now + ticks(FURTHEST_S);
        let before = self
            .waiting
            .back()
            .map_or(now + ticks(ramp_left_s), |last| last.over_tick);
        let mut earliest = (now + ticks(LEAD_S) + 1).max(before);
        for change in changes {
            let tick = change.at_tick;
            if !(earliest..=latest).contains(&tick) {
                let message = format!(
                    "at_tick = {tick} is out of range: it must be from {earliest} to {latest}, since the rig is at tick \
                     {now}, needs {} ms to prepare, and a change begins when the one before it, with its ramp, is over",
                    number(LEAD_S * 1e3)
                );
                #[expect(clippy::cast_precision_loss, reason = "ticks are below 2^53")]
                let (value, min, max) = (tick as f64, earliest as f64, latest as f64);
                return Err(WireError::new(ErrorCode::OutOfRange, message)
                    .about("at_tick")
                    .within(value, min, max, "1"));
            }
            earliest = change.over_tick();
        }
        Ok(())
    }

    /// Checks that there is room for changes, of which the loop has given back `decided`: it has room for as many as it
    /// may keep, until they come back.
    fn check_room(&self, changes: &[NewChange], decided: usize) -> Result<(), WireError> {
        let waiting: usize = self.waiting.iter().map(|waiting| 1 + waiting.steps).sum();
        for (what, value, max) in [
            ("changes", changes.len(), MAX_SCHEDULED_CHANGES + decided - self.sent),
            (
                "scenes with the steps of their ramps",
                changes.iter().map(NewChange::count).sum(),
                MAX_COMPILED.saturating_sub(waiting),
            ),
        ] {
            if value > max {
                let message = format!(
                    "{value} {what} are too many: there is room for {max} (at most {MAX_SCHEDULED_CHANGES} changes \
                     and {MAX_COMPILED} compiled scenes may wait in all)"
                );
                #[expect(clippy::cast_precision_loss, reason = "some thousands")]
                let (value, max) = (value as f64, max as f64);
                return Err(WireError::new(ErrorCode::OutOfRange, message)
                    .about("changes")
                    .within(value, 0.0, max, "1"));
            }
        }
        Ok(())
    }

    /// Takes back the changes from one on, and removes them; the loop may have rendered some of them by now.
    fn withdraw(&mut self, first: usize) -> usize {
        let before = self.waiting.len();
        // The last one first: none is rendered whose predecessor was taken back.
        while self.waiting.len() > first
            && self
                .waiting
                .back()
                .is_some_and(|last| last.claim.decide(ClaimState::Withdrawn))
        {
            self.waiting.pop_back();
        }
        before - self.waiting.len()
    }

    /// What became of the first ones that wait, if that is decided.
    fn next_outcome(&mut self) -> Option<Outcome> {
        let why = loop {
            match self.waiting.front()?.claim.state() {
                ClaimState::Open => return None,
                ClaimState::Rendered(tick) => {
                    let rendered = self.waiting.pop_front()?;
                    return Some(Outcome::Rendered(tick, Box::new(rendered)));
                }
                // Those after it build on it.
                ClaimState::Halted => break "the rig was stopped, faulted or disconnected",
                ClaimState::Missed => break "its first change came after its tick",
                ClaimState::Withdrawn => drop(self.waiting.pop_front()),
            }
        };
        let dropped = self.waiting.len();
        self.withdraw(0);
        self.waiting.clear();
        Some(Outcome::Dropped(dropped, why))
    }
}

impl RigHandle {
    /// The revision and the scene that a change builds on: the last one that is scheduled if the
    /// change is scheduled too, else the newest.
    pub(in crate::control) fn base(&self, is_scheduled: bool) -> (u64, Rc<Scene>) {
        let schedule = self.schedule();
        match schedule.waiting.back().filter(|_| is_scheduled) {
            Some(last) => (last.revision, Rc::clone(&last.scene)),
            None => (self.revision(), Rc::clone(&self.scene())),
        }
    }

    /// The newest scene, and those that wait for their tick.
    pub(super) fn scenes_to_come(&self) -> Vec<Rc<Scene>> {
        let newest = Rc::clone(&self.scene());
        let schedule = self.schedule();
        let waiting = schedule.waiting.iter().map(|waiting| Rc::clone(&waiting.scene));
        std::iter::once(newest).chain(waiting).collect()
    }

    /// Checks that changes can be scheduled as they are.
    ///
    /// # Errors
    /// Another client's changes wait, the rig is stopped, faulted or disconnected, a tick is too early
    /// or too late, or there are too many.
    pub(in crate::control) fn check_schedule(&self, session: u64, changes: &[NewChange]) -> Result<(), WireError> {
        let schedule = self.schedule();
        if schedule.session != session {
            schedule.refuse("schedule a change")?;
        }
        if let Some(refusal) = self.refusal_in(self.channel.state(), "schedule a change") {
            return Err(refusal);
        }
        let newest = self.channel.newest();
        let now = newest.map_or(0, |record| record.tick);
        let ramp_left_s = self.history().ramp_left_s(newest.as_ref());
        schedule.check_ticks(changes, now, ramp_left_s, self.facts.period_s())?;
        schedule.check_room(changes, self.channel.exchange().decided)
    }

    /// Schedules changes: all of them, or none. Returns the revision of the first one.
    ///
    /// # Errors
    /// As [`check_schedule`](Self::check_schedule), or another change was made since `base_revision`.
    pub(in crate::control) fn schedule_changes(
        &self,
        by: Requester<'_>,
        keep: bool,
        base_revision: u64,
        changes: Vec<NewChange>,
    ) -> Result<u64, WireError> {
        self.check_schedule(by.session, &changes)?;
        if self.base(true).0 != base_revision {
            let message = "the scene was changed while the schedule was prepared: try again";
            return Err(WireError::new(ErrorCode::Conflict, message).about("at_tick"));
        }
        let numbered = (base_revision + 1..).zip(changes);
        let (sent, waiting): (Vec<_>, Vec<_>) = numbered.map(|(revision, change)| change.split(revision)).unzip();
        if !self.channel.inbox.borrow_mut().send_all(sent) {
            let message = "the real-time thread takes no further changes: cancel the schedule and try again";
            return Err(WireError::new(ErrorCode::NotResponding, message));
        }
        let mut schedule = self.schedule.borrow_mut();
        schedule.sent += waiting.len();
        schedule.keep = keep || (schedule.keep && !schedule.waiting.is_empty());
        schedule.waiting.extend(waiting);
        (schedule.session, schedule.by) = (by.session, by.peer.clone());
        Ok(base_revision + 1)
    }

    /// Takes back what waits of a schedule and of those after it, or everything; returns the number of
    /// changes. `None` if no schedule has this name.
    pub(in crate::control) fn cancel_schedule(
        &self,
        name: Option<&str>,
        by: Option<&Peer>,
        why: &str,
    ) -> Option<usize> {
        let cancelled = {
            let mut schedule = self.schedule.borrow_mut();
            let is_named = |waiting: &WaitingChange| waiting.entry.schedule.as_deref() == name;
            let first = match name {
                Some(_) => schedule.waiting.iter().position(is_named)?,
                None => 0,
            };
            schedule.withdraw(first)
        };
        self.settle_schedule();
        if cancelled > 0 {
            self.enter_cancelled(cancelled, by, why);
        }
        Some(cancelled)
    }

    /// Takes back what a client has scheduled, now that it has ended, unless its schedule is kept.
    pub(in crate::control) fn end_schedule_of(&self, session: u64, why: &str) {
        let is_over = self.schedule().session == session && !self.schedule().keep;
        if is_over {
            self.cancel_schedule(None, None, why);
        }
    }

    /// Enters what has become of scheduled changes into the history and the journal.
    pub(super) fn settle_schedule(&self) {
        loop {
            let outcome = self.schedule.borrow_mut().next_outcome();
            match outcome {
                None => return,
                Some(Outcome::Rendered(tick, rendered)) => self.enter_rendered(tick, *rendered),
                Some(Outcome::Dropped(dropped, why)) => self.enter_cancelled(dropped, None, why),
            }
        }
    }

    fn enter_rendered(&self, tick: u64, rendered: WaitingChange) {
        let given = self.history_mut().moved(rendered.step, rendered.scene);
        debug_assert_eq!(given, rendered.revision, "nothing came between");
        self.history_mut().keep_ramp(rendered.ramp, rendered.steps);
        let entry = JournalEntry {
            tick: Some(tick),
            ..rendered.entry
        };
        self.enter(Completion::Done, entry);
    }

    /// Enters that changes were taken back.
    fn enter_cancelled(&self, cancelled: usize, by: Option<&Peer>, why: &str) {
        let op = if by.is_some() {
            "schedule.cancel"
        } else {
            "schedule_cancelled"
        };
        let message = format!("scheduled changes were cancelled ({cancelled}): {why}");
        self.enter_done(op, by, Some(message));
    }
}

#[cfg(test)]
mod tests;
