//! The pages of studies: what is typed, asked and shown, and the subject's window.

use crate::bench::{
    Hands as _, Panel, asked, at_page, connected, hear, is_enabled, panel, press, strike, type_into, value_of,
};
use crate::plots::felt;
use egui::Key;
use egui_kittest::kittest::Queryable;
use haptic_ipc::RigState;
use haptic_panel::{
    Intent, Page, Stage, StudyCommand, StudyNews, StudyPlan, StudyRow, StudyState, SubjectState, Update,
};
use haptic_studies::plan::Task;

pub(crate) fn state(task: Task, stage: Stage) -> StudyState {
    let subject = |code: &str, progress| SubjectState {
        code: code.to_owned(),
        progress,
        time_left: None,
        is_finished: false,
    };
    StudyState {
        folder: "/home/ada/study".into(),
        task,
        plan: "targets under five resistances".to_owned(),
        subjects: vec![subject("01", Some((12, Some(440)))), subject("02", None)],
        subject: 0,
        stage,
        now: vec![("Resistance", "viscous".to_owned()), ("Trial", "3".to_owned())],
        target_m: Some([0.02, 0.04]),
        columns: &["Block", "Time (s)"],
    }
}

pub(crate) fn held() -> Stage {
    Stage::Held {
        why: "Paused".to_owned(),
        is_trouble: false,
    }
}

pub(crate) fn running() -> Stage {
    Stage::Running {
        what: "The subject moves to the target".to_owned(),
    }
}

pub(crate) fn tell(panel: &mut Panel, news: StudyNews) {
    hear(panel, Update::Study(news));
}

/// What was asked of the study.
fn commands(panel: &mut Panel) -> Vec<StudyCommand> {
    let intents = asked(panel).into_iter();
    let commands = intents.map(|intent| match intent {
        Intent::Study(command) => command,
        other => panic!("{other:?}"),
    });
    commands.collect()
}

#[test]
fn typed_fields_make_a_study_and_wrong_fields_are_named() {
    for (page, plan) in [(Page::Task, Task::Fitts), (Page::Perception, Task::Perception)] {
        let mut panel = at_page(panel(), page);
        assert!(!is_enabled(&panel, "New study"));
        panel.get_by_label("Name the study's folder");
        type_into(&mut panel, "folder of the study", "/home/ada/study");
        type_into(&mut panel, "subjects of the study", "0");
        panel.get_by_label_contains("Subjects: 0 subjects: there must be 1 to 999");
        type_into(&mut panel, "subjects of the study", "P1,P/2");
        panel.get_by_label_contains("Subjects: subject `P/2`");
        type_into(&mut panel, "subjects of the study", "P1, P2");
        type_into(&mut panel, "seed of the study", "x");
        panel.get_by_label_contains("Seed: `x` is not a whole number");
        assert!(!is_enabled(&panel, "New study"));
        type_into(&mut panel, "seed of the study", "7");
        press(&mut panel, "New study");
        let create = |plan| StudyCommand::Create {
            folder: "/home/ada/study".into(),
            plan,
            subjects: vec!["P1".to_owned(), "P2".to_owned()],
            seed: 7,
        };
        assert_eq!(commands(&mut panel), [create(StudyPlan::BuiltIn(plan))]);
        assert!(!is_enabled(&panel, "New study"), "it is being made");
        tell(&mut panel, StudyNews::Failed("it is there already".to_owned()));
        panel.get_by_label("it is there already");
        type_into(&mut panel, "plan of the study", "my.toml");
        press(&mut panel, "New study");
        assert_eq!(commands(&mut panel), [create(StudyPlan::File("my.toml".into()))]);
        tell(&mut panel, StudyNews::Failed("no".to_owned()));
        press(&mut panel, "Open study");
        let folder = "/home/ada/study".into();
        assert_eq!(commands(&mut panel), [StudyCommand::Open { folder }]);
    }
}

