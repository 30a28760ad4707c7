//! The panel without a window: what it shows of a daemon's news, and what it makes of keys and clicks.

#[path = "../fixture/metadata.rs"]
mod metadata;
mod plots;
mod scene;

use egui::{Key, Modifiers};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use haptic_core::{Directional, Scene};
use haptic_gui::{Answer, Intent, Model, StopNews, Target, Update};
use haptic_ipc::{
    Advice, AdviceReply, ChangeReply, Description, ErrorCode, Event, Finding, Hello, LinkCounts, LinkStatus,
    LinkedDevice, ParameterDescription, RigState, SAMPLE_COLUMNS, Sample, SamplesEvent, StateEvent, StateReply, Timing,
    TimingWindow, WireError, params_of,
};
use std::time::{Duration, Instant};

const SOCKET: &str = "/run/user/1000/hapticd/control.sock";

/// The panel and everything that it asked for.
struct Bench {
    model: Model,
    asked: Vec<Intent>,
    /// When the interface's clock began, by the system's.
    began: Instant,
}

impl Bench {
    /// The system's time.
    fn now(&self, ui: &egui::Ui) -> Instant {
        self.began + Duration::from_secs_f64(ui.input(|input| input.time))
    }
}

type Panel = Harness<'static, Bench>;

fn panel() -> Panel {
    let draw = |ui: &mut egui::Ui, bench: &mut Bench| {
        let now = bench.now(ui);
        let asked = haptic_gui::ui(ui, &mut bench.model, now);
        bench.asked.extend(asked);
    };
    let bench = Bench {
        model: Model::new(),
        asked: Vec::new(),
        began: Instant::now(),
    };
    // The smallest window that the panel is made for.
    let mut panel = Harness::builder()
        .with_size([1024.0, 640.0])
        .with_context_setup(haptic_gui::theme::install)
        .build_ui_state(draw, bench);
    panel.run();
    panel
}

/// A connection that has been greeted.
fn greeted(session: &str) -> Update {
    Update::Connected {
        path: SOCKET.into(),
        hello: Hello {
            protocol: 1,
            server: "hapticd 0.1.0".into(),
            session: session.into(),
            rights: haptic_ipc::Rights::All,
        },
    }
}

fn lose_the_daemon(panel: &mut Panel) {
    let lost = Update::Disconnected {
        path: SOCKET.into(),
        reason: "the daemon closed the connection".into(),
    };
    hear(panel, lost);
}

fn find_another_daemon(panel: &mut Panel) {
    hear(panel, greeted("1-2"));
    hear(panel, in_state(RigState::Idle, 1));
}

/// A panel whose daemon renders the paper's scene.
fn connected(state: RigState) -> Panel {
    let mut panel = panel();
    let scene = Scene::paper();
    let description = Description {
        laws: Vec::new(),
        law: scene.friction.law().to_owned(),
        parameters: ParameterDescription::all_of(&scene),
        sample_columns: SAMPLE_COLUMNS.iter().map(ToString::to_string).collect(),
    };
    hear(&mut panel, greeted("1-1"));
    hear(&mut panel, Update::Described(description));
    hear(&mut panel, in_state(state, 100));
    panel
}

fn hear(panel: &mut Panel, update: Update) {
    panel.state_mut().model.apply(update);
    panel.run();
}

fn state_event(state: RigState, tick: u64) -> StateEvent {
    StateEvent {
        law: "karnopp".to_owned(),
        undo_depth: 0,
        redo_depth: 0,
        state,
        fault: None,
        tick,
        revision: 1,
        scene: "paper".into(),
        params: params_of(&Scene::paper()),
    }
}

fn in_state(state: RigState, tick: u64) -> Update {
    Update::Event(Event::State(state_event(state, tick)))
}

fn set(name: &str, value: f64) -> Intent {
    let target = Target {
        name: name.into(),
        direction: None,
    };
    Intent::Set {
        target,
        value,
        merge: false,
    }
}

fn asked(panel: &mut Panel) -> Vec<Intent> {
    std::mem::take(&mut panel.state_mut().asked)
}

fn type_into(panel: &mut Panel, field: &str, text: &str) {
    panel.get_by_label(field).focus();
    panel.run();
    panel.key_press_modifiers(Modifiers::COMMAND, Key::A);
    panel.run();
    panel.get_by_label(field).type_text(text);
    panel.run();
}

/// Lets the clocks go on.
fn wait(panel: &mut Panel, seconds: f64) {
    let begin = panel.ctx.input(|input| input.time);
    while panel.ctx.input(|input| input.time) < begin + seconds {
        panel.step();
    }
}

