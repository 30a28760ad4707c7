//! `raw`: lines of the control protocol as they are.

use crate::failure::Failure;
use crate::output;
use haptic_ipc::{ClientError, ErrorCode, ServerLine, socket_path};
use serde_json::Value;
use std::path::Path;
use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader, Lines};
use tokio::net::UnixStream;
use tokio::net::unix::OwnedReadHalf;

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Requests, each a JSON object; `id` may be missing [default: lines of stdin]
    #[arg(value_name = "LINE")]
    lines: Vec<String>,

    /// Print events after the last answer, until interrupted
    #[arg(long, short)]
    follow: bool,

    /// Print the JSON schema of the protocol instead; needs no daemon
    #[arg(long, conflicts_with_all = ["lines", "follow"])]
    pub(crate) schema: bool,
}

/// Prints the schema of the protocol.
pub(crate) fn schema() -> Result<(), Failure> {
    output::exact(&format!("{:#}", haptic_ipc::schema::protocol()))
}

pub(crate) async fn run(socket: Option<&Path>, arguments: &Arguments) -> Result<(), Failure> {
    let path = socket_path::for_client(socket);
    let stream = UnixStream::connect(&path)
        .await
        .map_err(|error| ClientError::connecting(&path, error))?;
    let (reader, mut writer) = stream.into_split();
    let mut conversation = Conversation {
        lines: BufReader::new(reader).lines(),
        worst: 0,
    };
    conversation.greeting().await?;
    let mut next_id = 1;
    if arguments.lines.is_empty() {
        let mut input = BufReader::new(tokio::io::stdin()).lines();
        while let Some(line) = input.next_line().await? {
            conversation.ask(&mut writer, &line, &mut next_id).await?;
        }
    } else {
        for line in &arguments.lines {
            conversation.ask(&mut writer, line, &mut next_id).await?;
        }
    }
    if arguments.follow {
        loop {
            output::exact(&conversation.next().await?)?;
        }
    }
    match conversation.worst {
        0 => Ok(()),
        code => Err(Failure::Silent(code)),
    }
}

struct Conversation {
    lines: Lines<BufReader<OwnedReadHalf>>,
    /// The exit code: that of the first refusal.
    worst: u8,
}

impl Conversation {
    async fn next(&mut self) -> Result<String, Failure> {
        let line = self.lines.next_line().await.map_err(ClientError::Io)?;
        line.ok_or_else(|| ClientError::Closed.into())
    }

    async fn greeting(&mut self) -> Result<(), Failure> {
        let line = self.next().await?;
        match ServerLine::parse(&line).map_err(ClientError::BadAnswer)? {
            ServerLine::Answer { result: Err(error), .. } => Err(ClientError::Refused(error).into()),
            _ => Ok(()),
        }
    }

    /// Sends a line, and prints what comes until it is answered.
    async fn ask(
        &mut self,
        writer: &mut tokio::net::unix::OwnedWriteHalf,
        line: &str,
        next_id: &mut u64,
    ) -> Result<(), Failure> {
        let line = line.trim();
        if line.is_empty() {
            return Ok(());
        }
        let sent = format!("{}\n", with_id(line, next_id));
        writer.write_all(sent.as_bytes()).await.map_err(ClientError::Io)?;
        loop {
            let answer = self.next().await?;
            output::exact(&answer)?;
            if let ServerLine::Answer { result, .. } = ServerLine::parse(&answer).map_err(ClientError::BadAnswer)? {
                if let Err(error) = result
                    && self.worst == 0
                {
                    self.worst = code(error.code);
                }
                return Ok(());
            }
        }
    }
}

/// What was written wrongly is the user's, what was refused is the daemon's.
const fn code(code: ErrorCode) -> u8 {
    match code {
        ErrorCode::BadJson | ErrorCode::LineTooLong => 2,
        _ => Failure::code_of_refusal(code),
    }
}

/// The line, with an `id` if it is an object that has none. A line that is not an object is sent as it is:
/// the daemon says what is wrong with it.
fn with_id(line: &str, next_id: &mut u64) -> String {
    match serde_json::from_str(line) {
        Ok(Value::Object(request)) if !request.contains_key("id") => {
            let mut object = serde_json::Map::new();
            object.insert("id".to_owned(), (*next_id).into());
            *next_id += 1;
            object.extend(request);
            Value::Object(object).to_string()
        }
        _ => line.to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_id_is_added_only_where_there_is_none() {
        let mut next = 1;
        assert_eq!(with_id(r#"{"op":"stop"}"#, &mut next), r#"{"id":1,"op":"stop"}"#);
        assert_eq!(with_id(r#"{"op":"get"}"#, &mut next), r#"{"id":2,"op":"get"}"#);
        for as_it_is in [r#"{"op":"stop","id":9}"#, "not json", "[1, 2]"] {
            assert_eq!(with_id(as_it_is, &mut next), as_it_is);
        }
    }
}
