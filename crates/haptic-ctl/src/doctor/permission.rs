//! Whether this user may use the socket, as its owner or by its group.

use super::check::Check;
use crate::failure::Failure;
use haptic_ipc::socket_permission::{group_name, remedy, user_name};
use haptic_ipc::{ClientError, ErrorCode};
use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// A user, as the system has it.
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

/// The result of connecting to the socket, as far as it concerns permission.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum ConnectResult<'a> {
    /// The daemon serves this user.
    Served,
    /// The system has refused the connection.
    KeptOut,
    /// The daemon has refused, and stated whom it serves.
    Refused(&'a str),
    /// The result says nothing of permission.
    Unknown,
}

/// Whether this user may use the socket, as its owner or by its group.
pub(super) fn permission(path: &Path, failure: Option<&Failure>) -> Check {
    let tried = match failure {
        None => ConnectResult::Served,
        Some(Failure::Client(ClientError::Permission { .. })) => ConnectResult::KeptOut,
        Some(Failure::Client(ClientError::Refused(error))) if error.code == ErrorCode::NotPermitted => {
            ConnectResult::Refused(&error.message)
        }
        Some(_) => ConnectResult::Unknown,
    };
    // A directory that keeps others out hides the socket; it has the same owner and group.
    let directory = || std::fs::metadata(path.parent()?).ok();
    let Some(found) = std::fs::metadata(path).ok().or_else(directory) else {
        if tried != ConnectResult::KeptOut {
            return Check::skip(PERMISSION, "there is no socket");
        }
        // A directory further up is closed: whose the socket is cannot be seen.
        let me = user_name(nix::unistd::geteuid().as_raw());
        return Check::fail(
            PERMISSION,
            format!("{me} may not pass to {}", path.display()),
            remedy(path),
        );
    };
    let socket = SocketFile {
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
struct SocketFile<'a> {
    path: &'a Path,
    owner: u32,
    group: u32,
    mode: u32,
}

fn may_use(socket: &SocketFile<'_>, person: &Person, tried: ConnectResult<'_>) -> Check {
    let path = socket.path.display();
    let (me, owner, group) = (user_name(person.uid), user_name(socket.owner), group_name(socket.group));
    // The daemon asks the kernel who the client is: a mode that was widened admits no other user.
    let serves_group = match tried {
        ConnectResult::Refused(reason) => reason.contains("members of the group"),
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
        (by, ConnectResult::Served) => {
            return Check::ok(PERMISSION, by.unwrap_or_else(|| format!("the daemon serves {me}")));
        }
        (Some(by), ConnectResult::Unknown) => return Check::ok(PERMISSION, by),
        (Some(by), ConnectResult::KeptOut) => {
            return Check::fail(
                PERMISSION,
                format!("{by}, but is refused"),
                format!("`namei -l '{path}'` shows the closed directory; its owner can open it"),
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
        format!("{me} is not {owner}, the daemon's user"),
        format!(
            "run haptic-ctl as that user: `sudo -u '{owner}' haptic-ctl --socket '{path}' status`; or let the daemon \
             serve a group: `hapticd --socket-group GROUP`"
        ),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::check::Level;

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
                &SocketFile {
                    path,
                    owner,
                    group,
                    mode,
                },
                person,
                tried,
            );
            (check.level, check.found, check.fix.unwrap_or_default())
        };
        let (stranger, member) = (person(&[7], &[7]), person(&[GROUP], &[]));
        use ConnectResult::{KeptOut, Refused, Served, Unknown};
        for (owner, mode, who, tried) in [
            (stranger.uid, 0o600, &stranger, Unknown),
            (0, 0o660, &member, Unknown),
            (0, 0o666, &stranger, Served),
            // By a list of access that the mode does not show.
            (0, 0o600, &stranger, Served),
        ] {
            assert_eq!(check(owner, mode, who, tried).0, Level::Ok, "{mode:o} {tried:?}");
        }
        let (level, found, fix) = check(0, 0o660, &stranger, KeptOut);
        assert_eq!(level, Level::Fail);
        assert!(
            found.contains("neither root nor a member of the group 4000000002"),
            "{found}"
        );
        assert!(fix.contains("sudo usermod -aG 4000000002 "), "{fix}");
        let (_, _, fix) = check(0, 0o750, &person(&[7], &[7, GROUP]), KeptOut);
        assert!(fix.contains("log in again") && fix.contains("newgrp"), "{fix}");
        let (_, _, fix) = check(0, 0o700, &stranger, KeptOut);
        assert!(
            fix.contains("`sudo -u 'root' haptic-ctl --socket '/run/x/control.sock' status`"),
            "{fix}"
        );
        let (level, _, fix) = check(stranger.uid, 0o600, &stranger, KeptOut);
        assert_eq!(level, Level::Fail);
        assert!(fix.contains("namei -l"), "{fix}");
        // Behind a widened mode the daemon has stated whom it serves.
        let own = Refused("the daemon serves its own user and root only");
        let (level, _, fix) = check(1, 0o666, &member, own);
        assert_eq!(level, Level::Fail);
        assert!(fix.contains("sudo -u '") && !fix.contains("usermod"), "{fix}");
        let group = Refused("the daemon serves its own user, root and the members of the group haptic only");
        assert!(check(0, 0o666, &stranger, group).2.contains("usermod"));
    }
}
