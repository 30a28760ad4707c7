//! The values of a parameter under their keys.

use haptic_core::{Direction, Directional, Parameter, ParameterKey};

/// Under the parameter's own key where both directions are alike, else under that of each direction.
pub(super) fn keyed(parameter: Parameter, value: Directional) -> Vec<(ParameterKey, f64)> {
    if value.is_symmetric() {
        return vec![(parameter.into(), value.positive)];
    }
    Direction::BOTH
        .map(|direction| (parameter.in_direction(direction), value.get(direction)))
        .into()
}
