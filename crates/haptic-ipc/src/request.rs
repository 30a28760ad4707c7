//! Requests, and how a line becomes one.

use crate::changes::Changes;
use crate::error::{ErrorCode, WireError};
use crate::scene::SceneRef;
use serde::{Deserialize, Serialize};

/// What a client asks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(tag = "op", rename_all = "snake_case", deny_unknown_fields)]
pub enum Request {
    /// The parameter table.
    Describe {},
    /// A scene.
    Get {
        /// Which one; the one in force when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        scene: Option<SceneRef>,
    },
    /// Change parameters.
    Set {
        /// The changes.
        params: Changes,
        /// Refuse unless this is the newest revision.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        if_revision: Option<u64>,
        /// Time over which to change, ms; at once when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        ramp_ms: Option<f64>,
        /// Only say what would happen.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        dry_run: bool,
        /// Let `undo` take it back together with the change before, if that was this client's and of the same parameters: for a
        /// slider that is dragged.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        merge: bool,
    },
    /// Put a whole scene in force.
    #[serde(rename = "scene.load")]
    SceneLoad {
        /// Which one.
        scene: SceneRef,
        /// Refuse unless this is the newest revision.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        if_revision: Option<u64>,
        /// Time over which to change, ms; at once when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        ramp_ms: Option<f64>,
        /// Only say what would happen.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        dry_run: bool,
    },
    /// Keep a scene in the library.
    #[serde(rename = "scene.save")]
    SceneSave {
        /// Its name there.
        name: String,
        /// Which one; the one in force when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        scene: Option<SceneRef>,
        /// Whether it may take the place of one that is there.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        replace: bool,
    },
    /// The scenes in the library.
    #[serde(rename = "scene.list")]
    SceneList {},
    /// In what two scenes differ.
    #[serde(rename = "scene.diff")]
    SceneDiff {
        /// The one.
        from: SceneRef,
        /// The other; the one in force when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        to: Option<SceneRef>,
    },
    /// Take the newest change back, whoever made it.
    Undo {
        /// Refuse unless this is the newest revision.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        if_revision: Option<u64>,
        /// Time over which to change, ms; at once when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        ramp_ms: Option<f64>,
        /// Only say what would happen.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        dry_run: bool,
    },
    /// Bring back what was undone last.
    Redo {
        /// Refuse unless this is the newest revision.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        if_revision: Option<u64>,
        /// Time over which to change, ms; at once when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        ramp_ms: Option<f64>,
        /// Only say what would happen.
        #[serde(default, skip_serializing_if = "std::ops::Not::not")]
        dry_run: bool,
    },
    /// Who changed what, and when.
    Log {
        /// Only what came after this number.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        after: Option<u64>,
        /// At most so many, the newest; 100 when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        limit: Option<usize>,
    },
    /// Release the rig should this client die or fall silent.
    Lease {
        /// How long it may be silent, ms; 0 ends the lease.
        timeout_ms: u32,
    },
    /// Ramp the force up.
    Engage {},
    /// Ramp the force down.
    Release {},
    /// Zero force at once.
    Stop {},
    /// Clear a stop or a fault.
    Reset {},
    /// How the rig and the daemon are.
    Status {},
    /// How well the loop keeps time.
    Timing {},
    /// What the scene in force will do to the rig.
    Advise {},
    /// Which devices are plugged in.
    Devices {
        /// Only this one, by its address, which is opened and asked who it is. That resets many boards.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        probe: Option<String>,
    },
    /// Events from now on.
    Subscribe {
        /// What to hear of; nothing ends the subscription.
        topics: Vec<Topic>,
        /// Samples a second; every tick when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rate_hz: Option<f64>,
        /// Time between sample events, ms; 10 when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        batch_ms: Option<u32>,
    },
}

impl Request {
    /// The scene in force.
    #[must_use]
    pub const fn get() -> Self {
        Self::Get { scene: None }
    }

    /// A change of parameters, at once and whatever the revision.
    #[must_use]
    pub const fn set(params: Changes) -> Self {
        Self::Set {
            params,
            if_revision: None,
            ramp_ms: None,
            dry_run: false,
            merge: false,
        }
    }

