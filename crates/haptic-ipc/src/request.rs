//! Requests, and how a line becomes one.

use crate::changes::Changes;
use crate::error::WireError;
use crate::refusal::{Line, explain};
use crate::scene::SceneRef;
use serde::{Deserialize, Serialize};
use std::ops::RangeInclusive;

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
    /// Have the rig to oneself, to commission it.
    #[serde(rename = "commission.begin")]
    CommissionBegin {},
    /// Move the handle by a single pulse of force.
    #[serde(rename = "commission.pulse")]
    CommissionPulse {
        /// Force on the hand, N, positive in the positive direction.
        #[serde(rename = "force_N")]
        force_n: f64,
        /// Duration of the whole pulse, ms; 200 when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        duration_ms: Option<f64>,
    },
    /// What has been found so far.
    #[serde(rename = "commission.status")]
    CommissionStatus {},
    /// Keep what was found: the rig counts as commissioned from now on.
    #[serde(rename = "commission.store")]
    CommissionStore {
        /// Travel of the handle between its ends, m.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        range_m: Option<f64>,
        /// Friction of the rig itself, N.
        #[serde(default, rename = "friction_N", skip_serializing_if = "Option::is_none")]
        friction_n: Option<f64>,
    },
    /// Give the rig back, as it was before.
    #[serde(rename = "commission.end")]
    CommissionEnd {},
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
            | Self::CommissionBegin {}
            | Self::CommissionPulse { .. }
            | Self::CommissionStatus {}
            | Self::CommissionStore { .. }
            | Self::CommissionEnd {}
            | Self::Engage {}
            | Self::Release {}
            | Self::Reset {}
            | Self::Devices { probe: Some(_) } => false,
        }
    }
}

/// How long a client with a lease may be silent, ms. Below, an ordinary program would lapse whenever the machine is busy.
pub const LEASE_TIMEOUT_MS: RangeInclusive<u32> = 20..=60_000;

/// Time between sample events, ms.
pub const BATCH_MS: RangeInclusive<u32> = 1..=1000;

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
        /// What serde would take for something else: a list for an object, a number for an operation's place among them.
        #[derive(Deserialize)]
        struct Head {
            id: serde_json::Value,
            op: serde_json::Value,
        }
        let read = serde_json::from_str(line).and_then(|head: Head| {
            if head.id.is_u64() && head.op.is_string() && line.trim_start().starts_with('{') {
                serde_json::from_str(line)
            } else {
                Err(serde::de::Error::custom("no request"))
            }
        });
        read.map_err(|error| {
            let fields = Line::read(line);
            BadLine {
                id: fields.as_ref().and_then(Line::id),
                means_stop: fields.as_ref().is_some_and(Line::means_stop),
                error: explain(line, fields.as_ref(), &error),
            }
        })
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
    use crate::error::ErrorCode;
    use crate::refusal::OPERATIONS;
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
        for op in OPERATIONS.iter().map(|operation| operation.name) {
            let more = match op {
                "set" => r#","params":{}"#,
                "subscribe" => r#","topics":["samples"],"rate_hz":100"#,
                "scene.load" => r#","scene":"viscous-drag","ramp_ms":50"#,
                "scene.save" => r#","name":"mine","scene":7"#,
                "scene.diff" => r#","from":{"friction":{"law":"viscous","viscous":2}}"#,
                "lease" => r#","timeout_ms":500"#,
                "commission.pulse" => r#","force_N":-1.5,"duration_ms":100"#,
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
