//! The operations: their fields, the fields' limits and their answers, and how a line becomes a
//! request.

use crate::changes::Changes;
use crate::error::{ErrorCode, WireError};
use crate::event::Topic;
use crate::object::{Limits, Object};
use crate::refusal;
use crate::scene::SceneRef;
use serde::Serialize;
use serde::de::IgnoredAny;

/// Ramps, ms.
const RAMP: Limits = Limits::new(0, 10_000);

/// How long a client with a lease may be silent, ms. Below, an ordinary program would lapse
/// whenever the machine is busy.
const LEASE: Limits = Limits {
    zero: Some("to end the lease"),
    ..Limits::new(20, 60_000)
};

/// Duration of a pulse, ms.
const PULSE: Limits = Limits::new(20, 300);

/// Time between sample events, ms.
const BATCH: Limits = Limits::new(1, 1000);

/// What can be found of a rig for a hand: m, N.
const FOUND: Limits = Limits::new(0, 1000);

/// How a scene changes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ChangeOptions {
    /// Refuse unless this is the newest revision.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub if_revision: Option<u64>,
    /// Time over which to change, ms; at once when absent.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ramp_ms: Option<f64>,
    /// Answer with what would happen, and change nothing.
    #[serde(default, skip_serializing_if = "is_default")]
    pub dry_run: bool,
}

impl ChangeOptions {
    const FIELDS: [&str; 3] = ["if_revision", "ramp_ms", "dry_run"];

    fn read(line: &Object<'_>) -> Result<Self, WireError> {
        Ok(Self {
            if_revision: line.optional("if_revision", None)?,
            ramp_ms: line.optional("ramp_ms", Some(RAMP))?,
            dry_run: line.optional("dry_run", None)?,
        })
    }
}

