//! Any signal in any plot, and what happened meanwhile above them.

use crate::bench::{
    Hands as _, Panel, asked, connected, find_another_daemon, hear, lose_the_daemon, press, press_item, strike,
    strike_in_one_frame, value_of,
};
use crate::files::going;
use crate::plots::{csv_times, drag, feel, felt, rows, svg};
use crate::scene::active_scene;
use egui::{Key, Modifiers, OutputCommand};
use egui_kittest::kittest::Queryable;
use haptic_core::{Directional, Scene};
use haptic_ipc::{Difference, Event, JournalEntry, Peer, RigState, StateChange, Value};
use haptic_panel::{Intent, Update};

fn top_of(panel: &Panel, plot: &str) -> f32 {
    panel.get_by_label(plot).rect().top()
}

#[test]
fn without_a_block_there_is_no_line_of_it() {
    let mut panel = felt(0..1000, |_| 1.0);
    assert!(svg(&panel).contains(">Block position</text>"));
    let on_the_device = Scene {
        block: None,
        ..Scene::paper()
    };
    hear(&mut panel, active_scene(1, &on_the_device));
    let shown = svg(&panel);
    assert!(shown.contains(">Device position</text>"));
    for of_block in ["Block position", "Block velocity"] {
        assert!(!shown.contains(&format!(">{of_block}</text>")), "{of_block}");
    }
    panel.get_by_label("none");
    press(&mut panel, "Cursors");
    press_item(&mut panel, "Statistics");
    panel.get_by_label("Device velocity (mm/s)");
    let of_block = panel.query_all_by_label_contains("Block velocity").count();
    assert_eq!(of_block, 0, "neither at the cursors nor in the table");
}

#[test]
fn every_signal_can_be_shown_alone() {
    let mut panel = connected(RigState::Engaged);
    panel.set_size(egui::vec2(1280.0, 2000.0));
    feel(&mut panel, &rows(0..3000, |_| 2.0));
    let menu = "signals of the Force plot";
    press(&mut panel, menu);
    press_item(&mut panel, "Force on the hand");
    for name in [
        "Coupling force",
        "Force on the hand",
        "Block position",
        "Device position",
        "Block velocity",
        "Device velocity",
        "Coupling deflection",
        "Coupling energy",
        "Block acceleration",
        "Device acceleration",
        "Power to the block",
        "Power to the hand",
        "Tick time",
        "Round trip",
        "Wake-up latency",
    ] {
        let lines = |panel: &Panel| svg(panel).matches(&format!(">{name}</text>")).count();
        let before = lines(&panel);
        press_item(&mut panel, name);
        assert_eq!(lines(&panel), before + 1, "{name}");
        press_item(&mut panel, name);
        assert_eq!(lines(&panel), before, "{name}");
    }
}

#[test]
fn plots_are_added_moved_and_removed() {
    let mut panel = felt(0..3000, |_| 2.0);
    let high = panel.get_by_label("Force plot").rect().height();
    press(&mut panel, "signals of the Velocity plot");
    press(&mut panel, "Remove plot");
    assert!(panel.query_by_label("Velocity plot").is_none());
    assert!(
        panel.get_by_label("Force plot").rect().height() > high,
        "the rest takes its place"
    );
    press(&mut panel, "Plots");
    press(&mut panel, "add energy plot");
    // 2 N over 0.34 mm.
    assert!(svg(&panel).contains(">Energy (mJ)<"));
    for (button, first, second) in [
        ("Move up", "Position plot", "Force plot"),
        ("Move down", "Force plot", "Position plot"),
        ("Move up", "Position plot", "Force plot"),
    ] {
        press(&mut panel, "signals of the Position plot");
        press(&mut panel, button);
        assert!(top_of(&panel, first) < top_of(&panel, second), "{button}");
    }
    press(&mut panel, "Plots");
    press(&mut panel, "Usual plots");
    assert!(top_of(&panel, "Force plot") < top_of(&panel, "Position plot"));
    assert!(panel.query_by_label("Energy plot").is_none());
    for plot in ["Force", "Position", "Velocity"] {
        press(&mut panel, &format!("signals of the {plot} plot"));
        press(&mut panel, "Remove plot");
    }
    press(&mut panel, "Show the usual plots");
    panel.get_by_label("Force plot");
}

