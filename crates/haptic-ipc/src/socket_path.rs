//! Where the control socket is.
//!
//! In this order: the path given, `$HAPTICD_SOCKET`, `$XDG_RUNTIME_DIR/hapticd/control.sock`,
//! `/run/user/UID/hapticd/control.sock` (where a login session exists but the variable is not set,
//! as in a cron job), `~/.local/state/hapticd/control.sock` (an account without a session),
//! `/run/hapticd/control.sock` (the service, and root). Never a directory that others can write to.
//!
//! A rig with a name has a service of its own, `hapticd@NAME`, and its socket in directories of that name instead of
//! `hapticd`. The rig without one goes by the name of its service.

use crate::quoted;
use std::collections::HashSet;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// The variable that names the socket.
pub const VARIABLE: &str = "HAPTICD_SOCKET";

const SERVICE: &str = "hapticd";
const SOCKET: &str = "control.sock";

/// The directory in which those of systemd's units lie.
const SERVICES: &str = "/run";

/// The directory of the services' configurations: a rig with a name is there if it has one.
const CONFIGURATIONS: &str = "/etc/hapticd";

/// The directories of systemd's units.
const UNITS: [&str; 3] = ["/etc/systemd/system", "/usr/lib/systemd/system", "/lib/systemd/system"];

/// What the choice depends on.
#[derive(Clone, Debug, Default)]
pub struct Environment {
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

impl Environment {
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
        let directories = self.directories().into_iter();
        directories
            .map(|directory| directory.join(service).join(SOCKET))
            .collect()
    }

    /// The directories in which those of the services lie, in order.
    fn directories(&self) -> Vec<PathBuf> {
        let mut directories: Vec<PathBuf> = [&self.runtime_dir, &self.session_dir]
            .into_iter()
            .flatten()
            .cloned()
            .collect();
        directories.dedup();
        if !self.is_root {
            directories.extend(self.home.as_ref().map(|home| home.join(".local/state")));
        }
        directories.push(SERVICES.into());
        directories
    }

    /// The sockets of all rigs that there are: that of `named` first and that of the variable, then by name those of
    /// the services, also of other machines, whose sockets were forwarded to the place of a service.
    #[must_use]
    pub fn all(&self, named: Option<&Path>) -> Vec<NamedSocket> {
        let named = named
            .into_iter()
            .chain(self.variable.as_deref())
            .map(|path| NamedSocket {
                name: path.display().to_string(),
                path: path.to_path_buf(),
            });
        let mut all: Vec<NamedSocket> = named.collect();
        for directory in self.directories() {
            let mut here: Vec<NamedSocket> = std::fs::read_dir(&directory)
                .into_iter()
                .flatten()
                .filter_map(|entry| NamedSocket::of_service(&entry.ok()?.path()))
                .collect();
            here.sort_by(|one, other| one.name.cmp(&other.name));
            all.extend(here);
        }
        let mut known = HashSet::new();
        all.retain(|socket| known.insert(socket.path.clone()));
        all
    }

    /// The socket that a client connects to: the first that exists, else the first in a directory that this user may
    /// not enter, else that of a service that has run here, else the first of all.
    #[must_use]
    pub fn for_client(&self) -> PathBuf {
        most_likely(self.candidates())
    }

    /// The socket of the rig of this name, chosen in the same way; `hapticd` is the rig without one.
    #[must_use]
    pub fn for_rig(&self, name: &str) -> PathBuf {
        most_likely(match name {
            SERVICE => self.of_service(SERVICE),
            _ => self.of_service(&format!("{SERVICE}@{name}")),
        })
    }

    /// The options with which haptic-ctl finds a socket in a shell without the variable; `None` where it needs none.
    fn options_to(&self, socket: &Path) -> Option<String> {
        let plain = Self {
            variable: None,
            ..self.clone()
        };
        if plain.for_client() == socket {
            return None;
        }
        Some(match rig_at(socket).filter(|name| self.for_rig(name) == socket) {
            Some(name) => format!("--rig {name}"),
            None => format!("--socket {}", quoted(socket)),
        })
    }
}

