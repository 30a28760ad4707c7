//! The part of docs/control.md that lists every operation, event and type, drawn from the protocol's schema, with
//! examples from the transcripts, which are held again with the real daemon.

use crate::transcript::{Said, Transcript};
use serde_json::Value;
use std::collections::BTreeMap;

/// Where the drawn part begins and ends in the page.
pub const MARKS: [&str; 2] = [
    "<!-- Drawn from the types of haptic-ipc; see tests/src/reference.rs. -->",
    "<!-- End of what is drawn. -->",
];

/// Longest line of an example, letters.
const MAX_LINE: usize = 200;

/// Draws it.
pub fn draw(schema: &Value, transcripts: &[Transcript]) -> String {
    let definitions = &schema["$defs"];
    let examples = examples(transcripts);
    let mut page = String::from("### Operations\n");
    page.push_str(&format!(
        "\n#### {CHANGE}\n\nThe fields of every change:\n\n{}",
        change_options(definitions)
    ));
    for operation in list(&definitions["FromClient"]["Envelope"]["oneOf"]) {
        let op = text(&operation["properties"]["op"]["const"]);
        page.push_str(&format!("\n#### `{op}`\n\n{}\n\n", text(&operation["description"])));
        page.push_str(&fields(operation, "op"));
        let answer = type_of(&definitions["Answers"][op]);
        page.push_str(&format!("Answer: {answer}.\n"));
        if let Some((asked, answered)) = examples.get(op) {
            page.push_str(&format!("\n```text\nC {}\nS {}\n```\n", cut(asked), cut(answered)));
        }
    }
    page.push_str("\n### Events\n");
    for event in list(&definitions["FromServer"]["Event"]["oneOf"]) {
        let name = text(&event["properties"]["event"]["const"]);
        let whole = event["$ref"]
            .as_str()
            .map_or_else(String::new, |_| format!(" It is {}.", type_of(event)));
        page.push_str(&format!("\n#### `{name}`\n\n{}{whole}\n", text(&event["description"])));
    }
    page.push_str("\n### Columns of a row of samples\n\n");
    for cell in list(&definitions["FromServer"]["Sample"]["prefixItems"]) {
        page.push_str(&item(text(&cell["title"]), "", cell, text(&cell["description"])));
    }
    page.push_str("\n### Types\n");
    for (name, definition) in types(definitions) {
        page.push_str(&format!("\n#### {name}\n\n"));
        if let Some(about) = definition["description"].as_str() {
            page.push_str(&format!("{about}\n\n"));
        }
        page.push_str(&body(definition));
    }
    page
}

/// The types of both directions, each once, without those that have a place of their own.
fn types(definitions: &Value) -> BTreeMap<&str, &Value> {
    let own_place = ["Envelope", "Event", "Sample", "ErrorCode"];
    ["FromServer", "FromClient"]
        .iter()
        .flat_map(|direction| definitions[direction].as_object().expect("definitions"))
        .map(|(name, definition)| (name.as_str(), definition))
        .filter(|(name, _)| !own_place.contains(name))
        .collect()
}

/// What a type consists of: fields, words, or one of several types.
fn body(definition: &Value) -> String {
    if definition["properties"].is_object() {
        return fields(definition, "");
    }
    let Some(choices) = ["oneOf", "anyOf"]
        .iter()
        .find_map(|choice| definition[choice].as_array())
    else {
        return format!("{}\n", type_of(definition));
    };
    let mut drawn = String::new();
    for choice in choices {
        let about = choice["description"]
            .as_str()
            .map_or_else(String::new, |about| format!(": {about}"));
        drawn.push_str(&format!("- {}{about}\n", type_of(choice)));
    }
    drawn
}

/// The list of an object's fields, but for one.
fn fields(object: &Value, but: &str) -> String {
    let Some(properties) = object["properties"].as_object() else {
        return String::new();
    };
    let needed: Vec<&str> = object["required"].as_array().into_iter().flatten().map(text).collect();
    let mut drawn = String::new();
    let is_change = CHANGE_OPTIONS.iter().all(|name| properties.contains_key(*name));
    let is_own = |name: &str| name != but && !(is_change && CHANGE_OPTIONS.contains(&name));
    for (name, field) in properties.iter().filter(|(name, _)| is_own(name)) {
        let presence = if needed.contains(&name.as_str()) { "" } else { "?" };
        let about = field["description"].as_str().unwrap_or_default();
        drawn.push_str(&item(name, presence, field, about));
    }
    for choice in object["oneOf"].as_array().into_iter().flatten() {
        for (name, field) in choice["properties"].as_object().into_iter().flatten() {
            let about = choice["description"].as_str().unwrap_or_default();
            drawn.push_str(&item(name, " or", field, about));
        }
    }
    if !drawn.is_empty() {
        drawn.push('\n');
    }
    if is_change {
        let anchor = CHANGE.to_lowercase().replace(' ', "-");
        drawn.push_str(&format!("And the [{}](#{anchor}).\n\n", CHANGE.to_lowercase()));
    }
    drawn
}

