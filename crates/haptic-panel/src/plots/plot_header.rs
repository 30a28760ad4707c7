//! The row above a plot: the names of its lines, and the menu that chooses its signals.

use super::axis::AXIS_WIDTH;
use super::legend::{self, Entry};
use super::picture;
use crate::plots::scope::plot_list::PlotList;
use crate::tape::signal::{Quantity, Signal};
use egui::containers::menu::{MenuButton, MenuConfig};
use egui::{Align, Layout, PopupCloseBehavior, RichText, Sense, Ui, UiBuilder, vec2};

/// Width of the menu's button, points.
const BUTTON_WIDTH: f32 = 56.0;

/// What a press in a menu asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Change {
    Toggle(Signal),
    Lengths,
    Raise,
    Lower,
    Remove,
}

/// Shows the row, `width` points wide, of a rig of one axis or of two. Returns the change that was asked for.
pub(super) fn show(
    ui: &mut Ui,
    width: f32,
    (plots, is_plane): (&PlotList, bool),
    place: usize,
    entries: &[Entry],
) -> Option<Change> {
    let size = vec2(width, legend::HEIGHT);
    let layout = Layout::left_to_right(Align::Center);
    let row = ui.allocate_ui_with_layout(size, layout, |ui| {
        ui.set_min_size(size);
        ui.add_space(AXIS_WIDTH);
        let button = BUTTON_WIDTH + ui.spacing().item_spacing.x;
        let names = vec2((ui.available_width() - button).max(0.0), legend::HEIGHT);
        // Names that do not fit must not make the plot wider.
        let (area, _) = ui.allocate_exact_size(names, Sense::hover());
        let mut within = ui.new_child(UiBuilder::new().max_rect(area).layout(layout));
        within.shrink_clip_rect(area);
        legend::show(&mut within, entries);
        picture::hide_controls(ui);
        show_menu(ui, plots, place, is_plane)
    });
    row.inner
}

fn show_menu(ui: &mut Ui, plots: &PlotList, place: usize, is_plane: bool) -> Option<Change> {
    let name = plots.name(place);
    let config = MenuConfig::new().close_behavior(PopupCloseBehavior::CloseOnClickOutside);
    ui.spacing_mut().button_padding.y = 0.0;
    ui.spacing_mut().interact_size.y = legend::HEIGHT;
    let menu = MenuButton::new(RichText::new("Signals").small()).config(config);
    let (button, content) = menu.ui(ui, |ui| {
        let mut change = None;
        let shown = plots.plots()[place].signals();
        for quantity in Quantity::ALL {
            ui.horizontal(|ui| {
                for signal in quantity.signals() {
                    let mut is_shown = shown.contains(&signal);
                    let about = format!("{} ({})", signal.definition(), quantity.unit());
                    let toggle = ui.checkbox(&mut is_shown, signal.name()).on_hover_text(about);
                    if toggle.changed() {
                        change = Some(Change::Toggle(signal));
                    }
                }
            });
        }
        ui.separator();
        if is_plane {
            let mut as_length = plots.plots()[place].shows_lengths;
            let toggle = ui.checkbox(&mut as_length, "Lengths");
            let hint = "Of forces, velocities and the deflection the length of the vector instead of x and y";
            if toggle.on_hover_text(hint).changed() {
                change = Some(Change::Lengths);
            }
            ui.separator();
        }
        ui.horizontal(|ui| {
            let lowest = plots.plots().len() - 1;
            for (text, what, is_possible) in [
                ("Move up", Change::Raise, place > 0),
                ("Move down", Change::Lower, place < lowest),
                ("Remove plot", Change::Remove, true),
            ] {
                let button = ui.add_enabled(is_possible, egui::Button::new(text));
                if button.clicked() {
                    change = Some(what);
                    ui.close();
                }
            }
        });
        change
    });
    button
        .on_hover_text("Chooses what this plot shows, and its place")
        .accessible_name(format!("signals of the {name} plot"));
    content.and_then(|content| content.inner)
}

pub(super) fn carry_out(plots: &mut PlotList, place: usize, change: Change) {
    match change {
        Change::Toggle(signal) => plots.plots_mut()[place].toggle(signal),
        Change::Lengths => plots.plots_mut()[place].shows_lengths ^= true,
        Change::Raise => plots.raise(place),
        Change::Lower => plots.raise(place + 1),
        Change::Remove => plots.remove(place),
    }
}
