//! `doctor`: everything between a person and the rig, checked, each with the command that mends it. Works without a daemon.

use crate::colour::{self, BAD, DOUBTFUL, GOOD};
use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::output;
use haptic_ipc::{
    ClientError, DevicesReply, ErrorCode, LinkCounts, Problem, Request, RigState, Rights, Status, socket_path,
};
use rustix::process::{Resource, getrlimit};
use serde::Serialize;
use std::os::unix::fs::MetadataExt;
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
    /// Not looked at, since there was nothing to look at.
    Skip,
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

    fn skip(check: &'static str, found: impl Into<String>) -> Self {
        Self {
            level: Level::Skip,
            ..Self::ok(check, found)
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
            checks.push(served(&path, daemon.hello().rights));
            checks.push(permission(&path, None));
            checks.push(version(&daemon.hello().server));
            match daemon.ask::<Status>(Request::Status {}).await {
                Ok(found) => {
                    checks.extend(rig(&found));
                    checks.extend(thread(&found));
                    status = Some(found);
                }
                Err(failure) => checks.push(Check::fail("daemon", failure.to_string(), mend(&failure))),
            }
            match daemon.ask::<DevicesReply>(Request::Devices { probe: None }).await {
                Ok(found) => checks.extend(devices(&found)),
                Err(failure) => checks.push(Check::warn("devices", failure.to_string(), "see `haptic-ctl devices`")),
            }
        }
        Err(failure) => {
            checks.push(unreachable(&path, &failure));
            checks.push(permission(&path, Some(&failure)));
        }
    }
    checks.extend(limits(status.as_ref()));
    checks.push(governor());
    checks.push(isolation(status.as_ref()));
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
                Level::Skip => ("skip", DOUBTFUL),
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

/// How the socket is served.
fn served(path: &Path, rights: Rights) -> Check {
    let path = path.display();
    match rights {
        Rights::Watch => Check::ok(
            "socket",
            format!("{path} is served; it is the watchers' socket, on which one may look and stop, and no more"),
        ),
        Rights::Stop => Check::warn(
            "socket",
            format!("{path} is served, but has no place left"),
            CLOSE_A_CLIENT,
        ),
        Rights::All | Rights::Unknown => Check::ok("socket", format!("{path} is served")),
    }
}

const CLOSE_A_CLIENT: &str = "close a client, such as a panel or a `haptic-ctl top`: `pgrep -a haptic` lists them";

/// What helps against a failure of the conversation itself.
fn mend(failure: &Failure) -> String {
    let refused = match failure {
        Failure::Client(ClientError::Refused(error)) => Some(error.code),
        _ => None,
    };
    match refused {
        Some(ErrorCode::TooManyClients) => CLOSE_A_CLIENT.to_owned(),
        Some(ErrorCode::NotPermitted) => "the check of the permission says how to get it".to_owned(),
        _ => "restart it, which takes the force away: `sudo systemctl restart hapticd`".to_owned(),
    }
}

/// Why nobody answers at the socket.
fn unreachable(path: &Path, failure: &Failure) -> Check {
    let Failure::Client(error) = failure else {
        return Check::fail("socket", failure.to_string(), mend(failure));
    };
    match error {
        ClientError::Permission { .. } => Check::fail(
            "socket",
            error.to_string(),
            "the check of the permission says how to get it",
        ),
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
        _ => Check::fail("socket", error.to_string(), mend(failure)),
    }
}

/// Who somebody is, as the system has it.
#[derive(Clone, Debug)]
struct Person {
    uid: u32,
    /// The groups of this process.
    groups: Vec<u32>,
    /// The groups that a new session would have.
    groups_of_login: Vec<u32>,
}

