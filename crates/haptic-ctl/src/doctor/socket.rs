//! Whether the daemon answers at its socket.

use super::check::Check;
use crate::failure::Failure;
use haptic_ipc::{ClientError, ErrorCode, Rights, socket_path};
use std::path::Path;

pub(super) fn version(server: &str) -> Check {
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

/// Whether the socket is served.
pub(super) fn served(path: &Path, rights: Rights) -> Check {
    let path = path.display();
    match rights {
        Rights::Watch => Check::ok(
            "socket",
            format!("{path} is served; it is the watchers' socket, which only serves watching and `stop`"),
        ),
        Rights::Stop => Check::warn(
            "socket",
            format!("{path} is served, but all places for clients are taken"),
            CLOSE_A_CLIENT,
        ),
        Rights::All | Rights::Unknown => Check::ok("socket", format!("{path} is served")),
    }
}

const CLOSE_A_CLIENT: &str = "close a client, such as a panel or a `haptic-ctl top`: `pgrep -a haptic` lists them";

/// The fix for a failure of the conversation itself.
pub(super) fn fix(path: &Path, failure: &Failure) -> String {
    let refused = match failure {
        Failure::Client(ClientError::Refused(error)) => Some(error.code),
        _ => None,
    };
    match refused {
        Some(ErrorCode::TooManyClients) => CLOSE_A_CLIENT.to_owned(),
        Some(ErrorCode::NotPermitted) => "see the check of the permission".to_owned(),
        _ => match socket_path::unit(path) {
            Some(unit) => format!("restart it, which takes the force away: `sudo systemctl restart {unit}`"),
            None => {
                "end its process, which takes the force away, and start it again: `pgrep -a hapticd` lists it, and one \
                     that is stopped ends by `kill -9 PID`"
                    .to_owned()
            }
        },
    }
}

/// Why the socket does not answer.
pub(super) fn unreachable(path: &Path, failure: &Failure) -> Check {
    let Failure::Client(error) = failure else {
        return Check::fail("socket", failure.to_string(), fix(path, failure));
    };
    match error {
        ClientError::Permission { .. } => Check::fail("socket", error.to_string(), "see the check of the permission"),
        ClientError::NoDaemon { .. } | ClientError::NoGreeting { .. }
            if let Some(remedy) = socket_path::remedy(path) =>
        {
            Check::fail("socket", format!("no daemon serves {}", path.display()), remedy)
        }
        ClientError::NoDaemon { source, .. } if path.exists() => Check::fail(
            "socket",
            format!("{} exists, but nobody listens: {source}", path.display()),
            match socket_path::unit(path) {
                Some(unit) => format!("the daemon has died; start it: `sudo systemctl start {unit}`"),
                None => "the daemon has died; start it again, or `hapticd --demo` to try it without a rig".to_owned(),
            },
        ),
        ClientError::NoDaemon { .. } => {
            let looked: Vec<String> = socket_path::Environment::of_process()
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
                "start a daemon: `hapticd --demo` to try it without a rig, `sudo systemctl start hapticd` for the \
                 service",
            )
        }
        ClientError::Version { .. } => Check::fail(
            "version",
            error.to_string(),
            "install both from one release, then `sudo systemctl restart hapticd`",
        ),
        _ => Check::fail("socket", error.to_string(), fix(path, failure)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::check::Level;
    use haptic_ipc::WireError;

    #[test]
    fn a_refusal_is_not_fixed_by_a_restart_that_drops_the_force() {
        for (code, fixed) in [
            (ErrorCode::TooManyClients, "close a client"),
            (ErrorCode::NotPermitted, "permission"),
        ] {
            let failure = Failure::from(ClientError::Refused(WireError::new(code, "no")));
            let check = unreachable(Path::new("/nonexistent"), &failure);
            let fix = check.fix.expect("a fix");
            assert!(fix.contains(fixed) && !fix.contains("restart"), "{fix}");
        }
        let silent = Failure::NoAnswer(std::time::Duration::from_secs(5));
        assert!(!fix(Path::new("/tmp/hapticd@left/control.sock"), &silent).contains("systemctl"));
        assert!(fix(Path::new("/run/hapticd@left/control.sock"), &silent).ends_with("restart hapticd@left`"));
    }

    #[test]
    fn the_watchers_socket_is_distinguished_from_the_control_one() {
        let found = |rights| served(Path::new("/run/x.sock"), rights).found;
        assert!(found(Rights::Watch).contains("the watchers' socket"));
        assert_eq!(found(Rights::All), "/run/x.sock is served");
        assert!(found(Rights::Stop).contains("all places"));
    }

    #[test]
    fn other_release_with_the_same_protocol_only_warns() {
        assert_eq!(version(concat!("hapticd ", env!("CARGO_PKG_VERSION"))).level, Level::Ok);
        assert_eq!(version("hapticd 99.0.0").level, Level::Warn);
    }
}
