//! Why a line is no request, in words for people and with the field's name for programs.
//!
//! Only a line that was refused comes here. What is a request is decided by the types alone, at no cost for this; here the line is gone through once more,
//! field by field, in the order in which it was written.

use crate::error::{ErrorCode, WireError};
use crate::nearest::meant_or_semicolon;
use crate::quantity;
use crate::request::{BATCH_MS, LEASE_TIMEOUT_MS};
use haptic_core::friction::{Friction, LAWS};
use haptic_core::parameters::TABLE;
use haptic_core::scene::{Block, Coupling};
use haptic_core::{Directional, ParameterKey};
use serde::de::{DeserializeOwned, MapAccess, Visitor};
use serde::{Deserialize, Deserializer};
use serde_json::value::RawValue;
use std::collections::HashSet;
use std::fmt;

/// The fields of an operation beside `id` and `op`: those that it needs, and those that may be left out.
pub(crate) struct Operation {
    pub(crate) name: &'static str,
    pub(crate) needed: &'static [&'static str],
    pub(crate) optional: &'static [&'static str],
}

const fn operation(
    name: &'static str,
    needed: &'static [&'static str],
    optional: &'static [&'static str],
) -> Operation {
    Operation { name, needed, optional }
}

/// The operations, in the order in which messages list them.
pub(crate) const OPERATIONS: [Operation; 25] = [
    operation("describe", &[], &[]),
    operation("get", &[], &["scene"]),
    operation("set", &["params"], &["if_revision", "ramp_ms", "dry_run", "merge"]),
    operation("scene.load", &["scene"], &["if_revision", "ramp_ms", "dry_run"]),
    operation("scene.save", &["name"], &["scene", "replace"]),
    operation("scene.list", &[], &[]),
    operation("scene.diff", &["from"], &["to"]),
    operation("undo", &[], &["if_revision", "ramp_ms", "dry_run"]),
    operation("redo", &[], &["if_revision", "ramp_ms", "dry_run"]),
    operation("engage", &[], &[]),
    operation("release", &[], &[]),
    operation("stop", &[], &[]),
    operation("reset", &[], &[]),
    operation("status", &[], &[]),
    operation("timing", &[], &[]),
    operation("advise", &[], &[]),
    operation("devices", &[], &["probe"]),
    operation("subscribe", &["topics"], &["rate_hz", "batch_ms"]),
    operation("log", &[], &["after", "limit"]),
    operation("lease", &["timeout_ms"], &[]),
    operation("commission.begin", &[], &[]),
    operation("commission.pulse", &["force_N"], &["duration_ms"]),
    operation("commission.status", &[], &[]),
    operation("commission.store", &[], &["range_m", "friction_N"]),
    operation("commission.end", &[], &[]),
];

/// What can be subscribed to.
const TOPICS: [&str; 4] = ["state", "timing", "samples", "log"];

/// What a stuck spring can be anchored to.
const RESEATS: [&str; 3] = ["continuous", "slides", "published"];

/// What a field holds.
#[derive(Clone, Copy)]
enum Kind {
    /// A whole number up to `largest`, which must lie between two limits.
    Whole {
        largest: u64,
        min: u64,
        max: u64,
        unit: &'static str,
    },
    /// A number in a unit.
    Number(&'static str),
    /// True or false.
    Flag,
    Text,
    Scene,
    Topics,
    Params,
}

/// A count, as large as it may be.
const COUNT: Kind = Kind::Whole {
    largest: u64::MAX,
    min: 0,
    max: u64::MAX,
    unit: "1",
};

impl Kind {
    /// That of a field, which is the same in every operation.
    fn of(field: &str) -> Self {
        let milliseconds = |range: std::ops::RangeInclusive<u32>| Self::Whole {
            largest: u32::MAX.into(),
            min: (*range.start()).into(),
            max: (*range.end()).into(),
            unit: "ms",
        };
        match field {
            "params" => Self::Params,
            "scene" | "from" | "to" => Self::Scene,
            "topics" => Self::Topics,
            "timeout_ms" => milliseconds(LEASE_TIMEOUT_MS),
            "batch_ms" => milliseconds(BATCH_MS),
            "ramp_ms" | "duration_ms" => Self::Number("ms"),
            "force_N" | "friction_N" => Self::Number("N"),
            "range_m" => Self::Number("m"),
            "rate_hz" => Self::Number("Hz"),
            "dry_run" | "merge" | "replace" => Self::Flag,
            "name" | "probe" => Self::Text,
            _ => COUNT,
        }
    }