/// The fields that every change has.
const CHANGE_OPTIONS: [&str; 5] = ["if_revision", "ramp_ms", "dry_run", "at_tick", "anyway"];

/// The heading above them.
const CHANGE: &str = "Options of a change";

/// The list of the fields that every change has.
fn change_options(definitions: &Value) -> String {
    let operations = list(&definitions["FromClient"]["Envelope"]["oneOf"]);
    let undo = operations
        .iter()
        .find(|operation| operation["properties"]["op"]["const"] == "undo");
    let properties = &undo.expect("it is an operation")["properties"];
    CHANGE_OPTIONS
        .iter()
        .map(|name| {
            let field = &properties[name];
            item(name, "?", field, text(&field["description"]))
        })
        .collect()
}

/// A field in the list of its object: its name, whether it may be absent, its type and its meaning.
fn item(name: &str, presence: &str, schema: &Value, about: &str) -> String {
    format!("- `{name}`{presence} ({}): {about}\n", type_of(schema))
}

/// A type in words.
fn type_of(schema: &Value) -> String {
    if let Some(path) = schema["$ref"].as_str() {
        let name = path.rsplit('/').next().unwrap_or_default();
        // Two types have a place of their own in the page.
        let heading = match name {
            "Sample" => "columns-of-a-row-of-samples".to_owned(),
            "ErrorCode" => "why-a-request-was-refused".to_owned(),
            _ => name.to_lowercase(),
        };
        return format!("[{name}](#{heading})");
    }
    if let Some(word) = schema.get("const") {
        return format!("`{word}`");
    }
    if let Some(choices) = ["oneOf", "anyOf"].iter().find_map(|choice| schema[choice].as_array()) {
        let choices: Vec<String> = choices
            .iter()
            .filter(|choice| choice["type"] != "null")
            .map(type_of)
            .collect();
        return choices.join(" or ");
    }
    let kind = match &schema["type"] {
        Value::Array(kinds) => kinds.first().map_or("", |kind| text(kind)),
        kind => kind.as_str().unwrap_or("any"),
    };
    let range = match (schema["minimum"].as_f64(), schema["maximum"].as_f64()) {
        (Some(min), Some(max)) => format!(" {min} to {max}"),
        _ => String::new(),
    };
    match kind {
        "integer" => format!("integer{range}"),
        "number" => format!("number{range}"),
        "string" => "string".to_owned(),
        "boolean" => "boolean".to_owned(),
        "array" if schema["items"].is_object() => format!("list of {}", type_of(&schema["items"])),
        "array" => "list".to_owned(),
        "object" if schema["additionalProperties"].is_object() => {
            format!("object of {}", type_of(&schema["additionalProperties"]))
        }
        "object" => {
            let names: Vec<String> = schema["properties"]
                .as_object()
                .into_iter()
                .flatten()
                .map(|(name, field)| match field.get("const") {
                    Some(word) => format!("`{name}`: `{word}`"),
                    None => format!("`{name}`"),
                })
                .collect();
            if names.is_empty() {
                "object".to_owned()
            } else {
                format!("object with {}", names.join(", "))
            }
        }
        other => other.to_owned(),
    }
}

/// For each operation the first request of a transcript that was answered `ok`, and its answer.
fn examples(transcripts: &[Transcript]) -> BTreeMap<String, (String, String)> {
    let mut found = BTreeMap::new();
    for transcript in transcripts {
        for (connection, said, _) in &transcript.lines {
            let Said::Client(asked) = said else { continue };
            let Ok(request) = serde_json::from_str::<Value>(asked) else {
                continue;
            };
            let answer = transcript.lines.iter().find_map(|(by, said, _)| match said {
                Said::Server(line) if by == connection && line["id"] == request["id"] && line.get("ok").is_some() => {
                    Some(line.to_string())
                }
                _ => None,
            });
            if let (Some(op), Some(answer)) = (request["op"].as_str(), answer) {
                found.entry(op.to_owned()).or_insert((asked.clone(), answer));
            }
        }
    }
    found
}

fn cut(line: &str) -> String {
    match line.char_indices().nth(MAX_LINE) {
        Some((end, _)) => format!("{}...", &line[..end]),
        None => line.to_owned(),
    }
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}

fn list(value: &Value) -> &[Value] {
    value.as_array().expect("a list")
}
