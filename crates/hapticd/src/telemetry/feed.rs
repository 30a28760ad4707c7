//! Distributes the records: to the timing histograms, the newest state, and the subscribers.

use crate::rt::handoff::Answers;
use crate::rt::outbox::{Consumer, TickRecord};
use crate::telemetry::excitation::ObservedExcitation;
use crate::telemetry::link;
use crate::telemetry::motion::Motion;
use crate::telemetry::stop_times::StopTimes;
use crate::telemetry::timing::TimingRecorder;
use device_io::link::LinkMonitor;
use haptic_core::Scene;
use haptic_ipc::{
    Event, JournalEntry, LinkStatus, RigState, Sample, SamplesEvent, SceneArrival, SceneRamp, ServoEvent, ServoSetup,
    StateEvent, Timing, Topic, params_of,
};
use std::collections::VecDeque;
use std::rc::Rc;
use std::sync::Arc;
use std::time::{Duration, Instant};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc};

/// Most lines that wait for a subscriber; further ones are dropped and counted.
pub(crate) const BACKLOG_LINES: usize = 64;

/// Most rows of one event, so that its line stays within the protocol's limit; a longer batch is
/// sent as several events.
const MOST_ROWS: usize = 256;

/// Most bytes of events that wait for a subscriber, whatever its subscriptions: two seconds of
/// every tick at 1 kHz.
pub(crate) const BACKLOG_BYTES: usize = 512 * 1024;

/// A line for a client, with the room that it takes until it is written.
#[derive(Debug)]
pub(crate) struct Line {
    pub(crate) text: String,
    pub(crate) room: Option<OwnedSemaphorePermit>,
}

/// A scene that is or was active, and the number of steps to undo and redo there.
#[derive(Clone, Debug)]
pub(crate) struct KnownScene {
    pub(crate) revision: u64,
    pub(crate) scene: Rc<Scene>,
    /// The ramp by which it came in.
    pub(crate) ramp: Option<Box<SceneRamp>>,
    pub(crate) undo_depth: usize,
    pub(crate) redo_depth: usize,
}

/// A client's subscription.
#[derive(Debug)]
pub(crate) struct Subscription {
    pub(crate) topics: Vec<Topic>,
    /// Every how many ticks one is sent.
    pub(crate) every: u64,
    pub(crate) batch: Duration,
    pub(crate) lines: mpsc::Sender<Line>,
    /// Room for the client's events, [`BACKLOG_BYTES`] of it.
    pub(crate) room: Arc<Semaphore>,
}

impl Subscription {
    /// Sends an event, if there is room for it.
    fn send(&self, text: String) -> bool {
        // The memory of the line, not the length of its text.
        let bytes = u32::try_from(text.capacity() + size_of::<Line>()).unwrap_or(u32::MAX);
        let Ok(room) = Arc::clone(&self.room).try_acquire_many_owned(bytes) else {
            return false;
        };
        let room = Some(room);
        self.lines.try_send(Line { text, room }).is_ok()
    }
}

#[derive(Debug)]
struct Subscriber {
    session: u64,
    subscription: Subscription,
    rows: Vec<Sample>,
    seq: u64,
    dropped: u64,
    due: Instant,
    state_sent: bool,
    /// The servo's settings that it was told.
    servo: ServoSetup,
    /// Whether there are others, which it is yet to be told.
    servo_due: bool,
}

/// The control end of the telemetry.
#[derive(Debug)]
pub(crate) struct Feed {
    consumer: Consumer,
    /// The motion of the handle, while a client has the rig to itself.
    pub(crate) motion: Option<Motion>,
    /// The excitation that is under way.
    pub(crate) excitation: Option<ObservedExcitation>,
    /// The link to the rig, unless the rig is simulated in this process.
    link: Option<LinkMonitor>,
    timing: TimingRecorder,
    stops: StopTimes,
    started_ns: u64,
    newest: Option<TickRecord>,
    /// Records that were taken and are not processed yet.
    taken: Vec<TickRecord>,
    subscribers: Vec<Subscriber>,
    /// State and revision of the newest record.
    last_state: Option<(RigState, u64)>,
    /// The first record of each state and revision since the last call of `tell_subscribers`.
    changes: Vec<TickRecord>,
    /// The servo's settings, and the first tick that was computed with them, once they may have changed.
    servo: Option<(u64, ServoSetup)>,
    /// Whether a record was lost from which on the servo has other settings.
    servo_is_doubtful: bool,
    timing_due: Instant,
    /// Records lost in the ring so far that subscribers were told of.
    ring_dropped: u64,
}

