//! What a tick reports to its loop, and what it may be passed: another device, and that standing
//! still is no fault.

use super::*;

#[test]
fn a_tick_says_when_it_ended() {
    let mut bench = bench(ramp());
    let wake = Wake {
        deadline_ns: bench.clock_ns,
        began_ns: bench.clock_ns,
        asleep_ns: 0,
    };
    let before_ns = now_ns();
    let ended_ns = bench.tick.run(wake, 0);
    let record = bench.records.pop().expect("a record");
    assert_eq!(record.ended_ns, ended_ns);
    assert!((before_ns..=now_ns()).contains(&ended_ns));
}

#[test]
fn another_device_may_be_anywhere() {
    let mut first = bench(ramp());
    first.ticks(SETTLE);
    first.engage();
    let other = bench(std::iter::repeat_n(Ok(0.7), 10));
    first.tick.replace_device(other.tick.device);
    let record = first.tick();
    assert_eq!((record.sample_position, record.device_position), (0.7, 0.7));
    assert_eq!((record.state, record.fault), (RigState::Engaged, None));
}

#[test]
fn a_loop_that_may_stand_still_does_not_fault_by_it() {
    let mut bench = bench(ramp());
    bench.ticks(SETTLE);
    bench.engage();
    bench.tick.disregard_stalls();
    bench.tick.device.sample_ns = 1_000_000_000;
    let record = bench.tick_after(1_000_000_000);
    assert_eq!((record.state, record.fault), (RigState::Engaged, None));
}
