//! Compiles a scene, and its ramp where it has one. Not for the real-time thread.
//!
//! A recording holds the scenes and the time, and no step between them: compiling them again
//! gives the same steps.

use super::transition::{CompiledScene, Steps, Transition};
use crate::math::ceil;
use crate::renderer::Rendering;
use crate::vector::Vector;
use crate::{Scene, SceneError, Scheme};
use alloc::vec::Vec;

/// Scenes that a ramp is made of at most: a force moves by less than a hundredth of its range in
/// one.
const MAX_STEPS: f64 = 250.0;

impl<V: Vector> CompiledScene<V> {
    /// Compiles a scene that takes `ramp_s` seconds to take effect after another, for ticks of about
    /// `period_s` seconds. With 0 s it takes effect at once.
    ///
    /// # Errors
    /// The scene cannot be rendered.
    pub fn ramped(
        from: &Scene,
        to: &Scene,
        revision: u64,
        scheme: Scheme,
        period_s: f64,
        ramp_s: f64,
    ) -> Result<Self, SceneError> {
        let renderer = V::Renderer::new(to, scheme, period_s)?;
        if ramp_s <= 0.0 {
            return Ok(Self::at_once(renderer, revision));
        }
        let Some(first) = from.toward(to, 0.0) else {
            return Ok(Self {
                renderer,
                revision,
                transition: Transition::Fade { over_s: ramp_s },
            });
        };
        // Where both ends are within the ranges, so is what lies between them.
        let is_in_range = first.check_ranges().is_ok();
        let compile = |scene: &Scene| {
            if is_in_range {
                V::Renderer::in_range(scene, scheme, period_s)
            } else {
                V::Renderer::new(scene, scheme, period_s)
            }
        };
        let count = ceil(ramp_s / period_s).min(MAX_STEPS);
        let mut renderers = Vec::new();
        let mut step = 1.0;
        while step < count {
            // What cannot be rendered between two scenes that can is passed over.
            if let Some(Ok(renderer)) = from.toward(to, step / count).as_ref().map(compile) {
                renderers.push(renderer);
            }
            step += 1.0;
        }
        renderers.push(renderer);
        Ok(Self {
            // The scene from which it comes has been rendered before.
            renderer: compile(&first).or_else(|_| compile(to))?,
            revision,
            transition: Transition::Steps(Steps::new(renderers, ramp_s)),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Renderer;

    /// The paper's scene with another stiffness, N/m.
    fn stiff(stiffness: f64) -> Scene {
        let mut scene = Scene::paper();
        scene.coupling.as_mut().expect("a coupling").stiffness = stiffness;
        scene
    }

    fn ramped(ramp_s: f64) -> CompiledScene {
        CompiledScene::ramped(&stiff(1000.0), &stiff(3000.0), 7, Scheme::Exact, 1e-3, ramp_s).expect("both are valid")
    }

    /// The force of a stuck block at 0.1 mm, N.
    fn coupling_force(renderer: &Renderer) -> f64 {
        let mut renderer = renderer.clone();
        renderer.start_at(0.0, 0.0);
        renderer.tick(1e-3, 1e-4, 0.0).coupling_force
    }

    #[test]
    fn ramped_scene_steps_once_per_period_to_target() {
        let CompiledScene {
            mut renderer,
            transition: Transition::Steps(mut steps),
            revision: 7,
        } = ramped(9.5e-3)
        else {
            panic!("both are of one law");
        };
        assert_eq!(steps.count(), 10);
        for step in 0..=11 {
            let between = stiff(1000.0).toward(&stiff(3000.0), f64::from(step.min(10)) / 10.0);
            let between = between.expect("both are of one law");
            let expected = Renderer::new(&between, Scheme::Exact, 1e-3).expect("it is valid");
            assert_eq!(coupling_force(&renderer), coupling_force(&expected), "step {step}");
            steps.advance(0.951e-3, &mut renderer);
        }
    }

    #[test]
    fn steps_beyond_the_ranges_of_a_damaged_beginning_are_left_out() {
        let ramp = |from: &Scene| {
            let compiled = CompiledScene::<f64>::ramped(from, &stiff(3000.0), 7, Scheme::Exact, 1e-3, 9.5e-3);
            match compiled.expect("its end is valid").transition {
                Transition::Steps(steps) => steps.count(),
                other => panic!("{other:?}"),
            }
        };
        assert_eq!(ramp(&stiff(1000.0)), 10);
        assert_eq!(ramp(&stiff(f64::NAN)), 1, "only the end is left");
    }

    #[test]
    fn a_long_ramp_has_a_bounded_number_of_steps_and_none_has_none() {
        assert!(matches!(ramped(10.0).transition, Transition::Steps(steps) if steps.count() == 250));
        assert!(matches!(ramped(0.0).transition, Transition::AtOnce));
        // There is no path to another law, nor to a surface without a block.
        let other_law = Scene::paper().with_law("viscous").expect("a law").expect("a scene");
        let on_device = Scene {
            block: None,
            coupling: None,
            ..Scene::paper()
        };
        for other in [other_law, on_device] {
            let fading = CompiledScene::<f64>::ramped(&Scene::paper(), &other, 7, Scheme::Exact, 1e-3, 0.02)
                .expect("both are valid");
            assert!(matches!(fading.transition, Transition::Fade { over_s: 0.02 }));
        }
    }
}
