//! The courses along which a rig is moved, within what the rig allows.

use haptic_core::{Course, Excitation};
use haptic_ipc::IdentificationReply;

/// Default of the largest force: this share of the largest that is allowed, or this many times the
/// friction that the commissioning has found.
const DEFAULT_SHARE: f64 = 0.4;
const TIMES_FRICTION: f64 = 4.0;

/// Default of the travel to either side: this share of what is allowed, and at most this, m.
const SHARE_OF_TRAVEL: f64 = 0.8;
const MAX_TRAVEL_M: f64 = 0.02;

/// Frequencies of the chirp, Hz, and its amplitude, m.
const CHIRP_HZ: (f64, f64) = (0.5, 3.0);
const CHIRP_M: f64 = 0.005;

/// Speed of the ramps under which the force builds up until the handle breaks away, m/s, and their
/// travel, m.
const RAMP_MPS: f64 = 1e-3;
const RAMP_M: f64 = 3e-3;

/// Frequency of the strokes before sliding, Hz, their number, and their force as a share of the one
/// that broke the handle away.
const STROKE_HZ: f64 = 1.0;
const STROKES: f64 = 6.0;
const STROKE_SHARE: f64 = 0.8;

/// Speed of the sweep for cogging, m/s: at it the mass takes little of the force.
const SWEEP_MPS: f64 = 0.01;

/// Distance between reference and handle at which the spring gives the largest force, m.
const FULL_FORCE_M: f64 = 4e-3;

/// Range of the spring's stiffness, N/m.
const STIFFNESS_N_PER_M: (f64, f64) = (200.0, 5000.0);

/// Time constant of damper and spring, s.
const DAMPING_S: f64 = 0.02;

/// Largest damping, N s/m: with it a handle of 0.1 kg does not oscillate at 1 kHz.
const MAX_DAMPING_NS_PER_M: f64 = 30.0;

/// Time in which the force may grow to its largest, s.
const FULL_FORCE_S: f64 = 0.02;

/// Distance from the reference at which the handle counts as held, as a multiple of
/// [`FULL_FORCE_M`].
const HELD: f64 = 2.0;

/// Speed limit above twice the speed of the course, m/s: a handle that breaks away is quick.
const SPARE_MPS: f64 = 0.1;

/// How far the handle may go beyond its course, m.
const SPARE_M: f64 = 0.005;

/// How far a handle may move against the force, in counts, and m.
const WRONG_WAY: (f64, f64) = (5.0, 1e-4);

/// What a rig is moved with.
#[derive(Clone, Copy, Debug)]
pub struct Bounds {
    /// Largest force, N.
    pub force_n: f64,
    /// Travel to either side, m.
    pub travel_m: f64,
    /// Farthest that the daemon allows, m.
    most_m: f64,
    resolution_m: f64,
}

impl Bounds {
    /// The bounds that were asked for, or else the default ones.
    #[must_use]
    pub fn new(rig: &IdentificationReply, force_n: Option<f64>, travel_m: Option<f64>) -> Self {
        let default_n = rig
            .friction_n
            .map_or(0.0, |friction_n| TIMES_FRICTION * friction_n)
            .max(DEFAULT_SHARE * rig.force_limit_n);
        let default_m = (SHARE_OF_TRAVEL * rig.travel_limit_m).min(MAX_TRAVEL_M);
        Self {
            force_n: force_n.unwrap_or(default_n.min(rig.force_limit_n)),
            travel_m: travel_m.unwrap_or(default_m),
            most_m: rig.travel_limit_m,
            resolution_m: rig.resolution_m,
        }
    }

