//! What is done with the plots: freeze, move, trigger, measure, export, record, open.

use super::*;
use crate::metadata::metadata;
use haptic_gui::{Format, Loaded, RecordingNews};
use haptic_ipc::{Bucket, Percentiles, TimingHistogram};
use haptic_lab::recording::{Ending, Totals};

fn rows(ms: std::ops::Range<u32>, force: impl Fn(u32) -> f64) -> Vec<Sample> {
    ms.map(|ms| Sample {
        tick: u64::from(ms),
        coupling_force_n: force(ms),
        ..sample(f64::from(ms) * 1e-3)
    })
    .collect()
}

fn feel(panel: &mut Panel, rows: &[Sample]) {
    for batch in rows.chunks(34) {
        let batch = SamplesEvent {
            seq: 0,
            dropped: 0,
            rows: batch.to_vec(),
        };
        panel.state_mut().model.apply(Update::Event(Event::Samples(batch)));
    }
    panel.run();
}

fn choose(panel: &mut Panel, list: &str, item: &str) {
    press(panel, list);
    press(panel, item);
}

fn csv_times(panel: &Panel) -> (f64, f64) {
    let text = haptic_gui::export::csv(&panel.state().model);
    let times: Vec<f64> = text
        .lines()
        .skip(1)
        .filter_map(|line| line.split(',').nth(1)?.parse().ok())
        .collect();
    let milliseconds = |t_s: f64| (t_s * 1e3).round() / 1e3;
    (milliseconds(times[0]), milliseconds(times[times.len() - 1]))
}

#[test]
fn plots_run_until_they_are_frozen() {
    let mut panel = connected(RigState::Engaged);
    feel(&mut panel, &rows(0..6000, |_| 1.0));
    press(&mut panel, "Freeze");
    feel(&mut panel, &rows(6000..9000, |_| 1.0));
    assert_eq!(csv_times(&panel).1, 5.999);
    press(&mut panel, "Run");
    assert_eq!(csv_times(&panel).1, 8.999);
}

#[test]
fn what_is_frozen_outlives_the_daemon() {
    let mut panel = connected(RigState::Engaged);
    feel(&mut panel, &rows(0..6000, |_| 1.0));
    press(&mut panel, "Freeze");
    let seen = csv_times(&panel);
    lose_the_daemon(&mut panel);
    panel.get_by_label("Force plot");
    assert_eq!(csv_times(&panel), seen);
    find_another_daemon(&mut panel);
    feel(&mut panel, &rows(0..3000, |_| 2.0));
    assert_eq!(csv_times(&panel), seen, "the seconds before the other died");
    press(&mut panel, "Run");
    assert_eq!(csv_times(&panel).1, 2.999);
}

#[test]
fn what_came_last_before_the_daemon_died_can_be_looked_at_and_kept() {
    let mut panel = connected(RigState::Engaged);
    feel(&mut panel, &rows(0..6000, |_| 1.0));
    lose_the_daemon(&mut panel);
    panel.get_by_label("Below is what came last before the connection was lost.");
    panel.get_by_label("Force plot");
    assert_eq!(csv_times(&panel).1, 5.999);
    assert!(panel.query_by_label("-3.50").is_none(), "it is not what is so now");
    press(&mut panel, "Export");
    panel.get_by_label("export CSV");
    find_another_daemon(&mut panel);
    assert!(panel.query_by_label("-3.50").is_none(), "nor is it of this daemon");
    assert_eq!(csv_times(&panel).1, 5.999);
    feel(&mut panel, &rows(0..1000, |_| 2.0));
    assert_eq!(csv_times(&panel), (0.0, 0.999));
}