/// The name of the rig whose service has a directory.
fn rig_of(directory: &Path) -> Option<&str> {
    let service = directory.file_name()?.to_str()?;
    let rig = service.strip_prefix(SERVICE)?;
    match rig.strip_prefix('@') {
        Some(name) if is_rig_name(name) => Some(name),
        None if rig.is_empty() => Some(SERVICE),
        _ => None,
    }
}

/// The name of the rig whose service has this socket; `hapticd` is the rig without one.
#[must_use]
pub fn rig_at(socket: &Path) -> Option<&str> {
    rig_of(socket.parent()?).filter(|_| socket.ends_with(SOCKET))
}

/// The name of the rig whose service has this socket, if it has one.
#[must_use]
pub fn name_of(socket: &Path) -> Option<&str> {
    rig_at(socket).filter(|name| *name != SERVICE)
}

/// What a person calls the rig of a socket: `Rig left`, or the path where the rig has no name.
#[must_use]
pub fn label(socket: &Path) -> String {
    name_of(socket).map_or_else(|| socket.display().to_string(), |name| format!("Rig {name}"))
}

/// The socket of a rig, and what the rig is called.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NamedSocket {
    /// The name of the rig; `hapticd` for the one without, and the path of a socket that was named.
    pub name: String,
    /// The socket.
    pub path: PathBuf,
}

impl NamedSocket {
    /// That of a service, by its directory.
    fn of_service(directory: &Path) -> Option<Self> {
        let name = rig_of(directory)?;
        let path = directory.join(SOCKET);
        may_exist(&path).then(|| Self {
            name: name.to_owned(),
            path,
        })
    }
}

/// The rigs with a name that services of this machine are configured for, besides those that are found.
#[must_use]
pub fn configured_besides(found: &[NamedSocket]) -> Vec<NamedSocket> {
    let mut rigs = configured_in(Path::new(CONFIGURATIONS));
    rigs.retain(|rig| found.iter().all(|socket| socket.path != rig.path));
    rigs
}

fn configured_in(configurations: &Path) -> Vec<NamedSocket> {
    let files = std::fs::read_dir(configurations).into_iter().flatten();
    let rig = |file: PathBuf| {
        let unit = file.file_name()?.to_str()?.strip_suffix(".toml")?;
        let name = unit.strip_prefix(SERVICE)?.strip_prefix('@')?;
        is_rig_name(name).then(|| NamedSocket {
            name: name.to_owned(),
            path: Path::new(SERVICES).join(unit).join(SOCKET),
        })
    };
    let mut rigs: Vec<NamedSocket> = files.filter_map(|entry| rig(entry.ok()?.path())).collect();
    rigs.sort_by(|one, other| one.name.cmp(&other.name));
    rigs
}

/// Whether a socket exists, or may exist in a directory that this user may not enter.
#[must_use]
pub fn may_exist(path: &Path) -> bool {
    std::fs::metadata(path).map_or_else(|error| hides_a_file(error.kind()), |_| true)
}

/// Whether a file may exist although looking for it failed with this.
fn hides_a_file(error: ErrorKind) -> bool {
    error == ErrorKind::PermissionDenied
}

/// The systemd unit, without its suffix, whose socket this would be: `hapticd` or `hapticd@NAME`.
#[must_use]
pub fn unit(socket: &Path) -> Option<&str> {
    let unit = socket.parent()?.strip_prefix(SERVICES).ok()?.to_str()?;
    let rig = unit.strip_prefix(SERVICE)?;
    (rig.is_empty() || rig.strip_prefix('@').is_some_and(is_rig_name)).then_some(unit)
}

/// Whether a unit lies in one of these directories, or the template of it, for a rig that is configured.
fn is_installed(unit: &str, directories: &[&Path], configurations: &Path) -> bool {
    let (file, is_configured) = match unit.split_once('@') {
        Some((template, _)) => (
            format!("{template}@.service"),
            configurations.join(format!("{unit}.toml")).exists(),
        ),
        None => (format!("{unit}.service"), true),
    };
    is_configured && directories.iter().any(|directory| directory.join(&file).exists())
}

