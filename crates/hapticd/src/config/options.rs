//! The options of the command line, which are those of the configuration file as well.

use crate::rt::lateness::LatePolicy;
use clap::error::{ContextKind, ContextValue, ErrorKind};
use clap::{Parser, ValueEnum};
use device_boards::Address;
use device_io::fake::Figure;
use device_io::kinematics::Kinematics;
use haptic_core::Scheme;
use haptic_core::nearest::meant_or_semicolon;
use haptic_core::velocity::Method;
use serde::Deserialize;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::str::FromStr;

/// Makes a force-feedback rig of one axis or two feel like a block sliding on a surface.
///
/// A pinned real-time thread renders the block; haptic-ctl and haptic-gui control it over the
/// control socket. Try it without hardware: `hapticd --demo`.
#[derive(Clone, Debug, Default, PartialEq, Parser, Deserialize)]
#[command(name = "hapticd", version, max_term_width = 80)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
pub(crate) struct Options {
    /// TOML file of options, named as here without the dashes: `rate = 2000`. The command line wins
    #[arg(long, value_name = "FILE")]
    #[serde(skip)]
    pub(crate) config: Option<PathBuf>,

    /// Print the manual page, for a package
    #[arg(long, hide = true)]
    #[serde(skip)]
    pub(crate) manual_page: bool,

    /// Print the configured device, for a rule of udev
    #[arg(long, hide = true)]
    #[serde(skip)]
    pub(crate) print_device: bool,

    /// Run on the built-in fake rig, engage at once, and show a live status line
    #[arg(long)]
    #[serde(skip)]
    pub(crate) demo: bool,

    /// Measure how well this machine keeps time
    ///
    /// The loop on the fake rig and a bare loop that only waits, in turn on the same processor, five times for 2 s
    /// each, or SECONDS.
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

    /// End with standard input, and so with the program that started this one
    #[arg(long, hide_short_help = true)]
    #[serde(skip)]
    pub(crate) end_with_input: bool,

    /// Rig: `fake`, or an address as `haptic-ctl devices` lists them
    ///
    /// `serial:/dev/ttyACM0` speaks the link protocol on a serial line, at 1000000 baud unless `?baud=N` follows,
    /// `hid:VID:PID[:SERIAL]` on USB HID. `odrive:/dev/ttyACM0?radius_mm=5&torque_limit_nm=0.1` is an ODrive
    /// (docs/how-to/firmware.md), not tested on a real board.
    #[arg(long, value_name = "DEVICE")]
    pub(super) device: Option<Named<Address>>,

    /// How two motors move the hand: `xy`, `h-belt`, or a TOML file [default: one axis]
    #[arg(long, value_name = "KINEMATICS")]
    pub(super) kinematics: Option<Named<Kinematics>>,

    /// Path of the control socket [default: $HAPTICD_SOCKET, else hapticd/control.sock in the
    /// user's runtime directory, else /run/hapticd/control.sock]
    #[arg(long, value_name = "PATH", hide_short_help = true)]
    pub(super) socket: Option<PathBuf>,

    /// Group, by name or number, that the control socket also serves [default: none]
    #[arg(long, value_name = "GROUP", hide_short_help = true)]
    pub(super) socket_group: Option<String>,

    /// Path of a socket for watchers, who may only read and stop the rig [default: none]
    #[arg(long, value_name = "PATH", hide_short_help = true)]
    pub(super) watch_socket: Option<PathBuf>,

    /// Serve metrics for Prometheus (OpenMetrics, at /metrics) on an address of this machine, as in
    /// 127.0.0.1:9664 [default: none]
    #[arg(long, value_name = "ADDRESS:PORT", value_parser = address_and_port, hide_short_help = true)]
    pub(super) metrics: Option<SocketAddr>,

    /// Let --metrics name an address that other machines can reach [default: false]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, default_missing_value = "true", hide_short_help = true)]
    pub(super) metrics_beyond_this_machine: Option<bool>,

    /// Write the metrics into a file every 5 s, for the textfile collector of node_exporter
    /// [default: none]
    #[arg(long, value_name = "FILE", hide_short_help = true)]
    pub(super) metrics_file: Option<PathBuf>,

    /// Rate of the loop, Hz, from 100 to 20000 [default: 1000]
    #[arg(long, value_name = "HZ", allow_hyphen_values = true)]
    pub(super) rate: Option<f64>,

