//! What is done to the scene as a whole: law, undo and redo, A and B, tries, the library.

use super::*;
use haptic_ipc::{
    Difference, JournalEntry, ListedScene, Peer, SceneDiffReply, SceneListReply, SceneRef, SceneReply, SceneSaveReply,
    Value,
};

fn scene_in_force(revision: u64, scene: &Scene) -> Update {
    Update::Scene(Ok(Box::new(SceneReply {
        revision,
        params: params_of(scene),
        scene: scene.clone(),
    })))
}

/// A panel that knows the whole of the paper's scene.
fn informed() -> Panel {
    let mut panel = connected(RigState::Engaged);
    hear(&mut panel, scene_in_force(1, &Scene::paper()));
    panel
}

fn changed(intent: Intent, revision: u64) -> Update {
    let reply = ChangeReply {
        revision,
        tick: Some(1000 + revision),
        ramp_ends_tick: None,
        dry_run: false,
        applied: [].into(),
        changes: vec![],
        advice: vec![],
    };
    Update::Answered {
        intent,
        result: Ok(Answer::Changed(reply)),
    }
}

#[test]
fn another_law_is_a_whole_scene_that_keeps_what_both_have() {
    let mut panel = informed();
    press(&mut panel, "friction law");
    press(&mut panel, "dahl");
    let asked = asked(&mut panel);
    let [
        Intent::Load {
            what,
            scene: SceneRef::Scene(scene),
            ramp_ms: None,
        },
    ] = asked.as_slice()
    else {
        panic!("{asked:?}");
    };
    assert_eq!(what, "law dahl");
    assert_eq!(**scene, Scene::paper().with_law("dahl").unwrap().unwrap());

    // The daemon has done it: the panel shows the parameters of that law, and no others.
    let mut event = state_event(RigState::Engaged, 300);
    (event.revision, event.law, event.params) = (2, "dahl".to_owned(), params_of(scene));
    hear(&mut panel, Update::Event(Event::State(event)));
    let description = Description {
        laws: vec![],
        law: "dahl".into(),
        parameters: ParameterDescription::all_of(scene),
        sample_columns: vec![],
    };
    hear(&mut panel, Update::Described(description));
    panel.get_by_label("exponent slider");
    assert!(panel.query_by_label("static force slider").is_none());
}

#[test]
fn undo_and_redo_show_how_far_they_reach_and_who_made_the_last_change() {
    let mut panel = connected(RigState::Engaged);
    assert!(!is_enabled(&panel, "undo") && !is_enabled(&panel, "redo"));
    hear(&mut panel, of_depth(3, 1));
    let entry = JournalEntry {
        seq: 1,
        time_unix_s: 0.0,
        tick: None,
        by: Some(Peer {
            user: Some("ada".into()),
            ..Peer::default()
        }),
        op: "set".into(),
        revision: 1,
        state: None,
        changes: vec![Difference {
            param: "mass".into(),
            unit: Some("kg".into()),
            before: Some(Value::Number(Directional::both(0.5))),
            after: Some(Value::Number(Directional::both(1.0))),
        }],
        ramp_ms: None,
        message: None,
    };
    hear(&mut panel, Update::Event(Event::Log(Box::new(entry))));
    press(&mut panel, "Changes");
    panel.get_by_label("00:00:00 UTC ada: set, mass: 0.5 kg -> 1 kg");
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
    panel.key_press_modifiers(undo, Key::Z);
    panel.run();
    assert_eq!(asked(&mut panel), [], "there is nothing to undo");
    hear(&mut panel, of_depth(1, 1));
    panel.key_press_modifiers(undo, Key::Z);
    panel.run();
    panel.key_press_modifiers(redo, Key::Z);
    panel.run();
    assert_eq!(asked(&mut panel), [Intent::Undo, Intent::Redo]);
    type_into(&mut panel, "mass value", "7");
    panel.key_press_modifiers(undo, Key::Z);
    panel.run();
    assert_eq!(asked(&mut panel), [], "the field's own undo");
}

#[test]
fn two_scenes_are_kept_and_switched_between() {
    let mut panel = informed();
    assert!(!is_enabled(&panel, "switch between A and B"));
    press(&mut panel, "keep as A");
    let heavy = Scene::paper().with(&[("M".parse().unwrap(), 2.0)]).unwrap();
    hear(&mut panel, scene_in_force(2, &heavy));
    press(&mut panel, "keep as B");
    press(&mut panel, "switch between A and B");
    let asked = asked(&mut panel);
    let [
        Intent::Load {
            what,
            scene: SceneRef::Scene(scene),
            ..
        },
    ] = asked.as_slice()
    else {
        panic!("{asked:?}");
    };
    assert_eq!((what.as_str(), &**scene), ("A", &Scene::paper()));
    let to_a = asked[0].clone();
    hear(&mut panel, scene_in_force(3, &Scene::paper()));
    hear(&mut panel, changed(to_a, 3));
    panel.get_by_label("Loaded A at tick 1003");
    press(&mut panel, "switch between A and B");
    let asked = super::asked(&mut panel);
    assert!(
        matches!(asked.as_slice(), [Intent::Load { what, .. }] if what == "B"),
        "{asked:?}"
    );
}

