//! What a tick reports to its loop and to the control thread.

use super::*;
use crate::rt::schedule::ScheduledScene;
use crate::rt::shared::{Claim, ClaimState};

/// Schedules a scene; what becomes of it.
pub(super) fn schedule(bench: &mut Bench, at_tick: u64, revision: u64) -> Arc<Claim> {
    let claim = Arc::new(Claim::new());
    let scene = Some(compiled(&Scene::paper(), revision).into());
    let change = ScheduledScene {
        at_tick,
        scene,
        claim: Arc::clone(&claim),
    };
    assert!(bench.inbox.send(ToLoop::Scheduled(change)));
    claim
}

#[test]
fn scheduled_scene_is_rendered_in_its_tick_unless_the_rig_halts() {
    let mut bench = bench(ramp());
    bench.ticks(SETTLE);
    bench.engage();
    let next = bench.tick.tick;
    let claim = schedule(&mut bench, next + 3, 7);
    let revisions: Vec<u64> = (0..5).map(|_| bench.tick().revision).collect();
    assert_eq!(revisions, [1, 1, 1, 7, 7]);
    assert_eq!(claim.state(), ClaimState::Rendered(next + 3));
    assert_eq!(bench.records.answers().decided, 1);

    let claim = schedule(&mut bench, next + 100, 8);
    bench.tick();
    assert_eq!(claim.state(), ClaimState::Open);
    bench.shared.stop();
    bench.ticks(2);
    assert_eq!(claim.state(), ClaimState::Halted);
    assert_eq!(bench.records.answers().decided, 2);
    assert_eq!(bench.tick().revision, 7);
}

#[test]
fn the_last_word_is_zero_force_and_says_whether_it_was_taken() {
    let mut bench = bench(ramp());
    bench.ticks(SETTLE);
    bench.engage();
    for (writing, is_linked, motor, is_zero) in [
        (Written::Taken, false, Motor::Unreported, true),
        (Written::Later, false, Motor::Unreported, false),
        (Written::Taken, true, Motor::Unreported, true),
        (Written::Taken, true, Motor::Off, true),
        (Written::Taken, true, Motor::Enabled, false),
        (Written::Later, true, Motor::Off, false),
    ] {
        bench.tick.device.writing = Ok(writing);
        bench.tick.device.motor = motor;
        bench.tick.bounds.is_linked = is_linked;
        let zero = bench.tick.zero_force(bench.clock_ns);
        assert_eq!(zero, Ok(is_zero), "{writing:?}, {is_linked}, {motor:?}");
        assert_eq!(bench.tick.device.enabled.last(), Some(&false));
    }
    bench.tick.device.writing = Err(DeviceError::Disconnected);
    assert_eq!(bench.tick.zero_force(bench.clock_ns), Err(DeviceError::Disconnected));
}

#[test]
fn a_snapshot_that_is_asked_for_is_of_the_next_tick() {
    let mut bench = bench(ramp());
    bench.ticks(SETTLE);
    assert!(bench.inbox.send(ToLoop::Snapshot(Box::new(None))));
    let tick = bench.tick().tick;
    let snapshot = bench.records.pop_snapshot().expect("it was asked for");
    assert_eq!(snapshot.tick, tick + 1);
}
