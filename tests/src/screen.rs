//! A screen that exists in memory alone: the panel's window is drawn on it in software, looked at
//! pixel by pixel, and given keys and clicks.
//!
//! Xvfb keeps its picture in a file (`-fbdir`), in the form of `xwd`, so that nothing else is
//! needed to look at it.

use crate::process::Killed;
use crate::{PATIENCE, binary, until};
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};
use std::{fs, thread};
use x11rb::protocol::xproto::ConnectionExt as _;

/// Width and height of the usual screen, pixels: what the panel opens with.
pub const SIZE: (usize, usize) = (1280, 800);

/// Between two looks at the screen: longer than any frame takes in software.
const BETWEEN_LOOKS: Duration = Duration::from_millis(700);

/// A screen of its own. It is gone when the test ends.
#[derive(Debug)]
pub struct Screen {
    /// Width and height, pixels.
    size: (usize, usize),
    _server: Killed,
    display: String,
    directory: tempfile::TempDir,
}

/// A panel on a screen, or another program there. It is closed when the test ends.
#[derive(Debug)]
pub struct Panel(Killed);

/// What a screen shows: red, green and blue of each pixel, row by row.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture {
    /// Width and height, pixels.
    pub size: (usize, usize),
    /// Three bytes a pixel.
    pub rgb: Vec<u8>,
}

impl Screen {
    /// Opens a screen of the usual size in the long run, or says what is missing for one.
    pub fn open() -> Option<Self> {
        Self::of_size(SIZE)
    }

    /// Opens a screen of any size, pixels, in the long run: the window's libraries take long to compile, and what is
    /// drawn without a graphics card keeps the processors busy.
    pub fn of_size(size: (usize, usize)) -> Option<Self> {
        if !test_run::is_long_for("the panel in a real window") {
            return None;
        }
        for (program, package) in [("Xvfb", "xvfb"), ("xdotool", "xdotool")] {
            if !test_run::is_there(program) {
                test_run::skip(
                    program,
                    &format!("Debian: apt install {package} libgl1-mesa-dri libegl1 libgl1"),
                );
                return None;
            }
        }
        let directory = tempfile::tempdir().expect("a directory");
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-nolisten", "tcp", "-noreset", "-screen", "0"])
            .arg(format!("{}x{}x24", size.0, size.1))
            .arg("-fbdir")
            .arg(directory.path())
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb starts");
        let mut number = String::new();
        let stdout = server.stdout.take().expect("it is piped");
        BufReader::new(stdout)
            .read_line(&mut number)
            .expect("it names its display");
        let display = format!(":{}", number.trim());
        assert_ne!(display, ":", "Xvfb did not come up");
        let screen = Self {
            size,
            _server: Killed(server),
            display,
            directory,
        };
        // What is under the pointer looks otherwise.
        screen.act(&["mousemove", &(size.0 - 1).to_string(), &(size.1 - 1).to_string()]);
        Some(screen)
    }

    /// Opens the panel on it.
    pub fn panel(&self, socket: &Path, arguments: &[&str]) -> Panel {
        let panel = Command::new(binary("haptic-gui"))
            .arg("--socket")
            .arg(socket)
            .args(arguments)
            .env("DISPLAY", &self.display)
            .env_remove("WAYLAND_DISPLAY")
            .env("LIBGL_ALWAYS_SOFTWARE", "1")
            // The window names its home as the folder of recordings: the same in every run.
            .env("HOME", "/nonexistent")
            .env("XDG_CONFIG_HOME", self.directory.path().join(".config"))
            .env("XDG_RUNTIME_DIR", self.directory.path())
            .stdin(Stdio::null())
            .spawn();
        let panel = Panel(Killed(panel.expect("haptic-gui starts")));
        if self.size != SIZE {
            // There is no window manager that would fit it to the screen.
            let (width, height) = (self.size.0.to_string(), self.size.1.to_string());
            let found = ["search", "--sync", "--onlyvisible", "--name", "Haptic panel"];
            self.act(&[&found[..], &["windowsize", &width, &height]].concat());
        }
        panel
    }

    /// Starts a window manager, without which no window can be minimised.
    pub fn window_manager(&self) -> Panel {
        let openbox = Command::new("openbox")
            .env("DISPLAY", &self.display)
            .env("HOME", self.directory.path())
            .stdin(Stdio::null())
            .stderr(Stdio::null())
            .spawn();
        Panel(Killed(openbox.expect("openbox starts (Debian: apt install openbox)")))
    }

    /// Moves the pointer, clicks, types: what `xdotool` takes.
    pub fn act(&self, what: &[&str]) {
        assert!(self.tries(what), "{what:?}");
    }

    /// The same, where it may be too early. Says whether it was done.
    pub fn tries(&self, what: &[&str]) -> bool {
        let done = Command::new("xdotool")
            .args(what)
            .env("DISPLAY", &self.display)
            .status();
        done.expect("xdotool runs").success()
    }

