//! What the whole-system tests share: the real binaries, started and talked to as their users do.
//!
//! Nothing here sleeps for a state to come about: a daemon is ready when it has named its socket,
//! an answer is there when it is read, and a condition is waited for by asking the daemon, every
//! millisecond. What does not come about fails the test, by a panic.

pub mod attack;
pub mod blocked;
pub mod commissioning;
pub mod console;
pub mod drawn;
pub mod fake_rig;
mod held;
pub mod links;
pub mod measure;
pub mod package;
pub mod pid1;
pub mod process;
pub mod recorded;
pub mod reference;
pub mod schema;
pub mod screen;
pub mod simulated_rig;
pub mod soak;
pub mod stalled;
pub mod terminal;
mod timed;
pub mod transcript;

pub use held::{HeldThread, real_time_thread};
pub use timed::{count_logged, timed};

use haptic_ipc::{
    Client, ClientError, JournalEntry, LogReply, Request, RigState, StateReply, Status, SubscribeReply, Topic,
    WireError,
};
use std::ffi::OsStr;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::Shutdown;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStderr, Command, ExitStatus, Output, Stdio};
use std::time::{Duration, Instant};

/// The path of a program that the tests were built with. What this thread starts from here on goes before other work of
/// the machine, where that is permitted: a rig's clock does not wait for it.
pub fn binary(name: &str) -> PathBuf {
    const NICE: i32 = -10;
    // What builds it goes on as it is.
    let path = test_run::binary(name);
    // Without the right, everything is as it was.
    rustix::process::setpriority_process(None, NICE).ok();
    path
}

/// Longest that anything may take on a busy machine before a test gives up.
pub const PATIENCE: Duration = Duration::from_secs(60);

/// Waits between two looks at the same thing, for a tick: who asks without a pause keeps a processor
/// from the other tests.
pub fn pause() {
    std::thread::sleep(Duration::from_millis(1));
}

/// Looks again and again until `holds` is true.
pub fn until(failure: &str, mut holds: impl FnMut() -> bool) {
    until_some(failure, || holds().then_some(()));
}

/// Looks again and again until `find` finds something, and returns that.
pub fn until_some<T>(failure: &str, mut find: impl FnMut() -> Option<T>) -> T {
    let began = Instant::now();
    loop {
        if let Some(found) = find() {
            return found;
        }
        assert!(began.elapsed() < PATIENCE, "{failure}");
        pause();
    }
}

/// Lets a daemon and its rig stand still for longer than they may with a hand on the rig, where the test does not say
/// for how long: no machine keeps them waiting for as long, and only [`timed()`] cases are about a busy one. For the
/// same reason the loop does not spin: the tests run side by side, and their loops share a processor.
pub fn be_patient(hapticd: &mut Command) {
    for (option, value) in [
        ("--stale-ms", "1000"),
        ("--control-timeout-ms", "5000"),
        ("--spin-us", "0"),
    ] {
        if !hapticd.get_args().any(|argument| argument == option) {
            hapticd.args([option, value]);
        }
    }
}

/// The scene of Richard and Cutkosky's block.
pub const PAPER_SCENE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/simulated-friction.toml");

/// The scene with which hapticd begins where none is named.
pub const LIGHT_BLOCK: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes/light-block.toml");

/// Lets a daemon on a rig in its own process begin with the paper's scene, unless its arguments name another: whatever
/// hapticd begins with, the figures of the tests are those of the paper.
fn begin_with_the_papers_scene(hapticd: &mut Command) {
    let given: Vec<_> = hapticd.get_args().map(OsStr::to_string_lossy).collect();
    let given = given.join(" ") + " ";
    let names_one = ["--scene=", "--scene ", "--config"]
        .iter()
        .any(|option| given.contains(option));
    if given.contains("--device fake ") && !names_one {
        hapticd.args(["--scene", PAPER_SCENE]);
    }
}

