//! The last gate before the motor: what leaves it is finite and within the rig's force limit.

use thiserror::Error;

/// Clamps forces and lets nothing through that is not a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SafetyLimiter {
    max_force_n: f64,
}

/// A force that is not a finite number: the rig must fault, at zero force.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
#[error("the force computed is {0} N, not a finite number")]
pub struct NonFiniteForce(pub f64);

impl SafetyLimiter {
    /// `max_force_n` (N, > 0) bounds the magnitude of every force.
    #[must_use]
    pub fn new(max_force_n: f64) -> Self {
        Self { max_force_n }
    }

    /// Scales `force` (N) by `gain` in 0..1 and cuts it to the limit.
    ///
    /// # Errors
    /// [`NonFiniteForce`] where the product is not a finite number.
    pub fn limit(&self, force: f64, gain: f64) -> Result<f64, NonFiniteForce> {
        let wanted = force * gain.clamp(0.0, 1.0);
        if !wanted.is_finite() {
            return Err(NonFiniteForce(wanted));
        }
        Ok(wanted.clamp(-self.max_force_n, self.max_force_n))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn whatever_comes_in_stays_within_the_limit(force in any::<f64>(), gain in any::<f64>(), limit in 0.1..100.0) {
            match SafetyLimiter::new(limit).limit(force, gain) {
                Ok(limited) => prop_assert!(limited.abs() <= limit),
                Err(NonFiniteForce(value)) => prop_assert!(!value.is_finite()),
            }
        }
    }
}
