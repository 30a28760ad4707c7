//! The help in the window: keys, what a plot shows, and the sign of force. It lies over the page, and never over Stop.

use egui::style::ScrollStyle;
use egui::{Align2, Event, Grid, Key, Label, Modifiers, Rect, RichText, ScrollArea, Ui, Window, vec2};

/// Width of the text beside a name, points.
const TEXT_WIDTH: f32 = 640.0;

/// Distance of the window from the edges of the page, points.
const MARGIN: f32 = 12.0;

/// Height of the window's title and frame, points.
const FRAME_HEIGHT: f32 = 60.0;

/// Height of a row of one line, points.
const ROW_HEIGHT: f32 = 18.0;

const KEYS: [(&str, &str); 10] = [
    ("Escape", "Stop, always"),
    ("Space", "Stop, unless you type in a text field"),
    ("F1, ?", "open and close this help"),
    ("Ctrl+1 to Ctrl+6", "turn to a page"),
    ("Ctrl+Z, Ctrl+Shift+Z", "undo, redo"),
    (
        "Tab; Enter",
        "go to the next control; press it, choose, or set what is typed",
    ),
    (
        "Arrow keys",
        "move a slider by a hundredth of its length, with Shift by a thousandth",
    ),
    ("M", "mark this moment in the recording"),
    ("N", "take a note on this moment, set by Enter, dropped if left empty"),
    ("Ctrl and plus, minus, 0", "scale the panel"),
];

const BUTTONS: [(&str, &str); 2] = [
    (
        "Reset",
        "after a stop or a fault; the force stays off until Engage, which is grey before",
    ),
    (
        "Keep A, Keep B; A/B",
        "keep the active scene as A or as B; change to the other one",
    ),
];

const PLOTS: [(&str, &str); 11] = [
    (
        "Force",
        "the force on the hand, as commanded after ramps and limits. Signals above the plot adds others, as the \
         coupling force, which drives the block",
    ),
    ("Fs, Fd", "dashed: static and dynamic friction of the scene"),
    (
        "Position, velocity",
        "of the device, which is the handle, and of the block that it pulls by the coupling",
    ),
    (
        "Ribbon",
        "grey while the block sticks, green while it slides; a flag above it is a change, a mark or a fault",
    ),
    ("Contact", "whether the block sticks or slides now"),
    (
        "Force against velocity",
        "what drives the block over the block's velocity, for the last second, on the law's curve",
    ),
    (
        "Spectrum",
        "which frequencies the signals in sight have, or those between the cursors",
    ),
    (
        "Strip below",
        "drag there to be the hand of a fake rig: a circle where you pull to, the blue handle, the orange block. The \
         bar at its foot is the force on the hand, as long as a half at the limit",
    ),
    (
        "Two axes",
        "x is solid and y dashed, or Lengths in the menu Signals; the page Plane shows hand, block and force as vectors",
    ),
    (
        "Pointer",
        "the wheel zooms in time, a drag moves; Run follows the rig again",
    ),
    ("Grey numbers", "are not of now: nobody knows what the rig does"),
];

const SIGN: [(&str, &str); 3] = [
    (
        "Force on the hand",
        "above zero it pushes the handle the way in which its position grows",
    ),
    (
        "Friction",
        "resists: while the position grows, the force on the hand is below zero",
    ),
    (
        "Coupling force",
        "acts on the block, and has the opposite sign: above zero it drives the block that way",
    ),
];

/// Opens and closes the help. In a text field a question mark is typed.
pub(crate) fn take_keys(ui: &Ui, is_shown: &mut bool) {
    let is_typing = ui.ctx().text_edit_focused();
    let is_pressed = ui.input_mut(|input| {
        let typed = input
            .events
            .iter()
            .position(|event| *event == Event::Text("?".to_owned()));
        let typed = typed.filter(|_| !is_typing).map(|place| input.events.remove(place));
        input.consume_key(Modifiers::NONE, Key::F1) || typed.is_some()
    });
    *is_shown ^= is_pressed;
}

/// Shows the help within the area of the page.
pub(crate) fn show(ui: &Ui, page: Rect, is_shown: &mut bool) {
    Window::new("Help")
        .open(is_shown)
        .collapsible(false)
        .auto_sized()
        .pivot(Align2::CENTER_TOP)
        .default_pos(page.center_top() + vec2(0.0, MARGIN))
        .constrain_to(page)
        .show(ui.ctx(), |ui| {
            ui.spacing_mut().scroll = ScrollStyle::solid();
            let height = page.height() - FRAME_HEIGHT - 2.0 * MARGIN;
            ScrollArea::vertical().max_height(height).show(ui, |ui| {
                for (title, rows) in [
                    ("Keys", &KEYS[..]),
                    ("The sign of force", &SIGN[..]),
                    ("What a plot shows", &PLOTS[..]),
                    ("Buttons", &BUTTONS[..]),
                ] {
                    show_part(ui, title, rows);
                }
            });
        });
}

fn show_part(ui: &mut Ui, title: &str, rows: &[(&str, &str)]) {
    ui.label(RichText::new(title).size(16.0).strong());
    let grid = Grid::new(title).num_columns(2).min_row_height(ROW_HEIGHT);
    grid.show(ui, |ui| {
        for (name, text) in rows {
            ui.label(RichText::new(*name).strong());
            ui.scope(|ui| {
                ui.set_width(TEXT_WIDTH);
                ui.add(Label::new(*text).wrap());
            });
            ui.end_row();
        }
    });
    ui.add_space(6.0);
}
