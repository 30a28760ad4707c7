//! Scheduled changes: checked and sent as one, kept until the loop says what became of them, and
//! taken back.
//!
//! All that wait belong to one client, each built on the one before it. So no other change may come
//! between, and taking one back takes back those after it.

use super::RigHandle;
use super::waiting_changes::WaitingChange;
use crate::control::compile::Compiled;
use crate::control::history::Move;
use crate::control::peer::Requester;
use crate::rt::claim::Claim;
use crate::rt::inbox::ToLoop;
use crate::rt::schedule::ScheduledScene;
use haptic_core::Scene;
use haptic_ipc::quantity::number;
use haptic_ipc::{ErrorCode, JournalEntry, MAX_SCHEDULED_CHANGES, Peer, RigState, ScheduleStatus, WireError};
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
        self.at_tick + self.compiled.ramp_ticks().unwrap_or(0).max(1)
    }
}

impl RigHandle {
    /// The revision and the scene that a change builds on: the last one that is scheduled if the
    /// change is scheduled too, else the newest.
    pub(in crate::control) fn base(&self, is_scheduled: bool) -> (u64, Rc<Scene>) {
        self.pump();
        let schedule = self.schedule.borrow();
        match schedule.waiting.back().filter(|_| is_scheduled) {
            Some(last) => (last.revision, Rc::clone(&last.scene)),
            None => (self.revision(), Rc::clone(&self.scene())),
        }
    }

    /// The revision that a scheduled change builds on, as the last call of `pump` found it.
    fn base_revision(&self) -> u64 {
        let last = self.schedule.borrow().waiting.back().map(|last| last.revision);
        last.unwrap_or_else(|| self.revision())
    }

    /// The newest scene, and those that wait for their tick.
    pub(super) fn scenes_to_come(&self) -> Vec<Rc<Scene>> {
        self.pump();
        let newest = Rc::clone(&self.scene());
        let schedule = self.schedule.borrow();
        let waiting = schedule.waiting.iter().map(|waiting| Rc::clone(&waiting.scene));
        std::iter::once(newest).chain(waiting).collect()
    }

    /// The changes that wait for their tick.
    pub(in crate::control) fn schedule_status(&self) -> Option<ScheduleStatus> {
        self.pump();
        self.waiting_status()
    }

    /// The same, as the last call of `pump` found it.
    fn waiting_status(&self) -> Option<ScheduleStatus> {
        let schedule = self.schedule.borrow();
        let (first, last) = (schedule.waiting.front()?, schedule.waiting.back()?);
        let mut names: Vec<String> = schedule
            .waiting
            .iter()
            .filter_map(WaitingChange::name)
            .map(str::to_owned)
            .collect();
        names.dedup();
        Some(ScheduleStatus {
            by: schedule.by.clone(),
            names,
            waiting: schedule.waiting.len(),
            next_tick: first.at_tick,
            last_tick: last.at_tick,
        })
    }

    /// Refuses what would come between scheduled changes.
    ///
    /// # Errors
    /// Changes wait for their tick.
    pub(in crate::control) fn refuse_during_schedule(&self, what: &str) -> Result<(), WireError> {
        self.pump();
        self.refuse_while_waiting(what)
    }

    /// The same, as the last call of `pump` found it.
    fn refuse_while_waiting(&self, what: &str) -> Result<(), WireError> {
        let Some(ScheduleStatus {
            by,
            waiting,
            next_tick,
            last_tick,
            ..
        }) = self.waiting_status()
        else {
            return Ok(());
        };
        let message = format!(
            "cannot {what}: scheduled changes of {by} wait for their tick ({waiting}, from tick {next_tick} to \
             {last_tick}); wait for the last one, or take them back with `schedule.cancel`"
        );
        Err(WireError::new(ErrorCode::Scheduled, message).about("state"))
    }

