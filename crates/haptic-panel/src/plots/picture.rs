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

#[cfg(test)]
mod tests {
    use super::*;
    use egui::Shape;
    use egui_kittest::Harness;

    /// The texts that are drawn, with their places.
    fn drawn(panel: &Harness<'_>) -> Vec<(String, egui::Pos2)> {
        let shapes = panel.output().shapes.iter().filter_map(|clipped| match &clipped.shape {
            Shape::Text(text) => Some((text.galley.text().to_owned(), text.pos)),
            _ => None,
        });
        shapes.collect()
    }

    #[test]
    fn a_picture_has_the_plots_where_they_were_and_no_control() {
        let mut panel = Harness::new_ui(|ui| {
            ui.horizontal(|ui| {
                hide_controls(ui);
                ui.checkbox(&mut true, "Zoom");
            });
            ui.label("Plot");
            count_frame(ui.ctx());
        });
        let before = drawn(&panel);
        assert_eq!(before.len(), 2);
        begin(&panel.ctx);
        panel.step();
        let picture: Vec<_> = before.iter().filter(|(text, _)| text == "Plot").cloned().collect();
        assert_eq!(drawn(&panel), picture);
        panel.run();
        assert_eq!(drawn(&panel), before, "after the picture");
    }
}
