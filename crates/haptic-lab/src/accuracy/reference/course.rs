//! A contact in motion, by collocation from one event to the next: every change of direction, of
//! contact and of regime is found on the way, so that no piece runs across a kink.
//!
//! Increments are computed in double precision and summed in double-double (31 digits): what
//! rounding leaves of a force is below 1e-13 N.

use super::collocation::{Piece, Rule, root};
use super::equations::{Law, Mode, Regime};
use haptic_core::Direction;
use haptic_core::block::Contact;
use haptic_core::friction::{Friction, Karnopp};
use twofloat::TwoFloat;

/// What the two highest orders of a piece may add, N: what the piece then leaves out is several
/// powers below.
pub(super) const TOLERANCE_N: f64 = 1e-10;
/// Most pieces of a tick: a run that takes more is a mistake of this solver.
const MAX_PIECES: usize = 10_000_000;
/// Share of the velocity, or of the one over which friction falls, that a piece may take away.
const FALL: f64 = 0.5;

/// What moves the contact within a tick.
pub(super) trait Driver {
    /// Acceleration, m/s^2, at a time of the tick, after a displacement since the start of the
    /// piece, at a velocity and under a friction.
    fn acceleration(&self, t: f64, displacement: f64, velocity: f64, friction: f64) -> f64;

    /// The load at rest at a time of the tick, N, and its slope, N/s; `None` where the motion is
    /// given, and no load asks whether the contact holds.
    fn load(&self, t: f64) -> Option<(f64, f64)>;

    /// Newtons for a meter and for a meter a second.
    fn sizes(&self) -> [f64; 2];

    /// The end of a piece at a time of the tick, after a displacement.
    fn advance(&mut self, t: f64, displacement: f64);
}

/// A contact with its velocity.
pub(super) struct Course<'a> {
    pub(super) law: Law<'a>,
    rule: Rule,
    tolerance_n: f64,
    pub(super) w: TwoFloat,
    pub(super) z: TwoFloat,
    pub(super) mode: Mode,
    /// Length of the piece to try next, s.
    try_s: f64,
}

fn exact(value: f64) -> TwoFloat {
    TwoFloat::from(value)
}

impl<'a> Course<'a> {
    pub(super) fn new(law: &'a Friction, tolerance_n: f64, velocity: f64, mode: Mode, z: f64) -> Self {
        Self {
            law: Law(law),
            rule: Rule::new(),
            tolerance_n,
            w: exact(velocity),
            z: exact(z),
            mode,
            try_s: f64::INFINITY,
        }
    }

    /// What the contact holds at rest, N.
    pub(super) fn force_at_rest(&self) -> f64 {
        self.law.friction(0.0, f64::from(self.z), self.mode).0
    }

    pub(super) fn contact(&self) -> Contact {
        self.law.contact(f64::from(self.w), f64::from(self.z), self.mode)
    }

    /// Begins to move one way, with a force in the contact and the friction that the slide began
    /// with, N.
    pub(super) fn move_on(&mut self, direction: Direction, peak: f64, force: f64) {
        let (mode, z) = self.law.moving(direction, peak, f64::from(self.w), force);
        (self.mode, self.z) = (mode, exact(z));
    }

    /// Integrates a tick from one time of it to another; reports each change of mode.
    pub(super) fn follow(
        &mut self,
        driver: &mut impl Driver,
        from_s: f64,
        to_s: f64,
        mut changed: impl FnMut(f64, Mode, Mode),
    ) {
        let mut t = from_s;
        for _ in 0..MAX_PIECES {
            if t >= to_s {
                return;
            }
            let before = self.mode;
            if before == Mode::Rigid {
                let Some(broke) = self.breakaway(driver, t, to_s) else {
                    self.z += exact(to_s - t);
                    return;
                };
                t = broke;
            } else {
                t = self.piece(driver, t, to_s);
            }
            if self.mode != before {
                changed(t, before, self.mode);
            }
        }
        panic!("the reference solver does not come to the end of a tick");
    }

    /// When a rigid contact breaks away: the load along a direction is a straight line, and the
    /// limit rises ever more slowly, so that it does so once at most each way.
    fn breakaway(&mut self, driver: &impl Driver, t: f64, to_s: f64) -> Option<f64> {
        let rest = f64::from(self.z);
        let excess = |at: f64, direction: Direction| {
            let load = driver.load(at).map_or(0.0, |(load, _)| load);
            direction.sign() * load - self.law.limit(direction, rest + (at - t))
        };
        let first = Direction::BOTH
            .into_iter()
            .filter(|&direction| excess(to_s, direction) > 0.0)
            .map(|direction| (root(t, to_s, |at| -excess(at, direction)), direction))
            .min_by(|a, b| a.0.total_cmp(&b.0));
        let (at, direction) = first?;
        let peak = self.law.limit(direction, rest + (at - t));
        self.move_on(direction, peak, 0.0);
        Some(at)
    }

