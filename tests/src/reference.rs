//! The part of docs/control.md that lists every operation, event and type, drawn from the protocol's schema.

use haptic_core::parameters::TABLE;
use serde_json::{Map, Value};
use std::collections::BTreeMap;

/// Where the drawn part begins and ends in the page.
pub const MARKS: [&str; 2] = [
    "<!-- Drawn from the types of haptic-ipc; see tests/src/reference.rs. -->",
    "<!-- End of what is drawn. -->",
];

/// Draws it.
pub fn draw(schema: &Value) -> String {
    let definitions = &schema["$defs"];
    let types = Types::of(definitions);
    let mut page = String::from("### Operations\n");
    page.push_str(&format!(
        "\n#### {CHANGE}\n\nThe fields of every change:\n\n{}",
        types.change_options(definitions)
    ));
    for operation in list(&definitions["FromClient"]["Envelope"]["oneOf"]) {
        let op = text(&operation["properties"]["op"]["const"]);
        page.push_str(&format!("\n#### `{op}`\n\n{}\n\n", summary(operation)));
        let asked = types.fields(operation, 0, &NOTHING);
        if !asked.is_empty() {
            page.push_str(&format!("{asked}\n"));
        }
        let answer = &definitions["Answers"][op];
        match types.inlined(answer) {
            Some(fields) => page.push_str(&format!("Answer:\n\n{}", types.body(fields, 0, &NOTHING))),
            None => page.push_str(&format!("Answer: {}.\n", types.name(answer))),
        }
    }
    page.push_str("\n### Events\n");
    for event in list(&definitions["FromServer"]["Event"]["oneOf"]) {
        let name = text(&event["properties"]["event"]["const"]);
        let about = summary(event);
        page.push_str(&format!("\n#### `{name}`\n\n{about}"));
        match types.inlined(event) {
            Some(_) if reference(event) == reference(&definitions["Answers"][name]) => {
                page.push_str(&format!(" It is the answer to [`{name}`](#{name}).\n"));
            }
            Some(fields) => page.push_str(&format!("\n\n{}", types.body(fields, 0, &NOTHING))),
            None => page.push_str(&format!(" It is {}.\n", types.name(event))),
        }
    }
    page.push_str("\n### Columns of a row of samples\n\n");
    for cell in list(&definitions["FromServer"]["Sample"]["prefixItems"]) {
        let name = text(&cell["title"]);
        page.push_str(&types.item(name, "", cell, summary(cell), 0, &NOTHING));
    }
    let second = haptic_ipc::SAMPLE_Y_COLUMNS.map(|name| format!("`{name}`")).join(", ");
    page.push_str(&format!(
        "\nOf two axes (`axes` is 2) a row has the same of the second axis behind these: {second}. A place where the \
         linkage cannot close is `null`.\n"
    ));
    let codes = types.all["ErrorCode"];
    page.push_str(&format!("\n### {REFUSED}\n\n{}\n\n", summary(codes)));
    page.push_str(&types.body(codes, 0, &NOTHING));
    page.push_str("\n### Types\n");
    for (name, definition) in &types.all {
        if OWN_PLACE.contains(name) || types.is_inline(name) {
            continue;
        }
        let about = summary(definition);
        page.push_str(&format!("\n#### {name}\n\n{about}\n\n"));
        page.push_str(&types.body(definition, 0, &NOTHING));
    }
    page
}

/// Types that the page does not list among the others.
const OWN_PLACE: [&str; 4] = ["Envelope", "Event", "Sample", "ErrorCode"];

/// The fields that every change has.
const CHANGE_OPTIONS: [&str; 5] = ["if_revision", "ramp_ms", "dry_run", "at_tick", "anyway"];

/// The heading above them.
const CHANGE: &str = "Options of a change";

/// The heading above the codes of errors.
const REFUSED: &str = "Why a request was refused";

/// Words that tell nothing of what is described.
const WITHOUT_MEANING: [&str; 10] = ["a", "an", "the", "its", "of", "it", "they", "is", "are", "was"];

/// Ranges that say how the daemon keeps a number, and nothing of its values.
const RANGES_OF_A_BYTE: [&str; 2] = [" 0 to 255", " -128 to 127"];

