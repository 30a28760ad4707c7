//! The journal: who changed what, and when.

use crate::daemon::Daemon;
use crate::tape::mark::in_words;
use egui::{Button, CollapsingHeader, Label, RichText, Ui};
use haptic_ipc::JournalEntry;

/// Shows the changes, the newest first.
pub(crate) fn show(ui: &mut Ui, daemon: &Daemon) {
    let mirror = &daemon.mirror;
    CollapsingHeader::new("Changes").default_open(false).show(ui, |ui| {
        if mirror.journal.is_empty() {
            ui.label(RichText::new("No changes since the panel connected").small().weak());
        }
        for entry in mirror.journal.iter().rev() {
            ui.horizontal_top(|ui| {
                let command = entry.command(&mirror.library);
                show_copy(ui, command.map(|command| daemon.addressed(command)));
                ui.add(Label::new(RichText::new(line(entry)).small()).wrap());
            });
        }
    });
}

/// The button that copies the command which repeats the change.
fn show_copy(ui: &mut Ui, command: Option<String>) {
    let button = ui.add_enabled(command.is_some(), Button::new("Copy").small());
    let Some(command) = command else {
        button.on_disabled_hover_text("No haptic-ctl command repeats this");
        return;
    };
    let button = button.accessible_name(format!("copy {command}"));
    if button.on_hover_text(format!("Copies: {command}")).clicked() {
        ui.ctx().copy_text(command);
    }
}

pub(crate) fn line(entry: &JournalEntry) -> String {
    let by = entry
        .by
        .as_ref()
        .map_or_else(|| "the daemon".to_owned(), ToString::to_string);
    format!("{} UTC {by}: {}", clock(entry.time_unix_s), in_words(entry))
}

/// The time of day.
fn clock(unix_s: f64) -> String {
    let of_day = unix_s.max(0.0).rem_euclid(86_400.0).floor();
    let (hours, minutes, seconds) = (of_day / 3600.0, of_day % 3600.0 / 60.0, of_day % 60.0);
    format!("{:02}:{:02}:{:02}", hours.floor(), minutes.floor(), seconds)
}
