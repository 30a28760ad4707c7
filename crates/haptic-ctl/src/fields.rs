//! `--json=FIELDS`: the fields of the JSON that are printed.
//!
//! A field that an answer may have and has not is null; one that no such answer has is an error. What an answer may
//! have says the schema of the protocol; what else is printed says it by what it holds.

use crate::failure::Failure;
use haptic_core::nearest::meant_or_semicolon;
use haptic_ipc::Request;
use serde_json::{Map, Value, json};
use std::str::FromStr;

/// The protocol's schema, as docs/control.md names it.
const PROTOCOL: &str = include_str!("../../../docs/control-protocol.schema.json");

/// Names of fields, those within another joined to it by dots: `state,device.description`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Fields(Vec<Vec<String>>);

impl FromStr for Fields {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let path = |text: &str| -> Vec<String> { text.split('.').map(|name| name.trim().to_owned()).collect() };
        let paths: Vec<Vec<String>> = text.split(',').map(path).collect();
        if paths.iter().flatten().any(String::is_empty) {
            return Err(format!(
                "`{text}`: names of fields are joined by commas, and those within another by dots, as in \
                 state,device.description"
            ));
        }
        Ok(Self(paths))
    }
}

impl Fields {
    /// Refuses a field that what is printed never has.
    ///
    /// # Errors
    /// The first such field, with those that there are.
    pub(crate) fn check(&self, schema: &Schema) -> Result<(), Failure> {
        self.0.iter().try_for_each(|path| {
            let mut nodes = schema.nodes(&[&schema.what]);
            for (depth, name) in path.iter().enumerate() {
                let within = schema.field(&nodes, name);
                if within.is_empty() {
                    // Only the answer shows what stands there.
                    return if schema.is_open(&nodes) {
                        Ok(())
                    } else {
                        Err(unknown(path, depth, &schema.names(&nodes)))
                    };
                }
                nodes = within;
            }
            Ok(())
        })
    }

    /// The fields of a value. Lists are gone through.
    ///
    /// # Errors
    /// The value has no such field, and would not have one at another time.
    pub(crate) fn of(&self, value: &Value, schema: Option<&Schema>) -> Result<Value, Failure> {
        if let Value::Array(items) = value {
            let picked: Result<Vec<Value>, Failure> = items.iter().map(|item| self.of(item, schema)).collect();
            return picked.map(Value::Array);
        }
        let mut picked = Value::Object(Map::new());
        for path in &self.0 {
            let nodes = schema.map(|schema| (schema, schema.nodes(&[&schema.what])));
            pick(&mut picked, value, path, 0, nodes)?;
        }
        Ok(picked)
    }
}

/// Copies what the path leads to, with the objects and lists on its way.
fn pick(
    picked: &mut Value,
    value: &Value,
    path: &[String],
    depth: usize,
    schema: Option<(&Schema, Vec<&Value>)>,
) -> Result<(), Failure> {
    let Some(name) = path.get(depth) else {
        picked.clone_from(value);
        return Ok(());
    };
    let within = schema.map(|(schema, nodes)| (schema, schema.field(&nodes, name), nodes));
    match value {
        Value::Object(object) => {
            let Value::Object(into) = picked else { return Ok(()) };
            let Some(found) = object.get(name) else {
                if within.as_ref().is_some_and(|(_, within, _)| !within.is_empty()) {
                    into.entry(name).or_insert(Value::Null);
                    return Ok(());
                }
                let mut known: Vec<&str> = object.keys().map(String::as_str).collect();
                if let Some((schema, _, nodes)) = &within {
                    known.extend(schema.names(nodes));
                    known.sort_unstable();
                    known.dedup();
                }
                return Err(unknown(path, depth, &known));
            };
            let place = into
                .entry(name)
                .or_insert_with(|| empty_like(found, depth + 1 == path.len()));
            pick(
                place,
                found,
                path,
                depth + 1,
                within.map(|(schema, within, _)| (schema, within)),
            )
        }
        Value::Array(items) => {
            let Value::Array(into) = picked else { return Ok(()) };
            into.resize(items.len(), json!({}));
            let nodes = within.map(|(schema, _, nodes)| (schema, nodes));
            into.iter_mut()
                .zip(items)
                .try_for_each(|(into, item)| pick(into, item, path, depth, nodes.clone()))
        }
        // Of what is absent, all is.
        Value::Null => Ok(()),
        _ => Err(unknown(path, depth, &[])),
    }
}

