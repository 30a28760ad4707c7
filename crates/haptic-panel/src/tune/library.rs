//! The library of scenes: pick one, save and compare.

use super::scene_edits::{SLOTS, Tuning};
use crate::drop_down::{self, Item};
use crate::intent::Intent;
use crate::text_input::number_field;
use crate::theme::Palette;
use crate::words::is_name_of;
use egui::{CollapsingHeader, Label, RichText, Ui};
use haptic_ipc::{DaemonMirror, Difference, ListedScene, SceneRef};

/// Shows the list of scenes, whose choice is loaded.
pub(crate) fn show_scenes(ui: &mut Ui, daemon: &DaemonMirror, tuning: &Tuning, intents: &mut Vec<Intent>) {
    ui.horizontal(|ui| {
        ui.label("Scenes");
        let name = name(daemon);
        let shown = if name.is_empty() { "choose" } else { name };
        let usable = daemon.library.iter().filter(|listed| listed.problem.is_none());
        let item = |listed: &ListedScene| Item {
            is_active: is_name_of(&listed.name, name),
            text: listed.name.clone(),
            hint: about(listed),
            what: listed.name.clone(),
        };
        let width = ui.available_width();
        let (chosen, list) = drop_down::show(ui, "scenes", width, shown, || usable.map(item).collect());
        list.on_hover_text("Pick a surface here first, and engage; the sliders below change it");
        if let Some(name) = chosen {
            intents.push(tuning.load(&name, SceneRef::Name(name.clone())));
        }
    });
}

/// The active scene: its name in the library, also where it was changed since; else its title.
fn name(daemon: &DaemonMirror) -> &str {
    let title = &daemon.scene.name;
    let status = daemon.status.as_ref();
    let status = status.filter(|status| Some(status.revision) == daemon.scene.revision);
    let origin = status.and_then(|status| status.library_scene.as_ref());
    match origin.filter(|origin| !is_name_of(&origin.name, title)) {
        Some(origin) => &origin.name,
        None => title,
    }
}

fn about(listed: &ListedScene) -> String {
    let place = listed.path.as_deref().unwrap_or("comes with the daemon");
    format!("{}\nLaw: {}\n{place}", listed.title, listed.law)
}

/// Shows the other controls of the library.
pub(crate) fn show(ui: &mut Ui, daemon: &DaemonMirror, tuning: &mut Tuning, intents: &mut Vec<Intent>) {
    CollapsingHeader::new("Save, compare")
        .default_open(false)
        .show(ui, |ui| {
            show_loading(ui, daemon, tuning);
            show_saving(ui, tuning, intents);
            show_comparison(ui, daemon, tuning);
        });
}

/// The time that a change of scene takes, and the scenes that cannot be loaded.
fn show_loading(ui: &mut Ui, daemon: &DaemonMirror, tuning: &mut Tuning) {
    ui.horizontal(|ui| {
        ui.label("Load a scene over");
        let ramp = number_field(&mut tuning.ramp_ms, |field| {
            field.range(0.0..=10_000.0).speed(10.0).suffix(" ms")
        });
        ui.add(ramp)
            .accessible_name("ramp")
            .on_hover_text("Time over which a scene is loaded; 0 changes between two ticks, without a step of force");
    });
    if daemon.library.is_empty() {
        ui.label(RichText::new("The daemon has no library of scenes").small().weak());
    }
    for listed in &daemon.library {
        if let Some(problem) = &listed.problem {
            let color = Palette::of(ui).error_text;
            let text = RichText::new(format!("{}: {problem}", listed.name))
                .small()
                .color(color);
            ui.add(Label::new(text).truncate()).on_hover_text(about(listed));
        }
    }
}

fn show_saving(ui: &mut Ui, tuning: &mut Tuning, intents: &mut Vec<Intent>) {
    let button = ("Save", "save scene", "Keeps the active scene in the daemon's library");
    let saved = ui.horizontal_wrapped(|ui| tuning.saving.show(ui, true, "name to save as", button));
    let save = |(name, replace)| Intent::Save {
        name,
        replace,
        scene: None,
    };
    intents.extend(saved.inner.map(save));
}

