//! The keys of Stop under X11, seen beside the window's event loop: that one takes no key while it draws a frame, which
//! lasts tens of milliseconds where the processor draws.
//!
//! X11 sends the keys of a window to every client that asks for them. A thread asks on a connection of its own, for the
//! main window and for each that is made after it, as the subject's is. A window's number shows which client
//! made it: the server gives each client a range of numbers, so there is nothing to wait for, as for a property.
//! Wayland delivers a window's keys to one queue alone, so a stop by key waits for the frame there.

use std::{io, thread};
use x11rb::connection::Connection as _;
use x11rb::errors::ReplyError;
use x11rb::protocol::Event;
use x11rb::protocol::xproto::{
    ChangeWindowAttributesAux, ConnectionExt as _, EventMask, KeyPressEvent, Keycode, Window,
};
use x11rb::rust_connection::RustConnection;

/// The keys of Stop as X11 names them (`X11/keysymdef.h`).
const SPACE: u32 = 0x0020;
const ESCAPE: u32 = 0xff1b;

/// Calls `stop` at each press of Space or Escape in the main window of a program under X11, or in any that the same
/// program opens later, until the main window is gone or `stop` returns false. Space does not stop in the main window
/// while `space_is_typed`. A key that is held down is one press. The usual display is that of the environment.
///
/// # Errors
/// There is no X server, it has no such window, or the system has no thread left.
pub(crate) fn watch(
    display: Option<&str>,
    main: Window,
    space_is_typed: impl Fn() -> bool + Send + 'static,
    stop: impl Fn() -> bool + Send + 'static,
) -> io::Result<()> {
    let (server, _) = x11rb::connect(display).map_err(io::Error::other)?;
    let of_keys = EventMask::KEY_PRESS | EventMask::KEY_RELEASE | EventMask::FOCUS_CHANGE;
    let asked = ask(&server, main, of_keys | EventMask::STRUCTURE_NOTIFY);
    let root = asked.and_then(|()| Ok(server.get_geometry(main)?.reply()?.root));
    let root = root.map_err(io::Error::other)?;
    ask(&server, root, EventMask::SUBSTRUCTURE_NOTIFY).map_err(io::Error::other)?;
    let mut keys = Keys {
        codes: stop_codes(&server).map_err(io::Error::other)?,
        down: Vec::new(),
        released: None,
    };
    thread::Builder::new().name("stop keys".to_owned()).spawn(move || {
        // Without a server there is no window any more.
        while let Ok(event) = server.wait_for_event() {
            let is_stop = match event {
                Event::KeyPress(event) => keys.press(&event, event.event == main && space_is_typed()),
                Event::KeyRelease(event) => {
                    keys.release(&event);
                    false
                }
                Event::MappingNotify(_) => {
                    keys.codes = stop_codes(&server).unwrap_or_else(|_| std::mem::take(&mut keys.codes));
                    false
                }
                Event::FocusOut(_) => {
                    keys.forget();
                    false
                }
                Event::CreateNotify(event) if are_of_one_client(&server, event.window, main) => {
                    // It fails only if the window is gone already.
                    ask(&server, event.window, of_keys).unwrap_or(());
                    false
                }
                Event::DestroyNotify(event) if event.window == main => return,
                _ => false,
            };
            if is_stop && !stop() {
                return;
            }
        }
    })?;
    Ok(())
}

/// Asks for events of a window.
fn ask(server: &RustConnection, window: Window, events: EventMask) -> Result<(), ReplyError> {
    let attributes = ChangeWindowAttributesAux::new().event_mask(events);
    server.change_window_attributes(window, &attributes)?.check()
}

/// Whether the same client made both windows.
fn are_of_one_client(server: &RustConnection, one: Window, other: Window) -> bool {
    (one ^ other) & !server.setup().resource_id_mask == 0
}

/// The codes of the keys of Stop on this keyboard.
#[derive(Debug, Default)]
struct StopCodes {
    space: Vec<Keycode>,
    escape: Vec<Keycode>,
}

/// Asks for them.
fn stop_codes(server: &RustConnection) -> Result<StopCodes, ReplyError> {
    let (first, last) = (server.setup().min_keycode, server.setup().max_keycode);
    let mapping = server.get_keyboard_mapping(first, last - first + 1)?.reply()?;
    let of_code = mapping.keysyms.chunks(usize::from(mapping.keysyms_per_keycode.max(1)));
    let of_code: Vec<_> = (first..=last).zip(of_code).collect();
    let codes = |key: u32| {
        let with_key = of_code.iter().filter(|(_, keysyms)| keysyms.contains(&key));
        with_key.map(|(code, _)| *code).collect()
    };
    Ok(StopCodes {
        space: codes(SPACE),
        escape: codes(ESCAPE),
    })
}

