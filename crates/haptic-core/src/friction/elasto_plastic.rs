//! Elasto-plastic friction (Dupont, Hayward, Armstrong and Altpeter 2002, "Single state
//! elastoplastic friction models"): LuGre's bristle, but truly elastic up to a breakaway
//! deflection, and elastic whenever it is unloaded. A load that shakes below the limit does not
//! make it creep.
//!
//! ```text
//! z' = v (1 - alpha(z, v) sigma0 z sgn(v)/g(v)),   F = sigma0 z + sigma1 z' + b v
//! alpha = 0 up to zba and wherever z and v are opposed, 1 from zmax on, and half a sine wave in between
//! ```

use super::forces::StribeckForces;
use super::law::{self, Law, LawKind};
use crate::block::{Piece, PiecewiseContact, Start};
use crate::contact::{
    Bristle, BristleForce, DeviceElastoPlastic, Fall, FallSeries, LOOK_BACK_ON_CURVE, LawContact, Level, MIN_ON_CURVE,
    MasterLaw, ORDER, PathBristle, PathSeries, Plasticity, RatioSeries, TowardsLimit, UnderCurve, flow_in_pieces,
    series_product,
};
use crate::directional::{Direction, Directional};
use crate::math::{cos, sin_cos};
use crate::parameters::{Parameter, SceneError, Slot};
use crate::render::{BlockSetup, DeviceSurface, Surface};
use crate::series::{FINE_TOLERANCE_N, Newest, Path, Products, RECIPROCAL, Recurrence};
use alloc::boxed::Box;
use core::f64::consts::PI;

/// Elasto-plastic friction.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ElastoPlastic {
    /// `Fs`, N: the most that the bristle holds at rest.
    #[cfg_attr(feature = "serde", serde(alias = "Fs"))]
    pub static_force: Directional,
    /// `Fd`, N: what it holds in fast motion; not above `Fs`.
    #[cfg_attr(feature = "serde", serde(alias = "Fd"))]
    pub dynamic_force: Directional,
    /// `ws` (Stribeck's velocity), m/s; above 0 where `Fs` and `Fd` differ.
    #[cfg_attr(feature = "serde", serde(alias = "ws", alias = "vs", default))]
    pub stribeck_velocity: f64,
    /// `sigma0`, N/m.
    #[cfg_attr(feature = "serde", serde(alias = "Kp", alias = "sigma", alias = "sigma0"))]
    pub contact_stiffness: f64,
    /// `sigma1`, N s/m.
    #[cfg_attr(feature = "serde", serde(alias = "sigma1", alias = "beta", default))]
    pub contact_damping: f64,
    /// `zba` over the steady deflection `g(v)/sigma0` of the moment: the share up to which nothing
    /// flows.
    #[cfg_attr(
        feature = "serde",
        serde(alias = "zba", alias = "zs", default = "crate::friction::law::elastic_fraction")
    )]
    pub elastic_fraction: f64,
    /// `b` (`sigma2`), N s/m.
    #[cfg_attr(feature = "serde", serde(alias = "b", alias = "sigma2", default))]
    pub viscous: Directional,
}

impl ElastoPlastic {
    fn forces(&self) -> StribeckForces {
        StribeckForces {
            static_force: self.static_force,
            dynamic_force: self.dynamic_force,
            velocity: self.stribeck_velocity,
        }
    }

    fn contact<L: Level>(&self, level: L) -> Bristle<L, DelayedPlasticity> {
        Bristle {
            level,
            plasticity: DelayedPlasticity {
                fraction: self.elastic_fraction,
            },
            stiffness: self.contact_stiffness,
            damping: self.contact_damping,
            viscous: self.viscous,
            deflection: 0.0,
        }
    }
}

impl LawKind for ElastoPlastic {
    const NAME: &'static str = "elasto-plastic";
    const SUMMARY: &'static str =
        "LuGre's bristle, elastic at first, so that shaking does not make it creep (Dupont et al. 2002)";

