//! Commands to the real-time thread: admitted, sent, answered, and withdrawn if their client is
//! gone. Stops: raised at once, and confirmed when the device has taken the zero force.

use super::{RigHandle, exclusive_use};
use crate::control::admission::{self, Admission, Purpose};
use crate::control::journal::Completion;
use crate::control::judge;
use crate::control::peer::Requester;
use crate::rt::handoff::{Outcome, StopConfirmation, Stopped};
use crate::rt::inbox::{RigSetup, SentCommand};
use haptic_core::limiter::Limits;
use haptic_core::servo::Command;
use haptic_ipc::{ErrorCode, JournalEntry, Peer, RigState, StateChange, WireError};

/// What had happened before a request was read: what comes later wins over it.
#[derive(Clone, Copy, Debug)]
pub(in crate::control) struct ReadAfter {
    /// Stops, with the request's own.
    pub(in crate::control) stops: u64,
    /// Times that the lease of its client had lapsed.
    pub(in crate::control) lapses: u64,
}

/// Who has a command carried out.
#[derive(Clone, Copy, Debug)]
pub(in crate::control) enum Asked<'a> {
    /// A client.
    By(&'a Peer),
    /// The daemon itself, and why.
    Because(&'a str),
    /// The end of a lease, and why.
    ByLapse(&'a str),
}

/// Withdraws a command when nobody waits for its answer any more, and enters its outcome into the
/// journal. After the answer there is nothing to withdraw.
struct WithdrawOnDrop<'a> {
    rig: &'a RigHandle,
    serial: u64,
    command: Command,
    before: RigState,
    asked: Asked<'a>,
}

impl Drop for WithdrawOnDrop<'_> {
    fn drop(&mut self) {
        self.rig.channel.shared.withdraw(self.serial);
        let outcome = self.rig.channel.exchange().command(self.serial);
        let Some(outcome) = outcome.filter(|outcome| !outcome.refused) else {
            return;
        };
        if self.command == Command::Engage {
            self.rig.channel.engaged_at.set(outcome.tick);
        }
        let (by, message) = match self.asked {
            Asked::By(peer) => (Some(peer.clone()), None),
            Asked::Because(why) | Asked::ByLapse(why) => (None, Some(why.to_owned())),
        };
        let change = StateChange {
            before: self.before,
            after: outcome.state,
        };
        let (mut tick, mut state) = (outcome.tick, change);
        if self.command == Command::Release {
            // The loop may have seen a lapse first, in an earlier tick; and a rig without force has nothing to let out.
            let is_late = matches!(self.asked, Asked::ByLapse(_)) && change.before == change.after;
            let Some(released) = self.rig.journal.borrow_mut().release(is_late, (tick, state)) else {
                return;
            };
            (tick, state) = released;
        }
        let entry = JournalEntry {
            tick: Some(tick),
            by,
            message,
            state: Some(state),
            ..JournalEntry::of(self.command.name())
        };
        self.rig.enter(Completion::Done, entry);
    }
}

impl RigHandle {
    /// Engages the rig for a client: with a scene that would chatter only if it is to be `anyway`. A stop or a lapse of
    /// the client's lease since the request was read wins over it.
    ///
    /// # Errors
    /// The rig's state does not allow it, its scene would chatter, the lease of the client has expired meanwhile, or
    /// the real-time thread does not answer.
    pub(in crate::control) async fn engage(
        &self,
        anyway: bool,
        read_after: ReadAfter,
        by: Requester<'_>,
    ) -> Result<Outcome, WireError> {
        let admission = admission::admit(self, Purpose::Scene).await?;
        let _engaging = self.channel.begin_engaging();
        // Whatever the scene is like, the rig has to be reset first.
        self.pump();
        let state = self.channel.state();
        if state != RigState::Disconnected
            && let Some(refusal) = self.refusal_in(state, "engage")
        {
            return Err(refusal);
        }
        if !anyway {
            self.refuse_chatter(&admission).await?;
        }
        if self.leases.lapses(by.session) != read_after.lapses {
            let message = "cannot engage: the lease of this client has expired since it asked";
            return Err(WireError::new(ErrorCode::WrongState, message).about("state"));
        }
        if self.leases.has_lapsed(by.session) {
            let message = "cannot engage: the lease of this client has lapsed: ask for `lease` again first, or for one of \
                           timeout_ms = 0, which is none";
            return Err(WireError::new(ErrorCode::WrongState, message).about("state"));
        }
        self.carry_out(Command::Engage, admission, read_after.stops, Asked::By(by.peer))
            .await
    }

    /// Engages the rig by the daemon itself.
    ///
    /// # Errors
    /// As [`Self::engage`].
    pub(crate) async fn engage_because(&self, why: &str) -> Result<Outcome, WireError> {
        let stops_known = self.channel.stops();
        let admission = admission::admit(self, Purpose::Scene).await?;
        let _engaging = self.channel.begin_engaging();
        self.refuse_chatter(&admission).await?;
        self.carry_out(Command::Engage, admission, stops_known, Asked::Because(why))
            .await
    }

