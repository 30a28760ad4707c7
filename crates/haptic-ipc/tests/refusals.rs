//! Every way in which a line can be wrong is refused with the field, the value, the limits, the
//! unit and a guess, in plain words.

use haptic_ipc::ErrorCode::{BadJson, OutOfRange};
use haptic_ipc::{BadLine, Envelope, WireError};
use proptest::prelude::*;

fn refused(line: &str) -> WireError {
    Envelope::parse(line).expect_err(line).error
}

/// Words of the language that the daemon is written in, and of its libraries.
fn is_plain(message: &str) -> bool {
    let jargon = "u64, u32, f64, usize, struct, variant, enum, invalid type, line 1, column, sequence";
    jargon.split(", ").all(|word| !message.contains(word))
}

#[test]
fn wrong_field_is_named_with_value_and_expectation() {
    let cases = include_str!("refusals.txt")
        .split_once("\n\n")
        .expect("an introduction")
        .1;
    let lines: Vec<&str> = cases.lines().collect();
    assert!(lines.len() > 100 && lines.len().is_multiple_of(2), "{}", lines.len());
    for case in lines.chunks(2) {
        let (fields, expected) = (case[0], case[1].trim_start());
        let (head, message) = expected.split_once(": ").expect("a message");
        let (code, param) = head.split_once(' ').expect("a code and a field");
        let line = format!(r#"{{"id":1,{fields}}}"#);
        let error = refused(&line);
        assert_eq!(error.param.as_deref(), Some(param), "{line}: {error}");
        assert_eq!(
            serde_json::to_value(error.code).expect("a word"),
            code,
            "{line}: {error}"
        );
        let mut rest = error.message.as_str();
        for part in message.split(" ... ") {
            let (_, after) = rest
                .split_once(part)
                .unwrap_or_else(|| panic!("{line}: {error} lacks {part}"));
            rest = after;
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
fn a_number_that_no_double_holds_has_its_limits_and_no_value() {
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
        (r#""op":"identify.begin""#, "range_m", "m", (0, 1000)),
    ] {
        let line = |value: i64| format!(r#"{{"id":1,{fields},"{field}":{value}}}"#);
        for value in [min, max] {
            Envelope::parse(&line(value)).unwrap_or_else(|bad| panic!("{}: {bad:?}", line(value)));
        }
        let below = if field == "timeout_ms" { 1 } else { min - 1 };
        for value in [below, max + 1] {
            let error = refused(&line(value));
            let expected = format!("{field} = {value} {unit} is out of range: it must be from {min} to {max} {unit}");
            assert!(error.message.starts_with(&expected), "{error} is not {expected}");
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

/// Values of any kind, and some of the expected kind.
const VALUES: &str = r#"
    1 -1 1.5 1e400 1.0 -0 99999999999999999999999 null true "x" "state" "500g" "\ud800"
    [] [1] [null] {} ["state"] [{"state":null}]
    {"mass":1} {"mass":[]} {"mass":{"times":2}} {"mass":{"plus":[]}} {"mass":1,"mass":2}
    [{"at_tick":1,"params":{}}] [{"at_tick":1,"scene":[]}]
    {"Fs":{"positive":1,"negative":1e400}} {"Fs":{"positive":1,"positive":2}}
    {"friction":{"law":"viscous","b":1}} {"friction":{"law":"viscous","b":{"positive":1}}}
    {"friction":[]} {"friction":null}
    {"friction":{"law":"dahl","Fd":1,"Kp":{"positive":1,"negative":1}}}
    {"block":[1],"friction":{"law":"viscous","b":1}} {"block":[],"friction":{"law":"viscous","b":1}}
"#;

fn value() -> impl Strategy<Value = String> {
    let some: Vec<&str> = VALUES.split_whitespace().collect();
    prop_oneof![
        prop::sample::select(some).prop_map(str::to_owned),
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
    let operations = listed(r#"{"id":1,"op":"dance"}"#, "the operations are ");
    assert_eq!(operations.len(), 38, "{operations:?}");
    let mut names: Vec<String> = ["id", "op", "colour"].map(str::to_owned).into();
    for op in &operations {
        names.extend(listed(
            &format!(r#"{{"id":1,"op":"{op}","colour":1}}"#),
            "its fields are ",
        ));
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