fn of_depth(undo_depth: usize, redo_depth: usize) -> Update {
    let mut event = state_event(RigState::Engaged, 200);
    (event.undo_depth, event.redo_depth) = (undo_depth, redo_depth);
    Update::Event(Event::State(event))
}

fn is_enabled(panel: &Panel, label: &str) -> bool {
    !panel.get_by_label(label).accesskit_node().is_disabled()
}

fn value_of(panel: &Panel, field: &str) -> String {
    panel.get_by_label(field).value().unwrap_or_default()
}

#[test]
fn a_connected_panel_offers_to_engage() {
    let mut panel = connected(RigState::Idle);
    panel.get_by_label("Idle");
    panel.get_by_label("Connected to hapticd 0.1.0");
    panel.get_by_label("Engage").click();
    panel.run();
    assert_eq!(asked(&mut panel), [Intent::Engage]);
}

#[test]
fn an_engaged_rig_can_be_released_and_a_stopped_one_reset() {
    let mut panel = connected(RigState::Engaged);
    panel.get_by_label("Release").click();
    panel.run();
    hear(&mut panel, in_state(RigState::Stopped, 200));
    panel.get_by_label("Stopped at tick 200");
    assert!(!is_enabled(&panel, "Engage"), "a stopped rig cannot be engaged");
    panel.get_by_label("Reset").click();
    panel.run();
    assert_eq!(asked(&mut panel), [Intent::Release, Intent::Reset]);
}

#[test]
fn nothing_is_drawn_while_nothing_is_new() {
    let mut panel = connected(RigState::Engaged);
    panel.run();
    let wait = |panel: &Panel| panel.output().viewport_output[&egui::ViewportId::ROOT].repaint_delay;
    assert_eq!(wait(&panel), Duration::MAX);
    hear(&mut panel, Update::Exported(Ok("/tmp/plots/haptic-plot-1.svg".into())));
    panel.run();
    assert!(
        wait(&panel) > Duration::from_secs(1),
        "until it goes: {:?}",
        wait(&panel)
    );
}

#[test]
fn a_second_click_never_engages_the_rig() {
    for (before, button, after) in [
        (RigState::Stopped, "Reset", RigState::Idle),
        (RigState::Faulted, "Reset", RigState::Idle),
        (RigState::Engaged, "Release", RigState::Releasing),
        (RigState::Engaging, "Release", RigState::Releasing),
        (RigState::Engaged, "Release", RigState::Idle),
    ] {
        let mut panel = connected(before);
        let at = panel.get_by_label(button).rect().center();
        let press = |panel: &mut Panel| {
            panel.drag_at(at);
            panel.step();
            panel.drop_at(at);
            panel.step();
        };
        press(&mut panel);
        assert_eq!(asked(&mut panel).len(), 1, "{button}");
        panel.state_mut().model.apply(in_state(after, 200));
        panel.step();
        press(&mut panel);
        assert_eq!(asked(&mut panel), [], "{button}, and again when the rig is {after}");
        panel.get_by_label("Engage").click();
        panel.run();
        assert_eq!(asked(&mut panel), [Intent::Engage], "it has a place of its own");
    }
}

#[test]
fn nothing_else_ever_stands_where_engage_does() {
    let states = [
        RigState::Disconnected,
        RigState::Idle,
        RigState::Engaging,
        RigState::Engaged,
        RigState::Releasing,
        RigState::Stopped,
        RigState::Faulted,
    ];
    let mut panel = connected(RigState::Idle);
    let engage = panel.get_by_label("Engage").rect();
    for (tick, state) in (200..).zip(states) {
        hear(&mut panel, in_state(state, tick));
        assert_eq!(panel.get_by_label("Engage").rect(), engage, "{state}");
        let others = ["Release", "Reset"].map(|label| panel.query_by_label(label));
        for other in others.into_iter().flatten() {
            assert!(!other.rect().intersects(engage), "{state}: {:?}", other.rect());
        }
    }
}

#[test]
fn a_fault_is_shown_with_its_reason() {
    let mut panel = connected(RigState::Engaged);
    let mut event = state_event(RigState::Faulted, 200);
    event.fault = Some("the device is silent for 12 ms; the limit is 10 ms".into());
    hear(&mut panel, Update::Event(Event::State(event)));
    panel.get_by_label_contains("silent for 12 ms");
    panel.get_by_label("Reset");
}

