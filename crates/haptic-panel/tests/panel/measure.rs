//! What is measured on the plots, and two runs over one another.

use crate::bench::{Hands as _, Panel, choose_item, connected, enter, hear, item_of, press, press_item};
use crate::metadata::metadata;
use crate::plots::{drag, feel, number_of, rows, svg, usual_plots, wheel};
use crate::scene::active_scene;
use egui::{Key, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable};
use haptic_core::Scene;
use haptic_ipc::{RigState, Sample};
use haptic_panel::{Loaded, Update};
use haptic_recording::{Ending, Mark};

/// The label that begins so.
fn label(panel: &Panel, beginning: &str) -> String {
    let all = panel.get_all_by_label_contains(beginning);
    let texts = all.filter_map(|node| node.accesskit_node().value());
    let mut texts = texts.filter(|text| text.starts_with(beginning));
    texts.next().unwrap_or_else(|| panic!("nothing says {beginning}"))
}

/// A step of 4 N at 0.2 s that goes beyond by 1 N for a moment, and a square wave of 50 Hz on top of nothing.
fn step(ms: u32) -> f64 {
    match ms {
        ..200 => 0.0,
        200..300 => 5.0,
        _ => 4.0,
    }
}

pub(crate) fn open(panel: &mut Panel, name: &str, rows: Vec<Sample>, marks: &[Mark]) {
    let loaded = Loaded::new(name.into(), metadata(), rows, marks, Ending::Complete);
    let (path, result) = (name.into(), Ok(Box::new(loaded)));
    hear(panel, Update::Opened { path, result });
}

#[test]
fn a_shortened_line_has_one_hint_with_the_whole() {
    let mut panel = connected(RigState::Engaged);
    panel.set_size(egui::vec2(1280.0, 800.0));
    let name = format!("{}.csv", "long".repeat(50));
    open(&mut panel, &name, rows(0..1000, step), &[]);
    panel.get_by_label_contains("Looking at").hover();
    crate::bench::wait(&mut panel, 1.0);
    assert_eq!(panel.query_all_by_label_contains("Looking at").count(), 2);
}

#[test]
fn three_plots_fit_under_two_cursors_in_a_low_window() {
    let mut panel = connected(RigState::Engaged);
    // The usual window, less the strip of a hand that is the mouse.
    panel.set_size(egui::vec2(1280.0, 690.0));
    open(&mut panel, "a.csv", rows(0..1000, step), &[]);
    press(&mut panel, "Cursors");
    panel.run();
    let plots = usual_plots(&panel);
    let below = panel.get_by_label("overview").rect().top();
    assert!(
        plots.iter().all(|plot| plot.height() > 50.0 && plot.bottom() < below),
        "{plots:?} {below}"
    );
}

#[test]
fn statistics_cover_what_is_seen_and_between_the_cursors() {
    let mut panel = connected(RigState::Engaged);
    open(&mut panel, "a.csv", rows(0..1000, step), &[]);
    press_item(&mut panel, "Statistics");
    for (column, value) in [
        ("min", "0"),
        ("max", "5.00"),
        ("mean", "3.30"),
        ("p-p", "5.00"),
        ("over", "25 %"),
        ("settle", "0.300 s"),
    ] {
        panel.get_by_label(&format!("Force on the hand {column} {value}"));
    }
    press(&mut panel, "Cursors");
    enter(&mut panel, "cursor 1", "0.4");
    enter(&mut panel, "cursor 2", "0.6");
    panel.get_by_label("0.2000 s between the cursors");
    for value in ["mean 4.00", "rms 4.00", "p-p 0", "over none", "settle none"] {
        panel.get_by_label(&format!("Force on the hand {value}"));
    }
}

#[test]
fn the_spectrum_has_a_sine_at_its_frequency_and_tells_of_gaps() {
    let mut panel = connected(RigState::Engaged);
    let sine = |ms: u32| 3.0 * (std::f64::consts::TAU * 0.05 * f64::from(ms)).sin();
    open(&mut panel, "a.csv", rows(0..2000, sine), &[]);
    press_item(&mut panel, "Spectrum");
    panel.get_by_label("Highest: 3.00 N at 50.00 Hz; one value every 0.500 Hz");
    panel.get_by_label("Spectrum plot");
    assert!(svg(&panel).contains("dB over 1 N"));
    press_item(&mut panel, "Power density");
    panel.get_by_label_contains("(N)²/Hz at 50.00 Hz");
    press_item(&mut panel, "Amplitude");
    panel.get_by_label("Highest: 3.00 N at 50.00 Hz; one value every 0.500 Hz");
    press_item(&mut panel, "Power density");
    choose_item(&mut panel, "signal of the spectrum", "Device velocity");
    panel.get_by_label_contains("(mm/s)²/Hz");
    let mut torn = rows(0..2000, sine);
    torn.drain(1000..1010);
    open(&mut panel, "b.csv", torn, &[]);
    panel.get_by_label_contains("samples are missing 0.999 s after the first in sight");
}

