//! Recorded conversations with a daemon, and how today's is held against them.
//!
//! ```text
//! # a remark
//! ! --ramp-ms 50                                  arguments of the daemon, before the first line of the conversation
//! F broken.toml law = 7                           a file in its directory of scenes, likewise
//! S {"hello":{"protocol":1}}                      what the server must say
//! C {"id":1,"op":"stop"}                          what the client sends, as it stands; <N spaces> stands for so many
//! S {"id":1,"ok":{"state":"stopped","tick":"<number>"}}
//! P {"id":1,"op":"status"}                        what the client sends again and again, until the server
//!                                                 says the next line
//! C2 {"id":1,"op":"get"}                          a second client; those that begin with CW are on
//! the watchers' socket
//! ```
//!
//! What the server says must have every field of the transcript, with an equal value. It may have
//! more: that is how a protocol grows. A list may be longer at its end, but `[]` is an empty one.
//! `"<number>"`, `"<string>"`, `"<boolean>"`, `"<list>"` and `"<object>"` stand for any of their
//! kind. An answer must be the next answer of its connection; an event the next of its kind that
//! matches, since how many there are depends on the time.

use crate::schema::{Part, Validator};
use crate::{Daemon, PATIENCE, Raw, files, pause, plain, timed};
use serde_json::Value;
use std::collections::{HashMap, VecDeque};
use std::path::{Path, PathBuf};
use std::time::Instant;

/// A line of a conversation.
#[derive(Clone, Debug, PartialEq)]
pub enum Message {
    /// By a client, as it is sent.
    Client(String),
    /// By a client, again and again, until the answer is as it must be.
    Poll(String),
    /// By the server, as it must at least be.
    Server(Value),
}

/// A recorded conversation.
#[derive(Clone, Debug, Default)]
pub struct Transcript {
    /// Arguments of the daemon.
    pub arguments: Vec<String>,
    /// Files in its directory of scenes, with what they hold.
    pub files: Vec<(String, String)>,
    /// The lines, each with the name of its connection and its number in the file.
    pub lines: Vec<(String, Message, usize)>,
}

impl Transcript {
    /// Reads a transcript.
    pub fn parse(text: &str) -> Self {
        let mut transcript = Self::default();
        for (line, number) in text.lines().zip(1..) {
            let (mark, rest) = line.split_once(' ').unwrap_or((line, ""));
            match mark.chars().next() {
                None | Some('#') => {}
                Some('!') => transcript.arguments.extend(rest.split_whitespace().map(str::to_owned)),
                Some('F') => {
                    let (name, text) = rest.split_once(' ').unwrap_or((rest, ""));
                    transcript.files.push((name.to_owned(), text.replace("\\n", "\n")));
                }
                Some(kind @ ('C' | 'P' | 'S')) => {
                    let message = match kind {
                        'C' => Message::Client(spaces(rest)),
                        'P' => Message::Poll(rest.to_owned()),
                        _ => match serde_json::from_str(rest) {
                            Ok(expected) => Message::Server(expected),
                            Err(error) => panic!("line {number}: {error}: {rest}"),
                        },
                    };
                    transcript.lines.push((mark[1..].to_owned(), message, number));
                }
                Some(_) => panic!("line {number} begins with none of # ! F C P S: {line}"),
            }
        }
        transcript
    }

    /// All transcripts of the repository, with the names of their files.
    pub fn all() -> Vec<(String, Self)> {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("transcripts");
        let read = |path: PathBuf| {
            let text = std::fs::read_to_string(&path).expect("text");
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            (name, Self::parse(&text))
        };
        files(&folder).into_iter().map(read).collect()
    }