    /// One piece, cut short at the first event; returns its end.
    fn piece(&mut self, driver: &mut impl Driver, t: f64, to_s: f64) -> f64 {
        let (w, z, mode, law) = (f64::from(self.w), f64::from(self.z), self.mode, self.law);
        let [per_meter, per_speed] = driver.sizes();
        let sizes = [per_meter, per_speed, law.size_of_state(w)];
        let rate = |since: f64, moved: &[f64; 3]| {
            let velocity = w + moved[1];
            let (friction, own) = law.friction(velocity, z + moved[2], mode);
            [
                velocity,
                driver.acceleration(t + since, moved[0], velocity, friction),
                own,
            ]
        };
        let left = to_s - t;
        let mut length = self.try_s.min(left).min(self.fall_length(w, rate(0.0, &[0.0; 3])[1]));
        let (piece, added) = loop {
            if let Some(piece) = self.rule.piece(length, &sizes, rate) {
                let added = self.rule.highest_orders(&piece, &sizes);
                if added <= self.tolerance_n {
                    break (piece, added);
                }
            }
            length *= 0.5;
        };
        let longer = (0.5 * self.tolerance_n / added.max(1e-30))
            .powf(1.0 / 7.0)
            .clamp(0.5, 2.5);
        if length < left || longer < 1.0 {
            self.try_s = length * longer;
        } else {
            self.try_s = self.try_s.max(length);
        }
        let margin = |index: usize, moved: &[f64; 3]| law.margin(index, w + moved[1], z + moved[2], mode);
        let mut event: Option<(f64, usize)> = None;
        for index in 0..3 {
            if margin(index, &[0.0; 3]).is_none() {
                continue;
            }
            let value = |moved: &[f64; 3]| margin(index, moved).unwrap_or(0.0);
            let Some((from, to)) = self.rule.first_fall(&piece, |_, moved| value(moved)) else {
                continue;
            };
            // The end of a shorter piece is truer than the inside of a longer one.
            let after = |since: f64| {
                let shorter = self.rule.piece(since, &sizes, rate).map(|piece| piece.end);
                value(&shorter.unwrap_or_else(|| self.rule.inside(&piece, since)))
            };
            let at = root(from, to, after);
            if event.is_none_or(|(earliest, _)| at < earliest) {
                event = Some((at, index));
            }
        }
        let Some((at, index)) = event else {
            self.accept(driver, t + length, &piece);
            return if length < left { t + length } else { to_s };
        };
        let piece = self.rule.piece(at, &sizes, rate).unwrap_or(piece);
        self.accept(driver, t + at, &piece);
        self.end_mode(driver, t + at, index);
        t + at
    }

    fn accept(&mut self, driver: &mut impl Driver, t: f64, piece: &Piece<3>) {
        driver.advance(t, piece.end[0]);
        self.w += exact(piece.end[1]);
        self.z += exact(piece.end[2]);
    }

    /// The time in which the velocity may change by a good part of that over which friction falls:
    /// a longer piece could step across the fall.
    fn fall_length(&self, w: f64, acceleration: f64) -> f64 {
        let Some(width) = self.law.falls_over() else {
            return f64::INFINITY;
        };
        FALL * w.abs().max(width) / acceleration.abs()
    }

    /// Goes over to the mode that follows at an event, by the index of the margin that came to
    /// zero.
    fn end_mode(&mut self, driver: &impl Driver, t: f64, index: usize) {
        let Mode::Moving {
            direction,
            regime,
            peak,
        } = self.mode
        else {
            let held = self.law.spring(f64::from(self.z));
            let towards = Direction::of(held);
            return self.move_on(towards, self.law.limit(towards, 0.0), held);
        };
        if index > 0 {
            let next = match (self.law.0, regime, index) {
                (Friction::Dahl(_), ..) => {
                    self.z = exact(0.0);
                    Regime::Flowing
                }
                (_, Regime::Slow, _) => Regime::Armed,
                (_, Regime::Yielding, 2) => Regime::Elastic,
                (_, Regime::Yielding, _) => Regime::Flowing,
                _ => Regime::Yielding,
            };
            self.mode = Mode::Moving {
                direction,
                regime: next,
                peak,
            };
            return;
        }
        let armed = regime == Regime::Armed;
        let level = if armed { self.law.threshold() } else { 0.0 };
        self.w = exact(direction.sign() * level);
        match self.law.0 {
            Friction::Karnopp(law) if driver.load(t).is_some() => {
                let (load, _) = driver.load(t).unwrap_or_default();
                let rest_s = rest_of(law, direction, peak);
                if load.abs() <= self.law.limit(Direction::of(load), rest_s) {
                    (self.w, self.z, self.mode) = (exact(0.0), exact(rest_s), Mode::Rigid);
                } else if level > 0.0 {
                    let regime = Regime::Slow;
                    self.mode = Mode::Moving {
                        direction,
                        regime,
                        peak,
                    };
                } else {
                    let towards = Direction::of(load);
                    self.move_on(towards, self.law.limit(towards, rest_s), 0.0);
                }
            }
            Friction::Karnopp(_) | Friction::ResetIntegrator(_) | Friction::SalcudeanVlaar(_) => {
                let (friction, _) = self.law.friction(f64::from(self.w), f64::from(self.z), self.mode);
                let limit = self.law.limit(Direction::of(friction), 0.0);
                self.z = exact(self.law.deflection(friction.clamp(-limit, limit)));
                self.mode = Mode::Spring;
            }
            _ => {
                let force = self.force_at_rest();
                let towards = match driver.load(t) {
                    Some((load, slope)) if load == force => Direction::of(slope),
                    Some((load, _)) => Direction::of(load - force),
                    None => Direction::of(-direction.sign()),
                };
                self.move_on(towards, 0.0, force);
            }
        }
    }
}

/// The rest that a contact has behind it, so to speak, which comes to rest with the friction that
/// its slide began with.
fn rest_of(law: &Karnopp, direction: Direction, peak: f64) -> f64 {
    let (held, sliding) = (law.static_force.get(direction), law.dynamic_force.get(direction));
    if law.stribeck_velocity == 0.0 || law.rising_rate == 0.0 || peak <= sliding {
        return 0.0;
    }
    let share = ((peak - sliding) / (held - sliding)).min(1.0);
    -(1.0 - share).ln() / law.rising_rate
}
