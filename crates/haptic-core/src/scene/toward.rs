//! The path from one scene to another with the same law and the same parts.

use super::change::Scene;
use crate::directional::{Direction, Directional};
use crate::math::powf;
use crate::parameters::{Scale, TABLE};

impl Scene {
    /// The scene at a share of the path to another, from 0 (this one) to 1 (the other): every
    /// parameter moves evenly, one with a logarithmic scale by equal ratios. Everything else is the
    /// other's.
    ///
    /// `None` between different laws, and between a scene with a block and one without. A scene
    /// between two valid ones need not be valid itself; [`validate`](Scene::validate) says so.
    #[must_use]
    pub fn toward(&self, other: &Self, share: f64) -> Option<Self> {
        let same_parts =
            (self.block.is_some(), self.coupling.is_some()) == (other.block.is_some(), other.coupling.is_some());
        if !same_parts || self.friction.law() != other.friction.law() {
            return None;
        }
        let mut between = other.clone();
        for row in &TABLE {
            let (Some(here), Some(there)) = (self.value(row.parameter), other.value(row.parameter)) else {
                continue;
            };
            if here == there {
                continue;
            }
            let at = |direction| {
                let (here, there) = (here.get(direction), there.get(direction));
                let even = here + (there - here) * share;
                if row.scale == Scale::Logarithmic && here > 0.0 && there > 0.0 {
                    here * powf(there / here, share)
                } else {
                    even
                }
            };
            let (positive, negative) = (at(Direction::Positive), at(Direction::Negative));
            between.keep(row.parameter, Directional { positive, negative });
        }
        Some(between)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parameters::{Parameter, ParameterKey};

    fn paper_with(changes: &[(&str, f64)]) -> Scene {
        let changes: alloc::vec::Vec<(ParameterKey, f64)> = changes
            .iter()
            .map(|(name, value)| (name.parse().expect("a parameter"), *value))
            .collect();
        Scene::paper().with(&changes).expect("a valid scene")
    }

    #[test]
    fn halfway_scene_takes_arithmetic_or_geometric_means() {
        let (from, to) = (
            paper_with(&[("M", 0.5), ("Fs", 4.0)]),
            paper_with(&[("M", 2.0), ("Fs+", 6.0), ("Fs-", 5.0)]),
        );
        let middle = from.toward(&to, 0.5).expect("the same make");
        let value = |parameter| middle.value(parameter).expect("it has it");
        assert!((value(Parameter::Mass).positive - 1.0).abs() < 1e-12);
        let limit = value(Parameter::StaticForce);
        assert_eq!((limit.positive, limit.negative), (5.0, 4.5));
        assert_eq!(from.toward(&to, 0.0).map(|scene| scene.friction), Some(from.friction));
        assert_eq!(
            from.toward(&to, 1.0).as_ref().map(|scene| scene.friction),
            Some(to.friction)
        );
    }
}
