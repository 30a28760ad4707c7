//! The elasto-plastic bristle with Stribeck's fall on the device itself.
//!
//! With `u = F/g` there are three regions: elastic up to `u = f`, where the force grows with the
//! distance; yielding up to 1, where a power series is followed from one piece to the next; and LuGre's
//! flow beyond. Where the curve has fallen, the yielding region is the master path. Along a leg the
//! curve goes one way, so that each border is crossed at most once either way: `g` over the distance is
//! convex, and the slope of `u` at `u = 1` has the sign of its fall.

use super::lugre::dissipated_by_nodes;
use super::master_path::{MasterLaw, MasterPath, series_product};
use super::stribeck_flow::{Curve, Part, follow, follow_constant};
use super::{DeviceBristle, DeviceContact, EnergyMeter};
use crate::contact::leg::Leg;
use crate::contact::level::{Level, Stribeck};
use crate::contact::state::{Contact, ContactMemory, LawContact};
use crate::contact::yielding::by_elastic_share;
use crate::directional::{Direction, Directional};
use crate::math::{flush, powf, sin_cos};
use crate::series::root_between;
use crate::snapshot::Archive;
use alloc::sync::Arc;
use core::f64::consts::PI;

/// The contact.
#[derive(Clone, Debug)]
pub(crate) struct DeviceElastoPlastic<M> {
    law: M,
    path: Arc<MasterPath>,
    /// `zba` over the steady deflection.
    fraction: f64,
    /// `g`, N.
    level: Stribeck,
    /// `sigma0`, N/m.
    stiffness: f64,
    /// `sigma1`, N s/m.
    damping: f64,
    /// `b`, N s/m.
    viscous: Directional,
    /// `sigma0 z`, N, signed.
    force: f64,
}

/// Order of the series, and the least at which it may count as right.
const ORDER: usize = 16;
const MIN_ORDER: usize = 8;
/// Error that a piece may have, N, and as a share of the level: rounding.
const TOLERANCE: (f64, f64) = (1e-13, 2e-16);
/// Most pieces of a leg.
const MAX_PIECES: u32 = 64;
/// A piece's greatest extent in `y`: up to there the order of the series is beyond its largest term.
const MAX_EXTENT: f64 = 12.0;
/// What lies farther back than this exponent is forgotten.
const FORGOTTEN: f64 = 80.0;
/// Crossings of a border are found to this in `u`; the laws on both sides of it differ by the
/// square.
const CLOSE: f64 = 1e-12;

/// Where the deflection is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Region {
    Elastic,
    Yielding,
    Saturated,
}

/// Yielding along a part of a leg.
struct Piece {
    /// Force along the motion, N, and `u`, over the share of the part.
    force: [f64; ORDER + 1],
    ratio: [f64; ORDER + 1],
    /// Whether the series is right to the end of the part.
    ends: bool,
}

impl<M: MasterLaw> DeviceElastoPlastic<M> {
    /// `law` has its elastic part up to the share `fraction`; `stiffness` is `sigma0`, N/m,
    /// `damping` `sigma1` and `viscous` `b`, N s/m.
    pub(crate) fn new(
        law: M,
        fraction: f64,
        level: Stribeck,
        stiffness: f64,
        damping: f64,
        viscous: Directional,
    ) -> Self {
        Self {
            law,
            path: Arc::new(MasterPath::new(&law, fraction)),
            fraction,
            level,
            stiffness,
            damping,
            viscous,
            force: 0.0,
        }
    }

    /// The force along the motion after a part of a leg, N, and whether the work ran out.
    fn follow(&self, force: f64, curve: &Curve, part: &Part) -> (f64, bool) {
        if part.distance == 0.0 {
            return (force, false);
        }
        if curve.fall == 0.0 || part.is_fallen() {
            return (self.follow_constant(force, curve.at(part.from), part.distance), false);
        }
        self.follow_curve(force, curve, *part)
    }

    fn follow_constant(&self, force: f64, level: f64, distance: f64) -> f64 {
        let end = self.fraction * level;
        if force < end || level <= 0.0 {
            let elastic = self.stiffness * distance;
            return if force + elastic <= end {
                force + elastic
            } else if level <= 0.0 {
                0.0
            } else {
                self.on_path(end, level, distance - (end - force) / self.stiffness)
            };
        }
        if force >= level {
            return follow_constant(force, level, self.stiffness, distance);
        }
        self.on_path(force, level, distance)
    }

    fn on_path(&self, force: f64, level: f64, distance: f64) -> f64 {
        let (mut place, mut cell) = self.path.find(force / level);
        place += distance * (self.stiffness / level);
        level * self.path.at(&mut place, &mut cell)
    }

