//! The values of parameters: typed, dragged, refused, and changed by others.

use crate::bench::{
    Hands as _, Panel, answer, asked, connected, enter, hear, of_depth, refuse, set, state_event, type_into, value_of,
    wait,
};
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use haptic_core::Directional;
use haptic_ipc::{ChangeReply, ErrorCode, Event, RigState};
use haptic_panel::{Answer, Intent, Update};

#[test]
fn a_value_is_typed_with_its_unit_and_what_is_none_is_not_sent() {
    let mut panel = connected(RigState::Engaged);
    enter(&mut panel, "mass value", "750g");
    assert_eq!(asked(&mut panel), [set("mass", 0.75)]);
    enter(&mut panel, "static force value", "2 kg");
    assert_eq!(asked(&mut panel), []);
    panel.get_by_label("`kg` is not a unit of this; give N, mN or kN");
    assert_eq!(value_of(&panel, "static force value"), "4");
}

/// Drags a slider by its handle, and gives what was asked.
fn drag_slider(panel: &mut Panel, slider: &str, shares: &[f32]) -> Vec<Intent> {
    let rail = panel.get_by_label(slider).rect();
    let at = |share: f32| egui::pos2(rail.left() + share * rail.width(), rail.center().y);
    panel.drag_at(at(shares[0]));
    panel.run();
    for share in shares {
        panel.hover_at(at(*share));
        wait(panel, 0.1);
    }
    // Let go while it still moves.
    panel.drop_at(at(shares[shares.len() - 1] + 0.05));
    wait(panel, 0.5);
    asked(panel)
}

/// Whether each change of a parameter continues the one before.
fn merges(asked: &[Intent], of: &str) -> Vec<bool> {
    let merge = |intent: &Intent| match intent {
        Intent::Set { target, merge, .. } if target.name == of => *merge,
        other => panic!("{other:?}"),
    };
    asked.iter().map(merge).collect()
}

#[test]
fn all_of_a_drag_is_one_step_of_undo() {
    let mut panel = connected(RigState::Engaged);
    for path in [[0.2, 0.4, 0.6, 0.8], [0.7, 0.5, 0.3, 0.1]] {
        let merges = merges(&drag_slider(&mut panel, "mass slider", &path), "mass");
        assert!(merges.len() >= 4, "{merges:?}");
        assert!(!merges[0] && merges[1..].iter().all(|merge| *merge), "{merges:?}");
    }
}

#[test]
fn a_parameter_is_a_row_of_40_points() {
    let panel = connected(RigState::Engaged);
    let top = |field: &str| panel.get_by_label(field).rect().top();
    let pitch = top("damping value") - top("stiffness value");
    assert!((pitch - 40.0).abs() < 0.5, "{pitch}");
}

#[test]
fn arrow_keys_move_a_slider_by_steps_that_are_felt() {
    let mut panel = connected(RigState::Engaged);
    panel.focus_on("static force slider");
    panel.key_press(Key::ArrowRight);
    panel.step();
    assert_eq!(asked(&mut panel), [set("static_force", 4.2)], "a hundredth of 20 N");
    wait(&mut panel, 0.1);
    panel.key_press(Key::ArrowRight);
    wait(&mut panel, 0.1);
    panel.key_press_modifiers(Modifiers::SHIFT, Key::ArrowLeft);
    wait(&mut panel, 0.1);
    let more = asked(&mut panel);
    let values: Vec<_> = more.iter().map(ToString::to_string).collect();
    assert_eq!(values, ["set static_force = 4.4", "set static_force = 4.38"]);
    assert_eq!(merges(&more, "static_force"), [true, true], "one step of undo");
    wait(&mut panel, 1.5);
    panel.hit(Key::ArrowRight);
    assert_eq!(
        merges(&asked(&mut panel), "static_force"),
        [false],
        "after a pause it is another"
    );
}

