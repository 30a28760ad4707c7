//! The bar below plots that stand still: the force of the whole tape, and the part of it that is seen.

use super::axis::AXIS_WIDTH;
use super::frame::{RIGHT_MARGIN, zoom};
use super::picture;
use super::scope::Scope;
use crate::tape::signal::Signal;
use crate::tapes::Tapes;
use crate::theme::Palette;
use egui::{Pos2, Rect, Sense, Stroke, StrokeKind, Ui, pos2, vec2};

/// Height of the bar with the distance above it, points.
pub(super) const HEIGHT: f32 = 36.0;

const INNER_HEIGHT: f32 = 30.0;

/// Narrowest width of the part that is seen, points: an hour shows five seconds as two points.
const NARROWEST: f32 = 4.0;

/// Shows the bar in the rest of the row.
pub(super) fn show(ui: &mut Ui, tapes: &Tapes, scope: &mut Scope) {
    let size = vec2(ui.available_width(), INNER_HEIGHT);
    let (row, _) = ui.allocate_exact_size(size, Sense::hover());
    picture::hide_controls(ui);
    let bar = Rect::from_min_max(row.min + vec2(AXIS_WIDTH, 0.0), row.max - vec2(RIGHT_MARGIN, 0.0));
    let response = ui
        .interact(bar, ui.scope_id().with("overview"), Sense::click_and_drag())
        .accessible_name("overview")
        .on_hover_text("The force on the hand over everything that is kept. A press or a drag moves, the wheel zooms.");
    let tape = scope.tape(tapes);
    let (Some(oldest_s), Some(newest_s)) = (tape.oldest_s(), tape.newest_s()) else {
        return;
    };
    let length_s = (newest_s - oldest_s).max(f64::MIN_POSITIVE);
    let per_point = length_s / f64::from(bar.width());
    #[expect(clippy::cast_possible_truncation, reason = "points of a window")]
    let x = |t_s: f64| bar.left() + ((t_s - oldest_s) / per_point) as f32;
    paint_tape(ui, tapes, scope, bar, (oldest_s, newest_s), x);
    let seen = scope.seen(tapes);
    let palette = Palette::of(ui);
    let (left, right) = (x(seen.from_s).max(bar.left()), x(seen.to_s).min(bar.right()));
    let middle = left.midpoint(right);
    let half = ((right - left) / 2.0).max(NARROWEST / 2.0);
    let window = Rect::from_min_max(pos2(middle - half, bar.top()), pos2(middle + half, bar.bottom()));
    let painter = ui.painter_at(bar.expand(1.0));
    painter.rect_filled(window, 0, palette.cursor.gamma_multiply(0.25));
    painter.rect_stroke(window, 0, Stroke::new(1.0, palette.cursor), StrokeKind::Inside);
    let time_at = |pos: Pos2| oldest_s + f64::from(pos.x - bar.left()) * per_point;
    if (response.clicked() || response.dragged())
        && let Some(pos) = response.interact_pointer_pos()
    {
        let middle_s = seen.from_s.midpoint(seen.to_s);
        scope.shift(time_at(pos) - middle_s, tapes);
    }
    if response.hovered()
        && let Some(factor) = zoom(ui)
    {
        scope.zoom(factor, seen.from_s.midpoint(seen.to_s) - seen.zero_s);
    }
}

/// The force over the whole tape, and where something happened.
fn paint_tape(ui: &Ui, tapes: &Tapes, scope: &Scope, bar: Rect, ends: (f64, f64), x: impl Fn(f64) -> f32) {
    let palette = Palette::of(ui);
    let painter = ui.painter_at(bar);
    painter.rect_filled(bar, 0, ui.visuals().extreme_bg_color);
    let tape = scope.tape(tapes);
    for (t_s, mark) in tape.marks(ends.0, ends.1) {
        let color = mark.kind.color()(palette).gamma_multiply(0.7);
        painter.vline(x(t_s), bar.y_range(), Stroke::new(1.0, color));
    }
    let column_s = (ends.1 - ends.0) / f64::from(bar.width() * ui.pixels_per_point());
    let line = tape
        .outlines(&[Signal::COMMAND_FORCE], ends, column_s.max(f64::MIN_POSITIVE))
        .remove(0);
    let greatest = line.iter().map(|[_, force]| force.abs()).fold(1.0, f64::max);
    let half = f64::from(bar.height()) / 2.0 - 2.0;
    #[expect(clippy::cast_possible_truncation, reason = "points of a window")]
    let point = |[t_s, force]: [f64; 2]| pos2(x(t_s), bar.center().y - (force / greatest * half) as f32);
    let points: Vec<Pos2> = line.into_iter().map(point).collect();
    painter.line(points, Stroke::new(1.0, palette.device));
}
