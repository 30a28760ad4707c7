//! What the daemon is told: the command line, a configuration file with the same names, and the defaults.

use crate::control::admission::EngageRules;
use crate::control::history::LONGEST_TITLE;
use crate::control::socket::Group;
use crate::rt::lateness::LatePolicy;
use crate::rt::privileges::{FIFO_PRIORITIES, Policy, available_cpus, default_cpu};
use clap::{Parser, ValueEnum};
use device_boards::Address;
use device_io::fake::{AfterEnd, FakeRig, Hand, Motion, MotionError, Recording, RigProperties};
use device_io::link::Connector;
use haptic_core::limiter::Limits;
use haptic_core::passivity::RigLosses;
use haptic_core::velocity::Method;
use haptic_core::{Scene, SceneError, Scheme};
use haptic_ipc::regular_file;
use serde::Deserialize;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::Arc;
use thiserror::Error;

/// Makes a one-axis force-feedback rig feel like a block sliding on a surface.
///
/// A pinned real-time thread renders the block; haptic-ctl and haptic-gui steer it over the control socket.
/// Try it without hardware: `hapticd --demo`.
#[derive(Clone, Debug, Default, Parser, Deserialize)]
#[command(name = "hapticd", version, max_term_width = 110)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub(crate) struct Options {
    /// Read options from this TOML file, named as here without the dashes: `rate = 2000`. The command line wins
    #[arg(long, value_name = "FILE")]
    #[serde(skip)]
    pub(crate) config: Option<PathBuf>,

    /// Run on the built-in fake rig, engage at once, and show a live status line
    #[arg(long)]
    #[serde(skip)]
    pub(crate) demo: bool,

    /// Measure how well this machine keeps time: the loop on the fake rig and a bare one that only waits, turn by turn on the
    /// same processor, five turns of 2 s each, or of so many. No socket, no clients
    #[arg(
        long,
        value_name = "SECONDS",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = "2",
        value_parser = clap::value_parser!(u64).range(1..=3600)
    )]
    #[serde(skip)]
    pub(crate) self_test: Option<u64>,

    /// The rig: `fake` is a simulated one in this process; `serial:/dev/ttyACM0` speaks the link protocol on a serial line, at
    /// 1000000 baud unless `?baud=N` follows, and `hid:VID:PID[:SERIAL]` on USB HID; `haptic-ctl devices` lists them. `odrive:/dev/ttyACM0?radius_mm=5&torque_limit_nm=0.1` and
    /// `simplefoc:/dev/ttyACM0?radius_mm=5&torque_limit_nm=0.1&nm_per_unit=0.05` speak to an ODrive and to a SimpleFOC board in
    /// their makers' protocols, see docs/adapters.md: never tried on a real board
    #[arg(long, value_name = "DEVICE")]
    device: Option<Named<Address>>,

    /// Where to make the control socket [default: $HAPTICD_SOCKET, else hapticd/control.sock in the user's
    /// runtime directory, else /run/hapticd/control.sock]
    #[arg(long, value_name = "PATH")]
    socket: Option<PathBuf>,

    /// Serve the members of this group on the control socket as well, by name or number; without it only the daemon's own user and root
    #[arg(long, value_name = "GROUP")]
    socket_group: Option<String>,

    /// Where to make a second socket for watchers: whoever can reach it may read everything and stop the rig, and nothing else [default: none]
    #[arg(long, value_name = "PATH")]
    watch_socket: Option<PathBuf>,

    /// Ticks a second, Hz, from 100 to 20000 [default: 1000]
    #[arg(long, value_name = "HZ", allow_negative_numbers = true)]
    rate: Option<f64>,

    /// Processor for the real-time thread [default: the last one, where there are several]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    cpu: Option<usize>,

    /// How the real-time thread is scheduled: `fifo`, or `deadline`, which guarantees it half of every period but pins it nowhere [default: fifo]
    #[arg(long, value_name = "POLICY")]
    policy: Option<PolicyName>,

    /// SCHED_FIFO priority of the real-time thread, from 1 to 99 [default: 80]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    priority: Option<i64>,

    /// Wake up this long before each tick and spin until it is due, us, from 0 to 1000; at most half a period [default: 100
    /// where the thread has a priority and a processor of its own, else 0]
    #[arg(long, value_name = "US", allow_negative_numbers = true)]
    spin_us: Option<f64>,

    /// Keep the processors from sleeping so deeply that they wake up late; it costs power [default: true]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, default_missing_value = "true")]
    keep_cpus_awake: Option<bool>,

    /// What to do when periods are missed: `warn`, or `fault:N` to take the force away at the Nth within any second
    /// of force, with N from 1 to 1000 [default: warn]
    #[arg(long, value_name = "POLICY")]
    late_policy: Option<Named<LatePolicy>>,

    /// Scene to start with, a TOML file [default: the paper's block, 0.5 kg on 4 N of stiction]
    #[arg(long, value_name = "FILE")]
    scene: Option<PathBuf>,

    /// Where saved scenes are kept [default: scenes in the service's state directory, else hapticd/scenes in the user's data
    /// directory, else /var/lib/hapticd/scenes]
    #[arg(long, value_name = "DIR")]
    scene_dir: Option<PathBuf>,

    /// Where it is kept what `haptic-ctl commission` found of rigs [default: the service's state directory, else hapticd in the user's
    /// state directory, else /var/lib/hapticd]
    #[arg(long, value_name = "DIR")]
    state_dir: Option<PathBuf>,

    /// Engage a rig though it was never commissioned (`haptic-ctl commission`), or is another than it was then: nobody knows which way its
    /// motor pulls [default: false]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, default_missing_value = "true")]
    uncommissioned: Option<bool>,

    /// Engage a device though it does not switch its motor off by itself within 200 ms when hapticd dies [default: false]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, default_missing_value = "true")]
    allow_no_watchdog: Option<bool>,

    /// How the block is integrated: `exact`, `literal` as the paper prints it, or `literal:N` with N steps a tick
    /// [default: exact]
    #[arg(long, value_name = "SCHEME")]
    scheme: Option<Named<Scheme>>,

    /// How velocity is estimated from positions: finite-difference, low-pass, alpha-beta-gamma, foaw-end-fit or
    /// foaw-best-fit [default: alpha-beta-gamma]
    #[arg(long, value_name = "METHOD")]
    velocity: Option<Named<Method>>,

    /// Largest force on the hand, N, from 0.1 to 1000; larger ones are cut to it [default: 20]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    force_limit_n: Option<f64>,

    /// Fastest change of the force on the hand, N/s, from 10 to 1000000000; letting go is not held back [default: 5000]
    #[arg(long, value_name = "N/S", allow_negative_numbers = true)]
    slew_limit_n_per_s: Option<f64>,

    /// Speed of the device at which the force is taken away, m/s, from 0.01 to 100 [default: 5]
    #[arg(long, value_name = "M/S", allow_negative_numbers = true)]
    speed_limit_mps: Option<f64>,

    /// Acceleration of the device beyond which its encoder must have jumped, and the force is taken away, m/s^2, from 10 to
    /// 1000000 [default: 2000]
    #[arg(long, value_name = "M/S^2", allow_negative_numbers = true)]
    acceleration_limit_mps2: Option<f64>,

    /// Largest force with which energy that the sampled loop makes is taken out again, N, from 0 to 100; 0 only watches it
    /// [default: 0]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    passivity_control_n: Option<f64>,

    /// Time that engaging and releasing take, ms, from 1 to 10000 [default: 200]
    #[arg(long, value_name = "MS", allow_negative_numbers = true)]
    ramp_ms: Option<f64>,

    /// Time without a new sample of the device at which the force is taken away, and time that the loop may stand still while force flows, ms, from 1 to 1000 [default: 20; 500 in the demo]
    #[arg(long, value_name = "MS", allow_negative_numbers = true)]
    stale_ms: Option<f64>,

    /// Time without a sign of life of the thread that hears stops, at which the force is let down, ms, from 50 to 10000 [default: 250]
    #[arg(long, value_name = "MS", allow_negative_numbers = true)]
    control_timeout_ms: Option<f64>,

    /// Button of the rig that stops it, by its number from 1 to 8; until a reset no force flows
    #[arg(long, value_name = "N")]
    stop_button: Option<u8>,

    /// Button of the rig that must be held down for force to flow, by its number from 1 to 8; letting go is zero force at once
    #[arg(long, value_name = "N")]
    enable_button: Option<u8>,

    /// Coulomb friction of the rig itself, N: what it takes up helps to keep it stable [default: 0.8 on the fake rig, else 0]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    rig_friction_n: Option<f64>,

    /// Viscous damping of the rig itself, N s/m [default: 0]
    #[arg(long, value_name = "NS/M", allow_negative_numbers = true)]
    rig_damping_ns_per_m: Option<f64>,

    /// The fake rig's hand: `sine` moves the handle to and fro, `arm` pulls it so through a spring and damper, `free`
    /// is nobody, `file:MOTION.csv` follows a recording (columns t_s, position_m), `arm:file:MOTION.csv` pulls along it
    /// [default: sine]
    #[arg(long, value_name = "HAND", help_heading = "Fake rig")]
    hand: Option<Named<HandName>>,

    /// Half the stroke of a sine hand, m [default: 0.03]
    #[arg(long, value_name = "M", help_heading = "Fake rig", allow_negative_numbers = true)]
    hand_amplitude_m: Option<f64>,

    /// Turns a second of a sine hand, Hz [default: 0.5]
    #[arg(long, value_name = "HZ", help_heading = "Fake rig", allow_negative_numbers = true)]
    hand_frequency_hz: Option<f64>,

    /// Factor on the positions of a recorded motion [default: 1]
    #[arg(
        long,
        value_name = "FACTOR",
        help_heading = "Fake rig",
        allow_negative_numbers = true
    )]
    hand_scale: Option<f64>,

    /// What a recorded motion does after its end: `hold` its last position, or `loop` [default: hold]
    #[arg(long, value_name = "HOW", help_heading = "Fake rig")]
    hand_after_end: Option<AfterEndName>,

    /// Stiffness of the arm, N/m [default: 500]
    #[arg(long, value_name = "N/M", help_heading = "Fake rig", allow_negative_numbers = true)]
    arm_stiffness_n_per_m: Option<f64>,

    /// Damping of the arm, N s/m [default: 5]
    #[arg(long, value_name = "NS/M", help_heading = "Fake rig", allow_negative_numbers = true)]
    arm_damping_ns_per_m: Option<f64>,

    /// Mass of the fake rig's moving part, kg [default: 1.4]
    #[arg(long, value_name = "KG", help_heading = "Fake rig", allow_negative_numbers = true)]
    rig_mass_kg: Option<f64>,

    /// Distance between two counts of the fake encoder, m; 0 for a perfect one [default: 0.00001]
    #[arg(long, value_name = "M", help_heading = "Fake rig", allow_negative_numbers = true)]
    encoder_resolution_m: Option<f64>,
}