/// Copies one of the workspace's binaries to where it can be run by others. A child writes it: were
/// this process to do it, a program that another thread starts meanwhile would hold it open for
/// writing for a moment, and it could not be run.
pub fn copy_binary(name: &str, to: &Path) {
    let copied = Command::new("cp").arg(binary(name)).arg(to).status();
    assert!(copied.expect("cp runs").success(), "{name} is copied");
}

/// A running hapticd. It is killed when the test ends.
#[derive(Debug)]
pub struct Daemon {
    child: Child,
    socket: PathBuf,
    printed: Vec<String>,
    stderr: BufReader<ChildStderr>,
    _directory: Option<tempfile::TempDir>,
}

impl Daemon {
    /// Starts a daemon with the fake rig on a socket of its own with more arguments.
    pub fn start(arguments: &[&str]) -> Self {
        Self::start_strictly_on("fake", arguments)
    }

    /// Starts a daemon with a device on a socket of its own with more arguments.
    pub fn start_on(device: &str, arguments: &[&str]) -> Self {
        Self::start_strictly_on(device, &[&["--uncommissioned"], arguments].concat())
    }

    /// The same, with every check of the device before it is engaged.
    pub fn start_strictly_on(device: &str, arguments: &[&str]) -> Self {
        let directory = tempfile::tempdir().expect("a directory");
        let mut daemon = Self::start_in(directory.path(), device, arguments);
        daemon._directory = Some(directory);
        daemon
    }

    /// The same in a directory that outlives it, and keeps its scenes and its state.
    pub fn start_in(directory: &Path, device: &str, arguments: &[&str]) -> Self {
        let mut command = Command::new(binary("hapticd"));
        command
            .args(["--device", device])
            .arg("--scene-dir")
            .arg(directory.join("scenes"))
            .arg("--state-dir")
            .arg(directory.join("state"))
            .args(arguments);
        Self::spawn(command, &directory.join("run/control.sock"))
    }

    /// Starts a daemon on a socket.
    pub fn start_at(socket: &Path, arguments: &[&str]) -> Self {
        let mut command = Command::new(binary("hapticd"));
        command.args(["--device", "fake"]).args(arguments);
        Self::spawn(command, socket)
    }

    /// Starts a prepared command on a socket, and waits until it has made it.
    pub fn spawn(mut command: Command, socket: &Path) -> Self {
        be_patient(&mut command);
        begin_with_the_papers_scene(&mut command);
        let mut child = command
            .arg("--socket")
            .arg(socket)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("hapticd starts");
        let mut stderr = BufReader::new(child.stderr.take().expect("it is piped"));
        let mut printed = Vec::new();
        // The line on its rate and privileges is the last that every daemon says.
        while !printed.last().is_some_and(|line: &String| line.contains(" Hz, ")) {
            let mut line = String::new();
            let read = stderr.read_line(&mut line).expect("its messages are text");
            assert!(read > 0, "hapticd did not come up: {printed:?}");
            printed.push(line);
        }
        Self {
            child,
            socket: socket.to_path_buf(),
            printed,
            stderr,
            _directory: None,
        }
    }

    /// The control socket.
    pub fn socket(&self) -> &Path {
        &self.socket
    }

    /// Where a daemon with a place of its own keeps the scenes that are saved.
    pub fn scene_dir(&self) -> PathBuf {
        let directory = self._directory.as_ref().expect("a place of its own");
        directory.path().join("scenes")
    }

    /// The process.
    pub fn pid(&self) -> u32 {
        self.child.id()
    }

    /// What it printed while it came up.
    pub fn printed(&self) -> &[String] {
        &self.printed
    }

    /// A client of the daemon; its greeting may come late on a busy machine.
    pub fn client(&self) -> Client {
        until_some("the daemon does not serve", || match Client::connect(&self.socket) {
            Err(ClientError::Io(error)) if error.kind() == std::io::ErrorKind::WouldBlock => None,
            client => Some(client.expect("the daemon serves")),
        })
    }