    /// Processor for the real-time thread [default: the last one, where there are several]
    #[arg(long, value_name = "N", allow_hyphen_values = true, hide_short_help = true)]
    pub(super) cpu: Option<usize>,

    /// Scheduling of the real-time thread: `fifo`, or `deadline`, which guarantees it half of every
    /// period but does not pin it [default: fifo]
    #[arg(long, value_name = "POLICY", hide_short_help = true)]
    pub(super) policy: Option<PolicyName>,

    /// SCHED_FIFO priority of the real-time thread, from 1 to 99 [default: 80]
    #[arg(long, value_name = "N", allow_hyphen_values = true, hide_short_help = true)]
    pub(super) priority: Option<i64>,

    /// Wake up this long before each tick and spin until it is due, us, from 0 to 1000; at most
    /// half a period [default: 100 where the thread has a priority and a processor of its own, else
    /// 0]
    #[arg(long, value_name = "US", allow_hyphen_values = true, hide_short_help = true)]
    pub(super) spin_us: Option<f64>,

    /// Keep the processors out of deep sleep; costs power [default: true]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, default_missing_value = "true", hide_short_help = true)]
    pub(super) keep_cpus_awake: Option<bool>,

    /// Policy for missed periods: `warn`, or `fault:N` to take the force away at the Nth within a second of force, N
    /// from 1 to 1000 [default: warn]
    #[arg(long, value_name = "POLICY", hide_short_help = true)]
    pub(super) late_policy: Option<Named<LatePolicy>>,

    /// Scene to start with, a TOML file [default: 0.1 kg, 4 N of stiction]
    #[arg(long, value_name = "FILE")]
    pub(super) scene: Option<PathBuf>,

    /// Directory of saved scenes [default: scenes in the service's state directory, else
    /// hapticd/scenes in the user's data directory, else /var/lib/hapticd/scenes]
    #[arg(long, value_name = "DIR", hide_short_help = true)]
    pub(super) scene_dir: Option<PathBuf>,

    /// Directory of the records of commissioned rigs [default: the service's state directory, else hapticd in the
    /// user's state directory, else /var/lib/hapticd]
    #[arg(long, value_name = "DIR", hide_short_help = true)]
    pub(super) state_dir: Option<PathBuf>,

    /// Engage a rig that was never commissioned, or has changed since: the direction of its motor is unknown [default:
    /// false]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, default_missing_value = "true", hide_short_help = true)]
    pub(super) uncommissioned: Option<bool>,

    /// Engage a device that does not switch its motor off by itself within 200 ms when hapticd dies
    /// [default: false]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, default_missing_value = "true", hide_short_help = true)]
    pub(super) allow_no_watchdog: Option<bool>,

    /// Integration of the block: `exact`, `implicit`, `literal` as the paper prints it, or `literal:N`
    /// with N steps a tick [default: exact]
    #[arg(long, value_name = "SCHEME", hide_short_help = true)]
    pub(super) scheme: Option<Named<Scheme>>,

    /// Estimator of velocity from positions: finite-difference, low-pass, alpha-beta-gamma,
    /// foaw-end-fit or foaw-best-fit [default: alpha-beta-gamma]
    #[arg(long, value_name = "METHOD", hide_short_help = true)]
    pub(super) velocity: Option<Named<Method>>,

    /// Largest force on the hand, N, from 0.1 to 1000; a larger force is clamped [default: 20]
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    pub(super) force_limit_n: Option<f64>,

    /// Fastest change of the force on the hand, N/s, from 10 to 1000000000; a fall to zero is not
    /// limited [default: 5000]
    #[arg(long, value_name = "N/S", allow_hyphen_values = true, hide_short_help = true)]
    pub(super) slew_limit_n_per_s: Option<f64>,

    /// Speed of the device at which the force is taken away, m/s, from 0.01 to 100 [default: 5]
    #[arg(long, value_name = "M/S", allow_hyphen_values = true)]
    pub(super) speed_limit_mps: Option<f64>,

    /// Acceleration of the device at which the force is taken away, m/s^2, from 10 to 1000000 [default: 2000]
    #[arg(long, value_name = "M/S^2", allow_hyphen_values = true, hide_short_help = true)]
    pub(super) acceleration_limit_mps2: Option<f64>,

    /// Largest force of passivity control, which takes out energy that sampling creates, N, from 0 to 100; 0 only
    /// observes [default: 0]
    #[arg(long, value_name = "N", allow_hyphen_values = true, hide_short_help = true)]
    pub(super) passivity_control_n: Option<f64>,

