//! The friction that a law predicts along a path. The deflection moves with the position and not with time, so each
//! step of the path is taken in closed form, whatever its length.

use super::path::Path;

/// Below this share of the limit there is nothing left to fall.
const SETTLED: f64 = 1e-9;

/// A law whose friction follows from the path.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PathLaw {
    /// Rigid until it slides: [`DYNAMIC`](Self::DYNAMIC) alone.
    Coulomb,
    /// Dahl 1968, as in `haptic_core::friction::Dahl`.
    Dahl,
    /// Canudas de Wit et al. 1995, as in `haptic_core::friction::Lugre`.
    Lugre,
}

impl PathLaw {
    /// Place of the dynamic force for positive motion, N; that for negative motion is the next.
    pub(crate) const DYNAMIC: usize = 0;
    /// Place of the friction at the beginning, N.
    pub(crate) const START: usize = 2;
    /// Place of the stiffness at zero deflection, N/m.
    pub(crate) const STIFFNESS: usize = 3;
    /// Place of Dahl's exponent.
    pub(crate) const EXPONENT: usize = 4;
    /// Place of LuGre's static force for positive motion over the dynamic one; that for negative motion is the next.
    pub(crate) const STATIC_RATIO: usize = 4;
    /// Place of the Stribeck velocity, m/s.
    pub(crate) const STRIBECK: usize = 6;
    /// Place of the bristle's damping, N s/m.
    pub(crate) const DAMPING: usize = 7;

    /// Whether a value is that of positive motion, followed by that of negative motion.
    pub(crate) fn is_by_direction(self, at: usize) -> bool {
        at == Self::DYNAMIC || (self == Self::Lugre && at == Self::STATIC_RATIO)
    }

    /// Friction at each sample without its viscous part, and its derivatives.
    pub(crate) fn along(self, values: &[f64], path: &Path) -> Course {
        match self {
            Self::Coulomb => coulomb(values, path),
            Self::Dahl => dahl(values, path),
            Self::Lugre => lugre(values, path),
        }
    }

    /// How much the friction changes with the position, N/m, where it is `friction_n`.
    pub(crate) fn tangent(self, values: &[f64], path: &Path, friction_n: &[f64]) -> Vec<f64> {
        let exponent = match self {
            Self::Coulomb => return vec![0.0; friction_n.len()],
            Self::Dahl => values[Self::EXPONENT],
            Self::Lugre => 1.0,
        };
        let samples = friction_n.iter().zip(&path.speed_mps);
        samples
            .map(|(friction, &speed)| {
                let limit = values[Self::DYNAMIC + side(speed)];
                let rest = (1.0 - friction.copysign(friction * speed) / limit).max(0.0);
                values[Self::STIFFNESS] * rest.powf(exponent)
            })
            .collect()
    }
}

/// Friction along a path.
#[derive(Clone, Debug, Default)]
pub(crate) struct Course {
    /// At each sample, N, positive against positive motion.
    pub(crate) friction_n: Vec<f64>,
    /// Its derivative by each of the law's values.
    pub(crate) by_value: Vec<Vec<f64>>,
}

impl Course {
    fn new<const N: usize>(samples: impl Iterator<Item = (f64, [f64; N])>) -> Self {
        let mut course = Self {
            friction_n: Vec::with_capacity(samples.size_hint().0),
            by_value: vec![Vec::with_capacity(samples.size_hint().0); N],
        };
        for (friction, by_value) in samples {
            course.friction_n.push(friction);
            for (column, derivative) in course.by_value.iter_mut().zip(by_value) {
                column.push(derivative);
            }
        }
        course
    }
}

/// Index of the limit for a motion.
fn side(distance: f64) -> usize {
    usize::from(distance < 0.0)
}

/// Sets a derivative by the friction at the beginning to zero once the motion has wiped it out: a fit would divide by
/// it.
fn forget(by_start: &mut f64) {
    if by_start.abs() < SETTLED {
        *by_start = 0.0;
    }
}

fn coulomb(values: &[f64], path: &Path) -> Course {
    Course::new(path.speed_mps.iter().map(|&speed| {
        let mut by_value = [0.0; 2];
        if speed == 0.0 {
            return (0.0, by_value);
        }
        by_value[side(speed)] = speed.signum();
        (values[side(speed)].copysign(speed), by_value)
    }))
}

/// What is left of Dahl's distance from the limit after some travel, both over the limit, and its derivatives.
struct Left {
    value: f64,
    by_rest: f64,
    by_travel: f64,
    by_exponent: f64,
}