impl Person {
    fn of_process() -> Self {
        let uid = nix::unistd::geteuid();
        let ids =
            |groups: Vec<nix::unistd::Gid>| groups.into_iter().map(nix::unistd::Gid::as_raw).collect::<Vec<u32>>();
        let mut groups = ids(nix::unistd::getgroups().unwrap_or_default());
        groups.push(nix::unistd::getegid().as_raw());
        let user = nix::unistd::User::from_uid(uid).ok().flatten();
        let groups_of_login = user.and_then(|user| {
            let name = std::ffi::CString::new(user.name).ok()?;
            nix::unistd::getgrouplist(&name, user.gid).ok()
        });
        Self {
            uid: uid.as_raw(),
            groups,
            groups_of_login: groups_of_login.map(ids).unwrap_or_default(),
        }
    }
}

/// The name of a user, or its number, as a shell takes it.
fn user_name(uid: u32) -> String {
    let user = nix::unistd::User::from_uid(uid.into()).ok().flatten();
    user.map_or_else(|| format!("#{uid}"), |user| user.name)
}

fn group_name(gid: u32) -> String {
    let group = nix::unistd::Group::from_gid(gid.into()).ok().flatten();
    group.map_or_else(|| gid.to_string(), |group| group.name)
}

/// What came of connecting to the socket, as far as it tells of permission.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Tried<'a> {
    /// The daemon serves this user.
    Served,
    /// The system has let nobody through.
    KeptOut,
    /// The daemon has said whom it serves.
    Refused(&'a str),
    /// Nothing.
    Unknown,
}

/// Whether this user may use the socket, as its owner or by its group.
fn permission(path: &Path, failure: Option<&Failure>) -> Check {
    // A directory that keeps others out hides the socket; it has the same owner and group.
    let directory = || std::fs::metadata(path.parent()?).ok();
    let Some(found) = std::fs::metadata(path).ok().or_else(directory) else {
        return Check::skip(PERMISSION, "there is no socket to have one for");
    };
    let tried = match failure {
        None => Tried::Served,
        Some(Failure::Client(ClientError::Permission { .. })) => Tried::KeptOut,
        Some(Failure::Client(ClientError::Refused(error))) if error.code == ErrorCode::NotPermitted => {
            Tried::Refused(&error.message)
        }
        Some(_) => Tried::Unknown,
    };
    let socket = Owned {
        path,
        owner: found.uid(),
        group: found.gid(),
        mode: found.mode(),
    };
    may_use(&socket, &Person::of_process(), tried)
}

const PERMISSION: &str = "permission";

/// A socket, or the directory that hides it.
#[derive(Clone, Copy)]
struct Owned<'a> {
    path: &'a Path,
    owner: u32,
    group: u32,
    mode: u32,
}

fn may_use(socket: &Owned<'_>, person: &Person, tried: Tried<'_>) -> Check {
    let path = socket.path.display();
    let (me, owner, group) = (user_name(person.uid), user_name(socket.owner), group_name(socket.group));
    // The daemon asks the kernel who is there; modes that somebody has widened let nobody in.
    let serves_group = match tried {
        Tried::Refused(said) => said.contains("members of the group"),
        _ => socket.mode & 0o030 != 0,
    };
    let by = if person.uid == 0 {
        Some("root may use every socket".to_owned())
    } else if person.uid == socket.owner {
        Some(format!("{me} owns the socket"))
    } else if serves_group && person.groups.contains(&socket.group) {
        Some(format!("{me} is a member of the group {group}"))
    } else if socket.mode & 0o002 != 0 {
        Some("everybody may use this socket".to_owned())
    } else {
        None
    };
    match (by, tried) {
        (by, Tried::Served) => return Check::ok(PERMISSION, by.unwrap_or_else(|| format!("the daemon serves {me}"))),
        (Some(by), Tried::Unknown) => return Check::ok(PERMISSION, by),
        (Some(by), Tried::KeptOut) => {
            return Check::fail(
                PERMISSION,
                format!("{by}, and is kept out all the same"),
                format!("`namei -l '{path}'` shows the directory that is closed; its owner can open it"),
            );
        }
        _ => {}
    }
    if serves_group && person.groups_of_login.contains(&socket.group) {
        return Check::fail(
            PERMISSION,
            format!("{me} is a member of the group {group}, and has not logged in since"),
            format!("log in again, or have a shell with it at once: `newgrp {group}`"),
        );
    }
    if serves_group {
        return Check::fail(
            PERMISSION,
            format!("{me} is neither {owner} nor a member of the group {group}"),
            format!("join the group: `sudo usermod -aG {group} {me}`, and log in again"),
        );
    }
    Check::fail(
        PERMISSION,
        format!("{me} is not {owner}, whose the daemon is"),
        format!(
            "ask as its user: `sudo -u '{owner}' haptic-ctl --socket '{path}' status`; or have it serve a group: `hapticd --socket-group GROUP`"
        ),
    )
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
    checks.extend(device.link.as_ref().map(|link| self::link(&link.counts, status.state)));
    checks.extend(device.engage_refused.iter().map(refused));
    checks
}

