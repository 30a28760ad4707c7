//! No control is in a picture of the plots: while the window's pixels are taken for a file, those between the plots
//! keep their places and are not drawn.

use egui::{Context, Id, Ui};

/// Frames without controls, with the one that asks for the pixels: they are those of the next, or of the one after it.
const FRAMES: u8 = 3;

fn key() -> Id {
    Id::unique("frames without controls")
}

/// Leaves the controls out of the next frames.
pub(crate) fn begin(ctx: &Context) {
    ctx.data_mut(|data| data.insert_temp(key(), FRAMES));
    ctx.request_repaint();
}

/// Counts a frame that was drawn.
pub(crate) fn count_frame(ctx: &Context) {
    let left: u8 = ctx.data(|data| data.get_temp(key())).unwrap_or(0);
    if left > 0 {
        ctx.data_mut(|data| data.insert_temp(key(), left - 1));
        ctx.request_repaint();
    }
}

/// Hides what follows in a row of controls while a picture is taken.
pub(crate) fn hide_controls(ui: &mut Ui) {
    if ui.data(|data| data.get_temp::<u8>(key())).is_some_and(|left| left > 0) {
        ui.set_invisible();
    }
}
