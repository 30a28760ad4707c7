//! Dialogs of a desktop that has none to open: the real library is asked, in a process.

use super::*;
use crate::intent::Format;
use std::process::Command;

/// The answer of a process of its own that asks for a file, with the address of a bus that nobody serves or without
/// any: libdbus reads it from the environment.
fn asked(has_bus: bool) -> String {
    let folder = tempfile::tempdir().expect("a folder");
    let mut child = Command::new(std::env::current_exe().expect("a program"));
    child.args(["--exact", "dialogs::tests::asks", "--ignored", "--nocapture"]);
    // There is no other program for dialogs either.
    child.env("PATH", folder.path()).env_remove("DBUS_SESSION_BUS_ADDRESS");
    child.env("XDG_RUNTIME_DIR", folder.path());
    if has_bus {
        let bus = folder.path().join("bus");
        child.env("DBUS_SESSION_BUS_ADDRESS", format!("unix:path={}", bus.display()));
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
    let why = asked(true);
    // Of the portal, and of the program in its place.
    assert!(
        why.contains("opened: ") && why.contains("; ") && why.contains("zenity"),
        "{why}"
    );
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