    /// A whole scene, at once and whatever the revision.
    #[must_use]
    pub const fn load(scene: SceneRef) -> Self {
        Self::SceneLoad {
            scene,
            if_revision: None,
            ramp_ms: None,
            dry_run: false,
        }
    }

    /// The newest change taken back, at once and whatever the revision.
    #[must_use]
    pub const fn undo() -> Self {
        Self::Undo {
            if_revision: None,
            ramp_ms: None,
            dry_run: false,
        }
    }

    /// What was undone brought back, at once and whatever the revision.
    #[must_use]
    pub const fn redo() -> Self {
        Self::Redo {
            if_revision: None,
            ramp_ms: None,
            dry_run: false,
        }
    }

    /// Whether it leaves everything as it is, or makes it safer: what a watcher may ask.
    #[must_use]
    pub const fn is_for_watchers(&self) -> bool {
        match self {
            Self::Describe {}
            | Self::Get { .. }
            | Self::SceneList {}
            | Self::SceneDiff { .. }
            | Self::Log { .. }
            | Self::Stop {}
            | Self::Status {}
            | Self::Timing {}
            | Self::Advise {}
            | Self::Subscribe { .. }
            | Self::Devices { probe: None } => true,
            Self::Set { .. }
            | Self::SceneLoad { .. }
            | Self::SceneSave { .. }
            | Self::Undo { .. }
            | Self::Redo { .. }
            | Self::Lease { .. }
            | Self::Engage {}
            | Self::Release {}
            | Self::Reset {}
            | Self::Devices { probe: Some(_) } => false,
        }
    }
}

/// The operations, for messages.
const OPERATIONS: &str = "describe, get, set, scene.load, scene.save, scene.list, scene.diff, undo, redo, engage, release, stop, reset, status, timing, advise, devices, subscribe, log, lease";

/// A request with the number that its answer will carry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Envelope {
    /// Chosen by the client.
    pub id: u64,
    /// What is asked.
    #[serde(flatten)]
    pub request: Request,
}

/// A line that is no request.
#[derive(Clone, Debug, PartialEq)]
pub struct BadLine {
    /// Its number, where one could be read.
    pub id: Option<u64>,
    /// What is wrong with it.
    pub error: WireError,
    /// Whether it was meant as a stop all the same: when in doubt, zero force.
    pub means_stop: bool,
}

impl Envelope {
    /// Reads a line.
    ///
    /// # Errors
    /// The answer to a line that is no request.
    pub fn parse(line: &str) -> Result<Self, BadLine> {
        /// What must be known of a line whatever else is wrong with it.
        #[derive(Default, Deserialize)]
        struct Head {
            id: Option<serde_json::Value>,
            op: Option<serde_json::Value>,
        }
        // An array would be read as a head as well.
        let is_object = line.trim_start().starts_with('{');
        let head = if is_object {
            serde_json::from_str(line).unwrap_or_default()
        } else {
            Head::default()
        };
        let (id, op) = (head.id.as_ref(), head.op.as_ref());
        let refused = |error| BadLine {
            id: id.and_then(serde_json::Value::as_u64),
            error,
            means_stop: op.is_some_and(|op| op == "stop"),
        };
        let bad = |field: &str, value: &serde_json::Value, wanted: &str| {
            let message = format!("{field} = {value} is not {wanted}");
            refused(WireError::new(ErrorCode::BadRequest, message).about(field))
        };
        match (id, op) {
            (Some(id), _) if !id.is_u64() => Err(bad("id", id, "a whole number from 0 to 2^64 - 1")),
            // A number would be taken for the operation's place in a list.
            (_, Some(op)) if !op.is_string() => Err(bad("op", op, "the name of an operation")),
            _ => serde_json::from_str(line).map_err(|error| refused(explain(line, &error))),
        }
    }
}

