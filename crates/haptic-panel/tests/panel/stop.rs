//! Stop: its keys, its button, and what the panel says of it.

use crate::bench::{Hands as _, Panel, asked, connected, hear, in_state, press, strike, type_into, value_of, wait};
use crate::legible::texts;
use crate::plane::draw_circle;
use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable};
use haptic_ipc::{ErrorCode, RigState, StateReply, WireError};
use haptic_panel::{Intent, Page, StopNews, Update};
use std::time::Duration;

#[test]
fn space_and_escape_stop_wherever_no_text_is_typed() {
    for key in [Key::Space, Key::Escape] {
        for focus in [None, Some("mass slider"), Some("Engage"), Some("friction law")] {
            let mut panel = connected(RigState::Idle);
            if let Some(focus) = focus {
                panel.focus_on(focus);
                assert!(panel.get_by_label(focus).is_focused());
            }
            panel.hit(key);
            assert_eq!(asked(&mut panel), [Intent::Stop], "{key:?} with the focus on {focus:?}");
        }
    }
}

/// The fields of a page in which text or a number is typed.
fn text_fields(panel: &Panel) -> Vec<String> {
    let fields = panel.query_all(egui_kittest::kittest::By::new().predicate(|node| {
        let role = node.role();
        let is_field = matches!(role, Role::TextInput | Role::MultilineTextInput | Role::SpinButton);
        is_field && !node.is_disabled()
    }));
    let names = fields.filter_map(|field| field.accesskit_node().label());
    names.collect()
}

/// Whether a text is drawn.
fn is_drawn(panel: &Panel, text: &str) -> bool {
    texts(panel).iter().any(|(_, shape)| shape.galley.text() == text)
}

// hazard: H28
#[test]
fn in_every_text_field_keys_are_typed_and_escape_stops() {
    for page in Page::ALL {
        let mut panel = connected(RigState::Engaged);
        if *page == Page::Plane {
            draw_circle(&mut panel);
        }
        press(&mut panel, &format!("{} page", page.name()));
        assert_eq!(panel.state().model.page(), *page);
        let fields = text_fields(&panel);
        assert!(!fields.is_empty(), "{page:?}");
        // Half a text may name a folder, and never changes the rig.
        let are_harmless = |asked: &[Intent]| asked.iter().all(|intent| intent.request().is_none());
        for field in fields {
            panel.focus_on(&field);
            assert!(is_drawn(&panel, "Esc stops"), "{field}");
            panel.hit_with(Modifiers::COMMAND, Key::A);
            strike(&mut panel, "7 nm");
            assert_eq!(value_of(&panel, &field), "7 nm");
            assert!(panel.query_by_label("note on this moment").is_none(), "{field}");
            let while_typed = asked(&mut panel);
            assert!(are_harmless(&while_typed), "{field}: {while_typed:?}");
            panel.key_press(Key::Escape);
            panel.step();
            let at_last = asked(&mut panel);
            let [Intent::Stop, others @ ..] = &at_last[..] else {
                panic!("{page:?} with {field}: {at_last:?}")
            };
            assert!(are_harmless(others), "{field}: {others:?}");
            panel.run();
            assert!(is_drawn(&panel, "Space or Escape"), "{field}: it has lost the keyboard");
        }
        for key in [Key::Space, Key::Escape] {
            panel.key_press(key);
            panel.step();
            assert_eq!(asked(&mut panel), [Intent::Stop], "{key:?} on {page:?}");
        }
    }
}

#[test]
fn a_page_is_turned_to_by_its_key_and_by_its_name() {
    let mut panel = connected(RigState::Engaged);
    for (page, key) in Page::ALL
        .iter()
        .zip([Key::Num1, Key::Num2, Key::Num3, Key::Num4, Key::Num5])
        .rev()
    {
        panel.hit_with(Modifiers::COMMAND, key);
        assert_eq!(panel.state().model.page(), *page);
    }
}

#[test]
fn a_held_key_is_one_stop() {
    let mut panel = connected(RigState::Engaged);
    for repeat in [false, true, true] {
        panel.event(egui::Event::Key {
            key: Key::Space,
            physical_key: None,
            pressed: true,
            repeat,
            modifiers: Modifiers::SHIFT,
        });
    }
    panel.run();
    assert_eq!(asked(&mut panel), [Intent::Stop]);
}

#[test]
fn a_stop_drops_a_half_typed_number() {
    let mut panel = connected(RigState::Engaged);
    type_into(&mut panel, "mass value", "7");
    panel.hit(Key::Escape);
    assert_eq!(asked(&mut panel), [Intent::Stop], "the half-typed 7 must not be set");
    assert_eq!(value_of(&panel, "mass value"), "0.5");
}

#[test]
fn the_button_stops_when_pressed_and_only_once() {
    let mut panel = connected(RigState::Engaged);
    let at = panel.get_by_label("Stop").rect().center();
    panel.hover_at(at);
    panel.run();
    panel.drag_at(at);
    panel.run();
    assert_eq!(asked(&mut panel), [Intent::Stop], "on the press");
    panel.drop_at(at);
    panel.run();
    assert_eq!(asked(&mut panel), [], "not again on the release");
    panel.get_by_label("Stop").click_accesskit();
    panel.run();
    assert_eq!(asked(&mut panel), [Intent::Stop], "by a screen reader");
}

/// Presses Space, and looks once at what is shown of it.
fn press_stop(panel: &mut Panel) {
    panel.key_press(Key::Space);
    panel.step();
}

