//! The control socket: made so that only its owner can use it, and one task for each client.

use crate::control::{RigHandle, session};
use haptic_ipc::{ErrorCode, WireError};
use rustix::fs::Mode;
use rustix::process::{geteuid, umask};
use serde_json::json;
use std::io;
use std::os::unix::fs::{DirBuilderExt, FileTypeExt};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use thiserror::Error;
use tokio::io::AsyncWriteExt;
use tokio::net::{UnixListener, UnixStream};

/// Clients served at once.
const MOST_CLIENTS: usize = 32;

/// Why the socket cannot be made.
#[derive(Debug, Error)]
pub(crate) enum SocketError {
    #[error("{} is in use by a daemon that is running: stop it first, or name another socket with --socket", .0.display())]
    InUse(PathBuf),
    #[error("{} exists and is not a socket: remove it, or name another socket with --socket", .0.display())]
    NotASocket(PathBuf),
    #[error("the socket {} cannot be made: {source}; name another place with --socket", .path.display())]
    Io { path: PathBuf, source: io::Error },
}

/// The socket; its file goes with it.
#[derive(Debug)]
pub(crate) struct Server {
    listener: UnixListener,
    path: PathBuf,
}

impl Server {
    /// Makes the socket. One left behind by a daemon that is gone is replaced.
    pub(crate) fn bind(path: &Path) -> Result<Self, SocketError> {
        let failed = |source| SocketError::Io {
            path: path.to_path_buf(),
            source,
        };
        if let Some(directory) = path.parent().filter(|directory| !directory.as_os_str().is_empty()) {
            std::fs::DirBuilder::new()
                .recursive(true)
                .mode(0o700)
                .create(directory)
                .map_err(failed)?;
        }
        match std::fs::symlink_metadata(path) {
            Ok(found) if !found.file_type().is_socket() => return Err(SocketError::NotASocket(path.to_path_buf())),
            Ok(_) if std::os::unix::net::UnixStream::connect(path).is_ok() => {
                return Err(SocketError::InUse(path.to_path_buf()));
            }
            Ok(_) => std::fs::remove_file(path).map_err(failed)?,
            Err(_) => {}
        }
        // Before the bind, so that there is no moment at which another user could connect.
        let before = umask(Mode::from_raw_mode(0o177));
        let bound = UnixListener::bind(path);
        umask(before);
        Ok(Self {
            listener: bound.map_err(failed)?,
            path: path.to_path_buf(),
        })
    }

    /// Where the socket is.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Serves clients for ever. Within a `LocalSet`.
    pub(crate) async fn serve(&self, rig: Rc<RigHandle>) {
        let mut session = 0;
        loop {
            let Ok((stream, _)) = self.listener.accept().await else {
                // Out of descriptors, most likely: let a client go before the next try.
                tokio::time::sleep(std::time::Duration::from_millis(100)).await;
                continue;
            };
            session += 1;
            let rig = Rc::clone(&rig);
            tokio::task::spawn_local(async move {
                if !is_ours(&stream) {
                    return;
                }
                if rig.clients().get() >= MOST_CLIENTS {
                    refuse(stream).await;
                    return;
                }
                rig.clients().set(rig.clients().get() + 1);
                session::run(Rc::clone(&rig), stream, session).await;
                rig.clients().set(rig.clients().get() - 1);
            });
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // Another daemon's socket would answer; this one no longer does.
        drop(std::fs::remove_file(&self.path));
    }
}

/// Whether the peer is the daemon's own user or root, whatever the socket's mode has become.
fn is_ours(stream: &UnixStream) -> bool {
    stream
        .peer_cred()
        .is_ok_and(|peer| peer.uid() == geteuid().as_raw() || peer.uid() == 0)
}

async fn refuse(mut stream: UnixStream) {
    let error = WireError::new(
        ErrorCode::TooManyClients,
        format!("{MOST_CLIENTS} clients are connected, the most that are served: close one first"),
    );
    let line = format!("{}\n", json!({ "id": null, "error": error }));
    // Whether it hears or not, it is not served.
    drop(stream.write_all(line.as_bytes()).await);
}