impl Left {
    /// With the rest `r = 1 - s F/Fc` before and the travel `a = sigma |dx|/Fc`: `r e^-a` for `i = 1`, else
    /// `r (1 + (i - 1) a r^(i-1))^(1/(1-i))`.
    fn new(rest: f64, travel: f64, exponent: f64) -> Self {
        /// Nearer to 1 the exponent's series is more exact than the formula.
        const NEARLY_ONE: f64 = 1e-4;
        let power = exponent - 1.0;
        let slope = rest.powf(power);
        let scaled = travel * slope;
        let grown = 1.0 + power * scaled;
        if grown <= 0.0 {
            return Self {
                value: 0.0,
                by_rest: 0.0,
                by_travel: 0.0,
                by_exponent: 0.0,
            };
        }
        let (logarithm, by_power) = if power.abs() < NEARLY_ONE {
            let logarithm = scaled * (1.0 - 0.5 * power * scaled);
            (logarithm, scaled * (0.5 * scaled - rest.ln()))
        } else {
            let logarithm = (power * scaled).ln_1p() / power;
            let growth = scaled * (1.0 + power * rest.ln()) / grown;
            (logarithm, (logarithm - growth) / power)
        };
        let share = (-logarithm).exp();
        Self {
            value: rest * share,
            by_rest: share / grown,
            by_travel: -rest * share * slope / grown,
            by_exponent: rest * share * by_power,
        }
    }
}

fn dahl(values: &[f64], path: &Path) -> Course {
    let (stiffness, exponent) = (values[PathLaw::STIFFNESS], values[PathLaw::EXPONENT]);
    let limits = [values[PathLaw::DYNAMIC], values[PathLaw::DYNAMIC + 1]];
    let mut force = values[PathLaw::START].clamp(-limits[1], limits[0]);
    let mut by_value = [0.0; 5];
    by_value[PathLaw::START] = 1.0;
    let mut before = path.smooth_m.first().copied().unwrap_or(0.0);
    let mut step = |position: f64| {
        let distance = position - before;
        before = position;
        if distance == 0.0 {
            return (force, by_value);
        }
        let (sign, side) = (distance.signum(), side(distance));
        let limit = limits[side];
        let rest = (1.0 - sign * force / limit).max(0.0);
        if rest < SETTLED {
            force = sign * limit;
            by_value = [0.0; 5];
            by_value[side] = sign;
            return (force, by_value);
        }
        let travel = stiffness * distance.abs() / limit;
        let left = Left::new(rest, travel, exponent);
        by_value = by_value.map(|derivative| left.by_rest * derivative);
        forget(&mut by_value[PathLaw::START]);
        by_value[side] += sign * (1.0 - left.value - left.by_rest * (1.0 - rest) + left.by_travel * travel);
        by_value[PathLaw::STIFFNESS] -= sign * limit * left.by_travel * travel / stiffness;
        by_value[PathLaw::EXPONENT] -= sign * limit * left.by_exponent;
        force = sign * limit * (1.0 - left.value);
        (force, by_value)
    };
    Course::new(path.via_m.iter().zip(&path.smooth_m).map(|(&turn, &position)| {
        step(turn);
        step(position)
    }))
}

