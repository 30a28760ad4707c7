//! An engagement holds for the device that was checked, and for no other.

use super::*;
use crate::rt::handoff::ANY_CONNECTION;
use crate::rt::rig_setup::{RigSetup, Setup, rig_setups};
use std::sync::atomic::AtomicU64;
use std::sync::atomic::Ordering::SeqCst;

/// A device that another is put in the place of.
struct Replaced {
    connection: Arc<AtomicU64>,
    sequence: u32,
}

impl Device for Replaced {
    fn description(&self) -> String {
        "replaced".to_owned()
    }

    fn resolution_m(&self) -> f64 {
        0.0
    }

    fn connection(&self) -> u64 {
        self.connection.load(SeqCst)
    }

    fn read(&mut self, now_ns: u64) -> Result<Measurement, DeviceError> {
        self.sequence += 1;
        Ok(Measurement::new(self.sequence, now_ns, 0.0))
    }

    fn write(&mut self, _force_n: f64, _enabled: bool) -> Result<Written, DeviceError> {
        Ok(Written::Taken)
    }
}

// hazard: H13
#[test]
fn engagement_for_a_replaced_device_is_refused() {
    let shared = Arc::new(Shared::new());
    let (producer, _records) = outbox::outbox();
    let connection = Arc::new(AtomicU64::new(1));
    let device = Replaced {
        connection: Arc::clone(&connection),
        sequence: 0,
    };
    let mut tick = Tick::new(
        Box::new(device),
        Arc::clone(&shared),
        producer,
        servo(0.02, compiled(&Scene::paper(), 1)),
        Lateness::new(LatePolicy::Warn),
        u64::MAX,
    );
    let mut serial = 0;
    let mut now_ns = 1_000_000_000;
    let mut engages = |admitted: u64| {
        serial += 1;
        shared.admit(admitted);
        shared.send(serial, Command::Engage, shared.stops());
        now_ns += 1_000_000;
        let wake = Wake {
            deadline_ns: now_ns,
            began_ns: now_ns,
            asleep_ns: 0,
        };
        tick.run(wake, 0);
        !shared.answers.command(serial).expect("it is answered").refused
    };
    assert!(engages(1), "the device that was checked");
    connection.store(2, SeqCst);
    assert!(!engages(1), "another one");
    assert!(!engages(0), "none was connected");
    assert!(engages(2));
    assert!(engages(ANY_CONNECTION), "one in this process");
}

#[test]
fn withdrawn_commands_leave_no_setup_behind() {
    let mut bench = bench(ramp());
    let (mut sender, receiver) = rig_setups();
    bench.tick = bench.tick.with_rig_setups(receiver);
    let setup = |friction| {
        Setup::Rig(RigSetup {
            losses: RigLosses { damping: 0.0, friction },
            compensation: None,
        })
    };
    // More of them than the queue holds.
    for serial in 1..=9 {
        assert!(sender.send(setup(f64::from(serial))), "no room for command {serial}");
        bench.shared.send(serial, Command::Engage, bench.shared.stops());
        bench.shared.withdraw(serial);
        if serial < 9 {
            bench.tick();
        }
    }
    assert_eq!(bench.tick.servo.state(), RigState::Idle);
    // The loop hears of the withdrawal between a setup and its command.
    assert!(sender.send(setup(42.0)));
    bench.tick();
    bench.serial = 9;
    assert!(!bench.command(Command::Engage).refused);
    assert_eq!(bench.tick.servo.settings().losses.friction, 42.0);
}

// hazard: H21
#[test]
fn limits_take_effect_even_if_their_announcement_is_replaced() {
    let mut bench = bench(ramp());
    let (mut sender, receiver) = rig_setups();
    bench.tick = bench.tick.with_rig_setups(receiver);
    let limits = |force_n| Limits {
        force_n,
        ..Limits::default()
    };
    let flagged = |record: &TickRecord| record.input_word.has_new_limits();
    assert!(sender.send(Setup::Limits(limits(7.0))));
    bench.shared.announce_setup(1);
    assert_eq!(bench.shared.answers.limits(), (0, 0));
    let record = bench.tick();
    assert!(
        flagged(&record) && !flagged(&bench.tick()),
        "in the first tick with them alone"
    );
    assert_eq!(bench.shared.answers.limits(), (1, record.tick));
    assert_eq!(bench.tick.servo.settings().limits, limits(7.0));

    // A command takes the place of the word before anybody looked.
    assert!(sender.send(Setup::Limits(limits(5.0))));
    bench.shared.announce_setup(2);
    bench.serial = 2;
    assert!(!bench.command(Command::Engage).refused);
    assert_eq!(bench.shared.answers.limits().0, 2);
    assert_eq!(bench.tick.servo.settings().limits, limits(5.0));
}