#[derive(Clone, Copy, Debug, ValueEnum, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum PolicyName {
    Fifo,
    Deadline,
}

/// Something with a name, on the command line and in the file.
#[derive(Clone, Copy, Debug)]
struct Named<T>(T);

impl<T: FromStr> FromStr for Named<T> {
    type Err = T::Err;

    fn from_str(text: &str) -> Result<Self, T::Err> {
        text.parse().map(Self)
    }
}

impl<'de, T: FromStr<Err: std::fmt::Display>> Deserialize<'de> for Named<T> {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let text = String::deserialize(deserializer)?;
        text.parse().map_err(serde::de::Error::custom)
    }
}

#[derive(Clone, Copy, Debug, ValueEnum, Deserialize)]
#[serde(rename_all = "kebab-case")]
enum AfterEndName {
    Hold,
    Loop,
}

/// `sine`, `arm`, `free`, `file:PATH` or `arm:file:PATH`.
#[derive(Clone, Debug, PartialEq, Eq)]
enum HandName {
    Free,
    Prescribed(MotionName),
    Arm(MotionName),
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum MotionName {
    Sine,
    File(PathBuf),
}

impl FromStr for HandName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let file = |path: &str| {
            if path.is_empty() {
                return Err(format!("`{text}` names no file: write file:MOTION.csv"));
            }
            Ok(MotionName::File(path.into()))
        };
        match text {
            "free" => Ok(Self::Free),
            "sine" => Ok(Self::Prescribed(MotionName::Sine)),
            "arm" | "arm:sine" => Ok(Self::Arm(MotionName::Sine)),
            _ => match (text.strip_prefix("file:"), text.strip_prefix("arm:file:")) {
                (Some(path), _) => file(path).map(Self::Prescribed),
                (_, Some(path)) => file(path).map(Self::Arm),
                _ => Err(format!(
                    "there is no hand `{text}`; there are sine, arm, free, file:MOTION.csv and arm:file:MOTION.csv"
                )),
            },
        }
    }
}

