//! `stop`: which rigs are meant, and what each has answered. In doubt, all.

use crate::all;
use crate::drive;
use crate::failure::Failure;
use crate::output;
use haptic_ipc::Request;
use haptic_ipc::socket_path::{Environment, NamedSocket};
use std::path::{Path, PathBuf};

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
}

/// Stops the rig that is named, and tells which others are engaged; all in reach where none is named, or where what is
/// named is not there.
///
/// # Errors
/// One of them has not confirmed its stop, or the one that was named is not there.
pub(crate) async fn run(named: &NamedRig<'_>, json: bool) -> Result<(), Failure> {
    let environment = Environment::of_process();
    let Some(path) = named.path() else {
        return match &environment.all(None)[..] {
            [] => drive::stop(None, Request::Stop {}, json).await,
            [only] => drive::stop(Some(&only.path), Request::Stop {}, json).await,
            _ => all::stop(None, json).await,
        };
    };
    let others: Vec<NamedSocket> = environment
        .all(None)
        .into_iter()
        .filter(|socket| socket.path != path)
        .collect();
    if !path.exists() && !others.is_empty() {
        let what = match named.rig {
            Some(rig) => format!("there is no rig {rig} ({} is missing)", path.display()),
            None => format!("{} is missing", path.display()),
        };
        return in_spite_of(&what, 3, json).await;
    }
    drive::stop(Some(&path), Request::Stop {}, json).await?;
    let engaged = all::engaged(others).await;
    if !engaged.is_empty() {
        eprintln!("haptic-ctl: still engaged: {}", engaged.join(", "));
    }
    Ok(())
}

/// Stops all rigs, where it is not clear which is meant; then fails with a code.
///
/// # Errors
/// Always: what was asked for is not there.
pub(crate) async fn in_spite_of(what: &str, code: u8, json: bool) -> Result<(), Failure> {
    eprintln!("haptic-ctl: {what}: every rig in reach is stopped");
    if Environment::of_process().all(None).is_empty() {
        drive::stop(None, Request::Stop {}, json).await?;
    } else {
        all::stop(None, json).await?;
    }
    Err(Failure::Silent(code))
}

/// The rig that a subcommand is meant for, where none is named: the only one in reach.
///
/// # Errors
/// There are several.
pub(crate) fn only_one() -> Result<Option<PathBuf>, Failure> {
    let in_reach: Vec<NamedSocket> = Environment::of_process()
        .all(None)
        .into_iter()
        .filter(|socket| std::os::unix::net::UnixStream::connect(&socket.path).is_ok())
        .collect();
    match &in_reach[..] {
        // None, and why, is for who connects to tell.
        [] => Ok(None),
        [only] => Ok(Some(only.path.clone())),
        several => Err(Failure::Usage(format!(
            "{} rigs are in reach: {}; name one with --rig NAME or --socket PATH",
            several.len(),
            several
                .iter()
                .map(|socket| format!("{} ({})", socket.name, socket.path.display()))
                .collect::<Vec<_>>()
                .join(", ")
        ))),
    }
}

/// Prints a line about a rig that was stopped, with its device and socket.
pub(crate) fn show(answer: &str, device: Option<&str>, socket: &Path) -> Result<(), Failure> {
    let device = device.map_or(String::new(), |device| format!("{device}, "));
    output::unless_quiet(&format!("{answer} ({device}{})", socket.display()))
}