#[test]
fn enter_sets_a_value_and_leaves_the_keyboard_in_its_field() {
    let mut panel = connected(RigState::Engaged);
    type_into(&mut panel, "mass value", "2");
    assert_eq!(asked(&mut panel), [], "not while typing");
    panel.hit(Key::Enter);
    panel.get_by_label("pending");
    assert_eq!(value_of(&panel, "mass value"), "2");
    assert!(panel.get_by_label("mass value").is_focused());
    // The next number takes the place of this one.
    panel.get_by_label("mass value").type_text("3");
    panel.run();
    panel.hit(Key::Enter);
    assert_eq!(asked(&mut panel), [set("mass", 2.0), set("mass", 3.0)]);
    hear(&mut panel, of_depth(2, 0));
    panel.hit_with(Modifiers::COMMAND, Key::Z);
    assert_eq!(asked(&mut panel), [Intent::Undo], "nothing is half-typed there");
    type_into(&mut panel, "mass value", "7");
    panel.hit(Key::Tab);
    assert!(!panel.get_by_label("mass value").is_focused());
    assert_eq!(asked(&mut panel), [set("mass", 7.0)]);
    type_into(&mut panel, "mass value", "9");
    panel.focus_on("static force value");
    assert_eq!(asked(&mut panel), [], "a click elsewhere drops what is half-typed");
    assert_ne!(value_of(&panel, "mass value"), "9");
}

/// Another client has changed some parameters.
fn be_overtaken(panel: &mut Panel, changes: &[(&str, Directional)]) {
    let mut event = state_event(RigState::Engaged, 200);
    event.revision = 2;
    event
        .params
        .extend(changes.iter().map(|(name, value)| ((*name).into(), *value)));
    hear(panel, Update::Event(Event::State(event)));
}

#[test]
fn a_refusal_goes_when_something_else_is_done() {
    let message = "mass = 1000 kg is out of range: 1e-6 to 100 kg";
    let refused = || {
        let mut panel = connected(RigState::Engaged);
        enter(&mut panel, "mass value", "1000");
        refuse(&mut panel, set("mass", 1000.0), ErrorCode::OutOfRange, message);
        panel.get_by_label(message);
        panel.get_by_label("refused");
        assert_eq!(value_of(&panel, "mass value"), "0.5", "the active value");
        panel
    };
    let mut panel = refused();
    be_overtaken(&mut panel, &[]);
    assert!(panel.query_by_label(message).is_none(), "another scene is active");
    let mut panel = refused();
    panel.get_by_label("mass value").type_text("1");
    panel.run();
    assert!(panel.query_by_label(message).is_none(), "the field was touched");
}

#[test]
fn an_accepted_change_is_shown_with_its_revision_and_tick() {
    let mut panel = connected(RigState::Engaged);
    enter(&mut panel, "mass value", "2");
    let reply = ChangeReply {
        revision: 2,
        changed: true,
        tick: Some(321),
        applied: [("mass".to_owned(), 2.0)].into(),
        ..ChangeReply::default()
    };
    answer(&mut panel, set("mass", 2.0), Answer::Changed(reply));
    assert_eq!(value_of(&panel, "mass value"), "2");
    panel.get_by_label("Revision 2, applied at tick 321");
    panel.get_by_label("applied at tick 321");
    // No tick has rendered the scene that a daemon begins with.
    let begun = Update::Event(Event::State(state_event(RigState::Idle, 0)));
    let mut panel = connected(RigState::Idle);
    hear(&mut panel, begun);
    assert!(panel.query_by_label_contains("at tick 0").is_none());
}

#[test]
fn foreign_change_spares_the_field_being_typed_in() {
    let mut panel = connected(RigState::Engaged);
    type_into(&mut panel, "stiffness value", "123");
    let [mass, stiffness] = [3.0, 999.0].map(Directional::both);
    be_overtaken(&mut panel, &[("mass", mass), ("stiffness", stiffness)]);
    assert_eq!(value_of(&panel, "mass value"), "3");
    assert_eq!(value_of(&panel, "stiffness value"), "123");
}

#[test]
fn uneven_directional_parameter_has_a_row_for_each_direction() {
    let mut panel = connected(RigState::Engaged);
    assert!(panel.query_by_label("static force + value").is_none());
    let uneven = Directional {
        positive: 5.0,
        negative: 3.0,
    };
    be_overtaken(&mut panel, &[("static_force", uneven)]);
    assert_eq!(value_of(&panel, "static force + value"), "5");
    assert_eq!(value_of(&panel, "static force - value"), "3");
    panel.click_on("static force by direction");
    assert_eq!(
        asked(&mut panel),
        [set("static_force", 5.0)],
        "joined at the positive one"
    );
}
