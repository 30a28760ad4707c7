//! The six reference scenes, solved elsewhere to 30 digits by an event-driven method.

use crate::explore::{data, table};
use haptic_core::block::{BlockState, Contact};
use haptic_core::friction::{Friction, Karnopp};
use haptic_core::scene::{Block, Coupling};
use haptic_core::{Direction, Directional, Renderer, Scene, Scheme};
fn scene(name: &str) -> (Scene, BlockState) {
    let all: serde_json::Value = serde_json::from_str(&data("reference/scenes.json")).expect("scenes.json");
    let number = |key: &str| all[name][key].as_f64().unwrap_or_else(|| panic!("{name}: no {key}"));
    let scene = Scene {
        name: name.to_owned(),
        block: Some(Block { mass: number("M") }),
        coupling: Some(Coupling {
            stiffness: number("K"),
            damping: number("B"),
        }),
        friction: Friction::Karnopp(Karnopp {
            viscous: Directional::both(number("b")),
            ..Karnopp::new(number("Fs"), number("Fd"))
        }),
    };
    let mut state = BlockState::new(number("x0"), number("v0"), 0.0, 0.0);
    state.contact = match number("mode0") {
        0.0 => Contact::Stuck,
        sign => Contact::Sliding(Direction::of(sign)),
    };
    (scene, state)
}

/// Largest errors over a run: position (m), force relative to max(K |p|, 1 N).
#[derive(Debug, Default)]
struct Errors {
    position: f64,
    force: f64,
    contacts: usize,
}

fn run(name: &str, scheme: Scheme) -> Errors {
    let (scene, mut state) = scene(name);
    let rows = table(&format!("reference/{name}"));
    let mut renderer = Renderer::new(&scene, scheme, 1e-3).expect("a valid scene");
    (state.device_position, state.device_velocity) = (rows[0][1], rows[0][2]);
    renderer.set_state(state);
    let mut errors = Errors::default();
    for pair in rows.windows(2) {
        let [t, p, v, x, _, force, contact] = pair[1][..] else {
            panic!("a row has seven numbers");
        };
        let rendered = renderer.tick(t - pair[0][0], p, v);
        errors.position = errors.position.max((renderer.state().position - x).abs());
        let scale = (scene.coupling.expect("a coupling").stiffness * p.abs()).max(1.0);
        errors.force = errors.force.max((rendered.coupling_force - force).abs() / scale);
        errors.contacts += usize::from(f64::from(renderer.state().contact.as_number()) != contact);
    }
    errors
}

const SCENES: [&str; 6] = [
    "paper",
    "high-stiction",
    "viscous",
    "slow-ramp-stick-slip",
    "free-motion",
    "light-block-10g",
];

#[test]
fn the_exact_scheme_meets_its_targets_on_every_reference_scene() {
    for name in SCENES {
        let errors = run(name, Scheme::Exact);
        println!("{name}: {errors:?}");
        assert!(errors.position <= 1e-12, "{name}: {errors:?}");
        assert!(errors.force <= 1e-9, "{name}: {errors:?}");
        assert_eq!(errors.contacts, 0, "{name}: {errors:?}");
    }
}

#[test]
fn the_literal_scheme_does_not() {
    // The references must be able to tell a good scheme from the paper's own.
    let errors = run("paper", Scheme::LITERAL);
    println!("{errors:?}");
    assert!(errors.position > 1e-6 && errors.contacts > 0, "{errors:?}");
}
