//! The page of identification: what is asked, what is shown of the answer, and what is done with it.

use crate::bench::{
    Hands as _, Panel, answer, answer_of, asked, at_page, choose_item, connected, hear, in_state, is_enabled,
    lose_the_daemon, panel, press, refuse, type_into, wait,
};
use crate::plot_list::difference;
use crate::plots::{feel, rows};
use crate::rig::status;
use crate::scene::active_scene;
use egui::Key;
use egui_kittest::kittest::{NodeT, Queryable};
use haptic_core::{Directional, Scene};
use haptic_ipc::{ChangeReply, ErrorCode, LeaseReply, RigState, SceneSaveReply};
use haptic_lab::identify::ModelKind;
use haptic_lab::identify::record_file::MovingMass;
use haptic_panel::{Answer, Files, Found, Intent, Page, Question, Update};
use std::ops::ControlFlow;
use std::path::Path;
use std::sync::LazyLock;

/// A record of 0.5 kg on a surface with 3 N of friction and 2 N s/m, pushed by a strong hand, with columns that
/// nobody could guess.
fn foreign(folder: &Path) -> std::path::PathBuf {
    let path = folder.join("foreign.csv");
    let mut text = "Zeit;Weg;Kraft\n".to_owned();
    for tick in 0..4000 {
        let t_s = f64::from(tick) * 1e-3;
        let (position, velocity, acceleration) = (
            0.02 * (9.0 * t_s).sin(),
            0.18 * (9.0 * t_s).cos(),
            -1.62 * (9.0 * t_s).sin(),
        );
        let force = 0.5 * acceleration + 3.0 * velocity.signum() + 2.0 * velocity;
        text += &format!("{t_s};{:.3};{force:.4}\n", position * 1e3);
    }
    std::fs::write(&path, text).expect("written");
    path
}

/// Types the file, hears its columns and asks. Returns number and question.
fn ask_for(panel: &mut Panel, path: &Path) -> (u64, Question) {
    type_into(panel, "file to identify", &path.display().to_string());
    panel.hit(Key::Tab);
    let path = path.to_path_buf();
    assert_eq!(asked(panel), [Intent::ReadHeadings { path: path.clone() }]);
    let names = ["Zeit", "Weg", "Kraft"].map(str::to_owned).to_vec();
    let result = Ok(Some(names));
    hear(panel, Update::Headings { path, result });
    for (list, item) in [
        ("time column", "Zeit"),
        ("position column", "Weg"),
        ("force column", "Kraft"),
    ] {
        choose_item(panel, list, item);
    }
    type_into(panel, "position gain to identify with", "0.001");
    ask(panel)
}

/// Asks. Returns number and question.
fn ask(panel: &mut Panel) -> (u64, Question) {
    press(panel, "Identify");
    match asked(panel).pop() {
        Some(Intent::Identify { number, question }) => (number, *question),
        other => panic!("{other:?}"),
    }
}

/// The answer of a thread of its own, with its number.
fn identified(files: &Files) -> (u64, Result<Box<Found>, String>) {
    answer_of(files, |update| match update {
        Update::Identified { number, result } => Some((number, result)),
        _ => None,
    })
}

/// What is found in [`foreign`].
static FOUND: LazyLock<Found> = LazyLock::new(|| {
    let folder = tempfile::tempdir().expect("a folder");
    let (_, question) = ask_for(&mut at_page(panel(), Page::Identify), &foreign(folder.path()));
    let mut files = Files::new(|_| {});
    files.identify(7, question);
    let (number, found) = identified(&files);
    assert_eq!(number, 7);
    *found.expect("an answer")
});

/// A panel with the answer.
pub(crate) fn answered(mut panel: Panel) -> Panel {
    let (number, _) = ask_for(&mut panel, Path::new("/home/ada/foreign.csv"));
    let result = Ok(Box::new(FOUND.clone()));
    hear(&mut panel, Update::Identified { number, result });
    panel
}

#[test]
fn foreign_file_is_identified_with_the_chosen_columns() {
    let mut panel = at_page(panel(), Page::Identify);
    assert!(!is_enabled(&panel, "Identify"), "there is no file yet");
    choose_item(&mut panel, "model", "Karnopp");
    let (number, question) = ask_for(&mut panel, Path::new("/home/ada/foreign.csv"));
    let source = question.file().expect("a file");
    assert_eq!(source.table.columns.position.as_deref(), Some("Weg"));
    assert_eq!(
        (source.table.position_gain, source.table.force_gain),
        (Some(1e-3), None)
    );
    assert_eq!(
        (question.options.model, question.options.mass_kg),
        (ModelKind::Karnopp, None)
    );
    panel.get_by_label("cancel identification");
    hear(&mut panel, Update::Identifying { number, share: 0.42 });
    panel.get_by_label("identified 42 %");
    let result = Ok(Box::new(FOUND.clone()));
    hear(
        &mut panel,
        Update::Identified {
            number: number + 1,
            result: result.clone(),
        },
    );
    panel.get_by_label("cancel identification");
    hear(&mut panel, Update::Identified { number, result });
    for text in [
        "mass",
        "dynamic friction +",
        "viscous friction -",
        "Force against velocity of the fit",
    ] {
        panel.get_by_label(text);
    }
    panel.get_by_label_contains("Karnopp, residual 0.0");
    panel.get_by_label_contains("Not determined: static friction");
    panel.get_by_label_contains("Record instead");
    assert!(!is_enabled(&panel, "Try this for 2 s"), "there is no daemon");
    assert_eq!(asked(&mut panel), [], "nobody is asked for advice");
}