    /// Judges the newest scene and those that are scheduled, until they are still the same after that.
    async fn refuse_chatter(&self, admission: &Admission) -> Result<(), WireError> {
        // Without a device the loop refuses by its state, and nothing is known of the rig.
        if admission.connection == 0 {
            return Ok(());
        }
        let mut judged = Vec::new();
        loop {
            let to_come = self.scenes_to_come();
            if judged == to_come {
                return Ok(());
            }
            let refused = judge::refuse_chatter(&self.known, &to_come, "engage").await;
            refused.map_err(|(_, error)| error)?;
            judged = to_come;
        }
    }

    /// Releases the rig by the daemon itself.
    ///
    /// # Errors
    /// As [`Self::carry_out`].
    pub(crate) async fn release_because(&self, why: &str) -> Result<Outcome, WireError> {
        let stops_known = self.channel.stops();
        self.carry_out(Command::Release, Admission::NONE, stops_known, Asked::Because(why))
            .await
    }

    /// Carries out an admitted command. `stops_known` is the count of stops when it was asked for: a command that a
    /// later stop has overtaken is refused.
    ///
    /// # Errors
    /// The rig's state does not allow it, or the real-time thread does not answer.
    pub(in crate::control) async fn carry_out(
        &self,
        command: Command,
        admission: Admission,
        stops_known: u64,
        asked: Asked<'_>,
    ) -> Result<Outcome, WireError> {
        let _turn = self.channel.turn().await;
        let verb = command.name();
        let mut rig = None;
        if command == Command::Engage {
            let is_scene = admission.purpose == Purpose::Scene;
            if is_scene {
                // A client may have taken the rig to itself since the admission.
                exclusive_use::refuse_others(self, verb)?;
            }
            self.channel.refuse_at_end()?;
            let setup = self.known.setup();
            rig = Some(RigSetup {
                // A pulse is to move the rig as it is.
                compensation: setup.compensation.filter(|_| is_scene),
                ..setup
            });
        }
        // The turn may have come late, and what nobody asked for comes without a request's pump.
        self.pump();
        let before = self.channel.state();
        let serial = self.channel.next_serial();
        let sent = SentCommand {
            serial,
            command,
            stops_known,
            connection: admission.connection,
            is_of_lapse: matches!(asked, Asked::ByLapse(_)),
        };
        self.channel.send_command(sent, rig)?;
        // A command that is abandoned here must not be carried out later.
        let withdraw = WithdrawOnDrop {
            rig: self,
            serial,
            command,
            before,
            asked,
        };
        let outcome = self.done(serial, Some(withdraw)).await?;
        if !outcome.refused {
            return Ok(outcome);
        }
        let is_overtaken = command == Command::Reset && outcome.state == RigState::Stopped;
        if !is_overtaken && let Some(refusal) = self.refusal_in(outcome.state, verb) {
            return Err(refusal);
        }
        let (code, hint) = if is_overtaken {
            (ErrorCode::Stopped, "another stop came in between")
        } else if admission.connection != self.known.connection() {
            (
                ErrorCode::WrongState,
                "another device was connected in between; try again",
            )
        } else {
            (ErrorCode::WrongState, "a stop came in between")
        };
        Err(refused_in(outcome.state, code, verb, hint))
    }

    /// The refusal of a rig that is stopped, faulted or disconnected to do something; of no other.
    pub(in crate::control) fn refusal_in(&self, state: RigState, verb: &str) -> Option<WireError> {
        let (code, hint) = match state {
            RigState::Stopped => (ErrorCode::Stopped, "reset it first"),
            RigState::Faulted => {
                let message = format!("cannot {verb} while {}: reset it first", self.faulted());
                return Some(WireError::new(ErrorCode::Faulted, message).about("state"));
            }
            RigState::Disconnected => (
                ErrorCode::WrongState,
                "its device cannot be read; see `haptic-ctl doctor`",
            ),
            _ => return None,
        };
        Some(refused_in(state, code, verb, hint))
    }

    /// That the rig is faulted, and with what.
    pub(in crate::control) fn faulted(&self) -> String {
        let fault = self.feed().newest().and_then(|record| record.fault);
        fault.map_or_else(
            || "the rig is faulted".to_owned(),
            |fault| format!("the rig is faulted ({fault})"),
        )
    }

    /// Waits until a command, or limits, were carried out or refused, and takes all that was recorded by then.
    ///
    /// # Errors
    /// The real-time thread does not answer.
    async fn done(&self, serial: u64, withdraw: Option<WithdrawOnDrop<'_>>) -> Result<Outcome, WireError> {
        let outcome = self.answer(|answers| answers.command(serial)).await?;
        // It comes into the journal before what followed it.
        drop(withdraw);
        self.pump();
        Ok(outcome)
    }

    /// The state of the rig with no command under way, and a guard that keeps commands waiting.
    pub(in crate::control) async fn quiet_state(&self) -> (tokio::sync::MutexGuard<'_, ()>, RigState) {
        let turn = self.channel.turn().await;
        self.pump();
        (turn, self.channel.state())
    }

