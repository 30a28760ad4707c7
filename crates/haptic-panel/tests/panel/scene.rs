//! The scene as a whole: law, undo and redo, A and B, tries.

use crate::bench::{
    Hands as _, Panel, asked, connected, enter, find_another_daemon, hear, is_enabled, lose_the_daemon, of_depth,
    press, press_item, refuse, set, state_event, type_into, wait,
};
use crate::library::listed;
use crate::plot_list::{by_ada, difference};
use egui::{Key, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable};
use haptic_core::friction::LAWS;
use haptic_core::{Directional, Parameter, Scene};
use haptic_ipc::{
    ChangeReply, Description, ErrorCode, Event, JournalEntry, ParameterDescription, RigState, SceneListReply, SceneRef,
    SceneReply, params_of,
};
use haptic_panel::{Answer, Intent, Update};
use std::time::{Duration, Instant};

pub(crate) fn active_scene(revision: u64, scene: &Scene) -> Update {
    Update::Scene(Ok(Box::new(SceneReply {
        revision,
        params: params_of(scene),
        scene: scene.clone(),
    })))
}

/// A panel that knows the whole of the paper's scene.
pub(crate) fn informed() -> Panel {
    let mut panel = connected(RigState::Engaged);
    hear(&mut panel, active_scene(1, &Scene::paper()));
    panel
}

pub(crate) fn changed(intent: Intent, revision: u64) -> Update {
    let mut another = Scene::paper();
    another.name.push('!');
    let reply = ChangeReply {
        revision,
        changed: true,
        tick: Some(1000 + revision),
        changes: haptic_ipc::differences(&Scene::paper(), &another),
        ..ChangeReply::default()
    };
    Update::Answered {
        intent,
        result: Ok(Answer::Changed(reply)),
    }
}

#[test]
fn the_whole_list_of_laws_is_in_sight() {
    let mut panel = informed();
    press(&mut panel, "friction law");
    let window = panel.ctx.content_rect();
    let mut above = f32::NEG_INFINITY;
    for law in LAWS {
        let item = crate::bench::item_of(&panel, law).rect();
        assert!(window.contains_rect(item) && item.top() >= above, "{law}: {item}");
        above = item.bottom();
    }
}

/// The scene whose loading was asked for, by its name in the request.
fn loading(panel: &mut Panel) -> (String, Scene, Intent) {
    let mut asked = asked(panel);
    let Some(Intent::Load {
        what,
        scene: SceneRef::Scene(scene),
        ..
    }) = asked.first().filter(|_| asked.len() == 1)
    else {
        panic!("{asked:?}");
    };
    (what.clone(), scene.clone().on(None), asked.remove(0))
}

/// Chooses a law, and has the daemon do it. Returns the scene that was asked for.
fn turn_to_law(panel: &mut Panel, law: &str, revision: u64) -> Scene {
    press(panel, "friction law");
    press(panel, law);
    let (_, scene, _) = loading(panel);
    let mut event = state_event(RigState::Engaged, 100 * revision);
    (event.revision, event.law, event.params) = (revision, law.to_owned(), params_of(&scene));
    hear(panel, Update::Event(Event::State(event)));
    hear(panel, active_scene(revision, &scene));
    scene
}

#[test]
fn a_law_that_is_chosen_again_has_the_values_that_it_had_last() {
    let mut panel = informed();
    let first = turn_to_law(&mut panel, "dahl", 2);
    assert_eq!(first, Scene::paper().with_law("dahl").unwrap().unwrap());
    let tuned = [(Parameter::Exponent.into(), 2.5), (Parameter::Mass.into(), 0.75)];
    let tuned = first.with(&tuned).expect("a scene");
    hear(&mut panel, active_scene(3, &tuned));
    turn_to_law(&mut panel, "karnopp", 4);
    let again = turn_to_law(&mut panel, "dahl", 5);
    assert_ne!(first.value(Parameter::Exponent), tuned.value(Parameter::Exponent));
    assert_eq!(again.value(Parameter::Exponent), tuned.value(Parameter::Exponent));
    // What both laws have keeps the value of now.
    let heavier = again.with(&[(Parameter::Mass.into(), 0.9)]).expect("a scene");
    hear(&mut panel, active_scene(6, &heavier));
    let karnopp = turn_to_law(&mut panel, "karnopp", 7);
    assert_eq!(karnopp.value(Parameter::Mass), heavier.value(Parameter::Mass));
    assert_eq!(
        karnopp.value(Parameter::StaticForce),
        Scene::paper().value(Parameter::StaticForce)
    );
}