    /// What is expected, for people.
    fn wanted(self) -> String {
        match self {
            Self::Whole { max: u64::MAX, .. } => "a whole number from 0 on".to_owned(),
            Self::Whole { min, max, unit, .. } => format!("a whole number from {min} to {max} {unit}"),
            Self::Number(unit) => format!("a number of {unit}"),
            Self::Flag => "true or false".to_owned(),
            Self::Text => "a text in quotes".to_owned(),
            Self::Scene => {
                "a scene: the number of a revision, a name of the library in quotes, or the scene itself as an object"
                    .to_owned()
            }
            Self::Topics => format!("a list of topics: {}", TOPICS.join(", ")),
            Self::Params => r#"an object of parameters and numbers, as in {"mass":1.5}"#.to_owned(),
        }
    }
}

/// A line as it was written.
pub(crate) struct Line<'a>(Fields<'a>);

impl<'a> Line<'a> {
    /// Reads an object; nothing where the line is none.
    pub(crate) fn read(line: &'a str) -> Option<Self> {
        serde_json::from_str(line).ok().map(Self)
    }

    /// The number of the request.
    pub(crate) fn id(&self) -> Option<u64> {
        self.0.all("id").find_map(|id| id.parse().ok())
    }

    /// Whether it is meant as a stop, whatever else it says.
    pub(crate) fn means_stop(&self) -> bool {
        self.0.all("op").any(|op| text(op).as_deref() == Some("stop"))
    }
}

/// The fields of an object in their order, each with its value as it was written. One that is given twice is there twice.
struct Fields<'a>(Vec<(String, &'a str)>);

impl<'a> Fields<'a> {
    fn all(&self, name: &str) -> impl Iterator<Item = &'a str> {
        self.0
            .iter()
            .filter(move |(field, _)| field == name)
            .map(|(_, value)| *value)
    }

    /// The first field that has come before, under this name or another.
    fn given_twice(&self) -> Option<&str> {
        let mut come = HashSet::new();
        let mut names = self.0.iter().map(|(name, _)| name.as_str());
        // In one pass: a line has room for thousands of fields, and others wait meanwhile.
        names.find(|name| {
            let row = TABLE.iter().find(|row| row.is_called(name));
            !come.insert(row.map_or(*name, |row| row.name))
        })
    }
}

impl<'de: 'a, 'a> Deserialize<'de> for Fields<'a> {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Object;
        impl<'de> Visitor<'de> for Object {
            type Value = Vec<(String, &'de str)>;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self::Value, A::Error> {
                let mut fields = Vec::new();
                while let Some((name, value)) = map.next_entry::<String, &'de RawValue>()? {
                    fields.push((name, value.get()));
                }
                Ok(fields)
            }
        }
        deserializer.deserialize_map(Object).map(Self)
    }
}

/// The refusal of a line.
pub(crate) fn explain(text: &str, line: Option<&Line<'_>>, error: &serde_json::Error) -> WireError {
    if let Some(Line(fields)) = line {
        let refused = check_line(fields).err();
        // Nothing else is known to be refused; what is not known is told as serde tells it.
        return refused.unwrap_or_else(|| WireError::new(ErrorCode::BadRequest, error.to_string()));
    }
    if serde_json::from_str::<serde::de::IgnoredAny>(text).is_ok() && !text.trim_start().starts_with('{') {
        let message = r#"the line is no request: that is an object, as in {"id":1,"op":"get"}"#;
        return WireError::new(ErrorCode::BadRequest, message);
    }
    let message = format!("the line is not JSON: {error} (NaN and infinity are not JSON either)");
    WireError::new(ErrorCode::BadJson, message)
}

fn check_line(fields: &Fields<'_>) -> Result<(), WireError> {
    if let Some(name) = fields.given_twice() {
        return Err(twice(name));
    }
    let id = fields.all("id").next();
    let wanted = "a whole number from 0 to 2^64 - 1";
    match id {
        None => {
            return Err(missing(
                "the line",
                "id",
                "a whole number of your choice, which its answer will have",
            ));
        }
        Some(id) if id.parse::<u64>().is_err() => return Err(bad("id", "id", id, wanted)),
        Some(_) => {}
    }
    let names: Vec<&str> = OPERATIONS.iter().map(|operation| operation.name).collect();
    let wanted = "the name of an operation in quotes";
    let Some(op) = fields.all("op").next() else {
        return Err(missing("the line", "op", wanted));
    };
    let Some(op) = text(op) else {
        return Err(bad("op", "op", op, wanted));
    };
    let Some(operation) = OPERATIONS.iter().find(|operation| operation.name == op) else {
        let op = shortened(&op);
        let message = format!(
            "there is no operation `{op}`{} there are {}",
            meant_or_semicolon(&op, &names),
            names.join(", ")
        );
        return Err(WireError::new(ErrorCode::UnknownOp, message).about("op"));
    };
    let has: Vec<&str> = operation.needed.iter().chain(operation.optional).copied().collect();
    for (name, value) in &fields.0 {
        if ["id", "op"].contains(&name.as_str()) {
            continue;
        }
        if !has.contains(&name.as_str()) {
            return Err(unknown_field(&op, name, &has));
        }
        let kind = Kind::of(name);
        let left_out = *value == "null" && operation.optional.contains(&name.as_str()) && !matches!(kind, Kind::Flag);
        if !left_out {
            check(name, kind, value)?;
        }
    }
    match operation.needed.iter().find(|name| fields.all(name).next().is_none()) {
        Some(name) => Err(missing(&format!("`{op}`"), name, &Kind::of(name).wanted())),
        None => Ok(()),
    }
}

