//! A rig of two axes: the page Plane, and the second axis in the plots.

use crate::bench::{Hands as _, Panel, connected, hear, press, press_item, value_of};
use crate::metadata::metadata;
use crate::plots::svg;
use crate::rig::status;
use crate::scene::active_scene;
use egui::{Key, Modifiers, Rect, Shape};
use egui_kittest::kittest::Queryable;
use haptic_core::Scene;
use haptic_core::planar::Workspace;
use haptic_ipc::{Event, RigState, SAMPLE_COLUMNS, SAMPLE_Y_COLUMNS, Sample, SampleY, SamplesEvent, ServoEvent};
use haptic_panel::{Page, Update};

/// A hand on a circle of 30 mm, whose block lags behind it: at its end at (18, 24) mm, with (-4, 3) N on the block
/// where the force is 5 N long.
fn on_circle(ticks: u32, force_n: f64) -> SamplesEvent {
    let angle = |tick: u32| 0.6_f64.acos() - f64::from(ticks - 1 - tick) * 2e-3;
    let row = |tick| Sample {
        tick: u64::from(tick),
        t_s: f64::from(tick) * 1e-3,
        contact: 1,
        device_position_m: 0.03 * angle(tick).cos(),
        device_velocity_mps: -0.06 * angle(tick).sin(),
        block_position_m: 0.029 * angle(tick).cos(),
        block_velocity_mps: -0.058 * angle(tick).sin(),
        coupling_force_n: -force_n * angle(tick).sin(),
        command_force_n: force_n * angle(tick).sin(),
        ..crate::bench::sample(0.0)
    };
    let y = |tick| SampleY {
        device_position_m: 0.03 * angle(tick).sin(),
        device_velocity_mps: 0.06 * angle(tick).cos(),
        block_position_m: 0.029 * angle(tick).sin(),
        block_velocity_mps: 0.058 * angle(tick).cos(),
        coupling_force_n: force_n * angle(tick).cos(),
        command_force_n: -force_n * angle(tick).cos(),
        sample_position_m: 0.03 * angle(tick).sin(),
    };
    SamplesEvent {
        rows: (0..ticks).map(row).collect(),
        rows_y: (0..ticks).map(y).collect(),
        ..SamplesEvent::default()
    }
}

/// Gives a panel a rig of two axes that has drawn for five seconds in a workspace of 120 by 80 mm.
pub(crate) fn draw_circle(panel: &mut Panel) {
    hear(panel, active_scene(1, &Scene::paper()));
    let mut servo = metadata().servo.expect("a setup");
    servo.settings.workspace = Some(Workspace {
        x_m: [-0.06, 0.06],
        y_m: [-0.04, 0.04],
    });
    hear(
        panel,
        Update::Event(Event::Servo(Box::new(ServoEvent { tick: 0, servo }))),
    );
    hear(panel, Update::Event(Event::Samples(on_circle(5001, 5.0))));
}

fn on_plane() -> Panel {
    let mut panel = connected(RigState::Engaged);
    draw_circle(&mut panel);
    panel
}

/// Where the lines with so many points are drawn.
fn lines(panel: &Panel, points: usize) -> Vec<Rect> {
    fn within(shape: &Shape, points: usize, found: &mut Vec<Rect>) {
        match shape {
            Shape::Path(path) if path.points.len() == points => found.push(Rect::from_points(&path.points)),
            Shape::Vec(shapes) => shapes.iter().for_each(|shape| within(shape, points, found)),
            _ => {}
        }
    }
    let mut found = Vec::new();
    for clipped in &panel.output().shapes {
        within(&clipped.shape, points, &mut found);
    }
    found
}

#[test]
fn page_plane_is_offered_to_a_rig_of_two_axes_alone() {
    let mut panel = connected(RigState::Engaged);
    assert!(panel.query_by_label("Plane page").is_none());
    panel.hit_with(Modifiers::COMMAND, Key::Num6);
    assert_eq!(panel.state().model.page(), Page::Tune);
    draw_circle(&mut panel);
    panel.get_by_label("Plane page");
    panel.hit_with(Modifiers::COMMAND, Key::Num6);
    assert_eq!(panel.state().model.page(), Page::Plane);
}

