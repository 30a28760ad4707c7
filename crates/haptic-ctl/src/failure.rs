//! How a command can end badly, and with which exit code.

use haptic_ipc::{ClientError, ErrorCode};
use std::process::ExitCode;
use std::time::Duration;

#[derive(Debug)]
pub(crate) enum Failure {
    Client(ClientError),
    Usage(String),
    NoAnswer(Duration),
    Interrupted,
    /// The output cannot be written.
    Output(std::io::Error),
}

impl From<ClientError> for Failure {
    fn from(error: ClientError) -> Self {
        Self::Client(error)
    }
}

impl From<std::io::Error> for Failure {
    fn from(error: std::io::Error) -> Self {
        Self::Output(error)
    }
}

impl Failure {
    fn code(&self) -> u8 {
        match self {
            Self::Client(ClientError::Refused(error)) => match error.code {
                ErrorCode::Stopped | ErrorCode::Faulted => 6,
                ErrorCode::NotPermitted => 4,
                _ => 1,
            },
            Self::Client(ClientError::NoDaemon { .. } | ClientError::Closed | ClientError::Io(_)) => 3,
            Self::Client(ClientError::Permission { .. }) => 4,
            Self::Client(_) => 1,
            Self::Usage(_) => 2,
            Self::NoAnswer(_) => 5,
            Self::Interrupted => 130,
            Self::Output(_) => 1,
        }
    }

    /// Says what went wrong on standard error, and gives the exit code.
    pub(crate) fn report(&self, json: bool) -> ExitCode {
        match self {
            // Whoever read the output has had enough, as `head` does.
            Self::Output(error) if error.kind() == std::io::ErrorKind::BrokenPipe => return ExitCode::SUCCESS,
            Self::Interrupted => {}
            Self::Client(ClientError::Refused(error)) if json => {
                eprintln!("{}", serde_json::json!({ "error": error }));
            }
            _ if json => eprintln!("{}", serde_json::json!({ "error": { "message": self.to_string() } })),
            _ => eprintln!("haptic-ctl: {self}"),
        }
        ExitCode::from(self.code())
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Client(error) => error.fmt(f),
            Self::Usage(message) => f.write_str(message),
            Self::NoAnswer(after) => write!(f, "the daemon has not answered for {} s", after.as_secs()),
            Self::Interrupted => f.write_str("interrupted"),
            Self::Output(error) => write!(f, "cannot write: {error}"),
        }
    }
}
