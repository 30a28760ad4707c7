//! Whatever the law, the scene, the scheme and the device, on the device itself or behind a block:
//! numbers, bounded work, and no panic, also when one scene takes over from another.
#![no_main]

use arbitrary::Arbitrary;
use haptic_core::friction::{Friction, LAWS, Reseat};
use haptic_core::parameters::TABLE;
use haptic_core::scene::{Block, Coupling};
use haptic_core::{Direction, ParameterKey, Renderer, Scene, Scheme};
use libfuzzer_sys::fuzz_target;

#[derive(Arbitrary, Debug)]
struct Made {
    law: u8,
    has_block: bool,
    /// Spread over the accepted ranges, by parameter and direction; the smallest stands for the lower end.
    parameters: Vec<u8>,
}

#[derive(Arbitrary, Debug)]
struct Case {
    first: Made,
    second: Made,
    scheme: u8,
    start: (i16, i16),
    samples: Vec<(u16, i16, i16)>,
    change_after: u8,
}

fn scene(made: &Made) -> Option<Scene> {
    let mut friction = Friction::default_of(LAWS[usize::from(made.law / 2) % LAWS.len()]).expect("a law");
    if let Friction::ResetIntegrator(law) = &mut friction
        && made.law % 2 == 1
    {
        law.reseat = Reseat::Slides;
    }
    let mut scene = Scene {
        name: String::new(),
        block: made.has_block.then_some(Block { mass: 1.0 }),
        coupling: made.has_block.then_some(Coupling { stiffness: 1e4, damping: 1.0 }),
        friction,
    };
    let keys = TABLE.iter().flat_map(|row| {
        let one_way = row.directional.then_some(Some(Direction::Negative));
        [None].into_iter().chain(one_way).map(|direction| ParameterKey { parameter: row.parameter, direction })
    });
    for (byte, key) in made.parameters.iter().zip(keys) {
        let (min, max) = (key.parameter.info().min, key.parameter.info().max);
        let least = min.max(1e-6 * max);
        let value = if *byte == 0 { min } else { least * (max / least).powf(f64::from(*byte) / 255.0) };
        // What the scene does not have, or cannot be together, is left as it was.
        if let Ok(changed) = scene.with(&[(key, value)]) {
            scene = changed;
        }
    }
    scene.validate_rate(1e-3).is_ok().then_some(scene)
}

fuzz_target!(|case: Case| {
    let schemes = ["exact", "exact", "literal", "literal:7", "implicit"];
    let scheme: Scheme = schemes[usize::from(case.scheme) % schemes.len()].parse().expect("a scheme");
    let (Some(first), Some(second)) = (scene(&case.first), scene(&case.second)) else { return };
    let mut renderer = Renderer::new(&first, scheme, 1e-3).expect("a valid scene");
    let position = |count: i16| f64::from(count) * 1e-5;
    renderer.start_at(position(case.start.0), position(case.start.1));
    for (k, (time, p, v)) in case.samples.into_iter().enumerate() {
        if k == usize::from(case.change_after) {
            let mut new = Renderer::new(&second, scheme, 1e-3).expect("a valid scene");
            // The literal scheme blows up where it does, to forces beyond all numbers: its step
            // then is none either.
            assert!(new.take_over(&renderer).is_finite() || scheme != Scheme::Exact);
            renderer = new;
        }
        // From a microsecond to a missed second.
        let elapsed = 10_f64.powf(-6.0 + 6.0 * f64::from(time >> 8) / 255.0) * f64::from(time & 0xff) / 128.0;
        let rendered = renderer.tick(elapsed, position(p), f64::from(v) * 1e-3);
        if scheme == Scheme::Exact || scheme == Scheme::Implicit {
            let state = renderer.state();
            assert!(rendered.coupling_force.is_finite(), "{rendered:?}");
            assert!(state.position.is_finite() && state.velocity.is_finite(), "{state:?}");
            assert!(rendered.events <= 800, "{rendered:?}");
        }
    }
});
