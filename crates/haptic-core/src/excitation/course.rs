//! The courses of an excitation: where its reference is, and how fast, at every time.

use crate::bound_error::BoundError;
use crate::math::{cos, floor, sin_cos};
use core::f64::consts::{PI, TAU};

/// Time in which a sine grows and fades, and in which a sweep gets its speed or turns it half round, s.
const EDGE_S: f64 = 0.1;

/// Range of the frequency of a chirp, Hz: above it a handle of some hundred grams no longer follows.
const FREQUENCY_HZ: (f64, f64) = (0.05, 10.0);

/// Slowest sweep, m/s: an encoder of 1 um then still counts ten times a second.
const SLOWEST_MPS: f64 = 1e-5;

/// Shortest travel of a reference, m.
const MIN_M: f64 = 1e-6;

/// Range of the duration of a course, s.
const DURATION_S: (f64, f64) = (0.1, 120.0);

/// Most rounds of a sweep.
const MAX_ROUNDS: u32 = 1000;

/// The course of the reference, from the handle's first place and back.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(
    feature = "serde",
    serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)
)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub enum Course {
    /// A sine whose frequency changes evenly; small strokes where both are equal.
    Chirp {
        /// Amplitude, m.
        amplitude_m: f64,
        /// Frequency at the beginning, Hz.
        from_hz: f64,
        /// Frequency at the end, Hz.
        to_hz: f64,
        /// Duration, s.
        duration_s: f64,
    },
    /// To one side, to the other, and back, at one speed with rounded turns.
    Sweep {
        /// Distance to either side, m.
        travel_m: f64,
        /// Speed, m/s.
        speed_mps: f64,
        /// How often it goes there and back.
        rounds: u32,
    },
}

impl Course {
    /// From the first moment to the last, s.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        match *self {
            Self::Chirp { duration_s, .. } => duration_s,
            Self::Sweep {
                travel_m,
                speed_mps,
                rounds,
            } => 4.0 * f64::from(rounds) * travel_m / speed_mps + edge_s(travel_m, speed_mps),
        }
    }

    /// Farthest place of the reference from its beginning, m.
    #[must_use]
    pub fn farthest_m(&self) -> f64 {
        match *self {
            Self::Chirp { amplitude_m, .. } => amplitude_m,
            Self::Sweep { travel_m, .. } => travel_m,
        }
    }

    /// Greatest speed of the reference, m/s.
    #[must_use]
    pub fn fastest_mps(&self) -> f64 {
        match *self {
            Self::Chirp {
                amplitude_m,
                from_hz,
                to_hz,
                ..
            } => TAU * amplitude_m * from_hz.max(to_hz),
            Self::Sweep { speed_mps, .. } => speed_mps,
        }
    }

    /// Whether it goes no farther and no faster than it may, m and m/s.
    ///
    /// # Errors
    /// The first quantity that is out of range, or not a number.
    pub(super) fn check(&self, farthest_m: f64, fastest_mps: f64) -> Result<(), BoundError> {
        match *self {
            Self::Chirp {
                amplitude_m,
                from_hz,
                to_hz,
                ..
            } => {
                BoundError::check("amplitude_m", amplitude_m, MIN_M, farthest_m, "m")?;
                let (slowest_hz, highest_hz) = FREQUENCY_HZ;
                let fastest_hz = highest_hz.min(fastest_mps / (TAU * amplitude_m));
                BoundError::check("from_hz", from_hz, slowest_hz, fastest_hz, "Hz")?;
                BoundError::check("to_hz", to_hz, slowest_hz, fastest_hz, "Hz")?;
            }
            Self::Sweep {
                travel_m,
                speed_mps,
                rounds,
            } => {
                BoundError::check("travel_m", travel_m, MIN_M, farthest_m, "m")?;
                BoundError::check("speed_mps", speed_mps, SLOWEST_MPS, fastest_mps, "m/s")?;
                BoundError::check("rounds", f64::from(rounds), 1.0, f64::from(MAX_ROUNDS), "")?;
            }
        }
        let (shortest_s, longest_s) = DURATION_S;
        BoundError::check("duration_s", self.duration_s(), shortest_s, longest_s, "s")
    }

    /// Place (m) and speed (m/s) of the reference at a time after the beginning, from 0 to the duration.
    pub(super) fn at(&self, at_s: f64) -> (f64, f64) {
        match *self {
            Self::Chirp {
                amplitude_m,
                from_hz,
                to_hz,
                duration_s,
            } => {
                let rise_hz_per_s = (to_hz - from_hz) / duration_s;
                let (sine, cosine) = sin_cos(TAU * at_s * (from_hz + 0.5 * rise_hz_per_s * at_s));
                let speed = TAU * (from_hz + rise_hz_per_s * at_s) * cosine;
                let edge_s = (1.0 / from_hz.max(to_hz)).max(EDGE_S).min(0.5 * duration_s);
                let (share, growth) = envelope(at_s, duration_s, edge_s);
                (
                    amplitude_m * share * sine,
                    amplitude_m * (share * speed + growth * sine),
                )
            }
            Self::Sweep {
                travel_m, speed_mps, ..
            } => {
                let edge_s = edge_s(travel_m, speed_mps);
                let (gone_s, pace) = paced(at_s, self.duration_s(), edge_s);
                let (place_s, slope) = rounded_triangle(gone_s, travel_m / speed_mps, 0.5 * edge_s);
                (speed_mps * place_s, speed_mps * slope * pace)
            }
        }
    }
}