/// Tells presses from the repetitions of a key that is held down.
struct Keys {
    codes: StopCodes,
    /// The keys of Stop that are down.
    down: Vec<Keycode>,
    /// The newest release of one that was down, and its time, ms: a repetition is that and a press at the same time.
    released: Option<(Keycode, u32)>,
}

impl Keys {
    /// Whether a press stops. A key that bears both is Escape.
    fn press(&mut self, event: &KeyPressEvent, space_is_typed: bool) -> bool {
        let is_escape = self.codes.escape.contains(&event.detail);
        if !is_escape && !self.codes.space.contains(&event.detail) {
            return false;
        }
        let was_down = self.down.contains(&event.detail) || self.released == Some((event.detail, event.time));
        self.down.retain(|down| *down != event.detail);
        self.down.push(event.detail);
        !was_down && (is_escape || !space_is_typed)
    }

    /// Another window has the keyboard, and hears of the releases.
    fn forget(&mut self) {
        self.down.clear();
        self.released = None;
    }

    fn release(&mut self, event: &KeyPressEvent) {
        let was_down = self.down.contains(&event.detail);
        self.down.retain(|down| *down != event.detail);
        self.released = was_down.then_some((event.detail, event.time));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{BufRead as _, BufReader};
    use std::process::{Child, Command, Stdio};
    use std::sync::mpsc;
    use std::time::{Duration, Instant};
    use x11rb::protocol::xproto::{CreateWindowAux, InputFocus, WindowClass};

    const PATIENCE: Duration = Duration::from_secs(60);

    struct Server(Child);

    impl Drop for Server {
        fn drop(&mut self) {
            drop(self.0.kill());
            drop(self.0.wait());
        }
    }

    /// A server without a screen, and the name of its display.
    fn server() -> Option<(Server, String)> {
        if !["Xvfb", "xdotool"].into_iter().all(test_run::is_there) {
            test_run::skip("Xvfb", "Debian: apt install xvfb xdotool");
            return None;
        }
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-nolisten", "tcp", "-screen", "0", "64x64x24"])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb starts");
        let output = server.stdout.take().expect("it is piped");
        let mut number = String::new();
        BufReader::new(output)
            .read_line(&mut number)
            .expect("it names its display");
        Some((Server(server), format!(":{}", number.trim())))
    }

    /// Opens a window that takes keys itself.
    fn open_window(client: &RustConnection, screen: usize) -> Window {
        let window = client.generate_id().expect("a number");
        let (root, copied) = (client.setup().roots[screen].root, WindowClass::COPY_FROM_PARENT);
        let about = CreateWindowAux::new().event_mask(EventMask::KEY_PRESS);
        let made = client.create_window(0, window, root, 0, 0, 64, 64, 0, copied, 0, &about);
        made.expect("it is sent").check().expect("a window");
        let shown = client.map_window(window).expect("it is sent");
        shown.check().expect("it is shown");
        window
    }

    /// Gives a window the keyboard.
    fn focus(client: &RustConnection, window: Window) {
        let focus = client.set_input_focus(InputFocus::PARENT, window, x11rb::CURRENT_TIME);
        focus.expect("it is sent").check().expect("it has the keyboard");
    }

    fn press(display: &str, keys: &[&str]) {
        let pressed = Command::new("xdotool")
            .arg("key")
            .args(keys)
            .env("DISPLAY", display)
            .status();
        assert!(pressed.expect("it runs").success());
    }

    // hazard: H5
    #[test]
    fn a_key_stops_while_the_window_draws_and_takes_no_event() {
        let Some((_server, display)) = server() else { return };
        let (client, screen) = x11rb::connect(Some(&display)).expect("a connection");
        let window = open_window(&client, screen);
        focus(&client, window);
        let (stop, stops) = mpsc::channel();
        watch(Some(&display), window, || false, move || stop.send(()).is_ok()).expect("it is watched");
        // Nobody reads the events of the window's own client.
        press(&display, &["a", "Return", "space"]);
        stops.recv_timeout(PATIENCE).expect("a stop");
        press(&display, &["Tab", "Escape"]);
        stops.recv_timeout(PATIENCE).expect("another stop");
        assert!(stops.try_recv().is_err(), "no other key stops");
        let gone = watch(Some(&display), window + 1, || false, || true).expect_err("there is no such window");
        assert!(gone.to_string().contains("Window"), "{gone}");
    }