/// What the fields of a value are put into.
fn empty_like(value: &Value, is_last: bool) -> Value {
    match value {
        Value::Object(_) if !is_last => json!({}),
        Value::Array(_) if !is_last => json!([]),
        _ => Value::Null,
    }
}

fn unknown(path: &[String], depth: usize, known: &[&str]) -> Failure {
    let name = &path[depth];
    let whole = path.join(".");
    let place = match depth {
        0 => "the answer".to_owned(),
        _ => format!("`{}`", path[..depth].join(".")),
    };
    Failure::Usage(if known.is_empty() {
        format!("--json={whole}: {place} has no fields, and so no `{name}`")
    } else {
        format!(
            "--json={whole}: {place} has no field `{name}`{} its fields are {}",
            meant_or_semicolon(name, known),
            known.join(", ")
        )
    })
}

/// What may stand in a line of JSON that is printed.
#[derive(Debug)]
pub(crate) struct Schema {
    protocol: Value,
    /// The schema of a line.
    what: Value,
}

impl Schema {
    /// The answer to a request.
    pub(crate) fn of_answer_to(request: &Request) -> Self {
        let op = json!(request)["op"].as_str().unwrap_or_default().to_owned();
        Self::of(json!({ "$ref": format!("#/$defs/Answers/{op}") }))
    }

    /// Of each of many rigs its name, its socket, and the answer to a request under its operation, or an error.
    pub(crate) fn of_each_rig(request: &Request) -> Self {
        let op = json!(request)["op"].as_str().unwrap_or_default().to_owned();
        let mut fields = json!({ "rig": {}, "socket": {}, "error": { "$ref": "#/$defs/FromServer/WireError" } });
        fields[&op] = json!({ "$ref": format!("#/$defs/Answers/{op}") });
        Self::of(json!({ "items": { "properties": fields } }))
    }

    /// What the types of this name hold, and fields beside them.
    pub(crate) fn of_types(names: &[&str], beside: &[&str]) -> Self {
        let mut all: Vec<Value> = names
            .iter()
            .map(|name| json!({ "$ref": format!("#/$defs/FromServer/{name}") }))
            .collect();
        let beside: Map<String, Value> = beside.iter().map(|name| ((*name).to_owned(), json!({}))).collect();
        all.push(json!({ "properties": beside }));
        Self::of(json!({ "anyOf": all }))
    }

    fn of(what: Value) -> Self {
        Self {
            protocol: serde_json::from_str(PROTOCOL).unwrap_or_default(),
            what,
        }
    }

    /// The schemas that these lead to, of which each says a part: through references, choices and lists.
    fn nodes<'a>(&'a self, of: &[&'a Value]) -> Vec<&'a Value> {
        let mut found: Vec<&Value> = Vec::new();
        let mut left = of.to_vec();
        while let Some(node) = left.pop() {
            if found.iter().any(|seen| std::ptr::eq(*seen, node)) {
                continue;
            }
            found.push(node);
            let reference = node["$ref"].as_str().and_then(|path| path.strip_prefix('#'));
            left.extend(reference.and_then(|path| self.protocol.pointer(path)));
            left.extend(node.get("items"));
            for choices in ["anyOf", "oneOf", "allOf"] {
                left.extend(node[choices].as_array().into_iter().flatten());
            }
        }
        found
    }

    /// The schemas of a field; none where there is no such field.
    fn field<'a>(&'a self, nodes: &[&'a Value], name: &str) -> Vec<&'a Value> {
        let of: Vec<&Value> = nodes.iter().filter_map(|node| node["properties"].get(name)).collect();
        self.nodes(&of)
    }

    fn names<'a>(&self, nodes: &[&'a Value]) -> Vec<&'a str> {
        let objects = nodes.iter().filter_map(|node| node["properties"].as_object());
        let mut names: Vec<&str> = objects.flat_map(|fields| fields.keys().map(String::as_str)).collect();
        names.sort_unstable();
        names.dedup();
        names
    }

    /// Whether names may stand there that the schema does not list, as those of parameters.
    fn is_open(&self, nodes: &[&Value]) -> bool {
        let is_any = |node: &&Value| node.as_object().is_some_and(Map::is_empty) || *node == &Value::Bool(true);
        nodes
            .iter()
            .any(|node| node.get("additionalProperties").is_some_and(|more| more != false) || is_any(node))
    }
}
