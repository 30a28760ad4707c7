//! Commands to the real-time thread: admitted, sent, answered, and withdrawn if their client is
//! gone.

use super::{RigHandle, exclusive_use, rig_friction};
use crate::control::admission::{self, Admission, Purpose};
use crate::control::connected_device::ConnectedDevice;
use crate::control::journal::Completion;
use crate::control::judge;
use crate::control::peer::Requester;
use crate::rt::handoff::Outcome;
use crate::rt::inbox::{RigSetup, SentCommand, ToLoop};
use haptic_core::limiter::Limits;
use haptic_core::servo::Command;
use haptic_ipc::{ErrorCode, JournalEntry, Peer, RigState, StateChange, WireError};

/// Who has a command carried out.
#[derive(Clone, Copy, Debug)]
pub(in crate::control) enum Asked<'a> {
    /// A client.
    By(&'a Peer),
    /// The daemon itself, and why.
    Because(&'a str),
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
        self.rig.shared.withdraw(self.serial);
        let outcome = self.rig.answers().command(self.serial);
        let Some(outcome) = outcome.filter(|outcome| !outcome.refused) else {
            return;
        };
        if self.command == Command::Engage {
            self.rig.engaged_at.set(outcome.tick);
        }
        let (by, message) = match self.asked {
            Asked::By(peer) => (Some(peer.clone()), None),
            Asked::Because(why) => (None, Some(why.to_owned())),
        };
        let entry = JournalEntry {
            tick: Some(outcome.tick),
            by,
            message,
            state: Some(StateChange {
                before: self.before,
                after: outcome.state,
            }),
            ..JournalEntry::of(self.command.name())
        };
        self.rig.enter(Completion::Done, entry);
    }
}

/// As long as it lives a client engages: until the answer every change of the scene is judged as one under force.
struct Engaging<'a>(&'a RigHandle);

impl<'a> Engaging<'a> {
    fn begin(rig: &'a RigHandle) -> Self {
        rig.engaging.set(rig.engaging.get() + 1);
        Self(rig)
    }
}

impl Drop for Engaging<'_> {
    fn drop(&mut self) {
        self.0.engaging.set(self.0.engaging.get() - 1);
    }
}

impl RigHandle {
    /// Carries out a command of a client that brings no force. `stops_known` is the count of
    /// stops when it was asked for: a command that a later stop has overtaken is refused.
    ///
    /// # Errors
    /// The rig's state does not allow it, or the real-time thread does not answer.
    pub(crate) async fn command(
        &self,
        command: Command,
        stops_known: u64,
        by: Requester<'_>,
    ) -> Result<Outcome, WireError> {
        self.carry_out(command, Admission::NONE, stops_known, Asked::By(by.peer))
            .await
    }

    /// Engages the rig for a client: with a scene that would chatter only if it is to be `anyway`. `stops_known` is as
    /// for [`Self::command`].
    ///
    /// # Errors
    /// The rig's state does not allow it, its scene would chatter, the lease of the client has expired meanwhile, or
    /// the real-time thread does not answer.
    pub(crate) async fn engage(&self, anyway: bool, stops_known: u64, by: Requester<'_>) -> Result<Outcome, WireError> {
        let admission = admission::admit(self, Purpose::Scene).await?;
        let _engaging = Engaging::begin(self);
        if !anyway {
            self.refuse_chatter().await?;
        }
        if self.leases().is_absent(by.session) {
            let message = "cannot engage: the lease of this client has expired since it asked";
            return Err(WireError::new(ErrorCode::WrongState, message).about("state"));
        }
        self.carry_out(Command::Engage, admission, stops_known, Asked::By(by.peer))
            .await
    }

    /// Engages the rig by the daemon itself.
    ///
    /// # Errors
    /// As [`Self::engage`].
    pub(crate) async fn engage_because(&self, why: &str) -> Result<Outcome, WireError> {
        let stops_known = self.stops();
        let admission = admission::admit(self, Purpose::Scene).await?;
        let _engaging = Engaging::begin(self);
        self.refuse_chatter().await?;
        self.carry_out(Command::Engage, admission, stops_known, Asked::Because(why))
            .await
    }

    /// Judges the newest scene and those that are scheduled, until they are still the same after that.
    async fn refuse_chatter(&self) -> Result<(), WireError> {
        let mut judged = Vec::new();
        loop {
            let to_come = self.scenes_to_come();
            if judged == to_come {
                return Ok(());
            }
            let refused = judge::refuse_chatter(self, &to_come, "engage").await;
            refused.map_err(|(_, error)| error)?;
            judged = to_come;
        }
    }