#[test]
fn plots_are_zoomed_and_moved_by_button_and_by_pointer() {
    let mut panel = connected(RigState::Engaged);
    feel(&mut panel, &rows(0..20_000, |_| 1.0));
    press(&mut panel, "zoom in");
    panel.get_by_label("3.33 s");
    press(&mut panel, "zoom out");
    panel.get_by_label("5.00 s");
    press(&mut panel, "earlier");
    let (from, to) = csv_times(&panel);
    assert!(
        (from - 13.75).abs() < 0.01 && (to - 18.75).abs() < 0.01,
        "{from} to {to}"
    );

    let plot = panel.get_by_label("Position plot").rect();
    wheel(&mut panel, plot.center());
    let (from, to) = csv_times(&panel);
    assert!(to - from < 2.5, "{from} to {to}");

    drag(&mut panel, plot.center(), egui::vec2(100.0, 0.0));
    assert!(csv_times(&panel).0 < from - 0.1, "dragged to earlier times");
}

fn wheel(panel: &mut Panel, at: egui::Pos2) {
    panel.hover_at(at);
    // A tooltip comes up in its own time.
    panel.run_steps(10);
    panel.event(egui::Event::MouseWheel {
        unit: egui::MouseWheelUnit::Point,
        delta: egui::vec2(0.0, 200.0),
        phase: egui::TouchPhase::Move,
        source: egui::MouseWheelSource::Wheel,
        modifiers: Modifiers::NONE,
    });
    panel.run_steps(10);
}

fn drag(panel: &mut Panel, from: egui::Pos2, way: egui::Vec2) {
    panel.drag_at(from);
    panel.run();
    panel.hover_at(from + way);
    panel.run();
    panel.drop_at(from + way);
    panel.run_steps(10);
}

/// The ends of the force axis, as the menu has them.
fn force_axis(panel: &mut Panel) -> (f64, f64) {
    press(panel, "Axes");
    let [low, high] = ["lower", "upper"].map(|end| {
        let label = format!("force axis {end} end");
        let field = panel.get_by_label(&label);
        field.accesskit_node().numeric_value().expect("a number")
    });
    panel.key_press(Key::Tab);
    press(panel, "Axes");
    (low, high)
}

#[test]
fn the_axis_of_the_values_is_zoomed_moved_typed_and_fitted_again() {
    let mut panel = connected(RigState::Engaged);
    feel(&mut panel, &rows(0..20_000, |ms| if ms % 2 == 0 { 4.0 } else { -4.0 }));
    let fitted = force_axis(&mut panel);
    assert!(fitted.0 < -4.0 && fitted.1 > 4.0, "{fitted:?}");
    let before = csv_times(&panel);

    let numbers = panel.get_by_label("Force axis").rect();
    wheel(&mut panel, numbers.center());
    let zoomed = force_axis(&mut panel);
    assert!(zoomed.1 - zoomed.0 < 0.5 * (fitted.1 - fitted.0), "{zoomed:?}");
    assert_eq!(csv_times(&panel), before, "time goes on as it was");

    drag(&mut panel, numbers.center(), egui::vec2(0.0, numbers.height() / 2.0));
    let moved = force_axis(&mut panel);
    assert!(
        moved.0 > zoomed.0 && moved.1 > zoomed.1,
        "{moved:?}: greater values come into sight"
    );

    press(&mut panel, "Axes");
    type_into(&mut panel, "force axis lower end", "3.9");
    press(&mut panel, "Axes");
    assert_eq!(force_axis(&mut panel).0, 3.9);

    press(&mut panel, "Axes");
    press(&mut panel, "Fit force");
    press(&mut panel, "Axes");
    assert_eq!(force_axis(&mut panel), fitted);
}

#[test]
fn a_trigger_catches_a_crossing_with_what_was_before_it() {
    let mut panel = connected(RigState::Engaged);
    choose(&mut panel, "trigger", "Single");
    choose(&mut panel, "trigger signal", "Coupling force");
    panel.get_by_label("Armed");
    feel(&mut panel, &rows(0..14_000, |ms| if ms < 10_000 { 0.0 } else { 5.0 }));
    panel.get_by_label("Caught");
    let (from, to) = csv_times(&panel);
    assert!(
        (from - 7.5).abs() < 0.01 && (to - 12.5).abs() < 0.01,
        "half of 5 s before 10 s: {from} to {to}"
    );
    feel(&mut panel, &rows(14_000..20_000, |_| 0.0));
    assert_eq!(csv_times(&panel), (from, to));
    press(&mut panel, "Arm");
    panel.get_by_label("Armed");
}

