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
use std::cell::{Cell, RefCell};
use std::fs::{DirBuilder, File, Metadata, Permissions, set_permissions};
use std::io;
use std::os::unix::fs::{DirBuilderExt, FileTypeExt, MetadataExt, OpenOptionsExt, PermissionsExt, lchown};
use std::os::unix::net::UnixListener as StdListener;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use thiserror::Error;
use tokio::net::{UnixListener, UnixStream};
use tokio::sync::Notify;

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

    /// That the system refuses something to a socket at a path.
    fn failed(&self, path: &Path) -> impl Fn(io::Error) -> SocketError + use<> {
        let (path, option) = (path.to_path_buf(), self.option());
        move |source| SocketError::Io {
            path: path.clone(),
            option,
            source,
        }
    }

    /// That another process serves a path.
    fn in_use(&self, path: &Path) -> SocketError {
        SocketError::InUse {
            path: path.to_path_buf(),
            option: self.option(),
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
        set_permissions(path, Permissions::from_mode(mode)).map_err(self.failed(path))
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
    listener: RefCell<Rc<UnixListener>>,
    /// It was bound again.
    bound_again: Notify,
    pub(super) access: Access,
    path: PathBuf,
    /// The file at the path, where it is this socket's.
    file: Cell<Option<FileId>>,
    /// Whether the service manager made that file.
    is_passed: Cell<bool>,
    lock: RefCell<Lock>,
}

impl Socket {
    /// Binds the socket, or takes it if it was passed. A stale one, left behind by a daemon that is gone, is replaced.
    pub(crate) fn bind(path: &Path, access: Access, passed: &mut InheritedSockets) -> Result<Self, SocketError> {
        let failed = access.failed(path);
        make_directories(path, &access)?;
        let lock = Lock::take_for(path, &access)?;
        let (listener, is_passed) = match passed.take(path) {
            Some(listener) => {
                listener.set_nonblocking(true).map_err(&failed)?;
                (UnixListener::from_std(listener).map_err(&failed)?, true)
            }
            None => {
                match std::fs::symlink_metadata(path) {
                    Ok(found) if !found.file_type().is_socket() => {
                        return Err(SocketError::NotASocket {
                            path: path.to_path_buf(),
                            option: access.option(),
                        });
                    }
                    // A process that listens here is alive, although it does not hold the lock.
                    Ok(_) => match std::os::unix::net::UnixStream::connect(path) {
                        Ok(_) => return Err(access.in_use(path)),
                        Err(error) if error.kind() == io::ErrorKind::ConnectionRefused => {
                            std::fs::remove_file(path).map_err(&failed)?;
                        }
                        Err(error) => return Err(failed(error)),
                    },
                    Err(_) => {}
                }
                (listen(path, &access)?, false)
            }
        };
        Ok(Self {
            listener: RefCell::new(Rc::new(listener)),
            bound_again: Notify::new(),
            access,
            path: path.to_path_buf(),
            file: Cell::new(FileId::of(path)),
            is_passed: Cell::new(is_passed),
            lock: RefCell::new(lock),
        })
    }

    /// The next client.
    ///
    /// # Errors
    /// It cannot be taken, for lack of descriptors.
    pub(super) async fn accept(&self) -> io::Result<UnixStream> {
        loop {
            let listener = Rc::clone(&self.listener.borrow());
            tokio::select! {
                accepted = listener.accept() => return accepted.map(|(stream, _)| stream),
                () = self.bound_again.notified() => {}
            }
        }
    }

    /// Looks whether clients find this socket at its path. Where nothing is there it is bound again, under the lock;
    /// returns whether it was. What another process has put there stays.
    ///
    /// # Errors
    /// Why clients cannot find it.
    pub(super) fn stay_reachable(&self) -> Result<bool, String> {
        let found = FileId::of(&self.path);
        if found.is_some() && found == self.file.get() {
            return Ok(false);
        }
        if found.is_some() {
            return Err("another file has taken its place".to_owned());
        }
        self.bind_again().map(|()| true).map_err(|error| error.to_string())
    }

    fn bind_again(&self) -> Result<(), SocketError> {
        make_directories(&self.path, &self.access)?;
        if !self.lock.borrow().is_in_place() {
            self.lock.replace(Lock::take_for(&self.path, &self.access)?);
        }
        let listener = listen(&self.path, &self.access)?;
        self.file.set(FileId::of(&self.path));
        self.is_passed.set(false);
        self.listener.replace(Rc::new(listener));
        self.bound_again.notify_one();
        Ok(())
    }

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
        // The lock is still held, and both files are this daemon's own where they are those that it made.
        let lock = self.lock.borrow();
        if !self.is_passed.get() && self.file.get().is_some() && self.file.get() == FileId::of(&self.path) {
            drop(std::fs::remove_file(&self.path));
        }
        if lock.is_in_place() {
            drop(std::fs::remove_file(&lock.path));
        }
    }
}

/// Which file it is, whatever its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct FileId {
    device: u64,
    inode: u64,
}

impl FileId {
    fn of(path: &Path) -> Option<Self> {
        std::fs::symlink_metadata(path)
            .ok()
            .map(|found| Self::of_metadata(&found))
    }

    fn of_metadata(found: &Metadata) -> Self {
        Self {
            device: found.dev(),
            inode: found.ino(),
        }
    }
}

/// Makes the directories of a socket that are missing, for its intended clients.
fn make_directories(path: &Path, access: &Access) -> Result<(), SocketError> {
    for directory in missing_directories(path).into_iter().rev() {
        DirBuilder::new()
            .mode(0o700)
            .create(directory)
            .map_err(access.failed(path))?;
        access.share(directory, access.modes().0)?;
    }
    Ok(())
}

/// Listens at a path where nothing is.
fn listen(path: &Path, access: &Access) -> Result<UnixListener, SocketError> {
    // Before the bind, so that no other user can connect at any moment.
    let before = umask(Mode::from_raw_mode(0o177));
    let bound = UnixListener::bind(path);
    umask(before);
    let listener = bound.map_err(access.failed(path))?;
    access.share(path, access.modes().1)?;
    Ok(listener)
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
    file: File,
}

impl Lock {
    /// Takes the lock of a socket for the daemon that serves it.
    fn take_for(socket: &Path, access: &Access) -> Result<Self, SocketError> {
        let taken = Self::take(socket).map_err(access.failed(socket))?;
        taken.ok_or_else(|| access.in_use(socket))
    }

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
            let lock = Self {
                path: path.clone(),
                file,
            };
            if lock.is_in_place() {
                return Ok(Some(lock));
            }
        }
    }

    /// Whether the file that is locked is the one that others find.
    fn is_in_place(&self) -> bool {
        let locked = self.file.metadata().ok();
        locked.is_some_and(|locked| FileId::of(&self.path) == Some(FileId::of_metadata(&locked)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    // hazard: H24
    #[tokio::test]
    async fn a_passed_socket_that_was_removed_leaves_no_file_behind() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("control.sock");
        let bind = |listener| Socket::bind(&path, Access::Owner, &mut InheritedSockets(vec![listener]));
        let socket = bind(StdListener::bind(&path).expect("bound")).expect("taken");
        drop(socket);
        assert!(path.exists(), "it is the service manager's");
        std::fs::remove_file(&path).expect("it is there");
        let socket = bind(StdListener::bind(&path).expect("bound")).expect("taken");
        std::fs::remove_file(&path).expect("it is there");
        assert_eq!(socket.stay_reachable(), Ok(true));
        assert!(path.exists(), "bound again");
        drop(socket);
        assert!(!path.exists(), "its own is left behind");
    }
}
