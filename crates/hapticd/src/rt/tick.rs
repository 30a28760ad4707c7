//! The path of one sample, from the encoder to the motor: read, step the servo, write, record.
//!
//! ```text
//! stop? inbox: scene, command? scheduled scene? -> device read -> Servo::step -> device write -> record, answers
//! ```

use crate::rt::clock::{Wake, now_ns};
use crate::rt::handoff::{LoopSide, Outcome, StopConfirmation, Stopped};
use crate::rt::inbox::{ENTRIES, Receiver, RigSetup, SentCommand, ToLoop};
use crate::rt::lateness::Lateness;
use crate::rt::outbox::{FromLoop, Producer, ROOM_OF_ONE, TickRecord, TickSnapshot};
use crate::rt::schedule::ScheduledScenes;
use crate::rt::shared::Shared;
use crate::rt::space::Space;
use device_io::{Device, DeviceBounds, DeviceError, Written};
use haptic_core::OwnMotion;
use haptic_core::sample::{Measurement, Motor};
use haptic_core::servo::{Command, CompiledScene, Event, Events, InputWord, Inputs, OFF_TIMEOUT_NS, Servo, Transition};
use haptic_ipc::{RigState, SampleY};
use std::mem::replace;
use std::sync::Arc;

/// A stop whose zero force the device has not confirmed yet.
#[derive(Clone, Copy, Debug)]
struct PendingStop {
    stops: u64,
    /// The state that it brought, once the servo has taken it.
    state: Option<RigState>,
    began_ns: u64,
    /// When the zero force was taken by the link, ns.
    written_ns: Option<u64>,
}

/// All that the loop owns.
pub(crate) struct Tick<D: Device<V> + ?Sized, V: Space = f64> {
    shared: Arc<Shared>,
    inbox: Receiver,
    outbox: Producer,
    scheduled: ScheduledScenes,
    /// Number of the limits that hold from this tick on, if they are other ones.
    new_limits: Option<u64>,
    /// Room for a snapshot of the servo, if one is asked for.
    snapshot: Option<Box<Option<TickSnapshot>>>,
    servo: Servo<V>,
    /// Missed periods, held against the late policy.
    lateness: Lateness,
    /// Time for which the control thread may give no sign of life, ns.
    control_timeout_ns: u64,
    tick: u64,
    stops_seen: u64,
    pending_stop: Option<PendingStop>,
    /// When the newest sample was read, ns; before the first tick the largest number, to which no time has passed.
    last_read_ns: u64,
    /// Time that the machine had slept in all when the tick before began, ns.
    asleep_ns: u64,
    bounds: DeviceBounds,
    device: Box<D>,
}

impl<V: Space, D: Device<V> + ?Sized> Tick<D, V> {
    pub(crate) fn new(
        device: Box<D>,
        LoopSide {
            shared,
            inbox,
            mut outbox,
        }: LoopSide,
        servo: Servo<V>,
        lateness: Lateness,
        control_timeout_ns: u64,
    ) -> Self {
        outbox.send(FromLoop::Rendered {
            revision: servo.scene().revision,
            tick: 0,
        });
        Self {
            shared,
            inbox,
            outbox,
            scheduled: ScheduledScenes::new(),
            new_limits: None,
            snapshot: None,
            servo,
            lateness,
            control_timeout_ns,
            tick: 0,
            stops_seen: 0,
            pending_stop: None,
            last_read_ns: u64::MAX,
            asleep_ns: 0,
            bounds: device.bounds(),
            device,
        }
    }

