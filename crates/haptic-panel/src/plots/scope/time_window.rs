//! The window in time that the user sees, zooms and moves.

use crate::tape::KEPT_S;

/// Shortest window, s: a few ticks.
const MIN_S: f64 = 0.002;

/// Usual length of the window, s.
const DEFAULT_S: f64 = 5.0;

/// Zero of the time axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Zero {
    /// At the newest sample, so that the plots run.
    Newest,
    /// At this time of the daemon's clock, s, so that they stand still.
    At(f64),
}

/// A window, s from its zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct TimeWindow {
    pub(crate) zero: Zero,
    span_s: f64,
    right_s: f64,
    /// Length of what there is to see, s: the window is no longer.
    longest_s: f64,
    /// What there is to see begins at the zero, and the window does not leave it.
    is_whole: bool,
}

impl Default for TimeWindow {
    fn default() -> Self {
        Self {
            zero: Zero::Newest,
            span_s: DEFAULT_S,
            right_s: 0.0,
            longest_s: KEPT_S,
            is_whole: false,
        }
    }
}

impl TimeWindow {
    /// The window from 0 to `length_s`.
    pub(crate) fn whole(zero_s: f64, length_s: f64) -> Self {
        let span_s = length_s.max(MIN_S);
        Self {
            zero: Zero::At(zero_s),
            span_s,
            right_s: span_s,
            longest_s: span_s,
            is_whole: true,
        }
    }

    pub(crate) fn span_s(&self) -> f64 {
        self.span_s
    }

    /// The shortest and the longest span, s.
    pub(crate) fn reach_s(&self) -> (f64, f64) {
        (MIN_S, self.longest_s)
    }

    /// The usual length, or all of something shorter, s.
    pub(crate) fn default_s(&self) -> f64 {
        DEFAULT_S.min(self.longest_s)
    }

    /// Left and right edge, s from the zero.
    pub(crate) fn edges(&self) -> (f64, f64) {
        (self.right_s - self.span_s, self.right_s)
    }

    /// Follows the newest sample again.
    pub(crate) fn follow(&mut self) {
        (self.zero, self.right_s) = (Zero::Newest, 0.0);
    }

    /// Stands still: with its zero at `zero_s` on the daemon's clock and its right edge `right_s` after it.
    pub(crate) fn hold(&mut self, zero_s: f64, right_s: f64) {
        (self.zero, self.right_s) = (Zero::At(zero_s), right_s);
        self.stay();
    }

    /// Makes the window shorter (a factor above 1) or longer around a time, s from the zero. A running
    /// window continues to run.
    pub(crate) fn zoom(&mut self, factor: f64, around_s: f64) {
        let span_s = (self.span_s / factor).clamp(MIN_S, self.longest_s);
        if self.zero != Zero::Newest {
            let share = (self.right_s - around_s) / self.span_s;
            self.right_s = around_s + share * span_s;
        }
        self.span_s = span_s;
        self.stay();
    }

    fn stay(&mut self) {
        if self.is_whole {
            self.right_s = self.right_s.clamp(self.span_s, self.longest_s);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_zoom_keeps_what_is_under_the_pointer() {
        let mut window = TimeWindow::whole(100.0, 10.0);
        window.zoom(2.0, 4.0);
        assert_eq!(window.edges(), (2.0, 7.0));
        window.zoom(0.5, 4.0);
        assert_eq!(window.edges(), (0.0, 10.0));
        window.zoom(0.5, 4.0);
        assert_eq!(window.span_s(), 10.0, "there is no more of it");
        window.zoom(5.0, 9.0);
        window.hold(100.0, 12.0);
        assert_eq!(window.edges(), (8.0, 10.0), "nor beyond its end");
        window.zoom(0.1, 8.0);
        assert_eq!(window.edges(), (0.0, 10.0), "all of it is in sight again");
    }

    #[test]
    fn a_running_window_keeps_the_newest_sample_at_its_right_edge() {
        let mut window = TimeWindow::default();
        window.zoom(5.0, -3.0);
        assert_eq!(window.edges(), (-1.0, 0.0));
        window.hold(42.0, -0.5);
        assert_eq!((window.zero, window.edges()), (Zero::At(42.0), (-1.5, -0.5)));
        window.follow();
        assert_eq!((window.zero, window.edges()), (Zero::Newest, (-1.0, 0.0)));
        window.zoom(1e30, 0.0);
        assert_eq!(window.span_s(), MIN_S);
        window.zoom(1e-30, 0.0);
        assert_eq!(window.span_s(), KEPT_S, "no more is kept");
    }
}