    /// Duration of engaging and releasing, ms, from 1 to 10000 [default: 200]
    #[arg(long, value_name = "MS", allow_hyphen_values = true, hide_short_help = true)]
    pub(super) ramp_ms: Option<f64>,

    /// Time without a new sample or a tick at which the force is taken away, ms, from 1 to 1000 [default: 20; 500 in
    /// the demo]
    #[arg(long, value_name = "MS", allow_hyphen_values = true, hide_short_help = true)]
    pub(super) stale_ms: Option<f64>,

    /// Time without a beat of the control thread, which hears stops, at which the rig is released,
    /// ms, from 50 to 10000 [default: 250]
    #[arg(long, value_name = "MS", allow_hyphen_values = true, hide_short_help = true)]
    pub(super) control_timeout_ms: Option<f64>,

    /// Stop button of the rig, by its number from 1 to 8: zero force until a reset [default: none]
    #[arg(long, value_name = "N")]
    pub(super) stop_button: Option<u8>,

    /// Enable button of the rig (dead man's switch), by its number from 1 to 8: zero force at once
    /// unless it is held [default: none]
    #[arg(long, value_name = "N", hide_short_help = true)]
    pub(super) enable_button: Option<u8>,

    /// Coulomb friction of the rig itself, N, which helps to keep it stable [default: what was
    /// identified, else commissioned; else 0.8 on the fake rig, and 0 on others]
    #[arg(long, value_name = "N", allow_hyphen_values = true, hide_short_help = true)]
    pub(super) rig_friction_n: Option<f64>,

    /// Viscous damping of the rig itself, N s/m [default: what was identified; else 12 on the fake
    /// rig, and 0 on others]
    #[arg(long, value_name = "NS/M", allow_hyphen_values = true, hide_short_help = true)]
    pub(super) rig_damping_ns_per_m: Option<f64>,

    /// Compensate a share of the rig's own friction (`haptic-ctl identify --rig`), from 0 to 0.8 [default: 0]
    #[arg(long, value_name = "SHARE", allow_hyphen_values = true, hide_short_help = true)]
    pub(super) compensate: Option<f64>,

    /// Hand on the fake rig: sine, arm, free or mouse; of two axes circle or eight [default: sine, or
    /// circle]
    ///
    /// `sine` moves the handle to and fro, `arm` pulls it likewise through a spring and damper, `mouse` pulls it
    /// through the arm to the pointer in haptic-gui. `circle` and `eight` draw through the arm.
    #[arg(long, value_name = "HAND", help_heading = "Fake rig")]
    pub(super) hand: Option<Named<HandName>>,

    /// Amplitude of a sine hand, m [default: 0.03]
    #[arg(
        long,
        value_name = "M",
        help_heading = "Fake rig",
        allow_hyphen_values = true,
        hide_short_help = true
    )]
    pub(super) hand_amplitude_m: Option<f64>,

    /// Frequency of a sine hand, Hz [default: 0.5]
    #[arg(
        long,
        value_name = "HZ",
        help_heading = "Fake rig",
        allow_hyphen_values = true,
        hide_short_help = true
    )]
    pub(super) hand_frequency_hz: Option<f64>,

    /// Mass of the fake rig's moving part, kg [default: 1.4]
    #[arg(
        long,
        value_name = "KG",
        help_heading = "Fake rig",
        allow_hyphen_values = true,
        hide_short_help = true
    )]
    pub(super) rig_mass_kg: Option<f64>,

    /// Distance between two counts of the fake encoder, m; 0 for a perfect one [default: 0.00001]
    #[arg(
        long,
        value_name = "M",
        help_heading = "Fake rig",
        allow_hyphen_values = true,
        hide_short_help = true
    )]
    pub(super) encoder_resolution_m: Option<f64>,
}

#[derive(Clone, Copy, Debug, PartialEq, ValueEnum, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum PolicyName {
    Fifo,
    Deadline,
}

/// A value that is parsed from text, on the command line and in the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Named<T>(pub(super) T);

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

/// `sine`, `arm`, `free` or `mouse`; in the plane `circle` or `eight`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum HandName {
    Free,
    Sine,
    Arm,
    Mouse,
    Figure(Figure),
}

