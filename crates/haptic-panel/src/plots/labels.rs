//! Places for the labels of a plot: none lies over another, and none leaves the plot.

use egui::{Rect, Vec2, pos2};

/// Places that are tried farther from where a label would stand by itself.
const STEPS: u8 = 24;

/// The labels of a plot that have a place.
#[derive(Debug)]
pub(crate) struct Labels {
    area: Rect,
    /// Vertical positions of the levels.
    levels: Vec<f32>,
    taken: Vec<Rect>,
}

impl Labels {
    /// None yet, in the inner part of a plot with levels at these vertical positions.
    pub(crate) const fn new(area: Rect, levels: Vec<f32>) -> Self {
        Self {
            area,
            levels,
            taken: Vec::new(),
        }
    }

    /// A place at the right end of a level, above or below it, or further to the left; else upon it, where the plot
    /// ends before; else on its other side. Never upon another level. `None` where there is no room.
    pub(crate) fn at_level(&mut self, y: f32, is_above: bool, size: Vec2) -> Option<Rect> {
        if !self.area.y_range().contains(y) {
            return None;
        }
        let right = self.area.right() - size.x;
        let [side, other] = if is_above { [y - size.y, y] } else { [y, y - size.y] };
        let at_edge = side.clamp(self.area.top(), (self.area.bottom() - size.y).max(self.area.top()));
        let is_free = |top: &f32| {
            let inner = top + 0.01..top + size.y - 0.01;
            !self.levels.iter().any(|level| *level != y && inner.contains(level))
        };
        let tops: Vec<f32> = [side, at_edge, other].into_iter().filter(is_free).collect();
        let places = tops.into_iter().flat_map(|top| {
            let left = move |step| right - f32::from(step) * size.x;
            (0..STEPS).map(move |step| Rect::from_min_size(pos2(left(step), top), size))
        });
        self.take(places)
    }

    /// A place at the foot of a mark at `x`, on the side away from the plot's zero, `zero`: the band between two marks
    /// may be narrower. Else on the other side, or higher up. `None` where there is no room.
    pub(crate) fn at_mark(&mut self, x: f32, zero: f32, size: Vec2) -> Option<Rect> {
        let foot = self.area.bottom() - size.y;
        let mut sides = [x, x - size.x];
        if x < zero {
            sides.reverse();
        }
        let places = (0..STEPS).flat_map(|step| {
            let top = foot - f32::from(step) * size.y;
            sides.map(|left| Rect::from_min_size(pos2(left, top), size))
        });
        self.take(places)
    }

    /// Takes the first place that is free.
    fn take(&mut self, mut places: impl Iterator<Item = Rect>) -> Option<Rect> {
        let is_free = |place: &Rect| {
            // What touches does not overlap, and a rounding error is not seen.
            let inner = place.shrink(0.01);
            self.area.contains_rect(inner) && !self.taken.iter().any(|other| other.intersects(inner))
        };
        let place = places.find(is_free)?;
        self.taken.push(place);
        Some(place)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::vec2;
    use proptest::prelude::*;

    const AREA: Rect = Rect::from_min_max(pos2(50.0, 10.0), pos2(450.0, 130.0));

    #[test]
    fn no_label_lies_on_the_line_of_another_level() {
        let size = vec2(20.0, 12.0);
        // Static force outward of dynamic force, above zero and below.
        for (static_y, dynamic_y, is_above) in [(40.0, 44.0, true), (104.0, 100.0, false)] {
            let mut labels = Labels::new(AREA, vec![static_y, dynamic_y]);
            let outward = labels.at_level(static_y, is_above, size).expect("there is room");
            let inward = labels.at_level(dynamic_y, !is_above, size).expect("there is room");
            let [outward, inward] = [outward, inward].map(|label| label.center().y);
            let side = if is_above { -6.0 } else { 6.0 };
            assert_eq!((outward, inward), (static_y + side, dynamic_y - side));
        }
        // Above there is no room: it is written on its own line, at the edge.
        let at_edge = Labels::new(AREA, vec![16.0, 24.0]).at_level(16.0, true, size);
        assert_eq!(at_edge.map(|label| label.top()), Some(AREA.top()));
        let closer = Labels::new(AREA, vec![16.0, 20.0]).at_level(16.0, true, size);
        assert_eq!(closer, None, "every place is on the other line");
        let beside = Labels::new(AREA, vec![60.0, 56.0]).at_level(60.0, true, size);
        assert_eq!(beside.map(|label| label.top()), Some(60.0), "above is another line");
        let outside = Labels::new(AREA, vec![-5.0]).at_level(-5.0, true, size);
        assert_eq!(outside.map(|label| label.top()), None, "the line is not in the plot");
    }

    proptest! {
        #[test]
        fn no_label_lies_over_another_and_none_leaves_the_plot(
            wanted in prop::collection::vec((any::<bool>(), -0.2..1.2_f32, 5.0..90.0_f32), 0..30),
        ) {
            let mut labels = Labels::new(AREA, Vec::new());
            let mut placed: Vec<Rect> = Vec::new();
            for (is_level, share, width) in wanted {
                let size = vec2(width, 12.0);
                let place = if is_level {
                    labels.at_level(AREA.top() + share * AREA.height(), share < 0.5, size)
                } else {
                    labels.at_mark(AREA.left() + share * AREA.width(), AREA.center().x, size)
                };
                let Some(place) = place else { continue };
                prop_assert!(AREA.expand(0.02).contains_rect(place), "{place:?}");
                let over = placed.iter().find(|other| other.shrink(0.02).intersects(place.shrink(0.02)));
                prop_assert_eq!(over, None, "under {:?}", place);
                placed.push(place);
            }
        }
    }
}
