use super::*;
use crate::own_motion::OwnMotion;
use alloc::vec::Vec;
use proptest::prelude::*;

const PERIOD_S: f64 = 1e-3;

fn chirp() -> Excitation {
    Excitation {
        course: course::tests::chirp(5e-3, 0.5, 3.0, 4.0),
        force_limit_n: 4.0,
        slew_limit_n_per_s: 200.0,
        stiffness_n_per_m: 1000.0,
        damping_ns_per_m: 20.0,
        travel_limit_m: 8e-3,
        speed_limit_mps: 0.3,
        lag_limit_m: 6e-3,
        wrong_way_limit_m: 1e-4,
    }
}

fn sweep() -> Excitation {
    Excitation {
        course: course::tests::sweep(4e-3, 8e-3, 1),
        ..chirp()
    }
}

/// An excitation that begins at a position with the next tick.
fn placed(excitation: Excitation, position: f64) -> OwnMotion {
    let mut motion = OwnMotion::excitation(excitation, PERIOD_S).expect("bounded");
    motion.place(position, 0.0);
    motion
}

fn on_hand(motion: &mut OwnMotion, position: f64, velocity: f64) -> f64 {
    -motion.tick(PERIOD_S, position, velocity)
}

/// A handle of 1 kg with 0.5 N of friction, whose motor has a sign: where it was after each tick,
/// and the force.
fn driven(excitation: Excitation, sign: f64) -> (Vec<(f64, f64)>, OwnMotion) {
    let mut motion = placed(excitation, 0.1);
    let (mut position, mut velocity): (f64, f64) = (0.1, 0.0);
    let mut seen = Vec::new();
    while motion.end().is_none() {
        let force = on_hand(&mut motion, position, velocity);
        seen.push((position, force));
        for _ in 0..10 {
            let free = velocity + 1e-4 * sign * force;
            velocity = if free.abs() <= 0.5e-4 {
                0.0
            } else {
                free - 0.5e-4 * free.signum()
            };
            position += 1e-4 * velocity;
        }
        assert!(seen.len() < 20_000, "it never ends");
    }
    (seen, motion)
}

#[test]
fn a_free_handle_follows_the_reference_to_the_end() {
    for excitation in [chirp(), sweep()] {
        let (seen, motion) = driven(excitation, 1.0);
        assert_eq!(motion.end(), Some(MotionEnd::Time));
        let ticks = excitation.duration_s() / PERIOD_S;
        assert!((seen.len() as f64 - ticks).abs() < 3.0, "{} of {ticks}", seen.len());
        let farthest = seen.iter().map(|(at, _)| (at - 0.1).abs()).fold(0.0, f64::max);
        assert!(farthest > 3e-3 && farthest < 7e-3, "{farthest}");
        let last = seen.iter().rposition(|(_, force)| *force != 0.0).expect("a force");
        assert!(seen[last].1.abs() < 0.1, "it fades: {:?}", seen[last]);
    }
}

// hazard: F20
#[test]
fn stopped_device_clock_doubles_excitation_duration() {
    let mut motion = placed(sweep(), 0.1);
    let (mut ticks, mut greatest) = (0, 0.0_f64);
    while motion.end().is_none() {
        let position = motion.reference().0;
        greatest = greatest.max(position - 0.1);
        motion.tick(0.0, position, 0.0);
        ticks += 1;
        assert!(ticks < 20_000, "it never ends");
        assert!(
            ticks != 500 || position > 0.1005,
            "first it goes the positive way: {position} m"
        );
    }
    let expected = 2.0 * sweep().duration_s() / PERIOD_S;
    assert!((f64::from(ticks) - expected).abs() < 4.0, "{ticks} of {expected}");
    assert!(greatest > 3e-3, "{greatest} m");
}

// hazard: H13
#[test]
fn reversed_motor_ends_excitation_after_short_travel() {
    for excitation in [chirp(), sweep()] {
        let (seen, motion) = driven(excitation, -1.0);
        assert_eq!(motion.end(), Some(MotionEnd::WrongWay));
        let farthest = seen.iter().map(|(at, _)| (at - 0.1).abs()).fold(0.0, f64::max);
        assert!(farthest < 1.5e-3, "{farthest} m");
        assert!(seen.len() < 1500, "{} ticks", seen.len());
    }
}