    /// A bare connection on which the greeting has been read.
    pub fn raw(&self) -> Raw {
        let mut raw = Raw::connect(&self.socket);
        let hello = raw.line();
        assert_eq!(hello["hello"]["protocol"], 1, "{hello}");
        raw
    }

    /// Runs haptic-ctl against the daemon.
    pub fn ctl(&self, arguments: &[&str]) -> Output {
        ctl(&self.socket, arguments)
    }

    /// Runs haptic-ctl, which must succeed, and returns what it printed.
    pub fn ctl_ok(&self, arguments: &[&str]) -> String {
        let output = self.ctl(arguments);
        assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
        String::from_utf8(output.stdout).expect("it prints text")
    }

    /// Runs haptic-ctl, which must succeed, and returns what it printed as JSON.
    pub fn ctl_json(&self, arguments: &[&str]) -> serde_json::Value {
        let printed = self.ctl_ok(&[arguments, &["--json"]].concat());
        serde_json::from_str(&printed).unwrap_or_else(|error| panic!("{printed}: {error}"))
    }

    /// Runs haptic-ctl, which must end with this code and print this on standard error; returns all of that.
    pub fn ctl_refused(&self, arguments: &[&str], code: i32, part: &str) -> String {
        let output = self.ctl(arguments);
        is_refused(&format!("{arguments:?}"), &output, code, &[part])
    }

    /// Starts haptic-ctl against the daemon; what it says is piped.
    pub fn start_ctl(&self, arguments: &[&str]) -> Child {
        let child = ctl_command(&self.socket, arguments).spawn();
        child.expect("haptic-ctl starts")
    }

    /// Starts `haptic-ctl record` into a file, with more arguments; what it says is piped.
    pub fn recorder(&self, file: &Path, more: &[&str]) -> Child {
        self.start_ctl(&[&["record", plain(file)], more].concat())
    }

    /// Sends a signal and waits for the end; returns how it ended and what it still printed.
    pub fn end(self, signal: rustix::process::Signal) -> (ExitStatus, String) {
        self.end_by(&signal.as_raw().to_string())
    }

    /// The same by a signal's name or number, as `kill` takes it: some have no name.
    pub fn end_by(mut self, signal: &str) -> (ExitStatus, String) {
        let kill = format!("kill -s {signal} {}", self.child.id());
        assert!(
            Command::new("bash")
                .args(["-c", &kill])
                .status()
                .expect("bash")
                .success(),
            "{kill}"
        );
        let mut printed = String::new();
        self.stderr.read_to_string(&mut printed).expect("its messages are text");
        (self.child.wait().expect("it ends"), printed)
    }
}

impl Drop for Daemon {
    fn drop(&mut self) {
        if std::thread::panicking() {
            timed::count_missed(&self.socket);
        }
        // It may have ended already; either way nothing of it stays.
        drop(self.child.kill());
        drop(self.child.wait());
        if std::thread::panicking() {
            let mut printed = String::new();
            drop(self.stderr.read_to_string(&mut printed));
            println!("hapticd has printed: {printed}");
        }
    }
}

/// haptic-ctl against a socket, as a person has it whose shell knows it: a command that it advises names none. It has
/// no input, and what it says is piped.
pub fn ctl_command(socket: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(binary("haptic-ctl"));
    command
        .env("HAPTICD_SOCKET", socket)
        .args(arguments)
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    command
}

/// Runs haptic-ctl against a socket.
pub fn ctl(socket: &Path, arguments: &[&str]) -> Output {
    let output = ctl_command(socket, arguments).output();
    output.expect("haptic-ctl starts")
}

/// Runs haptic-ctl for something that needs no daemon, which must succeed.
pub fn ctl_offline(arguments: &[&str]) -> Output {
    let output = ctl(Path::new("/nonexistent"), arguments);
    assert!(output.status.success(), "{arguments:?}: {}", stderr(&output));
    output
}