impl Feed {
    pub(crate) fn new(consumer: Consumer, period_ns: u64, link: Option<LinkMonitor>) -> Self {
        Self {
            consumer,
            motion: None,
            excitation: None,
            link,
            timing: TimingRecorder::new(period_ns),
            stops: StopTimes::default(),
            started_ns: 0,
            newest: None,
            taken: Vec::new(),
            subscribers: Vec::new(),
            last_state: None,
            changes: Vec::new(),
            servo: None,
            servo_is_doubtful: false,
            timing_due: Instant::now(),
            ring_dropped: 0,
        }
    }

    pub(crate) fn timing(&self) -> &TimingRecorder {
        &self.timing
    }

    /// The timing of the loop and of its link.
    pub(crate) fn timing_report(&self) -> Timing {
        Timing {
            link: self.link(),
            stops: self.stops.report(),
            ..self.timing.report()
        }
    }

    /// Begins to time a stop, from the time at which its line was read, ns.
    pub(crate) fn stop_begun(&mut self, stop: u64, read_ns: u64) {
        self.stops.begin(stop, read_ns);
    }

    /// Times the stops that have ended.
    pub(crate) fn stops_ended(&mut self, answers: &Answers) {
        self.stops.pump(answers);
    }

    /// The status of the link to the rig, if there is one.
    pub(crate) fn link(&self) -> Option<LinkStatus> {
        self.link.as_ref().map(link::status)
    }

    /// The rig's state in the newest record; before the first one that of a rig which is waited for, or idle.
    pub(crate) fn state(&self) -> RigState {
        match self.newest() {
            Some(record) => record.state,
            None if self.link.is_some() => RigState::Disconnected,
            None => RigState::Idle,
        }
    }

    /// The newest record; `None` before the first.
    pub(crate) fn newest(&self) -> Option<&TickRecord> {
        self.newest.as_ref()
    }

    /// Time from the first tick to the newest, s.
    #[expect(clippy::cast_precision_loss, reason = "nanoseconds of a run are far below 2^53")]
    pub(crate) fn uptime_s(&self) -> f64 {
        self.newest
            .map_or(0.0, |record| (record.began_ns - self.started_ns) as f64 * 1e-9)
    }

    /// The record of the first tick with other settings of the servo was lost.
    pub(crate) fn doubt_servo(&mut self) {
        self.servo_is_doubtful = true;
    }

    /// Begins, replaces or (without topics) ends the subscription of a session.
    /// `servo` is what it is told of the servo's settings.
    pub(crate) fn subscribe(&mut self, session: u64, subscription: Subscription, servo: ServoSetup) {
        self.unsubscribe(session);
        if subscription.topics.is_empty() {
            return;
        }
        self.subscribers.push(Subscriber {
            session,
            due: Instant::now() + subscription.batch,
            subscription,
            rows: Vec::new(),
            seq: 0,
            dropped: 0,
            state_sent: false,
            servo,
            servo_due: false,
        });
    }

    pub(crate) fn unsubscribe(&mut self, session: u64) {
        self.subscribers.retain(|subscriber| subscriber.session != session);
    }

    /// Tells the subscribers of an entry of the journal.
    pub(crate) fn tell(&self, entry: &JournalEntry) {
        if self.wanted(Topic::Log) {
            self.broadcast(Topic::Log, &Event::Log(Box::new(entry.clone())));
        }
    }

    /// Takes the records since the last call, and frees the scenes that were handed back.
    pub(crate) fn take_records(&mut self) {
        self.consumer.drop_retired();
        while let Some(record) = self.consumer.pop() {
            self.taken.push(record);
        }
    }