    fn defaults() -> Self {
        Self {
            static_force: Directional::both(law::STATIC_FORCE),
            dynamic_force: Directional::both(law::DYNAMIC_FORCE),
            stribeck_velocity: law::STRIBECK_VELOCITY_MPS,
            contact_stiffness: law::DEFAULT_CONTACT_STIFFNESS,
            contact_damping: law::CONTACT_DAMPING,
            elastic_fraction: law::ELASTIC_FRACTION,
            viscous: Directional::both(0.0),
        }
    }
}

impl Law for ElastoPlastic {
    fn slot(&mut self, parameter: Parameter, _on_device: bool) -> Option<Slot<'_>> {
        match parameter {
            Parameter::StaticForce => Some(Slot::Two(&mut self.static_force)),
            Parameter::DynamicForce => Some(Slot::Two(&mut self.dynamic_force)),
            Parameter::StribeckVelocity => Some(Slot::One(&mut self.stribeck_velocity)),
            Parameter::ContactStiffness => Some(Slot::One(&mut self.contact_stiffness)),
            Parameter::ContactDamping => Some(Slot::One(&mut self.contact_damping)),
            Parameter::ElasticFraction => Some(Slot::One(&mut self.elastic_fraction)),
            Parameter::Viscous => Some(Slot::Two(&mut self.viscous)),
            _ => None,
        }
    }

    fn validate(&self, _on_device: bool) -> Result<(), SceneError> {
        self.forces().check(Self::NAME)
    }

    fn comply(&mut self) {
        (self.static_force, self.stribeck_velocity) = self.forces().complied();
    }

    fn holding_force(&self) -> Directional {
        self.static_force
    }

    fn steady_friction(&self, direction: Direction, speed: f64) -> f64 {
        self.forces().at(direction, speed) + self.viscous.get(direction) * speed
    }

    fn contact_stiffness(&self, _on_device: bool) -> f64 {
        self.contact_stiffness
    }

    fn damping_of_curve(&self) -> Option<f64> {
        Some(self.viscous.greatest() + self.contact_damping)
    }

    fn passive_from(&self, direction: Direction) -> Option<f64> {
        Some(self.forces().passive_from(direction, self.contact_damping))
    }

    fn behind_block(&self, block: &BlockSetup) -> Box<dyn Surface> {
        match self.forces().curve() {
            None => self.yielding(block, self.contact(self.dynamic_force)),
            Some(curve) => self.yielding(block, self.contact(curve)),
        }
    }

    fn on_device(&self) -> Box<dyn Surface> {
        let law = DelayedPlasticity {
            fraction: self.elastic_fraction,
        };
        let (stiffness, damping) = (self.contact_stiffness, self.contact_damping);
        match self.forces().curve() {
            None => {
                let contact = PathBristle::new(law, self.dynamic_force, stiffness, damping, self.viscous);
                Box::new(DeviceSurface::new(contact))
            }
            Some(curve) => {
                let fraction = self.elastic_fraction;
                let contact = DeviceElastoPlastic::new(law, fraction, curve, stiffness, damping, self.viscous);
                Box::new(DeviceSurface::new(contact))
            }
        }
    }
}

/// `alpha`, by the share of the steady deflection at which it begins.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DelayedPlasticity {
    fraction: f64,
}

impl DelayedPlasticity {
    /// The share of the steady deflection at which a piece of its own begins.
    fn onset(self) -> f64 {
        self.fraction.max(CENTRE)
    }

    /// The width of the borders, as a share of the steady deflection.
    fn band(self) -> f64 {
        BAND * (1.0 - self.fraction)
    }
}

impl Plasticity for DelayedPlasticity {
    const EXACT: bool = false;
    const UNLOADS_ELASTICALLY: bool = true;

    fn alpha(&self, deflection: f64, steady: f64) -> f64 {
        let ratio = deflection / steady;
        if ratio <= self.fraction {
            0.0
        } else if ratio >= 1.0 {
            1.0
        } else {
            let share = (ratio - self.fraction) / (1.0 - self.fraction);
            0.5 * (1.0 - cos(PI * share))
        }
    }

