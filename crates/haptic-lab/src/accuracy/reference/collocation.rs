//! Gauss's collocation with eight nodes, a method of order 16 (Hairer, Lubich and Wanner,
//! "Geometric Numerical Integration", II.1.3): over a piece, the rates of change are a polynomial
//! that satisfies the differential equation at the nodes. It needs the equation's right-hand side
//! and nothing else of a law: no series, no tangent, no closed form.

/// Nodes of the method.
const NODES: usize = 8;
/// Points of a piece at which events are looked for.
const POINTS: usize = 32;
/// Most sweeps over the nodes; a piece short enough to be accurate takes about 14.
const MAX_SWEEPS: usize = 60;
/// Sweeps continue until a change is this much below the sum that it changes,
const ROUNDING: f64 = 1e-16;
/// or this much, and no longer gets smaller: forces are differences.
const NOISE: f64 = 1e-12;
/// Halvings and secants that find an event to the last digit.
const MAX_SECANTS: usize = 100;

/// The method's coefficients.
pub(super) struct Rule {
    nodes: [f64; NODES],
    weights: [f64; NODES],
    /// Integrals of the nodes' Lagrange polynomials up to each node.
    to_node: [[f64; NODES]; NODES],
    /// The same up to the points of [`POINTS`].
    to_point: Vec<[f64; NODES]>,
    /// What gives the two highest Legendre coefficients of the rates.
    highest: [[f64; NODES]; 2],
}

/// A piece of a solution, as increments from its start.
pub(super) struct Piece<const D: usize> {
    /// Its length, s.
    pub(super) length: f64,
    rates: [[f64; D]; NODES],
    /// The increments over the whole of it.
    pub(super) end: [f64; D],
}

/// `P_n(x)` and `P_n'(x)`.
fn legendre(n: usize, x: f64) -> (f64, f64) {
    let (mut before, mut value) = (1.0, x);
    if n == 0 {
        return (1.0, 0.0);
    }
    for k in 1..n {
        let k = k as f64;
        (before, value) = (value, ((2.0 * k + 1.0) * x * value - k * before) / (k + 1.0));
    }
    (value, n as f64 * (x * value - before) / (x * x - 1.0))
}

impl Rule {
    pub(super) fn new() -> Self {
        let (mut nodes, mut weights) = ([0.0; NODES], [0.0; NODES]);
        for i in 0..NODES {
            let mut x = -(std::f64::consts::PI * (i as f64 + 0.75) / (NODES as f64 + 0.5)).cos();
            for _ in 0..20 {
                let (value, slope) = legendre(NODES, x);
                x -= value / slope;
            }
            let (_, slope) = legendre(NODES, x);
            nodes[i] = 0.5 * (1.0 + x);
            weights[i] = 1.0 / ((1.0 - x * x) * slope * slope);
        }
        // Gauss's quadrature of these polynomials is exact.
        let up_to = |end: f64| -> [f64; NODES] {
            std::array::from_fn(|j| {
                let lagrange = |t: f64| -> f64 {
                    (0..NODES)
                        .filter(|&k| k != j)
                        .map(|k| (t - nodes[k]) / (nodes[j] - nodes[k]))
                        .product()
                };
                let sum: f64 = (0..NODES).map(|m| weights[m] * lagrange(end * nodes[m])).sum();
                end * sum
            })
        };
        Self {
            nodes,
            weights,
            to_node: std::array::from_fn(|i| up_to(nodes[i])),
            to_point: (0..=POINTS).map(|k| up_to(k as f64 / POINTS as f64)).collect(),
            highest: [NODES - 2, NODES - 1].map(|n| {
                std::array::from_fn(|j| (2 * n + 1) as f64 * weights[j] * legendre(n, 2.0 * nodes[j] - 1.0).0)
            }),
        }
    }

    /// Solves a piece by sweeps over its nodes. `sizes` turn the state's components into newtons.
    /// `None` where the sweeps do not converge: the piece is too long.
    pub(super) fn piece<const D: usize>(
        &self,
        length: f64,
        sizes: &[f64; D],
        rate: impl Fn(f64, &[f64; D]) -> [f64; D],
    ) -> Option<Piece<D>> {
        let mut rates = [rate(0.0, &[0.0; D]); NODES];
        let mut last_change = f64::INFINITY;
        for _ in 0..MAX_SWEEPS {
            let mut next = rates;
            let (mut change, mut size) = (0.0_f64, 0.0_f64);
            for (i, to_node) in self.to_node.iter().enumerate() {
                next[i] = rate(length * self.nodes[i], &combine(length, to_node, &rates));
                for d in 0..D {
                    if !next[i][d].is_finite() {
                        return None;
                    }
                    change = change.max(sizes[d] * length * (next[i][d] - rates[i][d]).abs());
                    size = size.max(sizes[d] * length * next[i][d].abs());
                }
            }
            rates = next;
            let stands_still = change >= 0.9 * last_change && change <= NOISE * (size + 1.0);
            if change <= ROUNDING * size || stands_still {
                let end = combine(length, &self.weights, &rates);
                return Some(Piece { length, rates, end });
            }
            last_change = change;
        }
        None
    }