impl FromStr for HandName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        Ok(match text {
            "free" => Self::Free,
            "sine" => Self::Sine,
            "arm" => Self::Arm,
            "mouse" => Self::Mouse,
            "circle" => Self::Figure(Figure::Circle),
            "eight" => Self::Figure(Figure::Eight),
            _ if text.contains("file:") => {
                return Err(format!(
                    "unknown hand `{text}`: a motion from a file is fake-rig's, as in `fake-rig --pty LINK --hand FILE`"
                ));
            }
            _ => {
                return Err(format!(
                    "unknown hand `{text}`{} expected sine, arm, free or mouse, and of two axes circle or eight",
                    meant_or_semicolon(text, &["sine", "arm", "free", "mouse", "circle", "eight"])
                ));
            }
        })
    }
}

impl Options {
    /// The options of the command line. Ends the process where they are wrong, and after a help.
    pub(crate) fn of_command_line() -> Self {
        Self::try_parse().unwrap_or_else(|error| without_unit(error).exit())
    }
}

/// Says that a number has no unit, where one has.
fn without_unit(mut error: clap::Error) -> clap::Error {
    let has_unit = |value: &str| {
        value.starts_with(|first: char| first.is_ascii_digit()) && value.ends_with(|last: char| last.is_alphabetic())
    };
    if error.kind() == ErrorKind::ValueValidation
        && let Some(ContextValue::String(value)) = error.get(ContextKind::InvalidValue)
        && has_unit(value)
    {
        let tip = "write a bare number, in the unit that the option names".into();
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![tip]));
    }
    error
}

fn address_and_port(text: &str) -> Result<SocketAddr, &'static str> {
    text.parse().map_err(|_| "an address with a port, as in 127.0.0.1:9664")
}

/// What is done with each option that the file may have.
macro_rules! options_of_the_file {
    ($($field:ident),* $(,)?) => {
        impl Options {
            /// The options that the file may have, as they are written there.
            pub(super) fn names() -> Vec<String> {
                [$(stringify!($field)),*].map(|name| name.replace('_', "-")).into()
            }

            /// These options, completed by those of the file.
            pub(super) fn or(self, file: Self) -> Self {
                Self {
                    config: self.config,
                    manual_page: self.manual_page,
                    print_device: self.print_device,
                    demo: self.demo,
                    self_test: self.self_test,
                    end_with_input: self.end_with_input,
                    $($field: self.$field.or(file.$field),)*
                }
            }

            /// The names of the options that others have otherwise.
            pub(super) fn changed_in(&self, others: &Self) -> Vec<String> {
                let mut names = Vec::new();
                $(if self.$field != others.$field {
                    names.push(stringify!($field).replace('_', "-"));
                })*
                names
            }
        }
    };
}

options_of_the_file!(
    device,
    kinematics,
    socket,
    socket_group,
    watch_socket,
    metrics,
    metrics_beyond_this_machine,
    metrics_file,
    rate,
    cpu,
    policy,
    priority,
    spin_us,
    keep_cpus_awake,
    late_policy,
    scene,
    scene_dir,
    state_dir,
    uncommissioned,
    allow_no_watchdog,
    scheme,
    velocity,
    force_limit_n,
    slew_limit_n_per_s,
    speed_limit_mps,
    acceleration_limit_mps2,
    passivity_control_n,
    ramp_ms,
    stale_ms,
    control_timeout_ms,
    stop_button,
    enable_button,
    hand,
    hand_amplitude_m,
    hand_frequency_hz,
    rig_mass_kg,
    rig_friction_n,
    rig_damping_ns_per_m,
    compensate,
    encoder_resolution_m,
);

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn short_help_fits_on_a_screen() {
        let help = Options::command().term_width(80).render_help().to_string();
        assert!(help.lines().count() <= 40, "{help}");
    }

    #[test]
    fn a_number_with_a_unit_is_refused_with_a_hint() {
        let refused = |value: &str| {
            let error = Options::try_parse_from(["hapticd", "--rate", value]).expect_err(value);
            without_unit(error).to_string()
        };
        assert!(refused("1kHz").contains("write a bare number"));
        assert!(!refused("fast").contains("write a bare number"));
        for address in ["9664", "127.0.0.1"] {
            let message = Options::try_parse_from(["hapticd", "--metrics", address]).map_err(without_unit);
            let message = message.expect_err(address).to_string();
            assert!(
                message.contains("as in 127.0.0.1:9664") && !message.contains("bare number"),
                "{message}"
            );
        }
    }
}
