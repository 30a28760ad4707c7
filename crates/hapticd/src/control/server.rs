//! The control socket: made so that only its owner can use it, and one task for each client.

use crate::control::RigHandle;
use crate::control::session::{self, MOST_CLIENTS, Rights};
use haptic_ipc::{ErrorCode, Peer, WireError};
use rustix::fs::{FlockOperation, Mode, flock};
use rustix::io::Errno;
use rustix::process::{geteuid, umask};
use serde_json::json;
use std::cell::Cell;
use std::fs::File;
use std::io;
use std::os::unix::fs::{DirBuilderExt, FileTypeExt, OpenOptionsExt};
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::time::Duration;
use thiserror::Error;
use tokio::io::AsyncWriteExt;
use tokio::net::{UnixListener, UnixStream};

/// Clients beyond the most served that may be connected for a moment, to stop the rig.
const STOPPING_CLIENTS: usize = 8;

/// How long such a client may stay.
const STOPPING_TIME: Duration = Duration::from_secs(2);

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
    /// Sessions begun so far.
    sessions: Cell<u64>,
    /// Held as long as the daemon lives, so that no other takes its socket for stale.
    _lock: File,
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
        let lock = lock(path)?;
        match std::fs::symlink_metadata(path) {
            Ok(found) if !found.file_type().is_socket() => return Err(SocketError::NotASocket(path.to_path_buf())),
            // Whoever listens here does not hold the lock, but is alive.
            Ok(_) => match std::os::unix::net::UnixStream::connect(path) {
                Ok(_) => return Err(SocketError::InUse(path.to_path_buf())),
                Err(error) if error.kind() == io::ErrorKind::ConnectionRefused => {
                    std::fs::remove_file(path).map_err(failed)?;
                }
                Err(error) => return Err(failed(error)),
            },
            Err(_) => {}
        }
        // Before the bind, so that there is no moment at which another user could connect.
        let before = umask(Mode::from_raw_mode(0o177));
        let bound = UnixListener::bind(path);
        umask(before);
        Ok(Self {
            listener: bound.map_err(failed)?,
            path: path.to_path_buf(),
            sessions: Cell::new(0),
            _lock: lock,
        })
    }

    /// Where the socket is.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Serves clients for ever. Within a `LocalSet`.
    pub(crate) async fn serve(&self, rig: Rc<RigHandle>) {
        loop {
            let Ok((stream, _)) = self.listener.accept().await else {
                // Out of descriptors, most likely: let a client go before the next try.
                tokio::time::sleep(Duration::from_millis(100)).await;
                continue;
            };
            let session = self.sessions.get() + 1;
            self.sessions.set(session);
            let rig = Rc::clone(&rig);
            tokio::task::spawn_local(async move {
                if !is_ours(&stream) {
                    let error = WireError::new(ErrorCode::NotPermitted, "the daemon serves its own user and root only");
                    refuse(stream, error).await;
                    return;
                }
                let connected = rig.clients().get();
                if connected >= MOST_CLIENTS + STOPPING_CLIENTS {
                    let error =
                        WireError::new(ErrorCode::TooManyClients, "too many clients are connected even to stop");
                    refuse(stream, error).await;
                    return;
                }
                let peer = peer_of(&stream, session);
                let _place = Place::take(&rig);
                if connected < MOST_CLIENTS {
                    session::run(Rc::clone(&rig), stream, session, peer, Rights::All).await;
                } else {
                    let brief = session::run(Rc::clone(&rig), stream, session, peer, Rights::OnlyStop);
                    // It has had its chance to stop; nothing is lost with the rest.
                    drop(tokio::time::timeout(STOPPING_TIME, brief).await);
                }
            });
        }
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It is this daemon's own: the lock is still held.
        drop(std::fs::remove_file(&self.path));
    }
}

/// Takes the lock beside the socket. The kernel lets it go with the process, however that ends.
fn lock(path: &Path) -> Result<File, SocketError> {
    let mut name = path.as_os_str().to_owned();
    name.push(".lock");
    let failed = |source| SocketError::Io {
        path: path.to_path_buf(),
        source,
    };
    let file = File::options()
        .create(true)
        .truncate(false)
        .write(true)
        .mode(0o600)
        .open(name)
        .map_err(failed)?;
    match flock(&file, FlockOperation::NonBlockingLockExclusive) {
        Ok(()) => Ok(file),
        Err(Errno::WOULDBLOCK) => Err(SocketError::InUse(path.to_path_buf())),
        Err(error) => Err(failed(error.into())),
    }
}

/// Whether the peer is the daemon's own user or root, whatever the socket's mode has become.
fn is_ours(stream: &UnixStream) -> bool {
    stream
        .peer_cred()
        .is_ok_and(|peer| peer.uid() == geteuid().as_raw() || peer.uid() == 0)
}

/// Who the client is, as the kernel says.
fn peer_of(stream: &UnixStream, session: u64) -> Peer {
    let known = stream.peer_cred().ok();
    Peer {
        session: format!("{}-{session}", std::process::id()),
        uid: known.map_or(u32::MAX, |peer| peer.uid()),
        pid: known.and_then(|peer| peer.pid()),
        ..Peer::default()
    }
}

/// One of the places for clients, given back however its session ends.
struct Place(Rc<RigHandle>);

impl Place {
    fn take(rig: &Rc<RigHandle>) -> Self {
        rig.clients().set(rig.clients().get() + 1);
        Self(Rc::clone(rig))
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        self.0.clients().set(self.0.clients().get() - 1);
    }
}

async fn refuse(mut stream: UnixStream, error: WireError) {
    let line = format!("{}\n", json!({ "id": null, "error": error }));
    // Whether it hears or not, it is not served.
    drop(stream.write_all(line.as_bytes()).await);
}