    /// One tick, from waking up to the answer; returns when it ended.
    pub(crate) fn run(&mut self, wake: Wake, missed_periods: u64) -> u64 {
        let stops = self.shared.stops();
        let mut events = self.events(wake, missed_periods, stops);
        self.hand_back_retired();
        let (posted, new_motion, command) = if self.inbox.is_empty() {
            (None, false, None)
        } else {
            let received = self.receive();
            events = events.and(Event::LeaseLapsed, received.2.is_some_and(|sent| sent.is_of_lapse));
            received
        };
        let scene = self.new_scene(posted);
        let new_scene = scene.is_some() || new_motion;
        let is_quiet = events.is_empty() && !new_scene && command.is_none() && self.new_limits.is_none();
        let (inputs, read_ns) = self.read(wake, events, command, stops);
        let is_linked = self.bounds.is_linked;
        let outputs = self.servo.step(&inputs, scene);
        let computed_ns = if is_linked { now_ns() } else { 0 };
        let written = self.device.write(outputs.force_n, outputs.enabled);
        // A predicted branch costs less than the bits of what hardly ever happens.
        let mut input_word = if is_quiet {
            InputWord::of_reading(&inputs)
        } else {
            self.word_of_happenings(inputs, new_scene)
        };
        if self.servo.own_motion().is_some() {
            input_word = input_word.with_motion();
        }
        if written.is_err() {
            self.servo.disconnect();
            input_word = input_word.with_write_failed();
        }
        let ended_ns = now_ns();
        let sample = inputs.sample.unwrap_or_else(|_| no_sample());
        let y = SampleY::of_step(&outputs, sample.position_m);
        self.outbox.push(y, || TickRecord {
            tick: self.tick,
            deadline_ns: wake.deadline_ns,
            began_ns: wake.began_ns,
            ended_ns,
            device_round_trip_ns: if is_linked {
                read_ns.saturating_sub(wake.began_ns) + ended_ns.saturating_sub(computed_ns)
            } else {
                0
            },
            missed_periods,
            dropped: 0,
            revision: self.servo.scene().revision,
            elapsed_ns: inputs.elapsed_ns,
            device_time_ns: sample.time_ns,
            sample_position: sample.position_m.first(),
            device_sequence: sample.sequence,
            samples_forgotten: self.servo.samples_forgotten(),
            ramp_steps: match &self.servo.scene().transition {
                Transition::Steps(steps) => u16::try_from(steps.taken()).unwrap_or(u16::MAX),
                _ => 0,
            },
            clock_error: self.servo.clock_error(),
            input_word,
            device_position: outputs.device_position_m.first(),
            device_velocity: outputs.device_velocity_mps.first(),
            block_position: outputs.block_position_m.first(),
            block_velocity: outputs.block_velocity_mps.first(),
            coupling_force: outputs.coupling_force_n.first(),
            command_force: outputs.force_n.first(),
            energy_excess: outputs.energy_excess_j,
            contact: outputs.contact,
            motion_end: self.servo.own_motion().and_then(OwnMotion::end),
            state: self.servo.state(),
            fault: self.servo.fault(),
        });
        // The answers come last, so that a thread that has one also finds the tick's record.
        if !is_quiet {
            self.answer(new_scene, command, inputs.command.is_none() || outputs.refused);
        }
        if self.pending_stop.is_some() {
            self.answer_stop(written, wake.began_ns, ended_ns);
        }
        self.tick += 1;
        if self.snapshot.is_some() {
            self.give_snapshot();
        }
        ended_ns
    }

    /// Leaves the state of the servo before the next tick; a motion of the rig's own has none, and is waited for.
    #[cold]
    fn give_snapshot(&mut self) {
        if let Some(snapshot) = self.servo.snapshot()
            && let Some(mut room) = self.snapshot.take()
        {
            let tick = self.tick;
            *room = Some(TickSnapshot { tick, snapshot });
            self.outbox.send(FromLoop::Snapshot(room));
        }
    }

    /// What the step is made from, once the device has been read, and when that was, ns; 0 without a link.
    #[inline(always)]
    fn read(&mut self, wake: Wake, events: Events, command: Option<SentCommand>, stops: u64) -> (Inputs<V>, u64) {
        let sample = self.device.read(wake.began_ns);
        self.bounds = self.device.bounds();
        // The time, if the device has a link whose time is of interest: reading the clock costs more
        // than the physics of a simple scene.
        let read_ns = if self.bounds.is_linked { now_ns() } else { 0 };
        // A tick that is held up between its beginning and the reading has a sample that was taken meanwhile: by the
        // beginning, the device's clock would seem to have leapt ahead.
        let sampled_ns = wake.began_ns.max(read_ns);
        let inputs = Inputs {
            elapsed_ns: sampled_ns.saturating_sub(replace(&mut self.last_read_ns, sampled_ns)),
            sample,
            device_resolution_m: self.bounds.resolution_m,
            device_force_limit_n: self.bounds.force_limit_n,
            events,
            // Asked after the reading, which may have brought another device.
            command: command.and_then(|sent| self.permitted(sent, stops)),
        };
        (inputs, read_ns)
    }

    /// What happened since the tick before.
    fn events(&mut self, wake: Wake, missed_periods: u64, stops: u64) -> Events {
        let now_ns = wake.began_ns;
        let stop = stops != self.stops_seen;
        if stop {
            self.stops_seen = stops;
            self.pending_stop = Some(PendingStop {
                stops,
                state: None,
                // Stops that come again and again do not put off the answer.
                began_ns: self.pending_stop.map_or(now_ns, |pending| pending.began_ns),
                written_ns: None,
            });
        }
        let slept_ns = wake
            .asleep_ns
            .saturating_sub(replace(&mut self.asleep_ns, wake.asleep_ns));
        let too_late = if self.servo.state().is_live() && !stop {
            self.lateness.is_too_late(now_ns, missed_periods)
        } else {
            self.lateness.rest(missed_periods);
            false
        };
        let slept = slept_ns > self.servo.settings().stale_ns;
        let lease_lapsed = self.shared.has_lapsed(now_ns);
        let control_lost = self.shared.silent_ns(now_ns) > self.control_timeout_ns;
        // A predicted branch costs less than the bits of what hardly ever happens.
        if stop || slept || too_late || lease_lapsed || control_lost {
            return happened([
                (Event::Stop, stop),
                (Event::Slept, slept),
                (Event::TooLate, too_late),
                (Event::LeaseLapsed, lease_lapsed),
                (Event::ControlLost, control_lost),
            ]);
        }
        Events::default()
    }