/// Why the daemon cannot start as it was told.
#[derive(Debug, Error)]
pub(crate) enum ConfigError {
    #[error("{}: {source}", .path.display())]
    Read { path: PathBuf, source: std::io::Error },
    #[error("{}: {source}", .path.display())]
    Parse {
        path: PathBuf,
        source: Box<toml::de::Error>,
    },
    #[error("{}: {source}", .path.display())]
    Scene { path: PathBuf, source: SceneError },
    #[error(transparent)]
    StartScene(SceneError),
    #[error(transparent)]
    Motion(#[from] MotionError),
    #[error("{}", format!("{name} = {value} {unit} is out of range: it must be from {min} to {max} {unit}").replace("  ", " ").trim_end())]
    OutOfRange {
        name: &'static str,
        value: f64,
        min: f64,
        max: f64,
        unit: &'static str,
    },
    #[error("cpu = {cpu} is not available: this process may use the processors {available:?}")]
    NoSuchCpu { cpu: usize, available: Vec<usize> },
    #[error(
        "name the rig: --device serial:/dev/ttyACM0, or --device fake for a simulated one; or try `hapticd --demo`"
    )]
    NoDevice,
    #[error(
        "socket-group = {0}: there is no such group; make it with `sudo groupadd --system {0}`, and its members with `sudo usermod -aG {0} USER`"
    )]
    NoSuchGroup(String),
    #[error("watch-socket = {} is the control socket: name another place for the watchers", .0.display())]
    WatchOnControl(PathBuf),
    #[error("--demo and --self-test run on the built-in fake rig: leave --device out")]
    OnlyFake,
}

