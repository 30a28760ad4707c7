//! How a command can end badly, and with which exit code.

use crate::hint;
use haptic_ipc::{ClientError, ErrorCode, WireError};
use std::io;
use std::path::Path;
use std::process::ExitCode;
use std::time::Duration;

/// What to do where the daemon cannot be asked to stop.
const CUT_THE_POWER: &str = "the rig could not be told to stop: if the motor pulls, cut its power. Its own watchdog \
                             switches it off where it has one";

#[derive(Debug)]
pub(crate) enum Failure {
    Client(ClientError),
    Usage(String),
    NoAnswer(Duration),
    /// The condition did not hold in time.
    TimedOut(String),
    /// The rig was stopped or faulted instead.
    Halted(String),
    /// The daemon cannot be asked to stop: it is not there, or it does not answer.
    CannotStop(Box<Failure>),
    /// No rig is in reach.
    NoRig(String),
    /// The device that was asked has not answered.
    NoDevice(String),
    /// Something is wrong with the rig, or with the person at it.
    BadRig(String),
    /// A recording does not hold what is asked of it.
    BadRecording(String),
    Interrupted,
    /// Two records have nothing that could be compared.
    NotComparable(String),
    /// The output cannot be written.
    Output(std::io::Error),
    /// A file cannot be written.
    File(String),
    /// Everything is reported already.
    Silent(u8),
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
    /// The refusal to replace a file.
    pub(crate) fn exists(path: &Path) -> Self {
        Self::Usage(format!("{} exists; --force replaces it", path.display()))
    }

    /// The failure to create a file: by its name, which is wrong usage, or by what the disk says.
    pub(crate) fn not_created(path: &Path, error: &io::Error) -> Self {
        let message = format!("{}: {error}", path.display());
        match error.kind() {
            io::ErrorKind::AlreadyExists => Self::exists(path),
            io::ErrorKind::NotFound
            | io::ErrorKind::PermissionDenied
            | io::ErrorKind::IsADirectory
            | io::ErrorKind::NotADirectory
            | io::ErrorKind::InvalidFilename
            | io::ErrorKind::ReadOnlyFilesystem => Self::Usage(message),
            _ => Self::File(message),
        }
    }

    /// The exit code of a request that the daemon refuses with this.
    pub(crate) const fn code_of_refusal(code: ErrorCode) -> u8 {
        match code {
            ErrorCode::Stopped | ErrorCode::Faulted => 6,
            ErrorCode::NotPermitted | ErrorCode::ReadOnly => 4,
            _ => 1,
        }
    }

    /// Whether the daemon is there, and had no place for another client.
    pub(crate) fn is_for_want_of_room(&self) -> bool {
        match self {
            Self::Client(ClientError::Refused(error)) => error.code == ErrorCode::TooManyClients,
            Self::Client(ClientError::Closed) => true,
            Self::Client(ClientError::Io(error)) => {
                matches!(error.kind(), io::ErrorKind::BrokenPipe | io::ErrorKind::ConnectionReset)
            }
            // So many wait that no more may.
            Self::Client(ClientError::NoDaemon { source, .. }) => source.kind() == io::ErrorKind::WouldBlock,
            _ => false,
        }
    }

    /// The exit code, and a name for programs.
    fn code(&self) -> (u8, &'static str) {
        match self {
            Self::Client(ClientError::Refused(error)) => (Self::code_of_refusal(error.code), "refused"),
            Self::Client(
                ClientError::NoDaemon { .. }
                | ClientError::NoGreeting { .. }
                | ClientError::Closed
                | ClientError::Io(_),
            ) => (3, "no_daemon"),
            Self::NoRig(_) => (3, "no_daemon"),
            Self::Client(ClientError::Permission { .. }) => (4, "no_permission"),
            Self::Client(ClientError::Version { .. }) => (1, "other_version"),
            Self::Client(_) => (1, "bad_answer"),
            Self::Usage(_) => (2, "usage"),
            Self::NoAnswer(_) => (5, "no_answer"),
            Self::TimedOut(_) => (5, "timed_out"),
            Self::Halted(_) => (6, "halted"),
            Self::CannotStop(failure) => failure.code(),
            Self::NoDevice(_) => (1, "no_device"),
            Self::BadRig(_) => (1, "bad_rig"),
            Self::NotComparable(_) => (1, "not_comparable"),
            Self::BadRecording(_) => (1, "bad_recording"),
            Self::Interrupted => (130, "interrupted"),
            Self::Output(_) | Self::File(_) => (1, "cannot_write"),
            Self::Silent(code) => (*code, ""),
        }
    }