#[test]
fn reference_recording_aligns_at_a_mark_or_a_crossing() {
    let marker = |tick| Mark::Marker {
        tick,
        text: "pull".to_owned(),
    };
    // The same change, by another process.
    let change = |tick, pid| {
        let entry = serde_json::json!({
            "seq": 1, "time_unix_s": 0, "tick": tick, "op": "set", "revision": 2,
            "by": { "session": "1-1", "uid": 1000, "user": "ada", "pid": pid, "program": "haptic-ctl" },
            "changes": [{ "param": "dynamic_force", "before": 3.5, "after": 2.5 }],
        });
        let entry = serde_json::from_value(entry).expect("an entry");
        Mark::Journal { tick, entry }
    };
    let mut panel = connected(RigState::Engaged);
    open(&mut panel, "a.csv", rows(0..1000, step), &[marker(200), change(200, 7)]);
    press(&mut panel, "Compare");
    press(&mut panel, "Keep what is seen as the reference");
    // The same pull, 100 ms later, and half a newton stronger at its end.
    let later = |ms: u32| step(ms.saturating_sub(100)) + if ms >= 600 { 0.5 } else { 0.0 };
    open(
        &mut panel,
        "b.csv",
        rows(0..1000, later),
        &[marker(300), change(300, 8)],
    );
    assert!(svg(&panel).contains(">Force on the hand, reference</text>"));
    press_item(&mut panel, "Force against velocity");
    assert!(svg(&panel).contains(">Trail, reference</text>"));
    press_item(&mut panel, "Statistics");
    let shifted = label(&panel, "minus the reference: rms");
    assert!(shifted.contains("peak -5.00 N at 0.2000 s"), "{shifted}");
    let aligned = |panel: &Panel| {
        let text = label(panel, "minus the reference: rms");
        assert!(text.contains("peak 0.500 N at 0.6000 s"), "{text}");
        let shift_s = number_of(panel, "shift of the reference");
        assert!((shift_s - 0.1).abs() < 1e-9, "{shift_s}");
    };
    press(&mut panel, "Compare");
    press(&mut panel, "Align at pull");
    aligned(&panel);
    press(&mut panel, "0 s");
    assert_eq!(label(&panel, "minus the reference: rms"), shifted);
    press(&mut panel, "Align at set, dynamic_force: 3.5 -> 2.5");
    aligned(&panel);
    press(&mut panel, "0 s");
    press(&mut panel, "Align where the trigger's level is crossed");
    aligned(&panel);
    press(&mut panel, "Compare");
    // A pull that is weaker than the level that the trigger begins with.
    for (level, problem) in [("30", 1), ("1", 0)] {
        enter(&mut panel, "trigger level", level);
        press(&mut panel, "Compare");
        press(&mut panel, "Align where the trigger's level is crossed");
        let problems = panel.query_all_by_label_contains("does not cross").count();
        assert_eq!(problems, problem, "{level} N");
        press(&mut panel, "Compare");
    }
    press(&mut panel, "Compare");
    aligned(&panel);
    // The rig against the recording.
    press(&mut panel, "Compare");
    panel.hit_with(Modifiers::COMMAND, Key::Num1);
    feel(&mut panel, &rows(0..1000, |_| 1.0));
    press_item(&mut panel, "Over time");
    assert!(svg(&panel).contains(">Force on the hand, reference</text>"));
    press(&mut panel, "Compare");
    panel.get_by_label("Reference: a.csv");
    press(&mut panel, "Drop the reference");
    assert!(!svg(&panel).contains("reference"));
}

