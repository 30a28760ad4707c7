//! What the subject reads, and what counts as a click or an answer.

use super::*;
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use haptic_studies::session::{Feedback, Instruction, Targets, View};

/// A window, and what the subject did there.
struct Window {
    frame: SubjectFrame,
    actions: Vec<SubjectAction>,
    pointed_m: Option<f64>,
    area: egui::Rect,
}

fn view(phase: Phase) -> View {
    View {
        phase,
        is_practice: false,
        done: 3,
        of: Some(8),
        feedback: None,
    }
}

fn window(view: Option<View>, reach_m: f64) -> Harness<'static, Window> {
    let frame = SubjectFrame {
        view,
        reach_m,
        cursor_m: Some(0.05),
        hand: None,
    };
    let draw = |ui: &mut Ui, window: &mut Window| {
        window.pointed_m = pointed_m(ui, &window.frame);
        window.area = ui.max_rect();
        let actions = contents(ui, &window.frame);
        window.actions.extend(actions);
    };
    let window = Window {
        frame,
        actions: Vec::new(),
        pointed_m: None,
        area: egui::Rect::NOTHING,
    };
    let mut harness = Harness::builder()
        .with_size([1024.0, 640.0])
        .build_ui_state(draw, window);
    harness.run();
    harness
}

pub(in crate::study) fn targets() -> View {
    View {
        feedback: Some(Feedback::Missed),
        ..view(Phase::Targets(Targets {
            active_m: 0.1,
            other_m: -0.1,
            width_m: 0.05,
            cursor_diameter_m: 0.006,
            is_start: false,
        }))
    }
}

fn press(window: &mut Harness<'_, Window>, key: Key, repeat: bool) {
    window.event(egui::Event::Key {
        key,
        physical_key: None,
        pressed: true,
        repeat,
        modifiers: Modifiers::NONE,
    });
    window.run();
}

fn actions(window: &mut Harness<'_, Window>) -> Vec<SubjectAction> {
    std::mem::take(&mut window.state_mut().actions)
}

#[test]
fn the_subject_reads_what_to_do() {
    window(None, 0.3).get_by_label("Please wait");
    let rest = |remaining_s| Phase::Rest { remaining_s };
    let (practice, trials) = (Instruction::Practice, Instruction::Trials);
    for (phase, reach_m, title, text) in [
        (Phase::Paused, 0.3, "Please wait", ""),
        (Phase::Mounting, 0.3, "Please wait", "Let go of the handle"),
        (Phase::Instruction(practice), 0.3, "Practice", "green target"),
        (Phase::Instruction(trials), 0.0, "Now it counts", "two surfaces"),
        (rest(42), 0.3, "Have a rest", "for a while: 42 s"),
        (rest(0), 0.3, "Have a rest", "whenever you are ready"),
        (Phase::GetReady, 0.3, "Get ready", "Take the handle"),
        (Phase::Done, 0.3, "Thank you", "That was all"),
        (Phase::Wait, 0.0, "The surface changes", ""),
        (Phase::Feel(1), 0.0, "Feel the first surface", ""),
        (Phase::Feel(2), 0.0, "Feel the second surface", ""),
        (Phase::Question, 0.0, "Which surface had more friction?", "left arrow"),
    ] {
        let window = window(Some(view(phase)), reach_m);
        window.get_by_label(title);
        let has_text = text.is_empty() || window.query_by_label_contains(text).is_some();
        assert!(has_text, "{phase:?}: {text}");
    }
}

#[test]
fn enter_and_the_mouse_click_once_when_pressed() {
    for view in [targets(), view(Phase::Instruction(Instruction::Trials))] {
        let mut window = window(Some(view), 0.3);
        for repeat in [false, true, true] {
            press(&mut window, Key::Enter, repeat);
        }
        assert_eq!(actions(&mut window), [SubjectAction::Click], "a held key is one click");
        let at = egui::pos2(500.0, 300.0);
        window.hover_at(at);
        window.drag_at(at);
        window.run();
        assert_eq!(actions(&mut window), [SubjectAction::Click], "on the press");
        window.drop_at(at);
        window.run();
        assert_eq!(actions(&mut window), [], "not again on the release");
    }
}

/// A press and its release in the input of one frame, as of a tap, or of a slow frame.
fn tap(window: &mut Harness<'_, Window>, at: egui::Pos2) {
    let events = [true, false].map(|pressed| Event::PointerButton {
        pos: at,
        button: PointerButton::Primary,
        pressed,
        modifiers: Modifiers::NONE,
    });
    window.input_mut().events.extend(events);
    window.step();
}

#[test]
fn a_press_and_its_release_in_one_frame_are_a_click() {
    let at = egui::pos2(500.0, 300.0);
    for view in [targets(), view(Phase::Instruction(Instruction::Trials))] {
        let mut window = window(Some(view), 0.3);
        for _ in 0..2 {
            tap(&mut window, at);
            assert_eq!(actions(&mut window), [SubjectAction::Click]);
        }
        tap(&mut window, egui::pos2(-5.0, 300.0));
        assert_eq!(actions(&mut window), [], "outside");
    }
    let mut asked = window(Some(view(Phase::Question)), 0.0);
    let at = asked.get_by_label("surface 2 had more friction").rect().center();
    tap(&mut asked, at);
    assert_eq!(actions(&mut asked), [SubjectAction::Answer(2)]);
}

#[test]
fn a_pointer_over_a_target_reaches_for_its_place() {
    let mut window = window(Some(targets()), 0.125);
    let area = window.state().area;
    // The outermost target is at 47 % of the width from the middle.
    window.hover_at(area.center() + egui::vec2(area.width() * 0.47 * 0.8, 0.0));
    window.run();
    assert_eq!(window.state().pointed_m, None, "a person holds the rig");
    let mapping = haptic_studies::plan::RigMapping {
        gain: 2.0,
        center_m: 0.01,
        range_m: [-0.1, 0.1],
    };
    window.state_mut().frame.hand = Some(crate::study::TaskScale {
        mapping,
        reach_m: 0.125,
    });
    window.run();
    let pointed_m = window.state().pointed_m.expect("it is the hand");
    assert!((pointed_m - 0.06).abs() < 1e-6, "{pointed_m}");
}

#[test]
fn a_question_is_answered_by_digits_arrows_and_by_its_places() {
    let mut asked = window(Some(view(Phase::Question)), 0.0);
    for (key, answer) in [
        (Key::Num1, 1),
        (Key::ArrowLeft, 1),
        (Key::Num2, 2),
        (Key::ArrowRight, 2),
    ] {
        press(&mut asked, key, false);
        assert_eq!(actions(&mut asked), [SubjectAction::Answer(answer)], "{key:?}");
    }
    press(&mut asked, Key::Enter, false);
    assert_eq!(actions(&mut asked), [], "Enter is no answer");
    asked.get_by_label("surface 2 had more friction").click();
    asked.run();
    assert_eq!(actions(&mut asked), [SubjectAction::Answer(2)]);
    let mut felt = window(Some(view(Phase::Feel(2))), 0.0);
    press(&mut felt, Key::Num1, false);
    assert_eq!(actions(&mut felt), [], "nothing is asked yet");
}
