//! Where the control socket is.
//!
//! In this order: the path given, `$HAPTICD_SOCKET`, `$XDG_RUNTIME_DIR/hapticd/control.sock`,
//! `/run/user/UID/hapticd/control.sock` (where a login session exists but the variable is not set,
//! as in a cron job), `~/.local/state/hapticd/control.sock` (an account without a session),
//! `/run/hapticd/control.sock` (the service, and root). Never a directory that others can write to.
//!
//! A rig with a name has a service of its own, `hapticd@NAME`, and its socket in directories of that name instead of `hapticd`.

use std::path::{Path, PathBuf};

/// The variable that names the socket.
pub const VARIABLE: &str = "HAPTICD_SOCKET";

const SERVICE: &str = "hapticd";
const SOCKET: &str = "control.sock";

/// What the choice depends on.
#[derive(Clone, Debug, Default)]
pub struct Surroundings {
    /// `$HAPTICD_SOCKET`.
    pub variable: Option<PathBuf>,
    /// `$XDG_RUNTIME_DIR`.
    pub runtime_dir: Option<PathBuf>,
    /// `/run/user/UID`, where it exists.
    pub session_dir: Option<PathBuf>,
    /// `$HOME`.
    pub home: Option<PathBuf>,
    /// Whether the user is root.
    pub is_root: bool,
}

impl Surroundings {
    /// Those of this process.
    #[must_use]
    pub fn of_process() -> Self {
        let path = |name| {
            std::env::var_os(name)
                .filter(|value| !value.is_empty())
                .map(PathBuf::from)
        };
        let user = rustix::process::geteuid();
        let session_dir = PathBuf::from(format!("/run/user/{}", user.as_raw()));
        Self {
            variable: path(VARIABLE),
            runtime_dir: path("XDG_RUNTIME_DIR"),
            session_dir: session_dir.is_dir().then_some(session_dir),
            home: path("HOME"),
            is_root: user.is_root(),
        }
    }

    /// The socket that a daemon makes.
    #[must_use]
    pub fn for_server(&self) -> PathBuf {
        self.candidates().swap_remove(0)
    }

    /// The sockets at which a client looks, in order. One that was named is the only one.
    #[must_use]
    pub fn candidates(&self) -> Vec<PathBuf> {
        match &self.variable {
            Some(path) => vec![path.clone()],
            None => self.of_service(SERVICE),
        }
    }

    /// The sockets of a service, in order.
    fn of_service(&self, service: &str) -> Vec<PathBuf> {
        let in_directory = |directory: &Path| directory.join(service).join(SOCKET);
        let mut paths: Vec<PathBuf> = [&self.runtime_dir, &self.session_dir]
            .into_iter()
            .flatten()
            .map(|directory| in_directory(directory))
            .collect();
        paths.dedup();
        if !self.is_root {
            paths.extend(self.home.as_ref().map(|home| in_directory(&home.join(".local/state"))));
        }
        paths.push(in_directory(Path::new("/run")));
        paths
    }

    /// The socket that a client connects to: the first that exists, else the first of all.
    #[must_use]
    pub fn for_client(&self) -> PathBuf {
        first_that_exists(self.candidates())
    }

    /// The socket of the rig of this name: the first that exists, else the first of all.
    #[must_use]
    pub fn for_rig(&self, name: &str) -> PathBuf {
        first_that_exists(self.of_service(&format!("{SERVICE}@{name}")))
    }
}

fn first_that_exists(mut paths: Vec<PathBuf>) -> PathBuf {
    let found = paths.iter().position(|path| path.exists()).unwrap_or(0);
    paths.swap_remove(found)
}

/// Whether a rig can have this name: letters, digits, `_`, `.` and `-`, since it becomes part of names of units and files.
#[must_use]
pub fn is_rig_name(name: &str) -> bool {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_.-".contains(c);
    !name.is_empty() && name.len() <= 64 && name.chars().all(plain)
}

/// The socket that a daemon makes: the one `given`, else the default.
#[must_use]
pub fn for_server(given: Option<&Path>) -> PathBuf {
    given.map_or_else(|| Surroundings::of_process().for_server(), Path::to_path_buf)
}

/// The socket that a client connects to: the one `given`, else the first default that exists.
#[must_use]
pub fn for_client(given: Option<&Path>) -> PathBuf {
    given.map_or_else(|| Surroundings::of_process().for_client(), Path::to_path_buf)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn surroundings() -> Surroundings {
        Surroundings {
            variable: None,
            runtime_dir: Some("/run/user/1000".into()),
            session_dir: Some("/run/user/1000".into()),
            home: Some("/home/ada".into()),
            is_root: false,
        }
    }

    #[test]
    fn the_variable_comes_first_and_alone() {
        let mut s = surroundings();
        s.variable = Some("/srv/rig.sock".into());
        assert_eq!(s.candidates(), [PathBuf::from("/srv/rig.sock")]);
    }

    #[test]
    fn a_user_without_a_session_still_has_a_private_place() {
        let mut s = surroundings();
        assert_eq!(s.for_server(), Path::new("/run/user/1000/hapticd/control.sock"));
        (s.runtime_dir, s.session_dir) = (None, None);
        assert_eq!(s.for_server(), Path::new("/home/ada/.local/state/hapticd/control.sock"));
        s.is_root = true;
        assert_eq!(s.for_server(), Path::new("/run/hapticd/control.sock"));
    }

    #[test]
    fn a_rig_with_a_name_has_a_socket_of_its_own_whatever_the_variable_says() {
        let mut s = surroundings();
        s.variable = Some("/srv/rig.sock".into());
        assert_eq!(s.for_rig("left"), Path::new("/run/user/1000/hapticd@left/control.sock"));
        (s.runtime_dir, s.session_dir, s.home) = (None, None, None);
        assert_eq!(s.for_rig("left"), Path::new("/run/hapticd@left/control.sock"));
        for name in ["left", "rig-2", "a.b_c"] {
            assert!(is_rig_name(name), "{name}");
        }
        for name in ["", "../x", "a/b", "a b", "é", &"x".repeat(65)] {
            assert!(!is_rig_name(name), "{name}");
        }
    }

    #[test]
    fn no_candidate_lies_where_others_can_write() {
        for path in surroundings().candidates() {
            assert!(!path.starts_with("/tmp") && !path.starts_with("/var/tmp"));
        }
    }
}