    /// Holds the conversation with a daemon of its own.
    ///
    /// # Errors
    /// Where it goes otherwise than it did: the line, what was expected, and what came.
    pub fn replay(&self) -> Result<(), String> {
        let directory = tempfile::tempdir().expect("a directory");
        let [scenes, watch] = ["scenes", "watch/watch.sock"].map(|name| directory.path().join(name));
        std::fs::create_dir(&scenes).expect("a directory");
        for (name, text) in &self.files {
            std::fs::write(scenes.join(name), text).expect("it can be written");
        }
        let given: Vec<&str> = self.arguments.iter().map(String::as_str).collect();
        let arguments = [&["--watch-socket", plain(&watch)], &given[..]].concat();
        let daemon = Daemon::start_in(directory.path(), "fake", &arguments);
        let mut connections: HashMap<&str, Connection> = HashMap::new();
        let schemas = [Part::Request, Part::Server].map(Validator::of);
        for (name, message, number) in &self.lines {
            let connection = connections.entry(name).or_insert_with(|| {
                let socket = if name.starts_with('W') { &watch } else { daemon.socket() };
                Connection::new(socket)
            });
            match message {
                Message::Client(line) => connection.ask(line),
                Message::Poll(line) => connection.polled = Some(line.clone()),
                Message::Server(expected) => connection.receive(expected, &schemas).map_err(|why| {
                    timed::count_missed(daemon.socket());
                    format!("line {number}: {why}")
                })?,
            }
        }
        Ok(())
    }
}

/// Writes out `<N spaces>`.
fn spaces(line: &str) -> String {
    let written_out = || {
        let (before, rest) = line.split_once('<')?;
        let (count, after) = rest.split_once(" spaces>")?;
        Some(format!("{before}{}{after}", " ".repeat(count.parse().ok()?)))
    };
    written_out().unwrap_or_else(|| line.to_owned())
}

/// The schemas of a request and of what the server says.
type Schemas = [Option<Validator>; 2];

/// Checks a value, where there is a validator.
fn check(validator: Option<&Validator>, value: &Value) -> Result<(), String> {
    validator.map_or(Ok(()), |validator| validator.check(value))
}

/// A client of the conversation.
struct Connection {
    raw: Raw,
    /// What was asked and not answered yet.
    asked: VecDeque<String>,
    /// What is asked until the answer is as it must be.
    polled: Option<String>,
    /// Events that nobody has waited for yet.
    events: VecDeque<Value>,
}

impl Connection {
    fn new(socket: &Path) -> Self {
        Self {
            raw: Raw::connect(socket),
            asked: VecDeque::new(),
            polled: None,
            events: VecDeque::new(),
        }
    }

    fn ask(&mut self, line: &str) {
        self.raw.send(format!("{line}\n"));
        self.asked.push_back(line.to_owned());
    }

    /// The next line of the server, which must be of the protocol.
    fn line(&mut self, schemas: &Schemas) -> Result<Value, String> {
        let line = self.raw.line();
        check(schemas[1].as_ref(), &line)?;
        Ok(line)
    }

    fn receive(&mut self, expected: &Value, schemas: &Schemas) -> Result<(), String> {
        if expected.get("event").is_some() {
            return self.hear_event(expected, schemas);
        }
        match self.polled.take() {
            Some(line) => self.poll(&line, expected, schemas),
            None => self.hear_answer(expected, schemas),
        }
    }

    /// Asks until the answer is as it must be.
    fn poll(&mut self, line: &str, expected: &Value, schemas: &Schemas) -> Result<(), String> {
        let began = Instant::now();
        loop {
            self.ask(line);
            match self.hear_answer(expected, schemas) {
                Err(why) if began.elapsed() > PATIENCE => return Err(format!("waited in vain: {why}")),
                Err(_) => pause(),
                Ok(()) => return Ok(()),
            }
        }
    }

    fn hear_answer(&mut self, expected: &Value, schemas: &Schemas) -> Result<(), String> {
        let line = loop {
            let line = self.line(schemas)?;
            if line.get("event").is_none() {
                break line;
            }
            self.events.push_back(line);
        };
        if line.get("hello").is_none() {
            self.check_answer(&line, schemas)?;
        }
        matches(expected, &line, "")
    }