/// At the speed of the sample: `z+ = zss + (z - zss) e^(-|dx| sigma0/g)`, with `zss = s g/sigma0`; the friction is
/// `sigma0 z + sigma1 z'`, with `z' = v (1 - s sigma0 z/g)`.
fn lugre(values: &[f64], path: &Path) -> Course {
    let (stiffness, damping) = (values[PathLaw::STIFFNESS], values[PathLaw::DAMPING]);
    let mut force = values[PathLaw::START];
    let mut by_force = [0.0; 8];
    by_force[PathLaw::START] = 1.0;
    let (mut friction, mut by_value) = (force, by_force);
    let mut before = path.smooth_m.first().copied().unwrap_or(0.0);
    let mut step = |position: f64, speed: f64| {
        let distance = position - before;
        before = position;
        if distance == 0.0 {
            return (friction, by_value);
        }
        let (sign, side) = (distance.signum(), side(distance));
        let (dynamic, ratio) = (values[PathLaw::DYNAMIC + side], values[PathLaw::STATIC_RATIO + side]);
        let fall = (speed / values[PathLaw::STRIBECK]).powi(2);
        let share = (-fall).exp();
        let height = 1.0 + (ratio - 1.0) * share;
        let level = dynamic * height;
        let mut by_level = [0.0; 8];
        by_level[PathLaw::DYNAMIC + side] = height;
        by_level[PathLaw::STATIC_RATIO + side] = dynamic * share;
        by_level[PathLaw::STRIBECK] = 2.0 * dynamic * (ratio - 1.0) * share * fall / values[PathLaw::STRIBECK];
        let (steady, travel) = (sign * level, distance.abs() * stiffness / level);
        let kept = (-travel).exp();
        let apart = force - steady;
        force = steady + apart * kept;
        let slip = 1.0 - force / steady;
        for k in 0..by_force.len() {
            by_force[k] = kept * by_force[k] + (sign * (1.0 - kept) + apart * kept * travel / level) * by_level[k];
            if k == PathLaw::STIFFNESS {
                by_force[k] -= apart * kept * travel / stiffness;
            }
            by_value[k] = by_force[k] - damping * speed * (by_force[k] - force * by_level[k] / level) / steady;
        }
        forget(&mut by_force[PathLaw::START]);
        forget(&mut by_value[PathLaw::START]);
        friction = force + damping * speed * slip;
        by_value[PathLaw::DAMPING] += speed * slip;
        (friction, by_value)
    };
    let samples = path.via_m.iter().zip(&path.smooth_m).zip(&path.speed_mps);
    Course::new(samples.map(|((&turn, &position), &speed)| {
        step(turn, speed);
        step(position, speed)
    }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::identify::grid::Even;
    use crate::identify::options::Record;
    use haptic_core::friction::{Dahl, Friction, Lugre};
    use haptic_core::{Directional, Renderer, Scene, Scheme};

    /// To and fro with turns within presliding and beyond.
    fn path() -> Path {
        let t_s: Vec<f64> = (0..4000).map(|k| f64::from(k) * 1e-3).collect();
        let record = Record {
            position_m: t_s.iter().map(|t| 1e-3 * (t * 9.0).sin() * (t * 0.7).sin()).collect(),
            force_n: vec![0.0; t_s.len()],
            t_s,
            ..Record::default()
        };
        Path::new(&Even::new(&record), 0.0).expect("long enough")
    }

    /// The friction that the renderer gives on the device, N.
    fn rendered(friction: Friction, path: &Path) -> Vec<f64> {
        let scene = Scene {
            name: String::new(),
            block: None,
            coupling: None,
            friction,
        };
        let mut renderer = Renderer::new(&scene, Scheme::Exact, path.period_s).expect("sound");
        renderer.start_at(path.smooth_m[0], path.speed_mps[0]);
        let samples = path.smooth_m.iter().zip(&path.speed_mps);
        samples
            .map(|(&position, &speed)| renderer.tick(path.period_s, position, speed).coupling_force)
            .collect()
    }

    #[test]
    fn dahl_and_lugre_are_the_laws_of_the_core() {
        let path = path();
        let dynamic_force = Directional::new(4.0, 3.0);
        let dahl = |exponent| Dahl {
            dynamic_force,
            contact_stiffness: 4e4,
            exponent,
            viscous: Directional::both(0.0),
        };
        let lugre = Lugre {
            static_force: Directional::new(5.0, 4.5),
            dynamic_force,
            stribeck_velocity: 2e-3,
            contact_stiffness: 4e4,
            contact_damping: 30.0,
            viscous: Directional::both(0.0),
        };
        let values = [4.0, 3.0, 0.0, 4e4, 1.25, 1.5, 2e-3, 30.0];
        let mut laws = vec![(PathLaw::Lugre, values.to_vec(), Friction::Lugre(lugre), 0.06)];
        laws.extend([0.5, 1.0, 1.7].map(|exponent| {
            let values = vec![4.0, 3.0, 0.0, 4e4, exponent];
            (PathLaw::Dahl, values, Friction::Dahl(dahl(exponent)), 0.02)
        }));
        for (law, values, friction, within) in laws {
            let (ours, theirs) = (law.along(&values, &path).friction_n, rendered(friction, &path));
            for k in 100..ours.len() {
                let (ours, theirs) = (ours[k], theirs[k]);
                assert!((ours - theirs).abs() < within, "{values:?}: {ours} {theirs} at {k}");
            }
        }
    }

    #[test]
    fn derivatives_are_those_of_differences() {
        let path = path();
        for (law, values) in [
            (PathLaw::Coulomb, vec![4.0, 3.0]),
            (PathLaw::Dahl, vec![4.0, 3.0, 0.5, 4e4, 0.6]),
            (PathLaw::Dahl, vec![4.0, 3.0, 0.5, 4e4, 1.0]),
            (PathLaw::Dahl, vec![4.0, 3.0, 0.5, 4e4, 1.6]),
            (PathLaw::Lugre, vec![4.0, 3.0, 0.5, 4e4, 1.25, 1.5, 2e-3, 30.0]),
        ] {
            let course = law.along(&values, &path);
            for (at, column) in course.by_value.iter().enumerate() {
                let width = 1e-5 * values[at];
                let moved = |by: f64| {
                    let mut values = values.clone();
                    values[at] += by;
                    law.along(&values, &path).friction_n
                };
                let (below, above) = (moved(-width), moved(width));
                let steepest = column.iter().fold(0.0_f64, |most, slope| most.max(slope.abs()));
                for k in 0..column.len() {
                    let slope = (above[k] - below[k]) / (2.0 * width);
                    assert!(
                        (slope - column[k]).abs() < 2e-4 * steepest,
                        "{law:?} {values:?}: by value {at} {} and not {slope} at {k}",
                        column[k]
                    );
                }
            }
        }
    }
}
