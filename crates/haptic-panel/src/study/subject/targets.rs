//! The targeting task: the active target is filled, and the cursor moves with the handle.

use crate::study::SubjectFrame;
use crate::theme::Palette;
use egui::{Pos2, Rect, Stroke, StrokeKind, Ui, pos2, vec2};
use haptic_studies::session::{Feedback, Targets};

/// Height of the targets, as a share of the window's.
const TARGET_HEIGHT: f32 = 0.56;

/// Distance from the outermost target to the window's edge, as a share of its width.
const MARGIN: f32 = 0.03;

/// Smallest radius of the cursor on the screen, points. The click goes by its true size.
const MIN_RADIUS: f32 = 3.0;

const OUTLINE: f32 = 2.0;
const MISS_OUTLINE: f32 = 8.0;

/// The scale of the task on a window, and its middle.
struct Scale {
    middle: Pos2,
    points_per_m: f32,
}

impl Scale {
    fn new(area: Rect, reach_m: f64) -> Self {
        #[expect(clippy::cast_possible_truncation, reason = "it is drawn")]
        let reach_m = reach_m.max(1e-6) as f32;
        Self {
            middle: area.center(),
            points_per_m: area.width() * (0.5 - MARGIN) / reach_m,
        }
    }

    #[expect(clippy::cast_possible_truncation, reason = "it is drawn")]
    fn x(&self, task_m: f64) -> f32 {
        self.middle.x + self.length(task_m as f32)
    }

    fn task_m(&self, x: f32) -> f64 {
        ((x - self.middle.x) / self.points_per_m).into()
    }

    fn length(&self, task_m: f32) -> f32 {
        task_m * self.points_per_m
    }
}

/// Position in the task, m, of a place in the window; beyond the outermost target it is that one's.
pub(super) fn task_m(area: Rect, reach_m: f64, at: Pos2) -> f64 {
    Scale::new(area, reach_m).task_m(at.x).clamp(-reach_m, reach_m)
}

/// Draws the targets, and the cursor over them.
pub(super) fn show(ui: &mut Ui, targets: &Targets, frame: &SubjectFrame, feedback: Option<Feedback>) {
    let palette = Palette::of(ui);
    let area = ui.max_rect();
    let scale = Scale::new(area, frame.reach_m);
    let painter = ui.painter();
    #[expect(clippy::cast_possible_truncation, reason = "it is drawn")]
    let size = vec2(scale.length(targets.width_m as f32), TARGET_HEIGHT * area.height());
    let around = |center_m| Rect::from_center_size(pos2(scale.x(center_m), area.center().y), size);
    let (active, other) = (around(targets.active_m), around(targets.other_m));
    painter.rect_stroke(other, 2.0, Stroke::new(OUTLINE, palette.stuck), StrokeKind::Inside);
    painter.rect_filled(active, 2.0, palette.sliding);
    if feedback == Some(Feedback::Missed) {
        let stroke = Stroke::new(MISS_OUTLINE, palette.halt);
        painter.rect_stroke(active, 2.0, stroke, StrokeKind::Outside);
    }
    let Some(cursor_m) = frame.cursor_m else { return };
    #[expect(clippy::cast_possible_truncation, reason = "it is drawn")]
    let radius = (scale.length(targets.cursor_diameter_m as f32) / 2.0).max(MIN_RADIUS);
    let at = pos2(scale.x(cursor_m), area.center().y);
    let (ink, ground) = (ui.visuals().strong_text_color(), crate::theme::ground(ui.visuals()));
    // A line above and below it is found at a glance, and covers neither target's edge at its height.
    let reach = TARGET_HEIGHT * area.height() / 2.0;
    for side in [-1.0, 1.0] {
        let ends = [at + vec2(0.0, side * reach * 1.04), at + vec2(0.0, side * reach * 1.2)];
        painter.line_segment(ends, Stroke::new(OUTLINE, ink));
    }
    painter.circle(at, radius, ink, Stroke::new(OUTLINE / 2.0, ground));
}
