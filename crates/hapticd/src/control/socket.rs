//! A socket in the file system, made so that nobody can use it before its mode is right, and nobody
//! beyond that later.
//!
//! | socket | directory made | socket | admitted |
//! |---|---|---|---|
//! | control | 0700 | 0600 | the daemon's own user, root |
//! | control with `--socket-group` | 0750 and the group | 0660 and the group | these and the members of the group |
//! | `--watch-socket` | 0755 | 0666 | whoever can reach it |
//!
//! A directory that exists is left as it is. Whom the control socket admits is asked of the kernel
//! for every client: a mode that somebody has changed lets nobody in.

use crate::control::peer::is_member;
use haptic_ipc::Problem;
use nix::unistd::Group as SystemGroup;
use rustix::fs::{FlockOperation, Mode, flock};
use rustix::io::Errno;
use rustix::process::{geteuid, umask};
use std::fs::{DirBuilder, File, Permissions, set_permissions};
use std::io;
use std::os::unix::fs::{DirBuilderExt, FileTypeExt, MetadataExt, OpenOptionsExt, PermissionsExt, lchown};
use std::path::{Path, PathBuf};
use thiserror::Error;
use tokio::net::{UnixListener, UnixStream};

/// Why a socket cannot be made.
#[derive(Debug, Error)]
pub(crate) enum SocketError {
    #[error("{} is in use by a daemon that is running: stop it first, or name another socket with {option}", .path.display())]
    InUse { path: PathBuf, option: &'static str },
    #[error("{} exists and is not a socket: remove it, or name another socket with {option}", .path.display())]
    NotASocket { path: PathBuf, option: &'static str },
    #[error("the socket {} cannot be made: {source}; name another place with {option}", .path.display())]
    Io {
        path: PathBuf,
        option: &'static str,
        source: io::Error,
    },
    #[error(
        "{} cannot be given to the group {group}: {source}; the user who runs hapticd must be a member of it (`sudo usermod -aG {group} USER`), or root",
        .path.display()
    )]
    Group {
        path: PathBuf,
        group: String,
        source: io::Error,
    },
}

/// A group of users.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Group {
    name: String,
    id: u32,
}

impl Group {
    /// The group of a name or a number.
    pub(crate) fn find(wanted: &str) -> Option<Self> {
        let found = match wanted.parse() {
            Ok(id) => SystemGroup::from_gid(nix::unistd::Gid::from_raw(id)),
            Err(_) => SystemGroup::from_name(wanted),
        };
        let SystemGroup { name, gid, .. } = found.ok().flatten()?;
        Some(Self { name, id: gid.as_raw() })
    }
}

/// Whom a socket is for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Access {
    /// The daemon's own user, and root.
    Owner,
    /// These, and the members of a group.
    Group(Group),
    /// Whoever can reach it, to watch and to stop.
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

    /// The option that says where the socket is.
    fn option(&self) -> &'static str {
        match self {
            Self::Owner | Self::Group(_) => "--socket",
            Self::Watchers => "--watch-socket",
        }
    }

    /// Whether a client may come in.
    pub(crate) fn admits(&self, client: &UnixStream) -> bool {
        let is_owner = || {
            client
                .peer_cred()
                .is_ok_and(|peer| peer.uid() == geteuid().as_raw() || peer.uid() == 0)
        };
        match self {
            Self::Owner => is_owner(),
            Self::Group(group) => is_owner() || is_member(client, group.id),
            Self::Watchers => true,
        }
    }

    /// Whom it admits, for those whom it does not.
    pub(crate) fn who(&self) -> String {
        match self {
            Self::Owner => "the daemon serves its own user and root only".to_owned(),
            Self::Group(Group { name, .. }) => format!(
                "the daemon serves its own user, root and the members of the group {name} only; new members must log in again"
            ),
            Self::Watchers => "the daemon serves everybody here".to_owned(),
        }
    }

    /// Gives a file or directory just made to those whom it is for.
    fn share(&self, path: &Path, mode: u32) -> Result<(), SocketError> {
        if let Self::Group(group) = self {
            lchown(path, None, Some(group.id)).map_err(|source| SocketError::Group {
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

    /// Whether those whom it is for may pass through a directory.
    fn may_pass(&self, directory: &Path) -> bool {
        let Ok(found) = directory.metadata() else {
            return true;
        };
        match self {
            Self::Owner => true,
            Self::Group(group) => found.mode() & 0o001 != 0 || (found.gid() == group.id && found.mode() & 0o010 != 0),
            Self::Watchers => found.mode() & 0o001 != 0,
        }
    }
}

/// A socket that is listened on; its file goes with it.
#[derive(Debug)]
pub(crate) struct Socket {
    pub(super) listener: UnixListener,
    pub(super) access: Access,
    path: PathBuf,
    /// Held as long as the daemon lives, so that no other takes its socket for stale.
    _lock: File,
}

impl Socket {
    /// Makes the socket. One left behind by a daemon that is gone is replaced.
    pub(crate) fn bind(path: &Path, access: Access) -> Result<Self, SocketError> {
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
        let lock = lock(path).map_err(failed)?.ok_or_else(in_use)?;
        match std::fs::symlink_metadata(path) {
            Ok(found) if !found.file_type().is_socket() => {
                return Err(SocketError::NotASocket {
                    path: path.to_path_buf(),
                    option,
                });
            }
            // The process that listens here does not hold the lock, but is alive.
            Ok(_) => match std::os::unix::net::UnixStream::connect(path) {
                Ok(_) => return Err(in_use()),
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
        let socket = Self {
            listener: bound.map_err(failed)?,
            access,
            path: path.to_path_buf(),
            _lock: lock,
        };
        socket.access.share(path, socket_mode)?;
        Ok(socket)
    }

    /// Where it is.
    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// What keeps those whom it is for from reaching it.
    pub(crate) fn problem(&self) -> Option<Problem> {
        // A relative path lies where the daemon was started.
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
                "{} is for {whom}, who may not pass through {closed}",
                self.path.display()
            ),
            remedy: match self.access {
                Access::Watchers => format!("`chmod a+x {closed}`, or name another place with {option}"),
                Access::Group(_) | Access::Owner => {
                    format!("`chgrp {group} {closed} && chmod g+x {closed}`, or name another place with {option}")
                }
            },
        })
    }
}

impl Drop for Socket {
    fn drop(&mut self) {
        // It is this daemon's own: the lock is still held.
        drop(std::fs::remove_file(&self.path));
    }
}

/// The directories on the way to a path that are not there yet, innermost first.
fn missing_directories(path: &Path) -> Vec<&Path> {
    path.ancestors()
        .skip(1)
        .take_while(|directory| !directory.as_os_str().is_empty() && !directory.exists())
        .collect()
}

/// Takes the lock beside the socket, if nobody has it. The kernel lets it go with the process,
/// however that ends.
fn lock(path: &Path) -> io::Result<Option<File>> {
    let mut name = path.as_os_str().to_owned();
    name.push(".lock");
    let file = File::options()
        .create(true)
        .truncate(false)
        .write(true)
        .mode(0o600)
        .open(name)?;
    match flock(&file, FlockOperation::NonBlockingLockExclusive) {
        Ok(()) => Ok(Some(file)),
        Err(Errno::WOULDBLOCK) => Ok(None),
        Err(error) => Err(error.into()),
    }
}