    fn excitation(&self, course: Course) -> Excitation {
        let (least, most) = STIFFNESS_N_PER_M;
        let stiffness_n_per_m = (self.force_n / FULL_FORCE_M).clamp(least, most);
        let (counts, least_m) = WRONG_WAY;
        let travel_limit_m = (course.farthest_m() + SPARE_M).min(self.most_m);
        Excitation {
            course,
            force_limit_n: self.force_n,
            slew_limit_n_per_s: (self.force_n / FULL_FORCE_S).clamp(10.0, 2000.0),
            stiffness_n_per_m,
            damping_ns_per_m: (DAMPING_S * stiffness_n_per_m).min(MAX_DAMPING_NS_PER_M),
            travel_limit_m,
            speed_limit_mps: (2.0 * course.fastest_mps() + SPARE_MPS).min(0.5),
            lag_limit_m: HELD * (self.force_n / stiffness_n_per_m).max(FULL_FORCE_M),
            wrong_way_limit_m: (counts * self.resolution_m).max(least_m).min(travel_limit_m),
        }
    }

    /// From slow to quick, for the mass and the viscous term; `share` of its usual amplitude.
    #[must_use]
    pub fn chirp(&self, duration_s: f64, share: f64) -> Excitation {
        let (from_hz, to_hz) = CHIRP_HZ;
        self.excitation(Course::Chirp {
            amplitude_m: share * CHIRP_M.min(self.travel_m),
            from_hz,
            to_hz,
            duration_s,
        })
    }

    /// So slow that the handle breaks away again and again, for the static limits.
    #[must_use]
    pub fn ramps(&self, rounds: u32) -> Excitation {
        self.excitation(Course::Sweep {
            travel_m: RAMP_M.min(self.travel_m),
            speed_mps: RAMP_MPS,
            rounds,
        })
    }

    /// Below the force that broke the handle away, N, for what gives way before it slides.
    #[must_use]
    pub fn strokes(&self, breakaway_n: f64) -> Excitation {
        let stiffness = self.excitation(self.ramps(1).course).stiffness_n_per_m;
        let amplitude_m = (STROKE_SHARE * breakaway_n / stiffness).clamp(1e-5, self.travel_m);
        self.excitation(Course::Chirp {
            amplitude_m,
            from_hz: STROKE_HZ,
            to_hz: STROKE_HZ,
            duration_s: STROKES / STROKE_HZ,
        })
    }

    /// All the travel at one speed, for friction and cogging by the position.
    #[must_use]
    pub fn sweep(&self) -> Excitation {
        self.excitation(Course::Sweep {
            travel_m: self.travel_m,
            speed_mps: SWEEP_MPS,
            rounds: 1,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_ipc::Peer;

    #[test]
    fn whatever_the_rig_its_motions_are_within_what_it_allows() {
        for force_limit_n in [0.1, 1.0, 10.0, 200.0] {
            for range_m in [2e-3, 0.03, 0.1, 0.6] {
                for friction_n in [None, Some(0.01), Some(3.0)] {
                    let rig = rig(force_limit_n, range_m, friction_n);
                    let bounds = Bounds::new(&rig, None, None);
                    let motions = [
                        bounds.chirp(12.0, 1.0),
                        bounds.ramps(2),
                        bounds.strokes(bounds.force_n),
                        bounds.sweep(),
                    ];
                    for motion in motions {
                        assert_eq!(motion.check(), Ok(()), "{motion:?}");
                        assert!(motion.force_limit_n <= force_limit_n, "{motion:?}");
                        assert!(motion.travel_limit_m <= rig.travel_limit_m, "{motion:?}");
                    }
                }
            }
        }
    }

    fn rig(force_limit_n: f64, range_m: f64, friction_n: Option<f64>) -> IdentificationReply {
        IdentificationReply {
            by: Peer::default(),
            rig: "mine".to_owned(),
            firmware: "mine 1.0".to_owned(),
            moving: false,
            ended: None,
            force_limit_n,
            range_m,
            middle_m: 0.0,
            travel_limit_m: 0.5 * range_m,
            friction_n,
            friction: None,
            resolution_m: 1e-5,
            ramp_ms: 20.0,
            position_m: 0.0,
            excitations: 0,
            gone_s: None,
            last: None,
            path: None,
        }
    }
}
