//! The plots: where they stand, how they are zoomed and moved, their trigger and their cursors.

use crate::bench::{
    Hands as _, Panel, choose_item, connected, enter, find_another_daemon, hear, lose_the_daemon, press, sample,
    type_into, value_of,
};
use egui::{Key, Modifiers};
use egui_kittest::kittest::{NodeT, Queryable};
use haptic_ipc::{Bucket, Event, Percentiles, RigState, Sample, SamplesEvent, Timing, TimingHistogram, TimingWindow};
use haptic_panel::Update;

pub(crate) fn rows(ms: std::ops::Range<u32>, force: impl Fn(u32) -> f64) -> Vec<Sample> {
    ms.map(|ms| Sample {
        tick: u64::from(ms),
        coupling_force_n: force(ms),
        command_force_n: force(ms),
        ..sample(f64::from(ms) * 1e-3)
    })
    .collect()
}

/// A batch of a rig of one axis.
pub(crate) fn batch_of(rows: Vec<Sample>) -> Update {
    Update::Event(Event::Samples(SamplesEvent {
        rows,
        ..SamplesEvent::default()
    }))
}

pub(crate) fn feel(panel: &mut Panel, rows: &[Sample]) {
    for batch in rows.chunks(34) {
        panel.state_mut().model.apply(batch_of(batch.to_vec()));
    }
    panel.run();
}

/// A panel at an engaged rig that has felt [`rows`].
pub(crate) fn felt(ms: std::ops::Range<u32>, force: impl Fn(u32) -> f64) -> Panel {
    let mut panel = connected(RigState::Engaged);
    feel(&mut panel, &rows(ms, force));
    panel
}

pub(crate) fn svg(panel: &Panel) -> String {
    haptic_panel::export::svg(&panel.state().model)
}

pub(crate) fn csv_times(panel: &Panel) -> (f64, f64) {
    let text = haptic_panel::export::csv(&panel.state().model);
    let times: Vec<f64> = text
        .lines()
        .skip(1)
        .filter_map(|line| line.split(',').nth(1)?.parse().ok())
        .collect();
    let milliseconds = |t_s: f64| (t_s * 1e3).round() / 1e3;
    (milliseconds(times[0]), milliseconds(times[times.len() - 1]))
}

/// The number in a field.
pub(crate) fn number_of(panel: &Panel, field: &str) -> f64 {
    let field = panel.get_by_label(field).accesskit_node();
    field.numeric_value().expect("a number")
}

/// Where the usual plots are.
pub(crate) fn usual_plots(panel: &Panel) -> [egui::Rect; 3] {
    ["Force plot", "Position plot", "Velocity plot"].map(|plot| panel.get_by_label(plot).rect())
}

#[test]
fn plots_align_and_lie_one_below_the_other_at_any_size() {
    for size in [(1024.0, 640.0), (1280.0, 800.0), (1920.0, 1080.0)] {
        let mut panel = connected(RigState::Engaged);
        panel.set_size(size.into());
        // The numbers of one axis are longer than those of the others.
        let far = rows(0..6000, |ms| f64::from(ms % 7)).into_iter().map(|row| Sample {
            device_position_m: 12_345.678 + 1e-3 * row.t_s,
            block_position_m: 12_345.678,
            ..row
        });
        feel(&mut panel, &far.collect::<Vec<_>>());
        // What takes room from them.
        hear(&mut panel, Update::Event(Event::Timing(Box::new(timing(vec![])))));
        press(&mut panel, "Histograms");
        press(&mut panel, "Cursors");
        choose_item(&mut panel, "trigger", "Auto");
        choose_item(&mut panel, "trigger", "Normal");
        let plots = usual_plots(&panel);
        for plot in plots {
            let apart = (plot.left() - plots[0].left(), plot.right() - plots[0].right());
            assert!(apart.0.abs() < 0.01 && apart.1.abs() < 0.01, "{size:?}: {plots:?}");
            assert!(plot.height() >= 50.0, "{size:?}: {plot:?}");
        }
        assert!(plots[0].left() > 0.0 && plots[0].width() > 100.0, "{size:?}: {plots:?}");
        let is_below = |above: &egui::Rect, plot: &egui::Rect| above.bottom() <= plot.top();
        assert!(plots.is_sorted_by(is_below), "{size:?}: {plots:?}");
    }
}

#[test]
fn last_data_before_daemon_loss_stays_visible_and_exportable() {
    let mut panel = felt(0..6000, |_| 1.0);
    lose_the_daemon(&mut panel);
    panel.get_by_label("Connection lost: the daemon closed the connection");
    panel.get_by_label("Force plot");
    assert_eq!(csv_times(&panel).1, 5.999);
    panel.get_by_label("Force on the hand, last");
    press(&mut panel, "Export");
    panel.get_by_label("export CSV");
    find_another_daemon(&mut panel);
    panel.get_by_label("Force on the hand, last");
    assert_eq!(csv_times(&panel).1, 5.999);
    feel(&mut panel, &rows(0..1000, |_| 2.0));
    assert_eq!(csv_times(&panel), (0.0, 0.999));
    assert!(panel.query_by_label("Force on the hand, last").is_none());
}

