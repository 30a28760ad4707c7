//! An engagement holds for the device that was checked, and for no other.

use super::*;
use crate::rt::handoff::ANY_CONNECTION;
use std::sync::atomic::{AtomicU64, Ordering::SeqCst};

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
fn an_engagement_for_a_device_that_was_replaced_meanwhile_is_refused() {
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