#[test]
fn space_and_escape_stop_wherever_the_focus_is() {
    for key in [Key::Space, Key::Escape] {
        for focus in [None, Some("mass value"), Some("mass slider"), Some("Engage")] {
            let mut panel = connected(RigState::Idle);
            if let Some(focus) = focus {
                panel.get_by_label(focus).focus();
                panel.run();
                assert!(panel.get_by_label(focus).is_focused());
            }
            panel.key_press(key);
            panel.run();
            assert_eq!(asked(&mut panel), [Intent::Stop], "{key:?} with the focus on {focus:?}");
        }
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
fn a_space_typed_into_a_field_stops_and_changes_nothing() {
    let mut panel = connected(RigState::Engaged);
    type_into(&mut panel, "mass value", "7");
    panel.key_down(Key::Space);
    panel.get_by_label("mass value").type_text(" ");
    panel.key_up(Key::Space);
    panel.run();
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

/// Presses Space, and looks once at what is said of it.
fn press_stop(panel: &mut Panel) {
    panel.event(egui::Event::Key {
        key: Key::Space,
        physical_key: None,
        pressed: true,
        repeat: false,
        modifiers: Modifiers::NONE,
    });
    panel.step();
    panel.step();
}

#[test]
fn a_stop_is_reported_as_done_only_with_the_daemons_word() {
    let mut panel = connected(RigState::Engaged);
    press_stop(&mut panel);
    panel.state_mut().model.apply(Update::Stop(StopNews::Sent));
    panel.step();
    panel.get_by_label_contains("Stop sent, NOT confirmed");
    let reply = StateReply {
        state: RigState::Stopped,
        tick: 4711,
    };
    let stopped = Update::Answered {
        intent: Intent::Stop,
        result: Ok(Answer::State(reply.clone())),
    };
    hear(&mut panel, stopped);
    panel.get_by_label("Stopped at tick 4711");
    let answered = StopNews::Answered {
        after: Duration::from_micros(3400),
        result: Ok(reply),
    };
    hear(&mut panel, Update::Stop(answered));
    panel.get_by_label("Stopped (confirmed, 3 ms) at tick 4711");
    hear(&mut panel, in_state(RigState::Idle, 5000));
    assert!(panel.query_by_label_contains("at tick 4711").is_none(), "it was reset");
    hear(&mut panel, in_state(RigState::Stopped, 6000));
    panel.get_by_label("Stopped at tick 6000");
}

// hazard: H4
#[test]
fn a_stop_is_said_to_be_sent_only_when_it_was() {
    let mut panel = connected(RigState::Engaged);
    press_stop(&mut panel);
    panel.get_by_label("Stop asked for, not sent yet");
    let not_sent = StopNews::NotSent {
        reason: "the daemon does not read".into(),
    };
    hear(&mut panel, Update::Stop(not_sent));
    panel.get_by_label_contains("Stop NOT sent: the daemon does not read. Cut the motor's power");
    panel.state_mut().model.apply(Update::Stop(StopNews::Sent));
    panel.step();
    panel.get_by_label("Stop sent, not confirmed yet");
    wait(&mut panel, 1.0);
    panel.get_by_label_contains("Stop sent, NOT confirmed: the daemon does not answer. Cut the motor's power");
    let lost = StopNews::NotSent {
        reason: "no connection".into(),
    };
    hear(&mut panel, Update::Stop(lost));
    panel.get_by_label_contains("Stop NOT sent: no connection. Cut the motor's power");
    let answered = StopNews::Answered {
        after: Duration::from_secs(7),
        result: Ok(StateReply {
            state: RigState::Stopped,
            tick: 4711,
        }),
    };
    hear(&mut panel, Update::Stop(answered));
    panel.get_by_label("Stopped (confirmed, 7000 ms) at tick 4711");
}

#[test]
fn a_stop_of_which_nothing_is_heard_is_not_said_to_be_on_its_way() {
    let mut panel = connected(RigState::Engaged);
    press_stop(&mut panel);
    panel.get_by_label("Stop asked for, not sent yet");
    wait(&mut panel, 1.0);
    panel.get_by_label_contains("Stop NOT sent: the panel is stuck. Cut the motor's power");
}

#[test]
fn a_stop_that_failed_says_so() {
    let mut panel = connected(RigState::Engaged);
    panel.key_press(Key::Escape);
    panel.run();
    let error = WireError::new(ErrorCode::NotResponding, "the real-time thread does not answer");
    let failed = Update::Answered {
        intent: Intent::Stop,
        result: Err(error),
    };
    hear(&mut panel, failed);
    panel.get_by_label("Not stopped: the real-time thread does not answer");
    hear(&mut panel, in_state(RigState::Stopped, 200));
    assert!(
        panel.query_by_label_contains("Not stopped").is_none(),
        "somebody else has stopped it"
    );
}

#[test]
fn a_stop_that_no_device_has_heard_says_so_until_the_rig_is_reset() {
    let mut panel = connected(RigState::Disconnected);
    panel.key_press(Key::Escape);
    panel.run();
    let unheard = Update::Answered {
        intent: Intent::Stop,
        result: Err(WireError::new(ErrorCode::NoDevice, "no device is connected")),
    };
    hear(&mut panel, unheard);
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

#[test]
fn a_typed_value_is_set_on_enter() {
    let mut panel = connected(RigState::Engaged);
    type_into(&mut panel, "mass value", "1.25");
    assert_eq!(asked(&mut panel), [], "not while typing");
    panel.key_press(Key::Enter);
    panel.run();
    assert_eq!(asked(&mut panel), [set("mass", 1.25)]);
    assert_eq!(value_of(&panel, "mass value"), "1.25");
    panel.get_by_label("pending");
}

#[test]
fn a_value_may_be_typed_with_its_unit() {
    let mut panel = connected(RigState::Engaged);
    type_into(&mut panel, "mass value", "750g");
    panel.key_press(Key::Enter);
    panel.run();
    type_into(&mut panel, "static force value", "2 kg");
    panel.key_press(Key::Enter);
    panel.run();
    assert_eq!(asked(&mut panel), [set("mass", 0.75)]);
    panel.get_by_label("`kg` is not a unit of this: give N, mN or kN");
}

#[test]
fn what_is_no_number_is_not_sent() {
    let mut panel = connected(RigState::Engaged);
    type_into(&mut panel, "mass value", "heavy");
    panel.key_press(Key::Enter);
    panel.run();
    assert_eq!(asked(&mut panel), []);
    panel.get_by_label("`heavy` is not a finite number");
    assert_eq!(value_of(&panel, "mass value"), "0.5");
    type_into(&mut panel, "stiffness value", "25,000");
    panel.key_press(Key::Enter);
    panel.run();
    assert_eq!(asked(&mut panel), [], "which would be 25 to some");
    panel.get_by_label("`25,000` has a comma: write a decimal point, and no separator between thousands");
}

#[test]
fn a_moved_slider_sets_its_parameter() {
    let mut panel = connected(RigState::Engaged);
    let slider = panel.get_by_label("static force slider").rect();
    panel.drag_at(slider.center());
    panel.run();
    panel.hover_at(slider.right_center());
    panel.run();
    panel.drop_at(slider.right_center());
    panel.run();
    let asked = asked(&mut panel);
    assert!(
        matches!(asked.last(), Some(Intent::Set { target, value: 20.0, .. }) if target.name == "static_force"),
        "{asked:?}"
    );
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

/// Whether each change of a parameter goes on with the one before.
fn merges(asked: &[Intent]) -> Vec<bool> {
    let merge = |intent: &Intent| match intent {
        Intent::Set { merge, .. } => *merge,
        other => panic!("{other:?}"),
    };
    asked.iter().map(merge).collect()
}

#[test]
fn all_of_a_drag_is_one_step_of_undo() {
    let mut panel = connected(RigState::Engaged);
    for way in [[0.2, 0.4, 0.6, 0.8], [0.7, 0.5, 0.3, 0.1]] {
        let merges = merges(&drag_slider(&mut panel, "mass slider", &way));
        assert!(merges.len() >= 4, "{merges:?}");
        assert!(!merges[0] && merges[1..].iter().all(|merge| *merge), "{merges:?}");
    }
}

#[test]
fn arrow_keys_move_a_slider_by_steps_that_are_felt() {
    let mut panel = connected(RigState::Engaged);
    panel.get_by_label("static force slider").focus();
    panel.run();
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
    assert_eq!(merges(&more), [true, true], "one step of undo");
    wait(&mut panel, 1.5);
    panel.key_press(Key::ArrowRight);
    panel.run();
    assert_eq!(merges(&asked(&mut panel)), [false], "after a pause it is another");
}

#[test]
fn enter_sets_a_value_and_leaves_the_keyboard_in_its_field() {
    let mut panel = connected(RigState::Engaged);
    type_into(&mut panel, "mass value", "2");
    panel.key_press(Key::Enter);
    panel.run();
    assert!(panel.get_by_label("mass value").is_focused());
    // The next number takes the place of this one.
    panel.get_by_label("mass value").type_text("3");
    panel.run();
    panel.key_press(Key::Enter);
    panel.run();
    assert_eq!(asked(&mut panel), [set("mass", 2.0), set("mass", 3.0)]);
    hear(&mut panel, of_depth(2, 0));
    panel.key_press_modifiers(Modifiers::COMMAND, Key::Z);
    panel.run();
    assert_eq!(asked(&mut panel), [Intent::Undo], "nothing is half-typed there");
    panel.key_press(Key::Tab);
    panel.run();
    assert!(!panel.get_by_label("mass value").is_focused());
}

#[test]
fn a_refusal_goes_when_something_else_is_done() {
    let message = "mass = 1000 kg is out of range: 1e-6 to 100 kg";
    let refused = || {
        let mut panel = connected(RigState::Engaged);
        type_into(&mut panel, "mass value", "1000");
        panel.key_press(Key::Enter);
        panel.run();
        let refused = Update::Answered {
            intent: set("mass", 1000.0),
            result: Err(WireError::new(ErrorCode::OutOfRange, message)),
        };
        hear(&mut panel, refused);
        panel.get_by_label(message);
        panel
    };
    let mut panel = refused();
    let mut other = state_event(RigState::Engaged, 200);
    other.revision = 2;
    hear(&mut panel, Update::Event(Event::State(other)));
    assert!(panel.query_by_label(message).is_none(), "another scene is in force");
    let mut panel = refused();
    panel.get_by_label("mass value").type_text("1");
    panel.run();
    assert!(panel.query_by_label(message).is_none(), "the field was touched");
}

#[test]
fn a_refusal_is_shown_and_the_field_returns_to_the_value_in_force() {
    let mut panel = connected(RigState::Engaged);
    type_into(&mut panel, "mass value", "1000");
    panel.key_press(Key::Enter);
    panel.run();
    let message = "mass = 1000 kg is out of range: 1e-6 to 100 kg";
    let refused = Update::Answered {
        intent: set("mass", 1000.0),
        result: Err(WireError::new(ErrorCode::OutOfRange, message)),
    };
    hear(&mut panel, refused);
    panel.get_by_label(message);
    panel.get_by_label("refused");
    assert_eq!(value_of(&panel, "mass value"), "0.5");
}

#[test]
fn an_accepted_change_is_shown_with_its_revision_and_tick() {
    let mut panel = connected(RigState::Engaged);
    type_into(&mut panel, "mass value", "2");
    panel.key_press(Key::Enter);
    panel.run();
    let reply = ChangeReply {
        ramp_ends_tick: None,
        dry_run: false,
        changes: Vec::new(),
        revision: 2,
        tick: Some(321),
        applied: [("mass".to_owned(), 2.0)].into(),
        advice: vec![],
    };
    let applied = Update::Answered {
        intent: set("mass", 2.0),
        result: Ok(Answer::Changed(reply)),
    };
    hear(&mut panel, applied);
    assert_eq!(value_of(&panel, "mass value"), "2");
    panel.get_by_label("Revision 2, applied at tick 321");
    panel.get_by_label("applied at tick 321");
}

#[test]
fn another_clients_change_moves_the_field_but_not_one_that_is_typed_in() {
    let mut panel = connected(RigState::Engaged);
    type_into(&mut panel, "stiffness value", "123");
    let mut event = state_event(RigState::Engaged, 200);
    event.revision = 2;
    event.params.insert("mass".into(), Directional::both(3.0));
    event.params.insert("stiffness".into(), Directional::both(999.0));
    hear(&mut panel, Update::Event(Event::State(event)));
    assert_eq!(value_of(&panel, "mass value"), "3");
    assert_eq!(value_of(&panel, "stiffness value"), "123");
}

#[test]
fn an_old_state_does_not_undo_a_newer_change() {
    let mut panel = connected(RigState::Engaged);
    let mut newer = state_event(RigState::Engaged, 200);
    newer.revision = 3;
    newer.params.insert("mass".into(), Directional::both(3.0));
    hear(&mut panel, Update::Event(Event::State(newer)));
    hear(&mut panel, in_state(RigState::Engaged, 150));
    assert_eq!(value_of(&panel, "mass value"), "3");
}

#[test]
fn a_directional_parameter_has_a_row_for_each_direction_when_they_differ() {
    let mut panel = connected(RigState::Engaged);
    assert!(panel.query_by_label("static force + value").is_none());
    let mut event = state_event(RigState::Engaged, 200);
    event.revision = 2;
    let uneven = Directional {
        positive: 5.0,
        negative: 3.0,
    };
    event.params.insert("static_force".into(), uneven);
    hear(&mut panel, Update::Event(Event::State(event)));
    assert_eq!(value_of(&panel, "static force + value"), "5");
    assert_eq!(value_of(&panel, "static force - value"), "3");
    panel.get_by_label("static force by direction").click();
    panel.run();
    assert_eq!(
        asked(&mut panel),
        [set("static_force", 5.0)],
        "joined at the positive one"
    );
}

#[test]
fn a_split_parameter_is_set_by_direction() {
    let mut panel = connected(RigState::Engaged);
    panel.get_by_label("viscous by direction").click();
    panel.run();
    type_into(&mut panel, "viscous - value", "2");
    panel.key_press(Key::Enter);
    panel.run();
    let asked = asked(&mut panel);
    let [Intent::Set { target, value, .. }] = asked.as_slice() else {
        panic!("{asked:?}");
    };
    assert_eq!((target.to_string().as_str(), *value), ("viscous-", 2.0));
}

#[test]
fn a_panel_without_a_daemon_says_where_it_looked_and_does_not_pretend() {
    let mut panel = connected(RigState::Engaged);
    let lost = Update::Disconnected {
        path: SOCKET.into(),
        reason: "the daemon closed the connection".into(),
    };
    hear(&mut panel, lost);
    panel.get_by_label("Not connected");
    panel.get_by_label("the daemon closed the connection");
    panel.get_by_label_contains(SOCKET);
    assert!(panel.query_by_label("Release").is_none(), "there is nobody to ask");
    assert!(
        panel.query_by_label("mass value").is_none(),
        "the values are not known any more"
    );
    panel.get_by_label("Stop").click();
    panel.run();
    assert_eq!(asked(&mut panel), [Intent::Stop], "sent when the daemon is back");
    panel.get_by_label_contains("Stop NOT sent: no connection to the daemon. Cut the motor's power");
}

#[test]
fn the_newest_sample_is_read_out_and_none_is_made_up_without_a_rig() {
    let mut panel = connected(RigState::Engaged);
    let rows = (0..1250).map(|i| sample(f64::from(i) / 250.0)).collect();
    let batch = SamplesEvent {
        seq: 0,
        dropped: 0,
        rows,
    };
    hear(&mut panel, Update::Event(Event::Samples(batch)));
    panel.get_by_label("-3.50");
    panel.get_by_label("12.34");
    panel.get_by_label("Force plot");
    panel.get_by_label("Position plot");
    hear(&mut panel, in_state(RigState::Disconnected, 200));
    assert!(
        panel.query_by_label("12.34").is_none(),
        "a stale position is no position"
    );
}

#[test]
fn numbers_beyond_any_rig_do_no_harm() {
    let mut panel = connected(RigState::Engaged);
    let mut rows = Vec::new();
    for value in [f64::MAX, f64::NAN, f64::INFINITY, f64::MIN, 0.0] {
        let mut row = sample(1.0);
        row.command_force_n = value;
        row.device_position_m = value;
        rows.push(row);
    }
    rows.push(Sample {
        t_s: 1e300,
        ..sample(0.0)
    });
    let batch = SamplesEvent {
        seq: 0,
        dropped: 7,
        rows,
    };
    hear(&mut panel, Update::Event(Event::Samples(batch)));
    panel.get_by_label("Force plot");
}

fn sample(t_s: f64) -> Sample {
    Sample {
        tick: 1,
        t_s,
        state: RigState::Engaged,
        contact: 0,
        device_position_m: 0.012_34,
        device_velocity_mps: 0.0,
        block_position_m: 0.012,
        block_velocity_mps: 0.0,
        coupling_force_n: 3.5,
        command_force_n: -3.5,
        revision: 1,
        wake_latency_ns: 0,
        tick_ns: 0,
        device_round_trip_ns: 0,
        ..Sample::default()
    }
}

/// A check of the stiffness, of 25000 N/m in the paper's scene; broken when the bound is below that.
fn check(name: &str, bound: f64, mending: Option<f64>) -> Advice {
    let passes = bound >= 25_000.0;
    let finding = Finding {
        check: name.into(),
        passes,
        value: Some(25_000.0),
        bound: Some(bound),
        unit: "N/m".into(),
        margin: Some(bound / 25_000.0),
        mending: mending.filter(|_| !passes),
    };
    Advice {
        param: "stiffness".into(),
        message: format!("25000 N/m is held against {bound} N/m"),
        finding: Some(finding),
    }
}

fn advised(revision: u64, advice: Vec<Advice>) -> Update {
    Update::Advised(Ok(AdviceReply {
        revision,
        advice,
        basis: None,
    }))
}

/// Presses a button that may have to be scrolled to.
fn press(panel: &mut Panel, button: &str) {
    panel.get_by_label(button).scroll_to_me();
    panel.run();
    panel.get_by_label(button).click();
    panel.run();
}

#[test]
fn a_broken_bound_is_shown_and_mended_by_a_button() {
    let mut panel = connected(RigState::Engaged);
    let advice = vec![
        check("friction", 16_000.0, Some(16_000.0)),
        check("encoder", 160_000.0, None),
    ];
    hear(&mut panel, advised(1, advice));
    press(&mut panel, "Friction: 25000, bound 16000 N/m");
    panel.get_by_label("25000 N/m is held against 16000 N/m");
    assert!(
        panel.query_by_label_contains("160000").is_none(),
        "a bound that is kept is no warning"
    );
    press(&mut panel, "set stiffness to 16000 N/m");
    assert_eq!(asked(&mut panel), [set("stiffness", 16_000.0)]);
    assert_eq!(value_of(&panel, "stiffness value"), "16000", "wanted, not in force yet");

    let refusal = "stiffness = 16000 N/m is refused";
    let refused = Update::Answered {
        intent: set("stiffness", 16_000.0),
        result: Err(WireError::new(ErrorCode::OutOfRange, refusal)),
    };
    hear(&mut panel, refused);
    panel.get_by_label(refusal);
    assert_eq!(value_of(&panel, "stiffness value"), "25000");
}

#[test]
fn several_broken_bounds_are_one_line_that_opens() {
    let mut panel = connected(RigState::Engaged);
    let advice = vec![
        check("passivity", 100.0, None),
        check("linear_stability", 20_000.0, Some(20_000.0)),
        check("friction", 16_000.0, Some(16_000.0)),
    ];
    hear(&mut panel, advised(1, advice));
    assert!(panel.query_by_label_contains("is held against").is_none());
    panel.get_by_label("set stiffness to 16000 N/m");
    assert!(
        panel.query_by_label("set stiffness to 20000 N/m").is_none(),
        "the strictest one only"
    );
    press(&mut panel, "3 bounds broken");
    let height = |bound: &str| {
        let message = format!("25000 N/m is held against {bound} N/m");
        panel.get_by_label(&message).rect().top()
    };
    assert!(height("16000") < height("20000") && height("20000") < height("100"));
    press(&mut panel, "set stiffness to 20000 N/m");
    assert_eq!(asked(&mut panel), [set("stiffness", 20_000.0)]);
}

#[test]
fn a_mending_of_one_direction_sets_that_one() {
    let mut panel = connected(RigState::Engaged);
    let mut advice = check("friction_passivity", 2.0, Some(2.0));
    advice.param = "viscous-".into();
    hear(&mut panel, advised(1, vec![advice]));
    press(&mut panel, "set viscous- to 2 N s/m");
    let asked = asked(&mut panel);
    let [Intent::Set { target, value, .. }] = asked.as_slice() else {
        panic!("{asked:?}");
    };
    assert_eq!((target.to_string().as_str(), *value), ("viscous-", 2.0));
}

#[test]
fn a_remark_is_shown_beside_its_parameter() {
    let mut panel = connected(RigState::Engaged);
    let message = "static_force+ = 3 N is below the dynamic force of 3.5 N";
    let remark = Advice {
        param: "static_force+".into(),
        message: message.into(),
        finding: None,
    };
    hear(&mut panel, advised(1, vec![remark]));
    let below = panel.get_by_label(message).rect().top();
    assert!(panel.get_by_label("static force slider").rect().bottom() <= below);
    assert!(below < panel.get_by_label("dynamic force slider").rect().top());
}

#[test]
fn advice_on_an_older_scene_is_ignored() {
    let mut panel = connected(RigState::Engaged);
    let mut newer = state_event(RigState::Engaged, 200);
    newer.revision = 3;
    hear(&mut panel, Update::Event(Event::State(newer)));
    let old = || advised(2, vec![check("friction", 16_000.0, Some(16_000.0))]);
    hear(&mut panel, old());
    assert!(panel.query_by_label_contains("16000").is_none());
    hear(
        &mut panel,
        advised(3, vec![check("friction", 18_000.0, Some(18_000.0))]),
    );
    hear(&mut panel, old());
    panel.get_by_label("Friction: 25000, bound 18000 N/m");
}

#[test]
fn the_answer_to_a_change_warns_where_the_daemon_has_no_more_advice() {
    let mut panel = connected(RigState::Engaged);
    let error = WireError::new(ErrorCode::UnknownOp, "there is no operation `advise`");
    hear(&mut panel, Update::Advised(Err(error)));
    assert!(panel.query_by_label_contains("advise").is_none(), "nobody asked for it");
    let reply = ChangeReply {
        ramp_ends_tick: None,
        dry_run: false,
        changes: Vec::new(),
        revision: 2,
        tick: Some(321),
        applied: [("stiffness".to_owned(), 25_000.0)].into(),
        advice: vec![check("friction", 16_000.0, None)],
    };
    let applied = Update::Answered {
        intent: set("stiffness", 25_000.0),
        result: Ok(Answer::Changed(reply)),
    };
    hear(&mut panel, applied);
    panel.get_by_label("Friction: 25000, bound 16000 N/m");
    assert!(
        panel.query_by_label_contains("Stability").is_none(),
        "what it does not say may be kept or broken"
    );
}

#[test]
fn every_check_is_in_a_table_at_the_end_of_the_scene() {
    let mut panel = connected(RigState::Engaged);
    assert!(panel.query_by_label_contains("Stability").is_none());
    let advice = vec![
        check("linear_stability", 20_000.0, Some(20_000.0)),
        check("encoder", 160_000.0, None),
    ];
    hear(&mut panel, advised(1, advice));
    press(&mut panel, "Stability: 1 of 2 bounds broken");
    for text in [
        "Linear stability",
        "20000 N/m",
        "0.80",
        "Broken",
        "Encoder",
        "160000 N/m",
        "6.40",
        "Kept",
    ] {
        panel.get_by_label(text);
    }
    let mut without_limit = check("encoder", 160_000.0, None);
    let finding = without_limit.finding.as_mut().unwrap();
    (finding.bound, finding.margin) = (None, None);
    hear(&mut panel, advised(1, vec![without_limit]));
    assert_eq!(panel.query_all_by_label("∞").count(), 2);
    panel.get_by_label("Stability: the bound is kept");
}

#[test]
fn a_mending_of_both_directions_that_is_refused_says_so_where_they_differ() {
    let mut panel = connected(RigState::Engaged);
    panel.get_by_label("viscous by direction").click();
    panel.run();
    let mut advice = check("friction_passivity", 2.0, Some(2.0));
    advice.param = "viscous".into();
    hear(&mut panel, advised(1, vec![advice]));
    press(&mut panel, "set viscous to 2 N s/m");
    assert_eq!(asked(&mut panel), [set("viscous", 2.0)]);
    let refused = Update::Answered {
        intent: set("viscous", 2.0),
        result: Err(WireError::new(ErrorCode::OutOfRange, "viscous is refused")),
    };
    hear(&mut panel, refused);
    panel.get_by_label("viscous is refused");
}

#[test]
fn the_link_to_the_rig_is_always_in_sight() {
    let mut panel = connected(RigState::Idle);
    let timing = |link: LinkStatus| {
        Update::Event(Event::Timing(Box::new(Timing {
            rate_hz: 1000.0,
            link: Some(link),
            ..Timing::default()
        })))
    };
    let waiting = LinkStatus {
        waiting: Some("/dev/ttyACM0 is not there".into()),
        ..LinkStatus::default()
    };
    hear(&mut panel, timing(waiting));
    panel.get_by_label("Link: /dev/ttyACM0 is not there");
    let connected = LinkStatus {
        device: Some(LinkedDevice {
            firmware: "demo 1.0".into(),
            force_limit_n: 20.0,
            sample_rate_hz: 1000.0,
            resolution_m: 1e-5,
            watchdog_ms: Some(50),
            rig: None,
        }),
        round_trip_us: 1234.0,
        clock_drift_ppm: Some(-12.3),
        counts: LinkCounts {
            lost: 7,
            ..LinkCounts::default()
        },
        ..LinkStatus::default()
    };
    hear(&mut panel, timing(connected));
    for label in [
        "Link demo 1.0",
        "Round trip 1.23 ms, longest 0.0 ms",
        "Lost 7",
        "Bad CRC 0",
        "Device clock -12.3 ppm",
    ] {
        panel.get_by_label(label);
    }
}
