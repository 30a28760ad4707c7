//! The parts of the plane: a hand on a line of it feels what a rig of one axis renders, and a state is restored whole.

use super::{PlanarRenderer, Plane, Workspace};
use crate::block::{Contact, Coupling, EventSink};
use crate::friction::{Friction, Karnopp, Viscous};
use crate::scene::Block;
use crate::snapshot::{Archive, Snapshot};
use crate::{Directional, Renderer, Rendering, Scene, Scheme, Vector};
use alloc::collections::BTreeMap;
use alloc::string::String;
use proptest::prelude::*;

const T: f64 = 1e-3;

#[test]
fn plane_has_its_axes_in_order() {
    let mut place = Plane::of_axes(3.0, 8.0);
    assert_eq!((place.first(), place.second()), (3.0, 8.0));
    place.parts().zip([5.0, 6.0]).for_each(|(part, value)| *part = value);
    assert_eq!((place, place / 2.0), (Plane::new(5.0, 6.0), Plane::new(2.5, 3.0)));
    for (x, y, is_finite) in [(1.0, 2.0, true), (f64::NAN, 2.0, false), (1.0, f64::INFINITY, false)] {
        assert_eq!(Plane::new(x, y).is_finite(), is_finite);
    }
    let workspace = Workspace {
        x_m: [1.0, 4.0],
        y_m: [-3.0, 8.0],
    };
    assert_eq!(workspace.middle(), Plane::new(2.5, 2.5));
}

fn on_device(friction: Friction) -> Scene {
    Scene {
        block: None,
        coupling: None,
        friction,
        ..Scene::paper()
    }
}

/// Of a block or of the device itself.
fn scene(has_block: bool) -> impl Strategy<Value = Scene> {
    let some = |low: f64, high: f64| prop_oneof![Just(0.0), low..high];
    let law = (
        0.2..5.0,
        prop_oneof![Just(1.0), 1.0..1.5],
        some(0.1, 5.0),
        some(0.01, 0.2),
    );
    let karnopp = law.prop_map(|(dynamic, stiction, viscous, velocity_threshold): (f64, f64, _, _)| {
        Friction::Karnopp(Karnopp {
            viscous: Directional::both(viscous),
            velocity_threshold,
            ..Karnopp::new(dynamic * stiction, dynamic)
        })
    });
    let viscous = (1.0..30.0).prop_map(|viscous| {
        let viscous = Directional::both(viscous);
        Friction::Viscous(Viscous { viscous })
    });
    let stiffness = prop_oneof![4 => 500.0..1e4, 1 => Just(0.0), 1 => (-320.0..2.0).prop_map(|e| f64::powf(10.0, e))];
    let held = (0.05..1.0, stiffness, 1.0..10.0).prop_map(move |held| has_block.then_some(held));
    let friction = prop_oneof![3 => karnopp, 1 => viscous];
    (friction, 1e3..2e4, held).prop_map(|(mut friction, own_stiffness, held)| {
        if let (Friction::Karnopp(law), None) = (&mut friction, held) {
            law.contact_stiffness = Some(own_stiffness);
        }
        Scene {
            block: held.map(|(mass, ..)| Block { mass }),
            coupling: held.map(|(_, stiffness, damping)| Coupling { stiffness, damping }),
            ..on_device(friction)
        }
    })
}

/// What a hand does in a tick.
#[derive(Clone, Copy, Debug)]
struct Step {
    by_m: f64,
    to_mps: f64,
}

/// It goes on, shakes, creeps, is held or leaps below a velocity at which slides last.
fn step() -> impl Strategy<Value = Step> {
    let by_m = prop_oneof![Just(0.0), -2e-4..2e-4, -1e-5..1e-5, -5e-3..5e-3];
    let to_mps = prop_oneof![Just(None), Just(Some(0.0)), (-0.2..0.2).prop_map(Some)];
    (by_m, to_mps).prop_map(|(by_m, to_mps): (f64, Option<f64>)| Step {
        by_m,
        to_mps: to_mps.unwrap_or(by_m / T),
    })
}

/// The newest contact that was reported.
struct NewestContact(Contact);

impl EventSink for NewestContact {
    fn contact_changed(&mut self, _at_s: f64, from: Contact, to: Contact) {
        assert_eq!(self.0, from);
        self.0 = to;
    }
}

