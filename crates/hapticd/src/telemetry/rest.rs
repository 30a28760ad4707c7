//! Whether the handle rests while no force flows: only then does its motion under a pulse show the pulse's direction.
//!
//! A hand that moves the handle along a sine, and lies within a range r for twice the time of a pulse, moves it by at
//! most 3 r in the pulse: around a turning point the distance grows with the square of time, `(1 + 1)^2 - 1`. A faster
//! sine turns within that time, and moves it by at most 2 r.

use haptic_core::planar::Plane;
use std::collections::VecDeque;

/// Range in which a handle at rest is seen, in counts and m: noise of its encoder.
pub(super) const REST: (f64, f64) = (4.0, 2e-5);

/// Least travel of a pulse, as a multiple of the range in which the handle lay before and a count: twice what a sine
/// does.
const OF_REST: f64 = 6.0;

/// Time for which the handle must rest before a pulse, as a multiple of the pulse's.
pub(super) const OF_PULSE: f64 = 2.0;

/// Longest pause before a pulse, as a multiple of the pulse's time.
const MAX_PAUSE: f64 = 2.0;

/// Short time within which it does not matter when the handle was where, ns, and longest time that is looked back to.
const BLOCK_NS: u64 = 10_000_000;
const MAX_SPAN_NS: u64 = 650_000_000;

/// Time that a handle gets to come to rest before the first pulse, ns.
const PATIENCE_NS: u64 = 2_000_000_000;

/// Where the handle has been, m.
#[derive(Clone, Copy, Debug)]
struct Extent {
    least: Plane,
    greatest: Plane,
}

impl Extent {
    fn of(hand: Plane) -> Self {
        Self {
            least: hand,
            greatest: hand,
        }
    }

    fn with(self, hand: Plane) -> Self {
        Self {
            least: Plane::new(self.least.x.min(hand.x), self.least.y.min(hand.y)),
            greatest: Plane::new(self.greatest.x.max(hand.x), self.greatest.y.max(hand.y)),
        }
    }

    fn and(self, other: Self) -> Self {
        self.with(other.least).with(other.greatest)
    }

    fn length_m(&self) -> f64 {
        (self.greatest - self.least).length()
    }
}

/// Where the handle was lately without force, and whether it rests there.
#[derive(Clone, Debug, Default)]
pub(super) struct Rest {
    /// The beginnings of short times, ns, and where the handle was in each, the newest last.
    blocks: VecDeque<(u64, Extent)>,
    /// Where it has been since the end of a pulse.
    alone: Option<(u64, Extent)>,
    now_ns: u64,
}

impl Rest {
    /// Takes in where the hand is, m, at a time, ns, and whether a force flows.
    pub(super) fn take(&mut self, hand: Plane, now_ns: u64, has_force: bool) {
        self.now_ns = now_ns;
        if has_force {
            self.blocks.clear();
            self.alone = None;
            return;
        }
        if let Some((_, alone)) = &mut self.alone {
            *alone = alone.with(hand);
        }
        match self
            .blocks
            .back_mut()
            .filter(|(since_ns, _)| now_ns - since_ns < BLOCK_NS)
        {
            Some((_, newest)) => *newest = newest.with(hand),
            None => self.blocks.push_back((now_ns, Extent::of(hand))),
        }
        while self
            .blocks
            .get(1)
            .is_some_and(|(since_ns, _)| now_ns - since_ns > MAX_SPAN_NS)
        {
            self.blocks.pop_front();
        }
    }

    /// A pulse has ended with the hand there, m: from now on nothing may move it until the next.
    pub(super) fn begin_alone(&mut self, hand: Plane) {
        self.alone = Some((self.now_ns, Extent::of(hand)));
    }

    /// Range in which the handle lay for some seconds up to now, m; `None` where a force flowed.
    pub(super) fn range_m(&self, time_s: f64) -> Option<f64> {
        #[expect(clippy::cast_precision_loss, reason = "nanoseconds of a rest")]
        let is_within = |since_ns: u64| (self.now_ns - since_ns) as f64 * 1e-9 <= time_s;
        self.blocks.front().filter(|(since_ns, _)| !is_within(*since_ns))?;
        // With the block in which the time began.
        let first = self.blocks.iter().rposition(|(since_ns, _)| !is_within(*since_ns))?;
        let extents = self.blocks.iter().skip(first).map(|(_, extent)| *extent);
        extents.reduce(Extent::and).map(|extent| extent.length_m())
    }

    /// Least travel, m, in a pulse of a duration, s, that begins now, which nothing but the pulse can make on an
    /// encoder of this resolution, m; `None` where the handle has not rested for long enough.
    pub(super) fn least_travel_m(&self, pulse_s: f64, resolution_m: f64) -> Option<f64> {
        Some(OF_REST * (self.range_m(OF_PULSE * pulse_s)? + resolution_m))
    }
}

/// The wait for a rest, right before a pulse.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Wait {
    rest_s: f64,
    /// Even a handle that rests waits so long, ns: a hand that moves evenly shall not be in step with the pulses.
    pause_ns: f64,
    /// Where it was since the beginning, m, and when that was, ns.
    seen: Option<(u64, Extent)>,
}

impl Wait {
    /// Before a pulse of a duration, s; a chance from 0 to 1 says how long.
    pub(crate) fn new(pulse_s: f64, chance: f64) -> Self {
        Self {
            rest_s: OF_PULSE * pulse_s,
            pause_ns: MAX_PAUSE * chance * pulse_s * 1e9,
            seen: None,
        }
    }

    /// Takes in where the hand is, m; returns whether the wait is over. At rest it lies within `most_m`, and since the
    /// pulse before it has moved less than `least_travel_m`.
    ///
    /// # Errors
    /// The handle does not come to rest.
    pub(super) fn take(&mut self, hand: Plane, rest: &Rest, most_m: f64, least_travel_m: f64) -> Result<bool, String> {
        let (began_ns, extent) = self.seen.unwrap_or((rest.now_ns, Extent::of(hand)));
        let extent = extent.with(hand);
        self.seen = Some((began_ns, extent));
        let waited_ns = rest.now_ns - began_ns;
        #[expect(clippy::cast_precision_loss, reason = "nanoseconds of a wait")]
        let has_paused = waited_ns as f64 >= self.pause_ns;
        let rests = rest.range_m(self.rest_s).is_some_and(|range_m| range_m <= most_m);
        let moved = rest.alone.filter(|(_, extent)| extent.length_m() >= least_travel_m);
        let moved = moved.or_else(|| (waited_ns > PATIENCE_NS && !rests).then_some((began_ns, extent)));
        match moved {
            None => Ok(rests && has_paused),
            Some((since_ns, extent)) => Err(format!(
                "the handle moves by itself by {:.2} mm in {} ms without force: let go of it, or hold it still; nothing \
                 is kept",
                extent.length_m() * 1e3,
                (rest.now_ns - since_ns) / 1_000_000
            )),
        }
    }
}
