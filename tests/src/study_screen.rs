//! A study with a person in the panel's windows: a short plan, where the panel's buttons for it are, and how the
//! subject's window is opened.

use crate::screen::{Picture, Screen};

/// Two segments of three trials. The hand's 30 mm are the targets' centres.
pub const PLAN: &str = r#"
task = "fitts"
name = "two segments"
practice_segments = 0
trials_per_segment = 3
rest_every_segments = 9
rest_s = 1
baseline = "simulated"
[cursor]
diameter_m = 0.006
[rig]
gain = 3
center_m = 0
range_m = [-0.12, 0.12]
[[conditions]]
name = "1"
amplitude_m = 0.18
width_m = 0.12
[[resistances]]
name = "simulated"
[resistances.scene]
block = { mass = 0.5 }
coupling = { stiffness = 25000, damping = 10 }
[resistances.scene.friction]
law = "karnopp"
static_force = 4.0
dynamic_force = 3.5
"#;

/// Near the left end of the button that begins or continues, pixels.
pub const GO_ON: (usize, usize) = (20, 226);

/// Near the left end of the button that pauses, pixels.
pub const PAUSE: (usize, usize) = (180, 226);

/// The box that shows the subject's window, pixels.
const SUBJECTS_SCREEN: (usize, usize) = (15, 269);

/// A button of the dark theme is darker than this where it cannot be pressed.
const ENABLED: u8 = 44;

/// The title of the subject's window.
pub const SUBJECTS_TITLE: &str = "Subject's screen";

/// Waits until a panel shows its study, which has not begun.
pub fn wait_until_open(screen: &Screen) {
    wait_until_enabled(screen, GO_ON);
}

/// Opens the subject's window of a dark panel that shows its study, and gives it the keyboard.
pub fn open_subjects_window(screen: &Screen) {
    screen.press(SUBJECTS_SCREEN);
    let found = ["search", "--sync", "--onlyvisible", "--name", SUBJECTS_TITLE];
    screen.act(&[&found[..], &["windowfocus"]].concat());
}

/// Whether the button at a place can be pressed.
pub fn is_enabled(picture: &Picture, (x, y): (usize, usize)) -> bool {
    picture.at(x, y)[0] >= ENABLED
}

/// Waits until the button at a place can be pressed.
pub fn wait_until_enabled(screen: &Screen, button: (usize, usize)) {
    screen.wait_until(&format!("the button at {button:?}"), |picture| {
        is_enabled(picture, button)
    });
}