    fn follow_curve(&self, mut force: f64, curve: &Curve, mut part: Part) -> (f64, bool) {
        // Far ahead of its end the part only leads to the curve, which any force comes to once it has
        // been unloaded.
        let per_level = 1.0 / (curve.dynamic + curve.fall);
        let exponent = self.stiffness * part.distance * per_level;
        if exponent + force.min(0.0) * per_level > FORGOTTEN {
            part = part.split(1.0 - FORGOTTEN / exponent).1;
            force = force.clamp(0.0, curve.at(part.from));
        }
        let at_start = curve.at(part.from);
        let mut region = if force < self.fraction * at_start {
            Region::Elastic
        } else if force < at_start {
            Region::Yielding
        } else {
            Region::Saturated
        };
        let mut pieces = 0;
        // Each pass ends the part or crosses a border.
        while part.distance > 0.0 {
            let (share, next) = match region {
                Region::Elastic => self.elastic(force, curve, &part),
                Region::Saturated => self.saturated(force, curve, &part),
                Region::Yielding if pieces < MAX_PIECES => {
                    pieces += 1;
                    let piece = self.piece(force, curve, &part);
                    let (share, next) = self.piece_end(&piece, curve, &part);
                    let after = horner(&piece.force, share);
                    if !after.is_finite() {
                        // Of a limit that has fallen to next to nothing the series is beyond all
                        // numbers; the force is near the limit.
                        return (follow(force, curve, self.stiffness, &part).0, true);
                    }
                    force = after;
                    (share, next)
                }
                Region::Yielding => return (follow(force, curve, self.stiffness, &part).0, true),
            };
            let (done, rest) = part.split(share);
            match region {
                Region::Elastic => force += self.stiffness * done.distance,
                Region::Saturated => force = follow(force, curve, self.stiffness, &done).0,
                Region::Yielding => {}
            }
            if share >= 1.0 {
                break;
            }
            (part, region) = (rest, next);
        }
        (force, false)
    }

    /// The share of a part that is elastic: Newton's method for `F - f g = 0`, which is concave, so
    /// that no step passes its first root.
    fn elastic(&self, force: f64, curve: &Curve, part: &Part) -> (f64, Region) {
        let per_share = self.stiffness * part.distance;
        let extent = part.to - part.from;
        let mut share = 0.0;
        for _ in 0..64 {
            let falling = curve.falling(part.from + extent * share);
            let beyond = force + per_share * share - self.fraction * (curve.dynamic + falling);
            let slope = per_share + self.fraction * falling * extent;
            if slope <= 0.0 {
                return (1.0, Region::Elastic);
            }
            let step = -beyond / slope;
            share += step.max(0.0);
            if share >= 1.0 {
                return (1.0, Region::Elastic);
            }
            if step <= 1e-16 {
                break;
            }
        }
        (share, Region::Yielding)
    }

    /// The share of a part along which `u` stays above 1: it falls to 1 on a slowing leg only.
    fn saturated(&self, force: f64, curve: &Curve, part: &Part) -> (f64, Region) {
        let ratio = |share: f64| {
            let done = part.split(share).0;
            follow(force, curve, self.stiffness, &done).0 / curve.at(done.to) - 1.0
        };
        if part.to > part.from || ratio(1.0) >= 0.0 {
            return (1.0, Region::Saturated);
        }
        if force <= curve.at(part.from) * (1.0 + CLOSE) {
            return (0.0, Region::Yielding);
        }
        (root_between(0.0, 1.0, CLOSE, ratio), Region::Yielding)
    }

    /// Error that a piece may have, N.
    fn tolerance(curve: &Curve) -> f64 {
        TOLERANCE.0 + TOLERANCE.1 * (curve.dynamic + curve.fall)
    }