/// The same renderer from its state alone.
fn restored(renderer: &mut PlanarRenderer, scene: &Scene) -> PlanarRenderer {
    let mut snapshot = Snapshot::EMPTY;
    renderer.archive(&mut Archive::saving(&mut snapshot));
    let fields: BTreeMap<String, _> = snapshot.fields().collect();
    let mut other = PlanarRenderer::new(scene, Scheme::Exact, T).expect("it can be rendered");
    let find = |name: &str| fields.get(name).copied();
    let mut archive = Archive::loading(&find);
    other.archive(&mut archive);
    archive.end().expect("its own fields");
    other
}

#[test]
fn slide_that_has_hardly_set_off_goes_on() {
    let friction = Friction::Karnopp(Karnopp::new(3.400_17, 3.4));
    for stiffness in [0.0, 1000.0] {
        let scene = Scene {
            block: Some(Block { mass: 0.43 }),
            coupling: Some(Coupling {
                stiffness,
                damping: 9.9,
            }),
            ..on_device(friction)
        };
        let mut line = Renderer::new(&scene, Scheme::Exact, T).expect("a scene");
        let mut plane = PlanarRenderer::new(&scene, Scheme::Exact, T).expect("a scene");
        for to_mps in [0.3, 0.6, 3.0] {
            line.start_at(0.0, 0.0);
            plane.start_at(Plane::ZERO, Plane::ZERO);
            let force_n = line.render(T, 0.0, to_mps);
            let rendered = plane.render_with_events(T, Plane::ZERO, Plane::new(0.0, to_mps), &mut ());
            assert!(!rendered.work_exhausted, "{to_mps} m/s: {rendered:?}");
            let apart_n = (rendered.coupling_force - Plane::new(0.0, force_n)).length();
            assert!(apart_n < 1e-9, "{to_mps} m/s: {force_n} {rendered:?}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn hand_on_a_line_of_the_plane_is_rendered_as_on_one_axis(
        scenes in any::<[bool; 2]>().prop_flat_map(|[first, second]| [scene(first), scene(second)]),
        angle in prop_oneof![Just(0.0), 0.0..6.3],
        begin_mps in prop_oneof![Just(0.0), -0.2..0.2],
        steps in [prop::collection::vec(step(), 1..80), prop::collection::vec(step(), 1..40)],
    ) {
        let along = Plane::new(f64::cos(angle), f64::sin(angle));
        let [mut line, mut other_line] =
            scenes.each_ref().map(|s| Renderer::new(s, Scheme::Exact, T).expect("a scene"));
        let [mut plane, mut other_plane] =
            scenes.each_ref().map(|s| PlanarRenderer::new(s, Scheme::Exact, T).expect("a scene"));
        prop_assert!((Rendering::stiffness(&line) - plane.stiffness()).abs() < 1e-9 * plane.stiffness().max(1.0));
        line.start_at(0.0, begin_mps);
        plane.start_at(Plane::ZERO, along * begin_mps);
        prop_assert_eq!(plane.shown().contact == Contact::Stuck, line.shown().contact == Contact::Stuck);
        let mut place = 0.0;
        for (index, steps) in steps.into_iter().enumerate() {
            if index == 1 {
                let slides_at_rest = line.shown().contact != Contact::Stuck && line.shown().velocity == 0.0;
                if scenes[0].block.is_some() != scenes[1].block.is_some() && slides_at_rest {
                    // On a line it goes on as a slide; in the plane what is at rest sticks.
                    return Ok(());
                }
                let step_n = other_line.take_over(&line);
                let planar_step_n = other_plane.take_over(&plane);
                let apart_n = (along * step_n - planar_step_n).length();
                prop_assert!(apart_n < 1e-6 * (1.0 + step_n.abs()), "{step_n} {planar_step_n:?}");
                (line, plane) = (other_line.clone(), other_plane.clone());
            }
            plane = restored(&mut plane, &scenes[index]);
            for Step { by_m, to_mps } in steps {
                place += by_m;
                let force = line.render(T, place, to_mps);
                let mut newest = NewestContact(plane.shown().contact);
                let rendered = plane.render_with_events(T, along * place, along * to_mps, &mut newest);
                prop_assert!(!rendered.work_exhausted);
                prop_assert_eq!(newest.0, plane.shown().contact);
                let apart_n = (along * force - rendered.coupling_force).length();
                prop_assert!(apart_n < 1e-6 * (1.0 + force.abs()), "{force} {rendered:?}");
                prop_assert_eq!(plane.shown().contact == Contact::Stuck, line.shown().contact == Contact::Stuck);
            }
        }
    }
}
