//! What subscribers are sent, and in which order.

use super::*;
use crate::rt::outbox::{self, FromLoop, Producer};
use crate::rt::tick::tests::{SETTINGS, compiled, servo};
use crate::telemetry::subscribers::{BACKLOG_BYTES, BACKLOG_LINES, ClientLine, Subscription};
use haptic_core::Scene;
use haptic_core::passivity::RigLosses;
use haptic_core::servo::Settings;
use std::sync::Arc;
use tokio::sync::{Semaphore, mpsc};

fn known(revision: u64) -> KnownScene {
    KnownScene {
        revision,
        scene: Scene::paper().into(),
        ramp: None,
        undo_depth: 0,
        redo_depth: 0,
    }
}

fn subscription(topics: &[Topic], every: u64, backlog: usize) -> (Subscription, mpsc::Receiver<ClientLine>) {
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

/// A feed with room for so many records, its end for the loop, and what its one subscriber is sent.
fn subscribed(
    records: usize,
    topics: &[Topic],
    every: u64,
    backlog: usize,
) -> (Producer, Feed, mpsc::Receiver<ClientLine>) {
    let (producer, consumer) = outbox::outbox(records);
    let mut feed = Feed::new(consumer, 1_000_000, None);
    let (subscription, received) = subscription(topics, every, backlog);
    feed.subscribers.subscribe(1, subscription, setup(0.5));
    (producer, feed, received)
}

fn pump(feed: &mut Feed, scenes: &VecDeque<KnownScene>, servo: impl Fn() -> Option<ServoSetup>) {
    feed.take_records();
    feed.update_subscribers(scenes, |_| servo());
}

fn events(received: &mut mpsc::Receiver<ClientLine>) -> Vec<Event> {
    std::iter::from_fn(|| received.try_recv().ok())
        .map(|line| serde_json::from_str(&line.text).expect("an event"))
        .collect()
}

#[test]
fn what_a_slow_subscriber_misses_is_counted_and_reported() {
    let (mut producer, mut feed, mut received) = subscribed(outbox::RECORDS, &[Topic::Samples], 2, 1);
    let scenes = VecDeque::from([known(1)]);
    for tick in 0..10 {
        producer.push(None, || outbox::tests::record(tick));
        pump(&mut feed, &scenes, || None);
    }
    // One event fitted; ticks 2, 4, 6 and 8 did not.
    let first = events(&mut received);
    producer.push(None, || outbox::tests::record(10));
    pump(&mut feed, &scenes, || None);
    let [Event::Samples(first), Event::Samples(second)] = [&first[0], &events(&mut received)[0]] else {
        panic!("two sample events");
    };
    assert_eq!((first.seq, first.dropped, first.rows[0].tick), (0, 0, 0));
    assert_eq!((second.seq, second.dropped, second.rows[0].tick), (1, 4, 10));
}

// hazard: H20
#[test]
fn backlog_of_an_unreading_subscriber_is_bounded_in_bytes() {
    let (mut producer, consumer) = outbox::outbox(outbox::RECORDS);
    let mut feed = Feed::new(consumer, 1_000_000, None);
    // As many lines as a client has, in batches as long as they may be.
    let topics = [Topic::Samples, Topic::State, Topic::Log, Topic::Timing];
    let (subscription, mut received) = subscription(&topics, 1, BACKLOG_LINES);
    let room = Arc::clone(&subscription.room);
    feed.subscribers.subscribe(1, subscription, setup(0.5));
    let scenes = VecDeque::from([known(1)]);
    for tick in 0..40_000 {
        producer.push(None, || outbox::tests::record(tick));
        if tick % 256 == 255 {
            pump(&mut feed, &scenes, || None);
        }
    }
    let held: Vec<ClientLine> = std::iter::from_fn(|| received.try_recv().ok()).collect();
    let bytes: usize = held.iter().map(|line| line.text.capacity()).sum();
    println!("{bytes} bytes in {} lines wait, of {BACKLOG_BYTES}", held.len());
    assert!(bytes <= BACKLOG_BYTES && bytes > BACKLOG_BYTES / 2, "{bytes}");
    assert!(held.len() < BACKLOG_LINES, "the bytes bound it, not the lines");
    // Once it is written there is all the room again, and the missed rows are reported.
    drop(held);
    assert_eq!(room.available_permits(), BACKLOG_BYTES);
    for tick in 40_000..40_256 {
        producer.push(None, || outbox::tests::record(tick));
    }
    pump(&mut feed, &scenes, || None);
    let newer = events(&mut received);
    let Some(Event::Samples(samples)) = newer.first() else {
        panic!("no samples")
    };
    assert!(samples.dropped > 0 && samples.dropped < 40_000, "{}", samples.dropped);
}

fn setup(friction: f64) -> ServoSetup {
    let losses = RigLosses { damping: 0.0, friction };
    ServoSetup {
        settings: Settings { losses, ..SETTINGS },
        scheme: haptic_core::Scheme::Exact,
        device_resolution_m: 1e-5,
        device_force_limit_n: None,
        version: haptic_core::servo::VERSION,
    }
}

/// What each event is about: the revision of a state, the friction of the servo's settings, or the rows'
/// ticks.
fn summaries(events: &[Event]) -> Vec<String> {
    let about = |event: &Event| match event {
        Event::State(state) => format!("revision {} from {}", state.revision, state.tick),
        Event::Servo(event) => format!("{} N from {}", event.servo.settings.losses.friction, event.tick),
        Event::Samples(samples) => match &samples.rows[..] {
            [first, .., last] => format!("rows {} to {}", first.tick, last.tick),
            rows => format!("{} rows", rows.len()),
        },
        Event::Snapshot(event) => format!("snapshot before {}", event.tick),
        other => format!("{other:?}"),
    };
    events.iter().map(about).collect()
}

#[test]
fn state_and_settings_precede_their_rows_in_a_late_feed() {
    let (mut producer, mut feed, mut received) = subscribed(2000, &[Topic::State, Topic::Samples], 1, 64);
    let scenes = VecDeque::from([known(1), known(2)]);
    // The control thread was held up for 600 ticks. A scene took effect at 100, and the rig was engaged at 400.
    for tick in 0..600 {
        let mut record = outbox::tests::record(tick);
        record.revision = if tick < 100 { 1 } else { 2 };
        record.state = if tick < 400 { RigState::Idle } else { RigState::Engaged };
        producer.push(None, || record);
    }
    pump(&mut feed, &scenes, || Some(setup(0.7)));
    assert_eq!(
        summaries(&events(&mut received)),
        [
            "0.7 N from 0",
            "revision 1 from 0",
            "revision 2 from 100",
            "rows 0 to 255",
            "revision 2 from 400",
            "rows 256 to 511",
            "rows 512 to 599",
        ]
    );
    // What it was sent is not sent again, and a later one hears nothing of what came before it.
    let (newer, mut newer_received) = subscription(&[Topic::State], 1, 64);
    feed.subscribers.subscribe(2, newer, setup(0.3));
    for (tick, state) in [(600, RigState::Idle), (601, RigState::Idle), (602, RigState::Engaging)] {
        let mut record = outbox::tests::record(tick);
        (record.revision, record.state) = (2, state);
        producer.push(None, || record);
        pump(&mut feed, &scenes, || Some(setup(0.7)));
    }
    assert_eq!(
        summaries(&events(&mut received)),
        [
            "revision 2 from 600",
            "1 rows",
            "1 rows",
            "revision 2 from 602",
            "1 rows"
        ]
    );
    assert_eq!(
        summaries(&events(&mut newer_received)),
        ["revision 2 from 600", "0.7 N from 602", "revision 2 from 602"]
    );
}

#[test]
fn rows_begin_with_a_snapshot_and_another_follows_lost_rows() {
    let (mut producer, mut feed, mut received) = subscribed(16, &[Topic::Samples, Topic::Snapshot], 1, 64);
    let scenes = VecDeque::from([known(1)]);
    let mut servo = servo(0.1, compiled(&Scene::paper(), 1));
    let mut snapshot = || servo.snapshot().expect("no motion of its own");
    let mut go_on = |ticks: std::ops::Range<u64>, snapshot_at: Option<u64>, feed: &mut Feed| {
        for tick in ticks {
            if snapshot_at == Some(tick) {
                let snapshot = snapshot();
                let snapshot = Some(TickSnapshot { tick, snapshot });
                producer.send(FromLoop::Snapshot(Box::new(snapshot)));
            }
            producer.push(None, || outbox::tests::record(tick));
        }
        pump(feed, &scenes, || None);
        (summaries(&events(&mut received)), feed.is_snapshot_due())
    };
    let before = go_on(0..5, None, &mut feed);
    assert_eq!(before, (vec![], true), "they wait for the first one");
    feed.snapshot_asked();
    assert!(!feed.is_snapshot_due(), "it is asked for once");
    let said = |lines: &[&str], due| (lines.iter().map(ToString::to_string).collect::<Vec<_>>(), due);
    let begun = said(&["snapshot before 8", "rows 8 to 11"], false);
    assert_eq!(go_on(5..12, Some(8), &mut feed), begun);
    assert_eq!(go_on(12..15, None, &mut feed), said(&["rows 12 to 14"], false));
    // The queue holds sixteen.
    let lossy = said(&["rows 15 to 30"], false);
    assert_eq!(go_on(15..40, None, &mut feed), lossy, "nothing is known of it yet");
    assert_eq!(go_on(40..43, None, &mut feed), said(&["rows 40 to 42"], true));
    let again = said(&["snapshot before 44", "rows 43 to 46"], false);
    assert_eq!(go_on(43..47, Some(44), &mut feed), again);
}