/// Everything that the active scene can be compared with.
fn comparable(daemon: &DaemonMirror, tuning: &Tuning) -> Vec<(String, SceneRef)> {
    let slots = SLOTS.into_iter().zip(&tuning.slots);
    let slots = slots.filter_map(|(name, slot)| Some((name.to_owned(), SceneRef::from(slot.clone()?))));
    let library = daemon.library.iter().filter(|listed| listed.problem.is_none());
    let library = library.map(|listed| (listed.name.clone(), SceneRef::Name(listed.name.clone())));
    let newest = daemon.scene.revision.unwrap_or(0);
    let oldest = newest.saturating_sub(20).max(1);
    let revisions = (oldest..newest).rev();
    let revisions = revisions.map(|revision| (format!("revision {revision}"), SceneRef::Revision(revision)));
    slots.chain(library).chain(revisions).collect()
}

fn show_comparison(ui: &mut Ui, daemon: &DaemonMirror, tuning: &mut Tuning) {
    ui.horizontal(|ui| {
        ui.label("Compare with");
        let shown = tuning.comparison.as_ref().map(|comparison| comparison.with.clone());
        let shown = shown.unwrap_or_else(|| "choose".to_owned());
        let item = |(what, other): (String, SceneRef)| Item {
            is_active: what == shown,
            text: what.clone(),
            hint: String::new(),
            what: (what, other),
        };
        let items = || comparable(daemon, tuning).into_iter().map(item).collect();
        let (chosen, _) = drop_down::show(ui, "compare with", 150.0, &shown, items);
        if let Some((with, other)) = chosen {
            tuning.comparison = Some(Comparison::new(with, other));
        }
    });
    let Some(Comparison {
        with,
        found: Some(found),
        ..
    }) = &tuning.comparison
    else {
        return;
    };
    let revision = found.revision;
    match &found.result {
        Ok(differences) if differences.is_empty() => {
            ui.label(RichText::new(format!("Revision {revision} (active) does not differ from {with}")).small());
        }
        Ok(differences) => {
            let heading = format!("From {with} to revision {revision} (active):");
            ui.label(RichText::new(heading).small().weak());
            for difference in differences {
                ui.add(Label::new(RichText::new(difference.to_string()).small()).wrap());
            }
        }
        Err(why) => {
            let color = Palette::of(ui).error_text;
            ui.add(Label::new(RichText::new(why).small().color(color)).wrap());
        }
    }
}

/// A comparison of the active scene with another. It is asked for again whenever one of them changes.
#[derive(Debug)]
pub(crate) struct Comparison {
    pub(crate) with: String,
    other: SceneRef,
    /// The revision in the last request.
    asked: Option<u64>,
    is_unanswered: bool,
    pub(crate) found: Option<Found>,
}

/// The result of a comparison.
#[derive(Debug)]
pub(crate) struct Found {
    /// Revision of the active scene.
    pub(crate) revision: u64,
    pub(crate) result: Result<Vec<Difference>, String>,
}

impl Comparison {
    pub(crate) fn new(with: String, other: SceneRef) -> Self {
        Self {
            with,
            other,
            asked: None,
            is_unanswered: false,
            found: None,
        }
    }

    /// The request while `newest` is active. There is one at a time, so that a dragged slider does not
    /// swamp the daemon.
    pub(super) fn due(&mut self, newest: Option<u64>) -> Option<Intent> {
        let revision = newest.filter(|_| !self.is_unanswered && self.asked != newest)?;
        (self.asked, self.is_unanswered) = (newest, true);
        Some(Intent::Compare {
            what: self.with.clone(),
            scene: self.other.clone(),
            revision,
        })
    }

    /// The other scene has changed: asks again.
    pub(super) fn ask_again(&mut self) {
        self.asked = None;
    }

    /// Takes an answer, unless it belongs to another request.
    pub(super) fn take(
        &mut self,
        with: &str,
        other: &SceneRef,
        revision: u64,
        result: Result<Vec<Difference>, String>,
    ) {
        if (self.with.as_str(), &self.other, self.asked) == (with, other, Some(revision)) {
            self.is_unanswered = false;
            self.found = Some(Found { revision, result });
        }
    }
}