/// Why the rig would not be engaged as it is.
fn refused(problem: &Problem) -> Check {
    Check::fail("engage", problem.what.clone(), problem.remedy.clone())
}

/// How well what is sent arrives.
fn link(counts: &LinkCounts, state: RigState) -> Check {
    let found = format!(
        "{} samples, {} lost, {} late, {} with a bad CRC, {} malformed",
        counts.samples, counts.lost, counts.late, counts.bad_crc, counts.malformed
    );
    // One in a thousand is felt.
    let many = |count: u64| count * 1000 > counts.samples;
    if many(counts.lost + counts.bad_crc + counts.malformed) {
        return Check::warn(
            "link",
            found,
            "try another cable and another port; `haptic-ctl status` shows whether it helped",
        );
    }
    if many(counts.late) {
        return Check::warn(
            "link",
            found,
            "give the rig a port without a hub, and see above whether the real-time thread has what it needs; `haptic-ctl status` shows whether it helped",
        );
    }
    match state {
        RigState::Disconnected => Check::skip(
            "link",
            format!("nothing comes while the rig is disconnected; so far {found}"),
        ),
        _ if counts.samples == 0 => {
            Check::warn("link", "no sample has come yet", "see `haptic-ctl status` in a second")
        }
        _ => Check::ok("link", found),
    }
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
    let person = rustix::process::geteuid().as_raw();
    let mend = |what: &str| {
        format!(
            "`echo '{} - {what}' | sudo tee -a /etc/security/limits.d/hapticd.conf`, and log in again",
            limited(person)
        )
    };
    let is_root = person == 0;
    let priority = getrlimit(Resource::Rtprio).current;
    let memory = getrlimit(Resource::Memlock).current;
    let shown = |limit: Option<u64>| limit.map_or_else(|| "unlimited".to_owned(), |limit| limit.to_string());
    let priority_text = format!("RLIMIT_RTPRIO is {} for this user", shown(priority));
    let memory_text = match memory {
        None => "RLIMIT_MEMLOCK is unlimited for this user".to_owned(),
        Some(bytes) => format!("RLIMIT_MEMLOCK is {} KiB for this user", bytes / 1024),
    };
    let has_priority = real_time.is_some_and(|thread| thread.fifo_priority.is_some() || thread.deadline_scheduled);
    let has_memory = real_time.is_some_and(|thread| thread.memory_locked);
    vec![
        limit(
            "priority limit",
            priority_text,
            priority.is_none_or(|limit| limit >= FIFO_PRIORITY),
            is_root,
            has_priority.then_some("its priority"),
            mend(&format!("rtprio {FIFO_PRIORITY}")),
        ),
        limit(
            "memory limit",
            memory_text,
            memory.is_none(),
            is_root,
            has_memory.then_some("its memory locked"),
            mend("memlock unlimited"),
        ),
    ]
}

/// A user as the system's file of limits takes it: a name, or a range of numbers.
fn limited(uid: u32) -> String {
    let user = nix::unistd::User::from_uid(uid.into()).ok().flatten();
    user.map_or_else(|| format!("{uid}:{uid}"), |user| user.name)
}