// hazard: F20
#[test]
fn held_handle_meets_force_limit_and_ends_excitation() {
    let mut excitation = chirp();
    excitation.lag_limit_m = 4.5e-3;
    let mut motion = placed(excitation, 0.0);
    let forces: Vec<f64> = (0..4000).map(|_| on_hand(&mut motion, 0.0, 0.0)).collect();
    let largest = forces.iter().fold(0.0, |most: f64, force| most.max(force.abs()));
    assert_eq!(largest, 4.0, "held at the limit");
    assert!(motion.end().is_some());
    let last = forces.iter().rposition(|force| *force != 0.0).expect("a force");
    assert!(last < 1500, "held until tick {last}");
}

#[test]
fn exceeded_bound_or_nan_ends_excitation_for_good() {
    for (position, velocity, end) in [
        (0.0081, 0.0, MotionEnd::Travel),
        (-0.0081, 0.0, MotionEnd::WrongWay),
        (0.0, 0.31, MotionEnd::Speed),
        (0.0, -0.31, MotionEnd::Speed),
        (0.0065, 0.0, MotionEnd::Lag),
        (f64::NAN, 0.0, MotionEnd::Travel),
        (0.0, f64::NEG_INFINITY, MotionEnd::Speed),
    ] {
        let mut motion = placed(chirp(), 0.0);
        for _ in 0..100 {
            on_hand(&mut motion, 0.0, 0.0);
        }
        assert!(on_hand(&mut motion, 0.0, 0.0) != 0.0);
        assert_eq!(
            on_hand(&mut motion, position, velocity),
            0.0,
            "{position} m, {velocity} m/s"
        );
        assert_eq!(motion.end(), Some(end));
        assert_eq!(on_hand(&mut motion, 0.0, 0.0), 0.0, "and stays so");
    }
}

#[test]
fn a_device_of_half_the_rate_has_the_same_course() {
    let place_after = |elapsed: &dyn Fn(u32) -> f64| {
        let mut motion = placed(sweep(), 0.0);
        for tick in 0..=1000 {
            motion.tick(elapsed(tick), 0.0, 0.0);
        }
        motion.reference().0
    };
    let whole = place_after(&|tick| if tick == 0 { 0.0 } else { PERIOD_S });
    let halves = place_after(&|tick| if tick % 2 == 0 && tick > 0 { 2.0 * PERIOD_S } else { 0.0 });
    assert!((whole - halves).abs() < 1e-9, "{whole} {halves}");
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    // hazard: F20
    #[test]
    fn excitation_stays_bounded_for_any_device_input(
        is_chirp in any::<bool>(),
        start in -1.0..1.0f64,
        wild in prop::collection::vec((any::<f64>(), any::<f64>(), any::<f64>()), 3),
        samples in prop::collection::vec((0.0..3e-3f64, -0.01..0.01f64, -0.4..0.4f64), 1..400),
        calm in 0..1000_usize,
    ) {
        let excitation = if is_chirp { chirp() } else { sweep() };
        let mut motion = placed(excitation, start);
        let quiet = core::iter::repeat_n((PERIOD_S, 0.0, 0.0), calm);
        let last = core::iter::repeat_n((0.0, 0.0, 0.0), 9000);
        let all = quiet.chain(samples).chain(wild).chain(last);
        let mut before = 0.0;
        for (elapsed_s, moved, velocity) in all {
            let position = start + moved;
            let force = -motion.tick(elapsed_s, position, velocity);
            prop_assert!(force.abs() <= excitation.force_limit_n, "{force} N");
            let step = f64::abs(force - before);
            prop_assert!(
                force == 0.0 || step <= excitation.slew_limit_n_per_s * PERIOD_S * (1.0 + 1e-9),
                "{before} to {force} N"
            );
            // Anything else than "within" has no force: NaN is not within.
            let is_within = (position - start).abs() <= excitation.travel_limit_m * (1.0 + 1e-9)
                && velocity.abs() <= excitation.speed_limit_mps;
            prop_assert!(is_within || force == 0.0, "{force} N at {moved} m, {velocity} m/s");
            before = force;
        }
        prop_assert!(motion.end().is_some());
        prop_assert_eq!(on_hand(&mut motion, start, 0.0), 0.0);
    }

    #[test]
    fn passive_handle_is_never_mistaken_for_reversed_motor(
        mass in 0.1..5.0f64, friction in 0.0..1.0f64, is_chirp in any::<bool>(),
    ) {
        let excitation = Excitation { speed_limit_mps: 0.5, travel_limit_m: 0.2, lag_limit_m: 0.2, ..if is_chirp { chirp() } else { sweep() } };
        let mut motion = placed(excitation, 0.0);
        let (mut position, mut velocity): (f64, f64) = (0.0, 0.0);
        let mut ticks = 0;
        while motion.end().is_none() {
            let counted = libm::round(position / 1e-5) * 1e-5;
            let force = on_hand(&mut motion, counted, velocity);
            let free = velocity + 1e-3 * force / mass;
            let most = 1e-3 * friction / mass;
            velocity = if free.abs() <= most { 0.0 } else { free - most * free.signum() };
            position += 1e-3 * velocity;
            ticks += 1;
            prop_assert!(ticks < 20_000, "it never ends");
        }
        prop_assert!(f64::from(ticks) * PERIOD_S > excitation.duration_s() - 0.01, "{ticks} ticks");
    }
}