/// Names of the parameters that a panel shows a field for.
fn parameters(panel: &Panel) -> Vec<String> {
    let fields = panel.get_all_by_label_contains(" value");
    let names = fields.filter_map(|field| field.accesskit_node().label());
    names
        .filter_map(|name| Some(name.strip_suffix(" value")?.to_owned()))
        .collect()
}

#[test]
fn every_law_parameter_has_a_field_and_a_slider() {
    let mut panel = informed();
    panel.set_size(egui::vec2(1280.0, 3000.0));
    // Karnopp, which is active and cannot be turned to, comes first in the list.
    for (revision, law) in (2..).zip(LAWS.into_iter().rev()).step_by(test_run::extent(3, 1)) {
        let scene = turn_to_law(&mut panel, law, revision);
        let description = Description {
            laws: vec![],
            law: law.into(),
            parameters: ParameterDescription::all_of(&scene),
            sample_columns: vec![],
        };
        hear(&mut panel, Update::Described(description));
        for switch in ["dynamic force by direction", "viscous by direction"] {
            if panel.query_by_label(switch).is_some() {
                press(&mut panel, switch);
            }
        }
        let names = parameters(&panel);
        assert!(!names.is_empty(), "{law}");
        for name in names {
            panel.get_by_label(&format!("{name} slider"));
            enter(&mut panel, &format!("{name} value"), "0.5");
            let parameter = name.replace(" +", "+").replace(" -", "-").replace(' ', "_");
            let asked = asked(&mut panel);
            let [Intent::Set { target, value: 0.5, .. }] = asked.as_slice() else {
                panic!("{law}, {name}: {asked:?}");
            };
            assert_eq!(target.to_string(), parameter, "{law}");
        }
    }
}

#[test]
fn undo_and_redo_show_depth_and_author_of_last_change() {
    let mut panel = connected(RigState::Engaged);
    assert!(!is_enabled(&panel, "undo") && !is_enabled(&panel, "redo"));
    hear(&mut panel, of_depth(3, 1));
    let entry = JournalEntry {
        time_unix_s: 1_700_000_000.9,
        changes: vec![difference("mass", "kg", 0.5, Directional::both(1.0))],
        ..by_ada("set", 7)
    };
    hear(&mut panel, Update::Event(Event::Log(Box::new(entry))));
    press(&mut panel, "Changes");
    panel.get_by_label("22:13:20 UTC ada (haptic-ctl, process 7): set, mass: 0.5 kg -> 1 kg");
    press(&mut panel, "undo");
    press(&mut panel, "redo");
    assert_eq!(asked(&mut panel), [Intent::Undo, Intent::Redo]);
    hear(&mut panel, changed(Intent::Undo, 5));
    panel.get_by_label("Undone at tick 1005");
}

#[test]
fn keys_undo_and_redo_but_not_while_a_number_is_typed() {
    let mut panel = connected(RigState::Engaged);
    let (undo, redo) = (Modifiers::COMMAND, Modifiers::COMMAND | Modifiers::SHIFT);
    panel.hit_with(undo, Key::Z);
    assert_eq!(asked(&mut panel), [], "there is nothing to undo");
    hear(&mut panel, of_depth(1, 1));
    panel.hit_with(undo, Key::Z);
    panel.hit_with(redo, Key::Z);
    assert_eq!(asked(&mut panel), [Intent::Undo, Intent::Redo]);
    type_into(&mut panel, "mass value", "7");
    panel.hit_with(undo, Key::Z);
    assert_eq!(asked(&mut panel), [], "the field's own undo");
}

#[test]
fn a_hanging_daemon_gets_no_change_of_scene() {
    let mut panel = connected(RigState::Engaged);
    hear(&mut panel, of_depth(1, 1));
    let scenes = vec![listed("high-stiction")];
    hear(&mut panel, Update::Library(Ok(SceneListReply { scenes })));
    press(&mut panel, "scenes");
    asked(&mut panel);
    hear(&mut panel, Update::NoSample(Duration::from_millis(600)));
    for control in ["undo", "scenes", "friction law", "mass slider"] {
        assert!(!is_enabled(&panel, control), "{control}");
    }
    // Of a list that was open when it fell silent.
    if panel.query_by_label("high-stiction").is_some() {
        press_item(&mut panel, "high-stiction");
    }
    panel.hit_with(Modifiers::COMMAND, Key::Z);
    assert_eq!(
        asked(&mut panel),
        [],
        "it would be carried out later, when nobody expects it"
    );
    hear(&mut panel, Update::NoSample(Duration::ZERO));
    panel.hit_with(Modifiers::COMMAND, Key::Z);
    assert_eq!(asked(&mut panel), [Intent::Undo]);
}

