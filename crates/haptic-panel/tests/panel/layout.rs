//! What stays where it is when something comes, grows or goes; and how often the window is drawn.

use crate::bench::{Panel, asked, connected, find_another_daemon, hear, in_state, lose_the_daemon, press};
use crate::plots::{feel, rows, timing};
use egui::{Rect, ViewportEvent, ViewportId};
use egui_kittest::kittest::Queryable;
use haptic_ipc::{Event, LinkCounts, LinkStatus, LinkedDevice, RigState, Timing};
use haptic_panel::{Page, Update};
use std::time::Duration;

/// Widgets from all over the page that changes the scene.
const WIDGETS: [&str; 9] = [
    "Engage",
    "Stop",
    "Tune page",
    "friction law",
    "mass value",
    "stiffness slider",
    "Freeze",
    "Force plot",
    "Histograms",
];

fn places(panel: &Panel) -> [Rect; 9] {
    WIDGETS.map(|widget| panel.get_by_label(widget).rect())
}

/// Counts of a loop and of its link, all of which are `count`.
fn counted(count: u64) -> Update {
    let mut timing: Timing = timing(Vec::new());
    for window in [&mut timing.since_start, &mut timing.last_10_s] {
        (window.overruns, window.missed_periods) = (count, count);
    }
    timing.since_start.telemetry_dropped = count;
    timing.link = Some(LinkStatus {
        device: Some(LinkedDevice {
            firmware: "a rig with a long name 1.0".into(),
            force_limit_n: 20.0,
            sample_rate_hz: 1000.0,
            resolution_m: 1e-5,
            watchdog_ms: Some(50),
            rig: None,
        }),
        counts: LinkCounts {
            lost: count,
            bad_crc: count,
            late: count,
            ..LinkCounts::default()
        },
        clock_drift_ppm: Some(-12.3),
        ..LinkStatus::default()
    });
    Update::Event(Event::Timing(Box::new(timing)))
}

#[test]
fn nothing_moves_when_counters_grow_a_notice_comes_or_the_daemon_goes() {
    let mut panel = connected(RigState::Engaged);
    feel(&mut panel, &rows(0..1000, |_| 3.0));
    hear(&mut panel, counted(0));
    // A panel that grows has its place one frame later.
    panel.run();
    let before = places(&panel);
    hear(&mut panel, counted(123_456_789));
    assert_eq!(places(&panel), before, "counters");
    hear(
        &mut panel,
        Update::Unreadable {
            reason: "a line of a later daemon".into(),
        },
    );
    assert_eq!(places(&panel), before, "a line that cannot be read");
    let why = "the rig's friction is not known ".repeat(9);
    let error = haptic_ipc::WireError::new(haptic_ipc::ErrorCode::OutOfRange, why);
    hear(&mut panel, Update::Advised(Err(error)));
    panel.get_by_label_contains("No advice: the rig's friction");
    assert_eq!(places(&panel), before, "there is no advice");
    hear(
        &mut panel,
        Update::Exported(Err("no such folder: ".to_owned() + &"/home".repeat(99))),
    );
    assert_eq!(places(&panel), before, "a notice");
    let (path, share) = ("/home/ada/r.mcap".into(), Some(0.42));
    hear(&mut panel, Update::Reading { path, share });
    assert_eq!(places(&panel), before, "progress");
    let root = panel.input_mut().viewports.entry(ViewportId::ROOT).or_default();
    root.events.push(ViewportEvent::Close);
    panel.run();
    panel.get_by_label("Release and close");
    assert_eq!(places(&panel), before, "a question");
    press(&mut panel, "Keep the window");
    asked(&mut panel);
    lose_the_daemon(&mut panel);
    assert_eq!(places(&panel), before, "the daemon has gone");
    hear(&mut panel, in_state(RigState::Idle, 300));
    find_another_daemon(&mut panel);
    let without_scene = |places: [Rect; 9]| {
        [
            places[0], places[1], places[2], places[3], places[6], places[7], places[8],
        ]
    };
    let another = ["mass value", "stiffness slider"].map(|widget| panel.query_by_label(widget).is_none());
    assert_eq!(another, [true; 2], "its scene is not known yet");
    let now = WIDGETS.map(|widget| {
        panel
            .query_by_label(widget)
            .map_or(Rect::NOTHING, |widget| widget.rect())
    });
    assert_eq!(without_scene(now), without_scene(before), "another daemon has come");
}

#[test]
fn frames_are_as_many_as_the_plots_need() {
    let pace = |panel: &Panel| panel.state().model.pace();
    let mut panel = connected(RigState::Engaged);
    feel(&mut panel, &rows(0..1000, |_| 3.0));
    assert_eq!(pace(&panel), Duration::from_nanos(1_000_000_000 / 30));
    panel.state_mut().model.show_span(60.0);
    assert_eq!(
        pace(&panel),
        Duration::from_millis(100),
        "a column of pixels comes in 180 ms"
    );
    for page in [Page::Record, Page::Identify, Page::Tune] {
        panel.state_mut().model.turn_to(page);
        panel.run();
        let runs = pace(&panel) < Duration::from_secs(1);
        assert_eq!(runs, page != Page::Identify, "{page:?}");
    }
    press(&mut panel, "Freeze");
    assert_eq!(pace(&panel), Duration::from_secs(1), "the numbers alone");
    press(&mut panel, "Run");
    assert_eq!(pace(&panel), Duration::from_millis(100));
}
