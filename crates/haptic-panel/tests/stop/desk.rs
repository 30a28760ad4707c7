//! A panel at a real daemon, with a thread that presses keys and one that listens to what the daemon does.

use crate::metadata::metadata;
use crate::row::row;
use egui::{Context, Event, Key, Modifiers, RawInput, Rect, vec2};
use haptic_ipc::{Client, Request, RigState, Sample, ServerLine, StateReply, Status, SubscribeReply, Topic};
use haptic_panel::connection::{Connection, Patience};
use haptic_panel::{App, Files, Intent, Loaded, Page, Update, theme};
use haptic_recording::{Ending, Format, Writer};
use rustix::event::{PollFd, PollFlags, Timespec, poll};
use std::fs::{File, OpenOptions};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};
use std::thread;
use std::time::{Duration, Instant};

/// Long enough for a busy machine; only a failing test waits for it.
pub(crate) const LIMIT: Duration = Duration::from_secs(30);

/// Between two frames of a window that draws 30 a second.
const FRAME: Duration = Duration::from_millis(33);

/// A panel at a daemon.
pub(crate) struct Desk {
    app: App,
    ctx: Context,
    daemon: Child,
    control: Client,
    stopped: mpsc::Receiver<Instant>,
    frames: Vec<Duration>,
    /// What the newest frame shows.
    texts: Vec<String>,
    seed: u64,
    _directory: tempfile::TempDir,
}

impl Drop for Desk {
    fn drop(&mut self) {
        drop(self.daemon.kill());
        drop(self.daemon.wait());
    }
}

