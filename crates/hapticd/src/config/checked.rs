//! The options, checked one by one: what the daemon runs with.

use super::error::{ConfigError, read_toml, within};
use super::options::{HandName, Named, Options, PolicyName};
use super::rig::{EngageRules, FrictionOptions, RigChoice};
use super::source::Configuration;
use crate::rt::lateness::LatePolicy;
use crate::rt::privileges::{FIFO_PRIORITIES, default_cpu};
use crate::rt::thread::Policy;
use device_boards::Address;
use device_io::kinematics::Kinematics;

use haptic_core::limiter::Limits;
use haptic_core::passivity::RigLosses;
use haptic_core::scene::SceneFile;
use haptic_core::servo::Settings;
use haptic_core::velocity::Method;
use haptic_core::{Scene, Scheme};
use nix::unistd::{Gid, Group};
use std::net::SocketAddr;
use std::path::PathBuf;

/// Longest title of a scene, bytes: everything else in a scene has a fixed size.
pub(crate) const MAX_TITLE: usize = 256;

/// Finds a group of users by its name or number.
fn find_group(wanted: &str) -> Option<Group> {
    let found = match wanted.parse() {
        Ok(id) => Group::from_gid(Gid::from_raw(id)),
        Err(_) => Group::from_name(wanted),
    };
    found.ok().flatten()
}

/// Where metrics are published.
#[derive(Clone, Debug, Default)]
pub(crate) struct MetricsOptions {
    pub(crate) address: Option<SocketAddr>,
    pub(crate) file: Option<PathBuf>,
}

/// The checked configuration.
#[derive(Debug)]
pub(crate) struct Config {
    /// Where it comes from.
    pub(crate) source: Configuration,
    pub(crate) socket: PathBuf,
    /// Group that the control socket serves beside the daemon's own user and root.
    pub(crate) socket_group: Option<Group>,
    pub(crate) watch_socket: Option<PathBuf>,
    pub(crate) metrics: MetricsOptions,
    pub(crate) period_ns: u64,
    pub(crate) cpu: Option<usize>,
    pub(crate) available_cpus: Vec<usize>,
    pub(crate) policy: Policy,
    pub(crate) spin_ns: Option<u64>,
    pub(crate) keep_cpus_awake: bool,
    pub(crate) late_policy: LatePolicy,
    pub(crate) scene: SceneFile,
    pub(crate) scene_dir: PathBuf,
    pub(crate) state_dir: PathBuf,
    pub(crate) rules: EngageRules,
    pub(crate) scheme: Scheme,
    /// Settings of the servo, but for what the rig takes up.
    pub(crate) servo: Settings,
    /// Longest time without a beat of the control thread, ns.
    pub(crate) control_timeout_ns: u64,
    pub(crate) device: Address,
    /// How the motors of a rig of two axes move the hand.
    pub(crate) kinematics: Option<Kinematics>,
    pub(crate) rig: RigChoice,
    pub(crate) friction: FrictionOptions,
}

fn path_in(variable: &str) -> Option<PathBuf> {
    std::env::var_os(variable)
        .filter(|value| !value.is_empty())
        .map(PathBuf::from)
}

/// The path from the root; as it is where there is no working directory.
fn absolute(path: PathBuf) -> PathBuf {
    std::path::absolute(&path).unwrap_or(path)
}

/// A default directory: the service manager's, else hapticd in one of XDG's base directories, which a variable names or
/// which lies below the user's home.
fn default_dir(variable: &str, below_home: &str) -> PathBuf {
    let base = || path_in(variable).or_else(|| path_in("HOME").map(|home| home.join(below_home)));
    path_in("STATE_DIRECTORY")
        .or_else(|| base().map(|base| base.join("hapticd")))
        .unwrap_or_else(|| "/var/lib/hapticd".into())
}

