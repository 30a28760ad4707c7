//! A machine of its own for the service: a minimal Debian with its systemd as PID 1 of new namespaces, on which the
//! package is installed.

use crate::{PATIENCE, package, stderr, text};
use haptic_ipc::Client;
use rustix::process::geteuid;
use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::sync::OnceLock;
use std::time::Instant;

/// The repository.
const REPOSITORY: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// What the packaged configuration holds.
pub const CONFIGURATION: &str = include_str!("../../packaging/hapticd.toml");

/// The package, on the machine.
pub const PACKAGE: &str = "/root/hapticd.deb";

/// What a unit needs instead of its limits where PID 1 itself may not raise any.
const WITHOUT_LIMITS: &str = "[Service]
AmbientCapabilities=CAP_SYS_NICE CAP_IPC_LOCK
CapabilityBoundingSet=CAP_SYS_NICE CAP_IPC_LOCK
";

/// Number of the capability to raise limits.
const CAP_SYS_RESOURCE: u32 = 24;

/// The machine. It is gone, with all that runs on it, when this is dropped.
#[derive(Debug)]
pub struct Machine {
    unshare: Child,
    init: u32,
    cgroup: PathBuf,
    raises_limits: bool,
    _directory: tempfile::TempDir,
}

impl Machine {
    /// Boots a machine and installs the package on it, with more lines in its configuration.
    /// Returns nothing, and says why, where that cannot be.
    pub fn boot(configuration: &str) -> Option<Self> {
        let machine = Self::boot_bare()?;
        machine.run_ok(&["dpkg", "--install", PACKAGE]);
        machine.configure(configuration);
        Some(machine)
    }

    /// Boots a machine that has the package as a file alone, [`PACKAGE`].
    /// Returns nothing, and says why, where that cannot be.
    pub fn boot_bare() -> Option<Self> {
        // The package takes a while to be built, and each machine to boot.
        if !test_run::is_long_for("the package on a systemd of its own") {
            return None;
        }
        let ready = missing().and_then(|hierarchy| Ok((hierarchy, debian()?, package::hapticd()?)));
        let (hierarchy, debian, package) = match ready {
            Ok(ready) => ready,
            Err((need, remedy)) => {
                test_run::skip(need, &remedy);
                return None;
            }
        };
        let directory = tempfile::tempdir().expect("a directory");
        let stage = directory.path();
        // Its own user goes through here.
        fs::set_permissions(stage, fs::Permissions::from_mode(0o755)).expect("it is ours");
        let put = |path: &str, content: &[u8]| {
            let path = stage.join(path);
            fs::create_dir_all(path.parent().expect("it lies in the stage")).expect("a directory");
            fs::write(path, content).expect("written");
        };
        // With an identity it is no first boot, which would enable whatever this machine has.
        put("etc/machine-id", b"6a70dc4a1f0e4c1c9d5d6f2f6b7a8c90\n");
        let raises_limits = capabilities() & 1 << CAP_SYS_RESOURCE != 0;
        if !raises_limits {
            put(
                "etc/systemd/system/hapticd.service.d/capabilities.conf",
                WITHOUT_LIMITS.as_bytes(),
            );
            println!("NOTE: root lacks CAP_SYS_RESOURCE here, so capabilities stand in for the limits of the unit");
        }

        let cgroup = hierarchy.join(stage.file_name().expect("it has a name"));
        fs::create_dir(&cgroup).expect("root makes cgroups");
        let printed = fs::File::create(stage.join("printed")).expect("a file");
        let mut unshare = Command::new("sh")
            .arg(Path::new(REPOSITORY).join("tests/systemd/pid1.sh"))
            .args([&debian, stage, &cgroup])
            .stdin(Stdio::null())
            .stdout(printed.try_clone().expect("a second handle"))
            .stderr(printed)
            .spawn()
            .expect("there is a shell");
        let began = Instant::now();
        let init = loop {
            if let Some(init) = only_child(unshare.id()).filter(|&init| is_systemd(init)) {
                break init;
            }
            let ended = unshare.try_wait().expect("it is ours");
            assert!(
                ended.is_none() && began.elapsed() < PATIENCE,
                "systemd did not come up: {}",
                fs::read_to_string(stage.join("printed")).unwrap_or_default()
            );
            crate::pause();
        };
        let machine = Self {
            unshare,
            init,
            cgroup,
            raises_limits,
            _directory: directory,
        };
        machine.eventually("the end of the boot", || {
            let state = machine.run(&["systemctl", "is-system-running"]);
            // "degraded" is as good: what else this machine has is not of interest.
            ["running", "degraded"]
                .contains(&text(&state.stdout).trim())
                .then_some(())
        });
        fs::copy(package, machine.path(PACKAGE)).expect("it is built");
        Some(machine)
    }

