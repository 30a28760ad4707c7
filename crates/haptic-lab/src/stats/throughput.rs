//! Throughput by ISO 9241-411 (2012), annex B, in the words of Soukoreff and MacKenzie (2004): how many bits a second
//! a person gets across, with the spread of the hits in the place of the target's width.

use super::StatsError;
use super::error::{check_count, check_finite, check_positive};
use super::mean::{deviation, mean};
use serde::Serialize;

/// Standard deviations that hold 96 % of normally distributed hits: the square root of 2 pi e.
pub const DEVIATIONS_IN_WIDTH: f64 = 4.132_731_354;

/// One movement to a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Movement {
    /// Distance from target to target, m.
    pub amplitude_m: f64,
    /// Where the movement ended beyond the target's centre, m: positive along the movement, whichever way that went.
    pub end_error_m: f64,
    /// How long it took, s.
    pub movement_time_s: f64,
}

/// Where a movement begins.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Task {
    /// Where the one before has ended: one that ended beyond its target has lengthened the path back.
    #[default]
    Serial,
    /// At the centre of a place of its own.
    Discrete,
}

/// What a sequence of movements under one condition amounts to.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Throughput {
    /// Effective amplitude, m: the mean distance that was moved.
    pub effective_amplitude_m: f64,
    /// Standard deviation of the ends along the movement, m, with n - 1.
    pub end_deviation_m: f64,
    /// Effective width, m: [`DEVIATIONS_IN_WIDTH`] times that.
    pub effective_width_m: f64,
    /// Effective index of difficulty, bit: log2(Ae / We + 1).
    pub effective_id_bit: f64,
    /// Mean movement time, s.
    pub movement_time_s: f64,
    /// Throughput, bit/s: the index over the time.
    pub throughput_bit_per_s: f64,
}

/// Throughput of one sequence, whose movements follow one another in this order.
///
/// The distance moved is `A + dx_i + dx_(i-1)` in a serial task, where both errors are positive along their own
/// movement and the first begins at the centre of a target (its `dx_0` is 0), and `A + dx_i` in a discrete one.
///
/// # Errors
/// There are fewer than two movements, all end at the same place, a time is not above zero, or a value is not finite.
pub fn throughput(movements: &[Movement], task: Task) -> Result<Throughput, StatsError> {
    check_count("movements", movements.len(), 2)?;
    check_finite("amplitude", movements.iter().map(|one| one.amplitude_m))?;
    check_finite("end error", movements.iter().map(|one| one.end_error_m))?;
    check_finite("movement time", movements.iter().map(|one| one.movement_time_s))?;
    for one in movements {
        check_positive("amplitude", one.amplitude_m, "m")?;
        check_positive("movement time", one.movement_time_s, "s")?;
    }
    let errors_m: Vec<f64> = movements.iter().map(|one| one.end_error_m).collect();
    let before_m = std::iter::once(0.0).chain(errors_m.iter().copied());
    let moved_m: Vec<f64> = movements
        .iter()
        .zip(before_m)
        .map(|(one, before)| match task {
            Task::Serial => one.amplitude_m + one.end_error_m + before,
            Task::Discrete => one.amplitude_m + one.end_error_m,
        })
        .collect();
    let effective_amplitude_m = mean(&moved_m);
    check_positive("effective amplitude", effective_amplitude_m, "m")?;
    let end_deviation_m = deviation(&errors_m);
    if end_deviation_m <= f64::EPSILON * effective_amplitude_m {
        return Err(StatsError::new(format!(
            "every end error is {} m: the effective width is 0, and throughput infinite",
            errors_m[0]
        )));
    }
    let effective_width_m = DEVIATIONS_IN_WIDTH * end_deviation_m;
    let effective_id_bit = (effective_amplitude_m / effective_width_m + 1.0).log2();
    let times_s: Vec<f64> = movements.iter().map(|one| one.movement_time_s).collect();
    let movement_time_s = mean(&times_s);
    Ok(Throughput {
        effective_amplitude_m,
        end_deviation_m,
        effective_width_m,
        effective_id_bit,
        movement_time_s,
        throughput_bit_per_s: effective_id_bit / movement_time_s,
    })
}

