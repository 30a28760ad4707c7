//! A clock that jitters, a loop that stalls or comes late, and the times that a record carries.

use super::*;
use haptic_core::servo::Fault;

#[test]
fn a_record_has_its_number_and_the_time_that_the_link_took() {
    let mut bench = bench(ramp());
    let first = bench.tick();
    assert_eq!((first.tick, bench.tick().tick, bench.tick().tick), (0, 1, 2));
    assert_eq!(first.device_round_trip_ns, 0, "no link");
    let takes = std::time::Duration::from_millis(2);
    bench.tick.device.link = Some(takes);
    bench.tick.device.connection += 1;
    bench.clock_ns = now_ns();
    let record = bench.tick_after(0);
    assert!(record.ended_ns <= now_ns());
    let round_trip = std::time::Duration::from_nanos(record.device_round_trip_ns);
    let whole = std::time::Duration::from_nanos(record.ended_ns - record.began_ns);
    assert!(
        2 * takes <= round_trip && round_trip <= whole,
        "{round_trip:?} of {whole:?}"
    );
}

#[test]
fn held_up_tick_is_timed_at_its_reading() {
    let mut bench = bench(ramp());
    let held_up = std::time::Duration::from_millis(5);
    bench.tick.device.connection += 1;
    let ticks = [std::time::Duration::ZERO, held_up, std::time::Duration::ZERO].map(|takes| {
        bench.tick.device.link = Some(takes);
        bench.clock_ns = now_ns();
        bench.tick_after(0)
    });
    let [first, late, next] = &ticks;
    let held_up_ns = 5_000_000;
    assert!(
        late.elapsed_ns >= late.began_ns + held_up_ns - first.ended_ns,
        "{late:?} after {first:?}"
    );
    assert!(
        next.elapsed_ns <= next.ended_ns - (late.began_ns + held_up_ns),
        "{next:?} after {late:?}"
    );
}

// hazard: P6
#[test]
fn the_jitter_of_our_own_clock_is_not_felt() {
    let run = |jitter_ns: u64| {
        let mut bench = bench(ramp());
        bench.ticks(SETTLE);
        bench.engage();
        bench.ticks(300);
        let records: Vec<TickRecord> = (0..200)
            .map(|k| {
                bench.tick_after(if k % 2 == 0 {
                    1_000_000 - jitter_ns
                } else {
                    1_000_000 + jitter_ns
                })
            })
            .collect();
        records
    };
    for (even, uneven) in run(0).iter().zip(&run(700_000)) {
        assert_eq!(even.device_velocity, uneven.device_velocity);
        assert_eq!(even.command_force, uneven.command_force);
    }
}

// hazard: H7
#[test]
fn stall_or_machine_sleep_under_force_is_a_fault() {
    for (stalls_ns, sleeps_ns, fault) in [
        (STALE_NS, 0, None),
        (STALE_NS + 1, 0, Some(Fault::Stalled)),
        (1_000_000_000, 0, Some(Fault::Stalled)),
        (1_000_000, STALE_NS, None),
        // The monotonic clock stands still while the machine sleeps.
        (1_000_000, 10_000_000_000, Some(Fault::Stalled)),
    ] {
        let mut bench = bench(ramp());
        bench.asleep_ns = 3_600_000_000_000;
        bench.ticks(SETTLE);
        bench.engage();
        bench.tick.device.sample_ns = stalls_ns;
        bench.asleep_ns += sleeps_ns;
        let record = bench.tick_after(stalls_ns);
        assert_eq!(record.fault, fault, "{stalls_ns} ns, {sleeps_ns} ns");
        assert_eq!(record.command_force == 0.0, fault.is_some(), "{record:?}");
    }
}

#[test]
fn a_stall_skips_no_ramp_and_lifts_no_slew_limit() {
    // At rest, and a millimetre on after the stall, on a spring that gives all the force there is.
    let still = || std::iter::repeat_n(Ok(0.0), 150);
    let slew_n_per_s = 1000.0;
    let mut bench = bench_with(slewed(slew_n_per_s), still().chain(std::iter::repeat_n(Ok(1e-3), 10)));
    bench.inbox.post(compiled(&scenes()[5], 2));
    bench.clock_ns += 3_000_000_000;
    bench.command(Command::Engage);
    bench.tick.device.sample_ns = STALE_NS;
    assert_eq!(bench.tick_after(STALE_NS).state, RigState::Engaging);
    bench.tick.device.sample_ns = 1_000_000;
    bench.ticks(147);
    assert_eq!(bench.tick().state, RigState::Engaged);
    bench.tick.device.sample_ns = STALE_NS;
    let after = bench.tick_after(STALE_NS);
    assert!(after.coupling_force.abs() > MAX_FORCE, "{after:?}");
    assert_eq!(after.command_force.abs(), slew_n_per_s * MAX_STEP_S, "{after:?}");
    bench.tick.device.sample_ns = 1_000_000;
    let next = bench.tick();
    assert_eq!(next.command_force.abs(), slew_n_per_s * (MAX_STEP_S + 1e-3));
}

#[test]
fn only_periods_missed_under_force_make_the_loop_too_late() {
    let mut bench = bench(ramp());
    bench.ticks(SETTLE);
    // Idle, and late in many ticks: nobody is harmed.
    for _ in 0..100 {
        bench.missed_periods += 3;
        bench.tick();
    }
    bench.command(Command::Engage);
    bench.ticks(5);
    assert_eq!(bench.tick().fault, None, "what was missed while it was idle");
    // Four at the end of a second, four at the beginning of the next.
    bench.missed_periods += 4;
    assert_eq!(bench.tick().fault, None);
    bench.missed_periods += 4;
    assert_eq!(bench.tick().fault, Some(Fault::TooLate));
}
