//! Making a study, and opening one.

use super::form::{StudyForm, StudyView};
use crate::dialogs;
use crate::intent::{DialogPurpose, Intent};
use crate::model::Model;
use crate::page::Page;
use egui::{Button, Label, RichText, TextEdit, Ui};
use haptic_studies::plan::Task;

/// Shows what a new study needs, and the way to one that is there.
pub(super) fn show(ui: &mut Ui, model: &mut Model, task: Task, intents: &mut Vec<Intent>) {
    let view = &mut model.view;
    if let Some(open) = view.study.state().map(|state| state.task) {
        ui.label("Another study is open.");
        let page = Page::of(open);
        if ui.button(format!("To the page {}", page.name())).clicked() {
            view.page = page;
        }
        return;
    }
    show_form(ui, &mut view.study.form, intents);
    ui.add_space(8.0);
    show_buttons(ui, &mut view.study, task, intents);
}

fn show_form(ui: &mut Ui, form: &mut StudyForm, intents: &mut Vec<Intent>) {
    for (label, name, text, hint, about, purpose) in [
        (
            "Folder",
            "folder of the study",
            &mut form.folder,
            "path of a new or an existing study",
            "A new study needs a folder that is not there yet, or empty; nothing is overwritten",
            Some(DialogPurpose::StudyFolder),
        ),
        (
            "Plan",
            "plan of the study",
            &mut form.plan,
            "the built-in one, or the path of a file",
            "`haptic-ctl study plan` prints the built-in plans, to be changed",
            Some(DialogPurpose::StudyPlan),
        ),
        (
            "Subjects",
            "subjects of the study",
            &mut form.subjects,
            "a number, or codes with commas",
            "A number gives the codes 01, 02, ...; no name is asked for, and none is stored",
            None,
        ),
        (
            "Seed",
            "seed of the study",
            &mut form.seed,
            "a whole number",
            "Every random order follows from the seed and the subject's number",
            None,
        ),
    ] {
        ui.label(label);
        ui.horizontal(|ui| {
            let button_width = purpose.map_or(0.0, |_| dialogs::BROWSE_WIDTH);
            let field = TextEdit::singleline(text)
                .hint_text(hint)
                .desired_width(ui.available_width() - button_width);
            ui.add(field).accessible_name(name).on_hover_text(about);
            if let Some(purpose) = purpose {
                dialogs::browse_button(
                    ui,
                    "Browse...",
                    &format!("choose {name}"),
                    (purpose, text.as_str()),
                    intents,
                );
            }
        });
    }
}

/// Makes or opens the study of the form, and says what the form lacks.
fn show_buttons(ui: &mut Ui, study: &mut StudyView, task: Task, intents: &mut Vec<Intent>) {
    let (create, open) = (study.form.create(task), study.form.open());
    let is_asked = study.is_asked;
    ui.horizontal(|ui| {
        for (label, command, about) in [
            ("New study", &create, "Makes the folder, and opens it"),
            ("Open study", &open, "Goes on where the study was left, also after days"),
        ] {
            let button = Button::new(RichText::new(label).size(16.0));
            let button = ui.add_enabled(!is_asked && command.is_ok(), button);
            let problem = command.as_ref().err().map_or("A study is being opened", String::as_str);
            let is_pressed = button.on_hover_text(about).on_disabled_hover_text(problem).clicked();
            if let (true, Ok(command)) = (is_pressed, command) {
                study.note_sent(command);
                intents.push(Intent::Study(command.clone()));
            }
        }
    });
    if let Err(why) = &create {
        ui.add(Label::new(RichText::new(why).small().weak()).wrap());
    }
}

/// Says what the page is for, and offers the next step.
pub(super) fn explain(ui: &mut Ui, study: &mut StudyView, task: Task, intents: &mut Vec<Intent>) {
    let (title, text) = match task {
        Task::Fitts => (
            "Targets under five resistances",
            "A subject moves a cursor with the handle and clicks on targets.",
        ),
        Task::Perception => (
            "Which surface had more friction?",
            "A subject feels two surfaces, one after the other, and says which had more friction. Neither the subject's \
             screen nor the order shows it.",
        ),
    };
    ui.heading(title);
    ui.label(text);
    ui.label("Make a study at the left, or open one; then show the subject's screen, engage the rig and begin.");
    if study.state().is_some() {
        return;
    }
    match study.form.create(task) {
        Ok(create) if !study.is_asked => {
            let open = study.form.open().ok();
            for (label, command) in [("Make this study", Some(create)), ("Open this study", open)] {
                if let Some(command) = command
                    && ui.button(label).clicked()
                {
                    study.note_sent(&command);
                    intents.push(Intent::Study(command));
                }
            }
        }
        Ok(_) => {}
        Err(_) => {
            let asked = (DialogPurpose::StudyFolder, study.form.folder.as_str());
            dialogs::browse_button(
                ui,
                "Choose the study's folder...",
                "choose a folder for a study",
                asked,
                intents,
            );
        }
    }
}