    /// The subject's window comes and goes while the panel runs. It has no text field.
    // hazard: H28
    #[test]
    fn stop_key_works_in_later_panel_windows_only() {
        let Some((_server, display)) = server() else { return };
        let (client, screen) = x11rb::connect(Some(&display)).expect("a connection");
        let (stranger, _) = x11rb::connect(Some(&display)).expect("a connection");
        let main = open_window(&client, screen);
        let (stop, stops) = mpsc::channel();
        watch(Some(&display), main, || true, move || stop.send(()).is_ok()).expect("it is watched");
        let foreign = open_window(&stranger, screen);
        for _ in 0..2 {
            let window = open_window(&client, screen);
            wait_until_asked_for(&client, window);
            focus(&client, window);
            press(&display, &["space"]);
            stops.recv_timeout(PATIENCE).expect("a stop");
            focus(&stranger, foreign);
            press(&display, &["Escape"]);
            let gone = client.destroy_window(window).expect("it is sent");
            gone.check().expect("it is gone");
        }
        focus(&client, main);
        // Text is typed there.
        press(&display, &["space", "Escape"]);
        stops.recv_timeout(PATIENCE).expect("a stop");
        press(&display, &["a", "Escape"]);
        stops.recv_timeout(PATIENCE).expect("another stop");
        assert!(
            stops.try_recv().is_err(),
            "another program's key, or one that is typed, stops"
        );
    }

    /// Waits until another client hears of a window's keys.
    fn wait_until_asked_for(client: &RustConnection, window: Window) {
        let began = Instant::now();
        loop {
            let asked = client.get_window_attributes(window).expect("it is sent");
            let asked = asked.reply().expect("it is there").all_event_masks;
            if asked.contains(EventMask::KEY_RELEASE) {
                return;
            }
            assert!(began.elapsed() < PATIENCE, "its keys are not asked for");
            thread::yield_now();
        }
    }

    const ESCAPE_KEY: Keycode = 9;
    const SPACE_KEY: Keycode = 65;
    const OTHER_KEY: Keycode = 66;

    fn keys() -> Keys {
        Keys {
            codes: StopCodes {
                space: vec![SPACE_KEY],
                escape: vec![ESCAPE_KEY],
            },
            down: vec![],
            released: None,
        }
    }

    /// A press or a release.
    fn at(detail: Keycode, time: u32) -> KeyPressEvent {
        KeyPressEvent {
            detail,
            time,
            ..KeyPressEvent::default()
        }
    }

    #[test]
    fn a_key_that_is_held_down_is_one_press() {
        let mut keys = keys();
        assert!(keys.press(&at(SPACE_KEY, 900), false) && !keys.press(&at(SPACE_KEY, 910), false));
        // Its release goes to another window.
        keys.forget();
        // A program that presses keys may release them first.
        keys.release(&at(SPACE_KEY, 1000));
        assert!(keys.press(&at(SPACE_KEY, 1000), false) && !keys.press(&at(OTHER_KEY, 1000), false));
        for time in [1500, 1530] {
            keys.release(&at(SPACE_KEY, time));
            assert!(!keys.press(&at(SPACE_KEY, time), false), "a repetition");
        }
        assert!(
            !keys.press(&at(SPACE_KEY, 1560), false),
            "a repetition without a release"
        );
        keys.release(&at(SPACE_KEY, 1600));
        assert!(keys.press(&at(SPACE_KEY, 1700), false), "pressed again");
    }

    // hazard: H28
    #[test]
    fn space_that_is_typed_does_not_stop_and_escape_does() {
        let mut keys = keys();
        assert!(!keys.press(&at(SPACE_KEY, 100), true), "it is typed");
        keys.release(&at(SPACE_KEY, 200));
        assert!(keys.press(&at(ESCAPE_KEY, 300), true));
        assert!(keys.press(&at(SPACE_KEY, 400), false), "no text is typed any more");
        // A key may bear both on some keyboard.
        keys.forget();
        keys.codes.space.push(ESCAPE_KEY);
        assert!(keys.press(&at(ESCAPE_KEY, 500), true));
    }
}
