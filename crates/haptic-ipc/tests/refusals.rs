//! Every way in which a line can be wrong is refused with the field, the value, the limits, the
//! unit and a guess, in plain words.

use haptic_ipc::ErrorCode::{BadJson, BadRequest, GivenTwice, OutOfRange, UnknownField, UnknownOp};
use haptic_ipc::{BadLine, Envelope, WireError};
use proptest::prelude::*;

fn refused(line: &str) -> WireError {
    Envelope::parse(line).expect_err(line).error
}

/// Words of the language that the daemon is written in, and of its libraries.
fn is_plain(message: &str) -> bool {
    let jargon = [
        "u64",
        "u32",
        "f64",
        "usize",
        "struct",
        "variant",
        "enum",
        "invalid type",
        "line 1",
        "column",
        "sequence",
    ];
    jargon.iter().all(|word| !message.contains(word))
}

#[test]
fn every_field_that_is_wrong_is_named_with_its_value_and_what_is_expected() {
    for (fields, code, param, parts) in [
        (
            r#""op":"set","params":{},"ramp_ms":"x""#,
            BadRequest,
            "ramp_ms",
            &[r#"ramp_ms = "x" is not a number of ms"#][..],
        ),
        (
            r#""op":"set","params":{},"ramp_ms":1e400"#,
            BadRequest,
            "ramp_ms",
            &["ramp_ms = 1e400 ms is out of range"],
        ),
        (
            r#""op":"set","params":{},"if_revision":-1"#,
            OutOfRange,
            "if_revision",
            &["if_revision = -1 is out of range: it must be from 0"],
        ),
        (
            r#""op":"set","params":{},"if_revision":1.5"#,
            BadRequest,
            "if_revision",
            &["if_revision = 1.5 is not a whole number"],
        ),
        (
            r#""op":"undo","if_revision":99999999999999999999999"#,
            OutOfRange,
            "if_revision",
            &["99999999999999999999999 is out of range"],
        ),
        (
            r#""op":"set","params":{},"dry_run":1"#,
            BadRequest,
            "dry_run",
            &["dry_run = 1 is not true or false"],
        ),
        (
            r#""op":"set","params":{},"dry_run":null"#,
            BadRequest,
            "dry_run",
            &["dry_run = null is not true or false"],
        ),
        (
            r#""op":"set","params":{},"merge":"yes""#,
            BadRequest,
            "merge",
            &["merge = \"yes\" is not true or false"],
        ),
        (
            r#""op":"subscribe","topics":[],"batch_ms":1.5"#,
            BadRequest,
            "batch_ms",
            &["batch_ms = 1.5 is not a whole number from 1 to 1000 ms"],
        ),
        (
            r#""op":"subscribe","topics":[],"batch_ms":-1"#,
            OutOfRange,
            "batch_ms",
            &["batch_ms = -1 ms is out of range: it must be from 1 to 1000 ms"],
        ),
        (
            r#""op":"subscribe","topics":[],"rate_hz":[1]"#,
            BadRequest,
            "rate_hz",
            &["rate_hz = [1] is not a number of Hz"],
        ),
        (
            r#""op":"subscribe","topics":"state""#,
            BadRequest,
            "topics",
            &["topics = \"state\" is not a list of topics: state, timing, samples, log"],
        ),
        (
            r#""op":"subscribe","topics":[3]"#,
            BadRequest,
            "topics",
            &["topics = [3] is not a list"],
        ),
        (
            r#""op":"subscribe","topics":["sample"]"#,
            BadRequest,
            "topics",
            &["no topic `sample`, did you mean `samples`?"],
        ),
        (
            r#""op":"subscribe","topics":["weather"]"#,
            BadRequest,
            "topics",
            &["no topic `weather`; there are state"],
        ),
        (
            r#""op":"subscribe""#,
            BadRequest,
            "topics",
            &["`subscribe` has no `topics`: a list of topics"],
        ),
        (
            r#""op":"lease","timeout_ms":500.5"#,
            BadRequest,
            "timeout_ms",
            &["timeout_ms = 500.5 is not a whole number from 20 to 60000 ms"],
        ),
        (
            r#""op":"lease","timeout_ms":-1"#,
            OutOfRange,
            "timeout_ms",
            &["timeout_ms = -1 ms is out of range: it must be from 20 to 60000 ms"],
        ),
        (
            r#""op":"lease","timeout_ms":99999999999"#,
            OutOfRange,
            "timeout_ms",
            &["timeout_ms = 99999999999 ms is out of range"],
        ),
        (
            r#""op":"lease","timeout_ms":null"#,
            BadRequest,
            "timeout_ms",
            &["timeout_ms = null is not a whole number"],
        ),
        (
            r#""op":"log","limit":-5"#,
            OutOfRange,
            "limit",
            &["limit = -5 is out of range"],
        ),
        (
            r#""op":"log","after":"x""#,
            BadRequest,
            "after",
            &["after = \"x\" is not a whole number from 0 on"],
        ),
        (
            r#""op":"get","scene":true"#,
            BadRequest,
            "scene",
            &["scene = true is not a scene: the number of a revision"],
        ),
        (
            r#""op":"get","scene":-1"#,
            OutOfRange,
            "scene",
            &["scene = -1 is out of range"],
        ),
        (
            r#""op":"get","scene":1.5"#,
            BadRequest,
            "scene",
            &["scene = 1.5 is not a scene"],
        ),
        (
            r#""op":"scene.diff","from":[1]"#,
            BadRequest,
            "from",
            &["from = [1] is not a scene"],
        ),
        (
            r#""op":"scene.save","name":1"#,
            BadRequest,
            "name",
            &["name = 1 is not a text in quotes"],
        ),
        (
            r#""op":"devices","probe":7"#,
            BadRequest,
            "probe",
            &["probe = 7 is not a text in quotes"],
        ),
        (
            r#""op":null"#,
            BadRequest,
            "op",
            &["op = null is not the name of an operation"],
        ),
        (
            r#""op":3"#,
            BadRequest,
            "op",
            &["op = 3 is not the name of an operation"],
        ),
        (
            r#""op":"gett""#,
            UnknownOp,
            "op",
            &["no operation `gett`, did you mean `get`?", "describe, get, set"],
        ),
        (
            r#""op":"dance""#,
            UnknownOp,
            "op",
            &["no operation `dance`; there are describe"],
        ),
        (r#""op":"get","op":"get""#, GivenTwice, "op", &["op is given twice"]),
        (
            r#""op":"get","scen":1"#,
            UnknownField,
            "scen",
            &["`get` has no field `scen`, did you mean `scene`? it has scene"],
        ),
        (
            r#""op":"stop","why":"fire""#,
            UnknownField,
            "why",
            &["`stop` has no field `why`; it has none but `id` and `op`"],
        ),
        (
            r#""op":"set""#,
            BadRequest,
            "params",
            &["`set` has no `params`: an object of parameters and numbers"],
        ),
        (
            r#""op":"set","params":[1]"#,
            BadRequest,
            "params",
            &["params = [1] is not an object of parameters"],
        ),
        (
            r#""op":"set","params":null"#,
            BadRequest,
            "params",
            &["params = null is not an object"],
        ),
        (
            r#""op":"set","params":{"mass":"500g"}"#,
            BadRequest,
            "mass",
            &["mass = \"500g\" is not a number in kg; write 0.5"],
        ),
        (
            r#""op":"set","params":{"mass":"heavy"}"#,
            BadRequest,
            "mass",
            &["mass = \"heavy\" is not a number in kg"],
        ),
        (
            r#""op":"set","params":{"mass":1e400}"#,
            BadRequest,
            "mass",
            &["mass = 1e400 kg is out of range"],
        ),
        (
            r#""op":"set","params":{"M":1,"Fs":null}"#,
            BadRequest,
            "Fs",
            &["Fs = null is not a number in N, or one for each direction"],
        ),
        (
            r#""op":"set","params":{"Fs":{"positive":1}}"#,
            BadRequest,
            "Fs",
            &[r#"Fs = {"positive":1} is not a number in N"#],
        ),
        (
            r#""op":"set","params":{"Fs":{"positive":1,"negative":"2"}}"#,
            BadRequest,
            "Fs",
            &[r#"Fs = "2" is not a number in N"#],
        ),
        (
            r#""op":"set","params":{"zba":"half"}"#,
            BadRequest,
            "zba",
            &["zba = \"half\" is not a number"],
        ),
        (
            r#""op":"scene.load","scene":{"friction":{"law":"viscous","viscous":1,"b":2}}"#,
            GivenTwice,
            "b",
            &["b is given twice"],
        ),
        (
            r#""op":"scene.load","scene":{"friction":{"law":"viscous","b":1,"b":2}}"#,
            GivenTwice,
            "b",
            &["b is given twice"],
        ),
        (
            r#""op":"scene.load","scene":{"block":{"M":1,"mass":2},"friction":{"law":"viscous","b":1}}"#,
            GivenTwice,
            "mass",
            &["given twice"],
        ),
        (
            r#""op":"scene.load","scene":{"friction":{"law":"viscous","visous":1}}"#,
            UnknownField,
            "visous",
            &["`scene.friction` has no field `visous`, did you mean `viscous`?"],
        ),
        (
            r#""op":"scene.load","scene":{"frictoin":{"law":"viscous","b":1}}"#,
            UnknownField,
            "frictoin",
            &["`scene` has no field `frictoin`, did you mean `friction`?"],
        ),
        (
            r#""op":"scene.load","scene":{"friction":{"law":"viscos","b":1}}"#,
            BadRequest,
            "law",
            &["no law `viscos`, did you mean `viscous`?", "karnopp"],
        ),
        (
            r#""op":"scene.load","scene":{"friction":{"law":true,"b":1}}"#,
            BadRequest,
            "law",
            &["scene.friction.law = true is not one of karnopp"],
        ),
        (
            r#""op":"scene.load","scene":{"friction":{"b":1}}"#,
            BadRequest,
            "law",
            &["`scene.friction` has no `law`: one of karnopp"],
        ),
        (
            r#""op":"scene.load","scene":{"friction":{"law":"viscous"}}"#,
            BadRequest,
            "viscous",
            &["`scene.friction` has no `viscous`: a number in N s/m"],
        ),
        (
            r#""op":"scene.load","scene":{"friction":{"law":"viscous","b":"2"}}"#,
            BadRequest,
            "b",
            &["scene.friction.b = \"2\" is not a number in N s/m"],
        ),
        (
            r#""op":"scene.load","scene":{"friction":{"law":"karnopp","Fs":1,"Fd":1,"reseat":"slide"}}"#,
            BadRequest,
            "reseat",
            &["no reseat `slide`, did you mean `slides`?"],
        ),
        (
            r#""op":"scene.load","scene":{"block":{"mass":"x"},"friction":{"law":"viscous","b":1}}"#,
            BadRequest,
            "mass",
            &["scene.block.mass = \"x\" is not a number in kg"],
        ),
        (
            r#""op":"scene.load","scene":{"block":{"mass":1e400},"friction":{"law":"viscous","b":1}}"#,
            BadRequest,
            "mass",
            &["scene.block.mass = 1e400 kg is out of range"],
        ),
        (
            r#""op":"scene.load","scene":{"block":{},"friction":{"law":"viscous","b":1}}"#,
            BadRequest,
            "mass",
            &["`scene.block` has no `mass`: a number in kg"],
        ),
        (
            r#""op":"scene.load","scene":{"block":7,"friction":{"law":"viscous","b":1}}"#,
            BadRequest,
            "block",
            &["scene.block = 7 is not an object"],
        ),
        (
            r#""op":"scene.load","scene":{"name":7,"friction":{"law":"viscous","b":1}}"#,
            BadRequest,
            "name",
            &["scene.name = 7 is not a text"],
        ),
        (
            r#""op":"scene.load","scene":{"name":"x"}"#,
            BadRequest,
            "friction",
            &["`scene` has no `friction`"],
        ),
        (
            r#""op":"scene.load""#,
            BadRequest,
            "scene",
            &["`scene.load` has no `scene`: a scene"],
        ),
    ] {
        let line = format!(r#"{{"id":1,{fields}}}"#);
        let error = refused(&line);
        assert_eq!(
            (error.code, error.param.as_deref()),
            (code, Some(param)),
            "{line}: {error}"
        );
        for part in parts {
            assert!(error.message.contains(part), "{line}: {error} lacks {part}");
        }
        assert!(is_plain(&error.message), "{line}: {error}");
        assert_eq!(
            error.code == OutOfRange,
            error.unit.is_some() && error.value.is_some(),
            "{line}: {error:?}"
        );
    }
}

#[test]
fn a_number_out_of_range_has_its_limits_and_their_unit() {
    let error = refused(r#"{"id":1,"op":"lease","timeout_ms":-1}"#);
    assert_eq!(
        (error.value, error.min, error.max),
        (Some(-1.0), Some(20.0), Some(60_000.0))
    );
    assert_eq!(error.unit.as_deref(), Some("ms"));
    let error = refused(r#"{"id":1,"op":"set","params":{"mass":1e400}}"#);
    assert_eq!((error.value, error.min, error.max), (None, Some(1e-6), Some(100.0)));
    assert_eq!(refused(r#"{"id":1,"op":"get","scene":1.5}"#).value, Some(1.5));
}

#[test]
fn every_limit_of_the_grammar_is_held_to_its_ends() {
    for (fields, field, unit, (min, max)) in [
        (r#""op":"undo""#, "ramp_ms", "ms", (0, 10_000)),
        (r#""op":"subscribe","topics":[]"#, "batch_ms", "ms", (1, 1000)),
        (r#""op":"lease""#, "timeout_ms", "ms", (20, 60_000)),
        (r#""op":"commission.pulse","force_N":1"#, "duration_ms", "ms", (20, 300)),
        (r#""op":"commission.store""#, "range_m", "m", (0, 1000)),
        (r#""op":"commission.store""#, "friction_N", "N", (0, 1000)),
    ] {
        let line = |value: i64| format!(r#"{{"id":1,{fields},"{field}":{value}}}"#);
        for value in [min, max] {
            Envelope::parse(&line(value)).unwrap_or_else(|bad| panic!("{}: {bad:?}", line(value)));
        }
        let below = if field == "timeout_ms" { 1 } else { min - 1 };
        for value in [below, max + 1] {
            let error = refused(&line(value));
            let told = format!("{field} = {value} {unit} is out of range: it must be from {min} to {max} {unit}");
            assert!(error.message.starts_with(&told), "{error} is not {told}");
            assert_eq!((error.code, error.param.as_deref()), (OutOfRange, Some(field)));
            assert_eq!((error.min, error.max), (Some(min as f64), Some(max as f64)), "{error}");
            assert_eq!((error.value, error.unit.as_deref()), (Some(value as f64), Some(unit)));
        }
    }
    Envelope::parse(r#"{"id":1,"op":"lease","timeout_ms":0}"#).expect("0 ends a lease");
    let error = refused(r#"{"id":1,"op":"lease","timeout_ms":1}"#);
    assert!(error.message.ends_with("60000 ms, or 0 to end the lease"), "{error}");
}

#[test]
fn a_long_value_is_cut_in_the_message() {
    let line = format!(r#"{{"id":1,"op":"scene.save","name":[{}1]}}"#, "1,".repeat(10_000));
    let message = refused(&line).message;
    assert!(message.len() < 200 && message.contains("..."), "{message}");
}

/// A value of any kind, and some of those that are meant.
fn value() -> impl Strategy<Value = String> {
    prop_oneof![
        prop::sample::select(vec![
            "1",
            "-1",
            "1.5",
            "1e400",
            "1.0",
            "-0",
            "99999999999999999999999",
            "null",
            "true",
            "\"x\"",
            "\"state\"",
            "\"500g\"",
            "[]",
            "[1]",
            "[null]",
            "{}",
            "[\"state\"]",
            "[{\"state\":null}]",
            "{\"mass\":1}",
            "{\"mass\":[]}",
            "{\"mass\":1,\"mass\":2}",
            "{\"Fs\":{\"positive\":1,\"negative\":1e400}}",
            "{\"Fs\":{\"positive\":1,\"positive\":2}}",
            "\"\\ud800\"",
            "{\"friction\":{\"law\":\"viscous\",\"b\":1}}",
            "{\"friction\":{\"law\":\"viscous\",\"b\":{\"positive\":1}}}",
            "{\"friction\":[]}",
            "{\"friction\":null}",
            "{\"friction\":{\"law\":\"dahl\",\"Fd\":1,\"Kp\":{\"positive\":1,\"negative\":1}}}",
            "{\"block\":[1],\"friction\":{\"law\":\"viscous\",\"b\":1}}",
            "{\"block\":[],\"friction\":{\"law\":\"viscous\",\"b\":1}}",
        ])
        .prop_map(str::to_owned),
        "[0-9a-z\"{}:,\\[\\].-]{0,12}",
    ]
}

/// The names that a refusal lists.
fn listed(line: &str, after: &str) -> Vec<String> {
    let message = refused(line).message;
    let (_, names) = message.rsplit_once(after).unwrap_or_default();
    names
        .split(", ")
        .filter(|name| !name.is_empty())
        .map(str::to_owned)
        .collect()
}

fn line() -> impl Strategy<Value = String> {
    let operations = listed(r#"{"id":1,"op":"dance"}"#, "there are ");
    assert_eq!(operations.len(), 25, "{operations:?}");
    let mut names: Vec<String> = ["id", "op", "colour"].map(str::to_owned).into();
    for op in &operations {
        names.extend(listed(&format!(r#"{{"id":1,"op":"{op}","colour":1}}"#), "it has "));
    }
    let field = (prop::sample::select(names), value());
    (prop::sample::select(operations), prop::collection::vec(field, 0..4)).prop_map(|(op, fields)| {
        let fields: Vec<String> = fields
            .iter()
            .map(|(name, value)| format!(r#","{name}":{value}"#))
            .collect();
        format!(r#"{{"id":1,"op":"{op}"{}}}"#, fields.concat())
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]
    #[test]
    fn whatever_is_wrong_has_a_name_and_plain_words(line in line()) {
        if let Err(BadLine { error, .. }) = Envelope::parse(&line) && error.code != BadJson {
            prop_assert!(error.param.is_some(), "{line}: {error}");
            prop_assert!(is_plain(&error.message), "{line}: {error}");
        }
    }
}
