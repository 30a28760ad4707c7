//! A socket in the file system. Only its intended users can connect, from the moment it exists.
//!
//! | socket | directory made | socket | admitted |
//! |---|---|---|---|
//! | control | 0700 | 0600 | the daemon's own user, root |
//! | control with `--socket-group` | 0750 and the group | 0660 and the group | these and the members of the group |
//! | `--watch-socket` | 0755 | 0666 | everybody who can reach it |
//!
//! An existing directory is not changed. The control socket also asks the kernel who each client
//! is, so a widened mode admits nobody. A socket that the service manager passes (socket activation) is taken as it
//! is, and stays when the daemon ends.

use crate::control::peer::is_member;
use haptic_ipc::Problem;
use nix::unistd::Group;
use rustix::fs::{FlockOperation, Mode, OFlags, flock};
use rustix::io::Errno;
use rustix::process::{geteuid, umask};
use std::fs::{DirBuilder, File, Permissions, set_permissions};
use std::io;
use std::os::unix::fs::{DirBuilderExt, FileTypeExt, MetadataExt, OpenOptionsExt, PermissionsExt, lchown};
use std::os::unix::net::UnixListener as StdListener;
use std::path::{Path, PathBuf};
use thiserror::Error;
use tokio::net::{UnixListener, UnixStream};

/// Why a socket cannot be bound.
#[derive(Debug, Error)]
pub(crate) enum SocketError {
    #[error("{} is in use by a running daemon: end that one first, or name another socket with {option}", .path.display())]
    InUse { path: PathBuf, option: &'static str },
    #[error("{} exists and is not a socket: remove it, or name another socket with {option}", .path.display())]
    NotASocket { path: PathBuf, option: &'static str },
    #[error("cannot create the socket {}: {source}; name another path with {option}", .path.display())]
    Io {
        path: PathBuf,
        option: &'static str,
        source: io::Error,
    },
    #[error(
        "{} cannot be given to the group {group}: {source}; the user who runs hapticd must be a member of the group \
         (`sudo usermod -aG {group} USER`), or root",
        .path.display()
    )]
    Group {
        path: PathBuf,
        group: String,
        source: io::Error,
    },
    #[error(
        "the service manager passed {0}, which is none of the daemon's sockets: let --socket or --watch-socket name the path of its ListenStream="
    )]
    Foreign(String),
}

/// The listening sockets that the service manager passed.
#[derive(Debug, Default)]
pub(crate) struct InheritedSockets(Vec<StdListener>);

impl InheritedSockets {
    /// Those of this process.
    ///
    /// # Errors
    /// One is not a listening Unix stream socket.
    pub(crate) fn of_process() -> Result<Self, SocketError> {
        let mut sockets = listenfd::ListenFd::from_env();
        let foreign = |error: io::Error| SocketError::Foreign(format!("a file ({error})"));
        let listeners = (0..sockets.len()).map(|index| sockets.take_unix_listener(index).map_err(foreign));
        let listeners: Result<Vec<_>, _> = listeners.collect();
        Ok(Self(listeners?.into_iter().flatten().collect()))
    }

    /// The one at a path.
    fn take(&mut self, path: &Path) -> Option<StdListener> {
        let at_path = |listener: &StdListener| listener.local_addr().is_ok_and(|at| at.as_pathname() == Some(path));
        self.0.iter().position(at_path).map(|index| self.0.swap_remove(index))
    }

    /// # Errors
    /// One was not taken: nobody would serve its clients.
    pub(crate) fn all_taken(self) -> Result<(), SocketError> {
        match self.0.first() {
            None => Ok(()),
            Some(left) => Err(SocketError::Foreign(format!("{:?}", left.local_addr()))),
        }
    }
}

/// The intended clients of a socket.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Access {
    /// The daemon's own user, and root.
    Owner,
    /// The daemon's own user, root, and the members of a group.
    Group(Group),
    /// Everybody who can reach it, to watch and to stop.
    Watchers,
}

