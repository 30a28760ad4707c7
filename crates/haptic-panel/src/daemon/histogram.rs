//! Histograms of durations, in which one among a million is visible.

use crate::theme::{Palette, SMALLEST_TEXT};
use egui::{Align2, FontId, Rect, Sense, Ui, pos2, vec2};
use haptic_ipc::{Bucket, Percentiles};

const HEIGHT: f32 = 64.0;
const LABELS_HEIGHT: f32 = 16.0;

/// Width that a number below the bars takes at most, points.
const LABEL_DISTANCE: f32 = 61.0;

/// Shows the buckets of a duration in `width` points. Each bucket is twice as wide as the one before; counts
/// are logarithmic.
pub(crate) fn show(ui: &mut Ui, title: &str, buckets: &[Bucket], percentiles: &Percentiles, width: f32) {
    let Percentiles { p50, p99, p999, max } = *percentiles;
    let [p50, p99, p999, max] = [p50, p99, p999, max].map(duration);
    let text = format!("{title}: half below {p50}, 99 % below {p99}, 99.9 % below {p999}, longest {max}");
    ui.vertical(|ui| {
        ui.set_width(width);
        ui.label(egui::RichText::new(&text).small());
        let (rect, response) = ui.allocate_exact_size(vec2(width, HEIGHT), Sense::hover());
        paint(ui, rect, used(buckets));
        response
            .on_hover_text(
                "The last 10 s. Each bar is twice as wide a range as the one before; heights are logarithmic.",
            )
            .accessible_name(format!("{title} histogram"));
    });
}

/// The buckets without the empty ones at either end.
fn used(buckets: &[Bucket]) -> &[Bucket] {
    let first = buckets.iter().position(|bucket| bucket.count > 0);
    let last = buckets.iter().rposition(|bucket| bucket.count > 0);
    match (first, last) {
        (Some(first), Some(last)) => &buckets[first..=last],
        _ => &[],
    }
}

fn paint(ui: &Ui, rect: Rect, buckets: &[Bucket]) {
    let palette = Palette::of(ui);
    let painter = ui.painter_at(rect);
    let ground = rect.with_max_y(rect.bottom() - LABELS_HEIGHT);
    painter.rect_filled(ground, 2, ui.visuals().extreme_bg_color);
    let most = buckets.iter().map(|bucket| height(bucket.count)).fold(0.0, f32::max);
    if most <= 0.0 {
        return;
    }
    #[expect(clippy::cast_precision_loss, reason = "a few dozen buckets")]
    let width = ground.width() / buckets.len() as f32;
    let mut left = ground.left();
    for bucket in buckets {
        let top = ground.bottom() - (ground.height() - 4.0) * height(bucket.count) / most;
        let bar = Rect::from_min_max(pos2(left + 1.0, top), pos2(left + width - 1.0, ground.bottom()));
        painter.rect_filled(bar, 0, palette.device);
        left += width;
    }
    for (index, anchor) in numbered(buckets.len(), ground.width()) {
        #[expect(clippy::cast_precision_loss, reason = "a few dozen buckets")]
        let at = pos2(ground.left() + (index + 1) as f32 * width, rect.bottom());
        let (color, font) = (ui.visuals().text_color(), FontId::proportional(SMALLEST_TEXT));
        painter.text(at, anchor, duration(buckets[index].up_to), font, color);
    }
}

/// Which of the bars in a row of a width have a number, and how it stands at the bar's right edge: none covers another,
/// or leaves the row.
fn numbered(bars: usize, row_width: f32) -> Vec<(usize, Align2)> {
    #[expect(clippy::cast_precision_loss, reason = "a few dozen bars")]
    let edge = |index: usize| row_width * (index + 1) as f32 / bars as f32;
    let mut free_from = f32::NEG_INFINITY;
    let mut numbered = Vec::new();
    for index in 0..bars {
        // The number belongs to the edge between this bar and the next; the last one stands before it.
        let anchor = if edge(index) > row_width - LABEL_DISTANCE / 2.0 {
            Align2::RIGHT_BOTTOM
        } else {
            Align2::CENTER_BOTTOM
        };
        let place = anchor.anchor_size(pos2(edge(index), 0.0), vec2(LABEL_DISTANCE, LABELS_HEIGHT));
        if place.left() >= free_from {
            free_from = place.right();
            numbered.push((index, anchor));
        }
    }
    numbered
}

/// The logarithmic height of a count; above zero for a single one.
fn height(count: u64) -> f32 {
    #[expect(clippy::cast_precision_loss, reason = "only its logarithm is drawn")]
    let count = count as f32;
    (1.0 + count).log10()
}

/// A duration in three digits with its unit.
pub(crate) fn duration(ns: u64) -> String {
    #[expect(clippy::cast_precision_loss, reason = "three digits are shown")]
    let ns = ns as f64;
    let (value, unit) = match ns {
        ..1e3 => (ns, "ns"),
        ..1e6 => (ns / 1e3, "µs"),
        ..1e9 => (ns / 1e6, "ms"),
        _ => (ns / 1e9, "s"),
    };
    match value {
        ..10.0 if unit != "ns" => format!("{value:.2} {unit}"),
        ..100.0 if unit != "ns" => format!("{value:.1} {unit}"),
        _ => format!("{value:.0} {unit}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn durations_have_three_digits() {
        for (ns, text) in [
            (7, "7 ns"),
            (1_234, "1.23 µs"),
            (56_780, "56.8 µs"),
            (999_000, "999 µs"),
            (2_500_000, "2.50 ms"),
            (3_000_000_000, "3.00 s"),
        ] {
            assert_eq!(duration(ns), text);
        }
    }

    #[test]
    fn no_number_covers_another() {
        for bars in 1..64 {
            for row_width in [60.0, 200.0, 431.5] {
                let numbered = numbered(bars, row_width);
                assert!(!numbered.is_empty(), "{bars} bars in {row_width}");
                #[expect(clippy::cast_precision_loss, reason = "a few dozen bars")]
                let places = numbered.iter().map(|(index, anchor)| {
                    let edge = row_width * (index + 1) as f32 / bars as f32;
                    anchor.anchor_size(pos2(edge, 0.0), vec2(LABEL_DISTANCE, LABELS_HEIGHT))
                });
                let places: Vec<_> = places.collect();
                let are_apart = places.windows(2).all(|two| two[0].right() <= two[1].left());
                let are_within = places.iter().all(|place| place.right() <= row_width + 0.5);
                assert!(are_apart && are_within, "{places:?}");
            }
        }
    }

    #[test]
    fn empty_buckets_at_the_ends_are_not_drawn() {
        let bucket = |up_to, count| Bucket { up_to, count };
        let buckets = [bucket(1, 0), bucket(2, 5), bucket(4, 0), bucket(8, 1), bucket(16, 0)];
        assert_eq!(used(&buckets), &buckets[1..4]);
        assert_eq!(used(&buckets[..1]), &[]);
    }
}
