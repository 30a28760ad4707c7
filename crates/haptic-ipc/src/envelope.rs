//! A line of a client: a request and its number, or the reason why the line is not a request.

use crate::error::{ErrorCode, WireError};
use crate::object::Object;
use crate::refusal;
use crate::request::Request;
use serde::Serialize;
use serde::de::IgnoredAny;

/// A request with the number that its answer will carry.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Envelope {
    /// Chosen by the client.
    pub id: u64,
    /// The request.
    #[serde(flatten)]
    pub request: Request,
}

/// A line that is not a request.
#[derive(Clone, Debug, PartialEq)]
pub struct BadLine {
    /// Its number, if that could be read.
    pub id: Option<u64>,
    /// What is wrong with it.
    pub error: WireError,
    /// Whether it was meant as a stop: when in doubt, zero force.
    pub means_stop: bool,
}

impl Envelope {
    /// Reads a line.
    ///
    /// # Errors
    /// The answer to a line that is not a request.
    pub fn parse(line: &str) -> Result<Self, BadLine> {
        let mut object = Object::line(line).map_err(|error| BadLine {
            id: None,
            error: not_an_object(line, &error),
            means_stop: false,
        })?;
        let id = object.all("id").find_map(|id| id.parse().ok());
        let means_stop = object.all("op").any(|op| text(op).as_deref() == Some("stop"));
        Self::read(&mut object).map_err(|error| BadLine { id, error, means_stop })
    }

    fn read(line: &mut Object<'_>) -> Result<Self, WireError> {
        line.no_field_twice()?;
        let id = line.take("id").ok_or_else(|| {
            refusal::missing(
                "the line",
                "id",
                "a whole number of your choice, which the answer repeats",
            )
        })?;
        let id = id
            .parse()
            .map_err(|_| refusal::wrong_type("id", "id", id, "a whole number from 0 to 2^64 - 1"))?;
        let expected = "the name of an operation in quotes";
        let op = line
            .take("op")
            .ok_or_else(|| refusal::missing("the line", "op", expected))?;
        let op = text(op).ok_or_else(|| refusal::wrong_type("op", "op", op, expected))?;
        let request = Request::read(&op, line)?;
        Ok(Self { id, request })
    }
}

fn text(json: &str) -> Option<String> {
    serde_json::from_str(json).ok()
}

