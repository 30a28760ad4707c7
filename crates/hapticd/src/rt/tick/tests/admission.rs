//! An engagement holds for the device that was checked, and for no other.

use super::*;
use crate::rt::handoff::ANY_CONNECTION;
use crate::rt::inbox::{RigSetup, SentCommand, ToLoop};

// hazard: H13
#[test]
fn engagement_for_a_replaced_device_is_refused() {
    let mut bench = bench(ramp());
    let engages = |bench: &mut Bench, admitted: u64| {
        bench.serial += 1;
        assert!(bench.inbox.send(engage(bench.serial, admitted, None)));
        bench.tick();
        let outcome = bench.records.answers().command(bench.serial);
        !outcome.expect("it is answered").refused
    };
    assert!(engages(&mut bench, 1), "the device that was checked");
    bench.tick.device.connection = 2;
    assert!(!engages(&mut bench, 1), "another one");
    assert!(!engages(&mut bench, 0), "none was connected");
    assert!(engages(&mut bench, 2));
    assert!(engages(&mut bench, ANY_CONNECTION), "one in this process");
}

/// A command to engage the device of a connection.
pub(super) fn engage(serial: u64, connection: u64, rig: Option<RigSetup>) -> ToLoop {
    let sent = SentCommand {
        serial,
        command: Command::Engage,
        stops_known: 0,
        connection,
        is_of_lapse: false,
    };
    ToLoop::Command { sent, rig }
}

#[test]
fn withdrawn_commands_engage_nothing() {
    let mut bench = bench(ramp());
    let setup = |friction| RigSetup {
        losses: RigLosses { damping: 0.0, friction },
        compensation: None,
    };
    let friction = |bench: &Bench| bench.tick.servo.settings().losses.friction;
    for serial in 1..=9_u32 {
        let setup = setup(f64::from(serial));
        assert!(bench.inbox.send(engage(serial.into(), ANY_CONNECTION, Some(setup))));
        bench.shared.withdraw(serial.into());
    }
    // The control thread takes the newest rig that it sent for the servo's, in recordings too.
    assert_eq!((bench.tick().state, friction(&bench)), (RigState::Idle, 9.0));
    assert_eq!(bench.records.answers().command(9), None);
    // More of them, and one that holds: it is carried out in the same tick.
    assert!(bench.inbox.send(engage(10, ANY_CONNECTION, Some(setup(10.0)))));
    bench.shared.withdraw(10);
    assert!(bench.inbox.send(engage(11, ANY_CONNECTION, Some(setup(42.0)))));
    assert_eq!((bench.tick().state, friction(&bench)), (RigState::Engaging, 42.0));
}

#[test]
fn a_tick_carries_out_one_command_and_answers_each() {
    let mut bench = bench(ramp());
    for (serial, command) in [(1, Command::Engage), (2, Command::Release)] {
        assert!(bench.inbox.command(serial, command, 0));
    }
    bench.inbox.post(compiled(&Scene::paper(), 2));
    let ticks = [bench.tick(), bench.tick()];
    assert_eq!(ticks.map(|record| record.revision), [1, 2], "in the order sent");
    assert_eq!(ticks.map(|record| record.state == RigState::Engaging), [true, false]);
    let outcome = bench.records.answers().command(2).expect("answered");
    assert_eq!((outcome.tick, outcome.refused), (ticks[1].tick, false));
}

// hazard: H21
#[test]
fn limits_hold_from_the_tick_that_answers_them() {
    let mut bench = bench(ramp());
    let limits = Limits {
        force_n: 7.0,
        ..Limits::default()
    };
    let flagged = |record: &TickRecord| record.input_word.has_new_limits();
    assert!(bench.inbox.send(ToLoop::Limits { serial: 1, limits }));
    // With a command right behind them.
    assert!(bench.inbox.send(engage(2, ANY_CONNECTION, None)));
    let record = bench.tick();
    assert_eq!(
        (record.state, bench.tick.servo.settings().limits),
        (RigState::Engaging, limits)
    );
    assert!(
        flagged(&record) && !flagged(&bench.tick()),
        "in the first tick with them alone"
    );
    assert!(bench.inbox.send(ToLoop::Limits { serial: 3, limits }));
    let tick = bench.tick().tick;
    let answered = bench
        .records
        .answers()
        .command(3)
        .map(|outcome| (outcome.tick, outcome.refused));
    assert_eq!(answered, Some((tick, false)));
}