/// Writes the grammar down once: each operation with the fields that it needs, those that may be
/// left out, whether it takes [`ChangeOptions`], and its answer. From that come the type, its
/// serialisation and schema, the reading of a line and every refusal.
macro_rules! operations {
    (@name $field:ident) => { stringify!($field) };
    (@name $field:ident $wire:literal) => { $wire };
    (@limits) => { None };
    (@limits $limits:ident) => { Some($limits) };
    ($(
        $(#[$doc:meta])*
        $variant:ident $op:literal {$(
            $(#[$needed_doc:meta])*
            $needed:ident $(as $needed_wire:literal)?: $needed_type:ty $(where $needed_limits:ident)?,
        )*}
        $(optional {$(
            $(#[$optional_doc:meta])*
            $optional:ident $(as $optional_wire:literal)?: $optional_type:ty $(where $optional_limits:ident)?,
        )*})?
        $(with $options:ident)?
        -> $answer:ty;
    )*) => {
        /// What a client asks.
        #[derive(Clone, Debug, PartialEq, Serialize)]
        #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
        #[serde(tag = "op")]
        pub enum Request {$(
            $(#[$doc])*
            #[serde(rename = $op)]
            $variant {
                $(
                    $(#[$needed_doc])*
                    $(#[serde(rename = $needed_wire)])?
                    $needed: $needed_type,
                )*
                $($(
                    $(#[$optional_doc])*
                    $(#[serde(rename = $optional_wire)])?
                    #[serde(default, skip_serializing_if = "is_default")]
                    $optional: $optional_type,
                )*)?
                $(
                    /// How the scene changes.
                    #[serde(flatten)]
                    $options: ChangeOptions,
                )?
            },
        )*}

        impl Request {
            /// The names of the operations.
            const OPERATIONS: &[&str] = &[$($op),*];

            /// Reads the fields of an operation, which are those of its line but for `id` and `op`.
            fn read(op: &str, line: &Object<'_>) -> Result<Self, WireError> {
                match op {
                    $($op => {
                        let known: &[&[&str]] = &[
                            &[$(operations!(@name $needed $($needed_wire)?)),*],
                            $(&[$(operations!(@name $optional $($optional_wire)?)),*],)?
                            $({ let $options = ChangeOptions::FIELDS; &{ $options } },)?
                        ];
                        line.no_field_but(op, &known.concat())?;
                        Ok(Self::$variant {
                            $($needed: line.needed(
                                op,
                                operations!(@name $needed $($needed_wire)?),
                                operations!(@limits $($needed_limits)?),
                            )?,)*
                            $($($optional: line.optional(
                                operations!(@name $optional $($optional_wire)?),
                                operations!(@limits $($optional_limits)?),
                            )?,)*)?
                            $($options: ChangeOptions::read(line)?,)?
                        })
                    })*
                    _ => Err(refusal::unknown_operation(op, Self::OPERATIONS)),
                }
            }

            /// What `ok` holds, by operation.
            #[cfg(feature = "schema")]
            pub(crate) fn answers(
                generator: &mut schemars::SchemaGenerator,
            ) -> serde_json::Map<String, serde_json::Value> {
                [$(($op.to_owned(), generator.subschema_for::<$answer>().into())),*].into_iter().collect()
            }
        }
    };
}

operations! {
    /// The parameter table.
    Describe "describe" {} -> crate::Description;
    /// A scene.
    Get "get" {} optional {
        /// Which one; the active one when absent.
        scene: Option<SceneRef>,
    } -> crate::SceneReply;
    /// Change parameters.
    Set "set" {
        /// The changes.
        params: Changes,
    } optional {
        /// Undo it together with the change before, if that was this client's and of the same
        /// parameters: for a slider that is dragged.
        merge: bool,
    } with options -> crate::ChangeReply;
    /// Load a whole scene.
    SceneLoad "scene.load" {
        /// Which one.
        scene: SceneRef,
    } with options -> crate::ChangeReply;
    /// Save a scene in the library.
    SceneSave "scene.save" {
        /// Its name there.
        name: String,
    } optional {
        /// Which one; the active one when absent.
        scene: Option<SceneRef>,
        /// Whether it may replace a scene of this name.
        replace: bool,
    } -> crate::SceneSaveReply;
    /// The scenes in the library.
    SceneList "scene.list" {} -> crate::SceneListReply;
    /// The differences of two scenes.
    SceneDiff "scene.diff" {
        /// The one.
        from: SceneRef,
    } optional {
        /// The other; the active one when absent.
        to: Option<SceneRef>,
    } -> crate::SceneDiffReply;
    /// Undo the newest change, of any client.
    Undo "undo" {} with options -> crate::ChangeReply;
    /// Redo the change that was undone last.
    Redo "redo" {} with options -> crate::ChangeReply;
    /// Ramp the force up.
    Engage "engage" {} -> crate::StateReply;
    /// Ramp the force down.
    Release "release" {} -> crate::StateReply;
    /// Zero force at once.
    Stop "stop" {} -> crate::StateReply;
    /// Clear a stop or a fault.
    Reset "reset" {} -> crate::StateReply;
    /// The state of the rig and of the daemon.
    Status "status" {} -> crate::Status;
    /// How well the loop keeps time.
    Timing "timing" {} -> crate::Timing;
    /// Every check of the active scene against the rig.
    Advise "advise" {} -> crate::AdviceReply;
    /// The devices that are plugged in.
    Devices "devices" {} optional {
        /// Only the device at this address, which is opened and identified. That resets many
        /// boards.
        probe: Option<String>,
    } -> crate::DevicesReply;
    /// Send events from now on.
    Subscribe "subscribe" {
        /// Topics of the subscription; an empty list ends it.
        topics: Vec<Topic>,
    } optional {
        /// Samples a second; every tick when absent.
        rate_hz: Option<f64>,
        /// Time between sample events, ms; 10 when absent.
        batch_ms: Option<u32> where BATCH,
    } -> crate::SubscribeReply;
    /// The journal: who changed what, and when.
    Log "log" {} optional {
        /// Only entries after this number.
        after: Option<u64>,
        /// Number of entries, the newest; 100 when absent.
        limit: Option<usize>,
    } -> crate::LogReply;
    /// Release the rig should this client close its connection or fall silent.
    Lease "lease" {
        /// Longest silence, ms; 0 ends the lease.
        timeout_ms: u32 where LEASE,
    } -> crate::LeaseReply;
    /// Take the rig alone, to commission it.
    CommissionBegin "commission.begin" {} -> crate::CommissionReply;
    /// Move the handle by a single pulse of force.
    CommissionPulse "commission.pulse" {
        /// Force on the hand, N, positive in the positive direction.
        force_n as "force_N": f64,
    } optional {
        /// Duration of the whole pulse, ms; 200 when absent.
        duration_ms: Option<f64> where PULSE,
    } -> crate::CommissionReply;
    /// The findings so far.
    CommissionStatus "commission.status" {} -> crate::CommissionReply;
    /// Store the findings: the rig counts as commissioned from now on.
    CommissionStore "commission.store" {} optional {
        /// Travel of the handle between its ends, m.
        range_m: Option<f64> where FOUND,
        /// Friction of the rig itself, N.
        friction_n as "friction_N": Option<f64> where FOUND,
    } -> crate::CommissionReply;
    /// Give the rig back, as it was before.
    CommissionEnd "commission.end" {} -> crate::CommissionReply;
}

/// Whether a field that may be left out is left out.
fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}

impl Request {
    /// The active scene.
    #[must_use]
    pub const fn get() -> Self {
        Self::Get { scene: None }
    }

    /// A change of parameters, at once and whatever the revision.
    #[must_use]
    pub fn set(params: Changes) -> Self {
        Self::Set {
            params,
            merge: false,
            options: ChangeOptions::default(),
        }
    }

    /// A whole scene, at once and whatever the revision.
    #[must_use]
    pub fn load(scene: SceneRef) -> Self {
        Self::SceneLoad {
            scene,
            options: ChangeOptions::default(),
        }
    }

    /// The newest change taken back, at once and whatever the revision.
    #[must_use]
    pub fn undo() -> Self {
        Self::Undo {
            options: ChangeOptions::default(),
        }
    }

    /// What was undone brought back, at once and whatever the revision.
    #[must_use]
    pub fn redo() -> Self {
        Self::Redo {
            options: ChangeOptions::default(),
        }
    }

    /// Whether a watcher may ask it: it changes nothing, or makes the rig safer.
    #[must_use]
    pub const fn is_for_watchers(&self) -> bool {
        matches!(
            self,
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
                | Self::Devices { probe: None }
        )
    }
}

/// A request with the number that its answer will carry.
#[derive(Clone, Debug, PartialEq, Serialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Envelope {
    /// Chosen by the client.
    pub id: u64,
    /// What is asked.
    #[serde(flatten)]
    pub request: Request,
}

/// A line that is not a request.
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
                "a whole number of your choice, which its answer will have",
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
        for op in Request::OPERATIONS {
            let more = match *op {
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
