//! A straight line through points, by least squares, with intervals.

use super::StatsError;
use super::error::{check_count, check_finite};
use super::mean::{mean, student_t};
use serde::Serialize;

/// `y = intercept + slope x`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RegressionLine {
    /// Where the line crosses x = 0, in the unit of y.
    pub intercept: f64,
    /// Its 95 % interval.
    pub intercept_interval: [f64; 2],
    /// Slope, in the unit of y over that of x.
    pub slope: f64,
    /// Its 95 % interval.
    pub slope_interval: [f64; 2],
    /// The share of the variance of y that the line explains.
    pub r_squared: f64,
    /// Standard deviation of the points about the line, in the unit of y, with n - 2.
    pub residual_deviation: f64,
    /// How many points there are.
    pub count: usize,
}

/// The line with the least squares of the distances along y, through points `[x, y]`.
///
/// # Errors
/// There are fewer than three points, one is not finite, or all have the same x or the same y.
pub fn line(points: &[[f64; 2]]) -> Result<RegressionLine, StatsError> {
    check_count("points of the regression", points.len(), 3)?;
    check_finite("coordinate", points.iter().flatten().copied())?;
    let count = points.len() as f64;
    let (x, y): (Vec<f64>, Vec<f64>) = points.iter().map(|[x, y]| (*x, *y)).unzip();
    let (middle_x, middle_y) = (mean(&x), mean(&y));
    let sum =
        |of: &dyn Fn(f64, f64) -> f64| -> f64 { points.iter().map(|[x, y]| of(x - middle_x, y - middle_y)).sum() };
    let (xx, xy, yy) = (sum(&|x, _| x * x), sum(&|x, y| x * y), sum(&|_, y| y * y));
    // Rounding leaves equal values a spread of some of their last digits.
    let is_spread = |squares: f64, middle: f64| squares > count * (8.0 * f64::EPSILON * middle).powi(2);
    let no_spread = |what, value, consequence| {
        let why = format!("every {what} of the regression is {value}: {consequence}");
        Err(StatsError::new(why))
    };
    if !is_spread(xx, middle_x) {
        return no_spread("x", x[0], "a line has no slope there");
    }
    if !is_spread(yy, middle_y) {
        return no_spread("y", y[0], "there is nothing that a line could explain");
    }
    let slope = xy / xx;
    let intercept = middle_y - slope * middle_x;
    let left: f64 = points.iter().map(|[x, y]| (y - intercept - slope * x).powi(2)).sum();
    let deviation = (left / (count - 2.0)).sqrt();
    let t = student_t(count - 2.0);
    let interval = |value: f64, half: f64| [value - half, value + half];
    Ok(RegressionLine {
        intercept,
        intercept_interval: interval(
            intercept,
            t * deviation * (1.0 / count + middle_x * middle_x / xx).sqrt(),
        ),
        slope,
        slope_interval: interval(slope, t * deviation / xx.sqrt()),
        r_squared: 1.0 - left / yy,
        residual_deviation: deviation,
        count: points.len(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_comes_out_as_by_hand() {
        // x 1 to 5, y 2 4 5 4 5: xx = 10, xy = 6, yy = 6; slope 0.6, intercept 4 - 1.8 = 2.2; what is left is
        // 6 - 0.6 * 6 = 2.4, so the deviation is sqrt(0.8). Student's t for 3 degrees of freedom is 3.182446.
        let found = line(&[[1.0, 2.0], [2.0, 4.0], [3.0, 5.0], [4.0, 4.0], [5.0, 5.0]]).expect("five points");
        let slope_half = 3.182_446 * (0.8_f64 / 10.0).sqrt();
        let intercept_half = 3.182_446 * 0.8_f64.sqrt() * (0.2_f64 + 0.9).sqrt();
        for (value, by_hand) in [
            (found.slope, 0.6),
            (found.intercept, 2.2),
            (found.r_squared, 0.6),
            (found.residual_deviation, 0.8_f64.sqrt()),
            (found.slope_interval[1], 0.6 + slope_half),
            (found.intercept_interval[0], 2.2 - intercept_half),
        ] {
            assert!((value - by_hand).abs() < 1e-6, "{value} is not {by_hand}");
        }
    }

    #[test]
    fn what_has_no_line_is_refused_by_name() {
        let refused = |points: &[[f64; 2]]| line(points).expect_err("refused").to_string();
        assert!(refused(&[[1.0, 2.0], [2.0, 3.0]]).starts_with("points of the regression: 2; at least 3"));
        assert!(refused(&[[0.1, 2.0], [0.1, 3.0], [0.1, 4.0]]).starts_with("every x of the regression is 0.1: "));
        assert!(refused(&[[1.0, 0.6], [2.0, 0.6], [3.0, 0.6]]).contains("nothing that a line could explain"));
        assert!(refused(&[[1.0, 2.0], [2.0, f64::INFINITY], [3.0, 1.0]]).starts_with("coordinate 4 is inf"));
    }
}
