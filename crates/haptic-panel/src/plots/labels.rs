//! Places for the labels of a plot: none lies over another, and none leaves the plot.

use egui::{Rect, Vec2, pos2};

/// Places that are tried farther from where a label would stand by itself.
const STEPS: u8 = 24;

/// The labels of a plot that have a place.
#[derive(Debug)]
pub(crate) struct Labels {
    area: Rect,
    taken: Vec<Rect>,
}

impl Labels {
    /// None yet, in the inner part of a plot.
    pub(crate) const fn new(area: Rect) -> Self {
        Self {
            area,
            taken: Vec::new(),
        }
    }

    /// A place at the right end of a level, on the side away from the plot's zero, `zero`; else on its other side, or
    /// further to the left. `None` where there is no room.
    pub(crate) fn at_level(&mut self, y: f32, zero: f32, size: Vec2) -> Option<Rect> {
        let right = self.area.right() - size.x;
        let mut sides = [y - size.y, y];
        if y > zero {
            sides.reverse();
        }
        let places = (0..STEPS).flat_map(|step| {
            let left = right - f32::from(step) * size.x;
            sides.map(|top| Rect::from_min_size(pos2(left, top), size))
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
    fn close_levels_are_labelled_above_and_below() {
        let mut labels = Labels::new(AREA);
        let size = vec2(20.0, 12.0);
        let rows = [60.0, 64.0, 66.0].map(|y| labels.at_level(y, 100.0, size).expect("there is room"));
        assert_eq!(rows[0].bottom(), 60.0, "above its line");
        assert_eq!(rows[1].top(), 64.0, "below its line");
        assert_eq!(rows[2].right(), AREA.right() - 20.0, "beside them");
        let low = labels.at_level(110.0, 100.0, size).expect("there is room");
        assert_eq!(low.top(), 110.0, "below its line, which is below zero");
        let top = labels.at_level(12.0, 100.0, size).expect("there is room");
        assert_eq!(top.top(), 12.0, "above it there is no room");
        let alone = Labels::new(AREA).at_level(5.0, 100.0, size);
        assert_eq!(alone, None, "the line is not in the plot");
    }

    proptest! {
        #[test]
        fn no_label_lies_over_another_and_none_leaves_the_plot(
            wanted in prop::collection::vec((any::<bool>(), -0.2..1.2_f32, 5.0..90.0_f32), 0..30),
        ) {
            let mut labels = Labels::new(AREA);
            let mut placed: Vec<Rect> = Vec::new();
            for (is_level, share, width) in wanted {
                let size = vec2(width, 12.0);
                let place = if is_level {
                    labels.at_level(AREA.top() + share * AREA.height(), AREA.center().y, size)
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