    pub(crate) fn exit_code(&self) -> u8 {
        self.code().0
    }

    /// What went wrong, for programs: the daemon's own error where that has refused.
    pub(crate) fn as_json(&self) -> serde_json::Value {
        match self {
            Self::Client(ClientError::Refused(error)) => serde_json::json!(error),
            _ => serde_json::json!({ "code": self.code().1, "message": self.to_string() }),
        }
    }

    fn message(&self) -> String {
        match self {
            Self::Client(ClientError::Refused(error)) => in_options(error),
            Self::Client(error) => error.to_string(),
            Self::Usage(message)
            | Self::TimedOut(message)
            | Self::Halted(message)
            | Self::File(message)
            | Self::NoRig(message)
            | Self::NoDevice(message)
            | Self::BadRig(message)
            | Self::NotComparable(message)
            | Self::BadRecording(message) => message.clone(),
            // While a motor pulls, advice on starting a daemon is of no use.
            Self::CannotStop(failure) => match &**failure {
                Self::Client(ClientError::NoDaemon { path, source }) => {
                    format!("{CUT_THE_POWER} (no daemon at {}: {source})", path.display())
                }
                other => format!("{CUT_THE_POWER} ({other})"),
            },
            Self::NoAnswer(after) => format!(
                "the daemon has not answered for {:.1} s; if the motor pulls, cut its power",
                after.as_secs_f64()
            ),
            Self::Interrupted => "interrupted".to_owned(),
            Self::Output(error) => format!("cannot write: {error}"),
            Self::Silent(code) => format!("exit code {code}"),
        }
    }

    /// Says what went wrong on standard error, and gives the exit code.
    pub(crate) fn report(&self, json: bool) -> ExitCode {
        let exit = self.exit_code();
        match self {
            // The reader of the output has closed it, as `head` does.
            Self::Output(error) if error.kind() == std::io::ErrorKind::BrokenPipe => return ExitCode::SUCCESS,
            Self::Interrupted | Self::Silent(_) => {}
            _ if json => eprintln!("{}", serde_json::json!({ "error": self.as_json() })),
            _ => eprintln!("haptic-ctl: {self}"),
        }
        ExitCode::from(exit)
    }
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&hint::addressed(&self.message()))
    }
}

/// A refusal in the words of the command line: options, not fields of the protocol.
fn in_options(error: &WireError) -> String {
    let mut message = error.message.clone();
    for (field, option) in [
        ("if_revision = ", "--if-revision = "),
        ("ramp_ms = ", "--ramp = "),
        ("rate_hz = ", "--rate = "),
        ("timeout_ms = ", "--timeout = "),
    ] {
        if let Some(rest) = message.strip_prefix(field) {
            message = format!("{option}{rest}");
        }
    }
    message
        .replace("`scene.list` lists", "`haptic-ctl scene list` lists")
        .replace("set `replace`", "use `--replace`")
        .replace("give `range_m`", "give `--range-mm`")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_refusal_names_what_was_typed() {
        for (message, typed) in [
            (
                "ramp_ms = 20000 ms is out of range",
                "--ramp = 20000 ms is out of range",
            ),
            ("if_revision = 1, but the scene", "--if-revision = 1, but the scene"),
            ("rate_hz = 9999 Hz is out of range", "--rate = 9999 Hz is out of range"),
            ("timeout_ms = 1 ms is out of range", "--timeout = 1 ms is out of range"),
            ("a scene `mine`: set `replace` to", "a scene `mine`: use `--replace` to"),
            ("not known: give `range_m`, or", "not known: give `--range-mm`, or"),
            (
                "no scene; `scene.list` lists all",
                "no scene; `haptic-ctl scene list` lists all",
            ),
            ("mass = -1 kg is out of range", "mass = -1 kg is out of range"),
        ] {
            let refused = Failure::from(ClientError::Refused(WireError::new(ErrorCode::OutOfRange, message)));
            assert_eq!(refused.to_string(), typed);
        }
    }

    #[test]
    fn what_one_has_no_right_to_ends_with_4() {
        for code in [ErrorCode::NotPermitted, ErrorCode::ReadOnly] {
            assert_eq!(Failure::code_of_refusal(code), 4);
        }
    }
}