/// Runs haptic-ctl for something that needs no daemon, which must succeed, and returns what it printed as JSON.
pub fn ctl_offline_json(arguments: &[&str]) -> serde_json::Value {
    let output = ctl_offline(&[arguments, &["--json"]].concat());
    serde_json::from_slice(&output.stdout).expect("JSON")
}

/// Runs haptic-ctl for something that needs no daemon, which must end with this code and print all of this on
/// standard error; returns all that it printed there.
pub fn ctl_offline_refused(arguments: &[&str], code: i32, parts: &[&str]) -> String {
    let output = ctl(Path::new("/nonexistent"), arguments);
    is_refused(&format!("{arguments:?}"), &output, code, parts)
}

/// Holds a program that was to refuse something to its exit code and to what it says on standard error; returns that.
pub fn is_refused(what: &str, output: &Output, code: i32, parts: &[&str]) -> String {
    let message = stderr(output);
    assert_eq!(output.status.code(), Some(code), "{what}: {message}");
    for part in parts {
        assert!(message.contains(part), "{what}: `{message}` lacks `{part}`");
    }
    message
}

/// A path as an argument.
pub fn plain(path: &Path) -> &str {
    path.to_str().expect("a plain path")
}

/// All files below a folder, sorted by their paths; none where it is not there.
pub fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).into_iter().flatten();
    let mut paths: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    paths.sort();
    let inner = |path: PathBuf| if path.is_dir() { files(&path) } else { vec![path] };
    paths.into_iter().flat_map(inner).collect()
}

/// Bytes that a program printed, as text.
pub fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

/// What a program printed on standard error.
pub fn stderr(output: &Output) -> String {
    text(&output.stderr)
}

/// A connection that speaks bytes.
#[derive(Debug)]
pub struct Raw {
    stream: UnixStream,
    reader: BufReader<UnixStream>,
}

impl Raw {
    /// Connects, and reads nothing yet.
    pub fn connect(socket: &Path) -> Self {
        let stream = UnixStream::connect(socket).expect("the daemon serves");
        stream.set_read_timeout(Some(PATIENCE)).expect("a time-out can be set");
        Self {
            reader: BufReader::new(stream.try_clone().expect("a second handle")),
            stream,
        }
    }

    /// Sends bytes as they are.
    pub fn send(&mut self, bytes: impl AsRef<[u8]>) {
        self.stream.write_all(bytes.as_ref()).expect("the daemon reads");
    }

    /// Sends no more; answers can still be read.
    pub fn hang_up(&mut self) {
        self.stream.shutdown(Shutdown::Write).expect("it is connected");
    }

    /// Reads a line.
    pub fn line(&mut self) -> serde_json::Value {
        let mut line = String::new();
        let read = self.reader.read_line(&mut line).expect("the daemon writes");
        assert!(read > 0, "the daemon closed the connection");
        serde_json::from_str(&line).unwrap_or_else(|error| panic!("{line}: {error}"))
    }

    /// Sends a line and reads the answer.
    pub fn ask(&mut self, line: &str) -> serde_json::Value {
        self.send(format!("{line}\n"));
        self.line()
    }
}

/// Asks for the status.
pub fn status(client: &mut Client) -> Status {
    client.request(Request::Status {}).expect("a status")
}

/// The daemon's refusal of a request.
pub fn refused(client: &mut Client, request: Request) -> WireError {
    let asked = format!("{request:?}");
    match client.request::<serde_json::Value>(request) {
        Err(ClientError::Refused(error)) => error,
        other => panic!("{asked}: {other:?}"),
    }
}

/// The whole journal.
pub fn journal(client: &mut Client) -> Vec<JournalEntry> {
    let all = Request::Log {
        after: None,
        limit: Some(2000),
    };
    client.request::<LogReply>(all).expect("the journal").entries
}