/// Whether a service of this machine serves, or served, this socket.
fn is_of_service(socket: &Path) -> bool {
    unit(socket).is_some_and(|unit| is_installed(unit, &UNITS.map(Path::new), Path::new(CONFIGURATIONS)))
}

/// What a user does where the service of a socket does not serve it, or no rig has the name that the socket has;
/// nothing where the socket is neither of a service nor of a rig with a name.
#[must_use]
pub fn remedy(socket: &Path) -> Option<String> {
    unit(socket)
        .filter(|_| is_of_service(socket))
        .map(remedy_of)
        .or_else(|| unknown_rig(socket, &Environment::of_process().all(None)))
}

/// That there is no rig of a socket's name, and which there are.
fn unknown_rig(socket: &Path, rigs: &[NamedSocket]) -> Option<String> {
    let service = socket.parent()?.file_name()?.to_str()?;
    let name = service.strip_prefix(SERVICE)?.strip_prefix('@')?;
    if rigs.iter().any(|rig| rig.path == socket) {
        return Some(format!(
            "the rig `{name}` does not answer: if its daemon has ended, start it again"
        ));
    }
    if rigs.is_empty() {
        return Some(format!(
            "there is no rig `{name}`, nor any other: {CONFIGURATIONS}/{SERVICE}@{name}.toml configures it, and \
             `sudo systemctl start {SERVICE}@{name}` starts it"
        ));
    }
    let known: Vec<&str> = rigs.iter().map(|rig| &*rig.name).collect();
    let unnamed = if known.contains(&SERVICE) {
        format!("; `--rig {SERVICE}` is the one without a name")
    } else {
        String::new()
    };
    Some(format!("there is no rig `{name}`, but {}{unnamed}", known.join(", ")))
}

fn remedy_of(unit: &str) -> String {
    format!(
        "`journalctl -u {unit}` says why the service does not run, such as a wrong configuration; \
         `sudo systemctl restart {unit}` starts it"
    )
}

fn most_likely(mut paths: Vec<PathBuf>) -> PathBuf {
    let find = |test: fn(&Path) -> bool| paths.iter().position(|path| test(path));
    let has_run = |path: &Path| is_of_service(path) && path.parent().is_some_and(Path::exists);
    let chosen = find(Path::exists).or_else(|| find(may_exist)).or_else(|| find(has_run));
    paths.swap_remove(chosen.unwrap_or(0))
}

/// Whether a rig can have this name: letters, digits, `_`, `.` and `-`, since it becomes part of names of units and
/// files.
#[must_use]
pub fn is_rig_name(name: &str) -> bool {
    let plain = |c: char| c.is_ascii_alphanumeric() || "_.-".contains(c);
    !name.is_empty() && name.len() <= 64 && name.chars().all(plain)
}

/// Reads the name of a rig.
///
/// # Errors
/// No rig can have this name.
pub fn rig_name(given: &str) -> Result<String, String> {
    if is_rig_name(given) {
        return Ok(given.to_owned());
    }
    Err("the name of a rig has 1 to 64 letters, digits, `_`, `.` and `-`".to_owned())
}

/// The socket that a daemon makes: the one `given`, else the default.
#[must_use]
pub fn for_server(given: Option<&Path>) -> PathBuf {
    given.map_or_else(|| Environment::of_process().for_server(), Path::to_path_buf)
}

/// The socket that a client connects to: the one `given`, else the first default that exists.
#[must_use]
pub fn for_client(given: Option<&Path>) -> PathBuf {
    given.map_or_else(|| Environment::of_process().for_client(), Path::to_path_buf)
}

/// Whether it is where a client looks by itself.
pub(crate) fn is_usual(socket: &Path) -> bool {
    socket == for_client(None)
}

