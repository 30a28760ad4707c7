//! Identification. The page has what is asked at the left, with the values that were found; data and fits on the
//! right. Answers are made and thinned on a thread of their own.

mod choice;
mod chosen;
pub(crate) mod fit;
mod fit_chart;
mod fit_plots;
mod question;
mod result;

use crate::dialogs;
use crate::intent::{DialogPurpose, Intent};
use crate::model::Model;
use crate::theme::Palette;
use crate::view::View;
use egui::style::ScrollStyle;
use egui::{Button, CentralPanel, Label, Panel, ProgressBar, RichText, ScrollArea, Ui};
use fit::{Origin, Progress};

pub use question::{Found, Question};

/// The names of a file's columns, `None` for a recording, whose columns are known; or why they cannot be read.
pub type Headings = Result<Option<Vec<String>>, String>;

/// Width of the left side, points.
const CHOICE_WIDTH: f32 = 394.0;

pub(super) fn show(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    Panel::left("identification")
        .resizable(false)
        .exact_size(CHOICE_WIDTH)
        .show(ui, |ui| {
            if let Progress::Found(_) = &model.view.fitting.progress {
                // It stays in sight, however long the list above it is.
                Panel::bottom("use of the scene")
                    .resizable(false)
                    .show(ui, |ui| result::show_use(ui, model, intents));
            }
            ui.add_space(4.0);
            ui.spacing_mut().scroll = ScrollStyle::solid();
            ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
                choice::show(ui, model, intents);
                show_asking(ui, model, intents);
                if let Progress::Found(found) = &model.view.fitting.progress {
                    result::show(ui, found, model.daemon.mirror.scene.whole.as_ref());
                }
            });
        });
    CentralPanel::default_margins().show(ui, |ui| {
        if let Progress::Found(found) = &model.view.fitting.progress {
            fit_plots::show(ui, found);
            return;
        }
        ui.heading("From a record of force and motion to a scene");
        ui.label(
            "Choose a recording, a CSV file of any laboratory, or what is seen of the rig; then press Identify. The \
             mass, the friction in both directions and their 95 % intervals are found, and a value that the record does \
             not determine is refused.",
        );
        show_choices(ui, model, intents);
    });
}

/// The buttons that choose what is identified.
fn show_choices(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    let has_samples = model.view.scope.has_samples(&model.tapes);
    let View { fitting, folder, .. } = &mut model.view;
    ui.horizontal(|ui| {
        let asked = (DialogPurpose::FileToIdentify, folder.as_str());
        dialogs::browse_button(ui, "Choose a file...", "choose a file", asked, intents);
        let rig = ui.add_enabled(has_samples, Button::new("Use what is seen of the rig"));
        if rig.on_disabled_hover_text("There is no sample of a rig").clicked() {
            fitting.choice.origin = Origin::Rig;
        }
    });
}

/// The button that asks, how far it is, and why nothing is found.
fn show_asking(ui: &mut Ui, model: &mut Model, intents: &mut Vec<Intent>) {
    ui.add_space(6.0);
    let asked = chosen::question(&model.view, &model.tapes, &model.daemon);
    let fitting = &mut model.view.fitting;
    if let Progress::Asked { share } = &fitting.progress {
        let share = *share;
        ui.horizontal(|ui| {
            if ui.button("Cancel").accessible_name("cancel identification").clicked() {
                fitting.give_up();
                intents.push(Intent::CancelIdentify);
            }
            match share {
                #[expect(clippy::cast_possible_truncation, reason = "a share is drawn")]
                Some(share) => {
                    ui.add(ProgressBar::new(share as f32).show_percentage())
                        .accessible_name(format!("identified {:.0} %", 100.0 * share));
                }
                None => {
                    ui.label("Reading");
                }
            }
        });
        return;
    }
    let button = Button::new(RichText::new("Identify").size(16.0));
    let button = ui.add_enabled(asked.is_ok(), button);
    let problem = match (&asked, &fitting.progress) {
        (Err(why), _) => Some((why, ui.visuals().weak_text_color())),
        (_, Progress::Failed(why)) => Some((why, Palette::of(ui).error_text)),
        _ => None,
    };
    if let Some((why, color)) = problem {
        ui.add(Label::new(RichText::new(why).small().color(color)).wrap());
    }
    if let Ok(question) = asked
        && button.clicked()
    {
        intents.push(Intent::Identify {
            number: fitting.ask(),
            question: Box::new(question),
        });
    }
}