    /// Processes the records that were taken, and sends the events that are due. `scenes` holds all scenes that these
    /// records may tell of; `servo` asks for the servo's settings, as far as they are known. Returns the first record
    /// of each state and revision.
    pub(crate) fn tell_subscribers(
        &mut self,
        scenes: &VecDeque<KnownScene>,
        servo: impl Fn(&TickRecord) -> Option<ServoSetup>,
    ) -> Vec<TickRecord> {
        let mut taken = std::mem::take(&mut self.taken);
        for record in taken.drain(..) {
            self.process(&record, scenes, &servo);
        }
        self.taken = taken;
        let changes = std::mem::take(&mut self.changes);
        self.announce_to_new(scenes);
        self.announce_servo();
        let now = Instant::now();
        for subscriber in &mut self.subscribers {
            if now >= subscriber.due {
                subscriber.due = now + subscriber.subscription.batch;
                subscriber.flush();
            }
        }
        if now >= self.timing_due {
            self.timing_due = now + Duration::from_secs(1);
            if self.wanted(Topic::Timing) {
                let event = Event::Timing(Box::new(self.timing_report()));
                self.broadcast(Topic::Timing, &event);
            }
        }
        changes
    }

    fn process(
        &mut self,
        record: &TickRecord,
        scenes: &VecDeque<KnownScene>,
        servo: &impl Fn(&TickRecord) -> Option<ServoSetup>,
    ) {
        if self.newest.is_none() {
            self.started_ns = record.began_ns;
        }
        self.timing.record(record);
        if let Some(motion) = &mut self.motion {
            motion.take(record);
        }
        if let Some(excitation) = &mut self.excitation {
            excitation.take(record);
        }
        // What a row is computed with is told before the row: a stall of this thread may leave rows for
        // several events.
        let before = self.newest.replace(*record);
        let is_doubtful = std::mem::take(&mut self.servo_is_doubtful);
        if before.is_none_or(|before| is_doubtful || may_be_set_up_anew(&before, record))
            && let Some(servo) = servo(record)
        {
            for subscriber in &mut self.subscribers {
                subscriber.servo_due = subscriber.wants(Topic::State) && subscriber.servo != servo;
            }
            self.servo = Some((record.tick, servo));
            self.announce_servo();
        }
        let state = Some((record.state, record.revision));
        if self.last_state != state {
            self.last_state = state;
            self.changes.push(*record);
            self.announce(record, scenes, |_| true);
        }
        let lost = record.dropped - self.ring_dropped;
        self.ring_dropped = record.dropped;
        let sample = self.sample(record);
        for subscriber in &mut self.subscribers {
            if subscriber.wants(Topic::Samples) {
                subscriber.dropped += lost / subscriber.subscription.every;
                if record.tick.is_multiple_of(subscriber.subscription.every) {
                    subscriber.rows.push(sample);
                    if subscriber.rows.len() >= MOST_ROWS {
                        subscriber.flush();
                    }
                }
            }
        }
    }

    #[expect(clippy::cast_precision_loss, reason = "nanoseconds of a run are far below 2^53")]
    fn sample(&self, record: &TickRecord) -> Sample {
        Sample {
            tick: record.tick,
            t_s: (record.began_ns - self.started_ns) as f64 * 1e-9,
            state: record.state,
            contact: record.contact,
            device_position_m: record.device_position,
            device_velocity_mps: record.device_velocity,
            block_position_m: record.block_position,
            block_velocity_mps: record.block_velocity,
            coupling_force_n: record.coupling_force,
            command_force_n: record.command_force,
            revision: record.revision,
            wake_latency_ns: record.began_ns.saturating_sub(record.deadline_ns),
            tick_ns: record.ended_ns.saturating_sub(record.began_ns),
            device_round_trip_ns: record.device_round_trip_ns,
            elapsed_ns: record.elapsed_ns,
            device_sequence: record.device_sequence,
            device_time_ns: record.device_time_ns,
            sample_position_m: record.sample_position,
            input_flags: record.input_word.flags,
            error_detail: record.input_word.detail,
        }
    }

