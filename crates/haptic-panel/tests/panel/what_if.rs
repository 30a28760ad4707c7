//! What would have been felt along a recording: asked for by its menu, drawn over it.

use crate::bench::{
    Panel, answer, answer_of, asked, at_page, connected, hear, is_enabled, lose_the_daemon, panel, press, refuse,
};
use crate::library::listed;
use crate::metadata::metadata;
use crate::plots::svg;
use crate::scene::active_scene;
use egui_kittest::kittest::Queryable;
use haptic_core::Scene;
use haptic_core::scene::SceneFile;
use haptic_ipc::{ErrorCode, Event, ListedScene, RigState, Sample, SampleY, SamplesEvent, SceneListReply, SceneReply};
use haptic_panel::{Answer, Files, Intent, Loaded, Page, Update, WhatIfTape};
use haptic_recording::{Mark, Metadata};
use std::path::PathBuf;
use std::sync::atomic::AtomicBool;

/// A second of a hand at 1 Hz under force, as a recording that begins with force.
fn motion() -> Vec<Sample> {
    let row = |tick: u32| {
        let t_s = f64::from(tick) * 1e-3;
        Sample {
            tick: tick.into(),
            t_s,
            state: RigState::Engaged,
            device_position_m: 0.03 * (6.3 * t_s).sin(),
            sample_position_m: 0.03 * (6.3 * t_s).sin(),
            device_velocity_mps: 0.189 * (6.3 * t_s).cos(),
            command_force_n: 1.0,
            revision: 1,
            elapsed_ns: 1_000_000,
            device_sequence: tick,
            device_time_ns: u64::from(tick) * 1_000_000,
            ..Sample::default()
        }
    };
    (1000..2000).map(row).collect()
}

/// A recording of [`motion`] with a marker, as a file of a rig of so many axes: on two the hand draws a circle.
fn recorded(axes: u8, folder: &std::path::Path) -> PathBuf {
    let path = folder.join("motion.csv");
    let about = Metadata { axes, ..metadata() };
    let mut recorder = haptic_recording::create(&path, &about, false).expect("begun");
    recorder.mark(Mark::Marker {
        tick: 1400,
        text: "here & now".to_owned(),
    });
    let rows = motion();
    let y = |row: &Sample| SampleY {
        device_position_m: 0.03 * (6.3 * row.t_s).cos(),
        sample_position_m: 0.03 * (6.3 * row.t_s).cos(),
        device_velocity_mps: -0.189 * (6.3 * row.t_s).sin(),
        ..SampleY::default()
    };
    let rows_y = if axes == 2 {
        rows.iter().map(y).collect()
    } else {
        Vec::new()
    };
    recorder
        .event(&Event::Samples(SamplesEvent {
            rows,
            rows_y,
            ..SamplesEvent::default()
        }))
        .expect("written");
    recorder.finish().expect("written");
    path
}

/// A panel whose daemon renders a scene, with the recording open.
fn looking_at(path: &std::path::Path, scene: &Scene) -> Panel {
    let mut panel = connected(RigState::Engaged);
    hear(&mut panel, active_scene(1, scene));
    let result = Loaded::read(path, |_| {}).map(Box::new);
    let path = path.to_path_buf();
    hear(&mut panel, Update::Opened { path, result });
    // The list of recordings.
    asked(&mut panel);
    panel
}

/// Asks for a rendering by an item of the menu. Returns the question.
fn ask(panel: &mut Panel, item: &str) -> (u64, PathBuf, Option<SceneFile>) {
    press(panel, "What if...");
    press(panel, item);
    match asked(panel).pop() {
        Some(Intent::WhatIf { number, path, scene }) => (number, path, scene.map(|scene| *scene)),
        other => panic!("{other:?}"),
    }
}

/// What a thread of its own makes of a question.
fn rendered(number: u64, path: PathBuf, scene: Option<SceneFile>) -> (u64, Result<Box<WhatIfTape>, String>) {
    let mut files = Files::new(|_| {});
    files.what_if(number, path, scene);
    answer_of(&files, |update| match update {
        Update::WhatIf { number, result } => Some((number, result)),
        _ => None,
    })
}

fn stickier() -> Scene {
    let scene = Scene::paper().with(&[("Fd".parse().expect("a parameter"), 9.0)]);
    Scene {
        name: "sticky".to_owned(),
        ..scene.expect("a scene")
    }
}

#[test]
fn what_if_of_the_edited_scene_is_drawn_over_the_recording() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = recorded(1, folder.path());
    let mut panel = looking_at(&path, &stickier());
    for marker in [">here &amp; now</text>", "class=\"mark "] {
        assert!(svg(&panel).contains(marker), "{marker}");
    }
    assert!(!svg(&panel).contains("What if"));
    let plot = panel.get_by_label("Force plot").rect();
    let (number, path, scene) = ask(&mut panel, "what if: active scene");
    assert_eq!(scene, Some(stickier().into()));
    panel.get_by_label("Cancel what-if");
    let (number, result) = rendered(number, path, scene);
    // The answer to another question is not shown.
    let other = Update::WhatIf {
        number: number + 1,
        result: result.clone(),
    };
    hear(&mut panel, other);
    panel.get_by_label("Cancel what-if");
    hear(&mut panel, Update::WhatIf { number, result });
    panel.get_by_label_contains("What if sticky: 8.");
    panel.get_by_label_contains("N rms instead of 1.00 N");
    assert_eq!(panel.get_by_label("Force plot").rect(), plot, "an answer moves nothing");
    panel.get_by_label_contains("does not react to the other force");
    assert!(svg(&panel).contains(">What if</text>"));
    press(&mut panel, "Hide what-if");
    assert!(!svg(&panel).contains("What if"));
    assert_eq!(asked(&mut panel), [Intent::CancelWhatIf]);
}