impl Access {
    fn modes(&self) -> (u32, u32) {
        match self {
            Self::Owner => (0o700, 0o600),
            Self::Group(_) => (0o750, 0o660),
            Self::Watchers => (0o755, 0o666),
        }
    }

    /// The option that names the socket's path.
    fn option(&self) -> &'static str {
        match self {
            Self::Owner | Self::Group(_) => "--socket",
            Self::Watchers => "--watch-socket",
        }
    }

    /// Whether a client is admitted.
    pub(crate) fn admits(&self, client: &UnixStream) -> bool {
        let is_owner = || {
            client
                .peer_cred()
                .is_ok_and(|peer| peer.uid() == geteuid().as_raw() || peer.uid() == 0)
        };
        match self {
            Self::Owner => is_owner(),
            Self::Group(group) => is_owner() || is_member(client, group.gid.as_raw()),
            Self::Watchers => true,
        }
    }

    /// The refusal of a client that is not admitted.
    pub(crate) fn who(&self) -> String {
        match self {
            Self::Owner => "the daemon serves its own user and root only".to_owned(),
            Self::Group(Group { name, .. }) => format!(
                "the daemon serves its own user, root and the members of the group {name} only; new members must log \
                 in again"
            ),
            Self::Watchers => "the daemon serves everybody here".to_owned(),
        }
    }

    /// Sets group and mode of a new file or directory.
    fn share(&self, path: &Path, mode: u32) -> Result<(), SocketError> {
        if let Self::Group(group) = self {
            lchown(path, None, Some(group.gid.as_raw())).map_err(|source| SocketError::Group {
                path: path.to_path_buf(),
                group: group.name.clone(),
                source,
            })?;
        }
        set_permissions(path, Permissions::from_mode(mode)).map_err(|source| SocketError::Io {
            path: path.to_path_buf(),
            option: self.option(),
            source,
        })
    }

    /// Whether the intended clients may pass through a directory.
    fn may_pass(&self, directory: &Path) -> bool {
        let Ok(found) = directory.metadata() else {
            return true;
        };
        match self {
            Self::Owner => true,
            Self::Group(group) => {
                found.mode() & 0o001 != 0 || (found.gid() == group.gid.as_raw() && found.mode() & 0o010 != 0)
            }
            Self::Watchers => found.mode() & 0o001 != 0,
        }
    }
}

/// A listening socket. When it is dropped its file is removed, unless the service manager made it.
#[derive(Debug)]
pub(crate) struct Socket {
    pub(super) listener: UnixListener,
    pub(super) access: Access,
    path: PathBuf,
    is_passed: bool,
    lock: Lock,
}

impl Socket {
    /// Binds the socket, or takes it if it was passed. A stale one, left behind by a daemon that is gone, is replaced.
    pub(crate) fn bind(path: &Path, access: Access, passed: &mut InheritedSockets) -> Result<Self, SocketError> {
        let option = access.option();
        let failed = |source| SocketError::Io {
            path: path.to_path_buf(),
            option,
            source,
        };
        let in_use = || SocketError::InUse {
            path: path.to_path_buf(),
            option,
        };
        let (directory_mode, socket_mode) = access.modes();
        for directory in missing_directories(path).into_iter().rev() {
            DirBuilder::new().mode(0o700).create(directory).map_err(failed)?;
            access.share(directory, directory_mode)?;
        }
        let lock = Lock::take(path).map_err(failed)?.ok_or_else(in_use)?;
        if let Some(listener) = passed.take(path) {
            listener.set_nonblocking(true).map_err(failed)?;
            return Ok(Self {
                listener: UnixListener::from_std(listener).map_err(failed)?,
                access,
                path: path.to_path_buf(),
                is_passed: true,
                lock,
            });
        }
        match std::fs::symlink_metadata(path) {
            Ok(found) if !found.file_type().is_socket() => {
                return Err(SocketError::NotASocket {
                    path: path.to_path_buf(),
                    option,
                });
            }
            // A process that listens here is alive, although it does not hold the lock.
            Ok(_) => match std::os::unix::net::UnixStream::connect(path) {
                Ok(_) => return Err(in_use()),
                Err(error) if error.kind() == io::ErrorKind::ConnectionRefused => {
                    std::fs::remove_file(path).map_err(failed)?;
                }
                Err(error) => return Err(failed(error)),
            },
            Err(_) => {}
        }
        // Before the bind, so that no other user can connect at any moment.
        let before = umask(Mode::from_raw_mode(0o177));
        let bound = UnixListener::bind(path);
        umask(before);
        let socket = Self {
            listener: bound.map_err(failed)?,
            access,
            path: path.to_path_buf(),
            is_passed: false,
            lock,
        };
        socket.access.share(path, socket_mode)?;
        Ok(socket)
    }