#[test]
fn plane_shows_positions_and_force_on_equal_scales() {
    let mut panel = on_plane();
    press(&mut panel, "Plane page");
    panel.run();
    for plot in ["Hand and block plot", "Coupling force plot"] {
        assert!(panel.get_by_label(plot).rect().height() > 200.0, "{plot}");
    }
    for text in ["Workspace", "Fs 4.00 N", "Fd 3.50 N", "Hand", "Block"] {
        panel.get_by_label(text);
    }
    panel.get_by_label("Hand 18.0, 24.0 mm; block 17.4, 23.2 mm");
    panel.get_by_label("5.00 N towards 143°, sliding");
    let picture = svg(&panel);
    for text in ["Hand and block", "Coupling force", "Fs 4.00 N", "Workspace", "x (mm)"] {
        assert!(picture.contains(text), "{text}");
    }
    assert!(!picture.contains("NaN") && !picture.contains("Time from"));
    let circle = lines(&panel, 129)[0];
    assert!((circle.width() - circle.height()).abs() < 0.5, "{circle}");
    let workspace = lines(&panel, 5)[0];
    assert!(
        (workspace.width() / workspace.height() - 1.5).abs() < 0.01,
        "{workspace}"
    );
    press(&mut panel, "Limits");
    assert!(panel.query_by_label("Fs 4.00 N").is_none());
    press(&mut panel, "Freeze");
    hear(&mut panel, Update::Event(Event::Samples(on_circle(7000, 5.0))));
    panel.get_by_label("Hand 18.0, 24.0 mm; block 17.4, 23.2 mm");
}

#[test]
fn second_axis_is_drawn_beside_the_first_or_both_as_length() {
    let mut panel = on_plane();
    for line in ["Force on the hand, x", "Force on the hand, y", "Block position, y"] {
        panel.get_by_label(line);
    }
    let lower_end = |panel: &mut Panel| -> f64 {
        press(panel, "Axes");
        let end = value_of(panel, "force axis lower end");
        press(panel, "Axes");
        end.trim_end_matches(" N").parse().expect("a number")
    };
    assert!(lower_end(&mut panel) < -4.0);
    press(&mut panel, "signals of the Force plot");
    press_item(&mut panel, "Lengths");
    panel.key_press(Key::Tab);
    panel.get_by_label("Force on the hand, length");
    assert!(panel.query_by_label("Force on the hand, y").is_none());
    panel.get_by_label("Block velocity, y");
    assert!(panel.state().model.settings().rig_plots.expect("plots")[0].contains(&"Lengths".to_owned()));
    press(&mut panel, "signals of the Force plot");
    assert!(lower_end(&mut panel) > 0.0, "the length stays at 5 N");
}

#[test]
fn force_clipped_by_its_length_is_marked_in_the_plot() {
    // 20 N long, which is the rig's limit; neither axis alone is there at the end.
    for (force_n, is_marked) in [(5.0, false), (20.0, true)] {
        let mut panel = connected(RigState::Engaged);
        hear(&mut panel, Update::Status(Ok(Box::new(status()))));
        hear(&mut panel, active_scene(1, &Scene::paper()));
        hear(&mut panel, Update::Event(Event::Samples(on_circle(5001, force_n))));
        let svg = svg(&panel);
        assert_eq!(svg.contains("clipped by the force limit"), is_marked, "{force_n} N");
    }
}

#[test]
fn readouts_samples_table_spectrum_and_trail_hold_both_axes() {
    let mut panel = on_plane();
    for text in ["5.00", "18.0, 24.0", "17.4, 23.2", "Sliding"] {
        panel.get_by_label(text);
    }
    let csv = haptic_panel::export::csv(&panel.state().model);
    let mut lines = csv.lines();
    let columns = [SAMPLE_COLUMNS, &SAMPLE_Y_COLUMNS].concat().join(",");
    assert_eq!(lines.next(), Some(columns.as_str()));
    let last: Vec<&str> = lines.next_back().expect("rows").split(',').collect();
    let y: f64 = last[SAMPLE_COLUMNS.len()].parse().expect("a number");
    assert!((y - 0.024).abs() < 1e-9 && last.len() == SAMPLE_COLUMNS.len() + SAMPLE_Y_COLUMNS.len());
    press(&mut panel, "Statistics");
    panel.get_by_label("Block velocity, y (mm/s)");
    press(&mut panel, "Spectrum");
    panel.get_by_label("Spectrum plot");
    for line in ["Force on the hand, x", "Force on the hand, y"] {
        panel.get_by_label(line);
    }
    press(&mut panel, "Force against velocity");
    panel.get_by_label("Force against velocity plot");
    let svg = svg(&panel);
    assert!(svg.contains("Block velocity, length (mm/s)") && svg.contains("Coupling force, length (N)"));
    press(&mut panel, "Cursors");
    panel.get_by_label_contains("Cursor 1: 58.00 mm/s, 5.000 N");
}