/// The options with which haptic-ctl finds a socket in any shell of this user; `None` where it needs none.
#[must_use]
pub fn options_to(socket: &Path) -> Option<String> {
    Environment::of_process().options_to(socket)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn surroundings() -> Environment {
        Environment {
            variable: None,
            runtime_dir: Some("/run/user/1000".into()),
            session_dir: Some("/run/user/1000".into()),
            home: Some("/home/ada".into()),
            is_root: false,
        }
    }

    #[test]
    fn candidates_lie_where_no_other_can_write_and_the_variable_is_alone() {
        let mut s = surroundings();
        let places = ["/run/user/1000/", "/home/ada/.local/state/", "/run/"];
        let expected = places.map(|place| PathBuf::from(format!("{place}hapticd/control.sock")));
        assert_eq!(s.candidates(), expected);
        (s.runtime_dir, s.session_dir) = (None, None);
        assert_eq!(
            s.for_server(),
            expected[1],
            "without a session there is a private place"
        );
        s.is_root = true;
        assert_eq!(s.for_server(), expected[2]);
        s.variable = Some("/srv/rig.sock".into());
        assert_eq!(s.candidates(), [PathBuf::from("/srv/rig.sock")]);
    }

    #[test]
    fn named_rig_has_its_own_socket_despite_the_variable() {
        let mut s = surroundings();
        s.variable = Some("/srv/rig.sock".into());
        assert_eq!(s.for_rig("left"), Path::new("/run/user/1000/hapticd@left/control.sock"));
        (s.runtime_dir, s.session_dir, s.home) = (None, None, None);
        assert_eq!(s.for_rig("left"), Path::new("/run/hapticd@left/control.sock"));
        assert_eq!(s.for_rig("hapticd"), Path::new("/run/hapticd/control.sock"));
        for name in ["left", "rig-2", "a.b_c"] {
            assert!(is_rig_name(name), "{name}");
        }
        for name in ["", "../x", "a/b", "a b", "é", &"x".repeat(65)] {
            assert!(!is_rig_name(name), "{name}");
        }
    }

    #[test]
    fn a_command_names_the_socket_unless_it_finds_it_by_itself() {
        let mut s = surroundings();
        s.variable = Some("/srv/the rig.sock".into());
        for (socket, options) in [
            ("/run/user/1000/hapticd/control.sock", None),
            ("/run/user/1000/hapticd@left/control.sock", Some("--rig left")),
            // A shell may not have the variable.
            ("/srv/the rig.sock", Some("--socket '/srv/the rig.sock'")),
            // The name would lead to the session's rig.
            (
                "/run/hapticd@left/control.sock",
                Some("--socket '/run/hapticd@left/control.sock'"),
            ),
        ] {
            assert_eq!(s.options_to(Path::new(socket)).as_deref(), options, "{socket}");
        }
    }

    #[test]
    fn all_rigs_are_found_by_their_directories_and_each_once() {
        let directory = tempfile::tempdir().expect("a directory");
        let make = |service: &str, file: &str| {
            let place = directory.path().join(service);
            std::fs::create_dir(&place).expect("made");
            std::fs::write(place.join(file), "").expect("written");
            place.join(file)
        };
        let (own, left) = (make("hapticd", SOCKET), make("hapticd@left", SOCKET));
        make("hapticd@right", "control.sock.lock");
        make("hapticd@a b", SOCKET);
        make("hapticd-watch", SOCKET);
        let s = Environment {
            variable: Some(left.clone()),
            runtime_dir: Some(directory.path().into()),
            is_root: true,
            ..Environment::default()
        };
        let all = s.all(Some("/srv/rig.sock".as_ref()));
        let ours: Vec<&NamedSocket> = all.iter().filter(|socket| !socket.path.starts_with("/run")).collect();
        let found: Vec<(&str, &Path)> = ours.iter().map(|socket| (&*socket.name, &*socket.path)).collect();
        let shown = left.display().to_string();
        assert_eq!(
            found,
            [
                ("/srv/rig.sock", "/srv/rig.sock".as_ref()),
                (&*shown, &*left),
                ("hapticd", &*own)
            ]
        );
    }

    #[test]
    fn label_is_the_rig_or_the_socket() {
        for (socket, expected) in [
            ("/run/hapticd@left/control.sock", "Rig left"),
            ("/run/user/1000/hapticd@left/control.sock", "Rig left"),
            // The session's rig and the machine's both go without a name.
            ("/run/hapticd/control.sock", "/run/hapticd/control.sock"),
            ("/run/hapticd-watch/left.sock", "/run/hapticd-watch/left.sock"),
            ("/run/hapticd@left/other.sock", "/run/hapticd@left/other.sock"),
        ] {
            assert_eq!(label(Path::new(socket)), expected);
        }
    }

    // hazard: H26
    #[test]
    fn a_rig_that_is_configured_is_known_though_it_does_not_run() {
        let directory = tempfile::tempdir().expect("a directory");
        for file in [
            "hapticd.toml",
            "hapticd@right.toml",
            "hapticd@left.toml",
            "hapticd@a b.toml",
            "hapticd@c.bak",
        ] {
            std::fs::write(directory.path().join(file), "").expect("written");
        }
        let rigs = configured_in(directory.path());
        let found: Vec<(&str, &Path)> = rigs.iter().map(|rig| (&*rig.name, &*rig.path)).collect();
        let [left, right] = ["/run/hapticd@left/control.sock", "/run/hapticd@right/control.sock"].map(Path::new);
        assert_eq!(found, [("left", left), ("right", right)]);
        assert!(configured_in(Path::new("/nonexistent")).is_empty());
    }

    // hazard: H29
    #[test]
    fn a_directory_that_may_not_be_entered_may_hold_a_socket() {
        assert!(hides_a_file(ErrorKind::PermissionDenied));
        assert!(!hides_a_file(ErrorKind::NotFound) && !hides_a_file(ErrorKind::NotADirectory));
        assert!(!may_exist(Path::new("/nonexistent/hapticd/control.sock")));
    }

    #[test]
    fn a_socket_of_systemd_names_its_unit() {
        for (socket, named) in [
            ("/run/hapticd/control.sock", Some("hapticd")),
            ("/run/hapticd@left/control.sock", Some("hapticd@left")),
            ("/run/hapticd-watch/watch.sock", None),
            ("/run/user/1000/hapticd/control.sock", None),
            ("/home/ada/.local/state/hapticd/control.sock", None),
            ("control.sock", None),
        ] {
            assert_eq!(unit(Path::new(socket)), named, "{socket}");
        }
    }

    #[test]
    fn a_service_that_is_installed_is_looked_up_in_its_log() {
        let units = tempfile::tempdir().expect("a directory");
        let directories = [Path::new("/nonexistent"), units.path()];
        let installed = |unit: &str| is_installed(unit, &directories, units.path());
        for (unit, file) in [("hapticd", "hapticd.service"), ("hapticd@left", "hapticd@.service")] {
            assert!(!installed(unit), "{unit}");
            std::fs::write(units.path().join(file), "").expect("a file");
            if unit.contains('@') {
                assert!(!installed(unit), "{unit} is not configured");
                std::fs::write(units.path().join(format!("{unit}.toml")), "").expect("a file");
            }
            assert!(installed(unit), "{unit}");
            let remedy = remedy_of(unit);
            assert!(remedy.contains(&format!("`journalctl -u {unit}`")), "{remedy}");
        }
        assert_eq!(remedy(Path::new("/run/user/1000/hapticd/control.sock")), None);
    }

    #[test]
    fn remedy_for_an_unknown_rig_names_the_rigs_there_are() {
        let socket = Path::new("/run/user/1000/hapticd@lefft/control.sock");
        let rigs = ["hapticd", "left"].map(|name| NamedSocket {
            name: name.to_owned(),
            path: PathBuf::new(),
        });
        for (rigs, expected) in [
            (
                &rigs[..],
                "no rig `lefft`, but hapticd, left; `--rig hapticd` is the one without a name",
            ),
            (&rigs[1..], "no rig `lefft`, but left"),
            (&[], "/etc/hapticd/hapticd@lefft.toml configures it"),
        ] {
            let remedy = unknown_rig(socket, rigs).expect("it is of a rig with a name");
            assert!(remedy.contains(expected) && !remedy.contains("--demo"), "{remedy}");
        }
        assert_eq!(unknown_rig(Path::new("/run/hapticd/control.sock"), &rigs), None);
        let died = [NamedSocket {
            name: "lefft".to_owned(),
            path: socket.to_owned(),
        }];
        assert!(
            unknown_rig(socket, &died)
                .expect("it is of a rig with a name")
                .contains("start it again")
        );
    }
}
