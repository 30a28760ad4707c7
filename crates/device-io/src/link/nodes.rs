//! Hot-plug: reports when device nodes appear, disappear, or change their rights.

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::OwnedFd;
use rustix::fs::inotify;
use std::ffi::OsStr;
use std::mem::MaybeUninit;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

/// The folder of a node: that in which it appears and disappears.
#[must_use]
pub fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if folder != Path::new("") => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// Watches a folder of device nodes, or the nearest existing folder above it.
///
/// By inotify rather than by the kernel's own events: those come before the node has its rights and
/// its links, need a socket family that a hardened service does not have, and do not report
/// pseudo-terminals.
#[derive(Debug)]
pub(crate) struct NodeWatch {
    folder: PathBuf,
    notices: Option<OwnedFd>,
    watched: Option<PathBuf>,
}

impl NodeWatch {
    pub(crate) fn new(folder: PathBuf) -> Self {
        let notices = inotify::init(inotify::CreateFlags::CLOEXEC | inotify::CreateFlags::NONBLOCK).ok();
        let mut watch = Self {
            folder,
            notices,
            watched: None,
        };
        watch.follow();
        watch
    }

    /// Watches the folder itself as soon as it is there.
    fn follow(&mut self) {
        // A folder that appears between the look for it and the watch on the folder above is not
        // reported: the next look finds it.
        while let nearest = self.nearest()
            && self.watched.as_deref() != Some(nearest)
        {
            let nearest = nearest.to_owned();
            if !self.watch(nearest) {
                return;
            }
        }
    }

    fn nearest(&self) -> &Path {
        self.folder
            .ancestors()
            .find(|folder| folder.is_dir())
            .unwrap_or(Path::new("/"))
    }

    /// Whether a folder could be watched.
    fn watch(&mut self, folder: PathBuf) -> bool {
        let Some(notices) = &self.notices else { return false };
        let what = inotify::WatchFlags::CREATE
            | inotify::WatchFlags::MOVED_TO
            | inotify::WatchFlags::DELETE
            | inotify::WatchFlags::ATTRIB
            // A process that had it open has closed it.
            | inotify::WatchFlags::CLOSE_WRITE;
        self.watched = inotify::add_watch(notices, &folder, what).is_ok().then_some(folder);
        self.watched.is_some()
    }

    /// Forgets what has changed so far.
    pub(crate) fn clear(&mut self) {
        self.take_notices(|_| false);
    }

    /// Reads all changes; whether one of them concerns the caller.
    fn take_notices(&mut self, concerns: impl Fn(&OsStr) -> bool) -> bool {
        let (mut concerned, mut gone) = (false, false);
        if let Some(notices) = &self.notices {
            // While the folder itself is not there, any change may bring it.
            let elsewhere = self.watched.as_deref() != Some(&*self.folder);
            let mut buffer = [MaybeUninit::uninit(); 4096];
            let mut reader = inotify::Reader::new(notices, &mut buffer);
            while let Ok(notice) = reader.next() {
                if notice.events().contains(inotify::ReadFlags::IGNORED) {
                    // A new folder of the same name may be another.
                    gone = true;
                }
                // A notice without a name concerns the folder itself, or says that there were too
                // many.
                concerned |= elsewhere
                    || notice
                        .file_name()
                        .is_none_or(|name| concerns(OsStr::from_bytes(name.to_bytes())));
            }
        }
        if gone {
            self.watched = None;
        }
        self.follow();
        concerned
    }

    /// Waits for a change that concerns the caller, for a timeout at most. Without inotify every
    /// call counts as a change.
    pub(crate) fn changed(&mut self, timeout: Duration, concerns: impl Fn(&OsStr) -> bool) -> bool {
        let until = Instant::now() + timeout;
        loop {
            let left = until.saturating_duration_since(Instant::now());
            let (Some(notices), Some(_)) = (&self.notices, &self.watched) else {
                std::thread::sleep(left);
                return true;
            };
            let mut polled = [PollFd::new(notices, PollFlags::IN)];
            if !poll(&mut polled, Timespec::try_from(left).ok().as_ref()).is_ok_and(|ready| ready > 0) {
                return false;
            }
            if self.take_notices(&concerns) {
                return true;
            }
        }
    }
}
