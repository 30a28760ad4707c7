//! Hayward and Armstrong's position-based friction (Hayward and Armstrong 2000, "A new
//! computational model of friction applied to haptic rendering"): an adhesion point `w` that is
//! dragged along by the displacement and not by time, so that the noise of a velocity cannot make
//! it drift.
//!
//! ```text
//! z = x - w,   dw = |dx| alpha(z) z,   F = sigma z,   alpha(z) ~ z^8/(zs^8 + z^8) / zmax
//! ```
//!
//! Here `alpha` is scaled so that `alpha(zmax) zmax = 1`: the force of a long slide is then `Fd`
//! itself, and not a few percent above. The authors take one explicit step a sample and put `w` at
//! `x -+ zmax` where that would overshoot; here the same equation is followed within the sample,
//! and ends there by itself.

use super::law::{self, Law, LawKind};
use crate::block::{Piece, PiecewiseContact, Start};
use crate::contact::{
    Bristle, BristleForce, LawContact, MasterLaw, ORDER, PathBristle, PathSeries, Plasticity, TowardsLimit,
    flow_in_pieces, series_product,
};
use crate::directional::{Direction, Directional};
use crate::math::sqrt;
use crate::parameters::{Parameter, Slot};
use crate::render::{BlockSetup, DeviceSurface, Surface};
use crate::series::{FINE_TOLERANCE_N, Newest, Path, Products, Recurrence};
use alloc::boxed::Box;

/// Hayward-Armstrong friction.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct HaywardArmstrong {
    /// `Fd`, N: the force of a long slide, `sigma zmax`.
    #[cfg_attr(feature = "serde", serde(alias = "Fd"))]
    pub dynamic_force: Directional,
    /// `sigma`, N/m.
    #[cfg_attr(feature = "serde", serde(alias = "Kp", alias = "sigma", alias = "sigma0"))]
    pub contact_stiffness: f64,
    /// `zs/zmax`: the share of the greatest deflection around which the contact begins to flow.
    #[cfg_attr(
        feature = "serde",
        serde(alias = "zba", alias = "zs", default = "crate::friction::law::elastic_fraction")
    )]
    pub elastic_fraction: f64,
    /// `b`, N s/m: viscous friction on top.
    #[cfg_attr(feature = "serde", serde(alias = "b", alias = "sigma2", default))]
    pub viscous: Directional,
}

impl HaywardArmstrong {
    fn plasticity(&self) -> AdhesionPlasticity {
        AdhesionPlasticity {
            fraction: self.elastic_fraction,
            onset: eighth_power(self.elastic_fraction),
        }
    }

    fn contact(&self) -> Bristle<Directional, AdhesionPlasticity> {
        Bristle {
            level: self.dynamic_force,
            plasticity: self.plasticity(),
            stiffness: self.contact_stiffness,
            damping: 0.0,
            viscous: self.viscous,
            deflection: 0.0,
        }
    }
}

impl LawKind for HaywardArmstrong {
    const NAME: &'static str = "hayward-armstrong";
    const SUMMARY: &'static str =
        "A spring dragged along by displacement alone, which no noise makes drift (Hayward and Armstrong 2000)";

    fn defaults() -> Self {
        Self {
            dynamic_force: Directional::both(law::DYNAMIC_FORCE),
            contact_stiffness: law::DEFAULT_CONTACT_STIFFNESS,
            elastic_fraction: law::ELASTIC_FRACTION,
            viscous: Directional::both(0.0),
        }
    }
}

impl Law for HaywardArmstrong {
    fn slot(&mut self, parameter: Parameter, _on_device: bool) -> Option<Slot<'_>> {
        match parameter {
            Parameter::DynamicForce => Some(Slot::Two(&mut self.dynamic_force)),
            Parameter::ContactStiffness => Some(Slot::One(&mut self.contact_stiffness)),
            Parameter::ElasticFraction => Some(Slot::One(&mut self.elastic_fraction)),
            Parameter::Viscous => Some(Slot::Two(&mut self.viscous)),
            _ => None,
        }
    }

    fn holding_force(&self) -> Directional {
        self.dynamic_force
    }

    fn steady_friction(&self, direction: Direction, speed: f64) -> f64 {
        self.dynamic_force.get(direction) + self.viscous.get(direction) * speed
    }

    fn contact_stiffness(&self, _on_device: bool) -> f64 {
        self.contact_stiffness
    }

    fn damping_of_curve(&self) -> Option<f64> {
        Some(self.viscous.greatest())
    }

    fn behind_block(&self, block: &BlockSetup) -> Box<dyn Surface> {
        self.yielding(block, self.contact())
    }

    fn on_device(&self) -> Box<dyn Surface> {
        let contact = PathBristle::new(
            self.plasticity(),
            self.dynamic_force,
            self.contact_stiffness,
            0.0,
            self.viscous,
        );
        Box::new(DeviceSurface::new(contact))
    }
}

fn eighth_power(x: f64) -> f64 {
    let fourth = x * x * x * x;
    fourth * fourth
}

/// `alpha`, with the onset `(zs/zmax)^8`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct AdhesionPlasticity {
    fraction: f64,
    onset: f64,
}