#[test]
fn the_names_of_the_lines_and_the_numbers_of_time_hide_nothing() {
    let panel = felt(0..3000, |_| 2.0);
    let plot = panel.get_by_label("Force plot").rect();
    // The readouts have the same words higher up.
    let is_above = panel.get_all_by_label("Force on the hand").any(|name| {
        let name = name.rect();
        name.bottom() <= plot.top() + 1.0 && name.top() > plot.top() - 30.0
    });
    assert!(is_above, "the name of the line is not above its plot");
    let next = top_of(&panel, "Position plot");
    assert!(
        next - plot.bottom() < 26.0,
        "numbers of time below the first plot: {next}, {plot:?}"
    );
    let area = panel.state().model.plots_area();
    assert!(plot.right() + 12.0 <= area.right(), "the last number is cut");
}

/// A change of a parameter that was even.
pub(crate) fn difference(param: &str, unit: &str, before: f64, after: Directional) -> Difference {
    Difference {
        param: param.into(),
        unit: Some(unit.into()),
        before: Some(Value::Number(Directional::both(before))),
        after: Some(Value::Number(after)),
    }
}

pub(crate) fn by_ada(op: &str, tick: u64) -> JournalEntry {
    JournalEntry {
        seq: tick,
        tick: Some(tick),
        by: Some(Peer {
            user: Some("ada".into()),
            program: Some("haptic-ctl".into()),
            pid: Some(7),
            ..Peer::default()
        }),
        ..JournalEntry::of(op)
    }
}

#[test]
fn time_axis_flags_scene_and_state_changes_with_author() {
    let mut panel = felt(0..2000, |_| 1.0);
    let set = JournalEntry {
        changes: vec![difference("static_force", "N", 4.0, Directional::both(5.0))],
        ..by_ada("set", 1000)
    };
    let released = JournalEntry {
        state: Some(StateChange {
            before: RigState::Engaged,
            after: RigState::Releasing,
        }),
        ..by_ada("release", 1800)
    };
    let unticked = JournalEntry {
        tick: None,
        ..by_ada("scene_save", 1900)
    };
    for entry in [set, released, unticked] {
        hear(&mut panel, Update::Event(Event::Log(Box::new(entry))));
    }
    let set = "Scene: ada (haptic-ctl, process 7): set, static_force: 4 N -> 5 N";
    let released = "State: ada (haptic-ctl, process 7): release, engaged -> releasing";
    let [first, second] = [set, released].map(|flag| panel.get_by_label(flag).rect());
    assert!(first.center().x < second.center().x);
    assert!(first.bottom() <= top_of(&panel, "Force plot"), "it hides no data");
    // A press shows the text until another.
    panel.click_on(set);
    assert_eq!(panel.get_all_by_label(set).count(), 2, "flag and text");
    press(&mut panel, "Freeze");
    feel(&mut panel, &rows(2000..5000, |_| 1.0));
    panel.get_by_label(released);
}

const NOTE: &str = "note on this moment";

// hazard: H28
#[test]
fn a_note_is_taken_by_key_typed_with_spaces_and_set_by_enter() {
    let mut panel = felt(0..2000, |_| 1.0);
    // A marker has its key, too.
    hear(&mut panel, going("/home/ada/r.mcap"));
    for now in [2000, 3000] {
        if now == 2000 {
            strike(&mut panel, "nst");
        } else {
            strike_in_one_frame(&mut panel, "nst");
        }
        strike(&mut panel, "eel on m");
        assert_eq!(value_of(&panel, NOTE), "steel on m");
        // The moment is that of the key, whatever comes meanwhile.
        feel(&mut panel, &rows(now..now + 1000, |_| 1.0));
        panel.hit(Key::Enter);
        let text = "steel on m".to_owned();
        let tick = u64::from(now) - 1;
        assert_eq!(asked(&mut panel), [Intent::Marker { tick, text }]);
        assert!(panel.query_all_by_label("Marker: steel on m").next().is_some());
        assert!(panel.query_by_label(NOTE).is_none());
    }
    panel.key_press(Key::Space);
    panel.step();
    assert_eq!(asked(&mut panel), [Intent::Stop], "the field is gone");
}

