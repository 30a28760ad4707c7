//! The command line beside the protocol: lines that are sent as they are, and what shells and readers get.

use crate::book_reference::subcommands;
use serde_json::{Value, json};
use std::io::Write;
use std::path::Path;
use std::process::{Output, Stdio};
use system_tests::sources;
use system_tests::{Daemon, ctl_command, ctl_offline, ctl_offline_refused, text};

fn lines(text: &str) -> Vec<Value> {
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap_or_else(|error| panic!("{line}: {error}")))
        .collect()
}

#[test]
fn raw_lines_go_verbatim_and_first_refusal_sets_exit_code() {
    let daemon = Daemon::start(&[]);
    let raw = |input: &str| -> Output {
        let mut raw = ctl_command(daemon.socket(), &["raw"]);
        let mut child = raw.stdin(Stdio::piped()).spawn().expect("haptic-ctl starts");
        let mut stdin = child.stdin.take().expect("it is piped");
        stdin.write_all(input.as_bytes()).expect("it reads");
        drop(stdin);
        child.wait_with_output().expect("it ends")
    };
    let output = raw("{\"op\":\"status\"}\n\n{\"id\":70,\"op\":\"get\"}\n{\"op\":\"stop\"}");
    assert_eq!(output.status.code(), Some(0));
    let answers = lines(&text(&output.stdout));
    let ids: Vec<&Value> = answers.iter().map(|answer| &answer["id"]).collect();
    assert_eq!(ids, [&json!(1), &json!(70), &json!(2)]);
    assert_eq!(answers[2]["ok"]["state"], "stopped");
    for (input, code) in [
        (r#"{"op":"set","params":{"mass":-1}}"#, 1),
        (r#"{"op":"engage"}"#, 6),
        ("not json", 2),
        (r#"{"op":"dance"}"#, 1),
    ] {
        let output = daemon.ctl(&["raw", r#"{"op":"get"}"#, input, r#"{"op":"status"}"#]);
        assert_eq!(output.status.code(), Some(code), "{input}");
        let answers = lines(&text(&output.stdout));
        assert_eq!(answers.len(), 3, "the conversation goes on: {answers:?}");
        assert!(!answers[1]["error"]["message"].is_null());
    }
    ctl_offline_refused(&["raw", "{}"], 3, &[]);
}

#[test]
fn a_shell_completes_parameters_scenes_and_subcommands() {
    let daemon = Daemon::start(&[]);
    for (shell, mark) in [("bash", "complete "), ("zsh", "compdef"), ("fish", "complete ")] {
        let script = daemon.ctl_ok(&["completions", shell]);
        assert!(
            script.contains(mark) && script.contains("haptic-ctl"),
            "{shell}: {script}"
        );
    }
    let complete = |words: &[&str]| {
        let output = ctl_command(daemon.socket(), &[&["--"], words].concat())
            .env("COMPLETE", "bash")
            .env("_CLAP_IFS", "\n")
            .env("_CLAP_COMPLETE_INDEX", (words.len() - 1).to_string())
            .env("_CLAP_COMPLETE_COMP_TYPE", "9")
            .env("_CLAP_COMPLETE_SPACE", "true")
            .output()
            .expect("haptic-ctl starts");
        text(&output.stdout).lines().map(str::to_owned).collect::<Vec<_>>()
    };
    for (line, completed) in [
        ("set vel", "velocity_threshold="),
        ("set Fs", "Fs= Fs+= Fs-="),
        ("scene load visc", "viscous-drag"),
        ("wait --until device_v", "device_velocity_mps device_velocity_y_mps"),
        ("sce", "scene"),
        ("scene d", "delete diff"),
    ] {
        let words: Vec<&str> = ["haptic-ctl"].into_iter().chain(line.split(' ')).collect();
        assert_eq!(complete(&words).join(" "), completed);
    }
}

/// But `accuracy`, which takes minutes.
#[test]
fn every_subcommand_is_typed_by_a_test() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("..");
    let is_here = |(path, _): &(String, String)| path.starts_with("tests/tests/");
    let sources: Vec<String> = sources(&root)
        .into_iter()
        .filter(is_here)
        .map(|(_, source)| source)
        .collect();
    let help = text(&ctl_offline(&["--help"]).stdout);
    for name in subcommands(&help).iter().filter(|name| *name != "accuracy") {
        let is_typed = |source: &String| ["\"", " "].iter().any(|end| source.contains(&format!("\"{name}{end}")));
        assert!(sources.iter().any(is_typed), "no test types {name}");
    }
}
