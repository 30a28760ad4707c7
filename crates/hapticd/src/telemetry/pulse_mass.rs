//! The mass that a pulse moves: the motor's work, less that of the friction, is in the motion where it is fastest.
//!
//! The command of a tick acts on the motion within a round trip of the link, which is not known better. So the mass is
//! computed for both ends of that, each with what the encoder's steps may hide, and its interval holds both.

use std::collections::VecDeque;

/// Window over which the speed is taken, ns.
const SPEED_WINDOW_NS: u64 = 10_000_000;

/// Least distance within that window, in counts, and least share of the motor's work that is in the motion then: below,
/// the encoder or the friction says more than the mass.
const MIN_COUNTS: f64 = 20.0;
const MIN_SHARE: f64 = 0.3;

/// A tick of a pulse.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    pub(super) began_ns: u64,
    /// When the device took the sample, by its own time, ns.
    pub(super) device_ns: u64,
    /// Since the tick before, m.
    pub(super) moved_m: f64,
    /// The commanded force, N.
    pub(super) force_n: f64,
}

/// How far the handle has come, and what the motor has done.
#[derive(Clone, Copy, Debug, Default)]
struct Reached {
    device_ns: u64,
    path_m: f64,
    work_j: f64,
}

/// The middle of an interval that holds the mass, and half its width, kg, where a pulse whose force acts `delay_ns` at
/// most after its command tells it, on an encoder of this resolution, m.
pub(super) fn mass_within(ticks: &[Seen], delay_ns: u64, resolution_m: f64) -> Option<(f64, f64)> {
    let [at_once, late] = [0, delay_ns].map(|delay_ns| with_delay(ticks, delay_ns, resolution_m));
    let [(kg, reach_kg), (late_kg, late_reach_kg)] = [at_once?, late?];
    let least_kg = (kg - reach_kg).min(late_kg - late_reach_kg);
    let most_kg = (kg + reach_kg).max(late_kg + late_reach_kg);
    Some((0.5 * (least_kg + most_kg), 0.5 * (most_kg - least_kg)))
}

/// The mass, and how far off the encoder may have put it, kg, where the force acts `delay_ns` after its command.
fn with_delay(ticks: &[Seen], delay_ns: u64, resolution_m: f64) -> Option<(f64, f64)> {
    let (mut at, mut delayed) = (Reached::default(), 0);
    let mut window: VecDeque<Reached> = VecDeque::new();
    let (mut fastest, mut fastest_m, mut fastest_ns) = (Reached::default(), 0.0, 0);
    let mut largest_n = 0.0_f64;
    for (last, seen) in ticks.iter().zip(&ticks[1.min(ticks.len())..]) {
        // The force that acted between the two.
        let acts_since_ns = last.began_ns.saturating_sub(delay_ns);
        while ticks
            .get(delayed + 1)
            .is_some_and(|next| next.began_ns <= acts_since_ns)
        {
            delayed += 1;
        }
        let is_before_the_first = ticks[delayed].began_ns > acts_since_ns;
        let force_n = if is_before_the_first {
            0.0
        } else {
            ticks[delayed].force_n
        };
        at.device_ns = seen.device_ns;
        at.path_m += seen.moved_m.abs();
        at.work_j += force_n * seen.moved_m;
        // Near its end a pulse falls, and the delay would count for more.
        largest_n = largest_n.max(last.force_n.abs());
        if last.force_n.abs() < largest_n {
            window.clear();
            continue;
        }
        window.push_back(at);
        while let Some(from) = window.front().copied() {
            let time_ns = at.device_ns.saturating_sub(from.device_ns);
            if time_ns < SPEED_WINDOW_NS {
                break;
            }
            let distance_m = at.path_m - from.path_m;
            if distance_m > fastest_m {
                (fastest_m, fastest_ns) = (distance_m, time_ns);
                fastest = halfway(&window, from.device_ns + time_ns / 2)?;
            }
            window.pop_front();
        }
    }
    let friction_j = at.work_j / at.path_m * fastest.path_m;
    let motion_j = fastest.work_j - friction_j;
    #[expect(clippy::cast_precision_loss, reason = "nanoseconds of a window")]
    let speed_mps = fastest_m / (fastest_ns as f64 * 1e-9);
    let tells = fastest_m >= MIN_COUNTS * resolution_m && fastest_m > 0.0 && motion_j >= MIN_SHARE * fastest.work_j;
    let kg = 2.0 * motion_j / (speed_mps * speed_mps);
    // Each of both ends of a distance may be off by half a step.
    let of_speed = 2.0 * resolution_m / fastest_m;
    let of_work = resolution_m / fastest.path_m * (fastest.work_j + friction_j) / motion_j;
    tells.then_some((kg, kg * (of_speed + of_work)))
}

