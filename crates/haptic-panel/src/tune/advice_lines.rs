//! The advice: a line below the parameter of each finding, and a table of all findings.

use super::edit::{EditBy, ParameterEdits};
use crate::daemon::Daemon;
use crate::daemon::advice::{Advised, Fix, Warning, four_digits};
use crate::theme::Palette;
use crate::words::{sentence_case, shortened, spoken, subject};
use egui::{
    Align, Align2, Atom, AtomExt, Button, Color32, Grid, Label, Layout, Rect, Response, RichText, Shape, Sides,
    TextStyle, Ui, Vec2, vec2,
};
use haptic_ipc::quantity::number;
use haptic_ipc::{Finding, ParameterDescription};
use std::f32::consts::FRAC_PI_2;

const ARROW_SIZE: f32 = 8.0;

/// Distance of the cells of the table, points.
const SPACING: Vec2 = vec2(8.0, 4.0);

/// What each column of the table has of its width.
const SHARES: [f32; 4] = [0.26, 0.3, 0.24, 0.2];

/// Shows the warnings on a parameter: one line, which opens to all of them.
pub(crate) fn show(ui: &mut Ui, about: &ParameterDescription, edits: &mut ParameterEdits, advised: &Advised) {
    let warnings = advised.warnings(about);
    let Some(first) = warnings.first() else {
        return;
    };
    let unit = &about.unit;
    let is_open = &mut edits.advice_is_open;
    let hint = first.fix.as_ref().map(|fix| fixes(&warnings, fix));
    let mut wanted = with_fix(ui, first.fix.as_ref(), hint, unit, |ui| {
        let color = Palette::of(ui).caution_text;
        show_title(ui, &title(&warnings), color, is_open);
    });
    // A single remark is its own title.
    if *is_open && (warnings.len() > 1 || first.finding.is_some()) {
        ui.indent("advice", |ui| {
            for (place, warning) in warnings.iter().enumerate() {
                // The title has the button of the first one.
                let fix = warning.fix.as_ref().filter(|_| place > 0);
                let pressed = with_fix(ui, fix, None, unit, |ui| {
                    ui.add(Label::new(RichText::new(warning.message).small()).wrap());
                });
                wanted = wanted.take().or(pressed);
            }
        });
    }
    if let Some(Fix { target, value }) = wanted {
        let edit = edits.edit(target.direction);
        edit.change(value, EditBy::Once);
        edit.typing = None;
    }
}