/// Where saved scenes are kept unless a place is named.
fn default_scene_dir() -> PathBuf {
    let of = |name| {
        std::env::var_os(name)
            .filter(|value| !value.is_empty())
            .map(PathBuf::from)
    };
    // The service manager names the first one; the others are those of the XDG base directories.
    let service = of("STATE_DIRECTORY").map(|state| state.join("scenes"));
    let data = of("XDG_DATA_HOME").or_else(|| of("HOME").map(|home| home.join(".local/share")));
    service
        .or_else(|| data.map(|data| data.join("hapticd/scenes")))
        .unwrap_or_else(|| "/var/lib/hapticd/scenes".into())
}

/// Where it is kept what was found of rigs unless a place is named.
fn default_state_dir() -> PathBuf {
    let of = |name| {
        std::env::var_os(name)
            .filter(|value| !value.is_empty())
            .map(PathBuf::from)
    };
    // The service manager names the first one; the others are those of the XDG base directories.
    let state = of("XDG_STATE_HOME").or_else(|| of("HOME").map(|home| home.join(".local/state")));
    of("STATE_DIRECTORY")
        .or_else(|| state.map(|state| state.join("hapticd")))
        .unwrap_or_else(|| "/var/lib/hapticd".into())
}

/// What must go on for force to flow.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Watches {
    /// Time for which a device may repeat its last sample, or the loop stand still while force flows, ns.
    pub(crate) stale_ns: u64,
    /// Time for which the control thread may give no sign of life, ns.
    pub(crate) control_timeout_ns: u64,
    /// Button of the rig that stops it, by its bit.
    pub(crate) stop_button: Option<u8>,
    /// Button of the rig that must be held down for force to flow, by its bit.
    pub(crate) enable_button: Option<u8>,
}