    /// The line and what was asked must be in the schema too, the one as the answer to the other.
    fn check_answer(&mut self, line: &Value, schemas: &Schemas) -> Result<(), String> {
        let asked = self.asked.pop_front().ok_or("an answer that nobody waits for")?;
        let Some(ok) = line.get("ok") else {
            return Ok(());
        };
        let request: Value = serde_json::from_str(&asked).map_err(|error| format!("{asked}: {error}"))?;
        check(schemas[0].as_ref(), &request).map_err(|error| format!("the daemon accepts it: {error}"))?;
        let op = request["op"].as_str().unwrap_or_default();
        check(Validator::of(Part::Answer(op)).as_ref(), ok).map_err(|error| format!("the answer to {op}: {error}"))
    }

    fn hear_event(&mut self, expected: &Value, schemas: &Schemas) -> Result<(), String> {
        let (began, mut last) = (Instant::now(), String::new());
        loop {
            let found = self
                .events
                .iter()
                .position(|event| matches(expected, event, "").is_ok());
            if let Some(found) = found {
                // Those of its kind that came before it were not waited for.
                let mut index = 0;
                self.events.retain(|event| {
                    index += 1;
                    index - 1 > found || (index - 1 < found && event["event"] != expected["event"])
                });
                return Ok(());
            }
            if began.elapsed() > PATIENCE {
                return Err(format!("waited in vain for {expected}; the last of its kind: {last}"));
            }
            let line = self.line(schemas)?;
            if line.get("event").is_none() {
                return Err(format!("waited for {expected}, and was answered {line} without asking"));
            }
            if line["event"] == expected["event"] {
                last = line.to_string();
            }
            self.events.push_back(line);
        }
    }
}

/// Whether a message has everything that is expected.
///
/// # Errors
/// The first place at which it has not.
pub fn matches(expected: &Value, got: &Value, place: &str) -> Result<(), String> {
    let differs = || {
        Err(format!(
            "{}: expected {expected}, got {got}",
            if place.is_empty() { "/" } else { place }
        ))
    };
    let kind = |is: bool| if is { Ok(()) } else { differs() };
    match (expected, got) {
        (Value::String(text), _) if text.starts_with('<') => kind(match text.as_str() {
            "<number>" => got.is_number(),
            "<string>" => got.is_string(),
            "<boolean>" => got.is_boolean(),
            "<list>" => got.is_array(),
            "<object>" => got.is_object(),
            _ => expected == got,
        }),
        (Value::Object(fields), Value::Object(_)) => fields.iter().try_for_each(|(name, value)| {
            let place = format!("{place}/{name}");
            match got.get(name) {
                Some(found) => matches(value, found, &place),
                None => Err(format!("{place}: expected {value}, and there is none in {got}")),
            }
        }),
        (Value::Array(items), Value::Array(found)) => {
            if found.len() < items.len() || (items.is_empty() && !found.is_empty()) {
                return differs();
            }
            let mut each = items.iter().zip(found).zip(0..);
            each.try_for_each(|((item, found), index): (_, usize)| matches(item, found, &format!("{place}/{index}")))
        }
        // 1 and 1.0 are one number.
        (Value::Number(number), Value::Number(found)) => kind(number == found || number.as_f64() == found.as_f64()),
        _ => kind(expected == got),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn an_answer_has_all_that_is_expected_and_may_have_more() {
        let expected = json!({"tick":"<number>","state":"idle","list":[1,{"a":2}],"none":[]});
        let as_before = json!({"tick":7,"state":"idle","list":[1,{"a":2.0,"b":1},3],"none":[],"more":1});
        matches(&expected, &as_before, "").expect("it has everything");
        for (field, otherwise) in [
            ("tick", json!("7")),
            ("state", json!("engaged")),
            ("list", json!([1])),
            ("list", json!([1, {"b":2}])),
            ("none", json!([1])),
        ] {
            let mut got = as_before.clone();
            got[field] = otherwise;
            matches(&expected, &got, "").expect_err(field);
            got.as_object_mut().expect("an object").remove(field);
            matches(&expected, &got, "").expect_err("it is absent");
        }
    }
}