impl Plasticity for AdhesionPlasticity {
    const EXACT: bool = false;
    const UNLOADS_ELASTICALLY: bool = false;

    fn alpha(&self, deflection: f64, steady: f64) -> f64 {
        // The same on either side: also a contact that is unloaded flows beyond zs.
        let r = eighth_power(deflection / steady);
        if r == 0.0 {
            return 0.0;
        }
        (1.0 + self.onset) / (1.0 + self.onset / r)
    }

    fn flow(&self, deflection: f64, distance: f64, steady: f64) -> f64 {
        flow_in_pieces(deflection, distance, steady, |z| self.alpha(z, steady))
    }
}

/// An onset below this, `(1e-6)^8`, is none: of a deflection of `zmax` it changes 1e-12.
const NO_ONSET: f64 = 1e-48;

impl PiecewiseContact for Bristle<Directional, AdhesionPlasticity> {
    fn piece(&mut self, start: &Start) -> Piece {
        let direction = start.direction;
        let along = direction.sign() * self.force_at_rest();
        let limit = self.level.get(direction);
        if limit == 0.0 && along != 0.0 {
            return self.let_go(start);
        }
        if self.is_settled(along, limit) {
            return self.slide(start, 0.0);
        }
        let centre = CENTRE * self.plasticity.fraction * limit;
        if along.abs() < centre * (1.0 - 1e-12) {
            return self.stretch(start, centre, 0.0);
        }
        let bristle = BristleForce::<false>::new(start.remaining_s, self.stiffness, 0.0, along);
        let viscous = self.viscous.get(direction);
        if self.plasticity.onset < NO_ONSET {
            let mut series = TowardsLimit::new(bristle, limit, FINE_TOLERANCE_N);
            let mut expansion = start.expand(viscous, &mut series);
            let speed = expansion.falls_to(0.0).then_some(0.0);
            return self.bend(start, &expansion, speed, &series.bristle);
        }
        let mut series = AdhesionSeries::new(bristle, limit, self.plasticity.onset);
        let mut expansion = start.expand(viscous, &mut series);
        let mut speed = expansion.falls_to(0.0).then_some(0.0);
        if along < 0.0 && self.plasticity.fraction < NEAR_CENTRE {
            // The narrow part ahead hardly shows in a series from afar: by halves it comes nearer.
            let nearer = expansion.until(|_, n| if n == 0 { -0.5 * along } else { -series.bristle.get(n) });
            speed = speed.filter(|_| !nearer);
        }
        self.bend(start, &expansion, speed, &series.bristle)
    }
}

/// Up to this share of `zs` what flows is `u^10/10 o` of the force, less than 1e-12 of it: nothing.
/// A series begun there has its first term of the flow beyond its order.
const CENTRE: f64 = 0.08;
/// Up to this share of the greatest deflection the coefficients of a series say less of those that
/// follow.
const NEAR_CENTRE: f64 = 0.35;

/// The recurrences of the law: `rho = 1 - (1 + o)(u - o u/(o + u^8))`, with `u = p/Fd` and the onset
/// `o`. Each coefficient is that of `u` times a slope at the start, and what older ones add.
struct AdhesionSeries {
    bristle: BristleForce<false>,
    onset: f64,
    inverse_limit: f64,
    /// `u`, `u^2`, `u^4` and `u^8` at the start, and their slopes over `u`.
    powers: [f64; 4],
    power_slopes: [f64; 4],
    /// `1/(o + u^8)` at the start, and its slope.
    inverse: f64,
    inverse_slope: f64,
    /// `rho` at the start, and its slope.
    share: f64,
    share_slope: f64,
    /// The squares of `u` and of `u^2`.
    squares: Products,
    /// The square of `u^4`, and `w rho`.
    moved: Products,
    /// `u^8` and `u` over `o + u^8`.
    adhered: Products,
}

impl AdhesionSeries {
    fn new(bristle: BristleForce<false>, limit: f64, onset: f64) -> Self {
        let inverse_limit = 1.0 / limit;
        let ratio = bristle.at_start() * inverse_limit;
        let (mut powers, mut power_slopes) = ([ratio; 4], [1.0; 4]);
        for k in 1..4 {
            powers[k] = powers[k - 1] * powers[k - 1];
            power_slopes[k] = 2.0 * powers[k - 1] * power_slopes[k - 1];
        }
        let inverse = 1.0 / (onset + powers[3]);
        let inverse_slope = -inverse * inverse * power_slopes[3];
        Self {
            bristle,
            onset,
            inverse_limit,
            powers,
            power_slopes,
            inverse,
            inverse_slope,
            share: 1.0 - (1.0 + onset) * (ratio - onset * ratio * inverse),
            share_slope: -(1.0 + onset) * (1.0 - onset * (inverse + ratio * inverse_slope)),
            squares: Products::ZERO,
            moved: Products::ZERO,
            adhered: Products::ZERO,
        }
    }

