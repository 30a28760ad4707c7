//! The library of scenes: the list, saving, and the comparison with the active scene.

use crate::advice::{advised, check};
use crate::bench::{Hands as _, Panel, answer, asked, choose_item, enter, hear, press, refuse, state_event};
use crate::plot_list::difference;
use crate::scene::{changed, informed};
use egui::Key;
use egui_kittest::kittest::Queryable;
use haptic_core::Directional;
use haptic_ipc::{ErrorCode, Event, ListedScene, RigState, SceneDiffReply, SceneListReply, SceneRef, SceneSaveReply};
use haptic_panel::{Answer, Intent, Update};

/// A scene of the library.
pub(crate) fn listed(name: &str) -> ListedScene {
    ListedScene {
        name: name.into(),
        title: "A title".into(),
        law: "karnopp".into(),
        path: None,
        problem: None,
    }
}

#[test]
fn the_library_is_loaded_from_and_saved_to() {
    let mut panel = informed();
    let broken = ListedScene {
        problem: Some("line 3: no law".into()),
        ..listed("broken")
    };
    let scenes = vec![listed("high-stiction"), broken];
    hear(&mut panel, Update::Library(Ok(SceneListReply { scenes })));
    let above = |panel: &Panel, lower: &str| {
        panel.get_by_label("scenes").rect().bottom() <= panel.get_by_label(lower).rect().top()
    };
    assert!(
        above(&panel, "friction law") && above(&panel, "mass slider"),
        "it is picked first"
    );
    press(&mut panel, "scenes");
    assert!(panel.query_by_label("broken").is_none(), "it cannot be loaded");
    press(&mut panel, "scenes");
    choose_item(&mut panel, "scenes", "high-stiction");
    let asked = asked(&mut panel);
    assert!(
        matches!(asked.as_slice(), [Intent::Load { scene: SceneRef::Name(name), .. }] if name == "high-stiction"),
        "{asked:?}"
    );
    press(&mut panel, "Save, compare");
    panel.get_by_label("broken: line 3: no law");

    panel.get_by_label("name to save as").scroll_to_me();
    panel.run();
    panel.focus_on("name to save as");
    panel.hit(Key::Enter);
    assert_eq!(crate::bench::asked(&mut panel), [], "there is no name yet");
    enter(&mut panel, "name to save as", "mine");
    let save = |replace| Intent::Save {
        name: "mine".into(),
        replace,
        scene: None,
    };
    assert_eq!(crate::bench::asked(&mut panel), [save(false)]);
    let scenes = ["first", "mine"].map(listed).into();
    hear(&mut panel, Update::Library(Ok(SceneListReply { scenes })));
    assert!(
        panel.get_by_label("name to save as").is_focused(),
        "and not what now stands in its place"
    );
    press(&mut panel, "save scene");
    assert_eq!(crate::bench::asked(&mut panel), [save(false)]);
    refuse(&mut panel, save(false), ErrorCode::SceneExists, "there is one");
    panel.get_by_label("The library has a scene mine already: save under another name, or replace it");
    press(&mut panel, "Replace mine");
    assert_eq!(crate::bench::asked(&mut panel), [save(true)]);
    let saved = SceneSaveReply {
        name: "mine".into(),
        path: "/scenes/mine.toml".into(),
    };
    answer(&mut panel, save(true), Answer::Saved(saved));
    panel.get_by_label("Saved as mine (/scenes/mine.toml)");
}

#[test]
fn what_is_under_the_pointer_stays_there_when_the_scene_changes() {
    let mut panel = informed();
    let scenes = vec![listed("first"), listed("second"), listed("third")];
    hear(&mut panel, Update::Library(Ok(SceneListReply { scenes })));
    press(&mut panel, "Save, compare");
    choose_item(&mut panel, "scenes", "second");
    asked(&mut panel);
    let save = "name to save as";
    panel.get_by_label(save).scroll_to_me();
    panel.run();
    let at = panel.get_by_label(save).rect();
    panel.hover_at(at.center());
    panel.run();
    let load = Intent::Load {
        what: "second".into(),
        scene: SceneRef::Name("second".into()),
        ramp_ms: None,
    };
    hear(&mut panel, changed(load, 2));
    panel.get_by_label("Loaded second at tick 1002");
    hear(
        &mut panel,
        advised(2, vec![check("friction", 16_000.0, Some(16_000.0))]),
    );
    panel.get_by_label_contains("Friction: stiffness 25000");
    assert_eq!(panel.get_by_label(save).rect(), at);
    hear(&mut panel, advised(2, vec![]));
    assert_eq!(panel.get_by_label(save).rect(), at);
}

/// Answers a comparison: the static force is `force` N in the active scene.
fn differs(intent: Intent, force: f64) -> Update {
    let after = Directional {
        positive: force,
        negative: 3.0,
    };
    let difference = difference("static_force", "N", 4.0, after);
    let differences = vec![difference];
    let result = Ok(Answer::Differs(SceneDiffReply { differences }));
    Update::Answered { intent, result }
}

fn of_revision(revision: u64) -> Update {
    let mut event = state_event(RigState::Engaged, 200 + revision);
    event.revision = revision;
    Update::Event(Event::State(event))
}

/// The one comparison that was asked for.
fn compared(panel: &mut Panel) -> (Intent, u64) {
    let asked = asked(panel);
    let [intent @ Intent::Compare { what, revision, .. }] = asked.as_slice() else {
        panic!("{asked:?}");
    };
    assert_eq!(what, "A");
    (intent.clone(), *revision)
}

#[test]
fn the_active_scene_is_compared_and_again_when_it_changes() {
    let mut panel = informed();
    press(&mut panel, "keep as A");
    press(&mut panel, "Save, compare");
    press(&mut panel, "compare with");
    // The one in the list: the buttons of the slot are named otherwise.
    let item = panel.get_all_by_label("A").last().expect("an item");
    item.click();
    panel.run();
    let (first, revision) = compared(&mut panel);
    assert_eq!(revision, 1);
    for newer in [2, 3] {
        hear(&mut panel, of_revision(newer));
    }
    assert_eq!(asked(&mut panel), [], "one at a time");
    hear(&mut panel, differs(first, 5.0));
    panel.get_by_label("From A to revision 1 (active):");
    panel.get_by_label("static_force: 4 N -> +5 -3 N");
    let (second, revision) = compared(&mut panel);
    assert_eq!(revision, 3, "another scene is active by now");
    hear(&mut panel, differs(second, 6.0));
    panel.get_by_label("From A to revision 3 (active):");
    panel.get_by_label("static_force: 4 N -> +6 -3 N");
    assert_eq!(asked(&mut panel), []);

    press(&mut panel, "keep as A");
    let (third, _) = compared(&mut panel);
    let none = SceneDiffReply { differences: vec![] };
    answer(&mut panel, third, Answer::Differs(none));
    panel.get_by_label("Revision 3 (active) does not differ from A");
}