    /// Checks that changes can be scheduled as they are.
    ///
    /// # Errors
    /// Another client's changes wait, the rig is stopped, faulted or disconnected, a tick is too early
    /// or too late, or there are too many.
    pub(in crate::control) fn check_schedule(&self, session: u64, changes: &[NewChange]) -> Result<(), WireError> {
        self.pump();
        let is_mine = self.schedule.borrow().session == session;
        if !is_mine {
            self.refuse_while_waiting("schedule a change")?;
        }
        let (code, remedy) = match self.state() {
            RigState::Stopped => (ErrorCode::Stopped, "reset it first"),
            RigState::Faulted => (ErrorCode::Faulted, "see `status`, and reset it first"),
            RigState::Disconnected => (ErrorCode::WrongState, "its device cannot be read"),
            _ => {
                self.check_ticks(changes)?;
                return self.check_room(changes);
            }
        };
        let message = format!("cannot schedule a change while the rig is {}: {remedy}", self.state());
        Err(WireError::new(code, message).about("state"))
    }

    fn check_ticks(&self, changes: &[NewChange]) -> Result<(), WireError> {
        let now = self.feed.borrow().newest().map_or(0, |record| record.tick);
        let latest = now + self.ticks(FURTHEST_S);
        let schedule = self.schedule.borrow();
        let waiting = schedule.waiting.back().map_or(0, |last| last.over_tick);
        let mut earliest = (now + self.ticks(LEAD_S) + 1).max(waiting);
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

    fn check_room(&self, changes: &[NewChange]) -> Result<(), WireError> {
        // The loop has room for as many as it may keep, until they come back.
        let decided = self.answers().decided;
        let schedule = self.schedule.borrow();
        let compiled = |changes: &[NewChange]| changes.iter().map(|change| change.compiled.count()).sum::<usize>();
        let waiting: usize = schedule.waiting.iter().map(|waiting| waiting.compiled).sum();
        for (what, value, max) in [
            (
                "changes",
                changes.len(),
                MAX_SCHEDULED_CHANGES + decided - schedule.sent,
            ),
            (
                "scenes with the steps of their ramps",
                compiled(changes),
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

    /// The ticks in a time, s, rounded up.
    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at most an hour of ticks"
    )]
    fn ticks(&self, time_s: f64) -> u64 {
        (time_s / self.facts.period_s()).ceil() as u64
    }

    /// Schedules changes: all of them, or none. Returns the revision of the first one.
    ///
    /// # Errors
    /// As [`check_schedule`](Self::check_schedule), or another change was made since `base_revision`.
    pub(in crate::control) fn schedule(
        &self,
        by: Requester<'_>,
        keep: bool,
        base_revision: u64,
        changes: Vec<NewChange>,
    ) -> Result<u64, WireError> {
        self.check_schedule(by.session, &changes)?;
        if self.base_revision() != base_revision {
            let message = "the scene was changed while the schedule was prepared: try again";
            return Err(WireError::new(ErrorCode::Conflict, message).about("at_tick"));
        }
        let mut schedule = self.schedule.borrow_mut();
        let mut scenes = Vec::with_capacity(changes.len());
        let mut waiting = Vec::with_capacity(changes.len());
        for (revision, change) in (base_revision + 1..).zip(changes) {
            let claim = Arc::new(Claim::new());
            let (over_tick, compiled, ramp) = (
                change.over_tick(),
                change.compiled.count(),
                change.compiled.ramp().cloned(),
            );
            let (scene, path) = change.compiled.into_scene(revision);
            scenes.push(ToLoop::Scheduled(ScheduledScene {
                at_tick: change.at_tick,
                scene: Some(Box::new(scene)),
                claim: Arc::clone(&claim),
            }));
            waiting.push(WaitingChange {
                at_tick: change.at_tick,
                over_tick,
                revision,
                scene: change.scene,
                ramp,
                path,
                step: change.step,
                entry: change.entry,
                compiled,
                claim,
            });
        }
        if !self.inbox.borrow_mut().send_all(scenes) {
            let message = "the real-time thread takes no further changes: cancel the schedule and try again";
            return Err(WireError::new(ErrorCode::NotResponding, message));
        }
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
        self.pump();
        let cancelled = {
            let mut schedule = self.schedule.borrow_mut();
            let first = match name {
                Some(name) => schedule
                    .waiting
                    .iter()
                    .position(|waiting| waiting.name() == Some(name))?,
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
        let is_over = {
            let schedule = self.schedule.borrow();
            schedule.session == session && !schedule.keep
        };
        if is_over {
            self.cancel_schedule(None, None, why);
        }
    }
}

#[cfg(test)]
mod tests;
