//! What the panel copies as a command of haptic-ctl makes the same change again.

use haptic_ipc::{ChangeOptions, ChangeReply, Client, JournalEntry, Request, SceneListReply, SceneRef, SceneReply};
use std::path::Path;
use std::process::Command;
use system_tests::{Daemon, binary, journal, stderr};

fn set(client: &mut Client, params: &[(&str, f64)], ramp_ms: Option<f64>) {
    let request = Request::Set {
        params: params.iter().copied().collect(),
        merge: false,
        options: ChangeOptions {
            ramp_ms,
            ..ChangeOptions::default()
        },
    };
    client.request::<ChangeReply>(request).expect("changed");
}

fn scene(client: &mut Client) -> haptic_core::Scene {
    client.request::<SceneReply>(Request::get()).expect("a scene").scene
}

/// The commands of all changes.
fn copied(client: &mut Client) -> Vec<String> {
    let library: SceneListReply = client.request(Request::SceneList {}).expect("a library");
    let commands = |entry: JournalEntry| entry.command(&library.scenes);
    journal(client).into_iter().filter_map(commands).collect()
}

/// Runs a command as a shell does.
fn run(command: &str, socket: &Path) {
    let ctl = binary("haptic-ctl");
    let folder = ctl.parent().expect("a folder").display();
    let path = format!("{folder}:{}", std::env::var("PATH").unwrap_or_default());
    let output = Command::new("sh")
        .args(["-c", command])
        .env("PATH", path)
        .env("HAPTICD_SOCKET", socket)
        .output()
        .expect("it runs");
    let why = stderr(&output);
    assert!(output.status.success(), "{command}: {why}");
}

#[test]
fn copied_commands_lead_another_daemon_to_the_same_scene() {
    let (first, second) = (Daemon::start(&[]), Daemon::start(&[]));
    let (mut client, mut other) = (first.client(), second.client());
    let begin = scene(&mut other);
    let load = Request::load(SceneRef::Name("high-stiction".to_owned()));
    client.request::<ChangeReply>(load).expect("loaded");
    set(&mut client, &[("mass", 1.25)], Some(20.0));
    set(&mut client, &[("Fs+", 5.5), ("Fs-", 4.25)], None);
    set(&mut client, &[("mass", 2.0), ("K", 12345.678)], None);
    client.request::<ChangeReply>(Request::undo()).expect("undone");
    let commands = copied(&mut client);
    assert_eq!(commands.len(), 5, "{commands:?}");
    for command in &commands {
        run(command, second.socket());
    }
    let wanted = scene(&mut client);
    assert_ne!(wanted, begin);
    assert_eq!(scene(&mut other), wanted, "{commands:?}");
}
