//! The way of one sample, from the encoder to the motor: read, step the servo, write, record.
//!
//! ```text
//! stop? new or scheduled scene? command? -> device read -> Servo::step -> device write -> record, answers
//! ```

use crate::rt::clock::{Wake, now_ns};
use crate::rt::handoff::{CommandWord, Outcome, Shared, StopConfirmation, Stopped};
use crate::rt::lateness::Lateness;
use crate::rt::outbox::{Producer, TickRecord};
use crate::rt::rig_setup::{RigSetup, Setup, SetupReceiver};
use crate::rt::schedule::ScheduleReceiver;
use device_io::{Device, DeviceError, Written};
use haptic_core::sample::{Measurement, Motor};
use haptic_core::servo::{
    Command, CompiledScene, Event, Events, InputWord, Inputs, OFF_TIMEOUT_NS, Outputs, Servo, Transition,
};
use haptic_ipc::RigState;
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

/// What a device says of itself, asked for once a connection.
#[derive(Clone, Copy, Debug)]
struct DeviceFacts {
    connection: u64,
    resolution_m: f64,
    force_limit_n: f64,
    is_linked: bool,
}

impl DeviceFacts {
    #[cold]
    fn of(device: &(impl Device + ?Sized)) -> Self {
        Self {
            connection: device.connection(),
            resolution_m: device.resolution_m(),
            force_limit_n: device.force_limit_n(),
            is_linked: device.is_linked(),
        }
    }
}

/// All that the loop owns.
pub(crate) struct Tick<D: Device + ?Sized> {
    shared: Arc<Shared>,
    outbox: Producer,
    /// Facts of the rig to engage, and limits, if they may change.
    rig_setups: Option<SetupReceiver>,
    /// The newest facts, until that rig is engaged.
    rig_setup: Option<RigSetup>,
    /// Whether other limits hold from this tick on.
    new_limits: bool,
    schedule: Option<ScheduleReceiver>,
    servo: Servo,
    /// Missed periods, held against the late policy.
    lateness: Lateness,
    /// Time for which the control thread may give no sign of life, ns.
    control_timeout_ns: u64,
    tick: u64,
    scenes_seen: u64,
    stops_seen: u64,
    pending_stop: Option<PendingStop>,
    last_command_word: u64,
    /// When the newest sample was read, ns; before the first tick the largest number, to which no time has passed.
    last_read_ns: u64,
    /// Time that the machine had slept in all when the tick before began, ns.
    asleep_ns: u64,
    device_facts: DeviceFacts,
    device: Box<D>,
}

impl<D: Device + ?Sized> Tick<D> {
    pub(crate) fn new(
        device: Box<D>,
        shared: Arc<Shared>,
        outbox: Producer,
        servo: Servo,
        lateness: Lateness,
        control_timeout_ns: u64,
    ) -> Self {
        shared.answers.scene_applied(servo.scene().revision, 0);
        Self {
            shared,
            outbox,
            rig_setups: None,
            rig_setup: None,
            new_limits: false,
            schedule: None,
            servo,
            lateness,
            control_timeout_ns,
            tick: 0,
            scenes_seen: 0,
            stops_seen: 0,
            pending_stop: None,
            last_command_word: 0,
            last_read_ns: u64::MAX,
            asleep_ns: 0,
            device_facts: DeviceFacts::of(&*device),
            device,
        }
    }

    /// Takes what is known of the rig with each command to engage, and other limits at any time.
    pub(crate) fn with_rig_setups(mut self, setups: SetupReceiver) -> Self {
        self.rig_setups = Some(setups);
        self
    }

    /// Makes the changes of scene that are scheduled.
    pub(crate) fn with_schedule(mut self, schedule: ScheduleReceiver) -> Self {
        self.schedule = Some(schedule);
        self
    }

