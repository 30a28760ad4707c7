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

    /// Friction at each sample without its viscous part, N, positive against positive motion.
    pub(crate) fn friction(self, values: &[f64], path: &Path) -> Vec<f64> {
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

/// Index of the limit for a motion.
fn side(distance: f64) -> usize {
    usize::from(distance < 0.0)
}

fn coulomb(values: &[f64], path: &Path) -> Vec<f64> {
    let speeds = path.speed_mps.iter();
    speeds
        .map(|&speed| {
            if speed == 0.0 {
                0.0
            } else {
                values[side(speed)].copysign(speed)
            }
        })
        .collect()
}

/// With `r = 1 - s F/Fc` and `a = sigma |dx|/Fc`: `r e^-a` for `i = 1`, else `r (1 + (i - 1) a r^(i-1))^(1/(1-i))`.
fn dahl(values: &[f64], path: &Path) -> Vec<f64> {
    let (stiffness, exponent) = (values[PathLaw::STIFFNESS], values[PathLaw::EXPONENT]);
    let limits = [values[PathLaw::DYNAMIC], values[PathLaw::DYNAMIC + 1]];
    let mut force = values[PathLaw::START].clamp(-limits[1], limits[0]);
    let mut before = path.smooth_m.first().copied().unwrap_or(0.0);
    let mut step = |position: f64| {
        let distance = position - before;
        before = position;
        let limit = limits[side(distance)];
        let rest = (1.0 - distance.signum() * force / limit).max(0.0);
        if distance != 0.0 {
            let left = if rest < SETTLED {
                0.0
            } else {
                let a = stiffness * distance.abs() / limit;
                let power = exponent - 1.0;
                if power.abs() < 1e-6 {
                    rest * (-a).exp()
                } else {
                    let grown = power * a * rest.powf(power);
                    if grown > -1.0 {
                        rest * (-grown.ln_1p() / power).exp()
                    } else {
                        0.0
                    }
                }
            };
            force = distance.signum() * limit * (1.0 - left);
        }
        force
    };
    let ways = path.via_m.iter().zip(&path.smooth_m);
    ways.map(|(&turn, &position)| {
        step(turn);
        step(position)
    })
    .collect()
}

/// At the speed of the sample: `z+ = zss + (z - zss) e^(-|dx| sigma0/g)`, with `zss = s g/sigma0`; the friction is
/// `sigma0 z + sigma1 z'`, with `z' = v (1 - s sigma0 z/g)`.
fn lugre(values: &[f64], path: &Path) -> Vec<f64> {
    let (stiffness, damping) = (values[PathLaw::STIFFNESS], values[PathLaw::DAMPING]);
    let mut force = values[PathLaw::START];
    let mut before = path.smooth_m.first().copied().unwrap_or(0.0);
    let mut step = |position: f64, speed: f64| {
        let distance = position - before;
        before = position;
        if distance == 0.0 {
            return force;
        }
        let side = side(distance);
        let dynamic = values[PathLaw::DYNAMIC + side];
        let fall = (speed / values[PathLaw::STRIBECK]).powi(2);
        let level = dynamic * (1.0 + (values[PathLaw::STATIC_RATIO + side] - 1.0) * (-fall).exp());
        let steady = level.copysign(distance);
        force = steady + (force - steady) * (-distance.abs() * stiffness / level).exp();
        force + damping * speed * (1.0 - force / steady)
    };
    let ways = path.via_m.iter().zip(&path.smooth_m).zip(&path.speed_mps);
    ways.map(|((&turn, &position), &speed)| {
        step(turn, speed);
        step(position, speed)
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::super::super::Record;
    use super::*;
    use haptic_core::friction::{Dahl, Friction, Lugre};
    use haptic_core::{Directional, Renderer, Scene, Scheme};

    /// To and fro with turns within presliding and beyond.
    fn path() -> Path {
        let t_s: Vec<f64> = (0..4000).map(|k| f64::from(k) * 1e-3).collect();
        Path::new(&Record {
            position_m: t_s.iter().map(|t| 1e-3 * (t * 9.0).sin() * (t * 0.7).sin()).collect(),
            force_n: vec![0.0; t_s.len()],
            t_s,
            ..Record::default()
        })
        .expect("long enough")
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
    fn dahl_is_the_law_of_the_core() {
        let path = path();
        for exponent in [0.5, 1.0, 1.7] {
            let law = Dahl {
                dynamic_force: Directional {
                    positive: 4.0,
                    negative: 3.0,
                },
                contact_stiffness: 4e4,
                exponent,
                viscous: Directional::both(0.0),
            };
            let ours = PathLaw::Dahl.friction(&[4.0, 3.0, 0.0, 4e4, exponent], &path);
            let theirs = rendered(Friction::Dahl(law), &path);
            for k in 100..ours.len() {
                assert!(
                    (ours[k] - theirs[k]).abs() < 0.02,
                    "{exponent}: {} {} at {k}",
                    ours[k],
                    theirs[k]
                );
            }
        }
    }

    #[test]
    fn lugre_is_the_law_of_the_core() {
        let path = path();
        let law = Lugre {
            static_force: Directional {
                positive: 5.0,
                negative: 4.5,
            },
            dynamic_force: Directional {
                positive: 4.0,
                negative: 3.0,
            },
            stribeck_velocity: 2e-3,
            contact_stiffness: 4e4,
            contact_damping: 30.0,
            viscous: Directional::both(0.0),
        };
        let ours = PathLaw::Lugre.friction(&[4.0, 3.0, 0.0, 4e4, 1.25, 1.5, 2e-3, 30.0], &path);
        let theirs = rendered(Friction::Lugre(law), &path);
        for k in 100..ours.len() {
            assert!((ours[k] - theirs[k]).abs() < 0.06, "{} {} at {k}", ours[k], theirs[k]);
        }
    }
}
