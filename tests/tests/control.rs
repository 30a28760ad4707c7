//! The control plane of a running daemon: every operation, and every refusal, after which the loop goes on.

use haptic_ipc::{
    ChangeReply, Changes, ClientError, Description, ErrorCode, Event, MAX_LINE_BYTES, Request, RigState, SceneReply,
    StateReply, SubscribeReply, Timing, Topic,
};
use std::io::Write;
use system_tests::{Daemon, status, until, wait_for, wait_for_state};

fn set(changes: &[(&str, f64)]) -> Request {
    Request::set(changes.iter().copied().collect::<Changes>())
}

#[test]
fn change_reports_its_tick_and_reaches_both_clients() {
    let daemon = Daemon::start(&[]);
    let (mut one, mut other) = (daemon.client(), daemon.client());
    let description: Description = one.request(Request::Describe {}).expect("the table");
    assert!(
        description
            .parameters
            .iter()
            .any(|row| row.symbol == "Fs" && row.unit == "N")
    );
    let before = status(&mut other).tick;
    let reply: ChangeReply = one
        .request(set(&[
            ("mass", 1.5),
            ("Fs", 5.0),
            ("Fd", 3.5),
            ("b", 2.0),
            ("DV", 0.002),
        ]))
        .expect("a valid change");
    assert!(reply.tick.is_some_and(|tick| tick >= before), "{reply:?}");
    assert_eq!(reply.applied["static_force"], 5.0);
    let seen: SceneReply = other.request(Request::get()).expect("the scene");
    assert_eq!(
        (seen.revision, seen.scene.block.map(|block| block.mass)),
        (reply.revision, Some(1.5))
    );
    let reply: ChangeReply = other
        .request(set(&[("Fs+", 5.0), ("Fs-", 3.0)]))
        .expect("a valid change");
    assert!(
        reply.advice.iter().any(|advice| advice.param == "static_force-"),
        "Fs- lies below Fd: {reply:?}"
    );
    let seen: SceneReply = one.request(Request::get()).expect("the scene");
    assert_eq!(
        (
            seen.params["static_force"].positive,
            seen.params["static_force"].negative
        ),
        (5.0, 3.0)
    );
}

#[test]
fn engage_stop_and_reset_go_through_their_states() {
    let daemon = Daemon::start(&["--ramp-ms", "50"]);
    let mut client = daemon.client();
    assert_eq!(status(&mut client).state, RigState::Idle);
    let reply: StateReply = client.request(Request::engage()).expect("it is idle");
    assert_eq!(reply.state, RigState::Engaging);
    wait_for_state(&mut client, RigState::Engaged);
    wait_for(&mut client, "a force", |status| status.command_force_n.abs() > 1.0);

    // A stop may come from anybody.
    let stopped: StateReply = daemon.client().request(Request::Stop {}).expect("a stop always works");
    assert_eq!(stopped.state, RigState::Stopped);
    assert_eq!(status(&mut client).command_force_n, 0.0);
    let refused = client
        .request::<StateReply>(Request::engage())
        .expect_err("it is stopped");
    assert!(refused.to_string().contains("reset"), "{refused}");
    let idle: StateReply = client.request(Request::Reset {}).expect("it can be reset");
    assert_eq!(idle.state, RigState::Idle);
    assert_eq!(status(&mut client).command_force_n, 0.0, "a reset does not engage");

    let _: StateReply = client.request(Request::engage()).expect("it is idle");
    wait_for_state(&mut client, RigState::Engaged);
    let reply: StateReply = client.request(Request::Release {}).expect("it is engaged");
    assert_eq!(reply.state, RigState::Releasing);
    wait_for_state(&mut client, RigState::Idle);
}

