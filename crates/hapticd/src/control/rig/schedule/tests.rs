//! What becomes of a change whose fate the loop decides while something else is done here.

use super::*;
use crate::control::rig::fixture::rig;
use crate::rt::claim::ClaimState;
use crate::rt::outbox::tests::record;

#[test]
fn change_rendered_during_history_read_is_entered_afterwards() {
    let (rig, mut producer) = rig();
    producer.push(|| record(0));
    rig.pump();
    let changed = Scene::paper().with(&[("Fs".parse().expect("a key"), 5.0)]);
    let scene = Rc::new(changed.expect("a scene"));
    let change = NewChange {
        at_tick: 100,
        compiled: rig
            .compile_from(&Scene::paper(), &scene, 0.0)
            .expect("it can be rendered"),
        scene: Rc::clone(&scene),
        step: Move::Forward,
        entry: JournalEntry::of("set"),
    };
    let peer = Peer::default();
    let by = Requester {
        session: 1,
        peer: &peer,
    };
    let revision = rig.schedule(by, false, 1, vec![change]).expect("there is room");
    let claim = Arc::clone(&rig.schedule.borrow().waiting[0].claim);

    let history = rig.history();
    assert!(claim.decide(ClaimState::Rendered(100)));
    rig.pump();
    assert_eq!(history.newest().revision, 1);
    drop(history);
    rig.pump();
    assert_eq!((rig.revision(), rig.scene().clone()), (revision, scene));
    assert_eq!(rig.journal(0, 9).entries[0].tick, Some(100));
}
