//! The lines of the server.

use crate::error::WireError;
use crate::event::{Event, SamplesEvent};
use serde::{Deserialize, Serialize};

/// The greeting of the server.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct Hello {
    /// Version of the protocol.
    pub protocol: u32,
    /// Name and version of the server.
    pub server: String,
    /// Name of this connection in the server's log.
    pub session: String,
    /// The client's rights on this connection; absent for all.
    #[serde(default, skip_serializing_if = "Rights::is_all")]
    pub rights: Rights,
}

/// The rights of a client.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(rename_all = "snake_case")]
pub enum Rights {
    /// Every operation.
    #[default]
    All,
    /// Reading and `stop`: the watchers' socket.
    Watch,
    /// Only `stop`: all places for clients are taken.
    Stop,
    /// A right that only a later server knows.
    #[serde(other)]
    #[cfg_attr(feature = "schema", schemars(skip))]
    Unknown,
}

impl Rights {
    /// Whether the client has all rights.
    #[must_use]
    pub fn is_all(&self) -> bool {
        *self == Self::All
    }
}

/// How the server begins a batch of ticks.
const SAMPLES: &str = r#"{"event":"samples","#;

/// A line from the server.
#[derive(Clone, Debug, PartialEq)]
pub enum ServerLine {
    /// The greeting.
    Hello(Hello),
    /// The answer to a request; without `id` when the request's could not be read.
    Answer {
        /// Number of the request.
        id: Option<u64>,
        /// The result.
        result: Result<serde_json::Value, WireError>,
    },
    /// An event.
    Event(Event),
}

impl ServerLine {
    /// Reads a line.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(line: &str) -> Result<Self, serde_json::Error> {
        #[derive(Deserialize)]
        struct Line {
            hello: Option<Hello>,
            id: Option<u64>,
            ok: Option<serde_json::Value>,
            error: Option<WireError>,
            event: Option<serde::de::IgnoredAny>,
        }
        // Nearly all that comes. What its key says need not be looked for, and nothing is kept twice on the way to it.
        if line.starts_with(SAMPLES) {
            let samples: SamplesEvent = serde_json::from_str(line)?;
            return Ok(Self::Event(Event::Samples(samples)));
        }
        let parsed: Line = serde_json::from_str(line)?;
        if parsed.event.is_some() {
            return Ok(Self::Event(serde_json::from_str(line)?));
        }
        match parsed {
            Line { hello: Some(hello), .. } => Ok(Self::Hello(hello)),
            Line {
                id, error: Some(error), ..
            } => Ok(Self::Answer { id, result: Err(error) }),
            Line {
                id, ok: Some(value), ..
            } => Ok(Self::Answer { id, result: Ok(value) }),
            _ => Err(serde::de::Error::custom(
                "a line from the server has one of hello, ok, error, event",
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Sample;
    use crate::error::ErrorCode;

    #[test]
    fn what_a_later_server_adds_is_passed_over() {
        let line = r#"{"event":"weather","wind":3}"#;
        assert_eq!(
            ServerLine::parse(line).expect("it reads"),
            ServerLine::Event(Event::Unknown)
        );
        let line = r#"{"id":1,"error":{"code":"brand_new","message":"no","hint":"later"}}"#;
        let ServerLine::Answer { result: Err(error), .. } = ServerLine::parse(line).expect("it reads") else {
            panic!("an error");
        };
        assert_eq!(error.code, ErrorCode::Unknown);
        let line = r#"{"id":1,"ok":{"state":"idle","tick":3,"more":1},"took_ns":5}"#;
        assert!(ServerLine::parse(line).is_ok());
    }

    #[test]
    fn a_batch_of_ticks_is_read_alike_wherever_its_key_stands() {
        let rows = vec![
            Sample {
                tick: 7,
                command_force_n: -1.5,
                ..Sample::default()
            };
            3
        ];
        let event = Event::Samples(SamplesEvent {
            seq: 2,
            dropped: 1,
            rows,
            ..SamplesEvent::default()
        });
        let line = serde_json::to_string(&event).expect("it can be written");
        assert!(line.starts_with(SAMPLES), "{line}");
        let key_last = format!(
            "{}{}",
            line.replacen(SAMPLES, "{", 1).trim_end_matches('}'),
            r#","event":"samples"}"#
        );
        for line in [&line, &key_last] {
            assert_eq!(
                ServerLine::parse(line).expect("it reads"),
                ServerLine::Event(event.clone())
            );
            let damaged = line.replacen("-1.5", "true", 1);
            assert!(ServerLine::parse(&damaged).is_err(), "{damaged}");
        }
    }

    #[test]
    fn a_greeting_says_what_may_be_asked() {
        for (more, rights) in [
            ("", Rights::All),
            (r#","rights":"watch""#, Rights::Watch),
            (r#","rights":"paint""#, Rights::Unknown),
        ] {
            let line = format!(r#"{{"hello":{{"protocol":1,"server":"hapticd 1","session":"1-1"{more}}}}}"#);
            let Ok(ServerLine::Hello(hello)) = ServerLine::parse(&line) else {
                panic!("{line}");
            };
            assert_eq!(hello.rights, rights);
        }
    }

    proptest::proptest! {
        #[test]
        fn no_line_panics(line in ".{0,200}") {
            drop(ServerLine::parse(&line));
        }
    }
}
