//! What becomes of a change whose fate the loop decides while something else is done here.

use super::*;
use crate::control::rig::fixture::rig;
use crate::rt::outbox::tests::record;
use crate::rt::outbox::{FromLoop, TickRecord};
use crate::rt::shared::ClaimState;
use haptic_ipc::SceneRamp;

/// A change of `Fs`, and its scene.
fn change(rig: &RigHandle, at_tick: u64, static_force_n: f64) -> (NewChange, Rc<Scene>) {
    let changed = Scene::paper().with(&[("Fs".parse().expect("a key"), static_force_n)]);
    let scene = Rc::new(changed.expect("a scene"));
    let change = NewChange {
        at_tick,
        compiled: Compiled::new(&Scene::paper(), &scene, &rig.facts, 0.0).expect("it can be rendered"),
        scene: Rc::clone(&scene),
        step: Move::Forward,
        entry: JournalEntry::of("set"),
    };
    (change, scene)
}

fn schedule(rig: &RigHandle, base_revision: u64, changes: Vec<NewChange>) -> Result<u64, WireError> {
    let by = Requester {
        session: 1,
        peer: &Peer::default(),
    };
    rig.schedule_changes(by, false, base_revision, changes)
}

#[test]
fn a_rendered_change_is_entered_with_its_tick() {
    let (rig, mut loop_side) = rig();
    loop_side.outbox.push(None, || record(0));
    rig.pump();
    let (change, scene) = change(&rig, 100, 5.0);
    let revision = schedule(&rig, 1, vec![change]).expect("there is room");
    let claim = Arc::clone(&rig.schedule.borrow().waiting[0].claim);

    assert!(claim.decide(ClaimState::Rendered(100)));
    assert_eq!(rig.revision(), 1, "not before it is known here");
    rig.pump();
    assert_eq!((rig.revision(), rig.scene().clone()), (revision, scene));
    assert_eq!(rig.journal(0, 9).entries[0].tick, Some(100));
}

#[test]
fn the_loop_has_room_for_all_and_for_more_once_one_comes_back() {
    let (rig, mut loop_side) = rig();
    loop_side.outbox.push(None, || record(0));
    rig.pump();
    let all = (0..MAX_SCHEDULED_CHANGES as u64).map(|index| change(&rig, 100 + index, 5.0).0);
    assert_eq!(schedule(&rig, 1, all.collect()).ok(), Some(2));
    let more = || vec![change(&rig, 1000, 6.0).0];
    let last_revision = 1 + MAX_SCHEDULED_CHANGES as u64;
    let refused = schedule(&rig, last_revision, more()).expect_err("no room");
    assert_eq!((refused.code, refused.max), (ErrorCode::OutOfRange, Some(0.0)));
    let Ok(ToLoop::Scheduled(first)) = loop_side.inbox.pop() else {
        panic!("they were sent");
    };
    assert!(first.claim.decide(ClaimState::Rendered(100)));
    loop_side.outbox.send(FromLoop::Decided(first));
    assert_eq!(schedule(&rig, last_revision, more()).ok(), Some(last_revision + 1));
}

#[test]
fn a_scheduled_change_waits_for_the_ramp_under_way() {
    let (rig, mut loop_side) = rig();
    rig.history_mut().moved(Move::Forward, Scene::paper().into());
    let (from, over_s) = (Scene::paper(), 1.0);
    rig.history_mut().keep_ramp(Some(SceneRamp { from, over_s }), 250);
    let tick = TickRecord {
        revision: rig.revision(),
        ramp_steps: 25,
        ..record(0)
    };
    loop_side.outbox.push(None, || tick);
    rig.pump();
    let at = |tick| schedule(&rig, rig.revision(), vec![change(&rig, tick, 5.0).0]);
    let refused = at(899).expect_err("the ramp is under way");
    assert_eq!((refused.code, refused.min), (ErrorCode::OutOfRange, Some(900.0)));
    at(900).expect("the ramp is over");
}