/// Most words of a description of a type that stands inside of another one, which does not repeat them.
const MAX_INLINED_WORDS: usize = 15;

/// What encloses a list that stands in no other.
static NOTHING: Value = Value::Null;

/// Units by the endings of names; the page gives them once.
const UNITS: [(&str, &str); 15] = [
    ("_N", "N"),
    ("_N_per_m", "N/m"),
    ("_N_per_s", "N/s"),
    ("_Ns_per_m", "N s/m"),
    ("_m", "m"),
    ("_mps", "m/s"),
    ("_mps2", "m/s^2"),
    ("_kg", "kg"),
    ("_J", "J"),
    ("_hz", "Hz"),
    ("_s", "s"),
    ("_ms", "ms"),
    ("_us", "us"),
    ("_ns", "ns"),
    ("_ppm", "parts in a million"),
];

/// The types of both directions, each once.
struct Types<'a> {
    all: BTreeMap<&'a str, &'a Value>,
    /// How often each is used; what is used once stands where it is used.
    uses: BTreeMap<&'a str, usize>,
}

impl<'a> Types<'a> {
    fn of(definitions: &'a Value) -> Self {
        let mut all = BTreeMap::new();
        for direction in ["FromServer", "FromClient"] {
            let types = definitions[direction].as_object().expect("definitions");
            all.extend(types.iter().map(|(name, definition)| (name.as_str(), definition)));
        }
        let mut uses = BTreeMap::new();
        for definition in all.values().copied().chain([&definitions["Answers"]]) {
            count_uses(definition, &mut uses);
        }
        // An answer with the name of its operation stands there, whatever else refers to it.
        for (op, answer) in definitions["Answers"].as_object().expect("answers") {
            uses.extend(
                reference(answer)
                    .filter(|name| name.to_lowercase() == *op)
                    .map(|name| (name, 1)),
            );
        }
        Self { all, uses }
    }

    /// Whether a type has no heading of its own: it is used in one place, or is a plain value.
    fn is_inline(&self, name: &str) -> bool {
        let definition = self.all[name];
        let is_plain = ["properties", "oneOf", "anyOf", "additionalProperties"]
            .iter()
            .all(|keyword| definition.get(keyword).is_none());
        let is_short = summary(definition).split_whitespace().count() <= MAX_INLINED_WORDS;
        !OWN_PLACE.contains(&name) && (is_plain || (is_short && self.uses.get(name) == Some(&1)))
    }