/// How the daemon runs.
#[derive(Debug)]
pub(crate) struct Config {
    pub(crate) socket: PathBuf,
    /// Whom the control socket serves beside the daemon's own user and root.
    pub(crate) socket_group: Option<Group>,
    pub(crate) watch_socket: Option<PathBuf>,
    pub(crate) period_ns: u64,
    pub(crate) cpu: Option<usize>,
    pub(crate) available_cpus: Vec<usize>,
    pub(crate) policy: Policy,
    pub(crate) spin_ns: Option<u64>,
    pub(crate) keep_cpus_awake: bool,
    pub(crate) late_policy: LatePolicy,
    pub(crate) scene: Scene,
    pub(crate) scene_dir: PathBuf,
    pub(crate) state_dir: PathBuf,
    pub(crate) rules: EngageRules,
    pub(crate) scheme: Scheme,
    pub(crate) velocity: Method,
    pub(crate) limits: Limits,
    pub(crate) passivity_control_n: f64,
    pub(crate) ramp_s: f64,
    pub(crate) watches: Watches,
    pub(crate) device: Address,
    pub(crate) rig: RigChoice,
}

/// The rig that was asked for.
#[derive(Debug)]
pub(crate) enum RigChoice {
    Fake(FakeRig),
    Linked {
        connector: Box<dyn Connector>,
        /// As far as somebody has measured them.
        losses: RigLosses,
    },
}

/// What the file says where the command line says nothing.
macro_rules! fall_back {
    ($options:ident, $file:ident: $($field:ident),* $(,)?) => {
        $(if $options.$field.is_none() {
            $options.$field = $file.$field;
        })*
    };
}

