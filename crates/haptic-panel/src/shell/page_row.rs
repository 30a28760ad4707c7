//! The row of pages, with what is recorded and the outcome of the last file beside it.

use super::close_question;
use crate::intent::Intent;
use crate::model::Model;
use crate::notice;
use crate::page::Page;
use crate::record::amount;
use crate::theme::Palette;
use crate::view::{Closing, Reading};
use crate::words::shortened;
use egui::{Frame, Key, Modifiers, ProgressBar, RichText, Ui};
use std::time::Duration;

/// The keys of the pages, in the order of the row, each with Ctrl.
const KEYS: [Key; Page::ALL.len()] = [Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5, Key::Num6];

/// Width of the bar of a recording that is read, points.
const BAR_WIDTH: f32 = 140.0;

/// Turns to the page whose key is pressed.
pub(crate) fn take_keys(ui: &Ui, model: &mut Model) {
    for (key, page) in KEYS.iter().zip(Page::ALL) {
        if ui.input_mut(|input| input.consume_key(Modifiers::COMMAND, *key)) && is_offered(model, *page) {
            model.view.page = *page;
        }
    }
}

/// Whether the row has the page: that of the plane only with a second axis.
fn is_offered(model: &Model, page: Page) -> bool {
    page != Page::Plane || model.has_plane() || model.view.page == page
}

/// The message while nobody knows what the rig does: no sample comes for so long, or its daemon is lost.
fn unknown_line(silence: Option<Duration>) -> String {
    match silence.map(|lasts| lasts.as_secs_f64()) {
        Some(s) => format!("No sample for {s:.1} s: if in doubt, cut the motor's power. Stop is still sent"),
        None => "The daemon is lost, and the rig's state is unknown: if in doubt, cut the motor's power".to_owned(),
    }
}

/// Shows the row. Its height is the same with and without a message, so that nothing below it moves.
pub(crate) fn show(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    let pages: Vec<_> = Page::ALL
        .iter()
        .enumerate()
        .filter(|(_, page)| is_offered(model, **page))
        .collect();
    let Model { daemon, tapes, view } = model;
    ui.horizontal(|ui| {
        for (place, page) in pages {
            let name = RichText::new(page.name()).size(16.0);
            ui.selectable_value(&mut view.page, *page, name)
                .accessible_name(format!("{} page", page.name()))
                .on_hover_text(format!("{} (Ctrl+{})", page.hint(), place + 1));
        }
        ui.toggle_value(&mut view.help_shown, RichText::new("?").size(16.0))
            .accessible_name("help")
            .on_hover_text("Keys, plots and the sign of force (F1 or ?)");
        ui.add_space(8.0);
        if view.closing != Closing::No {
            close_question::show_question(ui, &mut view.closing, intents);
            return;
        }
        if daemon.is_rig_unknown() {
            let palette = Palette::of(ui);
            let text = unknown_line(daemon.silence().filter(|_| daemon.is_connected()));
            Frame::new()
                .fill(palette.halt)
                .inner_margin(3)
                .corner_radius(4)
                .show(ui, |ui| {
                    let line = RichText::new(&text).small().strong().color(palette.on_fill);
                    shortened(ui, line, &text);
                });
            return;
        }
        if let Some(written) = tapes.recording() {
            let palette = Palette::of(ui);
            let mut text = format!("Recording {}: {}", written.path.display(), amount(&written.totals));
            let mut color = palette.caution_text;
            if written.lost > 0 || written.lost_changes > 0 {
                let (samples, changes) = (written.lost, written.lost_changes);
                text = format!("The disk does not keep up: {samples} samples and {changes} changes lost. {text}");
                color = palette.error_text;
            }
            shortened(ui, RichText::new(&text).small().color(color), &text);
        }
        if let Some(reading) = &view.reading {
            show_reading(ui, reading);
        }
        // What a page did is shown before what was done to a file.
        let of_page = match view.page {
            Page::Identify => &mut view.fitting.report,
            Page::Task | Page::Perception => &mut view.study.report,
            Page::Tune | Page::Record | Page::Plane => &mut None,
        };
        let notice = if of_page.is_some() {
            of_page
        } else {
            &mut view.file_notice
        };
        notice::show(ui, notice);
    });
}

/// How much of a recording is read.
fn show_reading(ui: &mut Ui, reading: &Reading) {
    let share = reading.share.unwrap_or(0.0);
    #[expect(clippy::cast_possible_truncation, reason = "a share")]
    let bar = ProgressBar::new(share as f32)
        .desired_width(BAR_WIDTH)
        .desired_height(14.0)
        .text(RichText::new(format!("{:.0} %", 100.0 * share)).small());
    let name = reading.path.file_name().unwrap_or_default().to_string_lossy();
    ui.add(bar).accessible_name(format!("share of {name} that is read"));
    let line = RichText::new(format!("Reading {name}")).small();
    shortened(ui, line, &reading.path.display().to_string());
}