#[test]
fn open_study_turns_to_its_page_and_controls_send_commands() {
    let mut panel = felt(0..2000, |_| 1.0);
    tell(&mut panel, StudyNews::State(Box::new(state(Task::Fitts, held()))));
    assert_eq!(panel.state().model.page(), Page::Task);
    asked(&mut panel);
    for text in [
        "Paused",
        "Resistance",
        "viscous",
        "12 of 440 trials",
        "study position plot",
        "study force plot",
        "No trial since the study was opened; its files have those before",
    ] {
        panel.get_by_label(text);
    }
    panel.get_by_label_contains("Cursor latency: not measured yet");
    assert!(!is_enabled(&panel, "Pause"));
    press(&mut panel, "Go on");
    assert_eq!(commands(&mut panel), [StudyCommand::GoOn]);
    crate::bench::choose_item(&mut panel, "subject", "Subject 02");
    assert_eq!(commands(&mut panel), [StudyCommand::Choose(1)]);
    type_into(&mut panel, "note on the study", "late");
    press(&mut panel, "Note");
    assert_eq!(commands(&mut panel), [StudyCommand::Note("late".to_owned())]);
    assert_eq!(value_of(&panel, "note on the study"), "");
    press(&mut panel, "close the study");
    assert_eq!(commands(&mut panel), [StudyCommand::Close]);
    let mut later = state(Task::Fitts, running());
    later.subjects[0].time_left = Some("about 15 min left".to_owned());
    tell(&mut panel, StudyNews::State(Box::new(later)));
    panel.get_by_label("12 of 440 trials, about 15 min left");
    for free in ["Go on", "subject", "close the study"] {
        assert!(!is_enabled(&panel, free), "{free}: a subject is at work");
    }
    press(&mut panel, "Pause");
    assert_eq!(commands(&mut panel), [StudyCommand::Pause]);
    tell(&mut panel, StudyNews::Row(row(&["7", "0.612"], None)));
    tell(&mut panel, StudyNews::Row(row(&[], Some("the rig is stopped"))));
    panel.get_by_label("0.612");
    panel.get_by_label("void: the rig is stopped");
    tell(&mut panel, StudyNews::Closed);
    assert_eq!(value_of(&panel, "folder of the study"), "/home/ada/study");
}

// hazard: H28
#[test]
fn a_note_during_a_trial_stops_nothing_and_is_never_lost() {
    let mut panel = felt(0..2000, |_| 1.0);
    tell(&mut panel, StudyNews::State(Box::new(state(Task::Fitts, running()))));
    asked(&mut panel);
    let note = "note on the study";
    panel.focus_on(note);
    strike(&mut panel, "steel ");
    // The next trial begins meanwhile.
    tell(&mut panel, StudyNews::Row(row(&["7", "0.612"], None)));
    tell(&mut panel, StudyNews::State(Box::new(state(Task::Fitts, held()))));
    strike(&mut panel, "on");
    assert_eq!(value_of(&panel, note), "steel on");
    panel.hit(Key::Enter);
    let text = "steel on".to_owned();
    assert_eq!(commands(&mut panel), [StudyCommand::Note(text.clone())]);
    strike(&mut panel, "late");
    let outcome = Err("no space left".to_owned());
    tell(&mut panel, StudyNews::Noted { text, outcome });
    panel.get_by_label("no space left");
    assert_eq!(value_of(&panel, note), "steel on late");
    tell(&mut panel, StudyNews::Closed);
    tell(&mut panel, StudyNews::State(Box::new(state(Task::Fitts, held()))));
    assert_eq!(value_of(&panel, note), "steel on late");
}

fn row(cells: &[&str], void: Option<&str>) -> StudyRow {
    StudyRow {
        cells: cells.iter().map(|cell| (*cell).to_owned()).collect(),
        void: void.map(str::to_owned),
    }
}

#[test]
fn the_subjects_window_opens_and_a_key_stops_beside_it() {
    let (fitts, perception) = ((Task::Fitts, Page::Task), (Task::Perception, Page::Perception));
    for ((task, page), (_, other)) in [(fitts, perception), (perception, fitts)] {
        let mut panel = connected(RigState::Engaged);
        tell(&mut panel, StudyNews::State(Box::new(state(task, running()))));
        let mut panel = at_page(panel, other);
        press(&mut panel, &format!("To the page {}", page.name()));
        assert_eq!(panel.state().model.page(), page);
        assert!(!is_enabled(&panel, "Full screen"));
        press(&mut panel, "Subject's screen");
        panel.get_by_label("Please wait");
        assert!(is_enabled(&panel, "Full screen"));
        asked(&mut panel);
        for key in [Key::Space, Key::Escape] {
            panel.key_press(key);
            panel.step();
            assert_eq!(asked(&mut panel), [Intent::Stop], "{key:?}");
        }
    }
}