    /// The type that stands inside of the one that uses it, if one does.
    fn inlined(&self, schema: &'a Value) -> Option<&'a Value> {
        if let Some(name) = reference(schema) {
            return self.is_inline(name).then(|| self.all[name]);
        }
        let parts = ["oneOf", "anyOf"].iter().filter_map(|choice| schema[choice].as_array());
        parts
            .flatten()
            .chain([&schema["items"], &schema["additionalProperties"]])
            .filter(|part| part.is_object())
            .find_map(|part| self.inlined(part))
    }

    /// What a type consists of: fields, words, or one of several types. It stands in `depth` lists, the innermost of
    /// them that of `outer`.
    fn body(&self, definition: &'a Value, depth: usize, outer: &'a Value) -> String {
        if definition["properties"].is_object() {
            return self.fields(definition, depth, outer);
        }
        let Some(choices) = choices(definition) else {
            let kind = self.name(definition);
            return match self.inlined(definition) {
                Some(inner) => format!("{kind}:\n\n{}", self.body(inner, depth, definition)),
                None if depth == 0 => format!("{kind}.\n"),
                // The field's own line has it.
                None => String::new(),
            };
        };
        let indent = "  ".repeat(depth);
        let mut drawn = String::new();
        for choice in choices {
            let name = self.name(choice);
            let about = match summary(choice) {
                about if repeats(about, &name) => String::new(),
                about => format!(": {about}"),
            };
            drawn.push_str(&format!("{indent}- {name}{about}\n"));
            if let Some(inner) = self.inlined(choice) {
                drawn.push_str(&self.body(inner, depth + 1, definition));
            }
        }
        drawn
    }

    /// The list of an object's fields. Those that `outer` has in the same words are only named.
    fn fields(&self, object: &'a Value, depth: usize, outer: &'a Value) -> String {
        let Some(properties) = object["properties"].as_object() else {
            return String::new();
        };
        let indent = "  ".repeat(depth);
        let is_change = CHANGE_OPTIONS.iter().all(|name| properties.contains_key(*name));
        let mut drawn = String::new();
        let mut repeated = Vec::new();
        for (name, field) in properties {
            let is_option = is_change && CHANGE_OPTIONS.contains(&name.as_str());
            let is_operation = name == "op" && field.get("const").is_some();
            if is_option || is_operation || is_symbol(name, properties) {
                continue;
            }
            if outer["properties"].get(name) == Some(field) {
                repeated.push(format!("`{name}`"));
                continue;
            }
            let presence = if is_required(object, name) { "" } else { "?" };
            let about = summary(field);
            drawn.push_str(&self.item(name, presence, field, about, depth, object));
        }
        if !repeated.is_empty() {
            drawn.push_str(&format!("{indent}- as above: {}\n", repeated.join(", ")));
        }
        for choice in object["oneOf"].as_array().into_iter().flatten() {
            for (name, field) in choice["properties"].as_object().into_iter().flatten() {
                let about = summary(choice);
                drawn.push_str(&self.item(name, " or", field, about, depth, object));
            }
        }
        if is_change {
            drawn.push_str(&format!(
                "{indent}- the [{}](#{})\n",
                CHANGE.to_lowercase(),
                anchor(CHANGE)
            ));
        }
        drawn
    }

    /// The list of the fields that every change has.
    fn change_options(&self, definitions: &'a Value) -> String {
        let operations = list(&definitions["FromClient"]["Envelope"]["oneOf"]);
        let undo = operations
            .iter()
            .find(|operation| operation["properties"]["op"]["const"] == "undo");
        let properties = &undo.expect("it is an operation")["properties"];
        let item = |name: &&str| {
            let field = &properties[name];
            self.item(name, "?", field, summary(field), 0, &NOTHING)
        };
        CHANGE_OPTIONS.iter().map(item).collect()
    }

    /// A field in the list of its object `outer`: its name, whether it may be absent, its type and its meaning, and
    /// what its type consists of, where that is used here alone.
    fn item(
        &self,
        name: &str,
        presence: &str,
        schema: &'a Value,
        about: &str,
        depth: usize,
        outer: &'a Value,
    ) -> String {
        let indent = "  ".repeat(depth);
        let unit = unit(name);
        let kind = match self.name(schema) {
            // The page says that a name with a unit is a number.
            kind if kind == "number" && unit.is_some() => String::new(),
            kind => format!(" ({kind})"),
        };
        let about = unit.map_or_else(|| about.to_owned(), |unit| without_unit(about, unit));
        // The type says that it is true or false.
        let about = match about.strip_prefix("Whether ") {
            Some(fact) if kind == " (boolean)" => capitalised(fact),
            _ => about,
        };
        let about = match repeats(&about, &format!("{name} {kind}")) {
            true => String::new(),
            false => format!(": {about}"),
        };
        let mut drawn = format!("{indent}- `{name}`{presence}{kind}{about}\n");
        if let Some(inner) = self.inlined(schema) {
            drawn.push_str(&self.body(inner, depth + 1, outer));
        }
        drawn
    }

    /// A type in words.
    fn name(&self, schema: &Value) -> String {
        if let Some(name) = reference(schema) {
            // Two types have a place of their own in the page.
            let heading = match name {
                "Sample" => "columns-of-a-row-of-samples".to_owned(),
                "ErrorCode" => anchor(REFUSED),
                _ => name.to_lowercase(),
            };
            return match self.is_inline(name).then(|| self.all[name]) {
                Some(inner) if inner["properties"].is_object() => "object".to_owned(),
                Some(inner) => match choices(inner) {
                    Some(words) if words.iter().all(|word| word["const"].is_string()) => "string".to_owned(),
                    Some(_) => "one of".to_owned(),
                    None => self.name(inner),
                },
                None => format!("[{name}](#{heading})"),
            };
        }
        if let Some(word) = schema.get("const") {
            return format!("`{word}`");
        }
        if let Some(choices) = choices(schema) {
            let choices: Vec<String> = choices
                .iter()
                .filter(|choice| choice["type"] != "null")
                .map(|choice| self.name(choice))
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
        let range = if RANGES_OF_A_BYTE.contains(&range.as_str()) {
            ""
        } else {
            range.as_str()
        };
        match kind {
            "integer" | "number" => format!("{kind}{range}"),
            "array" if schema["items"].is_object() => match self.name(&schema["items"]) {
                plain if plain.chars().all(char::is_alphabetic) => format!("{plain}s"),
                other => format!("list of {other}"),
            },
            "array" => "list".to_owned(),
            "object" if schema["additionalProperties"].is_object() => {
                format!("object of {}", self.name(&schema["additionalProperties"]))
            }
            "object" => {
                let names: Vec<String> = schema["properties"]
                    .as_object()
                    .into_iter()
                    .flat_map(|properties| properties.iter().filter(|(name, _)| !is_symbol(name, properties)))
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
}

fn count_uses<'a>(schema: &'a Value, uses: &mut BTreeMap<&'a str, usize>) {
    if let Some(name) = reference(schema) {
        *uses.entry(name).or_default() += 1;
    }
    match schema {
        Value::Object(object) => object.values().for_each(|part| count_uses(part, uses)),
        Value::Array(parts) => parts.iter().for_each(|part| count_uses(part, uses)),
        _ => {}
    }
}

/// The name of the type that a schema refers to.
fn reference(schema: &Value) -> Option<&str> {
    schema["$ref"].as_str().and_then(|path| path.rsplit('/').next())
}

fn choices(schema: &Value) -> Option<&Vec<Value>> {
    ["oneOf", "anyOf"].iter().find_map(|choice| schema[choice].as_array())
}

/// Whether an object must have a field, by its name or, for a parameter of a scene, by its symbol.
fn is_required(object: &Value, name: &str) -> bool {
    let has = |schema: &Value| {
        let names = schema["required"].as_array();
        names.is_some_and(|names| names.iter().any(|other| other == name))
    };
    let either = object["allOf"].as_array().into_iter().flatten();
    has(object) || either.filter_map(choices).flatten().any(has)
}

/// Whether a field is a parameter of a scene under another name than its full one.
fn is_symbol(name: &str, fields: &Map<String, Value>) -> bool {
    TABLE.iter().any(|row| {
        name != row.name && fields.contains_key(row.name) && (row.symbol == name || row.aliases.contains(&name))
    })
}

/// The unit that a name ends in.
fn unit(name: &str) -> Option<&'static str> {
    let endings = UNITS.iter().filter(|(ending, _)| name.ends_with(ending));
    endings.max_by_key(|(ending, _)| ending.len()).map(|(_, unit)| *unit)
}

/// A description without the unit, which the field's name has.
fn without_unit(about: &str, unit: &str) -> String {
    match about.split_once(&format!(", {unit}")) {
        Some((before, after)) if !after.starts_with(|next: char| next.is_alphanumeric() || next == '/') => {
            format!("{before}{after}")
        }
        _ => about.to_owned(),
    }
}

fn capitalised(text: &str) -> String {
    let mut letters = text.chars();
    let first = letters.next();
    first.into_iter().flat_map(char::to_uppercase).chain(letters).collect()
}

/// Whether a description has no word that the name and the type of its field lack.
fn repeats(about: &str, field: &str) -> bool {
    let field = field.to_lowercase();
    let mut words = about
        .split(|end: char| !end.is_alphanumeric())
        .filter(|word| !word.is_empty());
    words.all(|word| {
        let word = word.to_lowercase();
        WITHOUT_MEANING.contains(&word.as_str()) || field.contains(&word)
    })
}

/// What leads to a heading.
fn anchor(heading: &str) -> String {
    heading.to_lowercase().replace(' ', "-")
}

/// The first paragraph of a description.
fn summary(schema: &Value) -> &str {
    text(&schema["description"]).split("  ").next().unwrap_or_default()
}

fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}

fn list(value: &Value) -> &[Value] {
    value.as_array().expect("a list")
}
