//! The protocol's JSON schema is that of the types, and tells a line of the protocol from one that is none.

use haptic_ipc::{JournalEntry, RigState};
use haptic_recording::Mark;
use haptic_recording::mcap::MARK_SCHEMA;
use serde_json::{Value, json};
use std::collections::BTreeSet;
use std::fs;
use std::path::Path;
use system_tests::schema::{Part, Validator};
use system_tests::{ctl_offline, reference, text};

#[test]
fn haptic_ctl_prints_the_schema_of_the_types() {
    let output = ctl_offline(&["raw", "--schema"]);
    let printed: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(printed, haptic_ipc::schema::protocol());
    let text = text(&output.stdout);
    assert!(!text.contains("[`"), "a link that leads nowhere");
}

#[test]
fn the_page_has_the_reference_of_the_types() {
    let page = concat!(env!("CARGO_MANIFEST_DIR"), "/../docs/control.md");
    let kept = fs::read_to_string(page).expect("it is there");
    let [begins, ends] = reference::MARKS;
    let (before, rest) = kept.split_once(begins).expect("where it begins");
    let (_, after) = rest.split_once(ends).expect("where it ends");
    let drawn = reference::draw(&haptic_ipc::schema::protocol());
    let drawn = format!("{before}{begins}\n\n{drawn}\n{ends}{after}");
    if std::env::var_os("HAPTICD_UPDATE_SCHEMA").is_some() {
        fs::write(page, &drawn).expect("it can be written");
        return;
    }
    assert!(
        kept == drawn,
        "the reference in docs/control.md is stale; draw it again with `HAPTICD_UPDATE_SCHEMA=1 cargo test -p \
         system-tests schema::`"
    );
}

#[test]
fn schema_and_daemon_accept_the_same_requests() {
    let Some(request) = Validator::of(Part::Request) else {
        return;
    };
    for line in [
        json!({"id":1,"op":"get"}),
        json!({"id":1,"op":"get","scene":7}),
        json!({"id":1,"op":"set","params":{"mass":1.5,"Fs":{"positive":5,"negative":3},"Fs-":2},"if_revision":4,"ramp_ms":50,"dry_run":true}),
        json!({"id":1,"op":"scene.load","scene":{"friction":{"law":"viscous","b":2}}}),
        json!({"id":1,"op":"scene.load","scene":{"name":"x","block":{"M":0.5},"coupling":{"K":1000,"damping":1},"friction":{"law":"karnopp","Fs":4,"Fd":3.5,"reseat":"published"}}}),
        json!({"id":1,"op":"subscribe","topics":["state","log"],"rate_hz":100}),
        json!({"id":1,"op":"lease","timeout_ms":500}),
        json!({"id":1,"op":"schedule","changes":[{"at_tick":5,"params":{"Fs":5},"ramp_ms":50},{"at_tick":6,"scene":"lugre"}]}),
        json!({"id":1,"op":"devices","probe":"serial:rig"}),
    ] {
        haptic_ipc::Envelope::parse(&line.to_string()).unwrap_or_else(|error| panic!("{line}: {error:?}"));
        request.check(&line).unwrap_or_else(|error| panic!("{error}"));
    }
    for line in [
        json!({"id":1,"op":"get","colour":"red"}),
        json!({"id":-1,"op":"get"}),
        json!({"op":"get"}),
        json!({"id":1,"op":"dance"}),
        json!({"id":1,"op":"set"}),
        json!({"id":1,"op":"set","params":{"mass":"heavy"}}),
        json!({"id":1,"op":"set","params":{"Fs":{"positive":5}}}),
        json!({"id":1,"op":"scene.load","scene":{"friction":{"law":"viscous","b":2,"viscous":2}}}),
        json!({"id":1,"op":"scene.load","scene":{"friction":{"law":"viscous","b":2,"Fs":2}}}),
        json!({"id":1,"op":"scene.load","scene":{"friction":{"law":"viscous"}}}),
        json!({"id":1,"op":"scene.load","scene":{"friction":{"law":"sticky"}}}),
        json!({"id":1,"op":"subscribe","topics":["weather"]}),
        json!({"id":1,"op":"schedule","changes":[{"at_tick":5,"params":{},"colour":"red"}]}),
        json!({"id":1,"op":"schedule","changes":[{"at_tick":5}]}),
        json!({"id":1,"op":"schedule","changes":[{"at_tick":5,"params":{},"scene":1}]}),
        json!({"id":1,"op":"schedule","changes":[{"at_tick":5,"params":{},"ramp_ms":20000}]}),
    ] {
        haptic_ipc::Envelope::parse(&line.to_string()).expect_err(&line.to_string());
        request.check(&line).expect_err("the daemon refuses it");
    }
}

