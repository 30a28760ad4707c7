//! A study with a person in real windows: a whole subject by keys, with the panel killed in the middle. The fake
//! rig's hand goes to and fro over both targets; the test presses the key that clicks where the hand turns.

use haptic_ipc::{Client, RigState};
use haptic_studies::plan::Plan;
use haptic_studies::store::{self, Study, StudyDescription};
use haptic_studies::trial::FittsTrial;
use std::path::Path;
use std::time::Instant;
use system_tests::screen::{Panel, Screen};
use system_tests::study_screen::{
    GO_ON, PAUSE, PLAN, SUBJECTS_TITLE, is_enabled, open_subjects_window, wait_until_enabled,
};
use system_tests::{Daemon, PATIENCE, bring_to, pause, status, timed, wait_for, wait_for_state};

/// Beyond this position, m, the cursor is wholly inside a target for half a second.
const INSIDE_M: f64 = 0.02;

/// Starts the panel on the study, has it begin, and the subject go on from the instructions.
fn begin(screen: &Screen, daemon: &Daemon, client: &mut Client, folder: &Path) -> Panel {
    let study = folder.to_str().expect("a name");
    let panel = screen.panel(daemon.socket(), &["--theme", "dark", "--study", study]);
    wait_for(client, "the panel", |status| status.clients == 3);
    go_on(screen);
    open_subjects_window(screen);
    panel
}

/// Begins, or goes on, as soon as that can be done.
fn go_on(screen: &Screen) {
    wait_until_enabled(screen, GO_ON);
    screen.press(GO_ON);
    wait_until_enabled(screen, PAUSE);
}

/// The experimenter goes on after a stop, and the subject has the keyboard again.
fn go_on_after_stop(screen: &Screen, client: &mut Client) {
    screen.act(&["search", "--name", "Haptic panel", "windowraise"]);
    let began = Instant::now();
    let mut is_asked = false;
    while !(is_asked && is_enabled(&screen.picture(), PAUSE)) {
        assert!(began.elapsed() < PATIENCE, "it does not continue");
        bring_to(client, RigState::Engaged);
        if is_enabled(&screen.picture(), GO_ON) {
            screen.press(GO_ON);
            is_asked = true;
        }
        pause();
    }
    screen.act(&["search", "--name", SUBJECTS_TITLE, "windowraise", "windowfocus"]);
}

/// Does trials until `wanted` rows are on the disk: a key wherever the hand has come to the other side. The first
/// presses go on from the instructions, and from the break.
fn click_until(screen: &Screen, client: &mut Client, folder: &Path, wanted: usize) {
    let began = Instant::now();
    let mut side = 0.0;
    loop {
        if store::trials::<FittsTrial>(folder).is_ok_and(|rows| rows.len() >= wanted) {
            return;
        }
        assert!(began.elapsed() < 2 * PATIENCE, "{wanted} rows");
        let status = status(client);
        if status.state == RigState::Stopped {
            // Also by a key whose last path was slow.
            go_on_after_stop(screen, client);
            continue;
        }
        let position_m = status.device_position_m;
        if position_m.abs() > INSIDE_M && position_m.signum() != side {
            side = position_m.signum();
            screen.act(&["key", "Return"]);
        }
        pause();
    }
}

#[test]
fn subject_does_study_in_own_window_and_killed_panel_resumes() {
    timed(
        "a subject's study in windows that are drawn without a graphics card",
        || {
            if let Some(screen) = Screen::open() {
                study_in_windows(&screen);
            }
        },
    );
}

fn study_in_windows(screen: &Screen) {
    let parent = tempfile::tempdir().expect("a folder");
    let folder = parent.path().join("study");
    let plan = Plan::read(PLAN).expect("a plan");
    let about = StudyDescription::people(&plan, PLAN, 1, vec!["P7".to_owned()]);
    drop(Study::create(&folder, PLAN, &about).expect("a study"));
    let daemon = Daemon::start(&["--ramp-ms", "10", "--hand-frequency-hz", "0.5"]);
    let mut client = daemon.client();
    bring_to(&mut client, RigState::Engaged);

    let panel = begin(screen, &daemon, &mut client, &folder);
    click_until(screen, &mut client, &folder, 4);
    drop(panel);
    // The lease of the panel ends with it, and the force.
    wait_for_state(&mut client, RigState::Idle);
    wait_for(&mut client, "the panel to go", |status| status.clients == 1);
    let before = store::trials::<FittsTrial>(&folder).expect("rows");

    bring_to(&mut client, RigState::Engaged);
    let _panel = begin(screen, &daemon, &mut client, &folder);
    click_until(screen, &mut client, &folder, 5);
    // A key in the subject's window stops, and it goes on by the experimenter alone.
    screen.act(&["key", "space"]);
    wait_for_state(&mut client, RigState::Stopped);
    click_until(screen, &mut client, &folder, 6);

    let rows = store::trials::<FittsTrial>(&folder).expect("rows");
    assert_eq!(rows[..before.len()], before, "what was there stays");
    let places: Vec<(u32, u32)> = rows.iter().map(|row| (row.block, row.trial)).collect();
    assert_eq!(places, [(1, 1), (1, 2), (1, 3), (2, 1), (2, 2), (2, 3)]);
    for row in &rows {
        assert!(row.movement_time_s > 0.2 && row.subject == "P7", "{row:?}");
        let recording = folder.join(row.recording.as_ref().expect("a recording"));
        let recording = haptic_recording::read(&recording).expect("it is read");
        assert!(recording.rows.iter().any(|sample| Some(sample.tick) == row.end_tick));
        assert!(recording.metadata.scene.block.is_some(), "the scene of the plan");
    }
    assert!(
        rows.iter()
            .any(|row| row.cursor_latency_s.is_some_and(|latency_s| latency_s > 0.0))
    );
}