#[test]
fn two_scenes_are_kept_and_switched_between() {
    let mut panel = informed();
    assert!(!is_enabled(&panel, "switch between A and B"));
    panel.get_by_label("Keep A, change something, Keep B: A/B switches");
    press(&mut panel, "keep as A");
    panel.get_by_label("A is kept. Change something, then Keep B");
    let heavy = Scene::paper().with(&[("M".parse().unwrap(), 2.0)]).unwrap();
    hear(&mut panel, active_scene(2, &heavy));
    press(&mut panel, "keep as B");
    panel.get_by_label("From A to B: mass: 0.5 kg -> 2 kg");
    press(&mut panel, "switch between A and B");
    let (what, scene, to_a) = loading(&mut panel);
    assert_eq!((what.as_str(), scene), ("A", Scene::paper()));
    hear(&mut panel, active_scene(3, &Scene::paper()));
    hear(&mut panel, changed(to_a, 3));
    panel.get_by_label("Loaded A at tick 1003");
    press(&mut panel, "switch between A and B");
    assert_eq!(loading(&mut panel).0, "B");
}

#[test]
fn what_is_kept_outlives_the_daemon() {
    let mut panel = informed();
    press(&mut panel, "keep as A");
    lose_the_daemon(&mut panel);
    find_another_daemon(&mut panel);
    assert!(is_enabled(&panel, "go to A"));
    assert!(!is_enabled(&panel, "go to B"), "nothing is kept there");
}

/// The program asks what is due before each frame, and alone while the window is hidden. The
/// interface's clock stands still meanwhile.
#[test]
fn a_try_lasts_two_seconds_of_the_systems_clock_whoever_asks() {
    let mut panel = informed();
    press(&mut panel, "try");
    enter(&mut panel, "mass value", "2");
    asked(&mut panel);
    panel.state_mut().model.apply(changed(set("mass", 2.0), 7));
    let begin = Instant::now() + Duration::from_secs(3600);
    let ctx = egui::Context::default();
    let mut wait_ms = Vec::new();
    let mut interface_s = 100.0;
    for ms in (0..2500).step_by(10) {
        let now = begin + Duration::from_millis(ms);
        let model = &mut panel.state_mut().model;
        let (intents, _) = model.due(now);
        // It lags, and then stands still.
        interface_s += if ms < 1000 { 0.009 } else { 0.0 };
        let input = egui::RawInput {
            time: Some(interface_s),
            ..egui::RawInput::default()
        };
        let mut drawn = Vec::new();
        let mut output = ctx.run_ui(input, |ui| {
            drawn = haptic_panel::ui(ui, &mut panel.state_mut().model, now);
        });
        output.textures_delta.clear();
        wait_ms.extend(intents.iter().chain(&drawn).map(|intent| (ms, intent.clone())));
    }
    let take_back = Intent::TakeBack { revision: 7 };
    assert_eq!(wait_ms, [(2000, take_back.clone())]);
    assert!(
        matches!(
            take_back.request(),
            Some(haptic_ipc::Request::Undo { options }) if options.if_revision == Some(7)
        ),
        "bound to the revision of the try"
    );
    panel.run();
    panel.get_by_label("Trying: goes back by itself");
    hear(&mut panel, changed(take_back, 8));
    assert!(panel.query_by_label("Trying: goes back by itself").is_none());
    // Somebody overtakes the next one: it stays, and that is said.
    enter(&mut panel, "mass value", "3");
    hear(&mut panel, changed(set("mass", 3.0), 9));
    wait(&mut panel, 2.5);
    let back = Intent::TakeBack { revision: 9 };
    assert_eq!(asked(&mut panel), [set("mass", 3.0), back.clone()]);
    refuse(&mut panel, back, ErrorCode::Conflict, "the newest revision is 10");
    panel.get_by_label("the try stays: the newest revision is 10");
}

#[test]
fn lists_are_used_by_keyboard_alone() {
    let mut panel = informed();
    panel.focus_on("friction law");
    panel.hit(Key::Enter);
    panel.focus_on("dahl");
    panel.hit(Key::Enter);
    assert_eq!(loading(&mut panel).0, "law dahl");
    assert!(panel.query_by_label("dahl").is_none(), "a choice closes the list");
    assert!(panel.get_by_label("friction law").is_focused());
}

#[test]
fn escape_stops_and_closes_what_is_open() {
    let mut panel = informed();
    for (opens, shows) in [
        ("friction law", "dahl"),
        ("Export", "folder to export to"),
        ("trigger", "Single"),
    ] {
        press(&mut panel, opens);
        panel.get_by_label(shows);
        panel.hit(Key::Escape);
        assert_eq!(asked(&mut panel), [Intent::Stop]);
        assert!(panel.query_by_label(shows).is_none(), "{opens}");
    }
}