    /// One tick, from waking up to the answer; returns when it ended.
    pub(crate) fn run(&mut self, wake: Wake, missed_periods: u64) -> u64 {
        let stops = self.shared.stops();
        let events = self.events(wake, missed_periods, stops);
        let scene = self.new_scene();
        let new_scene = scene.is_some();
        let word = self.new_command();
        let is_quiet = events.is_empty() && !new_scene && word.is_none() && !self.new_limits;
        let (inputs, read_ns) = self.read(wake, events, word, stops);
        let is_linked = self.device_facts.is_linked;
        let outputs = self.servo.step(&inputs, scene);
        let computed_ns = if is_linked { now_ns() } else { 0 };
        let written = self.device.write(outputs.force_n, outputs.enabled);
        // A predicted branch costs less than the bits of what hardly ever happens.
        let mut input_word = if is_quiet {
            InputWord::of_reading(&inputs)
        } else {
            self.word_of_happenings(&inputs, new_scene)
        };
        if self.servo.scene().renderer.is_motion() {
            input_word = input_word.with_motion();
        }
        if written.is_err() {
            self.servo.disconnect();
            input_word = input_word.with_write_failed();
        }
        let ended_ns = now_ns();
        let sample = inputs.sample.unwrap_or_else(|_| no_sample());
        self.outbox.push(|| TickRecord {
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
            sample_position: sample.position_m,
            device_sequence: sample.sequence,
            input_word,
            device_position: outputs.device_position_m,
            device_velocity: outputs.device_velocity_mps,
            block_position: outputs.block_position_m,
            block_velocity: outputs.block_velocity_mps,
            coupling_force: outputs.coupling_force_n,
            command_force: outputs.force_n,
            energy_excess: outputs.energy_excess_j,
            contact: outputs.contact,
            state: self.servo.state(),
            fault: self.servo.fault(),
        });
        // The answers come last, so that a thread that has one also finds the tick's record.
        self.answer_rarely_changing();
        if !is_quiet {
            self.answer(new_scene, word, &inputs, &outputs);
        }
        if self.pending_stop.is_some() {
            self.answer_stop(written, wake.began_ns, ended_ns);
        }
        self.tick += 1;
        if self.shared.is_snapshot_asked_for() {
            self.give_snapshot();
        }
        ended_ns
    }

    /// Leaves the state of the servo before the next tick; a motion of the rig's own has none, and is waited for.
    #[cold]
    fn give_snapshot(&mut self) {
        if let Some(snapshot) = self.servo.snapshot() {
            self.outbox.push_snapshot(self.tick, snapshot);
            self.shared.snapshot_given();
        }
    }