/// Where the crossing is that the trigger has caught, and how much before it is seen, s.
fn caught_s(panel: &Panel, share_before: f64) -> (f64, f64) {
    let (from, to) = csv_times(panel);
    let before = share_before * (to - from);
    (((from + before) * 10.0).round() / 10.0, before)
}

fn square(ms: u32) -> f64 {
    if ms % 8000 < 4000 { 0.0 } else { 5.0 }
}

#[test]
fn a_trigger_takes_the_edge_and_the_share_that_it_is_given() {
    let mut panel = connected(RigState::Engaged);
    choose(&mut panel, "trigger", "Single");
    press(&mut panel, "Falling");
    type_into(&mut panel, "pre-trigger share", "20");
    panel.key_press(Key::Enter);
    panel.run();
    assert!(panel.get_by_label("pre-trigger share").is_focused());
    feel(&mut panel, &rows(0..14_000, square));
    panel.get_by_label("Caught");
    let (at, before) = caught_s(&panel, 0.2);
    assert!(at == 8.0 && (before - 1.0).abs() < 0.01, "{at}, {before}");
}

#[test]
fn normal_holds_the_last_crossing_and_automatic_runs_on_without_one() {
    for (mode, holds) in [("Normal", true), ("Auto", false)] {
        let mut panel = connected(RigState::Engaged);
        choose(&mut panel, "trigger", mode);
        feel(&mut panel, &rows(0..8000, square));
        assert_eq!(caught_s(&panel, 0.5).0, 4.0, "{mode}");
        feel(&mut panel, &rows(8000..16_000, square));
        assert_eq!(caught_s(&panel, 0.5).0, 12.0, "{mode}: the next");
        feel(&mut panel, &rows(16_000..40_000, |_| 0.0));
        let (_, to) = csv_times(&panel);
        assert_eq!(to < 16.0, holds, "{mode}: up to {to} s");
    }
}

#[test]
fn a_trigger_is_chosen_by_keyboard() {
    let mut panel = connected(RigState::Engaged);
    for (list, item) in [("trigger", "Normal"), ("trigger signal", "Block velocity")] {
        panel.get_by_label(list).focus();
        panel.run();
        panel.key_press(Key::Enter);
        panel.run();
        panel.get_by_label(item).focus();
        panel.run();
        panel.key_press(Key::Enter);
        panel.run();
        assert!(panel.query_by_label(item).is_none(), "{item}: a choice closes the list");
        assert!(panel.get_by_label(list).is_focused());
    }
    panel.get_by_label("Armed");
}

#[derive(Debug)]
struct Dropped(std::path::PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &std::path::Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        Err("the panel reads it by its path".to_owned())
    }
}

#[test]
fn a_file_that_is_dropped_on_the_window_is_opened() {
    let mut panel = connected(RigState::Engaged);
    let file = Dropped("/home/ada/r.csv".into());
    panel.input_mut().dropped_files.push(std::sync::Arc::new(file));
    panel.run();
    let path = std::path::PathBuf::from("/home/ada/r.csv");
    assert_eq!(asked(&mut panel), [Intent::Open { path }]);
}

#[test]
fn cursors_that_are_out_of_sight_are_fetched_by_their_button() {
    let mut panel = connected(RigState::Engaged);
    feel(&mut panel, &rows(0..20_000, |ms| f64::from(ms) * 1e-3));
    press(&mut panel, "Freeze");
    press(&mut panel, "Cursors");
    for _ in 0..8 {
        press(&mut panel, "earlier");
    }
    press(&mut panel, "Cursors");
    panel.get_by_label("dt 1.6667 s, 1/dt 0.6000 Hz");
    panel.get_by_label("Coupling force +1.667 N");
    press(&mut panel, "Cursors");
    assert!(panel.query_by_label_contains("1/dt").is_none());
}