/// Whether a field holds what it should.
fn check(name: &str, kind: Kind, value: &str) -> Result<(), WireError> {
    let refused = || Err(bad(name, name, value, &kind.wanted()));
    match kind {
        Kind::Whole {
            largest,
            min,
            max,
            unit,
        } => match value.parse::<u64>() {
            Ok(number) if number <= largest => Ok(()),
            _ if is_whole(value) => Err(beyond(name, value, min, max, unit)),
            _ => refused(),
        },
        Kind::Number(unit) => match value.parse::<f64>() {
            Ok(number) if number.is_finite() => Ok(()),
            Ok(_) => Err(too_large(name, value, unit)),
            Err(_) => refused(),
        },
        Kind::Flag if ["true", "false"].contains(&value) => Ok(()),
        Kind::Text if text(value).is_some() => Ok(()),
        Kind::Topics => topics(name, value),
        Kind::Params => match serde_json::from_str::<Fields<'_>>(value) {
            Ok(fields) => fields
                .0
                .iter()
                .try_for_each(|(name, value)| parameter(name, name, value, true)),
            Err(_) => refused(),
        },
        Kind::Scene => scene(name, value),
        Kind::Flag | Kind::Text => refused(),
    }
}

fn topics(name: &str, value: &str) -> Result<(), WireError> {
    let refused = || bad(name, name, value, &Kind::Topics.wanted());
    let items: Vec<&RawValue> = serde_json::from_str(value).map_err(|_| refused())?;
    for item in items {
        let topic = text(item.get()).ok_or_else(refused)?;
        word(name, name, &topic, "topic", &TOPICS)?;
    }
    Ok(())
}

fn scene(name: &str, value: &str) -> Result<(), WireError> {
    if text(value).is_some() || value.parse::<u64>().is_ok() {
        return Ok(());
    }
    if is_whole(value) {
        return Err(beyond(name, value, 0, u64::MAX, "1"));
    }
    let Ok(fields) = serde_json::from_str::<Fields<'_>>(value) else {
        return Err(bad(name, name, value, &Kind::Scene.wanted()));
    };
    if let Some(twice_given) = fields.given_twice() {
        return Err(twice(twice_given));
    }
    const PARTS: [&str; 4] = ["name", "block", "coupling", "friction"];
    for (part, value) in &fields.0 {
        let place = format!("{name}.{part}");
        match part.as_str() {
            "name" if text(value).is_some() => {}
            "name" => return Err(bad(&place, part, value, &Kind::Text.wanted())),
            "block" | "coupling" if *value == "null" => {}
            "block" => part_of_scene::<Block>(&place, part, value)?,
            "coupling" => part_of_scene::<Coupling>(&place, part, value)?,
            "friction" => part_of_scene::<Friction>(&place, part, value)?,
            _ => return Err(unknown_field(name, part, &PARTS)),
        }
    }
    match fields.all("friction").next() {
        Some(_) => Ok(()),
        None => Err(missing(
            &format!("`{name}`"),
            "friction",
            "an object with the `law` and its parameters",
        )),
    }
}

