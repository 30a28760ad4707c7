//! A rig with a firmware of its own: what the loop, the host's side of the link and the firmware do together.

use super::*;
use device_io::fake::{Firmware, FirmwareProperties, Hand, HandMotion, Misbehaviour, RigProperties};
use device_io::link::{DirectRig, LoopTiming};
use haptic_core::servo::Fault;

const MS: u64 = 1_000_000;

/// Of the firmware's own watchdog, ns.
const WATCHDOG_NS: u64 = 50 * MS;

fn linked_with(settings: Settings, properties: FirmwareProperties) -> Bench<DirectRig> {
    let hand = Hand::Prescribed(HandMotion::Sine {
        amplitude_m: 0.03,
        frequency_hz: 1.0,
    });
    let firmware = Firmware::new(RigProperties::default(), hand, properties);
    let mut bench = bench_on(DirectRig::new(firmware, LoopTiming::default(), BEGAN_NS), settings);
    bench.ticks(SETTLE);
    bench
}

fn linked() -> Bench<DirectRig> {
    linked_with(SETTINGS, FirmwareProperties::default())
}

impl Bench<DirectRig> {
    fn firmware(&mut self) -> &mut Firmware {
        self.tick.device.firmware()
    }

    fn misbehave(&mut self, how: Misbehaviour) {
        let now_ns = self.clock_ns;
        assert_eq!(self.firmware().misbehave(how, now_ns), None);
    }

    /// Ticks until something is so, in half a second at most.
    fn tick_until(&mut self, what: &str, holds: impl Fn(&mut Self) -> bool) {
        for _ in 0..500 {
            if holds(self) {
                return;
            }
            self.tick();
        }
        panic!("waited in vain for {what}");
    }

    /// Engages, and ticks until the motor pulls.
    fn pull(&mut self) {
        self.engage();
        self.tick_until("a force", |bench| bench.firmware().force_n().abs() > 1.0);
    }

    /// Stops, and ticks until the stop is answered.
    fn stop(&mut self) -> Stopped {
        let stop = self.shared.stop();
        self.tick_until("an answer", |bench| bench.records.answers().stop(stop).is_some());
        self.records.answers().stop(stop).expect("it is answered")
    }
}

// hazard: H12
#[test]
fn firmware_confirms_a_stop_or_it_ends_unconfirmed() {
    let mut bench = linked();
    bench.pull();
    let stopped = bench.stop();
    assert_eq!(stopped.confirmation, StopConfirmation::Confirmed);
    assert!(stopped.written_ns < stopped.confirmed_ns, "written, then confirmed");
    assert_eq!(bench.firmware().force_n(), 0.0, "it is off when that is reported");
    bench.command(Command::Reset);
    bench.pull();
    bench.misbehave(Misbehaviour::NoEcho);
    assert_eq!(bench.stop().confirmation, StopConfirmation::Unconfirmed);
}

// hazard: H9
#[test]
fn firmware_that_stays_enabled_is_an_alarm_until_it_is_honest() {
    let mut bench = linked();
    bench.pull();
    bench.misbehave(Misbehaviour::StayEnabled);
    assert_eq!(bench.stop().confirmation, StopConfirmation::Unconfirmed);
    let is_alarmed = |bench: &mut Bench<DirectRig>| bench.tick().fault == Some(Fault::StillEnabled);
    bench.tick_until("the alarm", is_alarmed);
    bench.command(Command::Reset);
    bench.tick_until("the alarm again", is_alarmed);
    bench.misbehave(Misbehaviour::Honest);
    bench.ticks(5);
    bench.command(Command::Reset);
    bench.ticks(300);
    assert_eq!(bench.tick().state, RigState::Idle);
}

// hazard: H19
#[test]
fn buttons_of_a_firmware_release_and_stop() {
    let settings = Settings {
        enable_button: Some(1),
        ..SETTINGS
    };
    let properties = FirmwareProperties {
        buttons: 0b11,
        ..FirmwareProperties::default()
    };
    let mut bench = linked_with(settings, properties);
    assert!(
        bench.command(Command::Engage).refused,
        "nobody holds the enable button down"
    );
    for (button, pressed, state, fault) in [
        (2, false, RigState::Idle, None),
        (1, true, RigState::Stopped, Some(Fault::StopButton)),
    ] {
        bench.misbehave(Misbehaviour::Button(2, true));
        bench.tick();
        bench.pull();
        bench.misbehave(Misbehaviour::Button(button, pressed));
        let record = bench.tick();
        assert_eq!((record.state, record.fault, record.command_force), (state, fault, 0.0));
        assert_eq!(bench.firmware().force_n(), 0.0);
    }
}

// hazard: H8
#[test]
fn no_force_exceeds_the_firmwares_limit_and_none_is_claimed() {
    let properties = FirmwareProperties {
        force_limit_n: 1.0,
        ..FirmwareProperties::default()
    };
    let mut bench = linked_with(SETTINGS, properties);
    bench.engage();
    let forces_n = (0..1000).map(|_| bench.tick().command_force.abs());
    assert_eq!(forces_n.fold(0.0, f64::max), 1.0);
    assert_eq!(bench.firmware().take_largest_force_n(), 1.0);
}

// hazard: F5
#[test]
fn without_a_loop_the_firmwares_watchdog_ends_the_force() {
    let mut bench = linked();
    bench.pull();
    // The loop is killed.
    let killed_ns = bench.clock_ns;
    let firmware = bench.firmware();
    firmware.advance(killed_ns + WATCHDOG_NS - 1);
    assert!(firmware.force_n().abs() > 1.0 && !firmware.watchdog_has_tripped());
    firmware.advance(killed_ns + WATCHDOG_NS);
    assert!(firmware.force_n() == 0.0 && firmware.watchdog_has_tripped());
}

// hazard: F19
#[test]
fn a_release_ends_the_force_without_the_firmwares_watchdog() {
    let mut bench = linked();
    bench.pull();
    bench.command(Command::Release);
    bench.tick_until("an end", |bench| bench.tick().state == RigState::Idle);
    bench.tick();
    let firmware = bench.firmware();
    assert!(firmware.force_n() == 0.0 && !firmware.watchdog_has_tripped());
}

// hazard: F2
#[test]
fn a_rig_that_was_unplugged_comes_back_without_force() {
    for (stops, state) in [(false, RigState::Idle), (true, RigState::Stopped)] {
        let mut bench = linked();
        bench.pull();
        bench.tick.device.unplug();
        assert_eq!(bench.tick().state, RigState::Disconnected);
        if stops {
            assert_eq!(bench.stop().confirmation, StopConfirmation::NoDevice);
        }
        bench.ticks(60);
        assert!(bench.firmware().watchdog_has_tripped());
        bench.firmware().take_largest_force_n();
        bench.tick.device.plug_in();
        bench.ticks(100);
        assert_eq!(bench.tick().state, state);
        assert_eq!(bench.firmware().take_largest_force_n(), 0.0);
    }
}