    fn flow(&self, deflection: f64, distance: f64, steady: f64) -> f64 {
        let elastic = (self.fraction * steady - deflection).max(0.0).min(distance);
        let deflection = deflection + elastic;
        let plastic = distance - elastic;
        if plastic <= 0.0 {
            return deflection;
        }
        flow_in_pieces(deflection, plastic, steady, |z| self.alpha(z, steady))
    }
}

/// A bristle enters a regime at its border, and leaves it so much below, as a share of the interval from
/// one border to the next: on the border itself the speed may sway it to and fro. What `alpha` is off
/// in between goes with the square.
const BAND: f64 = 3e-7;
/// Up to this share of the steady deflection next to nothing flows even where all of it may, less than
/// 1e-12 of the force: a series begun at rest there has its first term of the flow beyond its orders.
const CENTRE: f64 = 1e-3;
/// A force this near the end of the elastic part, as a share of it, is there.
const AT_THE_END: f64 = 1e-12;

impl<L: Level> PiecewiseContact for Bristle<L, DelayedPlasticity> {
    fn piece(&mut self, start: &Start) -> Piece {
        let direction = start.direction;
        let along = direction.sign() * self.force_at_rest();
        let kinetic = self.level.kinetic(direction);
        let fraction = self.plasticity.fraction;
        let elastic = self.plasticity.onset() * kinetic;
        if along < elastic * (1.0 - AT_THE_END) {
            return self.stretch(start, elastic, 0.0);
        }
        let fall = self.level.fall(direction);
        let falls_to = fall.map_or(0.0, |fall| fall.fallen_from);
        if let Some(fall) = fall.filter(|_| start.speed <= falls_to && falls_to > 0.0) {
            return self.flow_on_curve(start, &fall, kinetic);
        }
        if kinetic == 0.0 && along != 0.0 {
            return self.let_go(start);
        }
        if self.is_settled(along, kinetic) {
            return self.slide(start, falls_to);
        }
        let bristle = BristleForce::<true>::new(start.remaining_s, self.stiffness, self.damping, along);
        let viscous = self.viscous.get(direction);
        if along >= kinetic * (1.0 - 0.5 * self.plasticity.band()) {
            let mut series = TowardsLimit::new(bristle, kinetic, FINE_TOLERANCE_N);
            let mut expansion = start.expand(viscous, &mut series);
            let speed = expansion.falls_to(falls_to).then_some(falls_to);
            return self.bend(start, &expansion, speed, &series.bristle);
        }
        let mut series = DelayedSeries::new(bristle, RatioSeries::new(along, kinetic, None), fraction);
        let mut expansion = start.expand(viscous, &mut series);
        let speed = expansion.falls_to(falls_to).then_some(falls_to);
        self.bend(start, &expansion, speed, &series.bristle)
    }
}

