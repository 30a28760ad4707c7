//! What stays where it is when something comes, grows or goes; and how often the window is drawn.

use crate::bench::{Panel, at_page, connected, find_another_daemon, hear, in_state, lose_the_daemon, press};
use crate::identify::answered;
use crate::plane::draw_circle;
use crate::plots::{feel, felt, rows, timing};
use crate::study::{held, running, state, tell};
use egui::accesskit::Role;
use egui::{Rect, ViewportEvent, ViewportId};
use egui_kittest::kittest::{By, NodeT, Queryable};
use haptic_ipc::{Event, LinkCounts, LinkStatus, LinkedDevice, RigState, Timing};
use haptic_panel::{Page, Stage, StudyNews, Update};
use haptic_studies::plan::Task;
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::time::Duration;

/// Where everything is that a page has but plain text, by label and number among those of that label.
fn places(panel: &Panel) -> BTreeMap<(String, usize), Rect> {
    let mut places = BTreeMap::new();
    let named = By::new().predicate(|node| node.role() != Role::Label && node.label().is_some());
    for node in panel.query_all(named) {
        let label = node.accesskit_node().label().expect("it has one");
        let number = (0..).find(|number| !places.contains_key(&(label.clone(), *number)));
        places.insert((label, number.expect("one is free")), node.rect());
    }
    places
}

/// Ends of the labels of what shows a scene, and of what stands below that.
const OF_SCENE: [&str; 5] = [" slider", " value", " by direction", "Save, compare", "Changes"];

/// What has moved or gone since.
fn moved(panel: &Panel, before: &BTreeMap<(String, usize), Rect>) -> Vec<(String, Rect, Option<Rect>)> {
    let now = places(panel);
    let moved = before.iter().filter(|(label, place)| now.get(label) != Some(place));
    moved
        .map(|(label, place)| (label.0.clone(), *place, now.get(label).copied()))
        .collect()
}

/// Counts of a loop and of its link: once, twice or thrice `count`.
pub(crate) fn counted(count: u64) -> Update {
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
            bad_crc: 2 * count,
            late: 3 * count,
            ..LinkCounts::default()
        },
        round_trip_us: 1234.0,
        clock_drift_ppm: Some(-12.3),
        ..LinkStatus::default()
    });
    Update::Event(Event::Timing(Box::new(timing)))
}

/// How a page comes into use.
pub(crate) type MadeBy = fn() -> Panel;

/// Pages as they are used, with a name for each.
pub(crate) fn pages() -> [(&'static str, MadeBy); 11] {
    fn at(page: Page) -> Panel {
        at_page(felt(0..1000, |_| 3.0), page)
    }
    fn study(task: Task, stage: Stage) -> Panel {
        let mut panel = felt(0..1000, |_| 3.0);
        tell(&mut panel, StudyNews::State(Box::new(state(task, stage))));
        panel
    }
    [
        ("Tune", || at(Page::Tune)),
        ("Tune with cursors", || {
            let mut panel = at(Page::Tune);
            press(&mut panel, "Cursors");
            panel
        }),
        ("Record", || at(Page::Record)),
        ("Identify", || at(Page::Identify)),
        ("Identify with an answer", || answered(at(Page::Identify))),
        ("Task", || at(Page::Task)),
        ("Task, running", || study(Task::Fitts, running())),
        ("Perception", || at(Page::Perception)),
        ("Perception, held", || study(Task::Perception, held())),
        ("Perception, running", || study(Task::Perception, running())),
        ("Plane", || {
            let mut panel = connected(RigState::Engaged);
            draw_circle(&mut panel);
            at_page(panel, Page::Plane)
        }),
    ]
}

/// What comes by itself while a page is used.
fn news() -> Vec<(&'static str, Update)> {
    let long = |what: &str| what.to_owned() + &"/home".repeat(99);
    let why = "the rig's friction is not known ".repeat(9);
    let no_advice = haptic_ipc::WireError::new(haptic_ipc::ErrorCode::OutOfRange, why);
    let folder: PathBuf = "/home/ada".into();
    vec![
        ("counters", counted(123_456_789)),
        (
            "a line that cannot be read",
            Update::Unreadable {
                reason: "a line of a later daemon".into(),
            },
        ),
        ("there is no advice", Update::Advised(Err(no_advice))),
        ("a notice", Update::Exported(Err(long("no such folder: ")))),
        ("settings", Update::Remembered(Err(long("cannot be written: ")))),
        ("busy", Update::Busy("writing r.svg".to_owned())),
        (
            "progress",
            Update::Reading {
                path: folder.join("r.mcap"),
                share: Some(0.42),
            },
        ),
        (
            "a folder",
            Update::ListRead {
                folder,
                result: Err(long("cannot be read: ")),
            },
        ),
        ("a dialog", Update::DialogClosed(Err(long("there is no portal: ")))),
        (
            "a study's note",
            Update::Study(StudyNews::Noted {
                text: "late".to_owned(),
                outcome: Err(long("cannot be written: ")),
            }),
        ),
        (
            "a study's failure",
            Update::Study(StudyNews::Failed(long("no such folder: "))),
        ),
    ]
}

#[test]
fn growing_counters_notices_or_daemon_loss_move_nothing() {
    let mut all = Vec::new();
    for (name, page) in pages() {
        let mut panel = page();
        hear(&mut panel, counted(0));
        // A panel that grows has its place one frame later.
        panel.run();
        let mut before = places(&panel);
        assert!(before.len() > 12, "{name}: {} places", before.len());
        let mut check = |panel: &Panel, before: &BTreeMap<_, _>, what: &str| {
            all.extend(
                moved(panel, before)
                    .into_iter()
                    .map(|moved| format!("{name}, {what}: {moved:?}")),
            );
        };
        for (what, update) in news() {
            hear(&mut panel, update);
            check(&panel, &before, what);
        }
        if name == "Plane" {
            draw_circle(&mut panel);
        } else {
            feel(&mut panel, &rows(1000..2000, |_| -199.876));
        }
        check(&panel, &before, "other numbers");
        let root = panel.input_mut().viewports.entry(ViewportId::ROOT).or_default();
        root.events.push(ViewportEvent::Close);
        panel.run();
        panel.get_by_label("Release and close");
        check(&panel, &before, "a question");
        press(&mut panel, "Keep the window");
        lose_the_daemon(&mut panel);
        check(&panel, &before, "the daemon has gone");
        hear(&mut panel, in_state(RigState::Idle, 300));
        find_another_daemon(&mut panel);
        // Its scene is not known yet.
        before.retain(|(label, _), _| !OF_SCENE.iter().any(|end| label.ends_with(end)));
        check(&panel, &before, "another daemon has come");
    }
    assert!(all.is_empty(), "{}", all.join("\n"));
}

#[test]
fn frames_are_as_many_as_the_plots_need() {
    let pace = |panel: &Panel| panel.state().model.pace();
    let mut panel = felt(0..1000, |_| 3.0);
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
