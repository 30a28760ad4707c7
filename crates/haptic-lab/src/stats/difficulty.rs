//! How hard a target is to hit, in bits.

use super::StatsError;
use super::error::{check_finite, check_positive};

/// Index of difficulty as Richard and Cutkosky (2000) have it, bit: `-log2((W - D) / 2A)`, Fitts's (1954) with the room
/// that a cursor of diameter D leaves in a target of width W at distance A.
///
/// It is not the index of ISO 9241-411, which takes the spread of the hits for the width
/// ([`throughput`](super::throughput)).
///
/// # Errors
/// A length is not above zero (the cursor's may be 0), or the cursor does not fit into the target.
pub fn index_of_difficulty(amplitude_m: f64, width_m: f64, cursor_diameter_m: f64) -> Result<f64, StatsError> {
    check_finite("length", [amplitude_m, width_m, cursor_diameter_m])?;
    check_positive("amplitude", amplitude_m, "m")?;
    if cursor_diameter_m >= width_m {
        return Err(StatsError::CursorTooWide {
            width_m,
            cursor_diameter_m,
        });
    }
    Ok(-((width_m - cursor_diameter_m) / (2.0 * amplitude_m)).log2())
}

#[cfg(test)]
mod tests {
    use super::*;

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
