//! Whom a socket is for, and what a user does who is kept out.

use std::os::unix::fs::MetadataExt;
use std::path::Path;

/// What a user does who may not use a socket, or may not enter the directory that hides it.
#[must_use]
pub fn remedy(socket: &Path) -> String {
    let visible = socket.ancestors().find_map(|path| Some((path, path.metadata().ok()?)));
    let Some((closed, found)) = visible else {
        return "the daemon's user can open it".to_owned();
    };
    // A socket is used by who may write it, and a directory is entered by who may execute it.
    let serves_group = found.mode() & if found.is_dir() { 0o010 } else { 0o020 } != 0;
    let (is_above, is_directory) = (socket.parent() != Some(closed) && socket != closed, found.is_dir());
    let closed = closed.display();
    if serves_group {
        let group = group_name(found.gid());
        format!("{closed} is for the group {group}: `sudo usermod -aG {group} $USER`, then log in again")
    } else {
        let owner = user_name(found.uid());
        let open = if is_above {
            "let its owner open it, or give hapticd another path (--socket)".to_owned()
        } else if is_directory {
            format!(
                "`hapticd --socket-group GROUP` lets a group use it where it makes this directory itself; else also \
                 `chgrp GROUP {closed} && chmod g+x {closed}`"
            )
        } else {
            "`hapticd --socket-group GROUP` lets a group use it".to_owned()
        };
        format!("{closed} is for the user {owner} alone: {open}")
    }
}

/// The name of a group, or its number.
#[must_use]
pub fn group_name(gid: u32) -> String {
    let group = nix::unistd::Group::from_gid(gid.into()).ok().flatten();
    group.map_or_else(|| gid.to_string(), |group| group.name)
}

/// The name of a user, or its number, as a shell takes it.
#[must_use]
pub fn user_name(uid: u32) -> String {
    let user = nix::unistd::User::from_uid(uid.into()).ok().flatten();
    user.map_or_else(|| format!("#{uid}"), |user| user.name)
}

/// A user as the system's file of limits takes it: a name, or a range of numbers.
#[must_use]
pub fn user_in_limits(uid: u32) -> String {
    let user = nix::unistd::User::from_uid(uid.into()).ok().flatten();
    user.map_or_else(|| format!("{uid}:{uid}"), |user| user.name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs::{Permissions, set_permissions};
    use std::os::unix::fs::PermissionsExt;

    // hazard: H29
    #[test]
    fn who_is_kept_out_learns_the_directory_the_group_and_the_login() {
        let root = tempfile::tempdir().expect("a directory");
        let directory = root.path().join("hapticd");
        std::fs::create_dir(&directory).expect("a directory");
        let remedy_with = |mode| {
            set_permissions(&directory, Permissions::from_mode(mode)).expect("ours");
            remedy(&directory.join("control.sock"))
        };
        let group = group_name(directory.metadata().expect("there").gid());
        for part in [
            directory.display().to_string(),
            format!("usermod -aG {group} $USER"),
            "then log in again".to_owned(),
        ] {
            let message = remedy_with(0o750);
            assert!(message.contains(&part), "{message} lacks {part}");
        }
        let message = remedy_with(0o700);
        assert!(message.contains("alone") && !message.contains("usermod"), "{message}");
    }
}