/// Subscribes to topics; to samples of every tick.
pub fn subscribe(client: &mut Client, topics: &[Topic]) -> SubscribeReply {
    client
        .request(Request::subscribe(topics.to_vec()))
        .expect("a subscription")
}

/// Asks for the status until it is as wanted.
pub fn wait_for(client: &mut Client, what: &str, mut wanted: impl FnMut(&Status) -> bool) -> Status {
    let began = Instant::now();
    loop {
        let status = status(client);
        if wanted(&status) {
            return status;
        }
        assert!(began.elapsed() < PATIENCE, "waited in vain for {what}: {status:?}");
        pause();
    }
}

/// Waits until the rig is in a state.
pub fn wait_for_state(client: &mut Client, state: RigState) -> Status {
    wait_for(client, &state.to_string(), |status| status.state == state)
}

/// Brings the rig to `state`, idle or engaged. A key of the panel stops on three paths, and the last may be late: it is
/// reset again.
pub fn bring_to(client: &mut Client, state: RigState) {
    let began = Instant::now();
    loop {
        let next = match status(client).state {
            now if now == state => return,
            RigState::Idle => Request::Engage { anyway: true },
            RigState::Stopped => Request::Reset {},
            _ => Request::Status {},
        };
        // Its state may have changed since.
        drop(client.request::<serde_json::Value>(next));
        assert!(began.elapsed() < PATIENCE, "waited in vain for {state}");
    }
}

/// Engages a rig, which is reset first if it is faulted. Anyway: on a busy machine a link is late, and what its scene
/// would do on a light rig behind a late link is no matter of those who only need force.
pub fn engage(client: &mut Client) {
    let engaged = try_to_engage(client);
    assert_eq!(engaged.state, RigState::Engaged, "{:?}", engaged.fault);
}

/// The same, to its end, which a busy machine may make a fault.
pub fn try_to_engage(client: &mut Client) -> Status {
    let before = wait_for(client, "a rig at rest", |status| {
        matches!(status.state, RigState::Idle | RigState::Faulted | RigState::Engaged)
    });
    if before.state == RigState::Faulted {
        let _: StateReply = client.request(Request::Reset {}).expect("its fault is over");
    }
    if before.state != RigState::Engaged {
        let _: StateReply = client.request(Request::Engage { anyway: true }).expect("it is idle");
    }
    wait_for(client, "the end of its ramp", |status| {
        !matches!(status.state, RigState::Idle | RigState::Engaging)
    })
}

/// Engages a rig and waits until it pulls, as somebody who can look at its motor says.
pub fn pull_until(client: &mut Client, mut pulls: impl FnMut(&Status) -> bool) {
    engage(client);
    let pulled = wait_for(client, "a force at the motor", |status| {
        pulls(status) || status.state != RigState::Engaged
    });
    assert_eq!(pulled.state, RigState::Engaged, "{:?}", pulled.fault);
}

/// The processors that this process may run on.
pub fn processors() -> Vec<usize> {
    processors_of(None)
}

/// The processors that a thread may run on.
pub fn processors_of(thread: Option<rustix::process::Pid>) -> Vec<usize> {
    let set = rustix::thread::sched_getaffinity(thread).expect("every thread has them");
    (0..rustix::thread::CpuSet::MAX_CPU)
        .filter(|cpu| set.is_set(*cpu))
        .collect()
}

/// All Rust files of the workspace's own crates and tests, and the tests of the Python package, from its root.
///
/// # Panics
/// They cannot be read.
pub fn sources(root: &Path) -> Vec<(String, String)> {
    let below = ["crates", "python/tests", "tests"].map(|folder| files(&root.join(folder)));
    let is_source = |path: &PathBuf| path.extension().is_some_and(|ending| ending == "rs" || ending == "py");
    let sources = below.into_iter().flatten().filter(is_source).map(|path| {
        let text = std::fs::read_to_string(&path).expect("a source");
        (plain(path.strip_prefix(root).expect("it lies below")).to_owned(), text)
    });
    sources.collect()
}
