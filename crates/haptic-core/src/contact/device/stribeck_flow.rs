//! Stribeck's curve along a leg, and the flow of a bristle at it, `dF/dx = sigma (1 - F/g)`.
//!
//! The square of the speed goes evenly with the distance, so `y = (v/ws)^2` does, and `g = Fd + (Fs -
//! Fd) e^-y`. The exponent of the flow, `q = sigma integral dx/g` over what is left of the leg, is
//! then a logarithm, and the force at the end an integral of `e^-q`, which Gauss's nodes give.

use crate::contact::leg::Leg;
use crate::contact::level::Stribeck;
use crate::directional::Direction;
use crate::math::{exp, exp_m1, ln_1p};

/// Nodes and weights of Gauss and Legendre's quadrature on [0, 1] (Abramowitz and Stegun 1964, table 25.4, from which
/// they were computed again to 40 digits): three of them.
const THREE: [(f64, f64); 3] = [
    (0.1127016653792583, 0.2777777777777778),
    (0.5, 0.4444444444444444),
    (0.8872983346207417, 0.2777777777777778),
];

/// Six.
const SIX: [(f64, f64); 6] = [
    (0.03376524289842399, 0.08566224618958518),
    (0.16939530676686773, 0.1803807865240693),
    (0.38069040695840156, 0.23395696728634552),
    (0.6193095930415985, 0.23395696728634552),
    (0.8306046932331322, 0.1803807865240693),
    (0.966234757101576, 0.08566224618958518),
];

/// Twelve.
pub(super) const TWELVE: [(f64, f64); 12] = [
    (0.009219682876640375, 0.023587668193255914),
    (0.04794137181476257, 0.05346966299765921),
    (0.11504866290284765, 0.08003916427167311),
    (0.2063410228566913, 0.10158371336153296),
    (0.3160842505009099, 0.1167462682691774),
    (0.43738329574426554, 0.12457352290670139),
    (0.5626167042557345, 0.12457352290670139),
    (0.6839157494990901, 0.1167462682691774),
    (0.7936589771433087, 0.10158371336153296),
    (0.8849513370971523, 0.08003916427167311),
    (0.9520586281852375, 0.05346966299765921),
    (0.9907803171233597, 0.023587668193255914),
];

/// Stribeck's curve in one direction.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Curve {
    /// `Fd`, N.
    pub(super) dynamic: f64,
    /// `Fs - Fd`, N.
    pub(super) fall: f64,
    velocity: f64,
}

/// Beyond this `y` the curve has fallen to the last digit.
const FALLEN: f64 = 37.0;

impl Curve {
    pub(super) fn new(level: &Stribeck, direction: Direction) -> Self {
        let dynamic = level.dynamic_force.get(direction);
        Self {
            dynamic,
            fall: level.static_force.get(direction) - dynamic,
            velocity: level.velocity,
        }
    }

    /// `g`, N.
    pub(super) fn at(&self, y: f64) -> f64 {
        self.dynamic + self.falling(y)
    }

    /// The part of it that falls, N; its slope over `y` is the negative.
    pub(super) fn falling(&self, y: f64) -> f64 {
        // A little beyond, so that no rounding of a border makes a level of zero.
        if y > 2.0 * FALLEN { 0.0 } else { self.fall * exp(-y) }
    }

    /// `y` at a speed, m/s.
    pub(super) fn place(&self, speed: f64) -> f64 {
        let ratio = speed / self.velocity;
        ratio * ratio
    }

    /// A leg in its parts: on the curve, and where the curve has fallen, in their order.
    pub(super) fn parts(&self, leg: &Leg) -> [Part; 2] {
        let (from, to) = (self.place(leg.from_speed), self.place(leg.to_speed));
        let whole = Part {
            distance: leg.distance,
            from,
            to,
        };
        let none = Part {
            distance: 0.0,
            from: to,
            to,
        };
        if (from < FALLEN) == (to < FALLEN) {
            return [whole, none];
        }
        let (first, rest) = whole.split((FALLEN - from) / (to - from));
        [Part { to: FALLEN, ..first }, Part { from: FALLEN, ..rest }]
    }
}

/// A part of a leg, from one `y` to another.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    /// m.
    pub(super) distance: f64,
    pub(super) from: f64,
    pub(super) to: f64,
}

impl Part {
    /// The first share of it, and the rest.
    pub(super) fn split(&self, share: f64) -> (Self, Self) {
        let middle = self.from + (self.to - self.from) * share;
        let first = Self {
            distance: self.distance * share,
            to: middle,
            ..*self
        };
        let rest = Self {
            distance: self.distance * (1.0 - share),
            from: middle,
            ..*self
        };
        (first, rest)
    }

    /// Whether the curve has fallen all along.
    pub(super) fn is_fallen(&self) -> bool {
        self.from >= FALLEN && self.to >= FALLEN
    }
}