#[test]
fn what_a_later_server_says_is_in_the_schema() {
    let Some(server) = Validator::of(Part::Server) else {
        return;
    };
    for line in [
        json!({"hello":{"protocol":1,"server":"hapticd 9","session":"1-1","motto":"more"}}),
        json!({"id":1,"ok":{"state":"idle","tick":3,"more":1},"took_ns":5}),
        json!({"id":null,"error":{"code":"bad_json","message":"no","hint":"more"}}),
        json!({"event":"samples","seq":0,"dropped":0,"rows":[[1,0.001,"idle",0,0.0,0.0,0.0,0.0,0.0,0.0,1,5,5,0,1000000,7,8,0.0,0,0,"more"],[2,0.002,"idle",0,null,null,null,null,0.0,0.0,1,5,5,0,1000000,7,8,null,0,0]]}),
    ] {
        server.check(&line).unwrap_or_else(|error| panic!("{error}"));
    }
    let none: [Value; 3] = [
        json!({"id":1}),
        json!({"event":"samples","seq":0,"dropped":0,"rows":[[1,0.001,"idle"]]}),
        json!({"id":1,"error":{"message":"no code"}}),
    ];
    for line in none {
        server.check(&line).expect_err("no server says it");
    }
}

#[test]
fn the_schema_of_a_recordings_marks_is_that_of_the_marks() {
    let schema: Value = serde_json::from_str(MARK_SCHEMA).expect("JSON");
    let validator = Validator::of_schema(&schema);
    let (tick, text) = (1, String::from("text"));
    let fixture = concat!(env!("CARGO_MANIFEST_DIR"), "/fixtures/recording-of-servo-3.mcap");
    let recorded = haptic_recording::read(Path::new(fixture)).expect("the fixture");
    // The recording has scenes, states, entries of the journal and snapshots.
    let servo = Mark::Servo {
        tick,
        servo: Box::new(recorded.metadata.servo.expect("the settings")),
    };
    let faulted = Mark::State {
        tick,
        state: RigState::Faulted,
        fault: Some(text.clone()),
    };
    let mut kinds = BTreeSet::new();
    for mark in recorded.marks.into_iter().map(|(_, mark)| mark).chain([
        servo,
        faulted,
        Mark::Journal {
            tick,
            entry: Box::new(JournalEntry::of("engage")),
        },
        Mark::Lost { rows: 1 },
        Mark::LostChanges { changes: 1 },
        Mark::Missed { tick, periods: 2 },
        Mark::Marker {
            tick,
            text: text.clone(),
        },
        Mark::Link { tick, text },
        Mark::End {
            rows: 1,
            lost: 2,
            missed: 3,
        },
    ]) {
        let value = serde_json::to_value(&mark).expect("JSON");
        kinds.insert(value["mark"].to_string());
        for (name, _) in value.as_object().expect("an object") {
            assert!(schema["properties"].get(name).is_some(), "{name}");
        }
        if let Some(validator) = &validator {
            validator.check(&value).unwrap_or_else(|error| panic!("{error}"));
        }
    }
    // What serde would take, in its own words: no kind is left out here or there.
    let weather = json!({ "mark": "weather" });
    let expected = serde_json::from_value::<Mark>(weather.clone()).expect_err("no such mark");
    let expected = expected.to_string();
    let expected: BTreeSet<String> = expected
        .split('`')
        .skip(3)
        .step_by(2)
        .map(|kind| format!("\"{kind}\""))
        .collect();
    let listed = schema["properties"]["mark"]["enum"].as_array().expect("a list");
    assert_eq!(kinds, expected);
    assert_eq!(listed.iter().map(Value::to_string).collect::<BTreeSet<_>>(), expected);
    if let Some(validator) = validator {
        validator.check(&weather).expect_err("there is no such mark");
    }
}