    /// Replaces or adds lines of the packaged configuration. A busy machine misses periods, which no test is about:
    /// unless one says otherwise, they are no fault.
    pub fn configure(&self, lines: &str) {
        let path = self.path("/etc/hapticd/hapticd.toml");
        let shipped = fs::read_to_string(&path).expect("it was installed");
        fs::write(path, configured(&shipped, lines)).expect("written");
    }

    /// Whether the unit's limits take effect; where they cannot be, capabilities stand in for them.
    pub fn raises_limits(&self) -> bool {
        self.raises_limits
    }

    /// A path on it, as seen from here.
    pub fn path(&self, path: &str) -> PathBuf {
        Path::new("/proc")
            .join(self.init.to_string())
            .join("root")
            .join(path.trim_start_matches('/'))
    }

    /// Runs a command on it, as root.
    pub fn run(&self, command: &[&str]) -> Output {
        self.command(command).output().expect("it starts")
    }

    /// Runs a command on it, which must succeed, and returns what it printed.
    pub fn run_ok(&self, command: &[&str]) -> String {
        let output = self.run(command);
        let (out, err) = (text(&output.stdout), text(&output.stderr));
        assert!(output.status.success(), "{command:?}: {out}{err}{}", self.journal());
        out
    }

    /// A command on it that is yet to be started.
    pub fn command(&self, command: &[&str]) -> Command {
        let mut nsenter = Command::new("nsenter");
        nsenter
            .args(["--target", &self.init.to_string(), "--wd=/"])
            .args(["--mount", "--pid", "--net", "--ipc", "--uts", "--cgroup", "--root"])
            .args(command)
            .stdin(Stdio::null());
        nsenter
    }

    /// A property of the unit.
    pub fn property(&self, name: &str) -> String {
        let shown = self.run_ok(&["systemctl", "show", "--property", name, "--value", "hapticd"]);
        shown.trim().to_owned()
    }

    /// What the unit and PID 1 logged about it.
    pub fn journal(&self) -> String {
        let synced = self.run(&["journalctl", "--sync"]);
        let output = self.run(&["journalctl", "--no-pager", "--output=cat", "--unit=hapticd"]);
        stderr(&synced) + &text(&output.stdout)
    }

    /// The daemon's process, as numbered here.
    pub fn daemon(&self) -> u32 {
        let listed = self.cgroup.join("system.slice/hapticd.service/cgroup.procs");
        let listed = fs::read_to_string(listed).expect("it runs");
        listed.trim().parse().expect("one process")
    }

    /// A client of the daemon.
    pub fn client(&self) -> Client {
        Client::connect(&self.path("/run/hapticd/control.sock")).expect("the daemon serves")
    }

    /// Waits until the unit has been restarted so many times and is up again.
    pub fn wait_for_restart(&self, times: u32) {
        self.eventually(&format!("restart number {times}"), || {
            (self.property("NRestarts") == times.to_string() && self.property("ActiveState") == "active").then_some(())
        });
    }

    /// Looks until there is something to be seen.
    pub fn eventually<T>(&self, what: &str, look: impl Fn() -> Option<T>) -> T {
        let began = Instant::now();
        loop {
            if let Some(seen) = look() {
                return seen;
            }
            assert!(
                began.elapsed() < PATIENCE,
                "waited in vain for {what}: {}",
                self.journal()
            );
            crate::pause();
        }
    }
}

