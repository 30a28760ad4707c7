//! Dialogs of a desktop without a portal: a bus in a thread, asked by the real library in a process.

use super::*;
use crate::intent::Format;
use std::io::{BufRead as _, BufReader, Read, Write as _};
use std::os::unix::net::{UnixListener, UnixStream};
use std::process::Command;
use std::thread;

/// A message of D-Bus, in its little-endian form.
#[derive(Default)]
struct Message(Vec<u8>);

impl Message {
    fn align(&mut self, to: usize) {
        self.0.resize(self.0.len().next_multiple_of(to), 0);
    }

    fn number(&mut self, number: usize) {
        self.align(4);
        let number = u32::try_from(number).expect("it is small");
        self.0.extend(number.to_le_bytes());
    }

    fn text(&mut self, text: &str) {
        self.number(text.len());
        self.0.extend(text.as_bytes());
        self.0.push(0);
    }

    fn signature(&mut self, signature: &str) {
        self.0.push(u8::try_from(signature.len()).expect("it is short"));
        self.0.extend(signature.as_bytes());
        self.0.push(0);
    }
}

/// A whole message of a kind (2: a reply, 3: an error) with fields of its header and a body.
fn message(kind: u8, fields: &[(u8, &str, &str)], reply_to: usize, body: &Message) -> Vec<u8> {
    let mut header = Message::default();
    for (code, signature, value) in fields {
        header.align(8);
        header.0.push(*code);
        header.signature(signature);
        match *signature {
            "g" => header.signature(value),
            _ => header.text(value),
        }
    }
    header.align(8);
    header.0.push(5);
    header.signature("u");
    header.number(reply_to);
    let mut whole = Message(vec![b'l', kind, 1, 1]);
    whole.number(body.0.len());
    whole.number(1);
    whole.number(header.0.len());
    whole.0.extend(&header.0);
    whole.align(8);
    whole.0.extend(&body.0);
    whole.0
}

/// A message's serial, and all of it. `None` when the client has gone.
fn receive(stream: &mut impl Read) -> Option<(usize, Vec<u8>)> {
    let mut fixed = [0; 16];
    stream.read_exact(&mut fixed).ok()?;
    let number = |at: usize| u32::from_le_bytes([fixed[at], fixed[at + 1], fixed[at + 2], fixed[at + 3]]) as usize;
    let mut rest = vec![0; number(12).next_multiple_of(8) + number(4)];
    stream.read_exact(&mut rest).ok()?;
    Some((number(8), rest))
}

fn contains(bytes: &[u8], part: &str) -> bool {
    bytes.windows(part.len()).any(|window| window == part.as_bytes())
}

/// A bus without a portal on it, for one client.
fn serve(stream: UnixStream) -> Option<()> {
    let mut input = BufReader::new(stream.try_clone().expect("a socket"));
    let mut out = stream;
    let mut line = String::new();
    while !line.ends_with("BEGIN\r\n") {
        line.clear();
        input.read_line(&mut line).ok()?;
        let reply = match line.trim_start_matches('\0') {
            auth if auth.starts_with("AUTH") => "OK 0123456789abcdef0123456789abcdef\r\n",
            begin if begin.starts_with("BEGIN") => "",
            _ => "ERROR\r\n",
        };
        out.write_all(reply.as_bytes()).ok()?;
    }
    const CLIENT: (u8, &str, &str) = (6, "s", ":1.1");
    const TEXT: (u8, &str, &str) = (8, "g", "s");
    const ERROR: (u8, &str, &str) = (4, "s", "org.freedesktop.DBus.Error.ServiceUnknown");
    loop {
        let (serial, text) = receive(&mut input)?;
        let mut body = Message::default();
        let reply = if contains(&text, "Hello") {
            body.text(":1.1");
            message(2, &[CLIENT, TEXT], serial, &body)
        } else if contains(&text, "org.freedesktop.portal.FileChooser") {
            body.text("The name is not activatable");
            message(3, &[CLIENT, ERROR, TEXT], serial, &body)
        } else {
            message(2, &[CLIENT], serial, &body)
        };
        out.write_all(&reply).ok()?;
    }
}

/// The answer of a process of its own that asks for a file by this bus: libdbus reads its address from the environment.
fn asked(has_bus: bool) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("bus");
    let mut child = Command::new(std::env::current_exe().expect("a program"));
    child.args(["--exact", "dialogs::tests::asks", "--ignored", "--nocapture"]);
    // There is no other program for dialogs either.
    child.env("PATH", folder.path()).env_remove("DBUS_SESSION_BUS_ADDRESS");
    child.env("XDG_RUNTIME_DIR", folder.path());
    if has_bus {
        child.env("DBUS_SESSION_BUS_ADDRESS", format!("unix:path={}", path.display()));
        let bus = UnixListener::bind(&path).expect("a socket");
        let serve_one = |stream| thread::spawn(move || serve(stream));
        thread::spawn(move || bus.incoming().flatten().map(serve_one).for_each(drop));
    }
    let output = child.output().expect("it runs").stdout;
    let output = String::from_utf8(output).expect("a text");
    let line = output.lines().find_map(|line| line.split_once("asked: "));
    line.unwrap_or_else(|| panic!("{output}")).1.to_owned()
}

#[test]
#[ignore = "the part of the test below that runs in a process of its own"]
fn asks() {
    let chosen = ask(DialogPurpose::Recording, Path::new("/tmp"));
    assert_eq!(
        chosen.is_ok(),
        ask(DialogPurpose::Export(Format::Svg), Path::new("/nowhere/at/all")).is_ok()
    );
    println!("asked: {chosen:?}");
}

#[test]
fn a_dialog_that_cannot_be_opened_says_why() {
    if !["/lib", "/usr/lib", "/lib64", "/usr/lib64"]
        .iter()
        .any(|folder| has_libdbus(Path::new(folder), 2))
    {
        test_run::skip("libdbus", "Debian: apt install libdbus-1-3");
        return;
    }
    let why = asked(true);
    assert!(why.contains("ServiceUnknown") && why.contains("zenity"), "{why}");
    let why = asked(false);
    assert!(why.contains("no message bus"), "{why}");
}

/// A dialog that was closed complains of nothing.
#[test]
fn only_the_library_of_dialogs_is_heard_while_one_is_open() {
    let say = |target: &str| log::error!(target: target, "{target} complains");
    say("rfd");
    let (done, complaints) = Complaints::during(|| {
        say("egui");
        say("rfd::backend");
        7
    });
    assert_eq!((done, complaints.join("; ").as_str()), (7, "rfd::backend complains"));
    assert_eq!(Complaints::during(|| ()).1, [""; 0]);
}

/// Whether a folder or one below it has the library.
fn has_libdbus(folder: &Path, depth: u8) -> bool {
    let Ok(found) = std::fs::read_dir(folder) else {
        return false;
    };
    found.flatten().any(|entry| {
        let is_it = entry.file_name() == "libdbus-1.so.3";
        is_it || (depth > 1 && entry.path().is_dir() && has_libdbus(&entry.path(), depth - 1))
    })
}
