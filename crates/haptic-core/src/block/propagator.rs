//! The response of an oscillator over a tick, kept from tick to tick.

use super::oscillator::Oscillator;
use super::response::Response;
use crate::snapshot::Archive;

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

    /// Saves or loads for which tick it is kept; the response follows from that.
    pub(super) fn archive(&mut self, name: &'static str, oscillator: &Oscillator, archive: &mut Archive<'_>) {
        archive.number(name, &mut self.cached_for);
        if archive.is_loading() {
            self.cached = oscillator.response(self.cached_for);
        }
    }

    /// The response at `t`: the one kept where the tick is as long as the last, one derived from it
    /// where it nearly is.
    #[inline]
    pub(super) fn at(&mut self, oscillator: &Oscillator, t: f64) -> Response {
        #[expect(clippy::float_cmp, reason = "a cache key: the same number or not")]
        if t == self.cached_for {
            return self.cached;
        }
        self.at_another(oscillator, t)
    }

    /// Apart, so that a tick on time saves no registers for it.
    #[cold]
    fn at_another(&mut self, oscillator: &Oscillator, t: f64) -> Response {
        if let Some(nearby) = oscillator.response_near(&self.cached, t - self.cached_for) {
            return nearby;
        }
        self.cached = oscillator.response(t);
        self.cached_for = t;
        self.cached
    }
}