impl Drop for Machine {
    fn drop(&mut self) {
        if std::thread::panicking() {
            crate::timed::count_missed(&self.path("/run/hapticd/control.sock"));
        }
        // With it goes PID 1, and with that all the others.
        drop(self.unshare.kill());
        drop(self.unshare.wait());
        let began = Instant::now();
        while remove_cgroups(&self.cgroup).is_err() && began.elapsed() < PATIENCE {
            crate::pause();
        }
    }
}

fn configured(shipped: &str, lines: &str) -> String {
    let option = |line: &str| line.split_once('=').map(|(name, _)| name.trim().to_owned());
    let mut lines = lines.to_owned();
    if !lines.contains("late-policy") {
        lines.push_str("\nlate-policy = \"warn\"");
    }
    let replaced: Vec<String> = lines.lines().filter_map(option).collect();
    let kept = shipped
        .lines()
        .filter(|line| option(line).is_none_or(|name| !replaced.contains(&name)));
    let kept: Vec<&str> = kept.collect();
    format!("{}\n{lines}\n", kept.join("\n"))
}

/// The cgroup (v2) under which this process may make others; or what this machine lacks.
fn missing() -> Result<PathBuf, (&'static str, String)> {
    if !geteuid().is_root() {
        return Err(("root", "systemd boots in namespaces of its own".to_owned()));
    }
    for program in ["/usr/bin/unshare", "/usr/bin/nsenter", "/usr/bin/setpriv"] {
        if !Path::new(program).exists() {
            return Err(("util-linux", format!("{program}; Debian: apt install util-linux")));
        }
    }
    let works = Command::new("unshare")
        .args(["--mount", "--pid", "--fork", "true"])
        .stderr(Stdio::null())
        .status();
    if !works.is_ok_and(|status| status.success()) {
        return Err(("namespaces", "root may not make any here".to_owned()));
    }
    let mounts = fs::read_to_string("/proc/self/mounts").unwrap_or_default();
    let own = fs::read_to_string("/proc/self/cgroup").unwrap_or_default();
    let mounted = mounts
        .lines()
        .find_map(|line| line.split_once(" cgroup2 ")?.0.rsplit(' ').next());
    let own = own.lines().find_map(|line| line.strip_prefix("0::/"));
    let (Some(mounted), Some(own)) = (mounted, own) else {
        return Err(("cgroup v2", "a mounted hierarchy".to_owned()));
    };
    Ok(Path::new(mounted).join(own))
}

/// The root of a minimal Debian, which is made if there is none yet; or what this machine lacks for that.
fn debian() -> Result<PathBuf, (&'static str, String)> {
    static MADE: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    let made = MADE.get_or_init(|| {
        let output = Command::new(Path::new(REPOSITORY).join("tests/debian/root.sh"))
            .stdin(Stdio::null())
            .output()
            .expect("bash runs");
        if output.status.success() {
            Ok(PathBuf::from(text(&output.stdout).trim()))
        } else {
            Err(text(&output.stderr).trim().to_owned())
        }
    });
    made.clone().map_err(|why| ("mmdebstrap", why))
}

/// The capabilities that a child of this process can have.
fn capabilities() -> u64 {
    let status = fs::read_to_string("/proc/self/status").expect("proc is mounted");
    let set = status.lines().find_map(|line| line.strip_prefix("CapBnd:"));
    set.and_then(|set| u64::from_str_radix(set.trim(), 16).ok())
        .expect("a set")
}

fn only_child(pid: u32) -> Option<u32> {
    fs::read_to_string(format!("/proc/{pid}/task/{pid}/children"))
        .ok()?
        .trim()
        .parse()
        .ok()
}

fn is_systemd(pid: u32) -> bool {
    fs::read_to_string(format!("/proc/{pid}/comm")).is_ok_and(|name| name.trim() == "systemd")
}

/// Removes a cgroup and all below it; they must be empty of processes.
fn remove_cgroups(cgroup: &Path) -> std::io::Result<()> {
    for entry in fs::read_dir(cgroup)? {
        let entry = entry?;
        if entry.file_type()?.is_dir() {
            remove_cgroups(&entry.path())?;
        }
    }
    fs::remove_dir(cgroup)
}