impl<L: Level> Bristle<L, DelayedPlasticity> {
    /// A piece at a speed at which Stribeck's curve is felt.
    fn flow_on_curve(&mut self, start: &Start, fall: &Fall, kinetic: f64) -> Piece {
        let along = start.direction.sign() * self.force_at_rest();
        let (fraction, onset, band) = (
            self.plasticity.fraction,
            self.plasticity.onset(),
            self.plasticity.band(),
        );
        let fall = FallSeries::new(fall, start.speed);
        let bristle = BristleForce::<true>::new(start.remaining_s, self.stiffness, self.damping, along);
        let viscous = self.viscous.get(start.direction);
        let ratio = along / (kinetic + fall.at_start);
        let (expansion, stops, leaves, bristle) = if ratio < onset - 0.5 * band {
            let mut series = StretchSeries { bristle, fall };
            let mut piece = start.expand(viscous, &mut series);
            let stops = piece.falls_to(0.0);
            let yields = piece.until(|_, n| {
                let level = series.fall.get(n) + if n == 0 { kinetic } else { 0.0 };
                onset * level - series.bristle.get(n)
            });
            (piece, stops, yields, series.bristle)
        } else if ratio < 1.0 - 0.5 * band {
            let ratio = RatioSeries::new(along, kinetic, Some(fall));
            let mut series = DelayedSeries::new(bristle, ratio, fraction);
            let mut piece = start.expand(viscous, &mut series);
            let stops = piece.falls_to(0.0);
            let ratios = &series.ratio;
            let sticks = piece.until(|_, n| ratios.get(n) - if n == 0 { onset - band } else { 0.0 });
            let slides = piece.until(|_, n| if n == 0 { 1.0 - ratios.get(n) } else { -ratios.get(n) });
            (piece, stops, sticks || slides, series.bristle)
        } else {
            let ratio = RatioSeries::new(along, kinetic, Some(fall));
            let mut series = UnderCurve {
                bristle,
                ratio,
                tolerance_n: FINE_TOLERANCE_N,
            };
            let mut piece = start.expand(viscous, &mut series);
            let stops = piece.falls_to(0.0);
            let ratios = &series.ratio;
            let sticks = piece.until(|_, n| ratios.get(n) - if n == 0 { 1.0 - band } else { 0.0 });
            (piece, stops, sticks, series.bristle)
        };
        let speed = (stops && !leaves).then_some(0.0);
        self.bend(start, &expansion, speed, &bristle)
    }
}

/// A bristle that takes up the whole motion while its limit falls with speed.
struct StretchSeries {
    bristle: BristleForce<true>,
    fall: FallSeries,
}

impl Recurrence for StretchSeries {
    const LOOK_BACK: usize = LOOK_BACK_ON_CURVE;
    const MIN_ORDERS: usize = MIN_ON_CURVE;

    fn tolerance_n(&self) -> f64 {
        FINE_TOLERANCE_N
    }

    #[inline(always)]
    fn friction<const N: usize>(&mut self, _path: &Path, newest: Newest) -> f64 {
        if N == 0 {
            self.fall.begin(newest);
            return self.bristle.begin(newest.speed, 1.0);
        }
        self.fall.next::<N>(newest);
        self.bristle.next::<N>(0.0, newest)
    }

    fn newest_damping(&self) -> f64 {
        self.bristle.newest_damping()
    }

    fn next_size(&self) -> f64 {
        self.bristle.next_size().max(self.fall.size())
    }
}

/// A bristle that flows in part: `rho = 1 - alpha u`, `alpha = (1 - cos theta)/2`, `theta = pi (u -
/// f)/(1 - f)`.
struct DelayedSeries {
    bristle: BristleForce<true>,
    ratio: RatioSeries,
    /// `pi/(1 - f)`.
    a_ratio: f64,
    sine_and_cosine_at_start: (f64, f64),
    /// Of `rho`, over `u`.
    share_slope: f64,
    /// `n theta[n]` by the cosine and by the sine.
    turned: Products,
    /// `alpha u` and `w rho`.
    flown: Products,
}

impl DelayedSeries {
    fn new(bristle: BristleForce<true>, ratio: RatioSeries, fraction: f64) -> Self {
        let a_ratio = PI / (1.0 - fraction);
        let (sine, cosine) = sin_cos(a_ratio * (ratio.at_start - fraction));
        Self {
            bristle,
            ratio,
            a_ratio,
            sine_and_cosine_at_start: (sine, cosine),
            share_slope: -0.5 * ((1.0 - cosine) + a_ratio * sine * ratio.at_start),
            turned: Products::ZERO,
            flown: Products::ZERO,
        }
    }

    /// Sets the coefficients of order 0, and gives that of `rho`.
    #[inline(always)]
    fn begin(&mut self, newest: Newest) -> f64 {
        self.ratio.begin(newest);
        let (sine, cosine) = self.sine_and_cosine_at_start;
        let alpha = 0.5 * (1.0 - cosine);
        let share = 1.0 - alpha * self.ratio.at_start;
        self.turned.set(0, [0.0; 2], [cosine, sine]);
        self.flown.set(0, [alpha, newest.speed], [self.ratio.at_start, share]);
        share
    }