/// Checks the block, the coupling or the friction of a scene. Which parameters it has is known to its type.
fn part_of_scene<T: DeserializeOwned>(place: &str, name: &str, value: &str) -> Result<(), WireError> {
    let Ok(fields) = serde_json::from_str::<Fields<'_>>(value) else {
        return Err(bad(place, name, value, "an object of parameters and numbers"));
    };
    if let Some(name) = fields.given_twice() {
        return Err(twice(name));
    }
    for (name, value) in &fields.0 {
        let place = format!("{place}.{name}");
        let known: &[&str] = match name.as_str() {
            "law" => &LAWS,
            "reseat" => &RESEATS,
            _ => {
                if let Some(row) = TABLE.iter().find(|row| row.is_called(name)) {
                    parameter(&place, name, value, row.directional)?;
                }
                continue;
            }
        };
        let Some(said) = text(value) else {
            return Err(bad(&place, name, value, &format!("one of {}", known.join(", "))));
        };
        word(&place, name, &said, name, known)?;
    }
    let Err(error) = serde_json::from_str::<T>(value) else {
        return Ok(());
    };
    // Its texts are the only place where serde names the culprit.
    let message = error.to_string();
    let mut quoted = message.split('`').skip(1).step_by(2);
    match quoted.next() {
        Some(field) if message.starts_with("unknown field") => {
            Err(unknown_field(place, field, &quoted.collect::<Vec<_>>()))
        }
        Some(field) if message.starts_with("missing field") => {
            let wanted = match TABLE.iter().find(|row| row.is_called(field)) {
                Some(row) => number(row.unit, row.directional),
                None => format!("one of {}", LAWS.join(", ")),
            };
            Err(missing(&format!("`{place}`"), field, &wanted))
        }
        _ => Err(WireError::new(ErrorCode::BadRequest, format!("{place}: {message}")).about(name)),
    }
}

/// Checks the value of a parameter, which may have one for each direction where it is directional.
fn parameter(place: &str, name: &str, value: &str, directional: bool) -> Result<(), WireError> {
    let key = name.parse::<ParameterKey>().ok();
    let info = key.map(|key| key.parameter.info());
    let unit = info.map_or("1", |info| info.unit);
    let refused = |value: &str| {
        let mut error = bad(
            place,
            name,
            value,
            &number(unit, info.is_some_and(|info| info.directional)),
        );
        if let Some(meant) = text(value).and_then(|text| quantity::parse(&text, unit).ok()) {
            error.message.push_str(&format!("; write {meant}"));
        }
        error
    };
    if directional && serde_json::from_str::<Directional>(value).is_ok() {
        return Ok(());
    }
    if directional && let Ok(pair) = serde_json::from_str::<Fields<'_>>(value) {
        if let Some(direction) = pair.given_twice() {
            return Err(twice(direction));
        }
        let numbers = pair.0.iter().filter(|(_, value)| value.parse::<f64>().is_err());
        return Err(refused(numbers.map(|(_, value)| *value).next().unwrap_or(value)));
    }
    match value.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(()),
        Ok(_) => {
            let mut error = too_large(place, value, unit).about(name);
            if let Some(info) = info {
                error = error.within(f64::INFINITY, info.min, info.max, info.unit);
            }
            Err(error)
        }
        Err(_) => Err(refused(value)),
    }
}

fn word(place: &str, name: &str, said: &str, what: &str, known: &[&str]) -> Result<(), WireError> {
    if known.contains(&said) {
        return Ok(());
    }
    let said = shortened(said);
    let message = format!(
        "{place}: there is no {what} `{said}`{} there are {}",
        meant_or_semicolon(&said, known),
        known.join(", ")
    );
    Err(WireError::new(ErrorCode::BadRequest, message).about(name))
}

fn bad(place: &str, name: &str, value: &str, wanted: &str) -> WireError {
    let message = format!("{place} = {} is not {wanted}", shortened(value));
    let error = WireError::new(ErrorCode::BadRequest, message).about(name);
    match value.parse::<f64>() {
        Ok(number) => error.given(number),
        Err(_) => error,
    }
}

fn beyond(name: &str, value: &str, min: u64, max: u64, unit: &str) -> WireError {
    let shown = if unit == "1" { String::new() } else { format!(" {unit}") };
    let message = format!(
        "{name} = {}{shown} is out of range: it must be from {min} to {max}{shown}",
        shortened(value)
    );
    #[expect(
        clippy::cast_precision_loss,
        reason = "limits are small, or the largest number there is"
    )]
    let (min, max) = (min as f64, max as f64);
    let number = value.parse().unwrap_or(f64::NAN);
    WireError::new(ErrorCode::OutOfRange, message)
        .about(name)
        .within(number, min, max, unit)
}

fn too_large(place: &str, value: &str, unit: &str) -> WireError {
    let shown = if unit == "1" { String::new() } else { format!(" {unit}") };
    let value = shortened(value);
    let message = format!("{place} = {value}{shown} is out of range: it is more than a number here can be");
    WireError::new(ErrorCode::BadRequest, message).about(place)
}

fn twice(name: &str) -> WireError {
    WireError::new(ErrorCode::GivenTwice, format!("{} is given twice", shortened(name))).about(name)
}