#[test]
fn bad_requests_get_documented_errors_and_loop_goes_on() {
    let daemon = Daemon::start(&[]);
    let mut raw = daemon.raw();
    let mut watcher = daemon.client();
    for (line, code, named) in [
        ("this is not JSON", "bad_json", "JSON"),
        (r#"{"id":1,"op":"set","params":{"mass":NaN}}"#, "bad_json", "NaN"),
        (
            r#"{"id":1,"op":"set","params":{"mass":1e999}}"#,
            "bad_request",
            "out of range",
        ),
        (r#"{"id":1,"op":"get","colour":"red"}"#, "unknown_field", "colour"),
        (r#"{"id":1,"op":"dance"}"#, "unknown_op", "dance"),
        (r#"{"id":1,"op":3}"#, "bad_request", "op = 3"),
        (r#"{"id":-1,"op":"get"}"#, "bad_request", "id = -1"),
        (r#"{"id":1,"op":"set"}"#, "bad_request", "params"),
        (
            r#"{"id":1,"op":"set","params":{"mass":"heavy"}}"#,
            "bad_request",
            "mass",
        ),
        (
            r#"{"id":1,"op":"set","params":{"weight":1}}"#,
            "unknown_parameter",
            "weight",
        ),
        (r#"{"id":1,"op":"set","params":{"M+":1}}"#, "not_directional", "mass"),
        (
            r#"{"id":1,"op":"set","params":{"Fs":5,"static_force":6}}"#,
            "given_twice",
            "static_force",
        ),
        (r#"{"id":1,"op":"set","params":{"K":0,"B":0}}"#, "no_coupling", "N/m"),
        (
            r#"{"id":1,"op":"set","params":{"M":0.000001,"K":3e6,"B":0}}"#,
            "too_fast_for_rate",
            "raise mass",
        ),
        (
            r#"{"id":1,"op":"subscribe","topics":["samples"],"rate_hz":5000}"#,
            "out_of_range",
            "Hz",
        ),
        (
            r#"{"id":1,"op":"subscribe","topics":["samples"],"batch_ms":0}"#,
            "out_of_range",
            "ms",
        ),
    ] {
        let before = status(&mut watcher);
        let answer = raw.ask(line);
        assert_eq!(answer["error"]["code"], code, "{line}: {answer}");
        let message = answer["error"]["message"].as_str().expect("a message");
        assert!(message.contains(named), "{line}: {message} does not name {named}");
        let after = wait_for(&mut watcher, "another tick", |status| status.tick > before.tick);
        assert_eq!(after.revision, before.revision, "{line} changed the scene");
    }
    let answer = raw.ask(r#"{"id":2,"op":"set","params":{"Fs":5,"mass":-1}}"#);
    let error = &answer["error"];
    assert_eq!((&answer["id"], &error["code"]), (&2.into(), &"out_of_range".into()));
    for (field, value) in [("value", -1.0), ("min", 1e-6), ("max", 100.0)] {
        assert_eq!(error[field], value, "{answer}");
    }
    assert_eq!((&error["param"], &error["unit"]), (&"mass".into(), &"kg".into()));
    let scene: SceneReply = watcher.request(Request::get()).expect("the scene");
    assert_eq!(scene.params["static_force"].positive, 4.0, "all or nothing");
}

#[test]
fn unrepresentable_number_reports_same_limits_as_too_small_one() {
    let daemon = Daemon::start(&[]);
    let mut raw = daemon.raw();
    for (op, field, small, others) in [
        ("lease", "timeout_ms", 1, ["-1", "99999999999"]),
        ("subscribe", "batch_ms", 0, ["-1", "99999999999"]),
    ] {
        let mut ask = |value: &str| {
            let topics = if op == "subscribe" { r#","topics":[]"# } else { "" };
            raw.ask(&format!(r#"{{"id":1,"op":"{op}"{topics},"{field}":{value}}}"#))["error"].clone()
        };
        let small = ask(&small.to_string());
        for value in others {
            let other = ask(value);
            for name in ["code", "param", "min", "max", "unit"] {
                assert_eq!(other[name], small[name], "{field} = {value}: {other}");
            }
        }
    }
}

#[test]
fn an_overlong_line_is_refused_and_the_next_one_is_served() {
    let daemon = Daemon::start(&[]);
    let mut raw = daemon.raw();
    let padding = |length: usize| " ".repeat(length);
    let request = r#"{"id":1,"op":"get"}"#;
    let fits = format!("{request}{}", padding(MAX_LINE_BYTES - request.len()));
    assert_eq!(raw.ask(&fits)["id"], 1, "a line of exactly the limit is served");
    let answer = raw.ask(&format!("{fits} "));
    assert_eq!(
        (&answer["id"], &answer["error"]["code"]),
        (&serde_json::Value::Null, &"line_too_long".into())
    );
    assert_eq!(raw.ask(&padding(10 * MAX_LINE_BYTES))["error"]["code"], "line_too_long");
    assert_eq!(raw.ask(r#"{"id":3,"op":"get"}"#)["id"], 3);
    // Bytes that are no text are refused like any other line that is not JSON.
    raw.send(b"\xff\xfe\n");
    assert_eq!(raw.line()["error"]["code"], "bad_json");
    assert_eq!(raw.ask(r#"{"id":4,"op":"get"}"#)["id"], 4);
}

#[test]
fn client_dying_in_mid_request_leaves_no_trace() {
    let daemon = Daemon::start(&[]);
    let mut watcher = daemon.client();
    let before = status(&mut watcher);
    for _ in 0..50 {
        let mut raw = daemon.raw();
        raw.send(r#"{"id":1,"op":"set","params":{"mass":9"#);
        drop(raw);
        let mut raw = daemon.raw();
        raw.send("{\"id\":1,\"op\":\"subscribe\",\"topics\":[\"samples\",\"state\",\"timing\"]}\n");
        drop(raw);
    }
    let after = wait_for(&mut watcher, "the others to be gone", |status| status.clients == 1);
    assert_eq!(after.revision, before.revision);
    wait_for(&mut watcher, "another tick", |status| status.tick > after.tick);
}

#[test]
fn answers_come_in_the_order_of_the_questions() {
    let daemon = Daemon::start(&[]);
    let mut raw = daemon.raw();
    let burst: String = (1..=100)
        .map(|id| {
            format!(
                "{{\"id\":{id},\"op\":\"set\",\"params\":{{\"mass\":{}}}}}\n",
                0.1 * f64::from(id)
            )
        })
        .collect();
    raw.send(burst);
    let mut last_tick = 0;
    for id in 1..=100 {
        let answer = raw.line();
        assert_eq!(answer["id"], id, "{answer}");
        let tick = answer["ok"]["tick"].as_u64().expect("a tick");
        assert!(tick >= last_tick);
        last_tick = tick;
    }
}

#[test]
fn a_subscriber_gets_the_state_then_every_tick_in_order() {
    let daemon = Daemon::start(&["--hand", "arm"]);
    let mut client = daemon.client();
    let subscribe = Request::Subscribe {
        topics: vec![Topic::State, Topic::Samples, Topic::Timing],
        rate_hz: None,
        batch_ms: Some(5),
    };
    let reply: SubscribeReply = client.request(subscribe).expect("valid topics");
    assert_eq!(reply.columns, haptic_ipc::SAMPLE_COLUMNS);
    let mut other = daemon.client();
    let (mut states, mut ticks, mut next_seq) = (Vec::new(), Vec::new(), 0);
    let (mut timed, mut engaged) = (false, false);
    while ticks.len() < 1500 || !timed || states.len() < 3 {
        match client.next_event().expect("the daemon goes on") {
            Event::Unknown | Event::Servo(_) | Event::Snapshot(_) | Event::Log(_) => {
                panic!("a topic that nobody asked for")
            }
            Event::State(state) => states.push(state.state),
            Event::Timing(timing) => timed |= timing.since_start.ticks > 0,
            Event::Samples(batch) => {
                assert_eq!(batch.seq, next_seq);
                next_seq += 1;
                let before = ticks.last().copied();
                ticks.extend(batch.rows.iter().map(|row| row.tick));
                // Every tick, or it is counted as dropped.
                if let (Some(before), Some(now)) = (before, ticks.last()) {
                    assert_eq!(now - before, batch.rows.len() as u64 + batch.dropped, "{batch:?}");
                }
            }
        }
        if !engaged && ticks.len() > 200 {
            let _: StateReply = other.request(Request::engage()).expect("it is idle");
            engaged = true;
        }
    }
    assert!(ticks.windows(2).all(|pair| pair[0] < pair[1]), "in order");
    assert_eq!(states[..3], [RigState::Idle, RigState::Engaging, RigState::Engaged]);

    // Thinned, and then not at all.
    let thinned = Request::Subscribe {
        topics: vec![Topic::Samples],
        rate_hz: Some(100.0),
        batch_ms: Some(20),
    };
    let reply: SubscribeReply = other.request(thinned).expect("a valid rate");
    assert_eq!(reply.rate_hz, 100.0);
    let Event::Samples(batch) = other.next_event().expect("samples") else {
        panic!("only samples were asked for");
    };
    assert!(
        batch.rows.windows(2).all(|pair| pair[1].tick == pair[0].tick + 10),
        "{batch:?}"
    );
}

#[test]
fn the_timing_adds_up() {
    let daemon = Daemon::start(&[]);
    let mut client = daemon.client();
    wait_for(&mut client, "1000 ticks", |status| status.tick >= 1000);
    let before = status(&mut client);
    let timing: Timing = client.request(Request::Timing {}).expect("a timing");
    let after = status(&mut client);
    assert_eq!(timing.rate_hz, 1000.0);
    let all = timing.since_start;
    // Ticks and skipped deadlines fill the time that has passed.
    let [least, most] = [before, after].map(|status| status.uptime_s * 1000.0);
    let counted = (all.ticks + all.missed_periods) as f64;
    assert!(
        counted > 0.95 * least - 50.0 && counted < 1.05 * most + 50.0,
        "{counted} of {least} to {most}: {all:?}"
    );
    assert!(all.tick_ns.p50 > 0 && all.tick_ns.p50 < 1_000_000, "{all:?}");
    assert!((900_000..1_100_000).contains(&all.period_ns.p50), "{all:?}");
}

#[test]
fn a_client_that_never_reads_is_cut_off_and_disturbs_nobody() {
    let daemon = Daemon::start(&["--rate", "4000"]);
    let mut deaf = daemon.raw();
    deaf.send("{\"id\":1,\"op\":\"subscribe\",\"topics\":[\"samples\"],\"batch_ms\":1}\n");
    let mut client = daemon.client();
    wait_for(&mut client, "the deaf client to be gone", |status| status.clients == 1);
    let timing: Timing = client.request(Request::Timing {}).expect("a timing");
    assert_eq!(timing.since_start.telemetry_dropped, 0);
}

#[test]
fn the_33rd_client_may_stop_and_is_told_why_it_may_do_no_more() {
    let daemon = Daemon::start(&[]);
    let clients: Vec<_> = (0..32).map(|_| daemon.client()).collect();
    let mut extra = daemon.client();
    let refused = extra
        .request::<Timing>(Request::Timing {})
        .expect_err("there is no place");
    let ClientError::Refused(error) = &refused else {
        panic!("{refused}");
    };
    assert_eq!(error.code, ErrorCode::TooManyClients);
    assert!(error.message.contains("32"), "{error}");
    let stopped: StateReply = extra.request(Request::Stop {}).expect("a stop always works");
    assert_eq!(stopped.state, RigState::Stopped);
    assert_eq!(daemon.ctl(&["stop"]).status.code(), Some(0));
    drop(extra);
    drop(clients);
    // The daemon notices the hang-ups one by one.
    until("places are given back", || {
        daemon.client().request::<Timing>(Request::Timing {}).is_ok()
    });
}

#[test]
fn a_stop_with_a_mistake_in_it_still_stops() {
    let daemon = Daemon::start(&[]);
    let mut raw = daemon.raw();
    let answer = raw.ask(r#"{"id":1,"op":"stop","why":"fire"}"#);
    assert_eq!(answer["error"]["code"], "unknown_field", "{answer}");
    wait_for_state(&mut daemon.client(), RigState::Stopped);
}

#[test]
fn ten_lines_of_anything_can_drive_it() {
    // No library: what a shell with nc would send and read.
    let daemon = Daemon::start(&[]);
    let mut stream = std::os::unix::net::UnixStream::connect(daemon.socket()).expect("the daemon serves");
    stream
        .write_all(b"{\"id\":1,\"op\":\"engage\"}\n\n{\"id\":2,\"op\":\"stop\"}\n")
        .expect("it reads");
    stream.shutdown(std::net::Shutdown::Write).expect("no more is said");
    let mut text = String::new();
    std::io::Read::read_to_string(&mut stream, &mut text).expect("it answers and closes");
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines.len(), 3, "{text}");
    assert!(
        lines[0].starts_with("{\"hello\":{\"protocol\":1,\"server\":\"hapticd "),
        "{text}"
    );
    assert!(
        lines[2].starts_with("{\"id\":2,\"ok\":{\"state\":\"stopped\",\"tick\":"),
        "{text}"
    );
}

#[test]
fn a_stop_overtakes_what_the_same_client_asked_before() {
    let daemon = Daemon::start(&["--rate", "100"]);
    let mut raw = daemon.raw();
    // Each `release` takes a tick of 10 ms; the stop is read long before its turn to be answered.
    let mut burst: String = (1..=200)
        .map(|id| format!("{{\"id\":{id},\"op\":\"release\"}}\n"))
        .collect();
    burst.push_str("{\"id\":201,\"op\":\"stop\"}\n");
    raw.send(burst);
    let answers: Vec<serde_json::Value> = (1..=201)
        .map(|id| {
            let answer = raw.line();
            assert_eq!(answer["id"], id, "{answer}");
            answer
        })
        .collect();
    assert_eq!(answers[200]["ok"]["state"], "stopped");
    let overtaken = answers[..200]
        .iter()
        .filter(|answer| answer["error"]["code"] == "stopped");
    let overtaken = overtaken.count();
    // How many are answered before it is read, the machine decides.
    assert!(overtaken > 0, "the stop came last");
}

#[test]
fn a_reset_asked_before_a_stop_does_not_clear_it() {
    let daemon = Daemon::start(&[]);
    let mut raw = daemon.raw();
    for _ in 0..20 {
        let _ = raw.ask(r#"{"id":1,"op":"stop"}"#);
        raw.send("{\"id\":2,\"op\":\"reset\"}\n{\"id\":3,\"op\":\"engage\"}\n{\"id\":4,\"op\":\"stop\"}\n");
        let answers = [raw.line(), raw.line(), raw.line()];
        assert_eq!(answers[2]["ok"]["state"], "stopped", "{answers:?}");
        assert_eq!(status(&mut daemon.client()).state, RigState::Stopped, "{answers:?}");
    }
}