    /// Whether a program there offers a copy to the others.
    pub fn offers_a_copy(&self) -> bool {
        let (server, _) = x11rb::connect(Some(&self.display)).expect("the screen answers");
        let clipboard = server.intern_atom(false, b"CLIPBOARD").expect("it takes requests");
        let clipboard = clipboard.reply().expect("an atom").atom;
        let owner = server.get_selection_owner(clipboard).expect("it takes requests");
        owner.reply().expect("an answer").owner != x11rb::NONE
    }

    /// The directory of the screen, where the panels on it keep their settings.
    pub fn home(&self) -> &Path {
        self.directory.path()
    }

    /// Clicks.
    pub fn press(&self, (x, y): (usize, usize)) {
        self.act(&["mousemove", &x.to_string(), &y.to_string(), "click", "1"]);
    }

    /// Clicks, and waits until the place looks otherwise: a field that is clicked shows that it
    /// listens, and only then do keys go to it.
    pub fn click(&self, (x, y): (usize, usize)) {
        self.act(&["mousemove", &x.to_string(), &y.to_string()]);
        let looks = || self.picture().around((x, y));
        let mut before = looks();
        let began = Instant::now();
        // The pointer alone changes its look as well.
        loop {
            thread::sleep(BETWEEN_LOOKS);
            let now = looks();
            if now == before {
                break;
            }
            assert!(began.elapsed() < PATIENCE, "({x}, {y}) does not come to rest");
            before = now;
        }
        self.act(&["click", "1"]);
        until(&format!("nothing happens at ({x}, {y})"), || looks() != before);
    }

    /// What it shows now.
    pub fn picture(&self) -> Picture {
        let dump = fs::read(self.directory.path().join("Xvfb_screen0")).expect("the server keeps it");
        let field = |number: usize| {
            let bytes = dump[4 * number..4 * number + 4].try_into().expect("four bytes");
            usize::try_from(u32::from_be_bytes(bytes)).expect("it fits")
        };
        // See X11/XWDFile.h: the size of the header, width, height, bits a pixel, bytes a line, colours.
        let (header, size, bits) = (field(0), (field(4), field(5)), field(11));
        assert_eq!((size, bits), (self.size, 32));
        let (line, colours) = (field(12), field(19));
        let pixels = &dump[header + 12 * colours..];
        let rows = pixels.chunks(line).take(size.1);
        // The least byte comes first, and is blue.
        let rgb = rows.flat_map(|row| {
            row[..4 * size.0]
                .chunks(4)
                .flat_map(|pixel| [pixel[2], pixel[1], pixel[0]])
        });
        Picture {
            size,
            rgb: rgb.collect(),
        }
    }

    /// Waits until it shows what a test waits for.
    pub fn wait_until(&self, what: &str, is_there: impl Fn(&Picture) -> bool) {
        until(&format!("waited in vain for {what}"), || is_there(&self.picture()));
    }

    /// What it shows once that does not change any more, and `is_there` finds what it waits for in it.
    pub fn settled(&self, is_there: impl Fn(&Picture) -> bool) -> Picture {
        let began = Instant::now();
        let mut before = self.picture();
        loop {
            thread::sleep(BETWEEN_LOOKS);
            let now = self.picture();
            if now == before && is_there(&now) {
                return now;
            }
            assert!(began.elapsed() < PATIENCE, "the screen does not come to rest");
            before = now;
        }
    }
}

impl Panel {
    /// Time that processors have spent on the threads that it has now, s.
    pub fn processor_time_s(&self) -> f64 {
        crate::process::processor_time_s(self.0.id())
    }
}

impl Picture {
    /// The colour at a place.
    pub fn at(&self, x: usize, y: usize) -> [u8; 3] {
        let first = 3 * (y * self.size.0 + x);
        [self.rgb[first], self.rgb[first + 1], self.rgb[first + 2]]
    }

    /// The pixels near a place, as near as the edges of a text field are.
    fn around(&self, (x, y): (usize, usize)) -> Vec<[u8; 3]> {
        let rows = y.saturating_sub(14)..(y + 14).min(self.size.1);
        let columns = x.saturating_sub(20)..(x + 20).min(self.size.0);
        rows.flat_map(|y| columns.clone().map(move |x| self.at(x, y))).collect()
    }

    /// Share of the pixels that differ from those of another picture by more than `tolerance` in a colour.
    pub fn difference(&self, other: &Self, tolerance: u8) -> f64 {
        assert_eq!(self.size, other.size);
        let pixels = self.rgb.chunks(3).zip(other.rgb.chunks(3));
        let differ = pixels.filter(|(a, b)| a.iter().zip(*b).any(|(a, b)| a.abs_diff(*b) > tolerance));
        let (differ, all) = (differ.count(), self.size.0 * self.size.1);
        #[expect(clippy::cast_precision_loss, reason = "a million pixels")]
        let share = differ as f64 / all as f64;
        share
    }
}
