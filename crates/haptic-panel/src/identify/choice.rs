//! What is asked: from which samples, which model, and what is known beforehand.

use super::fit::{Choice, Fitting, Origin};
use crate::dialogs;
use crate::drop_down::{self, Item};
use crate::intent::{DialogPurpose, Intent};
use crate::model::Model;
use crate::theme::Palette;
use crate::view::View;
use egui::{Grid, Label, RichText, TextEdit, Ui};
use haptic_lab::identify::ModelKind;
use haptic_lab::identify::record_file::MovingMass;

/// Width of the fields, points.
const FIELD_WIDTH: f32 = 200.0;

/// Text of a column that is found by its name.
const BY_NAME: &str = "by its name";

pub(super) fn show(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    let has_recording = model.tapes.opened().is_some();
    let View { fitting, folder, .. } = &mut model.view;
    ui.horizontal(|ui| {
        for (origin, name, hint, is_there) in [
            (
                Origin::File,
                "A file",
                "A recording, or a CSV file of any laboratory",
                true,
            ),
            (
                Origin::Rig,
                "The rig, as seen",
                "The time that the page Tune shows; freeze it there, and zoom",
                true,
            ),
            (
                Origin::Recording,
                "The recording, as seen",
                "The time that the page Record shows of the opened recording",
                has_recording,
            ),
        ] {
            let is_chosen = fitting.choice.origin == origin;
            let radio = egui::RadioButton::new(is_chosen, name);
            let radio = ui
                .add_enabled(is_there, radio)
                .on_hover_text(hint)
                .on_disabled_hover_text("No recording is open");
            if radio.clicked() {
                fitting.choice.origin = origin;
            }
        }
    });
    if fitting.choice.origin == Origin::File {
        ui.horizontal(|ui| {
            let field = TextEdit::singleline(&mut fitting.choice.path)
                .hint_text("path of the file, or drop it on the window")
                .desired_width(ui.available_width() - dialogs::BROWSE_WIDTH);
            let field = ui.add(field).accessible_name("file to identify");
            if !field.has_focus() {
                intents.extend(fitting.ask_headings());
            }
            let path = &fitting.choice.path;
            let near = if path.is_empty() { folder } else { path };
            let asked = (DialogPurpose::FileToIdentify, near.as_str());
            dialogs::browse_button(ui, "Browse...", "choose file to identify", asked, intents);
        });
        show_columns(ui, fitting);
    }
    Grid::new("options")
        .num_columns(2)
        .show(ui, |ui| show_options(ui, &mut fitting.choice));
}

/// The columns of the file if it is no recording.
fn show_columns(ui: &mut Ui, fitting: &mut Fitting) {
    let names = match fitting.headings() {
        None | Some(Ok(None)) => return,
        Some(Ok(Some(names))) => names.clone(),
        Some(Err(why)) => {
            let color = Palette::of(ui).error_text;
            ui.add(Label::new(RichText::new(why).small().color(color)).wrap());
            return;
        }
    };
    Grid::new("columns").num_columns(2).show(ui, |ui| {
        let Choice {
            columns,
            position_gain,
            force_gain,
            ..
        } = &mut fitting.choice;
        for (name, column) in [
            ("Time", &mut columns.time),
            ("Position", &mut columns.position),
            ("Velocity", &mut columns.velocity),
            ("Force", &mut columns.force),
        ] {
            ui.label(name);
            show_column(ui, &format!("{} column", name.to_lowercase()), &names, column);
            ui.end_row();
        }
        for (label, gain, hint) in [
            (
                "Position gain",
                position_gain,
                "Metres a unit of the position column; without it the unit at the end of its name, as in x_mm, or 1",
            ),
            (
                "Force gain",
                force_gain,
                "Newtons a unit of the force column, negative where the sensor points against the position; without it \
                 the unit at the end of its name, or 1",
            ),
        ] {
            show_field(ui, label, gain, "by its name", hint);
        }
    });
}

fn show_column(ui: &mut Ui, label: &str, names: &[String], column: &mut Option<String>) {
    let shown = column.clone().unwrap_or_else(|| BY_NAME.to_owned());
    let items = || {
        let by_name = Item::new(None, BY_NAME, column);
        let named = names.iter().map(|name| Item::new(Some(name.clone()), name, column));
        [by_name].into_iter().chain(named).collect()
    };
    let (chosen, _) = drop_down::show(ui, label, FIELD_WIDTH - 8.0, shown, items);
    if let Some(chosen) = chosen {
        *column = chosen;
    }
}

fn show_options(ui: &mut Ui, choice: &mut Choice) {
    ui.label("Model");
    let items = || {
        let item = |model: ModelKind| Item {
            hint: model.summary().to_owned(),
            ..Item::new(model, model.name(), &choice.model)
        };
        ModelKind::ALL.map(item).into()
    };
    let (chosen, _) = drop_down::show(ui, "model", FIELD_WIDTH - 8.0, choice.model.name(), items);
    choice.model = chosen.unwrap_or(choice.model);
    ui.end_row();
    ui.label("Moving mass");
    let masses = [
        (MovingMass::Auto, "by the recording"),
        (MovingMass::Block, "the block"),
        (MovingMass::Device, "the device"),
    ];
    let name = masses.iter().find(|(moving, _)| *moving == choice.moving);
    let items = || {
        masses
            .map(|(moving, name)| Item::new(moving, name, &choice.moving))
            .into()
    };
    let shown = name.map_or("", |(_, name)| name);
    let (chosen, list) = drop_down::show(ui, "moving mass", FIELD_WIDTH - 8.0, shown, items);
    list.on_hover_text("Of a recording: the block, driven by its coupling, or the device, driven by its motor");
    choice.moving = chosen.unwrap_or(choice.moving);
    ui.end_row();
    for (label, text, hint) in [
        (
            "Mass",
            &mut choice.mass,
            "With or without a unit (500 g); a known mass is not identified",
        ),
        (
            "Offset",
            &mut choice.offset,
            "A known constant force in N: 0 for a zeroed sensor on a level axis. Without it a constant force and a \
             difference of friction by direction cannot be told apart",
        ),
    ] {
        show_field(ui, label, text, "to be found", hint);
    }
}

/// A row with a field of a number that may be left out.
fn show_field(ui: &mut Ui, label: &str, text: &mut String, without: &str, hint: &str) {
    ui.label(label);
    let field = TextEdit::singleline(text)
        .hint_text(without)
        .desired_width(FIELD_WIDTH - 8.0);
    ui.add(field)
        .accessible_name(format!("{} to identify with", label.to_lowercase()))
        .on_hover_text(hint);
    ui.end_row();
}
