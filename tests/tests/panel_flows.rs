//! What a person does in the panel's real window, with keys and clicks: a recording with a mark and a note, a picture
//! of the plots, and the end of the window while force is on.

use haptic_ipc::{Request, RigState, StateReply};
use haptic_recording::{Ending, Mark};
use std::fs;
use std::path::Path;
use system_tests::screen::{Picture, Screen};
use system_tests::{Daemon, until, until_some, wait_for, wait_for_state};

/// The button that begins and ends a recording, on its page.
const RECORD: (usize, usize) = (43, 122);

/// Its colour while a recording is made: beside its text.
const RECORDING: (usize, usize) = (14, 122);

/// Within the field of a note, left of its text and below it.
const NOTE: (usize, usize) = (640, 690);

/// The menu of exports on that page, and what writes a PNG.
const EXPORT: (usize, usize) = (1116, 121);
const PNG: (usize, usize) = (842, 196);

/// Where its folder stands.
const EXPORT_FOLDER: (usize, usize) = (1050, 168);

/// What chooses the rig to be identified, and the button that begins, on its page.
const THE_RIG: (usize, usize) = (125, 119);
const IDENTIFY: (usize, usize) = (43, 255);

/// How much of a colour a dark field has, at most.
const DARK: u8 = 16;

fn is_dark(picture: &Picture, (x, y): (usize, usize)) -> bool {
    picture.at(x, y).iter().all(|part| *part <= DARK)
}

/// Pixels in the colour of a button, in the row of pages under a title bar: only a question has buttons there.
fn question(picture: &Picture) -> usize {
    let places = (95..122).flat_map(|y| (390..1270).map(move |x| (x, y)));
    let of_button = |(x, y): &(usize, usize)| picture.at(*x, *y).iter().all(|part| part.abs_diff(50) <= 4);
    places.filter(of_button).count()
}

/// More than any text has.
const MANY: usize = 1000;

/// The size of a picture, once it is written whole.
fn size_of(path: &Path) -> Option<(u32, u32)> {
    let file = std::io::BufReader::new(fs::File::open(path).ok()?);
    let mut reader = png::Decoder::new(file).read_info().ok()?;
    let mut pixels = vec![0; reader.output_buffer_size()?];
    let frame = reader.next_frame(&mut pixels).ok()?;
    Some((frame.width, frame.height))
}

#[test]
fn a_person_records_marks_notes_exports_and_closes() {
    if !test_run::is_long_for("a recording by hand in the panel's window") {
        return;
    }
    let Some(screen) = Screen::open() else { return };
    if !test_run::has(&["openbox"]) {
        return;
    }
    let daemon = Daemon::start(&["--ramp-ms", "10"]);
    let mut client = daemon.client();
    client.request::<StateReply>(Request::engage()).expect("it engages");
    let mut panel = screen.panel(daemon.socket(), &["--theme", "dark", "--page", "record"]);
    wait_for(&mut client, "the panel", |status| status.clients == 3);
    let is_amber = |picture: &Picture| {
        let [red, _, blue] = picture.at(RECORDING.0, RECORDING.1);
        red > 100 && blue < 40
    };
    screen.wait_until("the page", |picture| {
        let [red, ..] = picture.at(RECORDING.0, RECORDING.1);
        red > 40 && !is_amber(picture)
    });
    screen.act(&["search", "--sync", "--name", "Haptic panel", "windowfocus"]);
    screen.press(RECORD);
    screen.wait_until("the recording", is_amber);

    screen.act(&["key", "m"]);
    screen.act(&["key", "n"]);
    screen.wait_until("the note's field", |picture| is_dark(picture, NOTE));
    screen.act(&["type", "sticky"]);
    screen.act(&["key", "Return"]);
    screen.wait_until("its end", |picture| !is_dark(picture, NOTE));

    screen.press(EXPORT);
    screen.wait_until("the menu", |picture| is_dark(picture, EXPORT_FOLDER));
    screen.press(PNG);
    let picture = screen.home().join("haptic-plot-1.png");
    let size = until_some("no picture", || size_of(&picture));
    assert!(size.0 > 800 && size.1 > 500, "the plots alone: {size:?}");

    // Closing asks while force is on, and ends the recording.
    let _manager = screen.window_manager();
    let close = ["search", "--name", "Haptic panel", "windowactivate", "key", "alt+F4"];
    until("it does not ask", || {
        if question(&screen.picture()) >= MANY {
            return true;
        }
        assert!(!panel.has_ended(), "it closes unasked");
        // The manager has yet to come.
        screen.tries(&close);
        false
    });
    assert_eq!(system_tests::status(&mut client).state, RigState::Engaged);
    client.request::<StateReply>(Request::Release {}).expect("it lets go");
    wait_for_state(&mut client, RigState::Idle);
    until("it does not close", || {
        panel.has_ended() || {
            screen.tries(&close);
            false
        }
    });
    let recording = haptic_recording::read(&screen.home().join("haptic-recording-1.mcap")).expect("it is read");
    assert_eq!(recording.ending, Ending::Complete);
    let texts = recording.marks.iter().filter_map(|(_, mark)| match mark {
        Mark::Marker { text, .. } => Some(text.as_str()),
        _ => None,
    });
    assert_eq!(texts.collect::<Vec<_>>(), ["marker 1", "sticky"]);
}

#[test]
fn a_person_identifies_what_is_seen_of_the_rig() {
    if !test_run::is_long_for("an identification by hand in the panel's window") {
        return;
    }
    let Some(screen) = Screen::open() else { return };
    let daemon = Daemon::start(&["--ramp-ms", "10"]);
    let mut client = daemon.client();
    client.request::<StateReply>(Request::engage()).expect("it engages");
    let _panel = screen.panel(daemon.socket(), &["--theme", "dark", "--page", "identify"]);
    // Two turns of the hand and more.
    let begun = wait_for(&mut client, "the panel", |status| status.clients == 3);
    wait_for(&mut client, "some seconds", |status| status.tick > begun.tick + 6000);
    screen.press(THE_RIG);
    let is_light = |picture: &Picture| picture.at(IDENTIFY.0 - 28, IDENTIFY.1)[0] >= 45;
    screen.wait_until("a button that can be pressed", is_light);
    screen.press(IDENTIFY);
    // The samples of four plots, in the colour of the device.
    screen.wait_until("data and fits", |picture| {
        let places = (150..760).flat_map(|y| (390..1270).map(move |x| (x, y)));
        let is_of_device = |(x, y): &(usize, usize)| {
            let [red, _, blue] = picture.at(*x, *y);
            blue > 150 && red < 120
        };
        places.filter(is_of_device).count() > 3000
    });
}