    /// Its path.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// What keeps its intended clients from reaching it.
    pub(crate) fn problem(&self) -> Option<Problem> {
        // A relative path is relative to the daemon's working directory.
        let path = std::path::absolute(&self.path).ok()?;
        let closed = path
            .ancestors()
            .skip(1)
            .find(|directory| !self.access.may_pass(directory))?;
        let (whom, group) = match &self.access {
            Access::Group(group) => (format!("the group {}", group.name), group.name.as_str()),
            Access::Owner | Access::Watchers => ("everybody".to_owned(), "GROUP"),
        };
        let (closed, option) = (closed.display(), self.access.option());
        Some(Problem {
            what: format!(
                "{} is open to {whom}, but the directory {closed} is not",
                self.path.display()
            ),
            remedy: match self.access {
                Access::Watchers => format!("`chmod a+x {closed}`, or name another path with {option}"),
                Access::Group(_) | Access::Owner => {
                    format!("`chgrp {group} {closed} && chmod g+x {closed}`, or name another path with {option}")
                }
            },
        })
    }
}

impl Drop for Socket {
    fn drop(&mut self) {
        // Both files are this daemon's own: the lock is still held.
        if !self.is_passed {
            drop(std::fs::remove_file(&self.path));
        }
        drop(std::fs::remove_file(&self.lock.path));
    }
}

/// The missing directories of a path, innermost first.
fn missing_directories(path: &Path) -> Vec<&Path> {
    path.ancestors()
        .skip(1)
        .take_while(|directory| !directory.as_os_str().is_empty() && !directory.exists())
        .collect()
}

/// The lock beside the socket, held while the daemon runs, so that no other daemon takes the socket for stale. The
/// kernel releases it however the process ends.
#[derive(Debug)]
struct Lock {
    path: PathBuf,
    _file: File,
}

impl Lock {
    /// Takes the lock of a socket, unless another process holds it.
    fn take(socket: &Path) -> io::Result<Option<Self>> {
        let mut path = socket.as_os_str().to_owned();
        path.push(".lock");
        let path = PathBuf::from(path);
        loop {
            // Who may write here must not have another file opened in the daemon's name.
            let file = File::options()
                .create(true)
                .truncate(false)
                .write(true)
                .mode(0o600)
                .custom_flags(OFlags::NOFOLLOW.bits().cast_signed())
                .open(&path)?;
            match flock(&file, FlockOperation::NonBlockingLockExclusive) {
                Ok(()) => {}
                Err(Errno::WOULDBLOCK) => return Ok(None),
                Err(error) => return Err(error.into()),
            }
            // A daemon that ended meanwhile has removed the file that was opened here: the lock is another's to take.
            let locked = file.metadata()?;
            match std::fs::symlink_metadata(&path) {
                Ok(found) if (found.dev(), found.ino()) == (locked.dev(), locked.ino()) => {
                    return Ok(Some(Self { path, _file: file }));
                }
                _ => {}
            }
        }
    }
}