impl Options {
    /// Checks everything; the process may use these processors.
    pub(super) fn check(&self, available_cpus: &[usize], source: Configuration) -> Result<Config, ConfigError> {
        let device = match &self.device {
            Some(named) => named.0.clone(),
            None if self.demo || self.self_test.is_some() => Address::FAKE,
            None => return Err(ConfigError::NoDevice),
        };
        if (self.demo || self.self_test.is_some()) && device != Address::FAKE {
            return Err(ConfigError::OnlyFake);
        }
        if device != Address::FAKE && self.hand == Some(Named(HandName::Mouse)) {
            return Err(ConfigError::HandOfAnotherRig(device));
        }
        let kinematics = self.kinematics.as_ref().map(|named| named.0);
        if kinematics.is_some() {
            self.refuse_what_is_of_one_axis()?;
        }
        let period_ns = self.period_ns()?;
        #[expect(clippy::cast_precision_loss, reason = "at most 10 000 000")]
        device
            .check_rate(1e9 / period_ns as f64)
            .map_err(|why| ConfigError::LineTooSlow {
                address: device.clone(),
                why,
            })?;
        let policy = self.policy()?;
        self.check_cpu(available_cpus)?;
        let spin_ns = self.spin_ns()?;
        let scene = self.starting_scene()?;
        #[expect(clippy::cast_precision_loss, reason = "at most 10 000 000")]
        let period_s = period_ns as f64 * 1e-9;
        scene
            .clone()
            .on(None)
            .validate_rate(period_s)
            .map_err(ConfigError::StartScene)?;
        let socket = haptic_ipc::socket_path::for_server(self.socket.as_deref());
        if let Some(path) = self.watch_socket.as_ref().filter(|path| **path == socket) {
            return Err(ConfigError::WatchOnControl(path.clone()));
        }
        let group = self
            .socket_group
            .as_ref()
            .map(|name| find_group(name).ok_or_else(|| ConfigError::NoSuchGroup(name.clone())));
        let socket_group = group.transpose()?;
        let metrics = self.metrics()?;
        let (servo, control_timeout_ns) = self.servo(period_s, kinematics)?;
        Ok(Config {
            source,
            socket,
            socket_group,
            watch_socket: self.watch_socket.clone(),
            metrics,
            period_ns,
            cpu: self.cpu.or_else(|| default_cpu(available_cpus)),
            available_cpus: available_cpus.to_vec(),
            policy,
            spin_ns,
            keep_cpus_awake: self.keep_cpus_awake.unwrap_or(true),
            late_policy: self.late_policy.map_or(LatePolicy::Warn, |name| name.0),
            scene,
            // Clients get paths of files in it, and have another working directory.
            scene_dir: absolute(
                self.scene_dir
                    .clone()
                    .unwrap_or_else(|| default_dir("XDG_DATA_HOME", ".local/share").join("scenes")),
            ),
            state_dir: self
                .state_dir
                .clone()
                .unwrap_or_else(|| default_dir("XDG_STATE_HOME", ".local/state")),
            rules: EngageRules {
                uncommissioned: self.uncommissioned.unwrap_or(false),
                allow_no_watchdog: self.allow_no_watchdog.unwrap_or(false),
            },
            scheme: self.scheme.map_or(Scheme::Exact, |name| name.0),
            servo,
            control_timeout_ns,
            kinematics,
            rig: match (device.connector(), kinematics) {
                (None, None) => RigChoice::Fake(Box::new(self.fake_rig()?)),
                (None, Some(kinematics)) => RigChoice::FakePlane(Box::new(self.fake_plane(kinematics)?)),
                (Some(connector), _) => RigChoice::Linked(connector),
            },
            friction: self.friction()?,
            device,
        })
    }

    /// Refuses what a rig of two axes has not.
    fn refuse_what_is_of_one_axis(&self) -> Result<(), ConfigError> {
        let given = [
            ("--self-test", self.self_test.is_some()),
            ("--compensate", self.compensate.is_some_and(|share| share > 0.0)),
            (
                "another scheme than `exact`",
                self.scheme.as_ref().is_some_and(|scheme| scheme.0 != Scheme::Exact),
            ),
        ];
        match given.into_iter().find(|(_, given)| *given) {
            Some((what, _)) => Err(ConfigError::OneAxisOnly(what)),
            None => Ok(()),
        }
    }

    fn metrics(&self) -> Result<MetricsOptions, ConfigError> {
        match self.metrics {
            Some(address) if !address.ip().is_loopback() && self.metrics_beyond_this_machine != Some(true) => {
                Err(ConfigError::MetricsBeyondThisMachine(address))
            }
            address => Ok(MetricsOptions {
                address,
                file: self.metrics_file.clone(),
            }),
        }
    }

