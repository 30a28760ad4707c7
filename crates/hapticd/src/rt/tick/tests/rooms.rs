//! What goes back to the control thread, and what waits while there is no room for it.

use super::reports::schedule;
use super::*;
use crate::rt::outbox::tests::record;
use crate::rt::space::FIRST_AXIS;
use haptic_ipc::MAX_SCHEDULED_CHANGES;

/// Fills the outbox but for so many entries.
fn fill(bench: &mut Bench, room: usize) {
    while bench.tick.outbox.room() > room {
        bench.tick.outbox.send(FromLoop::Rendered { revision: 1, tick: 0 });
    }
}

#[test]
fn of_scenes_and_motions_in_a_tick_the_last_is_rendered() {
    let mut bench = bench(ramp());
    let mut rendered = |is_motion_last: bool, revision| {
        if !is_motion_last {
            bench.inbox.post_motion(OwnMotion::REST, FIRST_AXIS);
        }
        bench.inbox.post(compiled(&Scene::paper(), revision));
        if is_motion_last {
            bench.inbox.post_motion(OwnMotion::REST, FIRST_AXIS);
        }
        bench.tick();
        (bench.tick.servo.own_motion().is_some(), bench.tick.scene().revision)
    };
    assert_eq!(rendered(true, 2), (true, 1));
    assert_eq!(rendered(false, 3), (false, 3));
}

#[test]
fn replaced_scene_goes_back_once_there_is_room() {
    let mut bench = bench(ramp());
    bench.inbox.post(compiled(&Scene::paper(), 2));
    bench.tick();
    fill(&mut bench, 0);
    bench.tick.hand_back_retired();
    assert!(bench.tick.servo.has_retired(), "without room it is kept");
    while bench.records.pop().is_some() {}
    let room = bench.tick.outbox.room();
    bench.tick.hand_back_retired();
    assert!(!bench.tick.servo.has_retired());
    assert_eq!(bench.tick.outbox.room(), room - 1);
}

#[test]
fn entry_waits_while_only_the_schedule_has_room() {
    let mut bench = bench(ramp());
    let scheduled = [2000, 2001].map(|tick| schedule(&mut bench, tick, tick));
    bench.tick();
    bench.inbox.post(compiled(&Scene::paper(), 2));
    let needed = ROOM_OF_ONE * (scheduled.len() + 2);
    fill(&mut bench, needed - 1);
    assert_eq!(bench.rendered_unread(), 1);
    while bench.records.pop().is_some() {}
    fill(&mut bench, needed);
    assert_eq!(bench.rendered_unread(), 2);
}

#[test]
fn full_schedule_and_unread_records_keep_no_command_waiting() {
    let mut bench = bench(ramp());
    for change in 0..MAX_SCHEDULED_CHANGES as u64 {
        schedule(&mut bench, 2000 + change, 2 + change);
    }
    bench.tick();
    for tick in 0..2 * RECORDS as u64 {
        bench.tick.outbox.push(None, || record(tick));
    }
    bench.inbox.command(1, Command::Engage, 0);
    bench.rendered_unread();
    while bench.records.pop().is_some() {}
    assert!(bench.records.answers().command(1).is_some());
}