    /// Sends the servo's settings to those who were told others.
    fn announce_servo(&mut self) {
        let Some((tick, servo)) = &self.servo else { return };
        for subscriber in self.subscribers.iter_mut().filter(|subscriber| subscriber.servo_due) {
            let event = Event::Servo(Box::new(ServoEvent {
                tick: *tick,
                servo: servo.clone(),
            }));
            // A subscriber whose backlog is full gets them as soon as there is room.
            if subscriber.subscription.send(line(&event)) {
                (subscriber.servo, subscriber.servo_due) = (servo.clone(), false);
            }
        }
    }

    /// Sends the whole state to new subscribers.
    fn announce_to_new(&mut self, scenes: &VecDeque<KnownScene>) {
        if let Some(newest) = self.newest
            && self.subscribers.iter().any(|subscriber| !subscriber.state_sent)
        {
            self.announce(&newest, scenes, |subscriber| !subscriber.state_sent);
        }
    }

    fn announce(&mut self, record: &TickRecord, scenes: &VecDeque<KnownScene>, whom: impl Fn(&Subscriber) -> bool) {
        let listening = |subscriber: &Subscriber| subscriber.wants(Topic::State) && whom(subscriber);
        let found = scenes.binary_search_by_key(&record.revision, |known| known.revision);
        let Some(known) = found.ok().and_then(|index| scenes.get(index)) else {
            return;
        };
        if !self.subscribers.iter().any(listening) {
            return;
        }
        let event = Event::State(StateEvent {
            state: record.state,
            fault: record.fault.map(|fault| fault.to_string()),
            tick: record.tick,
            revision: record.revision,
            scene: known.scene.name.clone(),
            law: known.scene.friction.law().to_owned(),
            params: params_of(&known.scene),
            undo_depth: known.undo_depth,
            redo_depth: known.redo_depth,
            arrival: Some(Box::new(SceneArrival {
                scene: Scene::clone(&known.scene),
                ramp: known.ramp.as_deref().cloned(),
            })),
        });
        let line = line(&event);
        for subscriber in self.subscribers.iter_mut().filter(|subscriber| listening(subscriber)) {
            // A subscriber whose backlog is full gets the newest state as soon as there is room.
            subscriber.state_sent = subscriber.subscription.send(line.clone());
        }
    }

    fn wanted(&self, topic: Topic) -> bool {
        self.subscribers.iter().any(|subscriber| subscriber.wants(topic))
    }

    fn broadcast(&self, topic: Topic, event: &Event) {
        let line = line(event);
        for subscriber in self.subscribers.iter().filter(|subscriber| subscriber.wants(topic)) {
            // A subscriber whose backlog is full misses this event.
            subscriber.subscription.send(line.clone());
        }
    }
}

impl Subscriber {
    fn wants(&self, topic: Topic) -> bool {
        self.subscription.topics.contains(&topic)
    }

    /// Sends the collected rows, or counts them as dropped.
    fn flush(&mut self) {
        if self.rows.is_empty() {
            return;
        }
        let rows = std::mem::take(&mut self.rows);
        let count = rows.len();
        let event = Event::Samples(SamplesEvent {
            seq: self.seq,
            dropped: self.dropped,
            rows,
        });
        // Events that would not fit are not even serialised.
        if self.subscription.lines.capacity() > 0 && self.subscription.send(line(&event)) {
            self.seq += 1;
            self.dropped = 0;
        } else {
            self.dropped += count as u64;
        }
        // The next batch will probably be as long.
        self.rows.reserve(count);
    }
}

/// Whether the servo may have other settings from a record on: the rig was engaged, its device answers again, or
/// other limits hold.
fn may_be_set_up_anew(before: &TickRecord, record: &TickRecord) -> bool {
    let answers = |record: &TickRecord| record.input_word.sample(0, 0, 0.0).is_ok();
    (record.state.is_live() && !before.state.is_live())
        || (answers(record) && !answers(before))
        || record.input_word.has_new_limits()
}

/// An event as a line.
fn line(event: &Event) -> String {
    let mut line = serde_json::to_string(event).expect("events hold nothing that JSON cannot");
    line.push('\n');
    // Serialising has doubled its capacity several times.
    line.shrink_to_fit();
    line
}

#[cfg(test)]
mod tests;
