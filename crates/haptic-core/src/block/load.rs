//! What the device pulls with between two samples.

/// `K p + B v` between two samples, less `K` times the block's position at the start of the tick: the coupling force if the block stood still there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Load {
    /// At the start of the tick, N.
    pub(super) at_start: f64,
    /// N/s.
    pub(super) slope: f64,
    /// Within this, N, a force equals another.
    pub(super) rounding: f64,
}

/// The two samples, and the coupling between device and block.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pull {
    pub(super) stiffness: f64,
    pub(super) damping: f64,
    /// Position and velocity of the device at the start and at the end.
    pub(super) from: (f64, f64),
    pub(super) to: (f64, f64),
    pub(super) elapsed_s: f64,
    pub(super) block_position: f64,
}

impl Load {
    pub(super) fn new(pull: &Pull) -> Self {
        let Pull { stiffness, damping, .. } = *pull;
        // Differences, not K p: at a large offset the products would drown the deflection.
        Self {
            at_start: stiffness * (pull.from.0 - pull.block_position) + damping * pull.from.1,
            slope: (stiffness * (pull.to.0 - pull.from.0) + damping * (pull.to.1 - pull.from.1)) / pull.elapsed_s,
            rounding: 4.0
                * f64::EPSILON
                * (2.0 * stiffness * pull.block_position.abs() + (damping * pull.from.1).abs()),
        }
    }

    pub(super) fn at(&self, time: f64) -> f64 {
        self.at_start + self.slope * time
    }
}
