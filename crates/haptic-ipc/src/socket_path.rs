//! Where the control socket is.
//!
//! In this order: the path given, `$HAPTICD_SOCKET`, `$XDG_RUNTIME_DIR/hapticd/control.sock`,
//! `/run/user/UID/hapticd/control.sock` (where a login session exists but the variable is not set,
//! as in a cron job), `~/.local/state/hapticd/control.sock` (an account without a session),
//! `/run/hapticd/control.sock` (the service, and root). Never a directory that others can write to.

use std::path::{Path, PathBuf};

/// The variable that names the socket.
pub const VARIABLE: &str = "HAPTICD_SOCKET";

const NAME: &str = "hapticd/control.sock";
const SYSTEM: &str = "/run/hapticd/control.sock";

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
        if let Some(path) = &self.variable {
            return vec![path.clone()];
        }
        let mut paths: Vec<PathBuf> = [&self.runtime_dir, &self.session_dir]
            .into_iter()
            .flatten()
            .map(|dir| dir.join(NAME))
            .collect();
        paths.dedup();
        if !self.is_root {
            paths.extend(self.home.as_ref().map(|home| home.join(".local/state").join(NAME)));
        }
        paths.push(PathBuf::from(SYSTEM));
        paths
    }

    /// The socket that a client connects to: the first that exists, else the first of all.
    #[must_use]
    pub fn for_client(&self) -> PathBuf {
        let mut paths = self.candidates();
        let found = paths.iter().position(|path| path.exists()).unwrap_or(0);
        paths.swap_remove(found)
    }
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
        assert_eq!(s.for_server(), Path::new(SYSTEM));
    }

    #[test]
    fn no_candidate_lies_where_others_can_write() {
        for path in surroundings().candidates() {
            assert!(!path.starts_with("/tmp") && !path.starts_with("/var/tmp"));
        }
    }
}
