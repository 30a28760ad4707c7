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
    Event, JournalEntry, LinkStatus, RigState, Sample, SamplesEvent, SceneArrival, SceneRamp, StateEvent, Timing,
    Topic, params_of,
};
use std::collections::VecDeque;
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
    pub(crate) scene: Scene,
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
    subscribers: Vec<Subscriber>,
    /// State and revision of the newest record.
    last_state: Option<(RigState, u64)>,
    /// The first record of each state and revision since the last call of `tell_subscribers`.
    changes: Vec<TickRecord>,
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
            subscribers: Vec::new(),
            last_state: None,
            changes: Vec::new(),
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

    /// Begins, replaces or (without topics) ends the subscription of a session.
    pub(crate) fn subscribe(&mut self, session: u64, subscription: Subscription) {
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
            self.process(&record);
        }
    }

    /// Sends the events that are due. `scenes` holds all scenes that the records taken may tell of.
    /// Returns the first record of each state and revision.
    pub(crate) fn tell_subscribers(&mut self, scenes: &VecDeque<KnownScene>) -> Vec<TickRecord> {
        let changes = std::mem::take(&mut self.changes);
        self.announce_states(&changes, scenes);
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

    #[expect(clippy::cast_precision_loss, reason = "nanoseconds of a run are far below 2^53")]
    fn process(&mut self, record: &TickRecord) {
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
        self.newest = Some(*record);
        let state = Some((record.state, record.revision));
        if self.last_state != state {
            self.last_state = state;
            self.changes.push(*record);
        }
        let lost = record.dropped - self.ring_dropped;
        self.ring_dropped = record.dropped;
        let sample = Sample {
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
        };
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

    /// Sends every change of state to all, and the whole state to new subscribers.
    fn announce_states(&mut self, changes: &[TickRecord], scenes: &VecDeque<KnownScene>) {
        for record in changes {
            self.announce(record, scenes, |_| true);
        }
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
                scene: known.scene.clone(),
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

/// An event as a line.
fn line(event: &Event) -> String {
    let mut line = serde_json::to_string(event).expect("events hold nothing that JSON cannot");
    line.push('\n');
    // Serialising has doubled its capacity several times.
    line.shrink_to_fit();
    line
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rt::outbox;

    fn known(revision: u64) -> KnownScene {
        KnownScene {
            revision,
            scene: Scene::paper(),
            ramp: None,
            undo_depth: 0,
            redo_depth: 0,
        }
    }

    fn subscription(topics: &[Topic], every: u64, backlog: usize) -> (Subscription, mpsc::Receiver<Line>) {
        let (lines, received) = mpsc::channel(backlog);
        let subscription = Subscription {
            topics: topics.to_vec(),
            every,
            batch: Duration::ZERO,
            lines,
            room: Arc::new(Semaphore::new(BACKLOG_BYTES)),
        };
        (subscription, received)
    }

    fn pump(feed: &mut Feed, scenes: &VecDeque<KnownScene>) -> Vec<TickRecord> {
        feed.take_records();
        feed.tell_subscribers(scenes)
    }

    fn events(received: &mut mpsc::Receiver<Line>) -> Vec<Event> {
        std::iter::from_fn(|| received.try_recv().ok())
            .map(|line| serde_json::from_str(&line.text).expect("an event"))
            .collect()
    }

    #[test]
    fn the_state_comes_whole_at_first_and_then_at_every_change() {
        let (mut producer, consumer) = outbox::outbox();
        let mut feed = Feed::new(consumer, 1_000_000, None);
        let (subscription, mut received) = subscription(&[Topic::State], 1, 8);
        feed.subscribe(1, subscription);
        for (tick, state, revision) in [
            (0, RigState::Idle, 1),
            (1, RigState::Idle, 1),
            (2, RigState::Engaging, 1),
            (3, RigState::Engaging, 2),
        ] {
            let mut record = outbox::tests::record(tick);
            (record.state, record.revision) = (state, revision);
            producer.push(record);
            pump(&mut feed, &VecDeque::from([known(1), known(2)]));
        }
        let ticks: Vec<u64> = events(&mut received)
            .iter()
            .map(|event| match event {
                Event::State(state) => state.tick,
                other => panic!("{other:?}"),
            })
            .collect();
        assert_eq!(ticks, [0, 2, 3]);
    }

    #[test]
    fn what_a_slow_subscriber_misses_is_counted_and_told() {
        let (mut producer, consumer) = outbox::outbox();
        let mut feed = Feed::new(consumer, 1_000_000, None);
        let (subscription, mut received) = subscription(&[Topic::Samples], 2, 1);
        feed.subscribe(1, subscription);
        let scenes = VecDeque::from([known(1)]);
        for tick in 0..10 {
            producer.push(outbox::tests::record(tick));
            pump(&mut feed, &scenes);
        }
        // One event fitted; ticks 2, 4, 6 and 8 did not.
        let first = events(&mut received);
        producer.push(outbox::tests::record(10));
        pump(&mut feed, &scenes);
        let [Event::Samples(first), Event::Samples(second)] = [&first[0], &events(&mut received)[0]] else {
            panic!("two sample events");
        };
        assert_eq!((first.seq, first.dropped, first.rows[0].tick), (0, 0, 0));
        assert_eq!((second.seq, second.dropped, second.rows[0].tick), (1, 4, 10));
    }

    // hazard: H20
    #[test]
    fn what_waits_for_a_subscriber_that_does_not_read_is_bounded_in_bytes() {
        let (mut producer, consumer) = outbox::outbox();
        let mut feed = Feed::new(consumer, 1_000_000, None);
        // As many lines as a client has, in batches as long as they may be.
        let topics = [Topic::Samples, Topic::State, Topic::Log, Topic::Timing];
        let (subscription, mut received) = subscription(&topics, 1, BACKLOG_LINES);
        let room = Arc::clone(&subscription.room);
        feed.subscribe(1, subscription);
        let scenes = VecDeque::from([known(1)]);
        for tick in 0..40_000 {
            producer.push(outbox::tests::record(tick));
            if tick % 256 == 255 {
                pump(&mut feed, &scenes);
            }
        }
        let held: Vec<Line> = std::iter::from_fn(|| received.try_recv().ok()).collect();
        let bytes: usize = held.iter().map(|line| line.text.capacity()).sum();
        println!("{bytes} bytes in {} lines wait, of {BACKLOG_BYTES}", held.len());
        assert!(bytes <= BACKLOG_BYTES && bytes > BACKLOG_BYTES / 2, "{bytes}");
        assert!(held.len() < BACKLOG_LINES, "the bytes bound it, not the lines");
        // Once it is written there is all the room again, and what was missed is told.
        drop(held);
        assert_eq!(room.available_permits(), BACKLOG_BYTES);
        for tick in 40_000..40_256 {
            producer.push(outbox::tests::record(tick));
        }
        pump(&mut feed, &scenes);
        let told = events(&mut received);
        let Some(Event::Samples(samples)) = told.first() else {
            panic!("no samples")
        };
        assert!(samples.dropped > 0 && samples.dropped < 40_000, "{}", samples.dropped);
    }
}
