//! `doctor`: everything between a person and the rig, checked, each with the command that mends it. Works without a daemon.

use crate::colour::{self, BAD, DOUBTFUL, GOOD};
use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::output;
use haptic_ipc::{ClientError, DevicesReply, Request, RigState, Status, socket_path};
use rustix::process::{Resource, getrlimit};
use serde::Serialize;
use std::os::unix::fs::{MetadataExt, PermissionsExt};
use std::path::Path;

/// What the daemon asks for itself unless it is told otherwise.
const FIFO_PRIORITY: u64 = 80;

pub(crate) fn requests() -> Vec<Request> {
    vec![Request::Status {}, Request::Devices { probe: None }]
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Level {
    Ok,
    Warn,
    Fail,
}

/// Something that was looked at.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
struct Check {
    check: &'static str,
    level: Level,
    found: String,
    /// The command that mends it.
    #[serde(skip_serializing_if = "Option::is_none")]
    mend: Option<String>,
}

impl Check {
    fn ok(check: &'static str, found: impl Into<String>) -> Self {
        Self {
            check,
            level: Level::Ok,
            found: found.into(),
            mend: None,
        }
    }

    fn warn(check: &'static str, found: impl Into<String>, mend: impl Into<String>) -> Self {
        Self {
            level: Level::Warn,
            mend: Some(mend.into()),
            ..Self::ok(check, found)
        }
    }

    fn fail(check: &'static str, found: impl Into<String>, mend: impl Into<String>) -> Self {
        Self {
            level: Level::Fail,
            mend: Some(mend.into()),
            ..Self::ok(check, found)
        }
    }
}

pub(crate) async fn run(socket: Option<&Path>, json: bool) -> Result<(), Failure> {
    let path = socket_path::for_client(socket);
    let mut checks = Vec::new();
    let mut status = None;
    match Daemon::connect(Some(&path)).await {
        Ok(mut daemon) => {
            checks.push(Check::ok("socket", format!("{} is served", path.display())));
            checks.push(version(&daemon.hello().server));
            match daemon.ask::<Status>(Request::Status {}).await {
                Ok(found) => {
                    checks.extend(rig(&found));
                    checks.extend(thread(&found));
                    status = Some(found);
                }
                Err(failure) => checks.push(Check::fail(
                    "daemon",
                    failure.to_string(),
                    "restart it: `sudo systemctl restart hapticd`",
                )),
            }
            match daemon.ask::<DevicesReply>(Request::Devices { probe: None }).await {
                Ok(found) => checks.extend(devices(&found)),
                Err(failure) => checks.push(Check::warn("devices", failure.to_string(), "see `haptic-ctl devices`")),
            }
        }
        Err(failure) => checks.push(unreachable(&path, &failure)),
    }
    checks.extend(limits(status.as_ref()));
    checks.push(governor());
    checks.push(isolation(status.as_ref().and_then(|status| status.real_time.cpu)));
    show(&checks, json)
}

fn show(checks: &[Check], json: bool) -> Result<(), Failure> {
    let failed = checks.iter().filter(|check| check.level == Level::Fail).count();
    if json {
        output::json(&serde_json::json!({ "checks": checks, "failed": failed }))?;
    } else {
        for check in checks {
            let (word, style) = match check.level {
                Level::Ok => ("ok  ", GOOD),
                Level::Warn => ("warn", DOUBTFUL),
                Level::Fail => ("fail", BAD),
            };
            output::line(&format!(
                "{}  {}: {}",
                colour::paint(word, style),
                check.check,
                check.found
            ))?;
            if let Some(mend) = &check.mend {
                output::line(&format!("      {mend}"))?;
            }
        }
    }
    if failed > 0 { Err(Failure::Silent(1)) } else { Ok(()) }
}

fn version(server: &str) -> Check {
    let own = env!("CARGO_PKG_VERSION");
    let theirs = server.rsplit(' ').next().unwrap_or(server);
    let found = format!(
        "{server}, haptic-ctl {own}, both of protocol {}",
        haptic_ipc::PROTOCOL_VERSION
    );
    if theirs == own {
        Check::ok("version", found)
    } else {
        Check::warn(
            "version",
            found,
            "install both from one release, then `sudo systemctl restart hapticd`",
        )
    }
}

/// Why nobody answers at the socket.
fn unreachable(path: &Path, failure: &Failure) -> Check {
    let Failure::Client(error) = failure else {
        return Check::fail("socket", failure.to_string(), "`sudo systemctl restart hapticd`");
    };
    match error {
        ClientError::Permission { .. } => {
            let mend = permission(path).unwrap_or_else(|| format!("`sudo haptic-ctl --socket {}`", path.display()));
            Check::fail("socket", error.to_string(), mend)
        }
        ClientError::NoDaemon { source, .. } if path.exists() => Check::fail(
            "socket",
            format!("{} is there, but nobody listens: {source}", path.display()),
            "the daemon has died; start it: `sudo systemctl start hapticd`, or `hapticd --demo` to try it without a rig",
        ),
        ClientError::NoDaemon { .. } => {
            let looked: Vec<String> = socket_path::Surroundings::of_process()
                .candidates()
                .iter()
                .map(|path| path.display().to_string())
                .collect();
            Check::fail(
                "socket",
                format!(
                    "{} is not there (without --socket these are tried: {})",
                    path.display(),
                    looked.join(", ")
                ),
                "start a daemon: `hapticd --demo` to try it without a rig, `sudo systemctl start hapticd` for the service",
            )
        }
        ClientError::Version { .. } => Check::fail(
            "version",
            error.to_string(),
            "install both from one release, then `sudo systemctl restart hapticd`",
        ),
        _ => Check::fail("socket", error.to_string(), "`sudo systemctl restart hapticd`"),
    }
}

/// How to get permission for a socket: by its group, if that has it.
fn permission(path: &Path) -> Option<String> {
    let directory = path.parent()?;
    // The directory keeps others out, so that the socket itself may not be in sight.
    let found = std::fs::metadata(path).or_else(|_| std::fs::metadata(directory)).ok()?;
    let group_may = found.permissions().mode() & 0o010 != 0 || found.permissions().mode() & 0o020 != 0;
    if group_may && found.gid() != 0 {
        let groups = std::fs::read_to_string("/etc/group").unwrap_or_default();
        let id = found.gid().to_string();
        let group = groups
            .lines()
            .find(|line| line.split(':').nth(2) == Some(id.as_str()))
            .and_then(|line| line.split(':').next())
            .map_or_else(|| id.clone(), str::to_owned);
        return Some(format!(
            "join its group: `sudo usermod -aG {group} $USER`, and log in again"
        ));
    }
    Some(format!(
        "it is the user's who started the daemon: `sudo -u '#{}' haptic-ctl --socket {}`",
        found.uid(),
        path.display()
    ))
}

fn rig(status: &Status) -> Vec<Check> {
    let device = &status.device;
    let what = format!("{}, {}", status.state, device.description);
    let state = match status.state {
        RigState::Faulted => {
            let why = status.fault.as_deref().unwrap_or("for no known reason");
            Check::warn("rig", format!("{what}: {why}"), "`haptic-ctl reset`")
        }
        RigState::Stopped => Check::warn("rig", what, "`haptic-ctl reset`"),
        RigState::Disconnected => {
            let why = device.link.as_ref().and_then(|link| link.waiting.clone());
            Check::fail(
                "rig",
                format!("{what}: {}", why.unwrap_or_else(|| "it does not answer".to_owned())),
                "plug it in, and see `haptic-ctl devices`",
            )
        }
        _ => Check::ok("rig", what),
    };
    let mut checks = vec![state];
    if let Some(link) = &device.link {
        let counts = &link.counts;
        let bad = counts.lost + counts.bad_crc + counts.malformed;
        let found = format!(
            "{} samples, {} lost, {} with a bad CRC, {} malformed",
            counts.samples, counts.lost, counts.bad_crc, counts.malformed
        );
        // One in a thousand is felt.
        checks.push(if bad * 1000 > counts.samples {
            Check::warn(
                "link",
                found,
                "try another cable and another port; `haptic-ctl status` shows whether it helped",
            )
        } else {
            Check::ok("link", found)
        });
    }
    checks
}

/// What the real-time thread has, and could not have.
fn thread(status: &Status) -> Vec<Check> {
    let thread = &status.real_time;
    if thread.problems.is_empty() {
        let found = format!("{}, {}, {}", thread.scheduling(), thread.place(), thread.memory());
        return vec![Check::ok("real-time thread", found)];
    }
    thread
        .problems
        .iter()
        .map(|problem| Check::warn("real-time thread", problem.what.clone(), problem.remedy.clone()))
        .collect()
}

fn devices(found: &DevicesReply) -> Vec<Check> {
    if found.devices.is_empty() {
        return vec![Check::ok("devices", "no serial line and no HID device is plugged in")];
    }
    found
        .devices
        .iter()
        .map(|device| match &device.problem {
            Some(problem) => Check::warn(
                "device",
                format!("{}: {}", device.address, problem.what),
                problem.remedy.clone(),
            ),
            None if device.in_use => Check::ok("device", format!("{} is in use by the daemon", device.address)),
            None => Check::ok("device", format!("{} can be opened", device.address)),
        })
        .collect()
}

/// What a daemon that this user starts may have. Of no concern where a daemon has it already, as a service does.
fn limits(status: Option<&Status>) -> Vec<Check> {
    let real_time = status.map(|status| &status.real_time);
    let user = std::env::var("USER").unwrap_or_else(|_| "'*'".to_owned());
    let mend = |what: &str| {
        format!("`echo '{user} - {what}' | sudo tee -a /etc/security/limits.d/hapticd.conf`, and log in again")
    };
    let is_root = rustix::process::geteuid().is_root();
    let priority = getrlimit(Resource::Rtprio).current;
    let memory = getrlimit(Resource::Memlock).current;
    let enough_priority = is_root || priority.is_none_or(|limit| limit >= FIFO_PRIORITY);
    let shown = |limit: Option<u64>| limit.map_or_else(|| "unlimited".to_owned(), |limit| limit.to_string());
    let priority_text = format!("RLIMIT_RTPRIO is {} for this user", shown(priority));
    let memory_text = match memory {
        None => "RLIMIT_MEMLOCK is unlimited for this user".to_owned(),
        Some(bytes) => format!("RLIMIT_MEMLOCK is {} KiB for this user", bytes / 1024),
    };
    let has_priority = real_time.is_some_and(|thread| thread.fifo_priority.is_some() || thread.deadline_scheduled);
    let has_memory = real_time.is_some_and(|thread| thread.memory_locked);
    vec![
        if enough_priority || has_priority {
            Check::ok("priority limit", priority_text)
        } else {
            Check::warn(
                "priority limit",
                priority_text,
                mend(&format!("rtprio {FIFO_PRIORITY}")),
            )
        },
        if is_root || memory.is_none() || has_memory {
            Check::ok("memory limit", memory_text)
        } else {
            Check::warn("memory limit", memory_text, mend("memlock unlimited"))
        },
    ]
}

fn governor() -> Check {
    let Ok(processors) = std::fs::read_dir("/sys/devices/system/cpu") else {
        return Check::ok("governor", "this system does not say");
    };
    let mut governors: Vec<String> = processors
        .filter_map(|entry| std::fs::read_to_string(entry.ok()?.path().join("cpufreq/scaling_governor")).ok())
        .map(|text| text.trim().to_owned())
        .collect();
    governors.sort();
    governors.dedup();
    if governors.is_empty() {
        return Check::ok("governor", "this system does not scale its processors' frequency");
    }
    let found = governors.join(", ");
    if governors == ["performance"] {
        Check::ok("governor", found)
    } else {
        Check::warn(
            "governor",
            format!("{found}: a processor that has slowed down wakes up late"),
            "`echo performance | sudo tee /sys/devices/system/cpu/cpu*/cpufreq/scaling_governor`",
        )
    }
}

/// Whether the real-time thread's processor is kept free of other work.
fn isolation(cpu: Option<usize>) -> Check {
    let list = |name: &str| {
        let text = std::fs::read_to_string(format!("/sys/devices/system/cpu/{name}")).unwrap_or_default();
        processors(text.trim())
    };
    let (isolated, tickless) = (list("isolated"), list("nohz_full"));
    let Some(cpu) = cpu else {
        return Check::ok("isolation", "no real-time thread is pinned to a processor");
    };
    if isolated.contains(&cpu) && tickless.contains(&cpu) {
        return Check::ok("isolation", format!("processor {cpu} is kept for the real-time thread"));
    }
    Check::warn(
        "isolation",
        format!("other work may run on processor {cpu}, where the real-time thread is"),
        format!(
            "add `isolcpus={cpu} nohz_full={cpu}` to GRUB_CMDLINE_LINUX in /etc/default/grub, then `sudo update-grub && sudo reboot`"
        ),
    )
}

/// Reads the kernel's lists, such as `1,4-6`.
fn processors(list: &str) -> Vec<usize> {
    list.split(',')
        .filter_map(|part| {
            let (first, last) = part.split_once('-').unwrap_or((part, part));
            Some(first.trim().parse().ok()?..=last.trim().parse().ok()?)
        })
        .flatten()
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_kernels_lists_are_read() {
        assert_eq!(processors("1,4-6"), [1, 4, 5, 6]);
        assert_eq!(processors("3"), [3]);
        assert!(processors("").is_empty());
        assert!(processors("(null)").is_empty());
    }

    #[test]
    fn another_release_is_only_doubtful_while_the_protocol_is_the_same() {
        assert_eq!(version(concat!("hapticd ", env!("CARGO_PKG_VERSION"))).level, Level::Ok);
        assert_eq!(version("hapticd 99.0.0").level, Level::Warn);
    }
}