/// A limit that may be low, for reasons.
fn limit(
    check: &'static str,
    found: String,
    is_enough: bool,
    is_root: bool,
    daemon_has: Option<&str>,
    mend: String,
) -> Check {
    match daemon_has {
        _ if is_enough => Check::ok(check, found),
        Some(what) => Check::ok(check, format!("{found}, and the daemon has {what} all the same")),
        None if is_root => Check::ok(check, format!("{found}, which does not bind root")),
        None => Check::warn(check, found, mend),
    }
}

fn governor() -> Check {
    let Ok(processors) = std::fs::read_dir("/sys/devices/system/cpu") else {
        return Check::skip("governor", "this system does not say");
    };
    let mut governors: Vec<String> = processors
        .filter_map(|entry| std::fs::read_to_string(entry.ok()?.path().join("cpufreq/scaling_governor")).ok())
        .map(|text| text.trim().to_owned())
        .collect();
    governors.sort();
    governors.dedup();
    if governors.is_empty() {
        return Check::skip(
            "governor",
            "this system does not tell how it scales its processors' frequency",
        );
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
fn isolation(status: Option<&Status>) -> Check {
    let list = |name: &str| {
        let text = std::fs::read_to_string(format!("/sys/devices/system/cpu/{name}")).unwrap_or_default();
        processors(text.trim())
    };
    let (isolated, tickless) = (list("isolated"), list("nohz_full"));
    let Some(status) = status else {
        return Check::skip(
            "isolation",
            "without a daemon there is no real-time thread to keep a processor for",
        );
    };
    let Some(cpu) = status.real_time.cpu else {
        return Check::skip(
            "isolation",
            "the real-time thread is pinned to no processor that could be kept for it",
        );
    };
    if isolated.contains(&cpu) && tickless.contains(&cpu) {
        return Check::ok("isolation", format!("processor {cpu} is kept for the real-time thread"));
    }
    Check::warn(
        "isolation",
        format!("other work may run on processor {cpu}, where the real-time thread is"),
        format!(
            "boot with the kernel parameters `isolcpus={cpu} nohz_full={cpu}`; where GRUB is the boot loader, add them to GRUB_CMDLINE_LINUX in \
             /etc/default/grub, then `sudo update-grub` (Fedora: `sudo grub2-mkconfig -o /boot/grub2/grub.cfg`) and `sudo reboot`"
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
    use haptic_ipc::WireError;

    #[test]
    fn the_kernels_lists_are_read() {
        assert_eq!(processors("1,4-6"), [1, 4, 5, 6]);
        assert_eq!(processors("3"), [3]);
        assert!(processors("").is_empty());
        assert!(processors("(null)").is_empty());
    }

    fn person(groups: &[u32], groups_of_login: &[u32]) -> Person {
        Person {
            uid: 4_000_000_001,
            groups: groups.to_vec(),
            groups_of_login: groups_of_login.to_vec(),
        }
    }

    #[test]
    fn permission_is_that_of_the_owner_or_of_the_group() {
        const GROUP: u32 = 4_000_000_002;
        let path = Path::new("/run/x/control.sock");
        let check = |owner, mode, person: &Person, tried| {
            let group = GROUP;
            let check = may_use(
                &Owned {
                    path,
                    owner,
                    group,
                    mode,
                },
                person,
                tried,
            );
            (check.level, check.found, check.mend.unwrap_or_default())
        };
        let (stranger, member) = (person(&[7], &[7]), person(&[GROUP], &[]));
        use Tried::{KeptOut, Refused, Served, Unknown};
        for (owner, mode, who, tried) in [
            (stranger.uid, 0o600, &stranger, Unknown),
            (0, 0o660, &member, Unknown),
            (0, 0o666, &stranger, Served),
            // By a list of access that the mode does not show.
            (0, 0o600, &stranger, Served),
        ] {
            assert_eq!(check(owner, mode, who, tried).0, Level::Ok, "{mode:o} {tried:?}");
        }
        let (level, found, mend) = check(0, 0o660, &stranger, KeptOut);
        assert_eq!(level, Level::Fail);
        assert!(
            found.contains("neither root nor a member of the group 4000000002"),
            "{found}"
        );
        assert!(mend.contains("sudo usermod -aG 4000000002 "), "{mend}");
        let (_, _, mend) = check(0, 0o750, &person(&[7], &[7, GROUP]), KeptOut);
        assert!(mend.contains("log in again") && mend.contains("newgrp"), "{mend}");
        let (_, _, mend) = check(0, 0o700, &stranger, KeptOut);
        assert!(
            mend.contains("`sudo -u 'root' haptic-ctl --socket '/run/x/control.sock' status`"),
            "{mend}"
        );
        let (level, _, mend) = check(stranger.uid, 0o600, &stranger, KeptOut);
        assert_eq!(level, Level::Fail);
        assert!(mend.contains("namei -l"), "{mend}");
        // Behind a mode that somebody has widened the daemon has said whom it serves.
        let own = Refused("the daemon serves its own user and root only");
        let (level, _, mend) = check(1, 0o666, &member, own);
        assert_eq!(level, Level::Fail);
        assert!(mend.contains("sudo -u '") && !mend.contains("usermod"), "{mend}");
        let group = Refused("the daemon serves its own user, root and the members of the group haptic only");
        assert!(check(0, 0o666, &stranger, group).2.contains("usermod"));
    }

    #[test]
    fn what_is_refused_is_not_mended_by_a_restart_that_drops_the_force() {
        for (code, mended) in [
            (ErrorCode::TooManyClients, "close a client"),
            (ErrorCode::NotPermitted, "permission"),
        ] {
            let failure = Failure::from(ClientError::Refused(WireError::new(code, "no")));
            let check = unreachable(Path::new("/nonexistent"), &failure);
            let mend = check.mend.expect("a mend");
            assert!(mend.contains(mended) && !mend.contains("restart"), "{mend}");
        }
        assert!(mend(&Failure::NoAnswer(std::time::Duration::from_secs(5))).contains("takes the force away"));
    }

    #[test]
    fn a_low_limit_is_in_order_for_a_reason_that_is_told() {
        let check = |root, has| {
            limit(
                "priority limit",
                "it is 0".to_owned(),
                false,
                root,
                has,
                "mend".to_owned(),
            )
        };
        assert!(check(true, None).found.contains("root"));
        assert!(
            check(false, Some("its priority"))
                .found
                .contains("the daemon has its priority all the same")
        );
        assert_eq!(check(false, None).level, Level::Warn);
        assert_eq!(limited(0), "root");
        assert_eq!(limited(4_000_000_001), "4000000001:4000000001");
    }

    #[test]
    fn what_was_not_looked_at_is_not_in_order() {
        assert_eq!(isolation(None).level, Level::Skip);
        let counts = |samples, late| LinkCounts {
            samples,
            late,
            ..LinkCounts::default()
        };
        assert_eq!(link(&counts(0, 0), RigState::Disconnected).level, Level::Skip);
        assert_eq!(link(&counts(0, 0), RigState::Idle).level, Level::Warn);
        assert_eq!(link(&counts(100_000, 99), RigState::Idle).level, Level::Ok);
        assert_eq!(link(&counts(100_000, 101), RigState::Idle).level, Level::Warn);
    }

    #[test]
    fn the_watchers_socket_is_told_from_the_control_socket() {
        let found = |rights| served(Path::new("/run/x.sock"), rights).found;
        assert!(found(Rights::Watch).contains("the watchers' socket"));
        assert_eq!(found(Rights::All), "/run/x.sock is served");
        assert!(found(Rights::Stop).contains("no place left"));
    }

    #[test]
    fn another_release_is_only_doubtful_while_the_protocol_is_the_same() {
        assert_eq!(version(concat!("hapticd ", env!("CARGO_PKG_VERSION"))).level, Level::Ok);
        assert_eq!(version("hapticd 99.0.0").level, Level::Warn);
    }
}