/// Turns serde's refusal into one of ours. Its texts are the only place where it names the culprit.
fn explain(line: &str, error: &serde_json::Error) -> WireError {
    let message = error.to_string();
    let quoted = |after: &str| {
        let rest = message.split_once(after)?.1;
        Some(rest.split_once('`')?.0.to_owned())
    };
    if serde_json::from_str::<serde::de::IgnoredAny>(line).is_err() {
        return WireError::new(
            ErrorCode::BadJson,
            format!("the line is not JSON: {error} (NaN and infinity are not JSON either)"),
        );
    }
    if let Some(field) = quoted("unknown field `") {
        return WireError::new(ErrorCode::UnknownField, message).about(field);
    }
    if let Some(op) = quoted("unknown variant `") {
        // A topic can be unknown too; serde then lists the topics.
        if message.contains("`describe`") {
            return WireError::new(
                ErrorCode::UnknownOp,
                format!("there is no operation `{op}`; there are {OPERATIONS}"),
            )
            .about("op");
        }
        // So can a law.
        let field = if message.contains("`karnopp`") { "law" } else { "topics" };
        return WireError::new(ErrorCode::BadRequest, message).about(field);
    }
    match quoted("missing field `") {
        Some(field) => WireError::new(ErrorCode::BadRequest, message).about(field),
        None => WireError::new(ErrorCode::BadRequest, message),
    }
}

/// What can be subscribed to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Topic {
    /// The rig's state and the scene in force, at once and at every change.
    State,
    /// How well the loop keeps time, once a second.
    Timing,
    /// The ticks.
    Samples,
    /// Every change, by whom and when, from now on.
    Log,
}

#[cfg(test)]
mod tests {
    use super::*;
    use haptic_core::Scene;

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
        assert_eq!(params.resolve().expect("known names").len(), 3);
        for op in OPERATIONS.split(", ") {
            let more = match op {
                "set" => r#","params":{}"#,
                "subscribe" => r#","topics":["samples"],"rate_hz":100"#,
                "scene.load" => r#","scene":"viscous-drag","ramp_ms":50"#,
                "scene.save" => r#","name":"mine","scene":7"#,
                "scene.diff" => r#","from":{"friction":{"law":"viscous","viscous":2}}"#,
                "lease" => r#","timeout_ms":500"#,
                _ => "",
            };
            let line = format!(r#"{{"op":"{op}","id":1{more}}}"#);
            let envelope = Envelope::parse(&line).unwrap_or_else(|error| panic!("{line}: {error:?}"));
            let written = serde_json::to_string(&envelope).expect("writes");
            assert_eq!(Envelope::parse(&written).expect("reads"), envelope);
        }
    }

    #[test]
    fn every_bad_line_is_refused_by_its_own_code() {
        use ErrorCode::{BadJson, BadRequest, UnknownField, UnknownOp};
        for (line, id, code, part) in [
            ("not json", None, BadJson, "not JSON"),
            (r#"{"id":1,"op":"set","params":{"mass":NaN}}"#, None, BadJson, "NaN"),
            (
                r#"{"id":1,"op":"set","params":{"mass":1e999}}"#,
                Some(1),
                BadRequest,
                "out of range",
            ),
            (r#"{"id":1,"op":"get","colour":1}"#, Some(1), UnknownField, "colour"),
            (
                r#"{"id":1,"op":"set","params":{},"colour":1}"#,
                Some(1),
                UnknownField,
                "colour",
            ),
            (r#"{"id":1,"op":"dance"}"#, Some(1), UnknownOp, "dance"),
            (r#"{"id":1}"#, Some(1), BadRequest, "op"),
            (r#"{"op":"get"}"#, None, BadRequest, "id"),
            (r#"{"id":-1,"op":"get"}"#, None, BadRequest, "id = -1"),
            (r#"{"id":"a","op":"get"}"#, None, BadRequest, "id = \"a\""),
            (r#"{"id":1,"op":3}"#, Some(1), BadRequest, "op = 3"),
            (r#"{"id":1,"op":"set"}"#, Some(1), BadRequest, "params"),
            (
                r#"{"id":1,"op":"set","params":{"mass":"heavy"}}"#,
                Some(1),
                BadRequest,
                "mass",
            ),
            (r#"{"id":1,"op":"set","params":[1]}"#, Some(1), BadRequest, "params"),
            (
                r#"{"id":1,"op":"subscribe","topics":["weather"]}"#,
                Some(1),
                BadRequest,
                "weather",
            ),
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
        let refused = Scene::paper().with(&params.resolve().expect("known names"));
        assert!(refused.is_err_and(|error| error.to_string().contains("twice")));
    }

    proptest::proptest! {
        #[test]
        fn no_line_panics(line in ".{0,200}") {
            drop(Envelope::parse(&line));
        }
    }
}
