//! A small disk for a daemon, which can be full: a file system in memory where root may mount one for the daemon alone,
//! else a limit on the size of its files.

use rustix::process::{Pid, Resource, Rlimit, geteuid, prlimit};
use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// Size of the file system, in words of mount.
const SIZE: &str = "size=1m";

/// The disk of a daemon.
#[derive(Debug)]
pub(super) struct Disk {
    /// As the daemon sees it.
    folder: PathBuf,
    is_mounted: bool,
}

impl Disk {
    /// Prepares a folder, and the command that starts a program on it.
    pub(super) fn at(folder: PathBuf) -> (Self, Command) {
        fs::create_dir_all(&folder).expect("a folder");
        let is_mounted = geteuid().is_root() && may_unshare();
        let program = crate::binary("hapticd");
        let command = if is_mounted {
            let mut command = Command::new("unshare");
            command
                .args(["--mount", "--propagation", "private", "sh", "-c"])
                // Each of them runs in the place of the one before, so the process is the program's.
                .arg(format!(r#"mount -t tmpfs -o {SIZE} none "$0" && exec "$@""#))
                .arg(&folder)
                .arg(program);
            command
        } else {
            Command::new(program)
        };
        (Self { folder, is_mounted }, command)
    }

    /// The folder, as a process sees it that has the disk of the daemon `pid`.
    pub(super) fn seen_by(&self, pid: u32) -> PathBuf {
        if self.is_mounted {
            let within = self.folder.strip_prefix("/").unwrap_or(&self.folder);
            Path::new("/proc").join(pid.to_string()).join("root").join(within)
        } else {
            self.folder.clone()
        }
    }

    /// Leaves no room for the daemon `pid` and for `other`.
    pub(super) fn fill(&self, pid: u32, other: u32) {
        if self.is_mounted {
            let mut file = File::create(self.seen_by(pid).join("filling")).expect("a file");
            while file.write_all(&[0; 4096]).is_ok() {}
        } else {
            for pid in [pid, other] {
                limit_files(pid, Some(0));
            }
        }
    }

    /// Makes room again.
    pub(super) fn empty(&self, pid: u32) {
        if self.is_mounted {
            fs::remove_file(self.seen_by(pid).join("filling")).expect("it is there");
        } else {
            limit_files(pid, None);
        }
    }
}

fn may_unshare() -> bool {
    let tried = Command::new("unshare")
        .args(["--mount", "true"])
        .stderr(Stdio::null())
        .status();
    tried.is_ok_and(|status| status.success())
}

/// Bounds the size of the files that a process writes, bytes.
fn limit_files(pid: u32, current: Option<u64>) {
    let pid = Pid::from_raw(i32::try_from(pid).expect("a process")).expect("a process");
    let limit = Rlimit { current, maximum: None };
    prlimit(Some(pid), Resource::Fsize, limit).expect("a process of ours");
}