fn not_an_object(line: &str, error: &serde_json::Error) -> WireError {
    if serde_json::from_str::<IgnoredAny>(line).is_ok() && !line.trim_start().starts_with('{') {
        let message = r#"expected a JSON object, as in {"id":1,"op":"get"}"#;
        return WireError::new(ErrorCode::BadRequest, message);
    }
    let message = format!("the line is not JSON: {error} (NaN and infinity are not JSON either)");
    WireError::new(ErrorCode::BadJson, message)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ChangeOptions;
    use crate::fields::Fields as _;
    use haptic_core::Scene;

    const EXCITATION: &str = concat!(
        r#","excitation":{"course":{"kind":"sweep","travel_m":0.01,"speed_mps":0.001,"rounds":1},"#,
        r#""force_limit_N":2,"slew_limit_N_per_s":200,"stiffness_N_per_m":1000,"damping_Ns_per_m":20,"#,
        r#""travel_limit_m":0.02,"speed_limit_mps":0.3,"lag_limit_m":0.01,"wrong_way_limit_m":0.0001}"#
    );

    #[test]
    fn requests_read_as_the_specification_shows_them() {
        let envelope = Envelope::parse(r#"{"id":7,"op":"set","params":{"mass":1.5,"Fs":{"positive":5,"negative":3}}}"#);
        let Ok(Envelope {
            id: 7,
            request: Request::Set { params, .. },
        }) = envelope
        else {
            panic!("{envelope:?}");
        };
        assert_eq!(params.resolve(&Scene::paper()).expect("known names").len(), 3);
        for op in Request::OPERATIONS {
            let more = match *op {
                "set" => r#","params":{}"#,
                "subscribe" => r#","topics":["samples"],"rate_hz":100"#,
                "scene.load" => concat!(
                    r#","scene":"viscous-drag","ramp_ms":50,"if_revision":3,"dry_run":true,"at_tick":99,"#,
                    r#""anyway":true"#
                ),
                "scene.save" => r#","name":"mine","scene":7"#,
                "scene.delete" => r#","name":"mine""#,
                "scene.rename" => r#","name":"mine","to":"yours""#,
                "schedule" => concat!(
                    r#","changes":[{"at_tick":9,"params":{"mass":{"times":2},"Fs":{"plus":0.5}}},"#,
                    r#"{"at_tick":200,"ramp_ms":50.0,"scene":"lugre"}],"name":"a","keep":true"#
                ),
                "scene.diff" => r#","from":{"friction":{"law":"viscous","viscous":2}}"#,
                "lease" => r#","timeout_ms":500"#,
                "hand" => r#","target_m":-0.01"#,
                "commission.pulse" => r#","force_N":-1.5,"duration_ms":100"#,
                "identify.excite" => EXCITATION,
                "identify.store" => r#","friction":{"mass_kg":1.4,"dynamic_force_N":0.8,"viscous_Ns_per_m":0}"#,
                _ => "",
            };
            let line = format!(r#"{{"op":"{op}","id":1{more}}}"#);
            let envelope = Envelope::parse(&line).unwrap_or_else(|error| panic!("{line}: {error:?}"));
            let written = serde_json::to_string(&envelope).expect("writes");
            assert_eq!(Envelope::parse(&written).expect("reads"), envelope);
            let is_there = |field: &str| *op != "scene.load" || written.contains(&format!("\"{field}\":"));
            assert!(ChangeOptions::names().into_iter().all(is_there), "{written}");
        }
    }

    #[test]
    fn bad_line_is_answered_by_its_number_where_that_is_read() {
        use ErrorCode::{BadJson, BadRequest, UnknownOp};
        for (line, id, code, part) in [
            ("not json", None, BadJson, "not JSON"),
            (r#"{"id":1,"op":"set","params":{"mass":NaN}}"#, None, BadJson, "NaN"),
            (r#"{"id":1,"op":"dance"}"#, Some(1), UnknownOp, "dance"),
            (r#"{"id":1}"#, Some(1), BadRequest, "op"),
            (r#"{"id":1,"op":3}"#, Some(1), BadRequest, "op = 3"),
            (r#"{"op":"get"}"#, None, BadRequest, "id"),
            (r#"{"id":-1,"op":"get"}"#, None, BadRequest, "id = -1"),
            (r#"{"id":"a","op":"get"}"#, None, BadRequest, "id = \"a\""),
            (r#"[1,2]"#, None, BadRequest, ""),
            ("", None, BadJson, ""),
        ] {
            let BadLine { id: got_id, error, .. } = Envelope::parse(line).expect_err(line);
            assert_eq!((got_id, error.code), (id, code), "{line}: {error}");
            assert!(error.message.contains(part), "{line}: {error} does not name {part}");
        }
    }

    #[test]
    fn a_stop_that_cannot_be_read_is_known_for_one() {
        for line in [
            r#"{"id":1,"op":"stop","why":"fire"}"#,
            r#"{"id":"x","op":"stop"}"#,
            r#"{"op":"stop"}"#,
            r#"{"id":1,"op":"stop","id":1}"#,
            r#"{"id":1e400,"op":"stop"}"#,
        ] {
            assert!(Envelope::parse(line).expect_err(line).means_stop, "{line}");
        }
        assert!(
            !Envelope::parse(r#"{"id":1,"op":"engage","why":"stop"}"#)
                .expect_err("a field")
                .means_stop
        );
    }

    #[test]
    fn a_parameter_given_twice_reaches_the_scene_twice() {
        let line = r#"{"id":1,"op":"set","params":{"Fs":5,"Fs":6}}"#;
        let Ok(Envelope {
            request: Request::Set { params, .. },
            ..
        }) = Envelope::parse(line)
        else {
            panic!("it reads");
        };
        let refused = Scene::paper().with(&params.resolve(&Scene::paper()).expect("known names"));
        assert!(refused.is_err_and(|error| error.to_string().contains("twice")));
    }

    proptest::proptest! {
        #[test]
        fn no_line_panics(line in ".{0,200}") {
            drop(Envelope::parse(&line));
        }
    }
}
