//! The ranges of the value axes: fitted to the samples in sight, or held by the user.

use crate::tape::signal::Quantity;

/// Smallest span of an axis, in the unit of its quantity: far below the resolution of an encoder or a
/// motor.
pub(crate) const NARROWEST: f64 = 1e-6;

/// Largest distance of an axis from zero, in the unit of its quantity.
pub(crate) const FARTHEST: f64 = 1e6;

/// From the lower end of an axis to its upper, in the unit of its quantity.
pub(crate) type Reach = (f64, f64);

/// The axes of the plots over time.
#[derive(Debug, Default)]
pub(crate) struct ValueAxes {
    held: [Option<Reach>; 3],
    /// The ranges drawn last.
    seen: [Option<Reach>; 3],
}

impl ValueAxes {
    /// The range that the user holds; `None` while the axis is fitted.
    pub(crate) fn held(&self, quantity: Quantity) -> Option<Reach> {
        self.held[quantity as usize]
    }

    /// Notes the range that was drawn.
    pub(crate) fn saw(&mut self, quantity: Quantity, reach: Reach) {
        self.seen[quantity as usize] = Some(reach);
    }

    /// The range that was drawn last.
    pub(crate) fn seen(&self, quantity: Quantity) -> Reach {
        let half = quantity.smallest_span() / 2.0;
        self.seen[quantity as usize].unwrap_or((-half, half))
    }

    /// Fits an axis to the samples in sight.
    pub(crate) fn fit(&mut self, quantity: Quantity) {
        self.held[quantity as usize] = None;
    }

    /// Holds an axis. An invalid range is ignored.
    pub(crate) fn hold(&mut self, quantity: Quantity, (low, high): Reach) {
        let is_near = |end: f64| end.abs() <= FARTHEST;
        if is_near(low) && is_near(high) && high - low >= NARROWEST {
            self.held[quantity as usize] = Some((low, high));
        }
    }

    /// Holds an axis with a smaller (a factor above 1) or larger span around a value.
    pub(crate) fn zoom(&mut self, quantity: Quantity, factor: f64, around: f64) {
        let (low, high) = self.seen(quantity);
        let moved = |end: f64| around + (end - around) / factor;
        self.hold(quantity, (moved(low), moved(high)));
    }

    /// Holds an axis that is moved towards greater values.
    pub(crate) fn shift(&mut self, quantity: Quantity, by: f64) {
        let (low, high) = self.seen(quantity);
        self.hold(quantity, (low + by, high + by));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_is_held_from_how_it_was_seen_until_it_fits_again() {
        let mut axes = ValueAxes::default();
        axes.saw(Quantity::Force, (-4.0, 4.0));
        axes.zoom(Quantity::Force, 4.0, 2.0);
        assert_eq!(axes.held(Quantity::Force), Some((0.5, 2.5)));
        axes.saw(Quantity::Force, (0.5, 2.5));
        axes.shift(Quantity::Force, -1.5);
        assert_eq!(axes.held(Quantity::Force), Some((-1.0, 1.0)));
        assert_eq!(axes.held(Quantity::Position), None);
        axes.fit(Quantity::Force);
        assert_eq!(axes.held(Quantity::Force), None);
    }

    #[test]
    fn an_invalid_range_is_ignored() {
        let mut axes = ValueAxes::default();
        axes.hold(Quantity::Force, (1.0, 2.0));
        for reach in [
            (2.0, 1.0),
            (1.0, 1.0),
            (f64::NAN, 1.0),
            (0.0, f64::INFINITY),
            (-1e9, 0.0),
        ] {
            axes.hold(Quantity::Force, reach);
            assert_eq!(axes.held(Quantity::Force), Some((1.0, 2.0)), "{reach:?}");
        }
        axes.saw(Quantity::Force, (1.0, 2.0));
        axes.zoom(Quantity::Force, 1e30, 1.5);
        axes.zoom(Quantity::Force, 1e-30, 1.5);
        assert_eq!(axes.held(Quantity::Force), Some((1.0, 2.0)));
    }
}