    /// Goes on with another device, as if it had been unplugged and another plugged in.
    pub(crate) fn replace_device(&mut self, device: Box<D>) {
        self.bounds = device.bounds();
        self.device = device;
        self.servo.forget_device();
    }

    /// However long it stands still, that is not a fault from now on.
    pub(crate) fn disregard_stalls(&mut self) {
        self.servo.disregard_stalls();
    }

    pub(crate) fn scene(&self) -> &CompiledScene<V> {
        self.servo.scene()
    }

    /// Zero force, whatever happens after; returns whether the device has confirmed it, or has taken it where it
    /// reports nothing of its motor.
    ///
    /// # Errors
    /// The device could not be written.
    pub(crate) fn zero_force(&mut self, now_ns: u64) -> Result<bool, DeviceError> {
        let written = self.device.write(V::ZERO, false)?;
        if !self.bounds.is_linked {
            return Ok(written == Written::Taken);
        }
        // What a device says to this comes later; the next call has it.
        let motor = self
            .device
            .read(now_ns)
            .map_or(Motor::Unconfirmed, |sample| sample.motor);
        Ok(written == Written::Taken && matches!(motor, Motor::Unreported | Motor::Off))
    }

    /// Hands back the scenes that the servo renders no more, as far as there is room: nothing is freed on this thread.
    fn hand_back_retired(&mut self) {
        while self.servo.has_retired() && self.outbox.room() > 0 {
            if let Some(scene) = self.servo.take_retired() {
                self.outbox.send(FromLoop::Retired(V::either(scene)));
            }
        }
    }

    /// Whether there is room for what an entry of the inbox may lead to in this tick, beside that of the scheduled
    /// changes.
    fn has_room(&self) -> bool {
        self.outbox.room() >= ROOM_OF_ONE * (self.scheduled.len() + 2)
    }

    /// Takes what has come since the tick before, of several scenes and motions of the rig's own the last, and one
    /// command a tick; says whether it was a motion. Without room for the answers it waits in the inbox.
    #[inline(never)]
    fn receive(&mut self) -> (Option<Box<CompiledScene<V>>>, bool, Option<SentCommand>) {
        let (mut scene, mut new_motion, mut command) = (None::<Box<CompiledScene<V>>>, false, None);
        let retired = |scene| FromLoop::Retired(V::either(scene));
        for _ in 0..ENTRIES {
            let is_second = command.is_some() && matches!(self.inbox.peek(), Ok(ToLoop::Command { .. }));
            if is_second || !self.has_room() {
                break;
            }
            let handed_back = match self.inbox.pop() {
                Ok(ToLoop::Scene(newer)) => match V::own(newer) {
                    Ok(newer) => {
                        new_motion = false;
                        scene.replace(newer).map(retired)
                    }
                    Err(of_another_space) => Some(FromLoop::Retired(of_another_space)),
                },
                Ok(ToLoop::OwnMotion(motion, along)) => {
                    self.servo.begin_own_motion(motion, V::direction(along));
                    new_motion = true;
                    scene.take().map(retired)
                }
                Ok(ToLoop::Scheduled(change)) => self.scheduled.add(change).map(FromLoop::Decided),
                Ok(ToLoop::Snapshot(room)) => self.snapshot.replace(room).map(FromLoop::Snapshot),
                Ok(ToLoop::Command { sent, rig }) => {
                    // Also of one that was withdrawn: the control thread counts on it.
                    if let Some(RigSetup { losses, compensation }) = rig {
                        self.servo.set_rig(losses, compensation);
                    }
                    command = Some(sent).filter(|sent| !self.shared.is_withdrawn(sent.serial));
                    None
                }
                Ok(ToLoop::Limits { serial, limits }) => {
                    self.servo.set_limits(limits);
                    self.new_limits = Some(serial);
                    None
                }
                Err(_) => break,
            };
            if let Some(handed_back) = handed_back {
                self.outbox.send(handed_back);
            }
        }
        (scene, new_motion, command)
    }