    /// Gives the loop other limits; returns the first tick with them. Must not be dropped half-way.
    ///
    /// # Errors
    /// The real-time thread does not answer; if it continues, it will take them.
    pub(in crate::control) async fn change_limits(&self, limits: Limits) -> Result<u64, WireError> {
        let _turn = self.channel.turn().await;
        let serial = self.channel.send_limits(limits)?;
        let Outcome { tick, .. } = self.done(serial, None).await?;
        self.channel.limits_taken(&self.facts);
        Ok(tick)
    }

    /// Asks for zero force at once; returns the number of the stop, for [`stopped`](Self::stopped).
    pub(crate) fn raise_stop(&self, by: &Peer) -> u64 {
        let stop = self.channel.stop();
        let before = self.channel.newest().map_or(RigState::Idle, |record| record.state);
        // Even a watcher may stop, again and again: a stop that changes nothing is not entered, so
        // that it cannot push other entries out of the journal.
        let changes_nothing = matches!(before, RigState::Stopped | RigState::Faulted);
        if !changes_nothing && !self.journal.borrow().entries.waits_for_a_stop() {
            let after = RigState::Stopped;
            let entry = JournalEntry {
                by: Some(by.clone()),
                state: Some(StateChange { before, after }),
                ..JournalEntry::of("stop")
            };
            self.enter(Completion::Stopped(stop), entry);
        }
        stop
    }

    /// Waits until a stop has taken the force away; returns its tick and the state after it.
    ///
    /// # Errors
    /// No device is connected to take the zero force, or the real-time thread does not answer.
    pub(crate) async fn stopped(&self, stop: u64) -> Result<(u64, RigState), WireError> {
        let Stopped {
            tick,
            state,
            confirmation,
            ..
        } = self.answer(|answers| answers.stop(stop)).await?;
        let (code, what) = match confirmation {
            StopConfirmation::Confirmed => return Ok((tick, state)),
            StopConfirmation::NoDevice => (ErrorCode::NoDevice, "no device is connected to take the zero force"),
            StopConfirmation::Unconfirmed => (
                ErrorCode::NotConfirmed,
                "the device was sent the zero force and has not confirmed that its motor is off",
            ),
        };
        let message = format!(
            "the rig is {state}, but {what}: if the motor still pulls, cut its power (its own watchdog, if it has one, \
             switches it off)"
        );
        Err(WireError::new(code, message).about("device"))
    }
}

/// The refusal of a state to do something.
pub(in crate::control) fn refused_in(state: RigState, code: ErrorCode, verb: &str, hint: &str) -> WireError {
    WireError::new(code, format!("cannot {verb} while the rig is {state}: {hint}")).about("state")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::control::rig::fixture::rig;
    use crate::rt::outbox::FromLoop;
    use crate::rt::outbox::tests::record;

    /// The answer to the first command, which is there before it is asked for.
    fn done(tick: u64, state: RigState, refused: bool) -> FromLoop {
        let outcome = Outcome { tick, state, refused };
        FromLoop::Done { serial: 1, outcome }
    }

    const RELEASED: StateChange = StateChange {
        before: RigState::Engaged,
        after: RigState::Releasing,
    };

    #[tokio::test]
    async fn journal_has_the_state_before_a_release_nobody_asked_for() {
        let (rig, mut loop_side) = rig();
        loop_side.outbox.push(None, || record(0));
        rig.pump();
        // In a record that nobody has taken yet it is engaged.
        let mut engaged = record(1);
        engaged.state = RigState::Engaged;
        loop_side.outbox.push(None, || engaged);
        loop_side.outbox.send(done(2, RigState::Releasing, false));
        rig.release_because("a lease has lapsed").await.expect("released");
        rig.pump();
        let entry = rig.journal(0, 9).entries.swap_remove(0);
        assert_eq!((&*entry.op, entry.state), ("release", Some(RELEASED)));
    }

    #[tokio::test]
    async fn a_lapse_that_the_loop_saw_first_has_its_tick() {
        let (rig, mut loop_side) = rig();
        for (tick, state) in [(0, RigState::Engaged), (1, RigState::Releasing)] {
            let mut changed = record(tick);
            changed.state = state;
            loop_side.outbox.push(None, || changed);
        }
        loop_side.outbox.send(done(9, RigState::Releasing, false));
        let asked = Asked::ByLapse("a lease has lapsed");
        let released = rig.carry_out(Command::Release, Admission::NONE, 0, asked).await;
        released.expect("released");
        rig.pump();
        let entry = rig.journal(0, 9).entries.swap_remove(0);
        assert_eq!((entry.tick, entry.state), (Some(1), Some(RELEASED)));
    }

    #[tokio::test]
    async fn refusal_of_a_disconnected_rig_names_the_next_step() {
        let (rig, mut loop_side) = rig();
        loop_side.outbox.send(done(2, RigState::Disconnected, true));
        let asked = Asked::Because("a test");
        let refused = rig.carry_out(Command::Engage, Admission::NONE, 0, asked).await;
        let message = refused.expect_err("it is refused").message;
        assert!(
            message.ends_with("its device cannot be read; see `haptic-ctl doctor`"),
            "{message}"
        );
    }
}