#[test]
fn what_if_of_a_plane_is_drawn_by_its_parts() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = recorded(2, folder.path());
    let mut panel = looking_at(&path, &stickier());
    let (number, path, scene) = ask(&mut panel, "what if: active scene");
    let (number, result) = rendered(number, path, scene);
    hear(&mut panel, Update::WhatIf { number, result });
    panel.get_by_label_contains("What if sticky: 9.");
    let svg = svg(&panel);
    for line in [">What if, x</text>", ">What if, y</text>"] {
        assert!(svg.contains(line), "{line}");
    }
}

#[test]
fn recording_is_replayed_without_a_daemon() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = recorded(1, folder.path());
    let mut panel = at_page(panel(), Page::Record);
    let result = Loaded::read(&path, |_| {}).map(Box::new);
    let opened = Update::Opened { path, result };
    hear(&mut panel, opened);
    asked(&mut panel);
    press(&mut panel, "What if...");
    assert!(!is_enabled(&panel, "what if: active scene"), "there is none");
    press(&mut panel, "What if...");
    let (number, path, scene) = ask(&mut panel, "what if: own scenes");
    assert_eq!(scene, None);
    let (number, result) = rendered(number, path, None);
    hear(&mut panel, Update::WhatIf { number, result });
    panel.get_by_label_contains("Replay of 1000 ticks: the force differs by up to");
    press(&mut panel, "Hide what-if");
    asked(&mut panel);
    let (_, _, scene) = ask(&mut panel, "what if: high-stiction");
    assert_eq!(scene.map(|scene| scene.name).as_deref(), Some("high stiction"));
}

#[test]
fn what_if_of_a_saved_scene_asks_the_daemon_for_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let recording = recorded(1, folder.path());
    let mut panel = looking_at(&recording, &stickier());
    let saved = ListedScene {
        path: Some("/elsewhere/ours.toml".into()),
        ..listed("ours")
    };
    let scenes = vec![listed("high-stiction"), saved];
    hear(&mut panel, Update::Library(Ok(SceneListReply { scenes })));
    let ask = |panel: &mut Panel| {
        press(panel, "What if...");
        press(panel, "what if: ours");
        let asked_for = asked(panel).pop().expect("the scene");
        assert!(
            matches!(&asked_for, Intent::WhatIfSaved { name, .. } if name == "ours"),
            "{asked_for:?}"
        );
        panel.get_by_label("Cancel what-if");
        asked_for
    };
    let intent = ask(&mut panel);
    refuse(&mut panel, intent, ErrorCode::NoSuchScene, "there is no scene `ours`");
    panel.get_by_label_contains("there is no scene `ours`");
    let intent = ask(&mut panel);
    let reply = SceneReply {
        revision: 7,
        scene: stickier(),
        params: std::collections::BTreeMap::default(),
    };
    answer(&mut panel, intent, Answer::Scene(Box::new(reply)));
    let due = asked(&mut panel);
    let [
        Intent::WhatIf {
            path,
            scene: Some(scene),
            ..
        },
    ] = &due[..]
    else {
        panic!("{due:?}")
    };
    let ours = Scene {
        name: "ours".into(),
        ..stickier()
    };
    assert_eq!((path, &**scene), (&recording, &ours.into()));
    press(&mut panel, "Cancel what-if");
    asked(&mut panel);
    ask(&mut panel);
    lose_the_daemon(&mut panel);
    panel.get_by_label("What if...");
}

#[test]
fn cancelled_what_if_shows_nothing_and_failed_one_its_reason() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = recorded(1, folder.path());
    let mut panel = looking_at(&path, &stickier());
    let (number, ..) = ask(&mut panel, "what if: active scene");
    press(&mut panel, "Cancel what-if");
    assert_eq!(asked(&mut panel), [Intent::CancelWhatIf]);
    let given_up = WhatIfTape::render(&path, Some(stickier().into()), &AtomicBool::new(true));
    let why = given_up.expect_err("it is given up");
    let late = Update::WhatIf {
        number,
        result: Err(why),
    };
    hear(&mut panel, late);
    panel.get_by_label("What if...");
    assert!(panel.query_by_label_contains("given up").is_none());
    let (number, _, scene) = ask(&mut panel, "what if: active scene");
    let gone = folder.path().join("gone.csv");
    let (number, result) = rendered(number, gone, scene);
    hear(&mut panel, Update::WhatIf { number, result });
    panel.get_by_label_contains("gone.csv");
    panel.get_by_label("What if...");
    ask(&mut panel, "what if: active scene");
    press(&mut panel, "Close recording");
    assert_eq!(asked(&mut panel), [Intent::CancelWhatIf]);
}
