//! What a snapshot of a servo costs, which the loop takes every ten seconds of a recording: `cargo bench -p haptic-core
//! --bench snapshot`.

use haptic_core::limiter::Limits;
use haptic_core::passivity::RigLosses;
use haptic_core::servo::{CompiledScene, Servo, Settings};
use haptic_core::velocity::Method;
use haptic_core::{Renderer, Scene, Scheme};
use std::hint::black_box;
use std::time::Instant;

const TIMES: usize = 10_000;

fn main() {
    let settings = Settings {
        period_s: 1e-3,
        ramp_s: 0.1,
        limits: Limits::default(),
        losses: RigLosses::default(),
        passivity_control_n: 0.0,
        velocity: Method::FoawBestFit,
        stale_ns: 20_000_000,
        stop_button: None,
        enable_button: None,
        workspace: None,
        compensation: None,
    };
    let renderer = Renderer::new(&Scene::paper(), Scheme::Exact, 1e-3).expect("a valid scene");
    let mut servo = Servo::<f64>::new(settings, Box::new(CompiledScene::at_once(renderer, 1)));
    let mut costs: Vec<f64> = (0..TIMES)
        .map(|_| {
            let began = Instant::now();
            black_box(servo.snapshot());
            began.elapsed().as_secs_f64() * 1e9
        })
        .collect();
    costs.sort_by(f64::total_cmp);
    let (median_ns, dearest_ns) = (costs[TIMES / 2], costs[TIMES - 1]);
    println!("a servo's snapshot: {median_ns:.0} ns (median), {dearest_ns:.0} ns (dearest of {TIMES})");
}