impl Options {
    /// Reads the configuration file, if one is named, and checks everything.
    ///
    /// # Errors
    /// The first thing with which the daemon cannot run, by its name.
    pub(crate) fn resolve(mut self) -> Result<Config, ConfigError> {
        if let Some(path) = self.config.clone() {
            let file: Self = read_toml(&path)?;
            fall_back!(
                self, file: device, socket, socket_group, watch_socket, rate, cpu, policy, priority, spin_us, keep_cpus_awake, late_policy, scene, scene_dir, state_dir, uncommissioned, allow_no_watchdog, scheme,
                velocity, force_limit_n, slew_limit_n_per_s, speed_limit_mps, acceleration_limit_mps2, passivity_control_n, ramp_ms, stale_ms, control_timeout_ms, stop_button, enable_button, hand,
                hand_amplitude_m, hand_frequency_hz, hand_scale, hand_after_end, arm_stiffness_n_per_m,
                arm_damping_ns_per_m, rig_mass_kg, rig_friction_n, rig_damping_ns_per_m, encoder_resolution_m,
            );
        }
        let device = match &self.device {
            Some(named) => named.0.clone(),
            None if self.demo || self.self_test.is_some() => Address::FAKE,
            None => return Err(ConfigError::NoDevice),
        };
        if (self.demo || self.self_test.is_some()) && device != Address::FAKE {
            return Err(ConfigError::OnlyFake);
        }
        let rate_hz = within("rate", self.rate, 1000.0, 100.0, 20_000.0, "Hz")?;
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "from 50 000 to 10 000 000"
        )]
        let period_ns = (1e9 / rate_hz).round() as u64;
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
        let available_cpus = available_cpus();
        if let Some(cpu) = self.cpu
            && !available_cpus.contains(&cpu)
        {
            return Err(ConfigError::NoSuchCpu {
                cpu,
                available: available_cpus,
            });
        }
        let policy = match self.policy {
            None | Some(PolicyName::Fifo) => Policy::Fifo { priority },
            Some(PolicyName::Deadline) => Policy::Deadline,
        };
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "from 0 to 1 000 000"
        )]
        let spin_ns = self
            .spin_us
            .map(|_| within("spin-us", self.spin_us, 0.0, 0.0, 1000.0, "us"))
            .transpose()?
            .map(|spin_us| (spin_us * 1e3).round() as u64);
        let scene = self.starting_scene()?;
        #[expect(clippy::cast_precision_loss, reason = "at most 10 000 000")]
        scene
            .validate_rate(period_ns as f64 * 1e-9)
            .map_err(ConfigError::StartScene)?;
        let socket = haptic_ipc::socket_path::for_server(self.socket.as_deref());
        if let Some(path) = self.watch_socket.as_ref().filter(|path| **path == socket) {
            return Err(ConfigError::WatchOnControl(path.clone()));
        }
        let group = self
            .socket_group
            .as_ref()
            .map(|name| Group::find(name).ok_or_else(|| ConfigError::NoSuchGroup(name.clone())));
        Ok(Config {
            socket,
            socket_group: group.transpose()?,
            watch_socket: self.watch_socket.clone(),
            period_ns,
            cpu: self.cpu.or_else(|| default_cpu(&available_cpus)),
            available_cpus,
            policy,
            spin_ns,
            keep_cpus_awake: self.keep_cpus_awake.unwrap_or(true),
            late_policy: self.late_policy.map_or(LatePolicy::Warn, |name| name.0),
            scene,
            scene_dir: self.scene_dir.clone().unwrap_or_else(default_scene_dir),
            state_dir: self.state_dir.clone().unwrap_or_else(default_state_dir),
            rules: EngageRules {
                uncommissioned: self.uncommissioned.unwrap_or(false),
                allow_no_watchdog: self.allow_no_watchdog.unwrap_or(false),
            },
            scheme: self.scheme.map_or(Scheme::Exact, |name| name.0),
            velocity: self.velocity.map_or(Method::default(), |name| name.0),
            limits: Limits {
                force_n: within("force-limit-n", self.force_limit_n, 20.0, 0.1, 1000.0, "N")?,
                slew_n_per_s: within("slew-limit-n-per-s", self.slew_limit_n_per_s, 5000.0, 10.0, 1e9, "N/s")?,
                speed_mps: within("speed-limit-mps", self.speed_limit_mps, 5.0, 0.01, 100.0, "m/s")?,
                acceleration_mps2: within(
                    "acceleration-limit-mps2",
                    self.acceleration_limit_mps2,
                    2000.0,
                    10.0,
                    1e6,
                    "m/s^2",
                )?,
            },
            passivity_control_n: within("passivity-control-n", self.passivity_control_n, 0.0, 0.0, 100.0, "N")?,
            ramp_s: within("ramp-ms", self.ramp_ms, 200.0, 1.0, 10_000.0, "ms")? * 1e-3,
            watches: self.watches()?,
            rig: match device.connector() {
                None => RigChoice::Fake(self.fake_rig()?),
                Some(connector) => RigChoice::Linked {
                    connector,
                    losses: self.losses(0.0)?,
                },
            },
            device,
        })
    }

    fn watches(&self) -> Result<Watches, ConfigError> {
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
        Ok(Watches {
            // Nobody's hand is on the demo's rig, and whoever tries it builds the clients meanwhile.
            stale_ns: ns(within(
                "stale-ms",
                self.stale_ms,
                if self.demo { 500.0 } else { 20.0 },
                1.0,
                1000.0,
                "ms",
            )?),
            control_timeout_ns: ns(within(
                "control-timeout-ms",
                self.control_timeout_ms,
                250.0,
                50.0,
                10_000.0,
                "ms",
            )?),
            stop_button: button("stop-button", self.stop_button)?,
            enable_button: button("enable-button", self.enable_button)?,
        })
    }

    fn starting_scene(&self) -> Result<Scene, ConfigError> {
        let Some(path) = &self.scene else {
            return Ok(Scene::paper());
        };
        let mut scene: Scene = read_toml(path)?;
        if scene.name.is_empty() {
            scene.name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        }
        scene.validate().map_err(|source| ConfigError::Scene {
            path: path.clone(),
            source,
        })?;
        #[expect(clippy::cast_precision_loss, reason = "at most a megabyte")]
        let (bytes, most) = (scene.name.len() as f64, LONGEST_TITLE as f64);
        within("the length of the scene's name", Some(bytes), 0.0, 0.0, most, "bytes")?;
        Ok(scene)
    }

    /// What the rig itself takes up, with the friction that is supposed where nobody names one, N.
    fn losses(&self, usual_friction_n: f64) -> Result<RigLosses, ConfigError> {
        Ok(RigLosses {
            friction: within(
                "rig-friction-n",
                self.rig_friction_n,
                usual_friction_n,
                0.0,
                1000.0,
                "N",
            )?,
            damping: within(
                "rig-damping-ns-per-m",
                self.rig_damping_ns_per_m,
                0.0,
                0.0,
                1e4,
                "N s/m",
            )?,
        })
    }

    fn fake_rig(&self) -> Result<FakeRig, ConfigError> {
        let usual = RigProperties::default();
        let RigLosses { friction, damping } = self.losses(usual.friction_n)?;
        let properties = RigProperties {
            mass_kg: within("rig-mass-kg", self.rig_mass_kg, usual.mass_kg, 1e-3, 1000.0, "kg")?,
            friction_n: friction,
            damping_ns_per_m: damping,
            resolution_m: within(
                "encoder-resolution-m",
                self.encoder_resolution_m,
                usual.resolution_m,
                0.0,
                0.01,
                "m",
            )?,
            ..usual
        };
        let stiffness_n_per_m = within(
            "arm-stiffness-n-per-m",
            self.arm_stiffness_n_per_m,
            500.0,
            0.0,
            1e6,
            "N/m",
        )?;
        let damping_ns_per_m = within(
            "arm-damping-ns-per-m",
            self.arm_damping_ns_per_m,
            5.0,
            0.0,
            1e4,
            "N s/m",
        )?;
        let hand = match self
            .hand
            .as_ref()
            .map_or(&HandName::Prescribed(MotionName::Sine), |name| &name.0)
        {
            HandName::Free => Hand::Free,
            HandName::Prescribed(motion) => Hand::Prescribed(self.motion(motion)?),
            HandName::Arm(motion) => Hand::Arm {
                stiffness_n_per_m,
                damping_ns_per_m,
                motion: self.motion(motion)?,
            },
        };
        Ok(FakeRig::new(properties, hand))
    }

    fn motion(&self, name: &MotionName) -> Result<Motion, ConfigError> {
        match name {
            MotionName::Sine => Ok(Motion::Sine {
                amplitude_m: within("hand-amplitude-m", self.hand_amplitude_m, 0.03, 0.0, 1.0, "m")?,
                frequency_hz: within("hand-frequency-hz", self.hand_frequency_hz, 0.5, 0.0, 50.0, "Hz")?,
            }),
            MotionName::File(path) => {
                let scale = within("hand-scale", self.hand_scale, 1.0, -1e3, 1e3, "")?;
                let after_end = match self.hand_after_end {
                    Some(AfterEndName::Loop) => AfterEnd::Loop,
                    Some(AfterEndName::Hold) | None => AfterEnd::Hold,
                };
                let file = regular_file::open(path);
                let recording = Recording::read_opened(path, file, scale, after_end)?;
                Ok(Motion::Recorded(Arc::new(recording)))
            }
        }
    }
}

