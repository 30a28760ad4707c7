//! The true motion, by solvers that share nothing with the ticks that they judge: no closed form,
//! no formula for an event, no series of a law, no code of the core.
//!
//! Karnopp's law and drag behind a block are integrated by Taylor series in 31 digits. Every other
//! law, and every law on the device itself, is integrated by Gauss's collocation of order 16.

mod behind_block;
mod collocation;
mod course;
mod equations;
mod on_device;
mod taylor;

pub use equations::has_stuck_state;

use crate::motion::DeviceSample;
use crate::simulate::{Simulation, Start};
use haptic_core::Scene;
use haptic_core::friction::{Friction, Karnopp};

/// The true motion of a scene: to the last digits of a number under Karnopp's law without its
/// options and under drag, else to about 1e-13 N, as [`uncertainty_n`] says. The hand on a device
/// without a block has constant acceleration between two samples.
///
/// # Panics
/// The scene is not valid, or has a law whose equations are not written down here.
#[must_use]
pub fn solve(scene: &Scene, motion: &[DeviceSample], start: Start) -> Simulation {
    solve_with(scene, motion, start, course::TOLERANCE_N)
}

fn solve_with(scene: &Scene, motion: &[DeviceSample], start: Start, tolerance_n: f64) -> Simulation {
    let (Some(block), Some(coupling)) = (scene.block, scene.coupling) else {
        return on_device::solve(&scene.friction, motion, tolerance_n);
    };
    match &scene.friction {
        Friction::Karnopp(law) if law.stribeck_velocity == 0.0 && law.rising_rate == 0.0 => {
            taylor::solve(block.mass, &coupling, law, motion, start)
        }
        Friction::Viscous(law) => {
            let drag = Karnopp {
                viscous: law.viscous,
                ..Karnopp::new(0.0, 0.0)
            };
            taylor::solve(block.mass, &coupling, &drag, motion, start)
        }
        law => behind_block::solve(block.mass, &coupling, law, motion, start, tolerance_n),
    }
}

/// The solver's own error in a run, N: how far its forces are from those of a solution in shorter
/// pieces, which are more than ten times truer.
///
/// # Panics
/// As [`solve`].
#[must_use]
pub fn uncertainty_n(scene: &Scene, motion: &[DeviceSample], start: Start, truth: &Simulation) -> f64 {
    let finer = solve_with(scene, motion, start, 0.01 * course::TOLERANCE_N);
    truth
        .rows
        .iter()
        .zip(&finer.rows)
        .map(|(row, finer)| (row.coupling_force_n - finer.coupling_force_n).abs())
        .fold(0.0, |most, error| if error <= most { most } else { error })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accuracy::{cases, compare, hands};
    use haptic_core::scene::{Block, Coupling};

    /// Two methods that share no line, on one law.
    #[test]
    fn collocation_gives_what_the_series_in_31_digits_give() {
        for case in cases::of_karnopp() {
            let Friction::Karnopp(law) = case.scene.friction else {
                panic!("a case of Karnopp's law");
            };
            let (block, coupling) = (
                case.scene.block.expect("a block"),
                case.scene.coupling.expect("a coupling"),
            );
            // What only touches a limit is for the last digit to say.
            if law.breakaway_force().least() == 0.0 || coupling.damping + law.viscous.least() == 0.0 {
                continue;
            }
            let motion = &case.motion[..test_run::extent(150, 700).min(case.motion.len())];
            let series = taylor::solve(block.mass, &coupling, &law, motion, case.start);
            let collocated = behind_block::solve(
                block.mass,
                &coupling,
                &case.scene.friction,
                motion,
                case.start,
                course::TOLERANCE_N,
            );
            let error = compare(&collocated, &series, coupling.stiffness);
            println!("{:28} {error:?}", case.name);
            assert!(error.relative_force <= 1e-12, "{}: {error:?}", case.name);
            assert!(
                error.event_time_s.is_some_and(|time| time <= 1e-12),
                "{}: {error:?}",
                case.name
            );
        }
    }

    /// A slide whose speed falls through Stribeck's region and comes back within a tick; mpmath's
    /// `odefun` gives 11.04260332221317574 N with 30 digits.
    #[test]
    fn a_dip_through_stribecks_region_is_seen() {
        let scene = Scene {
            block: Some(Block { mass: 0.02 }),
            coupling: Some(Coupling {
                stiffness: 25_000.0,
                damping: 10.0,
            }),
            friction: Friction::Karnopp(Karnopp {
                stribeck_velocity: 0.01,
                ..Karnopp::new(5.0, 3.0)
            }),
            ..Scene::paper()
        };
        let sample = |t_s, position_m, velocity_mps| DeviceSample {
            t_s,
            position_m,
            velocity_mps,
        };
        let motion = [sample(0.0, 0.0, 0.26), sample(0.001, 0.00067, 0.33)];
        let start = Start {
            position_m: Some(0.000_287),
            velocity_mps: 0.108,
        };
        let truth = solve(&scene, &motion, start);
        let force = truth.rows[1].coupling_force_n;
        assert!((force - 11.042_603_322_213_176).abs() <= 1e-13, "{force}");
        let times: Vec<f64> = truth.events.iter().map(|event| event.t_s * 1e6).collect();
        assert!(
            times.len() == 2 && (times[0] - 497.0).abs() < 1.0 && (times[1] - 576.0).abs() < 1.0,
            "{times:?}"
        );
    }

    /// Splitting a motion behind a block changes nothing: the pull is a straight line.
    #[test]
    fn a_motion_that_is_cut_finer_is_the_same_motion() {
        let hand = hands::HANDS[3];
        for (name, law) in hands::laws_under_hands() {
            let scene = hands::behind_block(law, 0.01);
            let motion = hand.motion(20);
            let mut finer = vec![motion[0]];
            for pair in motion.windows(2) {
                let between = |share: f64, from: f64, to: f64| from + share * (to - from);
                finer.extend([0.3, 0.8, 1.0].map(|share| DeviceSample {
                    t_s: between(share, pair[0].t_s, pair[1].t_s),
                    position_m: between(share, pair[0].position_m, pair[1].position_m),
                    velocity_mps: between(share, pair[0].velocity_mps, pair[1].velocity_mps),
                }));
            }
            let (whole, cut) = (
                solve(&scene, &motion, Start::default()),
                solve(&scene, &finer, Start::default()),
            );
            for (row, cut) in whole.rows.iter().zip(cut.rows.iter().step_by(3)) {
                let error = (row.coupling_force_n - cut.coupling_force_n).abs();
                assert!(error <= 1e-11, "{name}: {error:e} N at {} s", row.device.t_s);
            }
        }
    }
}