impl Desk {
    pub(crate) fn new() -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        let socket = directory.path().join("s");
        let daemon = Command::new(test_run::binary("hapticd"))
            // A busy machine may keep it waiting for longer than a hand would.
            .args(["--stale-ms", "1000", "--control-timeout-ms", "5000", "--spin-us", "0"])
            .args(["--device", "fake", "--ramp-ms", "10", "--socket"])
            .arg(&socket)
            .arg("--scene-dir")
            .arg(directory.path().join("scenes"))
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .expect("hapticd starts");
        let began = Instant::now();
        let control = loop {
            match Client::connect(&socket) {
                Ok(client) => break client,
                Err(error) => assert!(began.elapsed() < LIMIT, "{error}"),
            }
        };
        let stopped = listen(&socket);
        let locate = move || socket.clone();
        let connection = Connection::start(locate, Patience::default(), |_| {}).expect("threads");
        let ctx = Context::default();
        theme::install(&ctx);
        let mut desk = Self {
            app: App::new(connection, Files::new(|_| {})),
            ctx,
            daemon,
            control,
            stopped,
            frames: Vec::new(),
            texts: Vec::new(),
            seed: 1,
            _directory: directory,
        };
        // The two connections of the panel, and those of this test.
        desk.draw_until("the panel is connected", |desk| {
            let status: Status = desk.control.request(Request::Status {}).expect("a status");
            desk.app.model().is_connected() && status.clients == 4
        });
        desk
    }

    pub(crate) fn ask(&mut self, intent: Intent) {
        let ctx = self.ctx.clone();
        self.app.carry_out(&ctx, intent);
    }

    pub(crate) fn open(&mut self, loaded: Loaded) {
        let path = PathBuf::from("hour.csv");
        let result = Ok(Box::new(loaded));
        self.app.hear(Update::Opened { path, result });
        self.frames.clear();
    }

    pub(crate) fn turn_to(&mut self, page: Page) {
        self.app.turn_to(page);
    }

    pub(crate) fn files_busy(&self) -> usize {
        self.app.files().busy()
    }

    /// Durations of the frames.
    pub(crate) fn frames(&self) -> String {
        let mut frames = self.frames.clone();
        frames.sort();
        percentiles(&frames).join(", ")
    }

    /// The work of a window when there is something to draw.
    fn draw(&mut self, events: Vec<Event>) {
        let began = Instant::now();
        let input = RawInput {
            screen_rect: Some(Rect::from_min_size(egui::Pos2::ZERO, vec2(1280.0, 800.0))),
            events,
            ..RawInput::default()
        };
        let app = &mut self.app;
        app.take_keys(&input);
        let mut output = self.ctx.run_ui(input, |ui| {
            app.take_news(ui.ctx());
            app.show(ui);
        });
        // There is no graphics card for the fonts.
        output.textures_delta.clear();
        self.texts = output.shapes.iter().filter_map(|shown| text(&shown.shape)).collect();
        drop(self.ctx.tessellate(output.shapes, output.pixels_per_point));
        self.frames.push(began.elapsed());
    }

    pub(crate) fn draw_until(&mut self, what: &str, is_so: impl Fn(&mut Self) -> bool) {
        let began = Instant::now();
        loop {
            self.draw(Vec::new());
            if is_so(self) {
                return;
            }
            assert!(began.elapsed() < LIMIT, "not in time: {what}");
        }
    }

    fn state(&mut self) -> RigState {
        let status: Status = self.control.request(Request::Status {}).expect("a status");
        status.state
    }

    fn engage(&mut self) {
        let began = Instant::now();
        loop {
            // Before the state is asked for: the panel's other connection may stop it once more, and that must be
            // received.
            while self.stopped.try_recv().is_ok() {}
            if self.state() == RigState::Engaged {
                return;
            }
            assert!(began.elapsed() < LIMIT, "it does not engage");
            // Refused if another stop comes in between.
            drop(self.control.request::<StateReply>(Request::Reset {}));
            drop(self.control.request::<StateReply>(Request::engage()));
            // The panel receives the state as well.
            self.draw(Vec::new());
        }
    }

    /// Presses Space on an engaged rig at any time of a frame. Returns the time until the daemon reports
    /// the stop.
    pub(crate) fn press_and_wait(&mut self) -> Duration {
        loop {
            self.engage();
            let at = self.press();
            let stopped = self.stopped.recv_timeout(LIMIT).expect("the daemon stops in time");
            // Otherwise it is the stop before, on the panel's other connection.
            if let Some(time) = stopped.checked_duration_since(at) {
                return time;
            }
        }
    }

    /// Presses Space in another window of the panel, whose keys it sees before its own next frame, and takes the news
    /// of the stop before it draws.
    pub(crate) fn press_elsewhere(&mut self) {
        self.engage();
        self.app.take_keys(&RawInput {
            events: vec![space(true)],
            ..RawInput::default()
        });
        self.stopped.recv_timeout(LIMIT).expect("the daemon stops in time");
        let began = Instant::now();
        while began.elapsed() < Duration::from_millis(100) {
            self.app.take_news(&self.ctx);
        }
    }

    /// Whether the newest frame shows a text.
    pub(crate) fn shows(&self, part: &str) -> bool {
        self.texts.iter().any(|text| text.contains(part))
    }

    /// The same for a stop without a panel: the share of the daemon and the machine.
    pub(crate) fn stop_without_panel(&mut self) -> Duration {
        loop {
            self.engage();
            let at = Instant::now();
            self.control.request::<StateReply>(Request::Stop {}).expect("it stops");
            let stopped = self.stopped.recv_timeout(LIMIT).expect("the daemon stops in time");
            if let Some(time) = stopped.checked_duration_since(at) {
                return time;
            }
        }
    }

    /// Presses Space at any moment of the window. Returns the time.
    fn press(&mut self) -> Instant {
        self.seed = self.seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1);
        // Up to an eighth of a second.
        let pause = Duration::from_micros(self.seed >> 47);
        let (keys, pressed) = mpsc::channel();
        let finger = thread::spawn(move || {
            thread::sleep(pause);
            keys.send(Instant::now()).expect("the window is there");
        });
        let at = loop {
            let drawn = Instant::now();
            self.draw(Vec::new());
            if let Ok(at) = pressed.recv_timeout(FRAME.saturating_sub(drawn.elapsed())) {
                break at;
            }
            assert!(drawn.elapsed() < LIMIT, "a frame in time");
        };
        finger.join().expect("it pressed");
        self.draw(vec![space(true), space(false)]);
        at
    }
}

fn space(pressed: bool) -> Event {
    Event::Key {
        key: Key::Space,
        physical_key: None,
        pressed,
        repeat: false,
        modifiers: Modifiers::NONE,
    }
}

fn text(shape: &egui::Shape) -> Option<String> {
    match shape {
        egui::Shape::Text(text) => Some(text.galley.text().to_owned()),
        _ => None,
    }
}

