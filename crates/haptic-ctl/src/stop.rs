//! `stop`: which rigs are meant, and what each has answered. In doubt, all.

use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::{all, output};
use haptic_ipc::socket_path::{self, Environment, NamedSocket};
use haptic_ipc::{ClientError, Request, RigState, StateReply, Status};
use std::io::ErrorKind;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The rig that is named on the command line or by the variable.
#[derive(Debug)]
pub(crate) struct NamedRig<'a> {
    pub(crate) rig: Option<&'a str>,
    pub(crate) socket: Option<&'a Path>,
}

impl NamedRig<'_> {
    /// Its socket; nothing where none is named.
    pub(crate) fn path(&self) -> Option<PathBuf> {
        let environment = Environment::of_process();
        self.rig
            .map(|rig| environment.for_rig(rig))
            .or_else(|| self.socket.map(Path::to_path_buf))
            .or(environment.variable)
    }

    /// Its socket, for a subcommand that is meant for one rig: where none is named, that of the only one in reach.
    pub(crate) fn one_path(&self) -> Result<Option<PathBuf>, Failure> {
        self.path().map_or_else(only_one, |path| Ok(Some(path)))
    }
}

/// Time without an answer to a stop after which a warning says what to do.
pub(crate) const ALARM: Duration = Duration::from_millis(300);
pub(crate) const NO_ANSWER_YET: &str = "no answer yet: if the motor pulls, cut its power";
/// Time after a refusal for want of room.
const ASK_AGAIN: Duration = Duration::from_millis(5);
/// Time without an answer to a stop after which nobody waits any more.
const TIMEOUT: Duration = Duration::from_secs(2);

/// Stops the rig that is named, and tells which others are engaged; all in reach where none is named, or where what is
/// named is not there.
pub(crate) async fn run(named: &NamedRig<'_>, json: bool) -> Result<(), Failure> {
    let Some(path) = named.path() else {
        return every(json).await;
    };
    if !socket_path::may_exist(&path) && !others_than(&path).is_empty() {
        let what = match named.rig {
            Some(rig) => format!("there is no rig {rig} ({} is missing)", path.display()),
            None => format!("{} is missing", path.display()),
        };
        return in_spite_of(&what, 3, json).await;
    }
    one(Some(&path), json).await?;
    // Looked for only now: a directory may be on a disk that does not answer.
    let engaged = all::engaged(others_than(&path)).await;
    if !engaged.is_empty() {
        eprintln!("haptic-ctl: still engaged: {}", engaged.join(", "));
    }
    Ok(())
}

/// Stops all rigs, where it is not clear which is meant; then fails with a code.
pub(crate) async fn in_spite_of(what: &str, code: u8, json: bool) -> Result<(), Failure> {
    eprintln!("haptic-ctl: {what}: every rig in reach is stopped");
    every(json).await?;
    Err(Failure::Silent(code))
}

/// Stops every rig in reach.
async fn every(json: bool) -> Result<(), Failure> {
    match &Environment::of_process().all(None)[..] {
        [] => one(None, json).await,
        [only] => one(Some(&only.path), json).await,
        _ => all::ask_all(true, None, json).await,
    }
}

fn others_than(path: &Path) -> Vec<NamedSocket> {
    let mut all = Environment::of_process().all(None);
    all.retain(|socket| socket.path != path);
    all
}

/// Stops a rig. Whatever keeps the daemon from saying that it has, the answer to that is not to
/// start one.
async fn one(socket: Option<&Path>, json: bool) -> Result<(), Failure> {
    let reply = ask(socket, if json { None } else { Some("") }).await?;
    if json {
        return output::json(&reply);
    }
    let socket = socket_path::for_client(socket);
    let status = all::status_soon(&socket).await;
    let (done, note) = outcome(&reply, status.as_ref());
    let outcome = [done].into_iter().chain(note).collect::<Vec<_>>().join(", ");
    let device = status.map_or_else(String::new, |status| format!("{}, ", status.device.description));
    output::unless_quiet(&format!("{outcome} ({device}{})", socket.display()))
}

/// What has become of a stop, and a note to it. A faulted rig has no force already, and stays faulted.
pub(crate) fn outcome(reply: &StateReply, status: Option<&Status>) -> (String, Option<String>) {
    let fault = status.and_then(|status| status.fault.as_ref());
    let note = fault
        .filter(|_| reply.state == RigState::Faulted)
        .map(|fault| format!("with zero force: {fault}; `haptic-ctl reset` clears the fault"));
    (format!("{} at tick {}", reply.state, reply.tick), note)
}

