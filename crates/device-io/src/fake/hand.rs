//! The hand on the fake rig, and its motion: a sinusoid, or a recording.

use super::pointer::PointerArm;
use std::f64::consts::TAU;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;

/// The hand on the carriage.
#[derive(Clone, Debug)]
pub enum Hand {
    /// Nobody: the carriage is free.
    Free,
    /// A hand so strong that the carriage follows it whatever the force.
    Prescribed(HandMotion),
    /// A hand that pushes with `offset + amplitude sin(2 pi frequency t)` newtons, wherever the
    /// carriage goes.
    Push {
        /// Steady part, N.
        offset_n: f64,
        /// Alternating part, N.
        amplitude_n: f64,
        /// Turns a second, Hz.
        frequency_hz: f64,
    },
    /// A hand that pulls through an arm, and can be held back.
    Arm {
        /// Stiffness of the arm, N/m.
        stiffness_n_per_m: f64,
        /// Damping of the arm, N s/m.
        damping_ns_per_m: f64,
        /// Intended motion of the hand.
        motion: HandMotion,
    },
    /// A hand that pulls through an arm to where a person points, and lets go without news of that.
    Pointer(PointerArm),
}

/// Stiffness of the usual arm, N/m.
pub(super) const ARM_STIFFNESS_N_PER_M: f64 = 500.0;

/// Its damping, N s/m.
pub(super) const ARM_DAMPING_NS_PER_M: f64 = 5.0;

impl Hand {
    /// A hand that pulls through the usual arm.
    #[must_use]
    pub fn arm(motion: HandMotion) -> Self {
        Self::Arm {
            stiffness_n_per_m: ARM_STIFFNESS_N_PER_M,
            damping_ns_per_m: ARM_DAMPING_NS_PER_M,
            motion,
        }
    }
}

impl fmt::Display for Hand {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Free => f.write_str("none"),
            Self::Push {
                offset_n,
                amplitude_n,
                frequency_hz,
            } => write!(f, "a push of {offset_n} N and {amplitude_n} N at {frequency_hz} Hz"),
            Self::Prescribed(motion) => write!(f, "{motion}"),
            Self::Arm {
                stiffness_n_per_m,
                damping_ns_per_m,
                motion,
            } => write!(
                f,
                "{motion}, through an arm of {stiffness_n_per_m} N/m and {damping_ns_per_m} N s/m"
            ),
            Self::Pointer(_) => write!(
                f,
                "a pointer, through an arm of {ARM_STIFFNESS_N_PER_M} N/m and {ARM_DAMPING_NS_PER_M} N s/m"
            ),
        }
    }
}

/// A motion: position and velocity for every time.
#[derive(Clone, Debug)]
pub enum HandMotion {
    /// `-amplitude cos(2 pi frequency t)`: it begins at rest, at one end.
    Sine {
        /// Half the stroke, m.
        amplitude_m: f64,
        /// Turns a second, Hz.
        frequency_hz: f64,
    },
    /// A motion from a file.
    Recorded(Arc<Recording>),
}

impl HandMotion {
    /// Position (m) and velocity (m/s) at `t_s` >= 0.
    #[must_use]
    pub fn at(&self, t_s: f64) -> (f64, f64) {
        match self {
            Self::Sine {
                amplitude_m,
                frequency_hz,
            } => {
                let omega = TAU * frequency_hz;
                // Of `libm`, the same on every machine.
                let (sin, cos) = libm::sincos(omega * t_s);
                (-amplitude_m * cos, amplitude_m * omega * sin)
            }
            Self::Recorded(recording) => recording.at(t_s),
        }
    }
}

impl fmt::Display for HandMotion {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Sine {
                amplitude_m,
                frequency_hz,
            } => write!(f, "sine of {} mm at {frequency_hz} Hz", amplitude_m * 1e3),
            Self::Recorded(recording) => write!(
                f,
                "{} ({} samples, {:.3} s, looped)",
                recording.path.display(),
                recording.samples.len(),
                recording.duration(),
            ),
        }
    }
}

/// Duration of the return in a loop, s.
const RETURN_S: f64 = 1.0;

/// A recorded motion. Between samples it is a cubic through both, with slopes from their
/// neighbours, so that its velocity has no steps. After the last it goes back to the first within
/// a second, smoothly, and starts again.
#[derive(Clone, Debug)]
pub struct Recording {
    path: PathBuf,
    samples: Vec<Sample>,
}

#[derive(Clone, Copy, Debug)]
struct Sample {
    t_s: f64,
    position_m: f64,
    velocity_mps: f64,
}

