//! A piece of a motion under a curved law: its Taylor series, as far as it converges, up to the
//! first event on the way.
//!
//! ```text
//! y[n+1] = H w[n]/(n+1)      w[n+1] = H/(M (n+1)) (L[n] - K y[n] - (B + b) w[n] - F[n])
//! ```
//!
//! with `y` the distance along the motion, `w` the speed, `H` the time left of the tick, which is 1 in
//! the series' own time, `L` the pull of the device and `F` the friction, whose coefficients the
//! law gives. Orders are added until two in a row are nothing: then one piece is the rest of the
//! tick. Where that takes more than [`ORDER`], the last coefficients say how far the series may be
//! used.

use super::body::Coupling;
use crate::directional::Direction;
use crate::math::sqrt;
use crate::series::{Newest, ORDER, Path, RECIPROCAL, ROOM, Recurrence, Series, first_root};

/// Share of the series' own time that a piece takes at most where the series does not reach its end.
const MAX_SHARE: f64 = 0.95;
/// Share taken of the length that the last coefficients promise.
const SHARE: f64 = 0.9;

/// A block in its coupling, as every piece needs it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct CoupledMass {
    /// kg.
    pub(crate) mass: f64,
    pub(crate) coupling: Coupling,
    inverse_mass: f64,
    /// `B + sqrt(K M)`: what a speed is in the coupling force, N s/m.
    impedance: f64,
    /// The size of the contact's forces, N.
    holds: f64,
}

impl CoupledMass {
    /// `holds` is the most that the contact holds, N.
    pub(crate) fn new(mass: f64, coupling: Coupling, holds: f64) -> Self {
        Self {
            mass,
            coupling,
            inverse_mass: 1.0 / mass,
            impedance: coupling.damping + sqrt(coupling.stiffness * mass),
            holds: holds.max(1e-3),
        }
    }
}

/// Where a piece starts. Speeds and forces along the direction are positive.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Start {
    pub(crate) held: CoupledMass,
    pub(crate) direction: Direction,
    /// Speed along the direction, m/s.
    pub(crate) speed: f64,
    /// The coupling force if the block stood still, N, along the direction, and its slope, N/s.
    pub(crate) at_rest: f64,
    pub(crate) slope: f64,
    /// Net force at the start, N, where an event fixes it better than subtraction can.
    pub(crate) net: Option<f64>,
    /// Time to the end of the tick, s.
    pub(crate) remaining_s: f64,
    /// Whether a listener wants the energy.
    pub(crate) listens: bool,
}

/// One piece, in the coordinate in which it goes forwards.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    pub(crate) lasted_s: f64,
    pub(crate) distance: f64,
    pub(crate) speed: f64,
    /// Energy that the friction took and the contact does not hold, J; 0 where nobody listens.
    pub(crate) dissipated: f64,
    /// Work that it took.
    pub(crate) work: u32,
}

/// What is known of a series to which orders are added.
struct Growing {
    newest: Newest,
    /// Of the coefficients, N.
    sizes: [f64; ROOM],
    /// `B + b`, and from order 1 on what the law adds of the newest speed, N s/m.
    damping: f64,
    /// `H/M`: speed of a force, m/s/N.
    acceleration: f64,
    /// Two coefficients that are less than this are nothing, N.
    nothing: f64,
}

/// A series, and how far it is used.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Expansion {
    pub(crate) path: Path,
    /// The last order.
    last: usize,
    /// In the series' own time.
    pub(crate) end: f64,
}

impl Start {
    /// A piece of no length, in which the contact lost an energy, J.
    pub(crate) fn no_distance(&self, dissipated: f64) -> Piece {
        Piece {
            lasted_s: 0.0,
            distance: 0.0,
            speed: self.speed,
            dissipated,
            work: 1,
        }
    }

    /// About the time that a distance takes, s, m, against a friction as it is at the start, N.
    pub(crate) fn time_for(&self, distance: f64, friction: f64) -> f64 {
        let drag = self.held.coupling.damping * self.speed;
        let push = self.net.unwrap_or(self.at_rest - friction - drag);
        let gains = 2.0 * (push.max(0.0) * self.held.inverse_mass) * distance;
        2.0 * distance / (self.speed + sqrt(self.speed * self.speed + gains))
    }

    /// The motion under a law in one of its regimes; `viscous` is `b`, N s/m.
    #[inline(always)]
    pub(crate) fn expand<R: Recurrence>(&self, viscous: f64, law: &mut R) -> Expansion {
        let mut expansion = Expansion {
            path: Path::new(self.remaining_s),
            last: ORDER,
            end: 1.0,
        };
        self.add_orders(viscous, law, &mut expansion);
        expansion
    }

