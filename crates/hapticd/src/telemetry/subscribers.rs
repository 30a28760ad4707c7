//! The subscribers: what each has asked for, and the events that it is sent.

use crate::rt::outbox::{TickRecord, TickSnapshot};
use haptic_core::Scene;
use haptic_ipc::{
    Event, Sample, SampleY, SamplesEvent, SceneArrival, SceneRamp, ServoEvent, ServoSetup, ServoSnapshot,
    SnapshotEvent, StateEvent, Topic, params_of,
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
const MAX_ROWS: usize = 256;

/// Most bytes of events that wait for a subscriber, whatever its subscriptions: two seconds of
/// every tick at 1 kHz.
pub(crate) const BACKLOG_BYTES: usize = 512 * 1024;

/// Time between two snapshots for a subscriber that has lost nothing.
const SNAPSHOT_PERIOD: Duration = Duration::from_secs(10);

/// Longest time for which rows wait for the first snapshot: a motion of the rig's own has none.
const MAX_HOLD: Duration = Duration::from_millis(250);

/// A line for a client, with the room that it takes until it is written.
#[derive(Debug)]
pub(crate) struct ClientLine {
    pub(crate) text: String,
    pub(crate) room: Option<OwnedSemaphorePermit>,
}

/// A scene that is or was active, and the number of steps to undo and redo there.
#[derive(Clone, Debug)]
pub(crate) struct KnownScene {
    pub(crate) revision: u64,
    pub(crate) scene: Rc<Scene>,
    /// The ramp by which it took effect.
    pub(crate) ramp: Option<Box<SceneRamp>>,
    pub(crate) undo_depth: usize,
    pub(crate) redo_depth: usize,
}

impl KnownScene {
    /// The scene of a revision, of those by revision.
    pub(crate) fn of(revision: u64, scenes: &VecDeque<Self>) -> Option<&Self> {
        let found = scenes.binary_search_by_key(&revision, |known| known.revision);
        found.ok().and_then(|index| scenes.get(index))
    }

    fn arrival(&self) -> SceneArrival {
        SceneArrival {
            scene: Scene::clone(&self.scene),
            ramp: self.ramp.as_deref().cloned(),
        }
    }
}

/// A client's subscription.
#[derive(Debug)]
pub(crate) struct Subscription {
    pub(crate) topics: Vec<Topic>,
    /// Every how many ticks one is sent.
    pub(crate) every: u64,
    pub(crate) batch: Duration,
    pub(crate) lines: mpsc::Sender<ClientLine>,
    /// Room for the client's events, [`BACKLOG_BYTES`] of it.
    pub(crate) room: Arc<Semaphore>,
}

impl Subscription {
    /// Sends an event, if there is room for it.
    fn send(&self, text: String) -> bool {
        // The memory of the line, not the length of its text.
        let bytes = u32::try_from(text.capacity() + size_of::<ClientLine>()).unwrap_or(u32::MAX);
        let Ok(room) = Arc::clone(&self.room).try_acquire_many_owned(bytes) else {
            return false;
        };
        let room = Some(room);
        self.lines.try_send(ClientLine { text, room }).is_ok()
    }
}

#[derive(Debug)]
struct Subscriber {
    session: u64,
    subscription: Subscription,
    rows: Vec<Sample>,
    rows_y: Vec<SampleY>,
    seq: u64,
    dropped: u64,
    due: Instant,
    state_sent: bool,
    /// The servo's settings that it was sent.
    servo: ServoSetup,
    /// Whether there are others, which are not sent yet.
    servo_due: bool,
    /// When it is to be sent the next snapshot; never, without that topic.
    snapshot_due: Option<Instant>,
    /// Until when its rows wait for the first snapshot.
    held_until: Option<Instant>,
}

#[derive(Debug, Default)]
pub(crate) struct Subscribers {
    all: Vec<Subscriber>,
    /// The servo's settings, and the first tick that was computed with them, once they may have changed.
    servo: Option<(u64, ServoSetup)>,
}

impl Subscribers {
    /// Begins, replaces or (without topics) ends the subscription of a session.
    /// `servo` holds the servo's settings, which it has been sent.
    pub(crate) fn subscribe(&mut self, session: u64, subscription: Subscription, servo: ServoSetup) {
        // What was collected for the one before is not lost.
        for before in self.all.iter_mut().filter(|subscriber| subscriber.session == session) {
            before.flush();
        }
        self.unsubscribe(session);
        if subscription.topics.is_empty() {
            return;
        }
        let now = Instant::now();
        let wants = |topic| subscription.topics.contains(&topic);
        let snapshot_due = wants(Topic::Snapshot).then_some(now);
        let is_replayable = wants(Topic::Samples) && subscription.every == 1;
        self.all.push(Subscriber {
            session,
            due: now + subscription.batch,
            snapshot_due,
            held_until: snapshot_due.filter(|_| is_replayable).map(|now| now + MAX_HOLD),
            subscription,
            rows: Vec::new(),
            rows_y: Vec::new(),
            seq: 0,
            dropped: 0,
            state_sent: false,
            servo,
            servo_due: false,
        });
    }

    pub(crate) fn unsubscribe(&mut self, session: u64) {
        self.all.retain(|subscriber| subscriber.session != session);
    }

    /// The servo has these settings from a tick on: sends them to those who have others.
    pub(super) fn set_servo(&mut self, tick: u64, servo: ServoSetup) {
        for subscriber in &mut self.all {
            subscriber.servo_due = subscriber.wants(Topic::State) && subscriber.servo != servo;
        }
        self.servo = Some((tick, servo));
        self.announce_servo();
    }

    /// Whether a snapshot is due for a subscriber.
    pub(super) fn is_snapshot_due(&self, now: Instant) -> bool {
        self.all
            .iter()
            .any(|subscriber| subscriber.snapshot_due.is_some_and(|due| due <= now))
    }

    /// Rows from here on do not go on from the last snapshot.
    pub(super) fn need_snapshot(&mut self) {
        for subscriber in &mut self.all {
            subscriber.need_snapshot();
        }
    }

    /// Sends the servo's state before the next row to those who want it, if its scenes are known.
    pub(super) fn add_snapshot(
        &mut self,
        TickSnapshot { tick, snapshot }: &TickSnapshot,
        scenes: &VecDeque<KnownScene>,
    ) {
        let arrival = |revision| KnownScene::of(revision, scenes).map(KnownScene::arrival);
        let Some(snapshot) = ServoSnapshot::of(snapshot, arrival) else {
            return;
        };
        let tick = *tick;
        let event = Event::Snapshot(Box::new(SnapshotEvent { tick, snapshot }));
        let (line, next) = (line(&event), Instant::now() + SNAPSHOT_PERIOD);
        for subscriber in &mut self.all {
            // A subscriber whose backlog is full gets another one as soon as there is room.
            if subscriber.snapshot_due.is_some() && subscriber.subscription.send(line.clone()) {
                (subscriber.snapshot_due, subscriber.held_until) = (Some(next), None);
            }
        }
    }

    /// Adds a tick, and what it has of a second axis, to the rows of those who want it; `lost` records were lost before
    /// it.
    pub(super) fn add_row(&mut self, sample: &Sample, y: Option<SampleY>, lost: u64) {
        for subscriber in &mut self.all {
            if subscriber.is_held() {
                continue;
            }
            if lost > 0 {
                subscriber.need_snapshot();
            }
            if subscriber.wants(Topic::Samples) {
                subscriber.dropped += lost / subscriber.subscription.every;
                if sample.tick.is_multiple_of(subscriber.subscription.every) {
                    subscriber.rows.push(*sample);
                    subscriber.rows_y.extend(y);
                    if subscriber.rows.len() >= MAX_ROWS {
                        subscriber.flush();
                    }
                }
            }
        }
    }

    /// Sends the rows that are due.
    pub(super) fn flush_due(&mut self, now: Instant) {
        for subscriber in &mut self.all {
            if now >= subscriber.due {
                subscriber.due = now + subscriber.subscription.batch;
                subscriber.flush();
            }
        }
    }

    /// Sends the servo's settings to those who have others.
    pub(super) fn announce_servo(&mut self) {
        let Some((tick, servo)) = &self.servo else { return };
        for subscriber in self.all.iter_mut().filter(|subscriber| subscriber.servo_due) {
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

    /// Sends the whole state to those who want it, or to those of them alone to whom it was not sent.
    pub(super) fn announce(&mut self, record: &TickRecord, scenes: &VecDeque<KnownScene>, only_new: bool) {
        let listening =
            |subscriber: &Subscriber| subscriber.wants(Topic::State) && !(only_new && subscriber.state_sent);
        if !self.all.iter().any(listening) {
            return;
        }
        let Some(known) = KnownScene::of(record.revision, scenes) else {
            return;
        };
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
            arrival: Some(Box::new(known.arrival())),
        });
        let line = line(&event);
        for subscriber in self.all.iter_mut().filter(|subscriber| listening(subscriber)) {
            // A subscriber whose backlog is full gets the newest state as soon as there is room.
            subscriber.state_sent = subscriber.subscription.send(line.clone());
        }
    }

    /// Sends an event to those who want its topic.
    pub(crate) fn broadcast(&self, topic: Topic, event: impl FnOnce() -> Event) {
        let mut wanting = self.all.iter().filter(|subscriber| subscriber.wants(topic)).peekable();
        if wanting.peek().is_none() {
            return;
        }
        let line = line(&event());
        for subscriber in wanting {
            // A subscriber whose backlog is full misses this event.
            subscriber.subscription.send(line.clone());
        }
    }
}

impl Subscriber {
    fn wants(&self, topic: Topic) -> bool {
        self.subscription.topics.contains(&topic)
    }

    fn need_snapshot(&mut self) {
        self.snapshot_due = self.snapshot_due.map(|_| Instant::now());
    }

    /// Whether its rows still wait for the first snapshot.
    fn is_held(&mut self) -> bool {
        self.held_until = self.held_until.filter(|until| Instant::now() < *until);
        self.held_until.is_some()
    }

    /// Sends the collected rows, or counts them as dropped.
    fn flush(&mut self) {
        if self.rows.is_empty() {
            return;
        }
        let rows = std::mem::take(&mut self.rows);
        let rows_y = std::mem::take(&mut self.rows_y);
        let count = rows.len();
        let event = Event::Samples(SamplesEvent {
            seq: self.seq,
            dropped: self.dropped,
            rows,
            rows_y,
        });
        // Events that would not fit are not even serialised.
        if self.subscription.lines.capacity() > 0 && self.subscription.send(line(&event)) {
            self.seq += 1;
            self.dropped = 0;
        } else {
            self.dropped += count as u64;
            self.need_snapshot();
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