impl Recording {
    /// Takes samples of time (s), which grows, and position (m) from a file at `path`; times are counted from the first.
    ///
    /// # Errors
    /// There are too few.
    pub fn new(path: impl Into<PathBuf>, samples: impl Iterator<Item = (f64, f64)>) -> Result<Self, String> {
        let path = path.into();
        let mut samples: Vec<Sample> = samples
            .map(|(t_s, position_m)| Sample {
                t_s,
                position_m,
                velocity_mps: 0.0,
            })
            .collect();
        if samples.len() < 2 {
            let (path, count) = (path.display(), samples.len());
            return Err(format!(
                "{path}: a motion needs at least 2 samples, this one has {count}"
            ));
        }
        let begin_s = samples[0].t_s;
        for sample in &mut samples {
            sample.t_s -= begin_s;
        }
        set_slopes(&mut samples);
        Ok(Self { path, samples })
    }

    /// Time of the last sample, s after the first.
    #[must_use]
    pub fn duration(&self) -> f64 {
        self.samples.last().map_or(0.0, |sample| sample.t_s)
    }

    fn at(&self, t_s: f64) -> (f64, f64) {
        let (first, last) = (self.samples[0], self.samples[self.samples.len() - 1]);
        let mut t = t_s.max(0.0);
        if t >= last.t_s {
            t %= last.t_s + RETURN_S;
            if t >= last.t_s {
                let back = Sample {
                    t_s: last.t_s + RETURN_S,
                    ..first
                };
                return between(last, back, t);
            }
        }
        let after = self.samples.partition_point(|sample| sample.t_s <= t).max(1);
        between(self.samples[after - 1], self.samples[after], t)
    }
}

/// Sets the velocities: the slope of the parabola through a sample and its neighbours; the ends are
/// at rest.
fn set_slopes(samples: &mut [Sample]) {
    for index in 1..samples.len() - 1 {
        let [a, b, c] = [samples[index - 1], samples[index], samples[index + 1]];
        let (before, after) = (b.t_s - a.t_s, c.t_s - b.t_s);
        let (rise, next) = (
            (b.position_m - a.position_m) / before,
            (c.position_m - b.position_m) / after,
        );
        // No steeper than thrice either side, and level at a turn: then the cubics do not
        // overshoot (Fritsch and Carlson 1980).
        let steepest = if rise * next > 0.0 {
            3.0 * rise.abs().min(next.abs())
        } else {
            0.0
        };
        let slope = (rise * after + next * before) / (before + after);
        samples[index].velocity_mps = slope.clamp(-steepest, steepest);
    }
}

/// The cubic through two samples with their slopes (Hermite).
fn between(a: Sample, b: Sample, t_s: f64) -> (f64, f64) {
    let width = b.t_s - a.t_s;
    let u = (t_s - a.t_s) / width;
    let rise = b.position_m - a.position_m;
    let (left, right) = (a.velocity_mps * width - rise, rise - b.velocity_mps * width);
    let position = a.position_m + u * rise + u * (1.0 - u) * (left * (1.0 - u) + right * u);
    let slope = rise + (1.0 - 2.0 * u) * (left * (1.0 - u) + right * u) + u * (1.0 - u) * (right - left);
    (position, slope / width)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn recording(samples: &[(f64, f64)]) -> Recording {
        Recording::new("m.csv", samples.iter().copied()).expect("a motion")
    }

    #[test]
    fn a_recording_is_followed_and_repeats() {
        let recording = recording(&[(10.0, 0.0), (10.1, 0.1), (10.3, 0.3), (10.4, 0.4)]);
        for (t, want) in [
            (0.0, 0.0),
            (0.1, 0.1),
            (0.2, 0.2),
            (0.3, 0.3),
            (0.4, 0.4),
            (1.4, 0.0),
            (1.6, 0.2),
        ] {
            let (position, _) = recording.at(t);
            assert!((position - want).abs() < 1e-12, "{t}: {position} for {want}");
        }
        // In the middle of a straight line the slope is the line's.
        assert!((recording.at(0.2).1 - 1.0).abs() < 1e-9);
    }

    #[test]
    fn position_and_velocity_agree_and_a_loop_has_no_jump() {
        let recording = recording(&[(0.0, 0.0), (0.2, 0.02), (0.5, 0.01), (1.0, 0.05)]);
        let h = 1e-5;
        let mut t = h;
        while t < 5.0 {
            let ((before, _), (here, velocity), (after, _)) =
                (recording.at(t - h), recording.at(t), recording.at(t + h));
            assert!((after - before).abs() < 1e-4, "a jump at {t} s");
            assert!(
                ((after - before) / (2.0 * h) - velocity).abs() < 1e-3,
                "at {t} s: {velocity}"
            );
            assert!(here.is_finite());
            t += 0.0137;
        }
    }

    #[test]
    fn uneven_samples_are_not_overshot() {
        let recording = recording(&[(0.0, 0.0), (1.0, 0.0), (1.001, 0.05), (3.0, 0.05)]);
        for k in 0..3000 {
            let (position, _) = recording.at(f64::from(k) * 1e-3);
            assert!((0.0..=0.05 + 1e-12).contains(&position), "{position} m at {k} ms");
        }
    }
}