/// A single warning is named; several are counted.
fn title(warnings: &[Warning<'_>]) -> String {
    if let [warning] = warnings {
        return warning.finding.map_or_else(
            || warning.message.to_owned(),
            |finding| {
                let Finding { check, unit, .. } = finding;
                let [value, bound] = [finding.value, finding.bound].map(|value| limited(value, ""));
                let value = format!("{} {value}", subject(check, unit));
                format!("{}: {}, bound {bound} {unit}", sentence_case(check), value.trim_start())
            },
        );
    }
    let broken = warnings.iter().filter(|warning| warning.finding.is_some()).count();
    let counts = [(broken, "bound", " broken"), (warnings.len() - broken, "remark", "")];
    let counts = counts.into_iter().filter(|(count, ..)| *count > 0);
    let counts = counts.map(|(count, what, state)| {
        let plural = if count == 1 { "" } else { "s" };
        format!("{count} {what}{plural}{state}")
    });
    counts.collect::<Vec<_>>().join(", ")
}

/// A value or a bound in four digits; the wire omits it if it is not finite.
fn limited(value: Option<f64>, unit: &str) -> String {
    let number = |value| format!("{} {unit}", number(four_digits(value)));
    value.map_or_else(|| "∞".to_owned(), |value| number(value).trim_end().to_owned())
}

/// The line that opens and closes the rest. An open one wraps its text.
fn show_title(ui: &mut Ui, title: &str, color: Color32, is_open: &mut bool) {
    let turn = if *is_open { 0.0 } else { -FRAC_PI_2 };
    // Drawn, because the font has no arrow; beside the first line of the text.
    let size = vec2(ARROW_SIZE, ui.text_style_height(&TextStyle::Small));
    let arrow = Atom::paint(size, move |ui, args| {
        let square = Rect::from_center_size(args.rect.center(), Vec2::splat(ARROW_SIZE));
        ui.painter().add(Shape::rotated_triangle(square, turn, color));
    });
    let text = RichText::new(title).small().color(color);
    let button = Button::new((arrow.atom_align(Align2::CENTER_TOP), text)).frame_when_inactive(false);
    let button = if *is_open { button.wrap() } else { button.truncate() };
    // The arrow stands below the parameter's name.
    ui.spacing_mut().button_padding.x = 0.0;
    // Its frame keeps a distance from the text.
    let widgets = &mut ui.visuals_mut().widgets;
    for look in [&mut widgets.hovered, &mut widgets.active] {
        look.expansion = 3.0;
    }
    if ui.add(button).accessible_name(title).clicked() {
        *is_open = !*is_open;
    }
}

/// Draws `left` and the button of its fix beside it. Returns the fix if the button was pressed.
fn with_fix(
    ui: &mut Ui,
    fix: Option<&Fix>,
    hint: Option<String>,
    unit: &str,
    left: impl FnOnce(&mut Ui),
) -> Option<Fix> {
    let right = |ui: &mut Ui| {
        let fix = fix?;
        let value = format!("{} {unit}", number(fix.value));
        let name = format!("set {} to {value}", spoken(&fix.target.to_string()));
        let button = Button::new(RichText::new(format!("Set to {value}")).small()).small();
        let mut button = ui.add(button).accessible_name(name.trim_end());
        if let Some(hint) = hint {
            button = button.on_hover_text(hint);
        }
        button.clicked().then(|| fix.clone())
    };
    Sides::new().shrink_left().show(ui, left, right).1
}

/// The names of the checks that a change fixes: others may stay broken.
fn fixes(warnings: &[Warning<'_>], fix: &Fix) -> String {
    let fixed = warnings.iter().filter(|warning| {
        let other = warning.fix.as_ref();
        other.is_some_and(|other| other.target == fix.target)
    });
    let names = fixed.filter_map(|warning| Some(spoken(&warning.finding?.check)));
    format!("Fixes: {}", names.collect::<Vec<_>>().join(", "))
}

/// Shows how many bounds are broken, in a line that is always there, and opens to every check.
pub(crate) fn show_all(ui: &mut Ui, daemon: &Daemon, is_open: &mut bool) {
    let advised = &daemon.advised;
    let caution = Palette::of(ui).caution_text;
    let count = advised.checks().count();
    if count == 0 || advised.failure().is_some() {
        // What stands below does not move when the advice comes, or fails.
        let line = vec2(ui.available_width(), ui.spacing().interact_size.y);
        ui.allocate_ui_with_layout(line, Layout::left_to_right(Align::Center), |ui| {
            ui.set_min_size(line);
            if let Some(failure) = advised.failure() {
                let text = format!("No advice: {failure}");
                shortened(ui, RichText::new(&text).small().color(caution), &text);
            }
        });
        return;
    }
    let broken = advised.checks().filter(|(finding, _)| !finding.passes).count();
    let (title, color) = match (broken, count) {
        (0, 1) => ("Stability: the bound is kept".to_owned(), ui.visuals().text_color()),
        (0, _) => (format!("Stability: all {count} bounds kept"), ui.visuals().text_color()),
        _ => (format!("Stability: {broken} of {count} bounds broken"), caution),
    };
    ui.scope(|ui| show_title(ui, &title, color, is_open));
    if *is_open {
        show_table(ui, advised);
        if let Some(frequencies) = daemon.stick_slip() {
            let hint = "How often the block lets go of a hand that keeps its speed";
            let text = format!("Stick-slip: {frequencies}");
            ui.add(Label::new(RichText::new(text).small()).wrap())
                .on_hover_text(hint);
        }
    }
}

fn show_table(ui: &mut Ui, advised: &Advised) {
    let caution = Palette::of(ui).caution_text;
    let spaces = 3.0 * SPACING.x;
    let widths = SHARES.map(|share| (share * (ui.available_width() - spaces)).floor());
    Grid::new("checks")
        .striped(true)
        .spacing(SPACING)
        .min_row_height(16.0)
        .show(ui, |ui| {
            for (column, title) in ["Check", "Value", "Bound", "Margin"].into_iter().enumerate() {
                cell(ui, widths[column], RichText::new(title).weak());
            }
            ui.end_row();
            for (finding, message) in advised.checks() {
                let check = cell(ui, widths[0], RichText::new(sentence_case(&finding.check)));
                let margin = finding.margin.map(|margin| format!("{margin:.2}"));
                let margin = margin.unwrap_or_else(|| "∞".to_owned());
                let value = format!(
                    "{} {}",
                    subject(&finding.check, &finding.unit),
                    limited(finding.value, "")
                );
                cell(ui, widths[1], RichText::new(value.trim_start()));
                cell(ui, widths[2], RichText::new(limited(finding.bound, &finding.unit)));
                let margin = if finding.passes {
                    RichText::new(margin)
                } else {
                    RichText::new(format!("{margin} broken")).color(caution)
                };
                let margin = cell(ui, widths[3], margin);
                check.union(margin).on_hover_text(message);
                ui.end_row();
            }
        });
}

/// A cell of the table: a text that is too long wraps, so that the table stays as wide as its column of the page.
fn cell(ui: &mut Ui, width: f32, text: RichText) -> Response {
    let cell = ui.vertical(|ui| {
        ui.set_width(width);
        ui.add(Label::new(text.small()).wrap())
    });
    cell.inner
}