    /// What the step is made from, once the device has been read, and when that was, ns; 0 without a link.
    #[inline(always)]
    fn read(&mut self, wake: Wake, events: Events, word: Option<CommandWord>, stops: u64) -> (Inputs, u64) {
        let sample = self.device.read(wake.began_ns);
        if self.device.connection() != self.device_facts.connection {
            self.device_facts = DeviceFacts::of(&*self.device);
        }
        // The time, if the device has a link whose time is of interest: reading the clock costs more
        // than the physics of a simple scene.
        let read_ns = if self.device_facts.is_linked { now_ns() } else { 0 };
        // A tick that is held up between its beginning and the reading has a sample that was taken meanwhile: by the
        // beginning, the device's clock would seem to have leapt ahead.
        let sampled_ns = wake.began_ns.max(read_ns);
        let inputs = Inputs {
            elapsed_ns: sampled_ns.saturating_sub(replace(&mut self.last_read_ns, sampled_ns)),
            sample,
            device_resolution_m: self.device_facts.resolution_m,
            device_force_limit_n: self.device_facts.force_limit_n,
            events,
            // Asked after the reading, which may have brought another device.
            command: word.and_then(|word| self.permitted(word, stops)),
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
                began_ns: now_ns,
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
        self.device_facts = DeviceFacts::of(&*device);
        self.device = device;
        self.servo.forget_device();
    }

    /// However long it stands still, that is not a fault from now on.
    pub(crate) fn disregard_stalls(&mut self) {
        self.servo.disregard_stalls();
    }

    /// The scene that it renders.
    pub(crate) fn scene(&self) -> &CompiledScene {
        self.servo.scene()
    }

    /// Zero force, whatever happens after; returns whether the device has confirmed it, or has taken it where it reports
    /// nothing of its motor.
    ///
    /// # Errors
    /// The device could not be written.
    pub(crate) fn zero_force(&mut self, now_ns: u64) -> Result<bool, DeviceError> {
        let written = self.device.write(0.0, false)?;
        if !self.device.is_linked() {
            return Ok(written == Written::Taken);
        }
        // What a device says to this comes later; the next call has it.
        let motor = self
            .device
            .read(now_ns)
            .map_or(Motor::Unconfirmed, |sample| sample.motor);
        Ok(written == Written::Taken && matches!(motor, Motor::Unreported | Motor::Off))
    }

    /// The newest scene, or the one that is scheduled for this tick. Without room for those that it
    /// replaces it waits: nothing is freed on this thread.
    fn new_scene(&mut self) -> Option<Box<CompiledScene>> {
        while self.servo.has_retired() && self.outbox.has_room_for_scenes(1) {
            if let Some(scene) = self.servo.take_retired() {
                self.outbox.retire(scene);
            }
        }
        let is_posted = self.shared.scenes.has_new(self.scenes_seen);
        let is_scheduled = self
            .schedule
            .as_ref()
            .is_some_and(|schedule| schedule.is_due(self.tick, || self.is_halted()));
        if is_posted || is_scheduled {
            return self.take_scene();
        }
        None
    }

    /// The scene that is there, if those that it replaces find room.
    #[inline(never)]
    fn take_scene(&mut self) -> Option<Box<CompiledScene>> {
        if !self.outbox.has_room_for_scenes(3) {
            return None;
        }
        let is_halted = self.is_halted();
        let posted = self.shared.scenes.take_new(&mut self.scenes_seen);
        let scheduled = self
            .schedule
            .as_mut()
            .and_then(|schedule| schedule.take_due(self.tick, is_halted));
        if scheduled.is_some()
            && let Some(posted) = posted
        {
            // It was posted before, and so the scheduled one builds on it.
            self.outbox.retire(posted);
            return scheduled;
        }
        scheduled.or(posted)
    }

    /// Whether something has taken the force away that a person must look at: that ends a schedule.
    fn is_halted(&self) -> bool {
        let state = self.servo.state();
        self.pending_stop.is_some() || matches!(state, RigState::Stopped | RigState::Faulted | RigState::Disconnected)
    }

    fn new_command(&mut self) -> Option<CommandWord> {
        let word = self.shared.command_word();
        if word == self.last_command_word {
            return None;
        }
        self.take_command(word)
    }

    #[inline(never)]
    fn take_command(&mut self, word: u64) -> Option<CommandWord> {
        self.last_command_word = word;
        // Also that of a command which was withdrawn: it must not fill the queue.
        while let Some(setup) = self.rig_setups.as_mut().and_then(SetupReceiver::next) {
            match setup {
                Setup::Rig(setup) => self.rig_setup = Some(setup),
                Setup::Limits(limits) => {
                    self.servo.set_limits(limits);
                    self.new_limits = true;
                }
            }
        }
        let word = CommandWord::unpack(word)?;
        if word.command == Command::Engage
            && let Some(setup) = self.rig_setup.take()
        {
            self.servo.set_rig(setup.losses, setup.compensation);
        }
        Some(word)
    }

    /// The command of a word, unless something forbids it of which the servo knows nothing.
    fn permitted(&self, word: CommandWord, stops: u64) -> Option<Command> {
        // A stop that came after the command was sent wins over it. Nobody engages before the
        // device has confirmed the zero force of the last stop, nor another device than the one
        // that was checked before.
        let must_wait = word.command == Command::Engage
            && (self.pending_stop.is_some() || !self.shared.is_admitted(self.device.connection()));
        (!must_wait && !word.overtaken_by(stops)).then_some(word.command)
    }

    /// Confirms a stop once the device reports its motor off; one that does not report its motor,
    /// once it has taken the zero force. Without a device nobody waits, and nobody waits for ever.
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
        let stopped = Stopped {
            tick: self.tick,
            state,
            confirmation,
            written_ns: pending.written_ns.unwrap_or(now_ns),
            confirmed_ns: now_ns,
        };
        self.shared.answers.stopped(pending.stops, stopped);
        self.pending_stop = None;
    }

    fn answer_rarely_changing(&self) {
        let answers = &self.shared.answers;
        if let Transition::Steps(steps) = &self.servo.scene().transition {
            answers.set_ramp_step(steps.taken());
        }
        answers.set_samples_forgotten(self.servo.samples_forgotten());
        answers.set_clock_error(self.servo.clock_error());
    }

    #[cold]
    fn word_of_happenings(&self, inputs: &Inputs, new_scene: bool) -> InputWord {
        let word = InputWord::new(inputs, new_scene);
        if self.new_limits { word.with_new_limits() } else { word }
    }

    /// Answers what came in this tick.
    #[inline(never)]
    fn answer(&mut self, new_scene: bool, word: Option<CommandWord>, inputs: &Inputs, outputs: &Outputs) {
        let answers = &self.shared.answers;
        if replace(&mut self.new_limits, false) {
            answers.limits_taken(self.tick);
        }
        if new_scene {
            answers.scene_applied(self.servo.scene().revision, self.tick);
        }
        if let Some(word) = word {
            let outcome = Outcome {
                tick: self.tick,
                state: self.servo.state(),
                refused: inputs.command.is_none() || outputs.refused,
            };
            answers.command_done(word.serial, outcome);
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
fn no_sample() -> Measurement {
    Measurement::new(0, 0, 0.0)
}

#[cfg(test)]
pub(crate) mod tests;
