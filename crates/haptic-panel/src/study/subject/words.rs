//! Words to the subject: instructions, a break, thanks; with the progress below.

use crate::theme::Palette;
use egui::{Align, Align2, Color32, FontId, Label, Layout, Pos2, Rect, RichText, Ui, UiBuilder, pos2, vec2};
use haptic_studies::session::{Instruction, Phase, View};

/// Height of the bar of progress, points.
const BAR: f32 = 8.0;

/// Width of a text, as a share of the window's.
const WIDTH: f32 = 0.8;

/// What the subject reads.
#[derive(Debug, PartialEq, Eq)]
pub(super) struct Words {
    title: &'static str,
    text: String,
    /// What the subject can do now; empty where there is nothing.
    prompt: &'static str,
}

/// While no subject is at work.
pub(super) const NOBODY: Words = Words {
    title: "Please wait",
    text: String::new(),
    prompt: "",
};

const GO_ON: &str = "Click, or press Enter, to continue";

pub(super) fn of(view: &View, is_targets: bool) -> Words {
    let words = |title, text: &str, prompt| Words {
        title,
        text: text.to_owned(),
        prompt,
    };
    let task = if is_targets {
        "Move the cursor into the green target with the handle, and click: by the mouse, by Enter or by the button. The whole \
         cursor must be inside. Be as quick as you can without missing."
    } else {
        "You feel two surfaces, one after the other. Move the handle to and fro, and then say which had more friction. If you \
         cannot tell, guess."
    };
    match view.phase {
        Phase::Instruction(Instruction::Practice) => words("Practice", task, GO_ON),
        Phase::Instruction(Instruction::Trials) => words("Now it counts", task, GO_ON),
        Phase::Rest {
            remaining_s: remaining_s @ 1..,
        } => Words {
            title: "Have a rest",
            text: format!("Let go of the handle for a while: {remaining_s} s"),
            prompt: "Click, or press Enter, to continue earlier",
        },
        Phase::Rest { .. } => words("Have a rest", "Continue whenever you are ready.", GO_ON),
        Phase::GetReady => words("Get ready", "Take the handle.", ""),
        Phase::Mounting => words("Please wait", "Let go of the handle. It is being changed.", ""),
        Phase::Done => words("Thank you", "That was all.", ""),
        _ => NOBODY,
    }
}

/// Shows words, with the progress below.
pub(super) fn show(ui: &mut Ui, words: &Words, view: Option<&View>) {
    let palette = Palette::of(ui);
    let area = ui.max_rect();
    // Letters that can be read at two metres, in any shape of window.
    let unit = area.width().min(area.height() * 1.6);
    let at = |share: f32| pos2(area.center().x, area.top() + share * area.height());
    let strong = ui.visuals().strong_text_color();
    line(ui, words.title, at(0.17), unit * 0.07, strong);
    line(ui, &words.text, at(0.36), unit * 0.036, strong);
    line(ui, words.prompt, at(0.72), unit * 0.036, palette.sliding);
    let Some(View {
        done,
        of: Some(all @ 1..),
        ..
    }) = view
    else {
        return;
    };
    #[expect(clippy::cast_precision_loss, reason = "a share is drawn")]
    let share = (*done as f32 / *all as f32).min(1.0);
    let rail = Rect::from_center_size(at(0.9), vec2(0.5 * area.width(), BAR));
    let filled = Rect::from_min_size(rail.min, vec2(share * rail.width(), BAR));
    let painter = ui.painter();
    painter.rect_filled(rail, BAR / 2.0, palette.rest.gamma_multiply(0.5));
    painter.rect_filled(filled, BAR / 2.0, palette.sliding);
    let text = format!("{done} of {all}");
    let below = rail.center_bottom() + vec2(0.0, 0.02 * area.height());
    let font = FontId::proportional(unit * 0.02);
    painter.text(below, Align2::CENTER_TOP, text, font, ui.visuals().weak_text_color());
}

/// A text below a place, in as many lines as it needs.
pub(super) fn line(ui: &mut Ui, text: &str, at: Pos2, size: f32, color: Color32) {
    if text.is_empty() {
        return;
    }
    let area = ui.max_rect();
    let place = Rect::from_center_size(at, vec2(WIDTH * area.width(), 0.0));
    let layout = Layout::top_down(Align::Center);
    ui.scope_builder(UiBuilder::new().max_rect(place).layout(layout), |ui| {
        ui.add(Label::new(RichText::new(text).size(size).color(color)).wrap());
    });
}