// hazard: H28
#[test]
fn no_stop_page_click_or_other_daemon_loses_a_note() {
    let mut panel = felt(0..2000, |_| 1.0);
    strike(&mut panel, "n");
    panel.hit(Key::Escape);
    assert!(panel.query_by_label(NOTE).is_none(), "nothing was typed");
    strike(&mut panel, "nsteel");
    let losses: [fn(&mut Panel); 4] = [
        |panel| panel.key_press(Key::Escape),
        |panel| panel.get_by_label("Stop").click(),
        |panel| panel.key_press_modifiers(Modifiers::COMMAND, Key::Num2),
        |panel| {
            lose_the_daemon(panel);
            find_another_daemon(panel);
        },
    ];
    for lose in losses {
        lose(&mut panel);
        panel.run();
        assert_eq!(value_of(&panel, NOTE), "steel");
    }
    // Its moment was that of another daemon: it waits for a sample of this one.
    strike(&mut panel, "n on");
    panel.hit(Key::Enter);
    assert_eq!(value_of(&panel, NOTE), "steel on");
    feel(&mut panel, &rows(0..500, |_| 1.0));
    panel.hit(Key::Enter);
    assert!(panel.query_by_label(NOTE).is_none());
    panel.get_by_label("Marker: steel on");
}

#[test]
fn a_plot_that_stands_still_has_an_overview_that_moves_it() {
    let mut panel = felt(0..20_000, |_| 1.0);
    assert!(
        panel.query_by_label("overview").is_none(),
        "a running plot is at its end"
    );
    press(&mut panel, "Freeze");
    let bar = panel.get_by_label("overview").rect();
    let first = panel.get_by_label("Force plot").rect();
    assert!(
        bar.top() > first.bottom() && bar.bottom() < 640.0,
        "it is never scrolled away: {bar:?}"
    );
    let middle = bar.center();
    drag(&mut panel, middle, egui::Vec2::ZERO);
    let (from, to) = csv_times(&panel);
    assert!((from - 7.5).abs() < 0.2 && (to - 12.5).abs() < 0.2, "{from} to {to}");
    drag(&mut panel, middle, egui::vec2(-bar.width() / 4.0, 0.0));
    let (from, to) = csv_times(&panel);
    assert!((from - 2.5).abs() < 0.3 && (to - 7.5).abs() < 0.3, "{from} to {to}");
    press(&mut panel, "Run");
    assert!(panel.query_by_label("overview").is_none());
}

/// The text that the next frames copy.
fn copied(panel: &mut Panel) -> Option<String> {
    (0..5).find_map(|_| {
        panel.step();
        let commands = &panel.output().platform_output.commands;
        commands.iter().find_map(|command| match command {
            OutputCommand::CopyText(text) => Some(text.clone()),
            _ => None,
        })
    })
}

#[test]
fn a_change_is_copied_as_a_command() {
    let mut panel = connected(RigState::Engaged);
    let after = Directional {
        positive: 5.0,
        negative: 3.0,
    };
    let set = JournalEntry {
        ramp_ms: Some(200.0),
        changes: vec![difference("static_force", "N", 4.0, after)],
        ..by_ada("set", 1000)
    };
    hear(&mut panel, Update::Event(Event::Log(Box::new(set))));
    press(&mut panel, "Changes");
    let command = "haptic-ctl --rig left set static_force+=5 static_force-=3 --ramp 200ms";
    let button = format!("copy {command}");
    panel.get_by_label(&button).scroll_to_me();
    panel.run();
    panel.get_by_label(&button).click();
    assert_eq!(copied(&mut panel).as_deref(), Some(command));
    panel.get_by_label("Mass").scroll_to_me();
    panel.run();
    panel.get_by_label("Mass").click_secondary();
    panel.run();
    panel.get_by_label("Copy as haptic-ctl command").click();
    assert_eq!(copied(&mut panel).as_deref(), Some("haptic-ctl --rig left set M=0.5"));
}