fn missing(place: &str, name: &str, wanted: &str) -> WireError {
    WireError::new(ErrorCode::BadRequest, format!("{place} has no `{name}`: {wanted}")).about(name)
}

fn unknown_field(place: &str, name: &str, has: &[&str]) -> WireError {
    let (shown, meant) = (shortened(name), meant_or_semicolon(name, has));
    let has = if has.is_empty() {
        "it has none but `id` and `op`".to_owned()
    } else {
        format!("it has {}", has.join(", "))
    };
    let message = format!("`{place}` has no field `{shown}`{meant} {has}");
    WireError::new(ErrorCode::UnknownField, message).about(name)
}

/// What a parameter takes.
fn number(unit: &str, directional: bool) -> String {
    let number = if unit == "1" {
        "a number".to_owned()
    } else {
        format!("a number in {unit}")
    };
    if directional {
        format!(r#"{number}, or one for each direction as in {{"positive":5,"negative":3}}"#)
    } else {
        number
    }
}

fn text(value: &str) -> Option<String> {
    serde_json::from_str(value).ok()
}

/// Whether JSON's text of a number is that of a whole one, however long and of either sign.
fn is_whole(value: &str) -> bool {
    let digits = value.strip_prefix('-').unwrap_or(value);
    !digits.is_empty() && digits.bytes().all(|digit| digit.is_ascii_digit())
}

/// As much of what was given as a message can hold.
fn shortened(value: &str) -> String {
    const LONGEST: usize = 80;
    match value.char_indices().nth(LONGEST) {
        Some((end, _)) => format!("{}...", &value[..end]),
        None => value.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::request::{BadLine, Envelope};
    use ErrorCode::{BadRequest, GivenTwice, OutOfRange, UnknownField, UnknownOp};
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
    fn a_long_value_is_cut_in_the_message() {
        let line = format!(r#"{{"id":1,"op":"scene.save","name":[{}1]}}"#, "1,".repeat(10_000));
        let message = refused(&line).message;
        assert!(message.len() < 200 && message.contains("..."), "{message}");
    }

    #[test]
    fn the_operations_and_their_fields_are_those_of_the_types() {
        for Operation { name, needed, optional } in &OPERATIONS {
            let error = serde_json::from_str::<Envelope>(&format!(r#"{{"id":1,"op":"{name}","colour":1}}"#));
            let message = error.expect_err("no colour").to_string();
            assert!(message.starts_with("unknown field `colour`"), "{message}");
            let sorted = |names: &mut dyn Iterator<Item = &'_ str>| {
                let mut names: Vec<String> = names.map(str::to_owned).collect();
                names.sort_unstable();
                names
            };
            let listed = sorted(&mut needed.iter().chain(*optional).copied());
            assert_eq!(listed, sorted(&mut message.split('`').skip(3).step_by(2)), "{name}");
        }
        let error = serde_json::from_str::<Envelope>(r#"{"id":1,"op":"dance"}"#).expect_err("no dance");
        assert_eq!(
            error.to_string().matches('`').count(),
            2 * (OPERATIONS.len() + 1),
            "{error}"
        );
        let error = serde_json::from_str::<Vec<crate::Topic>>(r#"["weather"]"#).expect_err("no weather");
        for topic in TOPICS {
            assert!(error.to_string().contains(&format!("`{topic}`")), "{error}");
        }
        assert_eq!(
            error.to_string().matches('`').count(),
            2 * (TOPICS.len() + 1),
            "{error}"
        );
        let error = serde_json::from_str::<haptic_core::friction::Reseat>(r#""x""#).expect_err("no x");
        for reseat in RESEATS {
            assert!(error.to_string().contains(&format!("`{reseat}`")), "{error}");
        }
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

    fn line() -> impl Strategy<Value = String> {
        let op = prop::sample::select(OPERATIONS.iter().map(|operation| operation.name).collect::<Vec<_>>());
        let names: Vec<&str> = OPERATIONS
            .iter()
            .flat_map(|operation| operation.needed.iter().chain(operation.optional))
            .copied()
            .chain(["id", "op", "colour"])
            .collect();
        let field = (prop::sample::select(names), value());
        (op, prop::collection::vec(field, 0..4)).prop_map(|(op, fields)| {
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
            if let Err(BadLine { error, .. }) = Envelope::parse(&line) && error.code != ErrorCode::BadJson {
                prop_assert!(error.param.is_some(), "{line}: {error}");
                prop_assert!(is_plain(&error.message), "{line}: {error}");
            }
        }
    }
}