#[test]
fn plots_do_not_lie_over_one_another_in_the_smallest_window() {
    let mut panel = connected(RigState::Engaged);
    feel(&mut panel, &rows(0..6000, |ms| f64::from(ms) * 1e-3));
    hear(&mut panel, Update::Event(Event::Timing(Box::new(timing(vec![])))));
    press(&mut panel, "Histograms");
    press(&mut panel, "Cursors");
    choose(&mut panel, "trigger", "Normal");
    let plots = ["Force plot", "Position plot", "Velocity plot"].map(|plot| panel.get_by_label(plot).rect());
    for (place, plot) in plots.iter().enumerate() {
        assert!(plot.height() >= 80.0, "{plot:?}");
        assert!(
            plots[..place].iter().all(|above| above.bottom() <= plot.top()),
            "{plots:?}"
        );
    }
}

#[test]
fn cursors_say_what_lies_between_them() {
    let mut panel = connected(RigState::Engaged);
    feel(&mut panel, &rows(0..6000, |ms| f64::from(ms) * 1e-3));
    press(&mut panel, "Freeze");
    press(&mut panel, "Cursors");
    panel.get_by_label("dt 1.6667 s, 1/dt 0.6000 Hz");
    panel.get_by_label("Coupling force +1.667 N");
    press(&mut panel, "Cursors");
    assert!(panel.query_by_label_contains("1/dt").is_none());
}

#[test]
fn every_plot_can_be_hidden_and_the_rest_takes_its_place() {
    let mut panel = connected(RigState::Engaged);
    let high = panel.get_by_label("Force plot").rect().height();
    press(&mut panel, "plot velocity");
    assert!(panel.query_by_label("Velocity plot").is_none());
    assert!(panel.get_by_label("Force plot").rect().height() > high);
    press(&mut panel, "Force against velocity");
    panel.get_by_label("Force against velocity plot");
    press(&mut panel, "Zoom to the stick band");
}

#[test]
fn what_is_seen_is_exported() {
    let mut panel = connected(RigState::Engaged);
    for format in Format::ALL {
        press(&mut panel, "Export");
        type_into(&mut panel, "folder to export to", "/tmp/plots");
        let name = format!("export {}", format.extension().to_uppercase());
        press(&mut panel, &name);
        let folder = "/tmp/plots".into();
        assert_eq!(asked(&mut panel), [Intent::Export { format, folder }]);
    }
    hear(&mut panel, Update::Exported(Ok("/tmp/plots/haptic-plot-1.svg".into())));
    panel.get_by_label("Written: /tmp/plots/haptic-plot-1.svg");
    hear(
        &mut panel,
        Update::Exported(Err("cannot write /x: no such folder".into())),
    );
    panel.get_by_label("cannot write /x: no such folder");
    wait(&mut panel, 10.0);
    press(&mut panel, "close the message");
    assert!(panel.query_by_label("cannot write /x: no such folder").is_none());
}

#[test]
fn a_recording_shows_its_length_and_size_until_it_is_ended() {
    let mut panel = connected(RigState::Engaged);
    let (path, totals) = (
        std::path::PathBuf::from("/home/ada/r.csv"),
        Totals {
            rows: 12_300,
            lost: 2,
            bytes: 1_810_000,
            length_s: 12.3,
        },
    );
    let going = RecordingNews::Going {
        path: path.clone(),
        totals,
    };
    hear(&mut panel, Update::Recording(going));
    panel.get_by_label("Recording /home/ada/r.csv: 12.3 s, 1.8 MB, 2 samples missing");
    press(&mut panel, "End recording");
    assert_eq!(asked(&mut panel), [Intent::EndRecording]);
    hear(
        &mut panel,
        Update::Recording(RecordingNews::Ended {
            path: path.clone(),
            totals,
        }),
    );
    panel.get_by_label_contains("Recorded /home/ada/r.csv");
    panel.get_by_label("Record");
    press(&mut panel, "Open");
    assert!(panel.get_by_label("recording to open").is_focused());
    assert_eq!(
        value_of(&panel, "recording to open"),
        "/home/ada/r.csv",
        "it may be looked at"
    );
    panel.key_press(Key::Enter);
    panel.run();
    assert_eq!(asked(&mut panel), [Intent::Open { path }]);
    wait(&mut panel, 10.0);
    assert!(
        panel.query_by_label_contains("Recorded").is_none(),
        "it is said for a while"
    );
}