/// Receives every stop of the daemon, with its time.
fn listen(socket: &Path) -> mpsc::Receiver<Instant> {
    let mut client = Client::connect(socket).expect("the daemon serves");
    let subscribe = Request::Subscribe {
        topics: vec![Topic::State],
        rate_hz: None,
        batch_ms: None,
    };
    client.request::<SubscribeReply>(subscribe).expect("it subscribes");
    let (_, mut events) = client.split();
    let (sender, receiver) = mpsc::channel();
    thread::spawn(move || {
        while let Ok(line) = events.receive() {
            let now = Instant::now();
            if let ServerLine::Event(haptic_ipc::Event::State(event)) = line
                && event.state == RigState::Stopped
                && sender.send(now).is_err()
            {
                return;
            }
        }
    });
    receiver
}

/// Median, 99th percentile and maximum of sorted times.
pub(crate) fn percentiles(times: &[Duration]) -> [String; 3] {
    let at = |hundredths: usize| times[(times.len() * hundredths / 100).min(times.len() - 1)];
    [50, 99, 100].map(|hundredths| format!("{:.1} ms", at(hundredths).as_secs_f64() * 1e3))
}

/// An hour at 1 kHz; in a short run five minutes.
pub(crate) fn an_hour() -> Loaded {
    Loaded::new(
        "hour.csv".into(),
        metadata(),
        (0..test_run::extent(300_000, 3_600_000)).map(row),
        &[],
        Ending::Complete,
    )
}

/// A named pipe: a disk that stalls until it is read.
pub(crate) struct Pipe {
    path: PathBuf,
    /// Both ends: writers can open it, and it is never read.
    held: Option<File>,
    is_over: Arc<AtomicBool>,
    _directory: tempfile::TempDir,
}

impl Pipe {
    /// A pipe without a reader.
    pub(crate) fn unopened() -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("pipe");
        let made = Command::new("mkfifo").arg(&path).status().expect("mkfifo runs");
        assert!(made.success());
        Self {
            path,
            held: None,
            is_over: Arc::default(),
            _directory: directory,
        }
    }

    /// A pipe that is open for reading, and is not read.
    pub(crate) fn new() -> Self {
        let mut pipe = Self::unopened();
        pipe.held = OpenOptions::new().read(true).write(true).open(&pipe.path).ok();
        assert!(pipe.held.is_some());
        pipe
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Whether it has no room, so that its writer is blocked.
    pub(crate) fn is_full(&self) -> bool {
        let held = self.held.as_ref().expect("it is open");
        let at_once = Timespec { tv_sec: 0, tv_nsec: 0 };
        let mut watched = [PollFd::new(held, PollFlags::OUT)];
        poll(&mut watched, Some(&at_once)).expect("a pipe") == 0
    }

    /// Reads it until the returned value is dropped.
    pub(crate) fn drain(&self) -> Busy {
        let mut end = self
            .held
            .as_ref()
            .and_then(|held| held.try_clone().ok())
            .expect("it is open");
        let is_over = Arc::clone(&self.is_over);
        thread::spawn(move || {
            let mut bytes = vec![0; 1 << 16];
            while !is_over.load(Ordering::Acquire) && end.read(&mut bytes).is_ok() {}
        });
        Busy(Arc::clone(&self.is_over))
    }

    /// Writes an endless recording into it until the returned value is dropped.
    pub(crate) fn feed(&self) -> Busy {
        let (path, is_over) = (self.path.clone(), Arc::clone(&self.is_over));
        thread::spawn(move || {
            let file = OpenOptions::new().write(true).open(&path).expect("it is read");
            let mut writer = Writer::new(Format::Csv, file, &path, &metadata()).expect("it is read");
            for begin in (0..u32::MAX - 1000).step_by(1000) {
                let rows: Vec<Sample> = (begin..begin + 1000).map(row).collect();
                if is_over.load(Ordering::Acquire) || writer.rows(&rows, &[]).is_err() {
                    return;
                }
                // An hour's worth a minute, so that it takes little memory in the time that it is fed.
                thread::sleep(Duration::from_millis(16));
            }
        });
        Busy(Arc::clone(&self.is_over))
    }
}

/// Ends the thread at a pipe.
pub(crate) struct Busy(Arc<AtomicBool>);

impl Drop for Busy {
    fn drop(&mut self) {
        self.0.store(true, Ordering::Release);
    }
}