    /// The scene that was posted, or the one that is scheduled for this tick.
    fn new_scene(&mut self, posted: Option<Box<CompiledScene<V>>>) -> Option<Box<CompiledScene<V>>> {
        let is_due = self.scheduled.is_due(self.tick, || self.is_halted());
        if is_due { self.take_scheduled(posted) } else { posted }
    }

    #[inline(never)]
    fn take_scheduled(&mut self, posted: Option<Box<CompiledScene<V>>>) -> Option<Box<CompiledScene<V>>> {
        let (is_halted, outbox) = (self.is_halted(), &mut self.outbox);
        let decided = |change| outbox.send(FromLoop::Decided(change));
        let scheduled = match self.scheduled.take_due(self.tick, is_halted, decided).map(V::own) {
            None => return posted,
            Some(Ok(scheduled)) => scheduled,
            Some(Err(of_another_space)) => {
                self.outbox.send(FromLoop::Retired(of_another_space));
                return posted;
            }
        };
        if let Some(posted) = posted {
            // It was posted before, and so the scheduled one builds on it.
            self.outbox.send(FromLoop::Retired(V::either(posted)));
        }
        Some(scheduled)
    }

    /// Whether something has taken the force away that a person must look at: that ends a schedule.
    fn is_halted(&self) -> bool {
        let state = self.servo.state();
        self.pending_stop.is_some() || matches!(state, RigState::Stopped | RigState::Faulted | RigState::Disconnected)
    }

    /// The command that was sent, unless something forbids it of which the servo knows nothing.
    fn permitted(&self, sent: SentCommand, stops: u64) -> Option<Command> {
        // A stop that came after the command was sent wins over it. Nobody engages before the
        // device has confirmed the zero force of the last stop, nor another device than the one
        // that was checked before.
        let must_wait =
            sent.command == Command::Engage && (self.pending_stop.is_some() || !sent.admits(self.bounds.connection));
        (!must_wait && sent.stops_known == stops).then_some(sent.command)
    }

    /// Confirms a stop once the device reports its motor off; one that does not report its motor,
    /// once it has taken the zero force. Without a device nobody waits, and nobody waits for ever. Without room for the
    /// answer the stop stays unconfirmed.
    #[inline(never)]
    fn answer_stop(&mut self, written: Result<Written, DeviceError>, began_ns: u64, now_ns: u64) {
        let Some(pending) = &mut self.pending_stop else {
            return;
        };
        let state = *pending.state.get_or_insert(self.servo.state());
        if written == Ok(Written::Taken) {
            pending.written_ns.get_or_insert(now_ns);
        }
        let confirmation = match (written, self.servo.motor()) {
            (Err(_), _) => StopConfirmation::NoDevice,
            (Ok(Written::Taken), Motor::Unreported | Motor::Off) => StopConfirmation::Confirmed,
            _ if began_ns.saturating_sub(pending.began_ns) >= OFF_TIMEOUT_NS => StopConfirmation::Unconfirmed,
            _ => return,
        };
        let stops = pending.stops;
        let stopped = Stopped {
            tick: self.tick,
            state,
            confirmation,
            written_ns: pending.written_ns.unwrap_or(now_ns),
            confirmed_ns: now_ns,
        };
        if self.has_room() {
            self.outbox.send(FromLoop::Stopped { stops, stopped });
            self.pending_stop = None;
        }
    }

    /// Takes a copy: a reference would keep the inputs of every tick in memory.
    #[cold]
    fn word_of_happenings(&self, inputs: Inputs<V>, new_scene: bool) -> InputWord {
        let word = InputWord::new(&inputs, new_scene);
        if self.new_limits.is_some() {
            word.with_new_limits()
        } else {
            word
        }
    }

    /// Answers what came in this tick.
    #[inline(never)]
    fn answer(&mut self, new_scene: bool, command: Option<SentCommand>, is_refused: bool) {
        let (tick, state) = (self.tick, self.servo.state());
        if new_scene {
            let revision = self.servo.scene().revision;
            self.outbox.send(FromLoop::Rendered { revision, tick });
        }
        let limits = self.new_limits.take().map(|serial| (serial, false));
        let command = command.map(|sent| (sent.serial, is_refused));
        for (serial, refused) in limits.into_iter().chain(command) {
            let outcome = Outcome { tick, state, refused };
            self.outbox.send(FromLoop::Done { serial, outcome });
        }
    }
}

/// Events of which at least one happened.
#[cold]
fn happened(events: [(Event, bool); 5]) -> Events {
    events
        .into_iter()
        .fold(Events::default(), |all, (event, happened)| all.and(event, happened))
}

/// What a record holds where the device could not be read.
#[cold]
fn no_sample<V: Space>() -> Measurement<V> {
    Measurement::new(0, 0, V::ZERO)
}

#[cfg(test)]
pub(crate) mod tests;