#[test]
fn plots_of_the_fit_are_inside_the_smallest_window() {
    let panel = answered(at_page(panel(), Page::Identify));
    let window = panel.ctx.content_rect();
    let plots: Vec<_> = panel.get_all_by_label_contains(" of the fit").collect();
    assert_eq!(plots.len(), 4);
    let texts = panel.get_all_by_label_contains("measured");
    for part in plots.into_iter().chain(texts) {
        let rect = part.rect();
        assert!(
            window.contains_rect(rect),
            "{:?} at {rect:?}",
            part.accesskit_node().label()
        );
    }
}

#[test]
fn columns_gains_and_what_is_known_are_given() {
    let mut panel = at_page(panel(), Page::Identify);
    type_into(&mut panel, "mass to identify with", "500 g");
    type_into(&mut panel, "offset to identify with", "0");
    choose_item(&mut panel, "model", "LuGre");
    ask_for(&mut panel, Path::new("/home/ada/foreign.csv"));
    press(&mut panel, "cancel identification");
    assert_eq!(asked(&mut panel), [Intent::CancelIdentify]);
    choose_item(&mut panel, "velocity column", "Weg");
    type_into(&mut panel, "force gain to identify with", "9.81");
    choose_item(&mut panel, "moving mass", "the device");
    assert!(!is_enabled(&panel, "The recording, as seen"), "none is open");
    press(&mut panel, "The rig, as seen");
    assert!(panel.query_by_label("velocity column").is_none());
    press(&mut panel, "A file");
    let (_, question) = ask(&mut panel);
    let options = &question.options;
    assert_eq!(
        (options.model, options.mass_kg, options.offset_n),
        (ModelKind::Lugre, Some(0.5), Some(0.0))
    );
    let source = question.file().expect("a file");
    assert_eq!(source.table.columns.velocity.as_deref(), Some("Weg"));
    assert_eq!(
        (source.table.force_gain, source.moving),
        (Some(9.81), MovingMass::Device)
    );
    press(&mut panel, "cancel identification");
    type_into(&mut panel, "mass to identify with", "heavy");
    panel.get_by_label_contains("Mass: `heavy` is not a finite number");
    assert!(!is_enabled(&panel, "Identify"));
}

#[test]
fn visible_rig_samples_are_identified_and_refusal_explained() {
    let mut panel = connected(RigState::Engaged);
    hear(&mut panel, active_scene(1, &Scene::paper()));
    let mut panel = at_page(panel, Page::Identify);
    press(&mut panel, "The rig, as seen");
    panel.get_by_label_contains("The daemon has not sent its scene yet");
    hear(&mut panel, Update::Status(Ok(Box::new(status()))));
    panel.get_by_label("There is no sample in sight");
    feel(&mut panel, &rows(0..2000, |_| 1.0));
    let (number, question) = ask(&mut panel);
    assert_eq!(
        (question.file(), question.origin().as_str()),
        (None, "what is seen of the rig, 2.0 s")
    );
    // The block of these rows never moves.
    let result = question.answer(&mut |_| ControlFlow::Continue(())).map(Box::new);
    hear(&mut panel, Update::Identified { number, result });
    panel.get_by_label_contains("Not determined: mass");
    panel.get_by_label_contains("a scene needs mass_kg");
    assert!(panel.query_by_label("Try this for 2 s").is_none());
    press(&mut panel, "Tune page");
    press(&mut panel, "Cursors");
    press(&mut panel, "Identify page");
    asked(&mut panel);
    let (_, between) = ask(&mut panel);
    assert_eq!(between.origin(), "what is between the cursors at the rig, 0.3 s");
}

fn changed(revision: u64, dry_run: bool) -> Answer {
    Answer::Changed(ChangeReply {
        revision,
        changed: !dry_run,
        tick: Some(1),
        dry_run,
        changes: vec![difference("mass", "kg", 0.5, Directional::both(1.0))],
        ..ChangeReply::default()
    })
}