    /// Adds the coefficient of order `N` of `rho`, from 1 on. Gives it without the speed's newest
    /// coefficient, and the inner sum of `w rho`.
    #[inline(always)]
    fn elastic_share<const N: usize>(&mut self, newest: Newest) -> (f64, f64) {
        let turned = self.turned.inner::<N>().map(|sum| RECIPROCAL[N] * sum);
        let [flown, moved] = self.flown.inner::<N>();
        let (known_ratio, _) = self.ratio.next::<N>(self.bristle.get(N), newest);
        let ratio = self.ratio.get(N);
        let turn = self.a_ratio * ratio;
        let (sine_at_start, cosine_at_start) = self.sine_and_cosine_at_start;
        let (sine, cosine) = (turned[0] + turn * cosine_at_start, -turned[1] - turn * sine_at_start);
        let known = -(flown + 0.5 * turned[1] * self.ratio.at_start);
        let share = known + self.share_slope * ratio;
        self.turned.set(N, [N as f64 * turn; 2], [cosine, sine]);
        self.flown.set(N, [-0.5 * cosine, newest.speed], [ratio, share]);
        (known + self.share_slope * known_ratio, moved)
    }
}

impl Recurrence for DelayedSeries {
    const LOOK_BACK: usize = LOOK_BACK_ON_CURVE;
    const MIN_ORDERS: usize = MIN_ON_CURVE;

    fn tolerance_n(&self) -> f64 {
        FINE_TOLERANCE_N
    }

    #[inline(always)]
    fn friction<const N: usize>(&mut self, path: &Path, newest: Newest) -> f64 {
        if N == 0 {
            let (speed, share) = (newest.speed, self.begin(newest));
            let uptake = share + speed * self.share_slope * self.ratio.per_speed;
            return self.bristle.begin(speed * share, uptake);
        }
        let (share, moved) = self.elastic_share::<N>(newest);
        self.bristle.next::<N>(moved + path.speed.get(0) * share, newest)
    }

    fn newest_damping(&self) -> f64 {
        self.bristle.newest_damping()
    }

    fn next_size(&self) -> f64 {
        self.bristle.next_size().max(self.ratio.size())
    }
}

/// Over `X`, by the recurrences of sine and cosine.
impl MasterLaw for DelayedPlasticity {
    fn series(&self, start: f64) -> PathSeries {
        let angle = PI / (1.0 - self.fraction);
        let mut u = [0.0; ORDER + 1];
        // `k u[k]`
        let mut turns = u;
        let (mut sin, mut cos) = (u, u);
        u[0] = start;
        (sin[0], cos[0]) = sin_cos(angle * (start - self.fraction));
        let mut order = 0.0;
        for n in 0..ORDER {
            if n > 0 {
                turns[n] = order * u[n];
                let (of_sin, of_cos) = (
                    series_product(&turns[1..=n], &cos[..n]),
                    series_product(&turns[1..=n], &sin[..n]),
                );
                (sin[n], cos[n]) = (angle * of_sin / order, -angle * of_cos / order);
            }
            let turned = series_product(&cos[..=n], &u[..=n]);
            let elastic = if n == 0 { 1.0 } else { 0.0 };
            order += 1.0;
            u[n + 1] = (elastic - 0.5 * (u[n] - turned)) / order;
        }
        u
    }

    fn elastic_up_to(&self) -> Option<f64> {
        Some(self.fraction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::contact::cells_and_error;
    use std::println;

    #[test]
    fn the_master_path_is_the_law_wherever_its_elastic_part_ends() {
        for fraction in [0.0, 1e-3, 0.3, 0.7, 0.9, 0.99] {
            let (cells, error) = cells_and_error(&DelayedPlasticity { fraction }, fraction);
            println!("{fraction}: {cells} cells, {error:.1e}");
            assert!(cells < 500 && error < 1e-13, "{fraction}: {cells} cells, {error:e}");
        }
    }
}
