//! The protocol as a JSON Schema, drawn from the types, for clients in other languages.
//!
//! `#/$defs/RequestLine` is a line that a client sends and `#/$defs/ServerLine` one that it reads;
//! `#/$defs/Answers/OP` is what `ok` holds in the answer to an operation. A line that is sent must not
//! have further fields; a line that is read may, from a later server.

use crate::{Envelope, Event, Hello, Request, WireError};
use haptic_core::parameters::TABLE;
use schemars::generate::SchemaSettings;
use schemars::json_schema;
use serde_json::{Value, json};

/// The schema of all lines.
///
/// # Panics
/// Never: schemas are objects.
#[must_use]
pub fn protocol() -> Value {
    let at = |path: &'static str, settings: SchemaSettings| {
        settings.with(|settings| settings.definitions_path = path.into())
    };
    let mut sent = at("/$defs/FromClient", SchemaSettings::draft2020_12().for_deserialize()).into_generator();
    let mut read = at("/$defs/FromServer", SchemaSettings::draft2020_12().for_serialize()).into_generator();

    let request: Value = sent.subschema_for::<Envelope>().into();
    let hello = read.subschema_for::<Hello>();
    let event = read.subschema_for::<Event>();
    let error = read.subschema_for::<WireError>();
    let answers = Request::answers(&mut read);
    let any_answer: Vec<Value> = answers
        .keys()
        .map(|op| json!({ "$ref": format!("#/$defs/Answers/{op}") }))
        .collect();
    let id = json!({ "type": ["integer", "null"], "minimum": 0 });

    let mut from_client = sent.take_definitions(true);
    from_client.values_mut().for_each(accept_symbols);
    if let Some(Value::Array(words)) = from_client.get_mut("Reseat").and_then(|reseat| reseat.get_mut("oneOf")) {
        // Another name, which serde knows and the generator does not.
        words.push(json!({ "type": "string", "const": "published", "description": "The same as `slides`." }));
    }
    if let Some(Value::Object(envelope)) = from_client.get_mut("Envelope") {
        // Stated of the operations' own fields in their types; the number beside them is not one of
        // those.
        envelope.insert("unevaluatedProperties".to_owned(), Value::Bool(false));
    }
    let mut from_server = read.take_definitions(true);
    from_server.values_mut().for_each(allow_more);
    let mut schema: Value = json_schema!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": format!("The control protocol of hapticd, version {}", crate::PROTOCOL_VERSION),
        "description": "Generated from the types of haptic-ipc, whose documentation is the specification.",
        "oneOf": [{ "$ref": "#/$defs/RequestLine" }, { "$ref": "#/$defs/ServerLine" }],
        "$defs": {
            "RequestLine": request,
            "ServerLine": {
                "oneOf": [
                    { "type": "object", "properties": { "hello": hello }, "required": ["hello"] },
                    {
                        "type": "object",
                        "properties": { "id": id, "ok": { "anyOf": any_answer } },
                        "required": ["id", "ok"],
                    },
                    { "type": "object", "properties": { "id": id, "error": error }, "required": ["id", "error"] },
                    event,
                ],
            },
            "Answers": answers,
            "FromClient": from_client,
            "FromServer": from_server,
        },
    })
    .into();
    plain_words(&mut schema);
    schema
}

/// Descriptions are the types' own, whose links lead nowhere here: "[`Thing`](place)" becomes
/// "`Thing`".
fn plain_words(schema: &mut Value) {
    match schema {
        Value::Object(object) => {
            for (keyword, value) in object {
                match value {
                    Value::String(text) if keyword == "description" => *text = without_links(text),
                    _ => plain_words(value),
                }
            }
        }
        Value::Array(items) => items.iter_mut().for_each(plain_words),
        _ => {}
    }
}

fn without_links(text: &str) -> String {
    let mut plain = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, linked)) = rest.split_once("[`") {
        let Some((name, after)) = linked.split_once("`]") else {
            break;
        };
        plain.push_str(before);
        plain.push('`');
        plain.push_str(name.trim_start_matches("crate::"));
        plain.push('`');
        let place = after.strip_prefix('(').and_then(|place| place.split_once(')'));
        rest = place.map_or(after, |(_, after)| after);
    }
    plain.push_str(rest);
    plain.replace('\n', " ")
}

/// Parameters of a scene go by their symbols as well: one of the names, and no two.
fn accept_symbols(schema: &mut Value) {
    let Value::Object(object) = schema else {
        if let Value::Array(items) = schema {
            items.iter_mut().for_each(accept_symbols);
        }
        return;
    };
    object.values_mut().for_each(accept_symbols);
    // Only where nothing else may stand: there a symbol would be refused.
    if object.get("additionalProperties") != Some(&Value::Bool(false)) {
        return;
    }
    let Some(Value::Object(properties)) = object.get_mut("properties") else {
        return;
    };
    let named: Vec<_> = TABLE.iter().filter(|row| properties.contains_key(row.name)).collect();
    let mut one_of_each = Vec::new();
    for row in named {
        let meant = properties[row.name].clone();
        let names: Vec<&str> = [row.name, row.symbol]
            .into_iter()
            .chain(row.aliases.iter().copied())
            .collect();
        for name in &names {
            properties.entry(*name).or_insert_with(|| meant.clone());
        }
        one_of_each.push((row.name, names));
    }
    let Some(Value::Array(required)) = object.get_mut("required") else {
        return;
    };
    let mut choices = Vec::new();
    for (name, names) in one_of_each {
        let before = required.len();
        required.retain(|wanted| wanted != name);
        if required.len() < before {
            let each: Vec<Value> = names.iter().map(|name| json!({ "required": [name] })).collect();
            choices.push(json!({ "oneOf": each }));
        }
    }
    if !choices.is_empty() {
        object.insert("allOf".to_owned(), choices.into());
    }
}

/// What a server says may have more fields.
fn allow_more(schema: &mut Value) {
    match schema {
        Value::Object(object) => {
            object.retain(|keyword, value| {
                !(["additionalProperties", "unevaluatedProperties"].contains(&keyword.as_str()) && value == false)
            });
            object.values_mut().for_each(allow_more);
        }
        Value::Array(items) => items.iter_mut().for_each(allow_more),
        _ => {}
    }
}
