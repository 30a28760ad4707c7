//! The perception test: two numbered places, the one that is felt filled, and at last the question.

use super::words::line;
use crate::theme::Palette;
use egui::{Align2, Button, Color32, FontId, Key, Rect, Stroke, StrokeKind, Ui, pos2, vec2};
use haptic_studies::session::Phase;

/// Side of a place, as a share of the smaller side of the window.
const SIDE: f32 = 0.38;

const OUTLINE: f32 = 3.0;

/// Shows the places of a trial in a phase; returns the answer, 1 or 2, if there is one.
pub(super) fn show(ui: &mut Ui, phase: Phase) -> Option<u8> {
    let palette = Palette::of(ui);
    let area = ui.max_rect();
    let unit = area.width().min(area.height() * 1.6);
    let side = SIDE * area.width().min(area.height());
    let text = match phase {
        Phase::Feel(1) => "Feel the first surface",
        Phase::Feel(_) => "Feel the second surface",
        Phase::Question => "Which surface had more friction?",
        _ => "The surface changes",
    };
    let is_asked = phase == Phase::Question;
    let title = pos2(area.center().x, area.top() + 0.1 * area.height());
    let ink = ui.visuals().strong_text_color();
    line(ui, text, title, unit * 0.05, ink);
    let mut answer = None;
    for (number, shift) in [(1, -0.75), (2, 0.75)] {
        let at = area.center() + vec2(shift * side, 0.06 * area.height());
        let place = Rect::from_center_size(at, vec2(side, side));
        let is_felt = phase == Phase::Feel(number);
        if is_asked {
            let button = ui.put(place, Button::new("").fill(Color32::TRANSPARENT));
            let button = button.accessible_name(format!("surface {number} had more friction"));
            answer = answer.or(button.clicked().then_some(number));
        }
        let (fill, stroke, ink) = match (is_felt, is_asked) {
            (true, _) => (palette.live, palette.live, palette.on_fill),
            (_, true) => (Color32::TRANSPARENT, palette.sliding, ink),
            _ => (Color32::TRANSPARENT, palette.stuck, ui.visuals().weak_text_color()),
        };
        let painter = ui.painter();
        painter.rect_filled(place, 12.0, fill);
        painter.rect_stroke(place, 12.0, Stroke::new(OUTLINE, stroke), StrokeKind::Inside);
        let font = FontId::proportional(side * 0.5);
        painter.text(place.center(), Align2::CENTER_CENTER, number.to_string(), font, ink);
    }
    if !is_asked {
        return None;
    }
    let hint = pos2(area.center().x, area.bottom() - 0.11 * area.height());
    let weak = ui.visuals().weak_text_color();
    let text = "1 or left arrow: the first.   2 or right arrow: the second.";
    line(ui, text, hint, unit * 0.028, weak);
    answer.or_else(|| answer_by_key(ui))
}

fn answer_by_key(ui: &Ui) -> Option<u8> {
    const KEYS: [(Key, u8); 4] = [
        (Key::Num1, 1),
        (Key::ArrowLeft, 1),
        (Key::Num2, 2),
        (Key::ArrowRight, 2),
    ];
    ui.input(|input| {
        let pressed = input.events.iter().find_map(|event| match event {
            egui::Event::Key {
                key,
                pressed: true,
                repeat: false,
                ..
            } => KEYS.iter().find(|(known, _)| known == key),
            _ => None,
        });
        pressed.map(|(_, answer)| *answer)
    })
}