/// Asks a rig to stop. Where there is a prefix, a warning that begins with it says meanwhile what to do.
pub(crate) async fn ask(socket: Option<&Path>, prefix: Option<&str>) -> Result<StateReply, Failure> {
    // Where a crowd takes all places, a newcomer is served for a moment, and may come again.
    let asked = async {
        loop {
            match Daemon::ask_at_once(socket, Request::Stop {}).await {
                Err(failure) if failure.is_for_want_of_room() => tokio::time::sleep(ASK_AGAIN).await,
                answered => return answered,
            }
        }
    };
    tokio::pin!(asked);
    let answered = match tokio::time::timeout(ALARM, &mut asked).await {
        Ok(answered) => answered,
        Err(_) => {
            if let Some(prefix) = prefix {
                eprintln!("haptic-ctl: {prefix}{NO_ANSWER_YET}");
            }
            tokio::time::timeout(TIMEOUT - ALARM, asked)
                .await
                .unwrap_or(Err(Failure::NoAnswer(TIMEOUT)))
        }
    };
    answered.map_err(|failure| match failure {
        Failure::Client(ClientError::Refused(_)) => failure,
        _ => Failure::CannotStop(Box::new(failure)),
    })
}

/// The only rig in reach.
pub(crate) fn only_one() -> Result<Option<PathBuf>, Failure> {
    let found = Environment::of_process().all(None);
    let (mut in_reach, mut silent, mut closed) = (Vec::new(), socket_path::configured_besides(&found), None);
    for socket in found {
        match UnixStream::connect(&socket.path) {
            Ok(_) => in_reach.push(socket),
            Err(error) if error.kind() == ErrorKind::PermissionDenied => closed = closed.or(Some(socket.path)),
            Err(_) => silent.push(socket),
        }
    }
    Ok(the_one(&in_reach, &silent)?.or(closed))
}

/// The only one of those in reach; nothing where none is, and who connects tells why. A rig with a name is not taken for
/// one that does not answer.
fn the_one(in_reach: &[NamedSocket], silent: &[NamedSocket]) -> Result<Option<PathBuf>, Failure> {
    match in_reach {
        [] => Ok(None),
        [only] => match silent {
            [other, ..] if socket_path::name_of(&only.path).is_some() => Err(Failure::Usage(format!(
                "{} is in reach, and {} does not answer: name the one you mean with --rig NAME or --socket PATH",
                only.name, other.name
            ))),
            _ => Ok(Some(only.path.clone())),
        },
        several => Err(Failure::Usage(format!(
            "{} rigs are in reach: {}; name one with --rig NAME or --socket PATH; `status`, `stop` and `doctor` \
             also take --all",
            several.len(),
            several
                .iter()
                .map(|socket| format!("{} ({})", socket.name, socket.path.display()))
                .collect::<Vec<_>>()
                .join(", ")
        ))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // hazard: H26
    #[test]
    fn a_named_rig_is_not_taken_for_one_that_does_not_answer() {
        let rig = |name: &str| NamedSocket {
            name: name.to_owned(),
            path: Path::new("/run").join(name).join("control.sock"),
        };
        let (unnamed, left, right) = (rig("hapticd"), rig("hapticd@left"), rig("hapticd@right"));
        let found = |in_reach: &[&NamedSocket], silent: &[&NamedSocket]| {
            let [in_reach, silent] =
                [in_reach, silent].map(|rigs| rigs.iter().map(|rig| (*rig).clone()).collect::<Vec<_>>());
            the_one(&in_reach, &silent).map_err(|failure| failure.to_string())
        };
        let refused = found(&[&right], &[&left]).expect_err("which is meant?");
        assert!(
            refused.contains("left does not answer") && refused.contains("--rig"),
            "{refused}"
        );
        assert!(found(&[&left, &right], &[]).is_err());
        assert_eq!(found(&[&right], &[]), Ok(Some(right.path.clone())));
        assert_eq!(
            found(&[&unnamed], &[&left]),
            Ok(Some(unnamed.path.clone())),
            "it goes without a name"
        );
        assert_eq!(found(&[], &[&left]), Ok(None));
    }
}
