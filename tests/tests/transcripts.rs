//! Whole conversations in version 1 of the protocol, as they once went, held again with today's
//! daemon. They are never changed: a daemon that cannot hold one any more has changed the protocol.

use serde_json::Value;
use std::collections::BTreeSet;
use system_tests::reference::MARKS;
use system_tests::timed;
use system_tests::transcript::{Message, Transcript};

#[test]
fn every_conversation_of_the_page_can_be_held() {
    let page = include_str!("../../docs/control.md");
    let (prose, _) = page.split_once(MARKS[0]).expect("a reference at its end");
    let conversations: Vec<&str> = prose
        .split("```text\n")
        .skip(1)
        .filter_map(|block| block.split_once("```").map(|(block, _)| block))
        .filter(|block| block.starts_with("# "))
        .collect();
    assert_eq!(conversations.len(), 2, "each begins with a remark");
    for conversation in conversations {
        let held = Transcript::parse(conversation).replay();
        held.unwrap_or_else(|why| panic!("{conversation}{why}"));
    }
}

#[test]
fn every_conversation_of_version_1_can_still_be_held() {
    let transcripts = Transcript::all();
    assert!(!transcripts.is_empty());
    for (name, transcript) in &transcripts {
        let hold = || transcript.replay().unwrap_or_else(|why| panic!("{name}, {why}"));
        if name == "all-places-taken.txt" {
            // It is served for a tenth of a second.
            timed("a newcomer beyond the full house", hold);
        } else {
            hold();
        }
    }
}

/// Codes that no conversation alone can bring about, and the tests that do.
const ELSEWHERE: [(&str, &str); 17] = [
    ("config_file", "reload.rs, with a wrong file"),
    ("not_permitted", "attacks.rs, as another user"),
    (
        "not_confirmed",
        "safety.rs, with a device that does not say that its motor is off",
    ),
    ("no_force", "control/admission.rs of hapticd"),
    ("no_watchdog", "control/admission.rs of hapticd"),
    ("no_button", "control/admission.rs of hapticd"),
    ("commands_late", "link.rs, on a line that carries less"),
    ("commands_ignored", "link.rs, with a device that takes none"),
    ("not_commissioned", "commission.rs, with a rig of one's own"),
    (
        "maybe_another_rig",
        "commission.rs, with a board without a serial number",
    ),
    ("device_clock", "link_health.rs, with a clock that lies"),
    ("not_identified", "rig_friction.rs, with --compensate"),
    ("would_chatter", "chatter.rs, with a light rig"),
    (
        "state_file",
        "commission.rs, where a file stands in the directory's place",
    ),
    ("no_device", "link.rs, with its device unplugged"),
    ("hand_held", "control/hand.rs of hapticd, by a clock that is handed in"),
    ("not_responding", "attacks.rs, with its real-time thread held"),
];

#[test]
fn they_have_every_operation_every_topic_and_every_error_code() {
    let (mut ops, mut topics, mut codes) = (BTreeSet::new(), BTreeSet::new(), BTreeSet::new());
    for (_, transcript) in Transcript::all() {
        let mut asked: Vec<(String, Value)> = Vec::new();
        for (connection, message, _) in transcript.lines {
            match message {
                Message::Client(line) | Message::Poll(line) => {
                    asked.extend(serde_json::from_str(&line).ok().map(|line| (connection, line)));
                }
                Message::Server(line) => {
                    if let Some(event) = line["event"].as_str() {
                        topics.insert(event.to_owned());
                    } else if let Some(code) = line["error"]["code"].as_str() {
                        codes.insert(code.to_owned());
                    } else if line.get("ok").is_some() {
                        let answers =
                            |(by, request): &&(String, Value)| *by == connection && request["id"] == line["id"];
                        let request = asked.iter().rev().find(answers);
                        ops.extend(request.and_then(|(_, request)| Some(request["op"].as_str()?.to_owned())));
                    }
                }
            }
        }
    }
    let schema = haptic_ipc::schema::protocol();
    let definitions = &schema["$defs"];
    let mut wanted: BTreeSet<String> = definitions["Answers"]
        .as_object()
        .expect("answers")
        .keys()
        .cloned()
        .collect();
    // plane.rs, with a rig of two axes behind a link.
    assert!(wanted.remove("home"));
    assert_eq!(ops, wanted, "operations that are answered `ok`");
    assert_eq!(
        topics,
        words(&definitions["FromClient"]["Topic"]),
        "topics that are received"
    );
    let mut wanted = words(&definitions["FromServer"]["ErrorCode"]);
    wanted.retain(|code| !ELSEWHERE.iter().any(|(elsewhere, _)| elsewhere == code));
    assert_eq!(codes, wanted, "error codes");
}

/// The words that a definition lists.
fn words(definition: &Value) -> BTreeSet<String> {
    let each = definition["oneOf"].as_array().expect("a list of words");
    each.iter()
        .map(|word| word["const"].as_str().expect("a word").to_owned())
        .collect()
}