/// What is beyond this exponent is forgotten to the last digit.
const FORGOTTEN: f64 = 38.0;
/// A panel's widest extent in `y` near rest: the curve's poles lie pi beside the real axis, which
/// leaves twelve nodes an error of 1e-13 of the fall. Farther along the curve they are farther off.
const WIDEST: f64 = 4.0;
/// Extent of a panel over the distance in `y` from the poles to its slower end.
const WIDENING: f64 = 1.5;
/// A panel's greatest extent in `q`.
const MAX_EXTENT: f64 = 8.0;
/// A panel no wider than this either way takes six nodes, and three.
const NARROW: f64 = 1.0;
const NARROWEST: f64 = 0.1;
/// Most panels; the widest falls take some 20.
const MAX_PANELS: usize = 64;

/// The force at the level after a distance at constant `g`, N.
pub(super) fn follow_constant(force: f64, level: f64, stiffness: f64, distance: f64) -> f64 {
    if level > 0.0 {
        level + (force - level) * exp(-stiffness * distance / level)
    } else {
        0.0
    }
}

/// The force along the motion after a part of a leg, N. The panels are taken from its end, whose
/// neighbourhood weighs most. Also returns whether it ran out of them.
pub(super) fn follow(force: f64, curve: &Curve, stiffness: f64, part: &Part) -> (f64, bool) {
    let extent = part.to - part.from;
    if curve.fall == 0.0 || part.is_fallen() || extent.abs() < 1e-12 {
        let level = curve.at(0.5 * (part.from + part.to));
        return (follow_constant(force, level, stiffness, part.distance), false);
    }
    if part.distance == 0.0 {
        return (force, false);
    }
    let back = -extent.signum();
    let force_per_y = stiffness * part.distance / extent.abs();
    let (mut y, mut level, mut q, mut sum, mut left) = (part.to, curve.at(part.to), 0.0, 0.0, extent.abs());
    // The poles are beside the `y` at which both parts of the curve are equal.
    let knee = if curve.fall > curve.dynamic {
        ln_1p((curve.fall - curve.dynamic) / curve.dynamic)
    } else {
        0.0
    };
    for _ in 0..MAX_PANELS {
        let beyond = (y - knee).max(0.0);
        let widest = WIDEST.max(WIDENING * if back > 0.0 { beyond } else { beyond / (1.0 + WIDENING) });
        let mut width = left.min(widest).min(MAX_EXTENT * level / force_per_y);
        // Back along a slowing leg the curve falls, and the exponent grows faster.
        while back > 0.0 && width * force_per_y > MAX_EXTENT * curve.at(y + width) {
            width *= 0.5;
        }
        let panel = Panel {
            y_back: back,
            level,
            falling_share: curve.falling(y) / level,
            dynamic: curve.dynamic,
            force_per_y,
            q,
        };
        let longest = force_per_y * width / level.min(curve.at(y + back * width));
        let nodes: &[(f64, f64)] = if width.max(longest) > NARROW {
            &TWELVE
        } else if width.max(longest) > NARROWEST {
            &SIX
        } else {
            &THREE
        };
        let mut mean = 0.0;
        for &(node, weight) in nodes {
            mean += weight * exp(-panel.exponent(node * width));
        }
        sum += force_per_y * width * mean;
        q = panel.exponent(width);
        left -= width;
        if left <= 0.0 || q > FORGOTTEN {
            return (sum + force * exp(-q), false);
        }
        y += back * width;
        level = curve.at(y);
    }
    (sum + force * exp(-q), true)
}

/// A panel, as it is seen from its end.
struct Panel {
    y_back: f64,
    /// `g` at its end, N.
    level: f64,
    /// The part of it that falls.
    falling_share: f64,
    dynamic: f64,
    force_per_y: f64,
    /// The exponent at its end.
    q: f64,
}

/// `Fd/g` below which an exponent is a small difference.
const LOW: f64 = 0.01;

impl Panel {
    /// `q` at a distance in `y` before its end: `sigma integral dx/g`, which is `dy + ln(g/g')` over
    /// `Fd`, and where `Fd` is next to nothing `ln(1 + (Fd/g)(e^dy - 1))` over `Fd`.
    fn exponent(&self, before: f64) -> f64 {
        let back = self.y_back;
        if self.dynamic > LOW * self.level {
            let changed = back * ln_1p(self.falling_share * exp_m1(-back * before));
            return self.q + self.force_per_y * ((before + changed) / self.dynamic);
        }
        let over_level = back * exp_m1(back * before) / self.level;
        let grown = back * self.dynamic * over_level;
        let integral = if grown.abs() > 1e-6 {
            over_level * (ln_1p(grown) / grown)
        } else {
            over_level * (1.0 - grown * (0.5 - grown / 3.0))
        };
        self.q + self.force_per_y * integral
    }
}