fn read_toml<T: serde::de::DeserializeOwned>(path: &Path) -> Result<T, ConfigError> {
    let text = regular_file::read_text(path).map_err(|source| ConfigError::Read {
        path: path.to_path_buf(),
        source,
    })?;
    toml::from_str(&text).map_err(|source| ConfigError::Parse {
        path: path.to_path_buf(),
        source: Box::new(source),
    })
}

/// The value given, else the default, if it lies within its range.
fn within(
    name: &'static str,
    given: Option<f64>,
    default: f64,
    min: f64,
    max: f64,
    unit: &'static str,
) -> Result<f64, ConfigError> {
    let value = given.unwrap_or(default);
    // NaN is within nothing.
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

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    fn options(arguments: &[&str]) -> Options {
        Options::try_parse_from([&["hapticd"], arguments].concat()).expect("it parses")
    }

    #[test]
    fn the_command_line_is_sound() {
        Options::command().debug_assert();
    }

    #[test]
    fn the_command_line_wins_over_the_file_and_the_file_over_the_defaults() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("hapticd.toml");
        std::fs::write(&path, "device = \"fake\"\nrate = 2000\nramp-ms = 50\nhand = \"free\"\n").expect("written");
        let config = options(&["--config", path.to_str().expect("a plain path"), "--rate", "4000"])
            .resolve()
            .expect("it holds");
        assert_eq!(config.period_ns, 250_000);
        assert_eq!(config.ramp_s, 0.05);
        assert_eq!(config.limits.force_n, 20.0);
    }

    #[test]
    fn a_bad_option_is_refused_by_its_name_value_limit_and_unit() {
        for (arguments, parts) in [
            (vec!["--rate", "50"], vec!["rate", "50", "100", "20000", "Hz"]),
            (vec!["--rate", "NaN"], vec!["rate", "NaN"]),
            (vec!["--force-limit-n", "0"], vec!["force-limit-n", "0", "0.1", "N"]),
            (vec!["--rig-mass-kg", "-1"], vec!["rig-mass-kg", "-1", "kg"]),
            (vec!["--stale-ms", "0"], vec!["stale-ms", "0", "1", "1000", "ms"]),
            (vec!["--priority", "0"], vec!["priority", "1", "99"]),
            (vec!["--cpu", "4000"], vec!["cpu", "4000", "processors"]),
            (
                vec!["--socket-group", "nosuch"],
                vec!["socket-group", "nosuch", "groupadd"],
            ),
            (vec!["--hand", "file:/nowhere.csv"], vec!["/nowhere.csv"]),
            (vec!["--scene", "/nowhere.toml"], vec!["/nowhere.toml"]),
        ] {
            let arguments = [vec!["--device", "fake"], arguments].concat();
            // A negative value needs its `=`.
            let joined: Vec<String> = arguments.chunks(2).map(|pair| pair.join("=")).collect();
            let parsed =
                Options::try_parse_from(std::iter::once("hapticd".to_owned()).chain(joined)).expect("it parses");
            let message = parsed.resolve().expect_err("it is refused").to_string();
            for part in parts {
                assert!(message.contains(part), "{message} lacks {part}");
            }
        }
    }

    #[test]
    fn an_unknown_name_in_the_file_is_refused() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("hapticd.toml");
        std::fs::write(&path, "rat = 2000\n").expect("written");
        let error = options(&["--config", path.to_str().expect("a plain path")])
            .resolve()
            .expect_err("no such name");
        assert!(error.to_string().contains("rat"), "{error}");
    }

    #[test]
    fn hands_are_read() {
        assert_eq!(
            "arm:file:m.csv".parse(),
            Ok(HandName::Arm(MotionName::File("m.csv".into())))
        );
        assert_eq!(
            "file:m.csv".parse(),
            Ok(HandName::Prescribed(MotionName::File("m.csv".into())))
        );
        assert!("file:".parse::<HandName>().is_err());
        assert!("wave".parse::<HandName>().is_err());
    }
}
