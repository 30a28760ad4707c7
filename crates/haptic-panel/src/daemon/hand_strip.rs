//! The hand on the fake rig of `--hand mouse`: its arm pulls the handle to where the pointer is dragged. The distance
//! by which the handle lags, and a bar, show the force.

use super::Daemon;
use crate::intent::Intent;
use crate::model::Model;
use crate::theme::Palette;
use egui::{Align, Label, Layout, Painter, Rect, RichText, Sense, Stroke, Ui, UiBuilder, pos2, vec2};
use std::time::Duration;

/// Largest target to either side, m.
const REACH_M: f64 = 0.06;

/// Distance of the marks, m.
const MARK_M: f64 = 0.01;

/// Height of the strip, and of the bar at its lower edge, points.
const HEIGHT: f32 = 44.0;
const BAR_HEIGHT: f32 = 10.0;

/// Time between two targets while the pointer rests: a few are lost before the arm lets go.
const AGAIN: Duration = Duration::from_millis(33);

/// Force at the end of the bar where the rig has no limit, N.
const DEFAULT_LIMIT_N: f64 = 20.0;

/// Places on the strip.
#[derive(Clone, Copy)]
struct Scale {
    middle: f32,
    points_per_m: f64,
}

impl Scale {
    fn of(strip: Rect) -> Self {
        Self {
            middle: strip.center().x,
            points_per_m: f64::from(strip.width()) / 2.0 / REACH_M,
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "points of a window")]
    fn x(self, position_m: f64) -> f32 {
        // What is beyond the strip stands at its end.
        self.middle + (position_m.clamp(-REACH_M, REACH_M) * self.points_per_m) as f32
    }

    fn position_m(self, x: f32) -> f64 {
        (f64::from(x - self.middle) / self.points_per_m).clamp(-REACH_M, REACH_M)
    }
}

/// Shows the strip. While it is held it says so again and again: without news the arm lets go.
pub(crate) fn show(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    let Model { daemon, tapes, view } = model;
    let (strip, response) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::drag());
    let held = response.is_pointer_button_down_on() && ui.is_enabled();
    let response = response.accessible_name("hand");
    let scale = Scale::of(strip);
    let at = response.interact_pointer_pos().filter(|_| held);
    let target_m = at.map(|at| scale.position_m(at.x));
    if let Some(target_m) = target_m {
        if view.hand.target_m.is_none() {
            view.hand.refusal = None;
        }
        intents.push(Intent::Hand { target_m });
        ui.ctx().request_repaint_after(AGAIN);
    } else {
        response.on_hover_text("Drag to move your hand; the handle lags by the force on it. Let go to let go.");
    }
    view.hand.target_m = target_m;
    let painter = ui.painter_at(strip);
    paint_ground(ui, &painter, strip, scale);
    let newest = tapes.newest();
    if let Some(sample) = newest {
        let has_block = daemon.mirror.has_block();
        let block_m = (has_block && sample.state.is_live()).then_some(sample.block_position_m);
        let y = strip.top() + (HEIGHT - BAR_HEIGHT) / 2.0;
        paint_positions(ui, &painter, y, scale, (block_m, sample.device_position_m, target_m));
        paint_force(ui, &painter, strip, sample.command_force_n, daemon);
    }
    let text = match (&view.hand.refusal, newest) {
        (Some(why), _) => format!("Refused: {why}"),
        // Without the "-0.0" that would flicker around rest.
        (None, Some(sample)) => format!(
            "Force on the hand {:.1} N{}{}",
            (10.0 * sample.command_force_n).round() / 10.0 + 0.0,
            beyond(sample.device_position_m),
            if held { "" } else { "; drag here to pull the handle" }
        ),
        (None, None) => "Drag here to pull the handle".to_owned(),
    };
    let place = Rect::from_min_max(strip.min + vec2(4.0, 0.0), strip.max - vec2(0.0, BAR_HEIGHT));
    let layout = Layout::left_to_right(Align::Max);
    let mut corner = ui.new_child(UiBuilder::new().max_rect(place).layout(layout));
    corner.add(Label::new(RichText::new(text).small()).truncate());
}

/// Where the handle is, if that is beyond the strip, at whose end it is drawn.
fn beyond(handle_m: f64) -> String {
    if handle_m.abs() <= REACH_M {
        return String::new();
    }
    format!("; the handle is at {:.0} mm, beyond this strip", 1e3 * handle_m)
}

/// The ground, a mark for each centimetre, and a longer one in the middle.
fn paint_ground(ui: &Ui, painter: &Painter, strip: Rect, scale: Scale) {
    painter.rect_filled(strip, 2, ui.visuals().extreme_bg_color);
    let stroke = Stroke::new(1.0, ui.visuals().weak_text_color());
    for mark in -5..=5_i8 {
        let length = if mark == 0 { 14.0 } else { 6.0 };
        let x = scale.x(f64::from(mark) * MARK_M);
        painter.vline(x, strip.top()..=strip.top() + length, stroke);
    }
}

/// The block, the handle, and where the hand reaches to.
fn paint_positions(
    ui: &Ui,
    painter: &Painter,
    y: f32,
    scale: Scale,
    (block_m, handle_m, target_m): (Option<f64>, f64, Option<f64>),
) {
    let palette = Palette::of(ui);
    if let Some(block_m) = block_m {
        let block = Rect::from_center_size(pos2(scale.x(block_m), y), vec2(28.0, 14.0));
        painter.rect_filled(block, 2, palette.block);
    }
    let handle = pos2(scale.x(handle_m), y);
    painter.rect_filled(Rect::from_center_size(handle, vec2(8.0, 26.0)), 2, palette.device);
    if let Some(target_m) = target_m {
        let ink = Stroke::new(2.0, ui.visuals().strong_text_color());
        let target = pos2(scale.x(target_m), y);
        painter.line_segment([handle, target], ink);
        painter.circle_stroke(target, 7.0, ink);
    }
}

/// The force on the hand, from the middle of the strip to its ends at the limit.
fn paint_force(ui: &Ui, painter: &Painter, strip: Rect, force_n: f64, daemon: &Daemon) {
    let limit_n = daemon.force_limit_n();
    let limit_n = if limit_n.is_finite() { limit_n } else { DEFAULT_LIMIT_N };
    #[expect(clippy::cast_possible_truncation, reason = "points of a window")]
    let length = ((force_n / limit_n).clamp(-1.0, 1.0) * f64::from(strip.width()) / 2.0) as f32;
    let (x, top) = (strip.center().x, strip.bottom() - BAR_HEIGHT);
    let bar = Rect::from_two_pos(pos2(x, top), pos2(x + length, strip.bottom()));
    painter.rect_filled(bar, 0, Palette::of(ui).device);
}