/// What was reached at a time within a window.
fn halfway(window: &VecDeque<Reached>, middle_ns: u64) -> Option<Reached> {
    let after = window.partition_point(|reached| reached.device_ns < middle_ns);
    let (to, from) = (window.get(after)?, window.get(after.saturating_sub(1))?);
    let time_ns = to.device_ns.saturating_sub(from.device_ns).max(1);
    #[expect(clippy::cast_precision_loss, reason = "nanoseconds of a window")]
    let share = middle_ns.saturating_sub(from.device_ns) as f64 / time_ns as f64;
    Some(Reached {
        device_ns: middle_ns,
        path_m: from.path_m + share * (to.path_m - from.path_m),
        work_j: from.work_j + share * (to.work_j - from.work_j),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A rig, and the force of its pulse.
    #[derive(Clone, Copy, Debug)]
    struct TestRig {
        mass_kg: f64,
        friction_n: f64,
        force_n: f64,
        resolution_m: f64,
        /// From a command to the motor, and from a sample to the tick that takes it, steps of `STEP_S`.
        down: usize,
        up: usize,
        /// When the encoder is read after a tick, in the same.
        phase: usize,
    }

    const STEP_S: f64 = 2e-5;
    const STEPS_OF_A_TICK: usize = 50;

    /// A pulse as [`TestRig`] shows it to the ticks, until it rests.
    fn pushed(rig: TestRig) -> Vec<Seen> {
        let smooth = |share: f64| share * share * (3.0 - 2.0 * share);
        let (mut position_m, mut velocity_mps) = (0.37 * rig.resolution_m, 0.0_f64);
        let read = |position_m: f64| (position_m / rig.resolution_m).round() * rig.resolution_m;
        let (mut commands, mut samples) = (Vec::new(), Vec::new());
        let mut seen: Vec<Seen> = Vec::new();
        let (mut last_m, mut has_ended, mut still) = (read(position_m), false, 0);
        for step in 0..150_000 {
            if step % STEPS_OF_A_TICK == rig.phase {
                samples.push((step, read(position_m)));
            }
            if step % STEPS_OF_A_TICK == 0 {
                let arrived = samples.partition_point(|(at, _)| at + rig.up <= step);
                let (sampled, now_m) = arrived.checked_sub(1).map_or((0, last_m), |newest| samples[newest]);
                let gone_s = step as f64 * STEP_S;
                let before_m: f64 = seen.iter().rev().take(4).map(|seen| seen.moved_m).sum();
                has_ended |= gone_s >= 0.3 || now_m > 0.02 || before_m > 0.3 * 4e-3;
                let edges = smooth((gone_s / 0.075).min(1.0)) * smooth(((0.3 - gone_s) / 0.075).clamp(0.0, 1.0));
                let force_n = if has_ended { 0.0 } else { rig.force_n * edges };
                commands.push((step, force_n));
                seen.push(Seen {
                    began_ns: (step * 20_000) as u64,
                    device_ns: (sampled * 20_000) as u64,
                    moved_m: now_m - last_m,
                    force_n,
                });
                still = if now_m == last_m { still + 1 } else { 0 };
                last_m = now_m;
                if has_ended && still > 30 {
                    break;
                }
            }
            let taken = commands.partition_point(|(at, _)| at + rig.down <= step);
            let force_n = taken.checked_sub(1).map_or(0.0, |newest| commands[newest].1);
            let free_mps = velocity_mps + force_n / rig.mass_kg * STEP_S;
            let held_mps = rig.friction_n / rig.mass_kg * STEP_S;
            velocity_mps = free_mps.signum() * (free_mps.abs() - held_mps).max(0.0);
            position_m += velocity_mps * STEP_S;
        }
        seen
    }

    /// A value within bounds, by their ratio.
    fn within(least: f64, most: f64) -> impl Strategy<Value = f64> {
        (least.ln()..most.ln()).prop_map(f64::exp)
    }

    prop_compose! {
        fn rig()(
            mass_kg in within(0.02, 3.0), friction_n in within(0.02, 0.8), beyond in 1.5..1.9_f64,
            resolution_m in within(1e-5, 1e-4), round_trip in 50..200_usize, share_down in 10..90_usize,
            phase in 0..STEPS_OF_A_TICK,
        ) -> TestRig {
            let down = round_trip * share_down / 100;
            let force_n = (beyond * friction_n.max(0.2)).min(2.0);
            TestRig { mass_kg, friction_n, force_n, resolution_m, down, up: round_trip - down, phase }
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

        #[test]
        fn interval_of_a_mass_holds_it(rig in rig()) {
            // The encoder is read, and the command of a tick is taken, up to a tick later.
            let delay_ns = ((rig.down + rig.up + STEPS_OF_A_TICK) * 20_000) as u64;
            let found = mass_within(&pushed(rig), delay_ns, rig.resolution_m);
            if let Some((kg, half_width_kg)) = found {
                prop_assert!(
                    (kg - rig.mass_kg).abs() <= half_width_kg,
                    "{kg} kg within {half_width_kg} of {rig:?}"
                );
            }
        }
    }

    #[test]
    fn light_mass_is_measured_within_a_tenth() {
        let rig = TestRig {
            mass_kg: 0.02,
            friction_n: 0.1,
            force_n: 0.3,
            resolution_m: 1e-5,
            down: 50,
            up: 50,
            phase: 10,
        };
        let (kg, half_width_kg) = mass_within(&pushed(rig), 3_000_000, rig.resolution_m).expect("measured");
        assert!(
            (kg - 0.02).abs() <= half_width_kg && half_width_kg < 0.1 * kg,
            "{kg} kg within {half_width_kg}"
        );
    }
}
