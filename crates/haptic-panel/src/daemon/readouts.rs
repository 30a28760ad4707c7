//! Large numbers that can be read from across the table.

use super::{Daemon, Staleness};
use crate::tape::Tape;
use crate::tape::plane::Component;
use crate::tape::signal::MM_PER_M;
use crate::tapes::Tapes;
use crate::theme::{Palette, SMALLEST_TEXT};
use crate::words::fixed;
use egui::{Color32, Label, RichText, Ui};
use haptic_ipc::Sample;

/// Size of the largest numbers, points.
const MAX_TEXT: f32 = 28.0;

/// Width of the longest number with its unit, as a multiple of its height.
const DIGITS: f32 = 5.0;

/// The same of two numbers.
const DIGITS_OF_TWO: f32 = 8.0;

/// Height of a unit, as a share of the height of its number.
const UNIT_SHARE: f32 = 0.57;

/// Ticks of this time on one sample of the device: it is silent, s.
const SILENCE_S: f64 = 0.2;

/// Shows the newest sample in large type, and dashes without one. Numbers that are not of now are grey, and named so.
pub(crate) fn show(ui: &mut Ui, daemon: &Daemon, tapes: &Tapes) {
    let palette = Palette::of(ui);
    let sample = tapes.last();
    // A daemon that has just come has yet to send one.
    let is_old = tapes.newest().is_none();
    let gone = daemon.staleness().or(is_old.then_some(Staleness::Gone));
    let staleness = gone.or_else(|| is_device_silent(tapes.live()).then_some(Staleness::DeviceSilent));
    let staleness = staleness.filter(|_| sample.is_some());
    let value = |of: fn(&Sample) -> f64| sample.map_or_else(|| "–".to_owned(), |sample| short(of(sample), 2));
    let on_plane = |component| tapes.live().component(component).and_then(Tape::last);
    let y = on_plane(Component::Y);
    let place = |of: fn(&Sample) -> f64| match sample.zip(y) {
        Some((x, y)) => format!("{}, {}", short(of(x), 1), short(of(y), 1)),
        None => value(of),
    };
    // Without force there is no surface to touch.
    let (contact, contact_color) = match sample
        .filter(|sample| sample.state.is_live())
        .map(|sample| sample.contact)
    {
        None => ("–", None),
        Some(0) => ("Stuck", None),
        Some(_) if y.is_some() => ("Sliding", Some(palette.sliding)),
        Some(1..) => ("Sliding +", Some(palette.sliding)),
        Some(..0) => ("Sliding -", Some(palette.sliding)),
    };
    // On a plane the length of the force.
    let force = on_plane(Component::Length).or(sample);
    let force = force.map_or_else(|| "–".to_owned(), |sample| short(sample.command_force_n, 2));
    let device = place(|sample| sample.device_position_m * MM_PER_M);
    let has_block = daemon.mirror.has_block();
    let (block, block_unit) = if has_block {
        (place(|sample| sample.block_position_m * MM_PER_M), "mm")
    } else {
        ("none".to_owned(), "")
    };
    ui.columns_const(|[first, second, third, fourth]| {
        let show_one = |ui: &mut Ui, title: &str, value: &str, unit: &str, color: Option<Color32>| match staleness {
            None => show_one(ui, title, value, unit, color),
            Some(staleness) => {
                let title = match staleness {
                    Staleness::Gone => format!("{title}, last"),
                    Staleness::DeviceSilent => title.to_owned(),
                };
                let grey = ui.visuals().weak_text_color();
                show_one(ui, &title, value, unit, Some(grey));
            }
        };
        show_one(first, "Force on the hand", &force, "N", Some(palette.device));
        show_one(second, "Device position", &device, "mm", Some(palette.device));
        show_one(third, "Block position", &block, block_unit, Some(palette.block));
        show_one(fourth, "Contact", contact, "", contact_color);
    });
    ui.add_space(4.0);
}

/// Whether all ticks of a while have used the same sample of a device: each of its samples has another number. An
/// earlier daemon gives none.
fn is_device_silent(tape: &Tape) -> bool {
    let Some(last) = tape.last().filter(|last| last.device_sequence != 0) else {
        return false;
    };
    let before = tape.at(last.t_s - SILENCE_S);
    before.is_some_and(|before| before.device_sequence == last.device_sequence && before.t_s < last.t_s)
}

fn show_one(ui: &mut Ui, title: &str, value: &str, unit: &str, color: Option<Color32>) {
    ui.spacing_mut().item_spacing = egui::vec2(4.0, 0.0);
    // In a narrow window the numbers are smaller, so that they do not overlap.
    let digits = if value.contains(',') { DIGITS_OF_TWO } else { DIGITS };
    let size = (ui.available_width() / digits).clamp(SMALLEST_TEXT, MAX_TEXT);
    ui.add(Label::new(RichText::new(title).small()).truncate());
    let color = color.unwrap_or(ui.visuals().strong_text_color());
    ui.horizontal(|ui| {
        ui.label(RichText::new(value).size(size).color(color));
        let unit = RichText::new(unit).size((size * UNIT_SHARE).max(SMALLEST_TEXT)).weak();
        ui.add(Label::new(unit).truncate());
    });
}

/// A number of decimals, short enough for its place.
fn short(value: f64, decimals: usize) -> String {
    let text = fixed(value, decimals);
    if text.len() > 9 { format!("{value:.2e}") } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn readouts_keep_their_width() {
        for (value, text) in [(-0.001, "0.00"), (-12.345, "-12.35"), (1e300, "1.00e300")] {
            assert_eq!(short(value, 2), text);
        }
        assert_eq!(
            (short(-0.04, 1), short(-0.06, 1)),
            ("0.0".to_owned(), "-0.1".to_owned())
        );
    }
}
