//! The response of an oscillator over a tick, kept from tick to tick.

use super::oscillator::Oscillator;
use super::response::Response;

/// The response for the tick length met last: a steady tick finds it here.
#[derive(Clone, Copy, Debug)]
pub(super) struct Propagator {
    cached_for: f64,
    cached: Response,
}

impl Propagator {
    pub(super) fn new(oscillator: &Oscillator) -> Self {
        Self {
            cached_for: 0.0,
            cached: oscillator.response(0.0),
        }
    }

    /// Forgets the tick before: what it then gives depends on nothing that was.
    pub(super) fn rest(&mut self, oscillator: &Oscillator) {
        if self.cached_for != 0.0 {
            *self = Self::new(oscillator);
        }
    }

    /// The response at `t`: the one kept where the tick is as long as the last, one derived from it
    /// where it nearly is.
    pub(super) fn at(&mut self, oscillator: &Oscillator, t: f64) -> Response {
        #[expect(clippy::float_cmp, reason = "a cache key: the same number or not")]
        if t == self.cached_for {
            return self.cached;
        }
        if let Some(nearby) = oscillator.response_near(&self.cached, t - self.cached_for) {
            return nearby;
        }
        self.cached = oscillator.response(t);
        self.cached_for = t;
        self.cached
    }
}