    /// How much the two highest orders of the rates add to a piece, N: a measure of what is left
    /// out, and far more than it.
    pub(super) fn highest_orders<const D: usize>(&self, piece: &Piece<D>, sizes: &[f64; D]) -> f64 {
        let [a, b] = self
            .highest
            .map(|weights| combine(piece.length, &weights, &piece.rates));
        (0..D).map(|d| sizes[d] * (a[d].abs() + b[d].abs())).fold(0.0, f64::max)
    }

    /// The times between which `value`, which is not negative at first, first falls below zero
    /// along a piece, dips included.
    pub(super) fn first_fall<const D: usize>(
        &self,
        piece: &Piece<D>,
        value: impl Fn(f64, &[f64; D]) -> f64,
    ) -> Option<(f64, f64)> {
        let time = |k: usize| piece.length * k as f64 / POINTS as f64;
        let at = |k: usize| value(time(k), &combine(piece.length, &self.to_point[k], &piece.rates));
        let (mut before, mut here) = (f64::NAN, value(0.0, &[0.0; D]));
        for k in 1..=POINTS {
            let next = at(k);
            if next < 0.0 {
                return Some((time(k - 1), time(k)));
            }
            // A low point between: the parabola through three says how low it may be.
            let (fall, rise) = (before - here, next - here);
            if fall > 0.0 && rise >= 0.0 && here < fall.max(rise) {
                let lowest = self.lowest(piece, time(k - 2), time(k), &value);
                if value(lowest, &self.inside(piece, lowest)) < 0.0 {
                    return Some((time(k - 2), lowest));
                }
            }
            (before, here) = (here, next);
        }
        None
    }

    /// The increments at a time within a piece.
    pub(super) fn inside<const D: usize>(&self, piece: &Piece<D>, time: f64) -> [f64; D] {
        // The polynomial of the points around, of the same degree, through the nearest nine.
        let share = time / piece.length * POINTS as f64;
        #[expect(clippy::cast_sign_loss, reason = "within the points")]
        let first = (share as usize).saturating_sub(NODES / 2).min(POINTS - NODES);
        let points = first..=first + NODES;
        let mut sum = [0.0; D];
        for k in points.clone() {
            let weight: f64 = points
                .clone()
                .filter(|&other| other != k)
                .map(|other| (share - other as f64) / (k as f64 - other as f64))
                .product();
            let there = combine(piece.length, &self.to_point[k], &piece.rates);
            for d in 0..D {
                sum[d] += weight * there[d];
            }
        }
        sum
    }

    /// Where a value is lowest between two times, by the golden section.
    fn lowest<const D: usize>(
        &self,
        piece: &Piece<D>,
        from: f64,
        to: f64,
        value: &impl Fn(f64, &[f64; D]) -> f64,
    ) -> f64 {
        let at = |time: f64| value(time, &self.inside(piece, time));
        let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
        let (mut low, mut high) = (from, to);
        for _ in 0..50 {
            let (left, right) = (high - golden * (high - low), low + golden * (high - low));
            if at(left) < at(right) {
                high = right;
            } else {
                low = left;
            }
        }
        0.5 * (low + high)
    }
}

fn combine<const D: usize>(length: f64, weights: &[f64; NODES], rates: &[[f64; D]; NODES]) -> [f64; D] {
    let mut sum = [0.0; D];
    for (weight, rate) in weights.iter().zip(rates) {
        for d in 0..D {
            sum[d] += weight * rate[d];
        }
    }
    sum.map(|sum| length * sum)
}

/// The time between two at which a value falls through zero, by secants that halve the value of an
/// end which stands still (the Illinois method), or else by halving.
pub(super) fn root(from: f64, to: f64, value: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high) = (from, to);
    let (mut at_low, mut at_high) = (value(low), value(high));
    if at_low <= 0.0 {
        return low;
    }
    for turn in 0..MAX_SECANTS {
        let secant = high - at_high * (high - low) / (at_high - at_low);
        let middle = if turn % 8 < 6 && secant > low && secant < high {
            secant
        } else {
            0.5 * (low + high)
        };
        if middle <= low || middle >= high || high - low <= 1e-16 * to {
            break;
        }
        let there = value(middle);
        if there > 0.0 {
            (low, at_low) = (middle, there);
            at_high *= 0.5;
        } else {
            (high, at_high) = (middle, there);
            at_low *= 0.5;
            if there == 0.0 {
                break;
            }
        }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_piece_is_right_to_rounding_and_a_dip_is_seen() {
        let rule = Rule::new();
        // y'' = -y from (0, 1), over a radian: y = sin t.
        let swing = |_: f64, y: &[f64; 2]| [1.0 + y[1], -y[0]];
        let piece = rule.piece(1.0, &[1.0, 1.0], swing).expect("short enough");
        assert!((piece.end[0] - 1.0_f64.sin()).abs() < 1e-15, "{:?}", piece.end);
        assert!((piece.end[1] + 1.0 - 1.0_f64.cos()).abs() < 1e-15, "{:?}", piece.end);
        // A value that is below zero from 0.5 - 1e-6 to 0.5 + 1e-6 only.
        let dip = |t: f64, _: &[f64; 2]| (t - 0.5 - 1e-3).powi(2) - 1e-12;
        let (from, to) = rule.first_fall(&piece, dip).expect("a dip");
        let found = root(from, to, |t| dip(t, &[0.0; 2]));
        assert!((found - (0.501 - 1e-6)).abs() < 1e-13, "{found}");
    }
}
