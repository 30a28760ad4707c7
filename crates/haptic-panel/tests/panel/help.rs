//! The help in the window, and the buttons of empty pages.

use crate::bench::{Hands as _, Panel, asked, at_page, connected, is_enabled, panel, press, type_into, value_of};
use crate::plots::{feel, rows};
use egui::{Event, Key};
use egui_kittest::kittest::Queryable;
use haptic_ipc::RigState;
use haptic_panel::{DialogPurpose, Intent, Page, StudyCommand};

fn is_open(panel: &Panel) -> bool {
    panel.query_by_label("The sign of force").is_some()
}

fn ask(panel: &mut Panel) {
    panel.event(Event::Text("?".to_owned()));
    panel.run();
}

#[test]
fn help_is_opened_and_closed_by_keys_and_button() {
    let mut panel = panel();
    for page in Page::ALL {
        panel.state_mut().model.turn_to(*page);
        panel.run();
        for opens in [0, 1, 2] {
            for is_wanted in [true, false] {
                match opens {
                    0 => ask(&mut panel),
                    1 => panel.key_press(Key::F1),
                    _ => panel.get_by_label("help").click(),
                }
                panel.run();
                assert_eq!(is_open(&panel), is_wanted, "{page:?}, {opens}");
            }
        }
    }
    ask(&mut panel);
    press(&mut panel, "Close window");
    assert!(!is_open(&panel));
}

#[test]
fn a_question_mark_is_typed_in_a_field() {
    let mut panel = connected(RigState::Idle);
    type_into(&mut panel, "mass value", "5");
    ask(&mut panel);
    assert_eq!(value_of(&panel, "mass value"), "5?");
    assert!(!is_open(&panel));
}

#[test]
fn help_covers_no_stop_and_a_stop_closes_it() {
    for key in [Key::Space, Key::Escape] {
        let mut panel = connected(RigState::Engaged);
        ask(&mut panel);
        panel.run();
        let (stop, window) = (panel.get_by_label("Stop").rect(), panel.ctx.content_rect());
        for part in ["Keys", "What a plot shows"] {
            let part = panel.get_by_label(part).rect();
            assert!(part.top() > stop.bottom() && window.contains_rect(part), "{part}");
        }
        panel.click_on("Stop");
        assert_eq!(asked(&mut panel), [Intent::Stop]);
        assert!(!is_open(&panel));
        ask(&mut panel);
        panel.hit(key);
        assert_eq!(asked(&mut panel), [Intent::Stop]);
        assert!(!is_open(&panel));
    }
}

#[test]
fn an_empty_page_has_a_button_for_the_next_step() {
    for (page, button, purpose) in [
        (Page::Record, "open a recording", DialogPurpose::Recording),
        (Page::Identify, "choose a file", DialogPurpose::FileToIdentify),
        (Page::Task, "choose a folder for a study", DialogPurpose::StudyFolder),
        (
            Page::Perception,
            "choose a folder for a study",
            DialogPurpose::StudyFolder,
        ),
    ] {
        let mut panel = at_page(panel(), page);
        press(&mut panel, button);
        let asked = asked(&mut panel);
        assert!(
            matches!(asked[..], [Intent::Choose { purpose: asked, .. }] if asked == purpose),
            "{page:?}: {asked:?}"
        );
    }
}

#[test]
fn an_empty_study_page_makes_the_study_whose_folder_is_named() {
    let mut panel = at_page(connected(RigState::Idle), Page::Task);
    type_into(&mut panel, "folder of the study", "/home/ada/study");
    panel.get_by_label("Open this study");
    press(&mut panel, "Make this study");
    let asked = asked(&mut panel);
    assert!(
        matches!(&asked[..], [Intent::Study(StudyCommand::Create { folder, .. })] if folder.ends_with("study")),
        "{asked:?}"
    );
    assert!(panel.query_by_label("Make this study").is_none(), "it is being made");
}

#[test]
fn an_empty_identify_page_takes_what_is_seen_of_the_rig() {
    let mut panel = at_page(connected(RigState::Engaged), Page::Identify);
    assert!(!is_enabled(&panel, "Use what is seen of the rig"));
    feel(&mut panel, &rows(0..1000, |_| 2.0));
    panel.get_by_label("file to identify");
    press(&mut panel, "Use what is seen of the rig");
    assert!(panel.query_by_label("file to identify").is_none(), "the rig is chosen");
}
