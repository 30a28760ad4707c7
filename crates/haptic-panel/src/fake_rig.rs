//! A daemon with the fake rig, which belongs to the window: it ends with it, however that ends.

use std::ffi::OsString;
use std::fs::File;
use std::io::{Read as _, Seek as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

const PROGRAM: &str = "hapticd";

/// The daemon, while it runs.
#[derive(Debug)]
pub(crate) struct FakeRig {
    /// Its standard input ends with this program, also with one that is killed; then it ends too.
    daemon: Child,
    /// What it says.
    log: File,
}

impl FakeRig {
    /// Starts it, at the usual socket unless one is named. The panel connects by itself.
    ///
    /// # Errors
    /// There is no such program, or the system does not start it.
    pub(crate) fn start(socket: Option<&Path>) -> Result<Self, String> {
        let program = program();
        let start = || {
            let log = tempfile::tempfile()?;
            let daemon = Command::new(&program)
                .args(arguments(socket))
                .stdin(Stdio::piped())
                .stdout(Stdio::null())
                .stderr(log.try_clone()?)
                .spawn()?;
            Ok(Self { daemon, log })
        };
        start().map_err(|why: std::io::Error| {
            let program = program.display();
            format!("Cannot start {program}: {why}. Install hapticd, or build it beside haptic-gui")
        })
    }

    pub(crate) fn pid(&self) -> u32 {
        self.daemon.id()
    }

    /// Why it has ended, if it has.
    pub(crate) fn end(&mut self) -> Option<String> {
        let status = self.daemon.try_wait().ok()??;
        let mut text = String::new();
        let read = self.log.rewind().and_then(|()| self.log.read_to_string(&mut text));
        let last = read.ok().and_then(|_| text.lines().next_back()).unwrap_or_default();
        Some(format!("The fake rig has ended ({status}). Its log ends with: {last}"))
    }
}

/// The daemon's program: the one beside this one, else the one that is installed.
fn program() -> PathBuf {
    let beside = std::env::current_exe().map(|this| this.with_file_name(PROGRAM));
    beside
        .ok()
        .filter(|path| path.is_file())
        .unwrap_or_else(|| PROGRAM.into())
}

fn arguments(socket: Option<&Path>) -> Vec<OsString> {
    // Nobody is pulled by it, so it may stand still for a moment on a desk's busy machine.
    let usual = "--end-with-input --device fake --hand mouse --stale-ms 500 --control-timeout-ms 2000";
    let mut arguments: Vec<OsString> = usual.split(' ').map(OsString::from).collect();
    arguments.extend(socket.into_iter().flat_map(|path| ["--socket".into(), path.into()]));
    arguments
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fake_rig_is_served_at_the_socket_that_was_named() {
        let named = arguments(Some(Path::new("/tmp/mine")));
        assert_eq!(named[named.len() - 2..], ["--socket", "/tmp/mine"]);
        assert!(!arguments(None).contains(&"--socket".into()), "the daemon chooses");
    }
}