    fn period_ns(&self) -> Result<u64, ConfigError> {
        let rate_hz = within("rate", self.rate, 1000.0, 100.0, 20_000.0, "Hz")?;
        if rate_hz.fract() != 0.0 {
            return Err(ConfigError::BrokenRate(rate_hz));
        }
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "from 50 000 to 10 000 000"
        )]
        let period_ns = (1e9 / rate_hz).round() as u64;
        Ok(period_ns)
    }

    fn policy(&self) -> Result<Policy, ConfigError> {
        let (lowest, highest) = (*FIFO_PRIORITIES.start(), *FIFO_PRIORITIES.end());
        let wanted = self.priority.unwrap_or(80);
        let priority = u8::try_from(wanted)
            .ok()
            .filter(|priority| FIFO_PRIORITIES.contains(priority));
        #[expect(clippy::cast_precision_loss, reason = "only to say which number was refused")]
        let priority = priority.ok_or(ConfigError::OutOfRange {
            name: "priority",
            value: wanted as f64,
            min: lowest.into(),
            max: highest.into(),
            unit: "",
        })?;
        Ok(match self.policy {
            None | Some(PolicyName::Fifo) => Policy::Fifo { priority },
            Some(PolicyName::Deadline) => Policy::Deadline,
        })
    }

    fn check_cpu(&self, available: &[usize]) -> Result<(), ConfigError> {
        match self.cpu {
            Some(cpu) if !available.contains(&cpu) => Err(ConfigError::NoSuchCpu {
                cpu,
                available: available.to_vec(),
            }),
            _ => Ok(()),
        }
    }

    #[expect(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "from 0 to 1 000 000"
    )]
    fn spin_ns(&self) -> Result<Option<u64>, ConfigError> {
        let spin_us = self
            .spin_us
            .map(|_| within("spin-us", self.spin_us, 0.0, 0.0, 1000.0, "us"));
        Ok(spin_us.transpose()?.map(|spin_us| (spin_us * 1e3).round() as u64))
    }

    fn limits(&self) -> Result<Limits, ConfigError> {
        let defaults = Limits::default();
        let slew_n_per_s = defaults.slew_n_per_s;
        Ok(Limits {
            force_n: within("force-limit-n", self.force_limit_n, defaults.force_n, 0.1, 1000.0, "N")?,
            slew_n_per_s: within(
                "slew-limit-n-per-s",
                self.slew_limit_n_per_s,
                slew_n_per_s,
                10.0,
                1e9,
                "N/s",
            )?,
            speed_mps: within(
                "speed-limit-mps",
                self.speed_limit_mps,
                defaults.speed_mps,
                0.01,
                100.0,
                "m/s",
            )?,
            acceleration_mps2: within(
                "acceleration-limit-mps2",
                self.acceleration_limit_mps2,
                defaults.acceleration_mps2,
                10.0,
                1e6,
                "m/s^2",
            )?,
        })
    }

    /// Settings of the servo, but for what the rig takes up; and the longest time without a beat of the control thread,
    /// ns.
    fn servo(&self, period_s: f64, kinematics: Option<Kinematics>) -> Result<(Settings, u64), ConfigError> {
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "from a millisecond to ten seconds"
        )]
        let ns = |ms: f64| (ms * 1e6).round() as u64;
        let button = |name, given: Option<u8>| match given {
            None => Ok(None),
            Some(number @ 1..=8) => Ok(Some(number - 1)),
            Some(number) => Err(ConfigError::OutOfRange {
                name,
                value: number.into(),
                min: 1.0,
                max: 8.0,
                unit: "",
            }),
        };
        let limits = self.limits()?;
        let passivity_control_n = within("passivity-control-n", self.passivity_control_n, 0.0, 0.0, 100.0, "N")?;
        let ramp_s = within("ramp-ms", self.ramp_ms, 200.0, 1.0, 10_000.0, "ms")? * 1e-3;
        // Nobody holds the rig of the demo, and a newcomer builds the clients meanwhile.
        let stale_ms = if self.demo { 500.0 } else { 20.0 };
        let stale_ns = ns(within("stale-ms", self.stale_ms, stale_ms, 1.0, 1000.0, "ms")?);
        let timeout_ms = self.control_timeout_ms;
        let control_timeout_ns = ns(within("control-timeout-ms", timeout_ms, 250.0, 50.0, 10_000.0, "ms")?);
        let settings = Settings {
            period_s,
            ramp_s,
            limits,
            losses: RigLosses::default(),
            passivity_control_n,
            velocity: self.velocity.map_or(Method::default(), |name| name.0),
            stale_ns,
            stop_button: button("stop-button", self.stop_button)?,
            enable_button: button("enable-button", self.enable_button)?,
            workspace: kinematics.and_then(|kinematics| kinematics.workspace().copied()),
            // Until a rig is engaged whose friction is known.
            compensation: None,
        };
        Ok((settings, control_timeout_ns))
    }

    fn starting_scene(&self) -> Result<SceneFile, ConfigError> {
        let Some(path) = &self.scene else {
            return Ok(Scene::light_block().into());
        };
        let mut scene: SceneFile = read_toml(path).map_err(|error| match error {
            ConfigError::Read { path, source } => ConfigError::NoScene { path, source },
            other => other,
        })?;
        if scene.name.is_empty() {
            scene.name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        }
        scene.validate().map_err(|source| ConfigError::Scene {
            path: path.clone(),
            source,
        })?;
        #[expect(clippy::cast_precision_loss, reason = "at most a megabyte")]
        let (bytes, most) = (scene.name.len() as f64, MAX_TITLE as f64);
        within("the length of the scene's name", Some(bytes), 0.0, 0.0, most, "bytes")?;
        Ok(scene)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    fn options(arguments: &[&str]) -> Options {
        Options::try_parse_from([&["hapticd"], arguments].concat()).expect("it parses")
    }

    #[test]
    fn buttons_are_counted_from_one() {
        let options = options(&["--stop-button", "1", "--enable-button", "8"]);
        let (settings, _) = options.servo(1e-3, None).expect("it holds");
        assert_eq!((settings.stop_button, settings.enable_button), (Some(0), Some(7)));
    }

    #[test]
    fn a_bad_option_is_refused_by_its_name_value_limit_and_unit() {
        for (arguments, parts) in [
            (vec!["--rate", "50"], vec!["rate", "50", "100", "20000", "Hz"]),
            (vec!["--rate", "-2e-5"], vec!["rate", "-0.00002", "100", "20000", "Hz"]),
            (vec!["--rate", "NaN"], vec!["rate", "NaN"]),
            (vec!["--rate", "1000.5"], vec!["rate", "1000.5", "whole number", "Hz"]),
            (vec!["--force-limit-n", "0"], vec!["force-limit-n", "0", "0.1", "N"]),
            (vec!["--rig-mass-kg", "-1"], vec!["rig-mass-kg", "-1", "kg"]),
            (vec!["--stale-ms", "0"], vec!["stale-ms", "0", "1", "1000", "ms"]),
            (vec!["--priority", "0"], vec!["priority", "1", "99"]),
            (vec!["--cpu", "4000"], vec!["cpu", "4000", "processors"]),
            (
                vec!["--socket-group", "nosuch"],
                vec!["socket-group", "nosuch", "groupadd"],
            ),
            (
                vec!["--metrics", "0.0.0.0:9664"],
                vec![
                    "metrics",
                    "0.0.0.0:9664",
                    "127.0.0.1:9664",
                    "metrics-beyond-this-machine",
                ],
            ),
            (vec!["--scene", "/nowhere.toml"], vec!["/nowhere.toml"]),
        ] {
            let message = options(&[vec!["--device", "fake"], arguments].concat())
                .resolve()
                .expect_err("it is refused")
                .to_string();
            for part in parts {
                assert!(message.contains(part), "{message} lacks {part}");
            }
        }
    }

    #[test]
    fn a_mouse_moves_no_other_rig_than_the_fake_one() {
        for device in ["serial:/dev/ttyACM0", "hid:1209:0001"] {
            let refused = options(&["--device", device, "--hand", "mouse"]).resolve();
            let message = refused.expect_err("a person may hold it").to_string();
            assert!(
                message.starts_with("hand = mouse") && message.contains(device),
                "{message}"
            );
        }
        assert!(options(&["--demo", "--hand", "mouse"]).resolve().is_ok());
    }

    #[test]
    fn an_unknown_hand_is_refused_with_a_hint() {
        for (text, part) in [
            ("wave", "expected sine"),
            ("file:m.csv", "fake-rig --pty LINK --hand FILE"),
        ] {
            let refused = text.parse::<HandName>().expect_err("no such hand");
            assert!(refused.contains(part), "{refused}");
        }
    }
}
