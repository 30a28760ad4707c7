//! The panel in a real window: how it looks in both themes, and that keys and clicks reach the daemon.
//!
//! The pictures are compared in software rendering under Xvfb rather than through `egui_kittest`'s
//! snapshots: those need wgpu and a Vulkan driver, which would double what the panel compiles, and
//! would not draw through the OpenGL code that its users run. After a change that is meant to be
//! seen, `HAPTIC_UPDATE_PICTURES=1 cargo test -p system-tests window::` draws the pictures again;
//! look at them.

use haptic_core::{Directional, Parameter};
use haptic_ipc::{Client, Request, RigState, SceneReply};
use haptic_studies::plan::{Plan, Task};
use haptic_studies::store::{Study, StudyDescription};
use haptic_studies::subject_table::SubjectTable;
use std::fs::{self, File};
use std::io::{BufReader, BufWriter};
use std::path::{Path, PathBuf};
use std::time::Instant;
use system_tests::measure::{percentile, us};
use system_tests::screen::{Picture, Screen};
use system_tests::{Daemon, PATIENCE, bring_to, engage, plain, status, until, wait_for, wait_for_state};

/// From where cargo runs the tests: the window names it.
const RECORDING: &str = "fixtures/recording-of-servo-3.mcap";

/// Colours of one driver's text differ a little from another's.
const TOLERANCE: u8 = 48;

/// A word of ten letters in small type covers as many pixels of the window.
const MAX_DIFFERENT: f64 = 0.001;

/// Where the field of the mass is, pixels.
const MASS_FIELD: (usize, usize) = (262, 289);

/// The red of the stop button, which is grey until a daemon is connected: from the right and from the top, pixels.
const STOP_BUTTON: (usize, usize) = (160, 20);

/// The blue of the page Record where that is shown, pixels.
const RECORD_TAB: (usize, usize) = (70, 92);

fn is_drawn(picture: &Picture) -> bool {
    let [red, green, blue] = picture.at(picture.size.0 - STOP_BUTTON.0, STOP_BUTTON.1);
    red > 150 && green < 80 && blue < 80
}

fn kept(theme: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("pictures/panel-{theme}.png"))
}