#[test]
fn a_recording_is_looked_at_without_a_daemon() {
    let mut panel = panel();
    press(&mut panel, "Open");
    type_into(&mut panel, "recording to open", "/home/ada/r.csv");
    press(&mut panel, "Open recording");
    let path = std::path::PathBuf::from("/home/ada/r.csv");
    assert_eq!(asked(&mut panel), [Intent::Open { path: path.clone() }]);
    let metadata = metadata();
    let ending = Ending::BrokenOff { line: 90_005, bytes: 7 };
    let loaded = Loaded::new(path.clone(), metadata, rows(0..90_000, |_| 1.0), &[], ending);
    hear(
        &mut panel,
        Update::Opened {
            path,
            result: Ok(Box::new(loaded)),
        },
    );
    panel.get_by_label("Force plot");
    panel.get_by_label_contains("broken off in line 90005");
    assert_eq!(csv_times(&panel), (0.0, 89.999), "the whole of it, however long");
    panel.key_press(Key::Escape);
    panel.run();
    assert_eq!(asked(&mut panel), [Intent::Stop], "a stop is a stop");
    press(&mut panel, "Close recording");
    assert!(panel.query_by_label("Force plot").is_none());
    let refused = Err("cannot open /x: it is no recording".to_owned());
    hear(
        &mut panel,
        Update::Opened {
            path: "/x".into(),
            result: refused,
        },
    );
    panel.get_by_label("cannot open /x: it is no recording");
}

/// The same for wake-ups and ticks.
fn timing(buckets: Vec<Bucket>) -> Timing {
    let percentiles = Percentiles {
        p50: 2_000,
        p99: 9_000,
        p999: 30_000,
        max: 1_200_000,
    };
    let window = TimingWindow {
        wake_latency_ns: percentiles,
        tick_ns: percentiles,
        histogram: TimingHistogram {
            wake_latency_ns: buckets.clone(),
            tick_ns: buckets,
        },
        ..TimingWindow::default()
    };
    Timing {
        rate_hz: 1000.0,
        since_start: window.clone(),
        last_10_s: window,
        ..Timing::default()
    }
}

#[test]
fn histograms_and_clipping_are_shown() {
    let mut panel = connected(RigState::Engaged);
    let buckets = vec![Bucket { up_to: 1024, count: 7 }, Bucket { up_to: 2048, count: 1 }];
    hear(&mut panel, Update::Event(Event::Timing(Box::new(timing(buckets)))));
    press(&mut panel, "Histograms");
    panel.get_by_label("Wake-up histogram");
    panel.get_by_label("Tick: half below 2.00 µs, 99 % below 9.00 µs, 99.9 % below 30.0 µs, longest 1.20 ms");
    // A fourth of the samples is at the limit of 20 N.
    let strong = rows(0..1000, |_| 0.0).into_iter().map(|mut row| {
        row.command_force_n = if row.tick < 250 { -20.0 } else { 3.0 };
        row
    });
    feel(&mut panel, &strong.collect::<Vec<_>>());
    hear(&mut panel, Update::Status(Ok(Box::new(status()))));
    panel.get_by_label("At the force limit 25.0 %");
}

fn status() -> haptic_ipc::Status {
    let text = r#"{"server":"hapticd 0.1.0","state":"engaged","tick":1,"uptime_s":1,"rate_hz":1000,"scheme":"exact",
        "velocity_estimator":"foaw","revision":1,"scene":"paper","command_force_N":0,"device_position_m":0,"clients":1,
        "device":{"description":"fake rig","force_limit_N":20},"real_time":{"memory_locked":true,"problems":[]}}"#;
    serde_json::from_str(text).expect("a status")
}

#[test]
fn the_theme_can_be_switched() {
    let mut panel = connected(RigState::Idle);
    let is_dark = |panel: &Panel| panel.ctx.global_style().visuals.dark_mode;
    let before = is_dark(&panel);
    press(&mut panel, "switch theme");
    assert_ne!(is_dark(&panel), before);
}
