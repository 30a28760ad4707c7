//! No number below the normal range stays in the state between two ticks: an operation on such a
//! number can cost a hundred times the usual, tick after tick.

use crate::explore::{Hand, scenes};
use haptic_core::velocity::{Estimator, METHODS};
use haptic_core::{ParameterKey, Renderer, Scheme};

/// The first number below the normal range in the debug form of a value.
fn subnormal(kept: &impl std::fmt::Debug) -> Option<f64> {
    let text = format!("{kept:?}");
    let number = |word: &str| word.parse::<f64>().ok();
    text.split([' ', ',', '(', ')', '{', '}', '[', ']'])
        .filter_map(number)
        .find(|value| value.is_subnormal())
}

#[test]
fn the_debug_form_shows_a_subnormal_number() {
    assert_eq!(subnormal(&(1.0, [0.0, -1e-310])), Some(-1e-310));
    assert_eq!(subnormal(&(1.0, [0.0, f64::MIN_POSITIVE])), None);
}

#[test]
fn contact_at_rest_never_decays_through_subnormals() {
    let heavy_grip: ParameterKey = "B".parse().expect("a parameter");
    for (name, scene) in scenes() {
        // So much damping that whatever decays does so within the test.
        let scene = scene.with(&[(heavy_grip, 300.0)]).unwrap_or(scene);
        for scheme in test_run::extent(
            &[Scheme::Exact][..],
            &[Scheme::Exact, Scheme::Implicit, Scheme::LITERAL],
        ) {
            let mut surface = Renderer::new(&scene, *scheme, 1e-3).expect("a valid scene");
            surface.start_at(0.0, 0.0);
            let mut hand = Hand::new();
            for tick in 0..300 {
                let (elapsed, position, velocity) = hand.next(tick);
                surface.tick(elapsed, position, velocity);
            }
            for tick in 0..6000 {
                let rendered = surface.tick(1e-3, 0.0, 0.0);
                // A stiff contact decays at once, a soft one over thousands of ticks.
                if tick < 300 || tick % 32 == 0 {
                    let found = subnormal(&surface).or_else(|| subnormal(&rendered));
                    assert_eq!(
                        found, None,
                        "{name}, {scheme}, {tick} ticks after the hand came to rest: {surface:?}"
                    );
                }
            }
        }
    }
}

#[test]
fn no_propagator_keeps_a_subnormal_number() {
    // Masses and stiffnesses at which the exponentials of a tick end anywhere down to zero.
    for exponent in 0..500 {
        let damping = 0.5 * 1.01_f64.powi(exponent);
        let keys = ["M", "K", "B", "b"].map(|name| name.parse::<ParameterKey>().expect("a parameter"));
        let scene = haptic_core::Scene::paper();
        for (mass, stiffness) in [(1e-3, 0.0), (1e-6, 10.0), (1e-6, damping * 7.2e5), (1e-6, 5.5e5)] {
            let changes: Vec<_> = keys.into_iter().zip([mass, stiffness, damping, 0.0]).collect();
            let Ok(scene) = scene.with(&changes) else { continue };
            let Ok(mut surface) = Renderer::new(&scene, Scheme::Exact, 1e-3) else {
                continue;
            };
            surface.start_at(0.0, 0.5);
            for tick in 1..40 {
                surface.tick(1e-3, 5e-4 * f64::from(tick), 0.5);
                assert_eq!(
                    subnormal(&surface),
                    None,
                    "M = {mass}, K = {stiffness}, B = {damping}: {surface:?}"
                );
            }
        }
    }
}

#[test]
fn no_estimator_decays_through_the_subnormal_range() {
    for method in METHODS {
        let mut estimator = Estimator::new(method, 1e-3, 1e-5);
        let mut hand = Hand::new();
        for tick in 0..300 {
            let (elapsed, position, _) = hand.next(tick);
            estimator.update(elapsed, position);
        }
        for tick in 0..5000 {
            let velocity = estimator.update(1e-3, 0.0);
            let found = subnormal(&estimator).or_else(|| subnormal(&velocity));
            assert_eq!(
                found, None,
                "{method}, {tick} samples after the hand came to rest: {estimator:?}"
            );
        }
        assert_eq!(estimator.update(1e-3, 0.0), 0.0, "{method} comes to rest");
    }
}
