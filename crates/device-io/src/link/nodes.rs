//! Hot-plug: tells when device nodes come, go, or may be opened by others than before.

use rustix::event::{PollFd, PollFlags, Timespec, poll};
use rustix::fd::OwnedFd;
use rustix::fs::inotify;
use std::mem::MaybeUninit;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// Watches a folder of device nodes; while there is no such folder, the nearest one above it.
///
/// By inotify rather than by the kernel's own events: those come before the system has given the node its rights and its links, need a socket family that a hardened
/// service does not have, and say nothing of a pseudo-terminal.
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
        let nearest = self
            .folder
            .ancestors()
            .find(|folder| folder.is_dir())
            .unwrap_or(Path::new("/"));
        if self.watched.as_deref() == Some(nearest) {
            return;
        }
        let Some(notices) = &self.notices else { return };
        let what = inotify::WatchFlags::CREATE
            | inotify::WatchFlags::MOVED_TO
            | inotify::WatchFlags::DELETE
            | inotify::WatchFlags::ATTRIB
            // Whoever had it open has closed it.
            | inotify::WatchFlags::CLOSE_WRITE;
        self.watched = inotify::add_watch(notices, nearest, what)
            .is_ok()
            .then(|| nearest.to_owned());
    }

    /// Forgets what has changed so far.
    pub(crate) fn clear(&mut self) {
        if let Some(notices) = &self.notices {
            let mut buffer = [MaybeUninit::uninit(); 4096];
            let mut reader = inotify::Reader::new(notices, &mut buffer);
            while reader.next().is_ok() {}
        }
        self.follow();
    }

    /// Waits for a change, this long at most; without a way to be told, every look counts as one.
    pub(crate) fn changed(&mut self, timeout: Duration) -> bool {
        let (Some(notices), Some(_)) = (&self.notices, &self.watched) else {
            std::thread::sleep(timeout);
            return true;
        };
        let timeout = Timespec::try_from(timeout).ok();
        let mut polled = [PollFd::new(notices, PollFlags::IN)];
        let changed = poll(&mut polled, timeout.as_ref()).is_ok_and(|ready| ready > 0);
        if changed {
            self.clear();
        }
        changed
    }
}
