//! Refusals of options, with name, value, limits and unit.

use device_boards::Address;
use haptic_core::SceneError;
use haptic_ipc::regular_file::{self, with_short_lines};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Why the daemon cannot start with its options.
#[derive(Debug, Error)]
pub(crate) enum ConfigError {
    #[error("{}: {source}", .path.display())]
    Read { path: PathBuf, source: std::io::Error },
    #[error("{}: {message}", .path.display())]
    Parse { path: PathBuf, message: String },
    #[error("{}: line {line}: {source}", .path.display())]
    InFile {
        path: PathBuf,
        line: usize,
        source: Box<ConfigError>,
    },
    #[error("scene = {}: {source}", .path.display())]
    NoScene { path: PathBuf, source: std::io::Error },
    #[error("{}: {source}", .path.display())]
    Scene { path: PathBuf, source: SceneError },
    #[error(transparent)]
    StartScene(SceneError),
    #[error(
        "{}",
        format!("{name} = {value} {unit} is out of range: it must be from {min} to {max} {unit}")
            .replace("  ", " ")
            .trim_end()
    )]
    OutOfRange {
        name: &'static str,
        value: f64,
        min: f64,
        max: f64,
        unit: &'static str,
    },
    #[error("rate = {0} Hz is not a whole number: it must be one from 100 to 20000 Hz")]
    BrokenRate(f64),
    #[error("cpu = {cpu} is not available: this process may use the processors {available:?}")]
    NoSuchCpu { cpu: usize, available: Vec<usize> },
    #[error(
        "name the rig: --device serial:/dev/ttyACM0, or --device fake for a simulated one; or try `hapticd --demo`"
    )]
    NoDevice,
    #[error(
        "socket-group = {0}: there is no such group; create it with `sudo groupadd --system {0}`, and add its members \
         with `sudo usermod -aG {0} USER`"
    )]
    NoSuchGroup(String),
    #[error("watch-socket = {} is the control socket: name another path for the watchers", .0.display())]
    WatchOnControl(PathBuf),
    #[error(
        "metrics = {0} can be reached from other machines: name an address of this machine alone, as in 127.0.0.1:{port}, \
         or allow it with metrics-beyond-this-machine",
        port = .0.port()
    )]
    MetricsBeyondThisMachine(SocketAddr),
    #[error("device = {address}: {why}")]
    LineTooSlow { address: Address, why: String },
    #[error(
        "hand = mouse moves the built-in fake rig alone, and {0} is another device: leave it out, or name --device fake"
    )]
    HandOfAnotherRig(Address),
    #[error("hand: {0}")]
    Hand(String),
    #[error("{0} is for a rig of one axis: leave it out, or --kinematics")]
    OneAxisOnly(&'static str),
    #[error("--demo and --self-test run on the built-in fake rig: leave --device out")]
    OnlyFake,
}

impl ConfigError {
    /// The error without its place in a file.
    pub(crate) fn innermost(&self) -> &Self {
        match self {
            Self::InFile { source, .. } => source.innermost(),
            _ => self,
        }
    }
}

pub(super) fn read_toml<T: serde::de::DeserializeOwned>(path: &Path) -> Result<T, ConfigError> {
    toml::from_str(&read_text(path)?).map_err(|source| ConfigError::Parse {
        path: path.to_path_buf(),
        message: with_short_lines(&source.to_string()),
    })
}

pub(super) fn read_text(path: &Path) -> Result<String, ConfigError> {
    regular_file::read_text(path).map_err(|source| ConfigError::Read {
        path: path.to_path_buf(),
        source,
    })
}

/// The given value or the default, if it is in range.
pub(super) fn within(
    name: &'static str,
    given: Option<f64>,
    default: f64,
    min: f64,
    max: f64,
    unit: &'static str,
) -> Result<f64, ConfigError> {
    let value = given.unwrap_or(default);
    // NaN is never in range.
    if (min..=max).contains(&value) {
        Ok(value)
    } else {
        Err(ConfigError::OutOfRange {
            name,
            value,
            min,
            max,
            unit,
        })
    }
}