#[test]
fn what_is_beyond_the_bounds_is_refused_by_its_field() {
    let along = |course| Excitation { course, ..chirp() };
    let of_chirp = |amplitude_m, to_hz, duration_s| along(course::tests::chirp(amplitude_m, 0.5, to_hz, duration_s));
    let of_sweep = |travel_m, speed_mps, rounds| along(course::tests::sweep(travel_m, speed_mps, rounds));
    let with = |change: fn(&mut Excitation)| {
        let mut excitation = chirp();
        change(&mut excitation);
        excitation
    };
    for (excitation, field) in [
        (with(|chirp| chirp.force_limit_n = f64::NAN), "force_limit_N"),
        (with(|chirp| chirp.force_limit_n = 0.0), "force_limit_N"),
        (with(|chirp| chirp.slew_limit_n_per_s = 1e5), "slew_limit_N_per_s"),
        (with(|chirp| chirp.stiffness_n_per_m = 1e6), "stiffness_N_per_m"),
        (with(|chirp| chirp.damping_ns_per_m = -1.0), "damping_Ns_per_m"),
        (with(|chirp| chirp.travel_limit_m = 0.3), "travel_limit_m"),
        (with(|chirp| chirp.speed_limit_mps = 0.6), "speed_limit_mps"),
        (with(|chirp| chirp.lag_limit_m = f64::INFINITY), "lag_limit_m"),
        (with(|chirp| chirp.wrong_way_limit_m = 0.1), "wrong_way_limit_m"),
        (of_chirp(9e-3, 3.0, 4.0), "amplitude_m"),
        (of_chirp(5e-3, 11.0, 4.0), "to_hz"),
        (of_chirp(5e-3, 9.9, 4.0), "to_hz"),
        (of_chirp(f64::NAN, 3.0, 4.0), "amplitude_m"),
        (of_chirp(5e-3, 3.0, 121.0), "duration_s"),
        (of_chirp(5e-3, 3.0, f64::NAN), "duration_s"),
        (of_sweep(9e-3, 1e-3, 1), "travel_m"),
        (of_sweep(5e-3, 0.4, 1), "speed_mps"),
        (of_sweep(5e-3, 0.0, 1), "speed_mps"),
        (of_sweep(5e-3, 1e-3, 0), "rounds"),
        (of_sweep(5e-3, 1e-3, 7), "duration_s"),
    ] {
        let error = OwnMotion::excitation(excitation, PERIOD_S).expect_err(field);
        assert_eq!(error.field, field, "{error}");
    }
    assert_eq!(chirp().check(), Ok(()));
    assert_eq!(sweep().check(), Ok(()));
}

#[test]
fn a_stall_does_not_put_the_reference_out_of_reach() {
    let mut motion = placed(chirp(), 0.1);
    // A handle that is always where the reference is.
    for _ in 0..3500 {
        let (position, velocity) = motion.reference();
        motion.tick(PERIOD_S, position, velocity);
    }
    let (position, velocity) = motion.reference();
    motion.tick(0.15, position, velocity);
    let moved_m = (motion.reference().0 - position).abs();
    // Half a period of 3 Hz would be 10 mm, and the lag's limit is 6 mm.
    assert!(motion.end().is_none() && moved_m < 6.0 * PERIOD_S * 0.1, "{moved_m}");
}
