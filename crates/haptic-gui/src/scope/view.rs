//! Which while is seen, and how the user moves it.

/// The shortest while that can be looked at, s: a few ticks.
const SHORTEST_S: f64 = 0.002;

/// The longest, s; a recording may be longer than what is kept of a live rig.
const LONGEST_S: f64 = 86_400.0;

/// Where the zero of the time axis is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Zero {
    /// At the newest sample, so that the plots run.
    Newest,
    /// At this time of the daemon's clock, s, so that they stand still.
    At(f64),
}

/// A while, in s relative to its zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct View {
    pub(crate) zero: Zero,
    span_s: f64,
    right_s: f64,
}

impl Default for View {
    fn default() -> Self {
        Self {
            zero: Zero::Newest,
            span_s: 5.0,
            right_s: 0.0,
        }
    }
}

impl View {
    /// The whole of something that lies from 0 to `length_s`.
    pub(crate) fn whole(zero_s: f64, length_s: f64) -> Self {
        let span_s = length_s.clamp(SHORTEST_S, LONGEST_S);
        Self {
            zero: Zero::At(zero_s),
            span_s,
            right_s: span_s,
        }
    }

    pub(crate) fn span_s(&self) -> f64 {
        self.span_s
    }

    /// Left and right edge, s from the zero.
    pub(crate) fn edges(&self) -> (f64, f64) {
        (self.right_s - self.span_s, self.right_s)
    }

    /// Follows the newest sample again.
    pub(crate) fn follow(&mut self) {
        (self.zero, self.right_s) = (Zero::Newest, 0.0);
    }

    /// Stands still: its zero is at `zero_s` on the daemon's clock, its right edge `right_s` after that.
    pub(crate) fn hold(&mut self, zero_s: f64, right_s: f64) {
        (self.zero, self.right_s) = (Zero::At(zero_s), right_s);
    }

    /// Makes the while shorter (a factor above 1) or longer around a time, s from the zero. A view that runs goes on running.
    pub(crate) fn zoom(&mut self, factor: f64, around_s: f64) {
        let span_s = (self.span_s / factor).clamp(SHORTEST_S, LONGEST_S);
        if self.zero != Zero::Newest {
            let share = (self.right_s - around_s) / self.span_s;
            self.right_s = around_s + share * span_s;
        }
        self.span_s = span_s;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_zoom_keeps_what_is_under_the_pointer() {
        let mut view = View::whole(100.0, 10.0);
        view.zoom(2.0, 4.0);
        assert_eq!(view.edges(), (2.0, 7.0));
        view.zoom(0.5, 4.0);
        assert_eq!(view.edges(), (0.0, 10.0));
    }

    #[test]
    fn a_running_view_keeps_the_newest_sample_at_its_right_edge() {
        let mut view = View::default();
        view.zoom(5.0, -3.0);
        assert_eq!(view.edges(), (-1.0, 0.0));
        view.hold(42.0, -0.5);
        assert_eq!((view.zero, view.edges()), (Zero::At(42.0), (-1.5, -0.5)));
        view.follow();
        assert_eq!((view.zero, view.edges()), (Zero::Newest, (-1.0, 0.0)));
    }

    #[test]
    fn a_zoom_ends_somewhere() {
        let mut view = View::default();
        view.zoom(1e30, 0.0);
        assert_eq!(view.span_s(), SHORTEST_S);
        view.zoom(1e-30, 0.0);
        assert_eq!(view.span_s(), LONGEST_S);
    }
}