    /// The series of the yielding force over the share of a part.
    fn piece(&self, force: f64, curve: &Curve, part: &Part) -> Piece {
        let per_share = self.stiffness * part.distance;
        let extent = part.to - part.from;
        let angle = PI / (1.0 - self.fraction);
        let mut p = [0.0; ORDER + 1];
        // `turns` is `k u[k]`.
        let (mut g, mut u, mut turns, mut sin, mut cos) = (p, p, p, p, p);
        p[0] = force;
        g[0] = curve.at(part.from);
        let over_level = 1.0 / g[0];
        let mut falling = curve.falling(part.from);
        let quarter = 0.25 * Self::tolerance(curve);
        let mut order = 0.0;
        let mut ends = false;
        for n in 0..=ORDER {
            // u g = p
            let known = series_product(&g[1..=n], &u[..n]);
            u[n] = (p[n] - known) * over_level;
            // The falling part's terms grow up to the order of its extent.
            ends = n >= MIN_ORDER && p[n].abs() + p[n - 1].abs() < quarter && extent.abs() < 0.5 * order;
            if ends || n == ORDER {
                break;
            }
            if n == 0 {
                (sin[0], cos[0]) = sin_cos(angle * (u[0] - self.fraction));
            } else {
                turns[n] = order * u[n];
                let of_sin = series_product(&turns[1..=n], &cos[..n]);
                let of_cos = series_product(&turns[1..=n], &sin[..n]);
                (sin[n], cos[n]) = (angle * of_sin / order, -angle * of_cos / order);
            }
            // dp = 1 - alpha u, alpha = (1 - cos)/2
            let turned = series_product(&cos[..=n], &u[..=n]);
            let elastic = if n == 0 { 1.0 } else { 0.0 };
            order += 1.0;
            p[n + 1] = per_share * (elastic - 0.5 * (u[n] - turned)) / order;
            falling *= -extent / order;
            g[n + 1] = falling;
        }
        Piece {
            force: p,
            ratio: u,
            ends,
        }
    }

    /// How far a piece goes: as far as its series is right, or to a border.
    fn piece_end(&self, piece: &Piece, curve: &Curve, part: &Part) -> (f64, Region) {
        let size = curve.dynamic + curve.fall;
        let share = if piece.ends {
            1.0
        } else {
            let mut growth: f64 = 0.0;
            let mut order = 12.0;
            for coefficient in &piece.force[12..] {
                growth = growth.max(powf(coefficient.abs() / size, 1.0 / order));
                order += 1.0;
            }
            (0.9 * powf(Self::tolerance(curve) / size, 1.0 / 16.0) / growth)
                .min(MAX_EXTENT / (part.to - part.from).abs())
                .min(1.0)
        };
        let end = curve.at(part.from + (part.to - part.from) * share);
        let ratio = horner(&piece.force, share) / end;
        let crossing = |border: f64| {
            let beyond = |share: f64| horner(&piece.ratio, share) - border;
            root_between(0.0, share, CLOSE, beyond)
        };
        if part.to > part.from && ratio > 1.0 {
            (crossing(1.0), Region::Saturated)
        } else if part.to < part.from && ratio < self.fraction {
            (crossing(self.fraction), Region::Elastic)
        } else {
            (share, Region::Yielding)
        }
    }
}

fn horner(series: &[f64; ORDER + 1], at: f64) -> f64 {
    series.iter().rev().fold(0.0, |sum, coefficient| sum * at + coefficient)
}

impl<M: MasterLaw> DeviceBristle for DeviceElastoPlastic<M> {
    fn share(&self, direction: Direction, speed: f64) -> f64 {
        let along = direction.sign() * self.force;
        let level = self.level.at(direction, speed);
        if level > 0.0 {
            let ratio = along / level;
            if ratio >= 1.0 {
                1.0 - ratio
            } else {
                self.law.rate(ratio)
            }
        } else if along < 0.0 {
            1.0
        } else {
            0.0
        }
    }

    fn dampings(&self, direction: Direction) -> (f64, f64) {
        (self.damping, self.viscous.get(direction))
    }
}

impl<M: MasterLaw> LawContact for DeviceElastoPlastic<M> {
    fn force_at_rest(&self) -> f64 {
        self.force
    }

    fn recall(&mut self, memory: &ContactMemory, _speed: f64) {
        self.force = memory.held(|direction| self.level.at(direction, 0.0));
    }

    fn archive(&mut self, archive: &mut Archive<'_>) {
        archive.number("force_N", &mut self.force);
    }

    fn contact(&self, direction: Direction, speed: f64) -> Contact {
        by_elastic_share(self.share(direction, speed), direction)
    }
}

impl<M: MasterLaw> DeviceContact for DeviceElastoPlastic<M> {
    fn advance<E: EnergyMeter>(&mut self, leg: &Leg, meter: &mut E) -> bool {
        let (direction, sign) = (leg.direction, leg.direction.sign());
        let curve = Curve::new(&self.level, direction);
        if E::LISTENS {
            meter.take(dissipated_by_nodes(self, leg, &curve, self.stiffness));
        }
        let [first, second] = curve.parts(leg);
        let (force, ran_out) = self.follow(sign * self.force, &curve, &first);
        let (force, also) = self.follow(force, &curve, &second);
        self.force = flush(sign * force);
        ran_out || also
    }

    fn friction(&self, velocity: f64) -> f64 {
        let direction = Direction::of(velocity);
        let share = self.share(direction, velocity.abs());
        self.force + (self.damping * share + self.viscous.get(direction)) * velocity
    }
}