    /// Whether force flows, or may in the next ticks.
    pub(in crate::control) fn may_have_force(&self) -> bool {
        let (state, tick) = {
            let feed = self.feed();
            (feed.state(), feed.newest().map_or(0, |record| record.tick))
        };
        // The answer to a command may come before the record of its tick.
        state.is_live() || self.engaging.get() > 0 || tick < self.engaged_at.get()
    }

    /// Releases the rig by the daemon itself.
    ///
    /// # Errors
    /// As [`Self::command`].
    pub(crate) async fn release_because(&self, why: &str) -> Result<Outcome, WireError> {
        self.carry_out(Command::Release, Admission::NONE, self.stops(), Asked::Because(why))
            .await
    }

    /// Sends an admitted command.
    ///
    /// # Errors
    /// As [`Self::command`].
    pub(in crate::control) async fn carry_out(
        &self,
        command: Command,
        admission: Admission,
        stops_known: u64,
        asked: Asked<'_>,
    ) -> Result<Outcome, WireError> {
        let _turn = self.commanding.lock().await;
        if command == Command::Engage && admission.purpose == Purpose::Scene {
            // A client may have taken the rig to itself since the admission.
            exclusive_use::refuse_others(self, "engage")?;
        }
        if self.closing.get() && command == Command::Engage {
            return Err(WireError::new(ErrorCode::WrongState, "cannot engage: the daemon is ending").about("state"));
        }
        let before = self.state();
        let serial = self.next_serial();
        let rig = (command == Command::Engage).then(|| self.rig_setup(admission.purpose));
        let sent = SentCommand {
            serial,
            command,
            stops_known,
            connection: admission.connection,
        };
        if !self.inbox.borrow_mut().send(ToLoop::Command { sent, rig }) {
            return Err(takes_no_commands(command.name()));
        }
        if rig.is_some() {
            self.sent_setup.set(rig);
        }
        // A command that is abandoned here must not be carried out later.
        let withdraw = WithdrawOnDrop {
            rig: self,
            serial,
            command,
            before,
            asked,
        };
        let outcome = self.answer(|answers| answers.command(serial)).await?;
        drop(withdraw);
        if !outcome.refused {
            return Ok(outcome);
        }
        let verb = command.name();
        let (code, hint) = match outcome.state {
            RigState::Stopped if command == Command::Reset => (ErrorCode::Stopped, "another stop came in between"),
            RigState::Stopped => (ErrorCode::Stopped, "reset it first"),
            RigState::Faulted => (ErrorCode::Faulted, "reset it first"),
            RigState::Disconnected => (ErrorCode::WrongState, "its device cannot be read"),
            _ if admission.connection != self.connection() => (
                ErrorCode::WrongState,
                "another device was connected in between; try again",
            ),
            _ => (ErrorCode::WrongState, "a stop came in between"),
        };
        Err(WireError::new(
            code,
            format!("cannot {verb} while the rig is {}: {hint}", outcome.state),
        )
        .about("state"))
    }

    /// Gives the loop other limits; returns the first tick with them. Must not be dropped half-way.
    ///
    /// # Errors
    /// The real-time thread does not answer; if it continues, it will take them.
    pub(in crate::control) async fn change_limits(&self, limits: Limits) -> Result<u64, WireError> {
        let _turn = self.commanding.lock().await;
        let serial = self.next_serial();
        if !self.inbox.borrow_mut().send(ToLoop::Limits { serial, limits }) {
            return Err(takes_no_commands("change the limits"));
        }
        self.sent_limits.set(Some(limits));
        let Outcome { tick, .. } = self.answer(|answers| answers.command(serial)).await?;
        self.pump();
        if let Some(limits) = self.sent_limits.take() {
            // The record of that tick was lost.
            self.facts.set_limits(limits);
            self.feed.borrow_mut().doubt_servo();
        }
        Ok(tick)
    }

    fn next_serial(&self) -> u64 {
        let serial = self.serial.get() + 1;
        self.serial.set(serial);
        serial
    }

    /// What is known of the rig that the loop is to engage.
    fn rig_setup(&self, purpose: Purpose) -> RigSetup {
        let setup = rig_friction::setup(self);
        // A pulse is to move the rig as it is.
        let compensation = setup.compensation.filter(|_| purpose == Purpose::Scene);
        RigSetup { compensation, ..setup }
    }

    /// The number of the connection to the device; 0 without a device.
    fn connection(&self) -> u64 {
        ConnectedDevice::find(&self.facts).map_or(0, |device| device.connection)
    }
}

fn takes_no_commands(what: &str) -> WireError {
    let message =
        format!("cannot {what}: the real-time thread takes no commands; cut the power of the motor if it pulls");
    WireError::new(ErrorCode::NotResponding, message)
}