    /// Adds orders where the series are: none is copied while its newest coefficients are on their
    /// way to memory.
    #[inline(never)]
    fn add_orders<R: Recurrence>(&self, viscous: f64, law: &mut R, expansion: &mut Expansion) {
        let mut growing = Growing {
            newest: Newest {
                distance: 0.0,
                speed: self.speed,
            },
            sizes: [0.0; ROOM],
            damping: self.held.coupling.damping + viscous,
            acceleration: self.held.inverse_mass * self.remaining_s,
            nothing: 0.25 * law.tolerance_n(),
        };
        'orders: {
            macro_rules! add_orders {
                ($($n:literal)*) => {
                    $(
                        if self.adds_nothing::<$n, R>(law, &mut expansion.path, &mut growing) {
                            expansion.last = $n + 1;
                            break 'orders;
                        }
                    )*
                };
            }
            add_orders!(0 1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 19);
            let last_sizes = &growing.sizes[ROOM - R::LOOK_BACK..];
            let reach = law.caution() * self.reach(last_sizes, law.tolerance_n());
            expansion.end = reach.min(MAX_SHARE);
        }
        let Newest { distance, speed } = growing.newest;
        expansion.path.set(expansion.last, distance, speed);
    }

    /// Adds the order after `N`; whether it and the one before it are nothing.
    #[inline(always)]
    fn adds_nothing<const N: usize, R: Recurrence>(&self, law: &mut R, path: &mut Path, growing: &mut Growing) -> bool {
        let Newest { distance, speed } = growing.newest;
        let duration_s = self.remaining_s;
        let friction = law.friction::<N>(path, growing.newest);
        path.set(N, distance, speed);
        let known = self.held.coupling.stiffness * distance + friction;
        let damped = growing.damping * speed;
        let force = match N {
            0 => self.net.unwrap_or(self.at_rest - known - damped),
            1 => (self.slope * duration_s - known) - damped,
            _ => -known - damped,
        };
        if N == 0 {
            growing.damping += law.newest_damping();
        }
        growing.newest = Newest {
            distance: (RECIPROCAL[N + 1] * duration_s) * speed,
            speed: (RECIPROCAL[N + 1] * growing.acceleration) * force,
        };
        if N + 2 >= R::MIN_ORDERS {
            growing.sizes[N + 1] = self.held.impedance * growing.newest.speed.abs() + law.next_size();
        }
        N + 1 >= R::MIN_ORDERS && growing.sizes[N] + growing.sizes[N + 1] < growing.nothing
    }

    /// How far a series reaches whose last coefficients have these sizes, N, until what it leaves
    /// out is the tolerance, N.
    fn reach(&self, sizes: &[f64], tolerance_n: f64) -> f64 {
        let scale = log2(self.held.holds);
        let growth = sizes
            .iter()
            .rev()
            .zip(RECIPROCAL[..=ORDER].iter().rev())
            .map(|(&size, &of_order)| (log2(size) - scale) * of_order)
            .fold(f64::MIN, f64::max);
        let allowed = (log2(tolerance_n) - scale) * RECIPROCAL[ORDER];
        SHARE * exp2(allowed - growth)
    }
}

/// What a number of 1 has as its bits, and what of them its exponent is counted in.
const ONE: f64 = 1023.0;
const EXPONENT: f64 = (1_u64 << 52) as f64;

/// The binary logarithm of a number that is not negative, to 0.09: a straight line between powers
/// of two. Of zero it is as little as a number has.
fn log2(value: f64) -> f64 {
    value.to_bits().cast_signed() as f64 / EXPONENT - ONE
}

/// A power of two, to 0.3 %: a parabola between whole ones.
fn exp2(power: f64) -> f64 {
    let power = (power + ONE).max(0.0);
    let whole = power as i64;
    let part = power - whole as f64;
    f64::from_bits(whole.cast_unsigned() << 52) * (1.0 + part * (0.6565 + 0.3435 * part))
}

impl Expansion {
    /// Ends the piece where the speed falls to a level, m/s; whether it does. A piece that begins at
    /// the level leaves it first.
    pub(crate) fn falls_to(&mut self, level: f64) -> bool {
        let mut speeds = *self.path.speed.coefficients();
        speeds[0] -= level;
        self.ends_at_root_of(speeds)
    }

    /// Ends the piece where a series comes down to zero, whose coefficients follow from the path;
    /// whether it does.
    pub(crate) fn until(&mut self, coefficient: impl Fn(&Path, usize) -> f64) -> bool {
        let mut polynomial = [0.0; ROOM];
        for (n, term) in polynomial.iter_mut().enumerate().take(self.last + 1) {
            *term = coefficient(&self.path, n);
        }
        self.ends_at_root_of(polynomial)
    }

    /// Ends the piece at the first root of a polynomial; whether there is one. One at the start
    /// itself is left behind.
    fn ends_at_root_of(&mut self, mut polynomial: [f64; ROOM]) -> bool {
        let mut degree = self.last;
        while polynomial[0] == 0.0 && degree > 0 {
            polynomial.copy_within(1.., 0);
            polynomial[degree] = 0.0;
            degree -= 1;
        }
        let root = first_root(&polynomial, degree, self.end);
        self.end = root.unwrap_or(self.end);
        root.is_some()
    }

    /// The last order of what the law gives: one less than the motion's.
    pub(crate) fn last_of_law(&self) -> usize {
        self.last - 1
    }

    /// The value of a series of the path at the end.
    pub(crate) fn at_end(&self, series: &Series) -> f64 {
        series.at(self.end)
    }

    /// The piece. `speed` is that of the event that ended it, m/s.
    pub(crate) fn piece(&self, speed: Option<f64>, dissipated: f64) -> Piece {
        Piece {
            lasted_s: self.end * self.path.duration_s,
            distance: self.at_end(&self.path.distance).max(0.0),
            speed: speed.unwrap_or_else(|| self.at_end(&self.path.speed).max(0.0)),
            dissipated,
            work: 1,
        }
    }
}
