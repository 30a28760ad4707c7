//! Too little memory for a daemon and a program that wants all of it, in a control group of their own.

use crate::process::Killed;
use rustix::process::geteuid;
use std::fs;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

/// Bytes that the group may have.
const LIMIT_BYTES: &str = "67108864";

/// A control group with little memory.
#[derive(Debug)]
pub(super) struct Group {
    folder: PathBuf,
    /// Where its processes came from.
    origin: PathBuf,
}

impl Group {
    /// Makes a group; says why where it cannot be.
    pub(super) fn new(name: &str) -> Result<Self, String> {
        if !geteuid().is_root() {
            return Err("root makes control groups".to_owned());
        }
        let unified = Path::new("/sys/fs/cgroup");
        let controllers = fs::read_to_string(unified.join("cgroup.subtree_control")).unwrap_or_default();
        let (hierarchy, controller, limit) = if controllers.split_whitespace().any(|one| one == "memory") {
            (unified.to_path_buf(), "", "memory.max")
        } else {
            (unified.join("memory"), "memory", "memory.limit_in_bytes")
        };
        let groups = fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
        let own = groups
            .lines()
            .filter_map(|line| line.split_once(':')?.1.split_once(':'))
            .find_map(|(controllers, path)| controllers.split(',').any(|one| one == controller).then_some(path))
            .unwrap_or("/");
        let folder = hierarchy.join(format!("hapticd-soak-{name}-{}", std::process::id()));
        fs::create_dir(&folder).map_err(|error| format!("{}: {error}", folder.display()))?;
        let group = Self {
            folder,
            origin: hierarchy.join(own.trim_start_matches('/')),
        };
        fs::write(group.folder.join(limit), LIMIT_BYTES).map_err(|error| format!("{limit}: {error}"))?;
        Ok(group)
    }

    /// Puts a process into it.
    pub(super) fn take(&self, pid: u32) {
        fs::write(self.folder.join("cgroup.procs"), pid.to_string()).expect("root moves a process");
    }

    /// Puts a process back.
    pub(super) fn release(&self, pid: u32) {
        fs::write(self.origin.join("cgroup.procs"), pid.to_string()).expect("root moves a process");
    }

    /// Starts a program in it that wants all memory, and waits until the kernel has ended it.
    pub(super) fn exhaust(&self) {
        let mut hungry = Killed(
            Command::new("sh")
                .arg("-c")
                // The kernel ends the one that says so.
                .arg(r#"echo $$ > "$0/cgroup.procs" && echo 1000 > /proc/self/oom_score_adj && exec tail /dev/zero"#)
                .arg(&self.folder)
                .stdin(Stdio::null())
                .stdout(Stdio::null())
                .stderr(Stdio::null())
                .spawn()
                .expect("there is a shell"),
        );
        let status = crate::until_some("the memory was not exhausted", || {
            hungry.try_wait().expect("it is ours")
        });
        assert_eq!(status.signal(), Some(9), "the memory was not exhausted: {status}");
    }
}

impl Drop for Group {
    fn drop(&mut self) {
        let began = Instant::now();
        // A process that has just ended is in it for a moment more.
        while fs::remove_dir(&self.folder).is_err() && began.elapsed() < crate::PATIENCE {
            crate::pause();
        }
    }
}