/// Time in which a sweep gets its speed, s: at most half of the travel to one side.
fn edge_s(travel_m: f64, speed_mps: f64) -> f64 {
    EDGE_S.min(0.5 * travel_m / speed_mps)
}

/// A share from 0 to 1 and back along smooth edges, and its derivative, 1/s.
fn envelope(at_s: f64, duration_s: f64, edge_s: f64) -> (f64, f64) {
    let (gone_s, sign) = if at_s < 0.5 * duration_s {
        (at_s, 1.0)
    } else {
        (duration_s - at_s, -1.0)
    };
    if gone_s >= edge_s {
        return (1.0, 0.0);
    }
    let (sine, cosine) = (sin_cos(PI * gone_s / edge_s).0, cos(PI * gone_s / edge_s));
    (0.5 * (1.0 - cosine), sign * 0.5 * PI / edge_s * sine)
}

/// Time along a sweep that gets its speed and loses it along an edge, s, and its pace, 0 to 1.
fn paced(at_s: f64, duration_s: f64, edge_s: f64) -> (f64, f64) {
    let left_s = duration_s - at_s;
    if at_s < edge_s {
        (0.5 * at_s * at_s / edge_s, at_s / edge_s)
    } else if left_s < edge_s {
        let left_s = left_s.max(0.0);
        (duration_s - edge_s - 0.5 * left_s * left_s / edge_s, left_s / edge_s)
    } else {
        (at_s - 0.5 * edge_s, 1.0)
    }
}

/// A triangle of slope 1 from 0 to `quarter` and on to its negative, whose corners are rounded for
/// `round` before and after; and its slope.
fn rounded_triangle(at: f64, quarter: f64, round: f64) -> (f64, f64) {
    let period = 4.0 * quarter;
    let phase = at - period * floor(at / period);
    // Distance in time from the nearest corner, which is the upper or the lower one.
    let (sign, from_corner) = if phase < 2.0 * quarter {
        (1.0, phase - quarter)
    } else {
        (-1.0, phase - 3.0 * quarter)
    };
    let away = from_corner.abs();
    let (depth, slope) = if away < round {
        (0.5 * (away * away / round + round), -from_corner / round)
    } else {
        (away, -from_corner.signum())
    };
    (sign * (quarter - depth), sign * slope)
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use alloc::vec::Vec;

    const STEP_S: f64 = 1e-4;

    pub(in crate::excitation) const fn chirp(amplitude_m: f64, from_hz: f64, to_hz: f64, duration_s: f64) -> Course {
        Course::Chirp {
            amplitude_m,
            from_hz,
            to_hz,
            duration_s,
        }
    }

    pub(in crate::excitation) const fn sweep(travel_m: f64, speed_mps: f64, rounds: u32) -> Course {
        Course::Sweep {
            travel_m,
            speed_mps,
            rounds,
        }
    }

    const COURSES: [Course; 6] = [
        chirp(5e-3, 0.5, 3.0, 10.0),
        chirp(5e-4, 1.0, 1.0, 4.0),
        // So short that it has its amplitude in the middle alone.
        chirp(5e-3, 1.0, 1.0, 1.0),
        sweep(3e-3, 1e-3, 1),
        sweep(0.02, 0.03, 2),
        // All of it is turns.
        sweep(1e-3, 0.1, 3),
    ];

    #[test]
    fn course_starts_and_ends_at_rest_within_bounds() {
        for course in COURSES {
            let duration_s = course.duration_s();
            for at_s in [0.0, duration_s] {
                let (place, speed) = course.at(at_s);
                assert!(place.abs() < 1e-12 && speed.abs() < 1e-9, "{course:?}: {place} {speed}");
            }
            let (mut farthest, mut fastest): (f64, f64) = (0.0, 0.0);
            let mut at_s = 0.0;
            while at_s < duration_s {
                let (place, speed) = course.at(at_s);
                (farthest, fastest) = (farthest.max(place.abs()), fastest.max(speed.abs()));
                at_s += STEP_S;
            }
            let (of_travel, of_speed) = (farthest / course.farthest_m(), fastest / course.fastest_mps());
            assert!((0.6..=1.0 + 1e-12).contains(&of_travel), "{course:?}: {farthest}");
            // The growth of the envelope is on top.
            assert!((0.8..1.5).contains(&of_speed), "{course:?}: {fastest}");
        }
    }

    #[test]
    fn the_speed_is_the_derivative_of_the_place() {
        for course in COURSES {
            let ticks: Vec<f64> = (1..2000).map(|k| course.duration_s() * f64::from(k) / 2000.0).collect();
            for at_s in ticks {
                let h = 1e-6;
                let slope = (course.at(at_s + h).0 - course.at(at_s - h).0) / (2.0 * h);
                let (_, speed) = course.at(at_s);
                assert!(
                    (slope - speed).abs() <= 1e-3 * course.fastest_mps(),
                    "{course:?} at {at_s}: {slope} {speed}"
                );
            }
        }
    }

    #[test]
    fn a_sweep_goes_at_its_speed_between_its_turns() {
        let course = sweep(0.02, 0.02, 1);
        // A tenth of a second until it has its speed.
        assert!((course.duration_s() - 4.1).abs() < 1e-12 && course.fastest_mps() == 0.02);
        let at_speed = (0..4000)
            .filter(|k| (course.at(f64::from(*k) * 1e-3).1.abs() - 0.02).abs() < 1e-12)
            .count();
        assert!(at_speed > 3600, "{at_speed} of 4000");
    }
}