/// The daemon's answer to a stop, so long after the press.
fn answered(after: Duration, result: Result<StateReply, WireError>) -> Update {
    Update::Stop(StopNews::Answered { after, result })
}

/// The daemon has stopped the rig in a tick.
fn confirmed(after: Duration, tick: u64) -> Update {
    let state = RigState::Stopped;
    answered(after, Ok(StateReply { state, tick }))
}

fn not_sent(reason: &str) -> Update {
    let reason = reason.to_owned();
    Update::Stop(StopNews::NotSent { reason })
}

#[test]
fn a_stop_is_reported_as_done_only_with_the_daemons_word() {
    let mut panel = connected(RigState::Engaged);
    press_stop(&mut panel);
    panel.state_mut().model.apply(Update::Stop(StopNews::Sent));
    panel.step();
    panel.get_by_label_contains("Stop sent, NOT confirmed");
    // It goes out on two connections, and the first answer counts.
    for after_us in [3400, 5600] {
        hear(&mut panel, confirmed(Duration::from_micros(after_us), 4711));
        panel.get_by_label("Stopped (confirmed, 3 ms) at tick 4711");
    }
    // The events of the tick come after the answer, on the other connection: it was engaged in that tick and stopped.
    hear(&mut panel, in_state(RigState::Engaged, 4711));
    hear(&mut panel, in_state(RigState::Stopped, 4711));
    panel.get_by_label("Stopped (confirmed, 3 ms) at tick 4711");
    // The same key, seen again, stops a rig that is stopped.
    panel.key_press(Key::Escape);
    panel.step();
    hear(&mut panel, confirmed(Duration::ZERO, 4739));
    panel.get_by_label("Stopped (confirmed, 3 ms) at tick 4711");
    hear(&mut panel, in_state(RigState::Idle, 4713));
    assert!(panel.query_by_label_contains("at tick 4711").is_none(), "it was reset");
    hear(&mut panel, in_state(RigState::Stopped, 4715));
    panel.get_by_label("Stopped at tick 4715");
    // Another client's stop came first.
    press_stop(&mut panel);
    hear(&mut panel, confirmed(Duration::ZERO, 4739));
    panel.get_by_label("Stopped (confirmed, 0 ms) at tick 4715");
}

// hazard: H4
#[test]
fn a_stop_is_shown_as_sent_only_when_it_was() {
    let mut panel = connected(RigState::Engaged);
    press_stop(&mut panel);
    panel.get_by_label("Stop asked for, not sent yet");
    hear(&mut panel, not_sent("the daemon does not read"));
    panel.get_by_label_contains("Stop NOT sent: the daemon does not read. Cut the motor's power");
    panel.state_mut().model.apply(Update::Stop(StopNews::Sent));
    panel.step();
    panel.get_by_label("Stop sent, not confirmed yet");
    wait(&mut panel, 1.0);
    panel.get_by_label_contains("Stop sent, NOT confirmed: the daemon does not answer. Cut the motor's power");
    hear(&mut panel, not_sent("no connection"));
    panel.get_by_label_contains("Stop NOT sent: no connection. Cut the motor's power");
    hear(&mut panel, confirmed(Duration::from_secs(7), 4711));
    panel.get_by_label("Stopped (confirmed, 7000 ms) at tick 4711");
    // The next one is without any news, and is dropped at last.
    hear(&mut panel, in_state(RigState::Engaged, 4800));
    press_stop(&mut panel);
    panel.get_by_label("Stop asked for, not sent yet");
    wait(&mut panel, 1.0);
    panel.get_by_label_contains("Stop NOT sent: the panel is stuck. Cut the motor's power");
    hear(&mut panel, Update::Stop(StopNews::Dropped));
    assert!(panel.query_by_label_contains("Stop NOT sent").is_none());
}

#[test]
fn grey_engage_after_a_stop_says_what_comes_first() {
    for (state, is_shown) in [
        (RigState::Stopped, true),
        (RigState::Faulted, true),
        (RigState::Engaged, false),
    ] {
        let mut panel = connected(state);
        panel.get_by_label("Engage").hover();
        wait(&mut panel, 1.0);
        assert_eq!(panel.query_by_label("Reset first").is_some(), is_shown, "{state:?}");
    }
}

/// The daemon's refusal of a stop.
fn refused(code: ErrorCode, message: &str) -> Update {
    answered(Duration::from_millis(3), Err(WireError::new(code, message)))
}

#[test]
fn a_stop_that_failed_says_so() {
    let mut panel = connected(RigState::Engaged);
    panel.hit(Key::Escape);
    let why = "the real-time thread does not answer";
    hear(&mut panel, refused(ErrorCode::NotResponding, why));
    panel.get_by_label("Not stopped: the real-time thread does not answer");
    hear(&mut panel, in_state(RigState::Stopped, 200));
    assert!(
        panel.query_by_label_contains("Not stopped").is_none(),
        "somebody else has stopped it"
    );
}

#[test]
fn stop_without_a_device_is_shown_until_the_rig_is_reset() {
    let mut panel = connected(RigState::Disconnected);
    panel.hit(Key::Escape);
    hear(&mut panel, refused(ErrorCode::NoDevice, "no device is connected"));
    for (state, tick) in [(RigState::Disconnected, 199), (RigState::Stopped, 200)] {
        hear(&mut panel, in_state(state, tick));
        panel.get_by_label("Stop not heard: no device is connected");
    }
    hear(&mut panel, in_state(RigState::Idle, 300));
    assert!(
        panel.query_by_label_contains("Stop not heard").is_none(),
        "it was reset"
    );
}