/// Index of difficulty as Richard and Cutkosky (2000) have it, bit: `-log2((W - D) / 2A)`, Fitts's (1954) with the room
/// that a cursor of diameter D leaves in a target of width W at distance A.
///
/// It is not the index of ISO 9241-411, which takes the spread of the hits for the width
/// ([`throughput`]).
///
/// # Errors
/// A length is not above zero (the cursor's may be 0), or the cursor does not fit into the target.
pub fn index_of_difficulty(amplitude_m: f64, width_m: f64, cursor_diameter_m: f64) -> Result<f64, StatsError> {
    check_finite("length", [amplitude_m, width_m, cursor_diameter_m])?;
    check_positive("amplitude", amplitude_m, "m")?;
    if cursor_diameter_m >= width_m {
        return Err(StatsError::new(format!(
            "the cursor, {cursor_diameter_m} m, does not fit into the target, {width_m} m wide"
        )));
    }
    Ok(-((width_m - cursor_diameter_m) / (2.0 * amplitude_m)).log2())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A 300 mm, and eight movements.
    fn worked() -> Vec<Movement> {
        let errors_mm = [-6.0, 3.0, 11.0, -2.0, 0.0, 25.0, -9.0, 4.0];
        let times_ms = [612.0, 580.0, 655.0, 701.0, 590.0, 640.0, 622.0, 598.0];
        let of = |(error_mm, time_ms): (f64, f64)| Movement {
            amplitude_m: 0.3,
            end_error_m: error_mm / 1000.0,
            movement_time_s: time_ms / 1000.0,
        };
        errors_mm.into_iter().zip(times_ms).map(of).collect()
    }

    #[test]
    fn a_sequence_comes_out_as_by_hand() {
        // The errors sum up to 26 mm, those of the movements before (0, then all but the last) to 22 mm: Ae = 300 + 48
        // / 8. Their squares sum up to 892 mm^2: SDx^2 = (892 - 26^2 / 8) / 7 = 115.357. The times sum up to 4998 ms.
        let found = throughput(&worked(), Task::Serial).expect("eight movements");
        for (value, by_hand, within) in [
            (found.effective_amplitude_m, 0.306, 1e-12),
            (found.end_deviation_m, 0.010_740_444, 5e-10),
            (found.effective_width_m, 0.044_387_371, 5e-10),
            (found.effective_id_bit, 2.980_730, 5e-7),
            (found.movement_time_s, 0.624_75, 1e-12),
            (found.throughput_bit_per_s, 4.771_076, 5e-7),
        ] {
            assert!((value - by_hand).abs() <= within, "{value} is not {by_hand}");
        }
        let discrete = throughput(&worked(), Task::Discrete).expect("eight movements");
        assert!(
            (discrete.effective_amplitude_m - 0.303_25).abs() <= 1e-12,
            "300 + 26 / 8 mm"
        );
        assert_eq!(discrete.effective_width_m.to_bits(), found.effective_width_m.to_bits());
    }

    #[test]
    fn what_has_no_throughput_is_refused_by_name() {
        let refused = |movements: &[Movement]| throughput(movements, Task::Serial).expect_err("refused").to_string();
        assert_eq!(refused(&worked()[..1]), "movements: 1; at least 2 are needed");
        let same = [worked()[0]; 4];
        assert!(refused(&same).contains("every end error is -0.006 m: the effective width is 0"));
        let mut instant = worked();
        instant[3].movement_time_s = 0.0;
        assert_eq!(refused(&instant), "the movement time is 0 s; it must be above 0 s");
        let mut broken = worked();
        broken[2].end_error_m = f64::NAN;
        assert!(refused(&broken).starts_with("end error 3 is NaN"));
        let mut backwards = worked();
        backwards.iter_mut().for_each(|one| one.end_error_m -= 0.3);
        assert!(refused(&backwards).starts_with("the effective amplitude is -"));
    }

    #[test]
    fn the_room_for_the_cursor_is_what_makes_it_hard() {
        // 2 * 0.32 m over 0.04 m is 16, and over 0.02 m is 32.
        assert_eq!(index_of_difficulty(0.32, 0.04, 0.0), Ok(4.0));
        assert_eq!(index_of_difficulty(0.32, 0.04, 0.02), Ok(5.0));
        let refused = |a, w, d| index_of_difficulty(a, w, d).expect_err("refused").to_string();
        assert_eq!(
            refused(0.3, 0.02, 0.02),
            "the cursor, 0.02 m, does not fit into the target, 0.02 m wide"
        );
        assert_eq!(refused(0.0, 0.02, 0.01), "the amplitude is 0 m; it must be above 0 m");
        assert!(refused(0.3, f64::NAN, 0.01).contains("length 2 is NaN"));
    }
}