#[test]
fn identified_scene_is_tried_under_a_lease_and_taken_back() {
    let mut panel = answered(at_page(connected(RigState::Engaged), Page::Identify));
    let usual = asked(&mut panel);
    // The coupling that suits this rig.
    let mut active = Scene::paper();
    active.coupling.as_mut().expect("it has one").stiffness = 7000.0;
    hear(&mut panel, active_scene(1, &active));
    let foreseen = asked(&mut panel);
    let ([Intent::Foresee { scene: with_usual }], [Intent::Foresee { scene }]) = (&usual[..], &foreseen[..]) else {
        panic!("{usual:?}, {foreseen:?}")
    };
    assert_eq!(
        (scene.coupling, &scene.friction),
        (active.coupling, &with_usual.friction)
    );
    assert_ne!(scene.coupling, with_usual.coupling);
    assert!(
        foreseen[0]
            .request()
            .is_some_and(|request| format!("{request:?}").contains("dry_run: true"))
    );
    answer(&mut panel, foreseen[0].clone(), changed(1, true));
    panel.get_by_label_contains("no objection");
    press(&mut panel, "Try this for 2 s");
    let lease = Intent::Lease { timeout_ms: 3000 };
    assert_eq!(asked(&mut panel), std::slice::from_ref(&lease), "first the lease");
    answer(
        &mut panel,
        lease.clone(),
        Answer::Leased(LeaseReply { timeout_ms: 3000 }),
    );
    let tried = Intent::Try { scene: scene.clone() };
    assert_eq!(asked(&mut panel), std::slice::from_ref(&tried));
    answer(&mut panel, tried, changed(2, false));
    assert!(!is_enabled(&panel, "Try this for 2 s"), "one is under way");
    wait(&mut panel, 1.0);
    assert_eq!(asked(&mut panel), [], "it lasts two seconds");
    wait(&mut panel, 1.5);
    let back = Intent::TakeBack { revision: 2 };
    assert_eq!(asked(&mut panel), std::slice::from_ref(&back));
    answer(&mut panel, back, changed(3, false));
    assert_eq!(
        asked(&mut panel),
        [Intent::Lease { timeout_ms: 0 }],
        "then the lease ends"
    );
    panel.run();
    assert!(is_enabled(&panel, "Try this for 2 s"));
    // Without a lease nothing is tried.
    press(&mut panel, "Try this for 2 s");
    asked(&mut panel);
    refuse(&mut panel, lease, ErrorCode::Unknown, "somebody commissions the rig");
    assert_eq!(asked(&mut panel), []);
    panel.get_by_label_contains("Not tried: no lease: somebody commissions the rig");
    lose_the_daemon(&mut panel);
    assert!(!is_enabled(&panel, "Try this for 2 s"));
    hear(&mut panel, in_state(RigState::Idle, 200));
}

#[test]
fn identified_scene_is_saved_and_replaces_only_on_request() {
    let mut panel = answered(at_page(connected(RigState::Idle), Page::Identify));
    asked(&mut panel);
    assert!(!is_enabled(&panel, "Save as scene"), "it has no name");
    type_into(&mut panel, "name of the identified scene", "bench");
    press(&mut panel, "Save as scene");
    let saved = asked(&mut panel).pop();
    let Some(Intent::Save {
        name,
        replace: false,
        scene: Some(scene),
    }) = &saved
    else {
        panic!("{saved:?}")
    };
    assert_eq!((name.as_str(), scene.name.as_str()), ("bench", "bench"));
    let intent = saved.clone().expect("it is asked");
    refuse(&mut panel, intent, ErrorCode::SceneExists, "there is one");
    panel.get_by_label_contains("The library has a scene bench already");
    press(&mut panel, "Replace bench");
    let intent = asked(&mut panel).pop().expect("it is asked");
    let replaces = |intent: &Intent| {
        matches!(
            intent,
            Intent::Save {
                replace: true,
                scene: Some(_),
                ..
            }
        )
    };
    assert!(replaces(&intent), "{intent:?}");
    let reply = SceneSaveReply {
        name: "bench".to_owned(),
        path: "/scenes/bench.toml".to_owned(),
    };
    answer(&mut panel, intent, Answer::Saved(reply));
    panel.get_by_label("Saved as bench (/scenes/bench.toml)");
    panel.state_mut().model.turn_to(Page::Tune);
    panel.run();
    assert!(
        panel.query_by_label_contains("Replace bench").is_none(),
        "there it would save the active scene"
    );
}

#[test]
fn identification_on_its_own_thread_can_be_cancelled() {
    let folder = tempfile::tempdir().expect("a folder");
    let (_, question) = ask_for(&mut at_page(panel(), Page::Identify), &foreign(folder.path()));
    let mut files = Files::new(|_| {});
    files.identify(8, question);
    files.cancel_identify();
    let (8, Err(why)) = identified(&files) else {
        panic!("it is given up")
    };
    assert!(why.contains("cancelled"), "{why}");
}
