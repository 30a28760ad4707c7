//! Every control of the panel has a name, and is named by a test.

use crate::advice::{advised, check};
use crate::bench::{Panel, at_page, connected, hear, is_enabled, panel};
use crate::files::going;
use crate::layout::pages;
use crate::library::listed;
use crate::measure::open;
use crate::plane::draw_circle;
use crate::plots::{felt, rows};
use crate::rig::status;
use crate::scene::active_scene;
use crate::study::{held, state, tell};
use egui::accesskit::Role;
use egui_kittest::kittest::{By, NodeT, Queryable};
use haptic_core::Scene;
use haptic_core::friction::LAWS;
use haptic_ipc::{RigState, SceneListReply};
use haptic_panel::{Page, StudyNews, Update};
use haptic_studies::plan::Task;
use std::collections::BTreeSet;
use std::path::Path;

/// The names of the controls that a panel shows, those that are disabled as well.
fn controls(panel: &Panel) -> BTreeSet<String> {
    let controls = panel.query_all(By::new().predicate(|node| {
        matches!(
            node.role(),
            Role::Button
                | Role::CheckBox
                | Role::ComboBox
                | Role::Link
                | Role::MultilineTextInput
                | Role::RadioButton
                | Role::Slider
                | Role::SpinButton
                | Role::TextInput
        )
    }));
    let name = |node: egui_kittest::Node<'_>| {
        let node = node.accesskit_node();
        node.label()
            .unwrap_or_else(|| format!("a {:?} at {:?}", node.role(), node.bounding_box()))
    };
    controls.map(name).collect()
}

/// A panel that knows all of a rig and its scene.
fn informed(mut panel: Panel) -> Panel {
    panel.set_size([1920.0, 4000.0].into());
    hear(&mut panel, active_scene(1, &Scene::paper()));
    let scenes = vec![listed("paper")];
    hear(&mut panel, Update::Library(Ok(SceneListReply { scenes })));
    hear(&mut panel, Update::Status(Ok(Box::new(status()))));
    let checks = vec![
        check("friction", 16_000.0, Some(16_000.0)),
        check("encoder", 160_000.0, None),
    ];
    hear(&mut panel, advised(1, checks));
    panel
}

/// Panels that show, together, all that there is.
fn panels() -> Vec<Panel> {
    let mut panels = vec![panel()];
    panels.extend(pages().map(|(_, page)| informed(page())));
    let mut plane = informed(connected(RigState::Engaged));
    draw_circle(&mut plane);
    let mut recording = informed(at_page(felt(0..2000, |_| 1.0), Page::Record));
    open(&mut recording, "/home/ada/r.mcap", rows(0..2000, |_| 1.0), &[]);
    hear(&mut recording, going("/home/ada/now.mcap"));
    let mut study = informed(felt(0..2000, |_| 1.0));
    tell(&mut study, StudyNews::State(Box::new(state(Task::Fitts, held()))));
    panels.extend([plane, recording, study]);
    panels
}

/// What a panel shows, and what it shows when each of its controls was pressed.
fn reached(panel: &mut Panel) -> BTreeSet<String> {
    let first = controls(panel);
    let mut all = first.clone();
    for name in &first {
        if panel.query_all_by_label(name).count() != 1 || name == "Stop" || !is_enabled(panel, name) {
            continue;
        }
        panel.get_by_label(name).click();
        panel.run_steps(3);
        all.extend(controls(panel));
        // It closes what is open.
        panel.key_press(egui::Key::Escape);
        panel.run_steps(3);
    }
    all
}

/// Every text in the sources of the tests, but this one; `{...}` stands for anything.
fn texts() -> Vec<String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/panel");
    let files = std::fs::read_dir(folder).expect("a folder").flatten();
    let files = files.filter(|file| file.file_name() != "controls.rs");
    let sources = files.map(|file| std::fs::read_to_string(file.path()).expect("a source"));
    let texts = sources.flat_map(|source| source.split('"').map(str::to_owned).collect::<Vec<_>>());
    // Every law is chosen, and its values are set, by the list of laws (scene.rs).
    texts.chain(LAWS.into_iter().map(str::to_owned)).collect()
}

/// Whether a text of a test is a name, or makes it by filling in.
fn is_named_by(name: &str, text: &str) -> bool {
    match text.split_once('{').zip(text.rsplit_once('}')) {
        Some(((before, _), (_, after))) => {
            before.len() + after.len() > 3
                && name.len() >= before.len() + after.len()
                && name.starts_with(before)
                && name.ends_with(after)
        }
        None => name == text,
    }
}

#[test]
fn every_control_has_a_name_and_is_named_by_a_test() {
    if !test_run::is_long_for("the walk over all controls") {
        return;
    }
    let texts = texts();
    let controls: BTreeSet<String> = panels().iter_mut().flat_map(reached).collect();
    assert!(controls.len() > 100, "{controls:?}");
    let is_tested = |name: &String| texts.iter().any(|text| is_named_by(name, text));
    let untested: Vec<&String> = controls.iter().filter(|name| !is_tested(name)).collect();
    println!("{controls:#?}");
    assert!(untested.is_empty(), "no test names {untested:#?}");
}