#[test]
fn any_signal_is_drawn_against_any_other_over_any_time() {
    let mut panel = connected(RigState::Engaged);
    let moving = |ms: u32| Sample {
        device_position_m: f64::from(ms) * 1e-5,
        ..rows(ms..ms + 1, step)[0]
    };
    open(&mut panel, "a.csv", (0..5000).map(moving).collect(), &[]);
    press_item(&mut panel, "Force against velocity");
    panel.get_by_label("Force against velocity plot");
    assert!(
        panel.query_by_label("Force plot").is_none(),
        "a narrow window shows one"
    );
    choose_item(&mut panel, "horizontal signal", "Device position");
    choose_item(&mut panel, "vertical signal", "Block velocity");
    panel.get_by_label("Block velocity against device position plot");
    choose_item(&mut panel, "vertical signal", "Coupling force");
    panel.get_by_label("Coupling force against device position plot");
    // The last second: from 40 mm on.
    let axis = |panel: &Panel| {
        let text = svg(panel);
        (text.contains(">42<"), text.contains(">20<"))
    };
    assert_eq!(axis(&panel), (true, false));
    choose_item(&mut panel, "samples drawn", "All in sight");
    assert_eq!(axis(&panel), (false, true));
    let plot = panel.get_by_label("Coupling force against device position plot").rect();
    wheel(&mut panel, plot.center());
    wheel(&mut panel, plot.center());
    assert_eq!(axis(&panel), (false, false), "zoomed to some millimetres around 25 mm");
    drag(&mut panel, plot.center(), egui::vec2(-plot.width() / 3.0, 0.0));
    press(&mut panel, "Cursors");
    enter(&mut panel, "cursor 1", "0.1");
    enter(&mut panel, "cursor 2", "1.1");
    panel.get_by_label("Cursor 1: 1.000 mm, 0 N; cursor 2: 11.00 mm, 4.000 N; difference 10.00 mm, 4.000 N");
    choose_item(&mut panel, "samples drawn", "Between cursors");
    choose_item(&mut panel, "horizontal signal", "Block velocity");
    panel.get_by_label("Force against velocity plot");
    assert!(svg(&panel).contains(">Law<"));
    press(&mut panel, "Zoom to the stick band");
}

const CIRCLE: &str = "Coupling force against device position plot";

/// The top and the right end of the circle in its plot, of whose fitted axes 8 % are free at either end.
fn places(panel: &Panel) -> (egui::Pos2, egui::Pos2) {
    let plot = panel.get_by_label(CIRCLE).rect();
    let radius = plot.size() / 2.0 / 1.16;
    (
        plot.center() - egui::vec2(0.0, radius.y),
        plot.center() + egui::vec2(radius.x, 0.0),
    )
}

#[test]
fn dragged_cursor_dot_stays_on_its_turn_of_the_trail() {
    let mut panel = connected(RigState::Engaged);
    // A circle of 10 mm and 4 N, once a second.
    let turning = |ms: u32| {
        let (sin, cos) = (f64::from(ms) * 1e-3 * std::f64::consts::TAU).sin_cos();
        Sample {
            device_position_m: 0.01 * sin,
            ..rows(ms..ms + 1, |_| 4.0 * cos)[0]
        }
    };
    open(&mut panel, "a.csv", (0..5000).map(turning).collect(), &[]);
    press_item(&mut panel, "Force against velocity");
    choose_item(&mut panel, "horizontal signal", "Device position");
    press(&mut panel, "Cursors");
    let cursors = |panel: &Panel| ["cursor 1", "cursor 2"].map(|field| number_of(panel, field));
    // In the last second alone the first cursor is before all that is drawn, which is a whole turn as well.
    for extent in ["Last second", "Between cursors", "All in sight"] {
        choose_item(&mut panel, "samples drawn", extent);
        for (field, at_s) in [("cursor 1", "2"), ("cursor 2", "3.5")] {
            enter(&mut panel, field, at_s);
        }
        let (top, right) = places(&panel);
        drag(&mut panel, top, right - top);
        let [first, second] = cursors(&panel);
        assert!((first - 2.25).abs() < 0.02, "{extent}: {first}: on its own turn");
        assert_eq!(second, 3.5, "{extent}");
    }
    let [first, second] = cursors(&panel);
    let plot = panel.get_by_label(CIRCLE).rect();
    // What is dragged in the middle is the plot.
    drag(&mut panel, plot.center(), egui::vec2(20.0, 0.0));
    assert_eq!(cursors(&panel), [first, second]);
}

#[test]
fn force_limits_are_lines_and_clipped_samples_are_dots() {
    let mut panel = connected(RigState::Engaged);
    hear(&mut panel, active_scene(1, &Scene::paper()));
    // The limit of this recording is 20 N.
    let clipped = |ms: u32| Sample {
        command_force_n: if ms == 500 { -20.0 } else { 1.0 },
        ..rows(ms..ms + 1, step)[0]
    };
    open(&mut panel, "a.csv", (0..1000).map(clipped).collect(), &[]);
    let text = svg(&panel);
    for line in [">Fs</text>", ">Fd</text>", ">force limit</text>"] {
        assert!(text.contains(line), "{line}");
    }
    assert_eq!(text.matches("<title>clipped by the force limit</title>").count(), 1);
    item_of(&panel, "Limits").click();
    panel.run();
    let text = svg(&panel);
    assert!(!text.contains(">Fs</text>") && !text.contains("force limit"));
}