#[test]
fn what_is_kept_outlives_the_daemon() {
    let mut panel = informed();
    press(&mut panel, "keep as A");
    let lost = Update::Disconnected {
        path: SOCKET.into(),
        reason: "gone".into(),
    };
    hear(&mut panel, lost);
    let hello = Hello {
        protocol: 1,
        server: "hapticd 0.1.0".into(),
        session: "1-2".into(),
    };
    let path = SOCKET.into();
    hear(&mut panel, Update::Connected { path, hello });
    hear(&mut panel, in_state(RigState::Idle, 1));
    assert!(is_enabled(&panel, "go to A"));
}

#[test]
fn a_try_goes_back_by_itself_after_two_seconds() {
    let mut panel = informed();
    press(&mut panel, "try");
    type_into(&mut panel, "mass value", "2");
    panel.key_press(Key::Enter);
    panel.run();
    assert_eq!(asked(&mut panel), [set("mass", 2.0)]);
    hear(&mut panel, changed(set("mass", 2.0), 7));
    panel.get_by_label("Trying: goes back by itself");
    wait(&mut panel, 1.5);
    assert_eq!(asked(&mut panel), []);
    wait(&mut panel, 1.0);
    let take_back = Intent::TakeBack { revision: 7 };
    assert_eq!(asked(&mut panel), std::slice::from_ref(&take_back));
    assert!(
        matches!(
            take_back.request(),
            Some(haptic_ipc::Request::Undo {
                if_revision: Some(7),
                ..
            })
        ),
        "bound to the revision of the try"
    );
    hear(&mut panel, changed(take_back, 8));
    assert!(panel.query_by_label("Trying: goes back by itself").is_none());
}

#[test]
fn a_try_that_somebody_has_overtaken_stays_and_says_so() {
    let mut panel = informed();
    press(&mut panel, "try");
    type_into(&mut panel, "mass value", "2");
    panel.key_press(Key::Enter);
    panel.run();
    hear(&mut panel, changed(set("mass", 2.0), 7));
    wait(&mut panel, 2.5);
    let refused = Update::Answered {
        intent: Intent::TakeBack { revision: 7 },
        result: Err(WireError::new(ErrorCode::Conflict, "the newest revision is 8")),
    };
    hear(&mut panel, refused);
    panel.get_by_label("the try stays: the newest revision is 8");
}

#[test]
fn the_library_is_loaded_from_and_saved_to() {
    let mut panel = informed();
    let listed = |name: &str, problem: Option<&str>| ListedScene {
        name: name.into(),
        title: "A title".into(),
        law: "karnopp".into(),
        path: None,
        problem: problem.map(str::to_owned),
    };
    let scenes = vec![listed("high-stiction", None), listed("broken", Some("line 3: no law"))];
    hear(&mut panel, Update::Library(Ok(SceneListReply { scenes })));
    press(&mut panel, "Scenes");
    press(&mut panel, "load high-stiction");
    let asked = asked(&mut panel);
    assert!(
        matches!(asked.as_slice(), [Intent::Load { scene: SceneRef::Name(name), .. }] if name == "high-stiction"),
        "{asked:?}"
    );
    assert!(!is_enabled(&panel, "load broken"));
    panel.get_by_label("line 3: no law");

    panel.get_by_label("name to save as").scroll_to_me();
    panel.run();
    type_into(&mut panel, "name to save as", "mine");
    press(&mut panel, "save scene");
    let save = |replace| Intent::Save {
        name: "mine".into(),
        replace,
    };
    assert_eq!(super::asked(&mut panel), [save(false)]);
    let refused = Update::Answered {
        intent: save(false),
        result: Err(WireError::new(ErrorCode::SceneExists, "there is a scene `mine`")),
    };
    hear(&mut panel, refused);
    panel.get_by_label("there is a scene `mine`");
    press(&mut panel, "Replace mine");
    assert_eq!(super::asked(&mut panel), [save(true)]);
    let saved = SceneSaveReply {
        name: "mine".into(),
        path: "/scenes/mine.toml".into(),
    };
    let saved = Update::Answered {
        intent: save(true),
        result: Ok(Answer::Saved(saved)),
    };
    hear(&mut panel, saved);
    panel.get_by_label("Saved as mine (/scenes/mine.toml)");
}

#[test]
fn the_scene_in_force_is_compared() {
    let mut panel = informed();
    press(&mut panel, "keep as A");
    press(&mut panel, "Scenes");
    press(&mut panel, "compare with");
    // The one in the list: the buttons of the slot are named otherwise.
    let item = panel.get_all_by_label("A").last().expect("an item");
    item.click();
    panel.run();
    let asked = asked(&mut panel);
    let [intent @ Intent::Compare { what, .. }] = asked.as_slice() else {
        panic!("{asked:?}");
    };
    assert_eq!(what, "A");
    let difference = Difference {
        param: "static_force".into(),
        unit: Some("N".into()),
        before: Some(Value::Number(Directional::both(4.0))),
        after: Some(Value::Number(Directional {
            positive: 5.0,
            negative: 3.0,
        })),
    };
    let differs = Update::Answered {
        intent: intent.clone(),
        result: Ok(Answer::Differs(SceneDiffReply {
            differences: vec![difference],
        })),
    };
    hear(&mut panel, differs);
    panel.get_by_label("static_force: 4 N -> +5 -3 N");
}