    /// Sets the coefficients of order 0.
    #[inline(always)]
    fn begin(&mut self, newest: Newest) {
        let [first, second, fourth, eighth] = self.powers;
        self.squares.set(0, [first, second], [first, second]);
        self.moved.set(0, [fourth, newest.speed], [fourth, self.share]);
        self.adhered.set(0, [eighth, first], [self.inverse; 2]);
    }

    /// Adds the coefficient of order `N` of `rho`, from 1 on, for one of `u`. Gives it, and the inner
    /// sum of `w rho`.
    #[inline(always)]
    fn elastic_share<const N: usize>(&mut self, ratio: f64, newest: Newest) -> (f64, f64) {
        let [inverted, adhered] = self.adhered.inner::<N>();
        let [of_first, of_second] = self.squares.inner::<N>();
        let [of_fourth, moved] = self.moved.inner::<N>();
        let [first, second, fourth, _] = self.powers;
        let known_fourth = of_second + 2.0 * second * of_first;
        let known_eighth = of_fourth + 2.0 * fourth * known_fourth;
        let power = |k: usize, known: f64| known + self.power_slopes[k] * ratio;
        let known_inverse = -self.inverse * (inverted + self.inverse * known_eighth);
        let known_product = adhered + first * known_inverse;
        let share = (1.0 + self.onset) * self.onset * known_product + self.share_slope * ratio;
        let (second, fourth, eighth) = (power(1, of_first), power(2, known_fourth), power(3, known_eighth));
        let inverse = known_inverse + self.inverse_slope * ratio;
        self.squares.set(N, [ratio, second], [ratio, second]);
        self.moved.set(N, [fourth, newest.speed], [fourth, share]);
        self.adhered.set(N, [eighth, ratio], [inverse; 2]);
        (share, moved)
    }
}

impl Recurrence for AdhesionSeries {
    const LOOK_BACK: usize = 8;
    const MIN_ORDERS: usize = 11;

    fn tolerance_n(&self) -> f64 {
        // What is left out adds up over the pieces of a tick: a median error of 1e-11 N needs this.
        1.5e-10
    }

    fn caution(&self) -> f64 {
        if self.powers[0].abs() < NEAR_CENTRE { 0.7 } else { 1.0 }
    }

    #[inline(always)]
    fn friction<const N: usize>(&mut self, path: &Path, newest: Newest) -> f64 {
        if N == 0 {
            self.begin(newest);
            return self.bristle.begin(newest.speed * self.share, self.share);
        }
        let ratio = self.bristle.get(N) * self.inverse_limit;
        let (share, moved) = self.elastic_share::<N>(ratio, newest);
        self.bristle.next::<N>(moved + path.speed.get(0) * share, newest)
    }

    fn next_size(&self) -> f64 {
        self.bristle.next_size()
    }
}

/// Over `X`, by products and a quotient: `alpha u = (1 + o)(u - o u/(o + u^8))`.
impl MasterLaw for AdhesionPlasticity {
    fn series(&self, start: f64) -> PathSeries {
        let onset = if self.onset > NO_ONSET { self.onset } else { 0.0 };
        let mut u = [0.0; ORDER + 1];
        let (mut u2, mut u4, mut u8) = (u, u, u);
        // 1/(o + u^8)
        let mut quotient = u;
        u[0] = start;
        let mut order = 0.0;
        for n in 0..ORDER {
            let product = |a: &PathSeries, b: &PathSeries| series_product(&a[..=n], &b[..=n]);
            let mut delayed = 0.0;
            if onset > 0.0 {
                u2[n] = product(&u, &u);
                u4[n] = product(&u2, &u2);
                u8[n] = product(&u4, &u4);
                quotient[n] = if n == 0 {
                    1.0 / (onset + u8[0])
                } else {
                    -quotient[0] * series_product(&u8[1..=n], &quotient[..n])
                };
                delayed = onset * product(&u, &quotient);
            }
            let elastic = if n == 0 { 1.0 } else { 0.0 };
            order += 1.0;
            u[n + 1] = (elastic - (1.0 + onset) * (u[n] - delayed)) / order;
        }
        u
    }

    /// Nothing flows around a deflection of zero, on a part as narrow as the onset is low.
    fn widest(&self, u: f64) -> f64 {
        let end = sqrt(sqrt(sqrt(self.onset)));
        if u < end && self.onset > NO_ONSET {
            0.5 * u.abs() + 0.3 * end
        } else {
            f64::INFINITY
        }
    }

    fn far(&self) -> (f64, f64) {
        (1.0 + self.onset, 1.0 / (1.0 + self.onset))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::cells_and_error;
    use std::println;

    #[test]
    fn master_path_matches_law_for_any_onset_and_start() {
        for fraction in [0.0, 1e-9, 1e-3, 0.05, 0.3, 0.7, 0.99] {
            for start in [-1.0, -10.0, -128.0] {
                let law = AdhesionPlasticity {
                    fraction,
                    onset: eighth_power(fraction),
                };
                let (cells, error) = cells_and_error(&law, start);
                println!("{fraction} from {start}: {cells} cells, {error:.1e}");
                assert!(
                    cells < 500 && error < 1e-13,
                    "{fraction} from {start}: {cells} cells, {error:e}"
                );
            }
        }
    }
}
