//! The same surface under another law: the parameters that both laws have stay, and the new law
//! chooses the others.

use super::change::Scene;
use crate::directional::{Direction, Directional};
use crate::friction::Friction;
use crate::parameters::{Parameter, SceneError, TABLE};

impl Scene {
    /// The scene with another friction law. Block, coupling and every parameter that both laws have
    /// stay as they are; what the new law forbids beside them is changed as little as it allows. A drag of 0
    /// stays behind: the viscous law begins with its default.
    /// `None` where there is no such law.
    ///
    /// # Errors
    /// Refusals of the new law that no small change resolves, as for a scene that could not
    /// be rendered before either.
    pub fn with_law(&self, law: &str) -> Option<Result<Self, SceneError>> {
        if law == self.friction.law() {
            return Some(self.validate().map(|()| self.clone()));
        }
        let mut changed = self.clone();
        changed.friction = Friction::default_of(law)?;
        // A law with one of the two forces has the same surface as one with both of that size.
        let forces = (self.value(Parameter::StaticForce), self.value(Parameter::DynamicForce));
        let (static_force, dynamic_force) = (forces.0.or(forces.1), forces.1.or(forces.0));
        for row in &TABLE {
            let had = match row.parameter {
                Parameter::StaticForce => static_force,
                Parameter::DynamicForce => dynamic_force,
                other => self.value(other),
            };
            if let Some(had) = had.filter(|had| changed.friction.as_law().adopts(row.parameter, *had)) {
                changed.keep(row.parameter, had);
            }
        }
        changed.friction.as_law_mut().comply();
        Some(changed.validate().map(|()| changed))
    }

    /// Sets a parameter, in both directions, where the scene has it.
    pub(super) fn keep(&mut self, parameter: Parameter, value: Directional) {
        for direction in Direction::BOTH {
            let key = if parameter.info().directional {
                parameter.in_direction(direction)
            } else {
                parameter.into()
            };
            self.set_value(key, value.get(direction)).unwrap_or(());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::friction::LAWS;

    fn on_device() -> Scene {
        Scene {
            block: None,
            coupling: None,
            ..Scene::paper()
        }
    }

    #[test]
    fn every_law_is_reached_from_every_other() {
        for scene in [Scene::paper(), on_device()] {
            for from in LAWS {
                let first = scene.with_law(from).expect("a law").expect("a scene");
                assert_eq!(first.friction.law(), from);
                for to in LAWS {
                    let second = first.with_law(to).expect("a law");
                    let second = second.unwrap_or_else(|error| panic!("{from} to {to}: {error}"));
                    assert_eq!(second.friction.law(), to);
                    for shared in second.parameters() {
                        let (before, after) = (first.value(shared), second.value(shared));
                        // A law that needs the one or the other gets it where there was none.
                        let was_none = before.is_some_and(|before| before.greatest() == 0.0);
                        assert!(
                            before.is_none() || before == after || was_none,
                            "{from} to {to}: {shared:?}"
                        );
                    }
                }
            }
        }
        assert!(Scene::paper().with_law("no-such-law").is_none());
    }

    #[test]
    fn directions_and_block_are_carried_over() {
        let mut scene = Scene::paper();
        let uneven = Directional::new(5.0, 3.0);
        scene.keep(Parameter::DynamicForce, uneven);
        let dahl = scene.with_law("dahl").expect("a law").expect("a scene");
        assert_eq!(dahl.value(Parameter::DynamicForce), Some(uneven));
        assert_eq!((dahl.block, dahl.coupling), (scene.block, scene.coupling));
        // Back, the static force that Dahl's law does not have is that of its slide.
        let back = dahl.with_law("karnopp").expect("a law").expect("a scene");
        assert_eq!(back.value(Parameter::StaticForce), Some(uneven));
    }

    #[test]
    fn a_law_that_forbids_weak_stiction_gets_it_raised_and_no_more() {
        let mut scene = Scene::paper();
        scene.keep(Parameter::StaticForce, Directional::new(3.0, 4.0));
        let lugre = scene.with_law("lugre").expect("a law").expect("a scene");
        let raised = Directional::new(3.5, 4.0);
        assert_eq!(lugre.value(Parameter::StaticForce), Some(raised));
        assert_eq!(lugre.value(Parameter::StribeckVelocity), Some(Directional::both(0.01)));
    }

    #[test]
    fn a_surface_without_drag_gets_some_where_drag_is_all_there_is() {
        let viscous = Scene::paper().with_law("viscous").expect("a law").expect("a scene");
        assert!(viscous.value(Parameter::Viscous).is_some_and(|drag| drag.least() > 0.0));
    }
}
