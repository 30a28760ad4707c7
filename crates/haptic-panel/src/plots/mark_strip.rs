//! The strip above the plots that shows what happened meanwhile: one flag a moment, whose text a pointer or
//! a press shows.

use super::axis::AXIS_WIDTH;
use super::scope::TimeRange;
use crate::tape::Tape;
use crate::tape::mark::{MarkKind, TapeMark};
use crate::theme::Palette;
use egui::{Popup, Pos2, Rect, Sense, Shape, Ui, pos2, vec2};
use egui_plot::PlotTransform;

/// Height of the strip, points.
pub(crate) const HEIGHT: f32 = 12.0;

/// Distance from the first moment of a flag to the last one, points: closer flags would cover one another.
const APART: f32 = 10.0;

/// Most texts that a flag shows.
const MAX_TEXTS: usize = 12;

/// Moments that share a flag.
#[derive(Debug)]
struct Flag<'a> {
    /// Of the first one, points from the left of the screen.
    x: f32,
    marks: Vec<&'a TapeMark>,
}

impl Flag<'_> {
    /// What kind it is drawn as: the one that matters most.
    fn kind(&self) -> MarkKind {
        let is_of = |kind: &MarkKind| self.marks.iter().any(|mark| mark.kind == *kind);
        let kinds = [MarkKind::Trouble, MarkKind::Marker, MarkKind::State];
        kinds.into_iter().find(is_of).unwrap_or(MarkKind::Scene)
    }

    fn text(&self, separator: &str) -> String {
        let texts = self.marks.iter().take(MAX_TEXTS);
        let mut texts: Vec<_> = texts.map(|mark| format!("{}: {mark}", mark.kind.name())).collect();
        if let Some(more) = self.marks.len().checked_sub(MAX_TEXTS).filter(|more| *more > 0) {
            texts.push(format!("and {more} more: zoom in"));
        }
        texts.join(separator)
    }
}

/// The flags of moments in the order of time, each with its place on the screen.
fn flags<'a>(moments: impl Iterator<Item = (f32, &'a TapeMark)>) -> Vec<Flag<'a>> {
    let mut flags: Vec<Flag<'_>> = Vec::new();
    for (x, mark) in moments {
        match flags.last_mut().filter(|flag| x - flag.x < APART) {
            Some(flag) => flag.marks.push(mark),
            None => flags.push(Flag { x, marks: vec![mark] }),
        }
    }
    flags
}

/// Makes room for the strip above the plots.
pub(crate) fn allocate(ui: &mut Ui) -> Rect {
    let (strip, _) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::hover());
    strip.with_min_x(strip.left() + AXIS_WIDTH)
}

/// Shows the flags in `strip`, on the time axis of the plots below it.
pub(crate) fn show(ui: &mut Ui, strip: Rect, transform: &PlotTransform, tape: &Tape, seen: &TimeRange) {
    let palette = Palette::of(ui);
    let at = |t_s: f64| transform.position_from_point_x(t_s - seen.zero_s);
    let moments = tape.marks(seen.from_s, seen.to_s).map(|(t_s, mark)| (at(t_s), mark));
    for flag in flags(moments) {
        let top = pos2(flag.x, strip.top());
        let area = Rect::from_center_size(pos2(flag.x, strip.center().y), vec2(APART, HEIGHT));
        // A moment keeps its number while the plots run.
        let id = ui.scope_id().with(("mark", flag.marks.first().map(|mark| mark.tick)));
        let response = ui.interact(area, id, Sense::click());
        let response = response.accessible_name(flag.text(", ")).on_hover_text(flag.text("\n"));
        let color = flag.kind().color()(palette);
        ui.painter().add(pennant(top, color));
        Popup::from_toggle_button_response(&response).show(|ui| ui.label(flag.text("\n")));
    }
}

/// A triangle whose tip points at the moment.
fn pennant(top: Pos2, color: egui::Color32) -> Shape {
    let half = APART / 2.0 - 0.5;
    let points = vec![
        top + vec2(-half, 1.0),
        top + vec2(half, 1.0),
        top + vec2(0.0, HEIGHT - 1.0),
    ];
    Shape::convex_polygon(points, color, egui::Stroke::NONE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_that_are_close_share_a_flag_which_names_the_worst() {
        let mark = |kind, text: &str| TapeMark {
            tick: 0,
            kind,
            by: None,
            text: text.to_owned(),
        };
        let marks = [
            mark(MarkKind::Scene, "softer"),
            mark(MarkKind::Trouble, "late"),
            mark(MarkKind::State, "engaged"),
        ];
        let flags = flags([100.0, 105.0, 200.0].into_iter().zip(&marks));
        let drawn: Vec<_> = flags
            .iter()
            .map(|flag| (flag.x, flag.kind(), flag.text("; ")))
            .collect();
        let both = "Scene: softer; Trouble: late".to_owned();
        assert_eq!(
            drawn,
            [
                (100.0, MarkKind::Trouble, both),
                (200.0, MarkKind::State, "State: engaged".to_owned())
            ]
        );
        let many: Vec<_> = (0..20).map(|_| mark(MarkKind::Scene, "a drag")).collect();
        let flags = super::flags(many.iter().map(|mark| (0.0, mark)));
        assert!(flags[0].text("; ").ends_with("and 8 more: zoom in"));
    }
}
