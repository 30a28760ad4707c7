//! The range of a value axis: fitted to the samples in sight, or held by the user.

/// Smallest span of an axis, in the unit of its plot: far below the resolution of an encoder or a motor.
pub(crate) const NARROWEST: f64 = 1e-6;

/// Largest distance of an axis from zero, in the unit of its plot.
pub(crate) const FARTHEST: f64 = 1e6;

/// From the lower end of an axis to its upper, in the unit of its plot.
pub(crate) type Reach = (f64, f64);

#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct ValueAxis {
    held: Option<Reach>,
    /// The range drawn last.
    seen: Option<Reach>,
}

impl ValueAxis {
    /// The range that the user holds; `None` while the axis is fitted.
    pub(crate) fn held(&self) -> Option<Reach> {
        self.held
    }

    /// Notes the range that was drawn.
    pub(crate) fn saw(&mut self, reach: Reach) {
        self.seen = Some(reach);
    }

    pub(crate) fn seen(&self) -> Reach {
        self.seen.unwrap_or((-1.0, 1.0))
    }

    /// Fits the axis to the samples in sight.
    pub(crate) fn fit(&mut self) {
        self.held = None;
    }

    /// Holds the axis. An invalid range is ignored.
    pub(crate) fn hold(&mut self, (low, high): Reach) {
        let is_near = |end: f64| end.abs() <= FARTHEST;
        if is_near(low) && is_near(high) && high - low >= NARROWEST {
            self.held = Some((low, high));
        }
    }

    /// Holds the axis with a smaller (a factor above 1) or larger span around a value.
    pub(crate) fn zoom(&mut self, factor: f64, around: f64) {
        let (low, high) = self.seen();
        let moved = |end: f64| around + (end - around) / factor;
        self.hold((moved(low), moved(high)));
    }

    /// Holds the axis, moved towards greater values.
    pub(crate) fn shift(&mut self, by: f64) {
        let (low, high) = self.seen();
        self.hold((low + by, high + by));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_is_held_from_how_it_was_seen_until_it_fits_again() {
        let mut axis = ValueAxis::default();
        axis.saw((-4.0, 4.0));
        axis.zoom(4.0, 2.0);
        assert_eq!(axis.held(), Some((0.5, 2.5)));
        axis.saw((0.5, 2.5));
        axis.shift(-1.5);
        assert_eq!(axis.held(), Some((-1.0, 1.0)));
        axis.fit();
        assert_eq!(axis.held(), None);
    }

    #[test]
    fn an_invalid_range_is_ignored() {
        let mut axis = ValueAxis::default();
        axis.hold((1.0, 2.0));
        for reach in [
            (2.0, 1.0),
            (1.0, 1.0),
            (f64::NAN, 1.0),
            (0.0, f64::INFINITY),
            (-1e9, 0.0),
        ] {
            axis.hold(reach);
            assert_eq!(axis.held(), Some((1.0, 2.0)), "{reach:?}");
        }
        axis.saw((1.0, 2.0));
        axis.zoom(1e30, 1.5);
        axis.zoom(1e-30, 1.5);
        assert_eq!(axis.held(), Some((1.0, 2.0)));
    }
}