#[test]
fn plots_are_zoomed_and_moved_by_button_and_by_pointer() {
    let mut panel = felt(0..20_000, |_| 1.0);
    let seen_s = |panel: &Panel| number_of(panel, "time seen");
    press(&mut panel, "zoom in");
    assert!((seen_s(&panel) - 5.0 / 1.5).abs() < 1e-9);
    press(&mut panel, "back to 5 s");
    assert_eq!(seen_s(&panel), 5.0);
    for _ in 0..10 {
        press(&mut panel, "zoom out");
    }
    assert_eq!(seen_s(&panel), 60.0, "no more is kept");
    press(&mut panel, "back to 5 s");
    press(&mut panel, "earlier");
    let (from, to) = csv_times(&panel);
    assert!(
        (from - 13.75).abs() < 0.01 && (to - 18.75).abs() < 0.01,
        "{from} to {to}"
    );
    press(&mut panel, "later");
    assert!((csv_times(&panel).0 - 15.0).abs() < 0.01);
    press(&mut panel, "earlier");

    let plot = panel.get_by_label("Position plot").rect();
    wheel(&mut panel, plot.center());
    let (from, to) = csv_times(&panel);
    assert!(to - from < 2.5, "{from} to {to}");

    drag(&mut panel, plot.center(), egui::vec2(100.0, 0.0));
    assert!(csv_times(&panel).0 < from - 0.1, "dragged to earlier times");
}

pub(crate) fn wheel(panel: &mut Panel, at: egui::Pos2) {
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

pub(crate) fn drag(panel: &mut Panel, from: egui::Pos2, offset: egui::Vec2) {
    panel.drag_at(from);
    panel.run();
    panel.hover_at(from + offset);
    panel.run();
    panel.drop_at(from + offset);
    panel.run_steps(10);
}

/// The ends of the force axis, as the menu has them.
fn force_axis(panel: &mut Panel) -> (f64, f64) {
    press(panel, "Axes");
    let ends = ["lower", "upper"].map(|end| number_of(panel, &format!("force axis {end} end")));
    panel.key_press(Key::Tab);
    press(panel, "Axes");
    ends.into()
}

#[test]
fn value_axis_is_zoomed_and_moved_by_its_numbers() {
    let mut panel = felt(0..20_000, |ms| if ms % 2 == 0 { 4.0 } else { -4.0 });
    let fitted = force_axis(&mut panel);
    assert!(fitted.0 < -4.0 && fitted.1 > 4.0, "{fitted:?}");
    let before = csv_times(&panel);

    let numbers = panel.get_by_label("Force axis").rect();
    wheel(&mut panel, numbers.center());
    let zoomed = force_axis(&mut panel);
    assert!(zoomed.1 - zoomed.0 < 0.5 * (fitted.1 - fitted.0), "{zoomed:?}");
    assert_eq!(csv_times(&panel), before, "time continues as it was");

    drag(&mut panel, numbers.center(), egui::vec2(0.0, numbers.height() / 2.0));
    let moved = force_axis(&mut panel);
    assert!(
        moved.0 > zoomed.0 && moved.1 > zoomed.1,
        "{moved:?}: greater values come into sight"
    );
}

#[test]
fn each_axis_is_typed_and_fitted_by_its_own_controls() {
    let mut panel = felt(0..5000, |ms| f64::from(ms) * 1e-3);
    for name in ["force", "position", "velocity"] {
        for (end, typed) in [("lower", "-77"), ("upper", "77")] {
            let field = format!("{name} axis {end} end");
            press(&mut panel, "Axes");
            let fitted = value_of(&panel, &field);
            enter(&mut panel, &field, typed);
            press(&mut panel, "Axes");
            press(&mut panel, "Axes");
            assert!(value_of(&panel, &field).starts_with(typed), "{field}");
            press(&mut panel, &format!("Fit {name}"));
            press(&mut panel, "Axes");
            press(&mut panel, "Axes");
            assert_eq!(value_of(&panel, &field), fitted, "{field}");
            press(&mut panel, "Axes");
        }
    }
}

#[test]
fn a_trigger_catches_a_crossing_with_what_was_before_it() {
    let mut panel = connected(RigState::Engaged);
    choose_item(&mut panel, "trigger", "Single");
    choose_item(&mut panel, "trigger signal", "Coupling force");
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
    choose_item(&mut panel, "trigger", "Off");
    assert!(panel.query_by_label("Armed").is_none());
}

#[test]
fn a_half_typed_number_changes_nothing_until_enter_or_tab() {
    let mut panel = felt(0..20_000, |_| 1.0);
    choose_item(&mut panel, "trigger", "Normal");
    press(&mut panel, "Cursors");
    press(&mut panel, "Save, compare");
    for field in [
        "time seen",
        "cursor 1",
        "cursor 2",
        "trigger level",
        "pre-trigger share",
        "ramp",
    ] {
        let before = number_of(&panel, field);
        type_into(&mut panel, field, "12.5");
        assert_eq!(number_of(&panel, field), before, "{field}: not while it is typed");
        panel.click_on("Tune page");
        assert!(!panel.get_by_label(field).is_focused());
        assert_eq!(number_of(&panel, field), before, "{field}: a click elsewhere drops it");
        for (key, typed) in [(Key::Enter, 12.5), (Key::Tab, 7.25)] {
            type_into(&mut panel, field, &typed.to_string());
            panel.hit(key);
            assert!((number_of(&panel, field) - typed).abs() < 1e-9, "{field}: {key:?}");
        }
        type_into(&mut panel, field, "3");
        panel.hit(Key::Escape);
        assert!((number_of(&panel, field) - 7.25).abs() < 1e-9, "{field}: a stop");
    }
}

#[test]
fn cursors_show_the_time_and_the_change_between_them() {
    let mut panel = felt(0..20_000, |ms| f64::from(ms) * 1e-3);
    press(&mut panel, "Cursors");
    panel.get_by_label("dt 1.6667 s, 1/dt 0.6000 Hz");
    panel.get_by_label("Force on the hand +1.667 N");
    press(&mut panel, "Cursors");
    assert!(panel.query_by_label_contains("1/dt").is_none());
}

/// The same for wake-ups and ticks.
pub(crate) fn timing(buckets: Vec<Bucket>) -> Timing {
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
