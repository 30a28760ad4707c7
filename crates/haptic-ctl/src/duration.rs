//! Durations on the command line: `50ms`, `5s`, `1.5min`.

use std::time::Duration;

/// Reads a duration. A bare number is refused: nobody knows whether it is of seconds or of
/// milliseconds.
pub(crate) fn duration(text: &str) -> Result<Duration, String> {
    let refused = || format!("`{text}` is not a duration: write a number with its unit, as in 50ms, 5s or 1.5min");
    let read: jiff::SignedDuration = text.parse().map_err(|_| refused())?;
    Duration::try_from(read).map_err(|_| format!("`{text}` is negative: a duration is 0s or more, as in 50ms"))
}

/// In milliseconds, as requests have them.
pub(crate) fn milliseconds(duration: Duration) -> f64 {
    duration.as_secs_f64() * 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_need_a_unit() {
        assert_eq!(duration("50ms"), Ok(Duration::from_millis(50)));
        assert_eq!(duration("5s"), Ok(Duration::from_secs(5)));
        assert_eq!(duration("1.5min"), Ok(Duration::from_secs(90)));
        assert_eq!(duration("1h 30s"), Ok(Duration::from_secs(3630)));
        assert_eq!(duration("0s"), Ok(Duration::ZERO));
        for bad in ["5", "", "-5s", "soon", "5kg", "5 5s"] {
            let error = duration(bad).expect_err(bad);
            assert!(error.contains("50ms"), "{error}");
        }
    }
}
