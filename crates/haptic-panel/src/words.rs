//! Names of parameters and checks in words, numbers, and a line of text.

use egui::text::LayoutJob;
use egui::{Align, Color32, Label, Layout, Response, RichText, TextStyle, Ui, Vec2};

/// A line that is shortened where it does not fit, with the whole text as its one hint.
pub(crate) fn shortened(ui: &mut Ui, line: impl Into<RichText>, whole: &str) {
    // The label's own hint would be a second one.
    let label = Label::new(line.into()).truncate().show_tooltip_when_elided(false);
    ui.add(label).on_hover_text(whole);
}

/// A cell of a row: it keeps its size, so that nothing moves as its text changes.
pub(crate) fn cell(ui: &mut Ui, size: Vec2, text: RichText) -> Response {
    let cell = ui.allocate_ui_with_layout(size, Layout::left_to_right(Align::Center), |ui| {
        ui.set_min_size(size);
        ui.add(Label::new(text).truncate())
    });
    cell.inner
}

/// Small text of at most two lines, with the whole text as its hint.
pub(crate) fn in_two_lines(ui: &mut Ui, text: &str, color: Color32) {
    let font = TextStyle::Small.resolve(ui.style());
    let mut job = LayoutJob::simple(text.to_owned(), font, color, ui.available_width());
    job.wrap.max_rows = 2;
    let lines = ui.painter().layout_job(job);
    ui.add(Label::new(lines)).on_hover_text(text);
}

/// A name with spaces: `static_force` becomes `static force`.
pub(crate) fn spoken(name: &str) -> String {
    name.replace('_', " ")
}

/// Whether a scene of the library has this title: its name there is that of a file.
pub(crate) fn is_name_of(name: &str, title: &str) -> bool {
    name.eq_ignore_ascii_case(&title.replace(' ', "-"))
}

/// What the value of a check is of, by its unit where that says it; empty for a check that this program
/// does not know.
pub(crate) fn subject(check: &str, unit: &str) -> &'static str {
    use haptic_core::adviser::Check;
    if check == Check::LinearStability.name() && unit == "N s/m" {
        return "damping";
    }
    let subjects = [
        (Check::LimitCycle, "speed of the block"),
        (Check::LeastMass, "mass"),
        (Check::Ripple, "force"),
        (Check::Passivity, "the rig's damping"),
        (Check::LinearStability, "stiffness"),
        (Check::Friction, "stiffness"),
        (Check::Encoder, "stiffness"),
        (Check::FrictionPassivity, "drag"),
    ];
    let found = subjects.iter().find(|(known, _)| known.name() == check);
    found.map_or("", |(_, subject)| subject)
}

/// A name as the beginning of a line: `static_force` becomes `Static force`.
pub(crate) fn sentence_case(name: &str) -> String {
    let name = spoken(name);
    let mut letters = name.chars();
    letters
        .next()
        .map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// A number with `digits` significant digits, without an exponent.
pub(crate) fn significant(value: f64, digits: usize) -> String {
    let decimals = decimals(value, digits);
    let text = format!("{value:.decimals$}");
    if is_zero(&text) { "0".to_owned() } else { text }
}

/// Decimals with which a number has so many digits.
pub(crate) fn decimals(value: f64, digits: usize) -> usize {
    let digits = i32::try_from(digits).unwrap_or(i32::MAX);
    #[expect(clippy::cast_possible_truncation, reason = "the exponent of a number is below 309")]
    let magnitude = if value == 0.0 {
        0
    } else {
        value.abs().log10().floor() as i32
    };
    usize::try_from((digits - 1 - magnitude).clamp(0, 9)).unwrap_or(0)
}

/// A number of decimals, without the sign of "-0.00", which would flicker around rest.
pub(crate) fn fixed(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    match text.strip_prefix('-') {
        Some(zero) if is_zero(zero) => zero.to_owned(),
        _ => text,
    }
}

fn is_zero(text: &str) -> bool {
    text.trim_start_matches(['-', '0', '.']).is_empty()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_has_the_digits_that_it_is_given() {
        for (value, text) in [
            (1.23456, "1.23"),
            (-0.012_345, "-0.0123"),
            (12_345.6, "12346"),
            (0.0, "0"),
            (-1e-12, "0"),
            (100.0, "100"),
        ] {
            assert_eq!(significant(value, 3), text);
        }
    }
}