fn read(path: &Path) -> Picture {
    let file = File::open(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut reader = png::Decoder::new(BufReader::new(file)).read_info().expect("a PNG");
    let mut rgb = vec![0; reader.output_buffer_size().expect("a size")];
    let frame = reader.next_frame(&mut rgb).expect("a picture");
    let [width, height] = [frame.width, frame.height].map(|side| usize::try_from(side).expect("it fits"));
    let size = (width, height);
    Picture { size, rgb }
}

fn write(path: &Path, picture: &Picture) {
    fs::create_dir_all(path.parent().expect("a folder")).expect("it can be made");
    let file = BufWriter::new(File::create(path).expect("it can be written"));
    let [width, height] = [picture.size.0, picture.size.1].map(|side| u32::try_from(side).expect("it fits"));
    let mut encoder = png::Encoder::new(file, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header().expect("it can be written");
    writer.write_image_data(&picture.rgb).expect("it can be written");
}

#[test]
fn the_window_looks_as_it_did_in_both_themes() {
    // Nothing moves without a daemon.
    let socket = Path::new("/nonexistent/hapticd/control.sock");
    let is_shown = |picture: &Picture| {
        let [red, _, blue] = picture.at(RECORD_TAB.0, RECORD_TAB.1);
        blue > red.saturating_add(100)
    };
    for theme in ["dark", "light"] {
        let Some(screen) = Screen::open() else {
            return;
        };
        let _panel = screen.panel(socket, &["--theme", theme, "--page", "record", "--open", RECORDING]);
        let began = Instant::now();
        let mut seen = screen.settled(is_shown);
        if std::env::var_os("HAPTIC_UPDATE_PICTURES").is_some() {
            write(&kept(theme), &seen);
            continue;
        }
        let expected = read(&kept(theme));
        // On a busy machine it may look settled while the panel has yet to hear or to draw something.
        while seen.difference(&expected, TOLERANCE) > MAX_DIFFERENT && began.elapsed() < PATIENCE {
            seen = screen.settled(is_shown);
        }
        let different = seen.difference(&expected, TOLERANCE);
        if different > MAX_DIFFERENT {
            let path = std::env::temp_dir().join(format!("panel-{theme}-now.png"));
            write(&path, &seen);
            panic!(
                "{:.2} % of the pixels differ in the {theme} theme: compare {} with {}",
                different * 100.0,
                path.display(),
                kept(theme).display()
            );
        }
    }
}

const PAGES: [&str; 5] = ["tune", "record", "identify", "task", "perception"];

/// Near the left end of the button that begins a study, pixels.
const BEGIN: (usize, usize) = (20, 226);

/// The box that shows the subject's window, pixels.
const SUBJECTS_SCREEN: (usize, usize) = (15, 269);

/// A button of the dark theme is darker than this where it cannot be pressed.
const ENABLED: u8 = 44;

/// Opens the subject's window of a dark panel once that shows its study, and gives it the keyboard.
fn open_subjects_window(screen: &Screen) {
    screen.wait_until("the study", |picture| picture.at(BEGIN.0, BEGIN.1)[0] >= ENABLED);
    screen.press(SUBJECTS_SCREEN);
    screen.act(&[
        "search",
        "--sync",
        "--onlyvisible",
        "--name",
        "Subject's screen",
        "windowfocus",
    ]);
}

/// A folder with a study for each page that has one, under the page's name.
fn studies() -> tempfile::TempDir {
    let folder = tempfile::tempdir().expect("a folder");
    for (page, task) in [("task", Task::Fitts), ("perception", Task::Perception)] {
        let text = task.built_in_plan();
        let plan = Plan::read(text).expect("a plan");
        let subjects = SubjectTable::of_codes(&["P7".to_owned()]);
        let about = StudyDescription::people(&plan, text, 1, &subjects);
        drop(Study::create(&folder.path().join(page), text, &about, &subjects).expect("a study"));
    }
    folder
}

/// How soon a key on the real window stops the rig, from the start of the program that presses it to the daemon's word,
/// while each page draws, and in the subject's window.
#[test]
fn a_key_stops_soon_on_every_page_and_in_the_subjects_window() {
    if !test_run::is_long_for("how soon a key stops the rig on each page of the panel") {
        return;
    }
    let Some(screen) = Screen::open() else {
        return;
    };
    let daemon = Daemon::start(&["--ramp-ms", "10"]);
    let mut client = daemon.client();
    let studies = studies();
    for page in PAGES {
        let study = studies.path().join(page);
        let mut arguments = vec!["--theme", "dark", "--page", page];
        if page == "record" {
            arguments.extend(["--open", RECORDING]);
        } else if study.exists() {
            arguments.extend(["--study", plain(&study)]);
        }
        let panel = screen.panel(daemon.socket(), &arguments);
        wait_for(&mut client, "the panel", |status| status.clients == 3);
        wait_until_drawn(&screen);
        screen.act(&["search", "--sync", "--name", "Haptic panel", "windowfocus"]);
        press_stop(&screen, &mut client, page);
        if page == "task" {
            open_subjects_window(&screen);
            press_stop(&screen, &mut client, "the subject's window");
        }
        drop(panel);
        wait_for(&mut client, "the panel to go", |status| status.clients == 1);
    }
}

/// Stops the rig by many keys in the window that has the keyboard, and prints how soon it stops.
fn press_stop(screen: &Screen, client: &mut Client, place: &str) {
    const PRESSES: usize = 100;
    let mut times: Vec<u64> = (0..PRESSES)
        .map(|_| {
            bring_to(client, RigState::Engaged);
            let pressed = Instant::now();
            screen.act(&["key", "space"]);
            wait_for_state(client, RigState::Stopped);
            u64::try_from(pressed.elapsed().as_nanos()).expect("it is soon")
        })
        .collect();
    times.sort_unstable();
    let ms = |per_mille| us(percentile(&times, per_mille)) * 1e-3;
    let [half, p99, longest] = [500, 990, 1000].map(ms);
    println!("{place}: a key stops in {half:.1} ms, p99 {p99:.1} ms, longest {longest:.1} ms");
}

fn wait_until_drawn(screen: &Screen) {
    until("the window is not drawn", || is_drawn(&screen.picture()));
}

#[test]
fn user_tunes_and_stops_rig_and_panel_outlives_daemon() {
    let Some(screen) = Screen::open() else {
        return;
    };
    let directory = tempfile::tempdir().expect("a directory");
    let socket = directory.path().join("run/control.sock");
    let daemon = Daemon::start_at(&socket, &["--ramp-ms", "10"]);
    let mut client = daemon.client();
    let _panel = screen.panel(&socket, &["--theme", "dark"]);
    wait_for(&mut client, "the panel", |status| status.clients == 3);
    engage(&mut client);
    wait_until_drawn(&screen);
    // There is no window manager that would do it.
    screen.act(&["search", "--sync", "--name", "Haptic panel", "windowfocus"]);

    screen.click(MASS_FIELD);
    screen.act(&["key", "ctrl+a"]);
    screen.act(&["type", "750g"]);
    screen.act(&["key", "Return"]);
    let mass = |expected: f64| {
        let mut client = daemon.client();
        until(&format!("the mass is not {expected} kg"), || {
            let reply: SceneReply = client.request(Request::get()).expect("a scene");
            reply.scene.value(Parameter::Mass) == Some(Directional::both(expected))
        });
    };
    mass(0.75);
    screen.click(MASS_FIELD);
    screen.act(&["key", "ctrl+a"]);
    assert!(!screen.offers_a_copy());
    screen.act(&["key", "ctrl+c"]);
    until("no other program can paste it", || screen.offers_a_copy());
    screen.act(&["key", "Tab"]);
    screen.act(&["key", "ctrl+z"]);
    mass(0.5);

    // Half a number in a text field, and the key that stops. (Space stops too where no frame is drawn for 300 ms, as on
    // a busy machine: that it is typed otherwise is for the panel's own tests, which hand in a clock.)
    screen.click(MASS_FIELD);
    screen.act(&["type", "9"]);
    assert_eq!(status(&mut client).state, RigState::Engaged);
    screen.act(&["key", "Escape"]);
    wait_for_state(&mut client, RigState::Stopped);
    mass(0.5);

    drop(client);
    daemon.end(rustix::process::Signal::KILL);
    let daemon = Daemon::start_at(&socket, &["--ramp-ms", "10"]);
    let mut client = daemon.client();
    wait_for(&mut client, "the panel again", |status| status.clients == 3);
    screen.act(&["key", "Escape"]);
    wait_for_state(&mut client, RigState::Stopped);
    // The other pages stop as well.
    for (page, key) in [
        ("ctrl+2", "space"),
        ("ctrl+3", "Escape"),
        ("ctrl+4", "space"),
        ("ctrl+5", "Escape"),
    ] {
        bring_to(&mut client, RigState::Idle);
        screen.act(&["key", page]);
        screen.act(&["key", key]);
        wait_for_state(&mut client, RigState::Stopped);
    }
}
