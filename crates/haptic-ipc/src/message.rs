//! Requests and answers.

use crate::error::{ErrorCode, WireError};
use crate::event::Event;
use haptic_core::adviser;
use haptic_core::parameters::{ParameterInfo, Scale, TABLE};
use haptic_core::scene::Note;
use haptic_core::{Directional, ParameterKey, Scene};
use serde::de::{MapAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::collections::BTreeMap;
use std::fmt;

/// What the server says first.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Hello {
    /// Version of the protocol.
    pub protocol: u32,
    /// Name and version of the server.
    pub server: String,
    /// Name of this connection in the server's log.
    pub session: String,
}

/// What a client asks.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "op", rename_all = "snake_case", deny_unknown_fields)]
pub enum Request {
    /// The parameter table.
    Describe {},
    /// The scene in force.
    Get {},
    /// Change parameters.
    Set {
        /// The changes.
        params: Changes,
    },
    /// Ramp the force up.
    Engage {},
    /// Ramp the force down.
    Release {},
    /// Zero force at once.
    Stop {},
    /// Clear a stop or a fault.
    Reset {},
    /// How the rig and the daemon are.
    Status {},
    /// How well the loop keeps time.
    Timing {},
    /// What the scene in force will do to the rig.
    Advise {},
    /// Which devices are plugged in.
    Devices {
        /// Only this one, by its address, which is opened and asked who it is. That resets many boards.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        probe: Option<String>,
    },
    /// Events from now on.
    Subscribe {
        /// What to hear of; nothing ends the subscription.
        topics: Vec<Topic>,
        /// Samples a second; every tick when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        rate_hz: Option<f64>,
        /// Time between sample events, ms; 10 when absent.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        batch_ms: Option<u32>,
    },
}

/// The operations, for messages.
const OPERATIONS: &str = "describe, get, set, engage, release, stop, reset, status, timing, advise, devices, subscribe";

/// A request with the number that its answer will carry.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Envelope {
    /// Chosen by the client.
    pub id: u64,
    /// What is asked.
    #[serde(flatten)]
    pub request: Request,
}

/// A line that is no request.
#[derive(Clone, Debug, PartialEq)]
pub struct BadLine {
    /// Its number, where one could be read.
    pub id: Option<u64>,
    /// What is wrong with it.
    pub error: WireError,
    /// Whether it was meant as a stop all the same: when in doubt, zero force.
    pub means_stop: bool,
}

impl Envelope {
    /// Reads a line.
    ///
    /// # Errors
    /// The answer to a line that is no request.
    pub fn parse(line: &str) -> Result<Self, BadLine> {
        /// What must be known of a line whatever else is wrong with it.
        #[derive(Default, Deserialize)]
        struct Head {
            id: Option<serde_json::Value>,
            op: Option<serde_json::Value>,
        }
        // An array would be read as a head as well.
        let is_object = line.trim_start().starts_with('{');
        let head = if is_object {
            serde_json::from_str(line).unwrap_or_default()
        } else {
            Head::default()
        };
        let (id, op) = (head.id.as_ref(), head.op.as_ref());
        let refused = |error| BadLine {
            id: id.and_then(serde_json::Value::as_u64),
            error,
            means_stop: op.is_some_and(|op| op == "stop"),
        };
        let bad = |field: &str, value: &serde_json::Value, wanted: &str| {
            let message = format!("{field} = {value} is not {wanted}");
            refused(WireError::new(ErrorCode::BadRequest, message).about(field))
        };
        match (id, op) {
            (Some(id), _) if !id.is_u64() => Err(bad("id", id, "a whole number from 0 to 2^64 - 1")),
            // A number would be taken for the operation's place in a list.
            (_, Some(op)) if !op.is_string() => Err(bad("op", op, "the name of an operation")),
            _ => serde_json::from_str(line).map_err(|error| refused(explain(line, &error))),
        }
    }
}

/// Turns serde's refusal into one of ours. Its texts are the only place where it names the culprit.
fn explain(line: &str, error: &serde_json::Error) -> WireError {
    let message = error.to_string();
    let quoted = |after: &str| {
        let rest = message.split_once(after)?.1;
        Some(rest.split_once('`')?.0.to_owned())
    };
    if serde_json::from_str::<serde::de::IgnoredAny>(line).is_err() {
        return WireError::new(
            ErrorCode::BadJson,
            format!("the line is not JSON: {error} (NaN and infinity are not JSON either)"),
        );
    }
    if let Some(field) = quoted("unknown field `") {
        return WireError::new(ErrorCode::UnknownField, message).about(field);
    }
    if let Some(op) = quoted("unknown variant `") {
        // A topic can be unknown too; serde then lists the topics.
        if message.contains("`describe`") {
            return WireError::new(
                ErrorCode::UnknownOp,
                format!("there is no operation `{op}`; there are {OPERATIONS}"),
            )
            .about("op");
        }
        return WireError::new(ErrorCode::BadRequest, message).about("topics");
    }
    match quoted("missing field `") {
        Some(field) => WireError::new(ErrorCode::BadRequest, message).about(field),
        None => WireError::new(ErrorCode::BadRequest, message),
    }
}

/// Changes of parameters in the order given, by name or symbol. Nothing is dropped: a name given twice is there twice.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Changes(pub Vec<(String, Directional)>);

impl Changes {
    /// The changes as the scene takes them.
    ///
    /// # Errors
    /// A name that no parameter has.
    pub fn resolve(&self) -> Result<Vec<(ParameterKey, f64)>, WireError> {
        let mut resolved = Vec::with_capacity(self.0.len());
        for (name, value) in &self.0 {
            let key: ParameterKey = name.parse()?;
            if value.is_symmetric() {
                resolved.push((key, value.positive));
                continue;
            }
            if key.direction.is_some() || !key.parameter.info().directional {
                return Err(WireError::new(
                    ErrorCode::NotDirectional,
                    format!("`{name}` takes one number, not a pair of directions"),
                )
                .about(name));
            }
            use haptic_core::Direction::{Negative, Positive};
            for direction in [Positive, Negative] {
                let one = ParameterKey {
                    parameter: key.parameter,
                    direction: Some(direction),
                };
                resolved.push((one, value.get(direction)));
            }
        }
        Ok(resolved)
    }
}

impl<N: Into<String>> FromIterator<(N, f64)> for Changes {
    fn from_iter<I: IntoIterator<Item = (N, f64)>>(changes: I) -> Self {
        Self(
            changes
                .into_iter()
                .map(|(name, value)| (name.into(), Directional::both(value)))
                .collect(),
        )
    }
}

impl Serialize for Changes {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, value)))
    }
}

impl<'de> Deserialize<'de> for Changes {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Pairs;
        impl<'de> Visitor<'de> for Pairs {
            type Value = Changes;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("an object of parameter names and numbers in `params`")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Changes, A::Error> {
                let mut changes = Vec::new();
                while let Some(name) = map.next_key::<String>()? {
                    let value = map
                        .next_value()
                        .map_err(|error| serde::de::Error::custom(format!("`{name}`: {error}")))?;
                    changes.push((name, value));
                }
                Ok(Changes(changes))
            }
        }
        deserializer.deserialize_map(Pairs)
    }
}

/// What can be subscribed to.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Topic {
    /// The rig's state and the scene in force, at once and at every change.
    State,
    /// How well the loop keeps time, once a second.
    Timing,
    /// The ticks.
    Samples,
}

/// State of the rig.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RigState {
    /// No device; zero force.
    Disconnected,
    /// Zero force.
    Idle,
    /// The force ramps up.
    Engaging,
    /// The scene is rendered.
    Engaged,
    /// The force ramps down.
    Releasing,
    /// Zero force, by a person; needs a reset.
    Stopped,
    /// Zero force, by a check; needs a reset.
    Faulted,
}

impl RigState {
    /// Whether force may flow: while engaging, engaged or releasing.
    #[must_use]
    pub const fn is_live(self) -> bool {
        matches!(self, Self::Engaging | Self::Engaged | Self::Releasing)
    }
}

impl fmt::Display for RigState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(match self {
            Self::Disconnected => "disconnected",
            Self::Idle => "idle",
            Self::Engaging => "engaging",
            Self::Engaged => "engaged",
            Self::Releasing => "releasing",
            Self::Stopped => "stopped",
            Self::Faulted => "faulted",
        })
    }
}

/// Answer to `describe`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Description {
    /// The scene's friction law.
    #[serde(default)]
    pub law: String,
    /// The parameters of the scene, in the order in which people read them.
    pub parameters: Vec<ParameterDescription>,
    /// Names of a sample's columns.
    pub sample_columns: Vec<String>,
}

/// A row of the parameter table.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterDescription {
    /// Name on the wire.
    pub name: String,
    /// Symbol in the paper.
    pub symbol: String,
    /// Other symbols, accepted as well.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub aliases: Vec<String>,
    /// SI unit.
    pub unit: String,
    /// Part of the scene that it belongs to.
    pub group: String,
    /// Smallest value accepted.
    pub min: f64,
    /// Largest value accepted.
    pub max: f64,
    /// Lower end of a slider.
    pub slider_min: f64,
    /// Upper end of a slider.
    pub slider_max: f64,
    /// The smallest difference worth a step.
    pub step: f64,
    /// Whether a slider should be logarithmic.
    pub logarithmic: bool,
    /// Whether it may differ by direction.
    pub directional: bool,
    /// What a larger value makes the hand feel.
    pub feel: String,
    /// The value in force.
    pub value: Directional,
}

impl ParameterDescription {
    /// The rows of the parameters that a scene has, with their values.
    #[must_use]
    pub fn all_of(scene: &Scene) -> Vec<Self> {
        TABLE
            .iter()
            .filter_map(|row| Some(Self::new(row, scene.value(row.parameter)?)))
            .collect()
    }

    /// A row of the table with a value.
    #[must_use]
    pub fn new(info: &ParameterInfo, value: Directional) -> Self {
        Self {
            name: info.name.to_owned(),
            symbol: info.symbol.to_owned(),
            aliases: info.aliases.iter().map(ToString::to_string).collect(),
            unit: info.unit.to_owned(),
            group: info.group.to_owned(),
            min: info.min,
            max: info.max,
            slider_min: info.slider_min,
            slider_max: info.slider_max,
            step: info.step,
            logarithmic: info.scale == Scale::Logarithmic,
            directional: info.directional,
            feel: info.feel.to_owned(),
            value,
        }
    }
}

/// Answer to `get`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SceneReply {
    /// Revision of the scene; it grows by one with every change.
    pub revision: u64,
    /// The parameters by name.
    pub params: BTreeMap<String, Directional>,
    /// The scene as its file holds it.
    pub scene: Scene,
}

/// The parameters of a scene by name.
#[must_use]
pub fn params_of(scene: &Scene) -> BTreeMap<String, Directional> {
    TABLE
        .iter()
        .filter_map(|row| Some((row.name.to_owned(), scene.value(row.parameter)?)))
        .collect()
}

/// Answer to `set`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SetReply {
    /// Revision of the changed scene.
    pub revision: u64,
    /// The first tick that rendered it.
    pub tick: u64,
    /// The changes by full name.
    pub applied: BTreeMap<String, f64>,
    /// What the user of the changed scene may not expect, and the bounds that it breaks.
    pub advice: Vec<Advice>,
}

/// A remark on a scene that is accepted all the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Advice {
    /// The parameter concerned: the one to change, where changing one mends it.
    pub param: String,
    /// The remark.
    pub message: String,
    /// What was checked; absent where the remark is no check against a bound.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub finding: Option<Finding>,
}

/// A bound on the scene, and how the scene keeps it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Finding {
    /// Name of the check.
    pub check: String,
    /// Whether the scene keeps the bound.
    pub passes: bool,
    /// What the scene has; absent where it has no limit.
    pub value: Option<f64>,
    /// The bound on it.
    pub bound: Option<f64>,
    /// Unit of both.
    pub unit: String,
    /// How far inside the bound, as a ratio; below 1 it is broken.
    pub margin: Option<f64>,
    /// The value of `param` that would mend it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mending: Option<f64>,
}

impl From<adviser::Finding> for Advice {
    fn from(finding: adviser::Finding) -> Self {
        // JSON has no infinity.
        let number = |value: f64| value.is_finite().then_some(value);
        let concerned = finding.mending.map_or(finding.parameter, |mending| mending.parameter);
        Self {
            param: concerned.info().name.to_owned(),
            message: finding.to_string(),
            finding: Some(Finding {
                check: finding.check.name().to_owned(),
                passes: finding.passes,
                value: number(finding.value),
                bound: number(finding.bound),
                unit: finding.unit.to_owned(),
                margin: number(finding.margin),
                mending: finding.mending.map(|mending| mending.value),
            }),
        }
    }
}

impl From<Note> for Advice {
    fn from(note: Note) -> Self {
        Self {
            param: note.param.to_string(),
            message: note.to_string(),
            finding: None,
        }
    }
}

/// Answer to `advise`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct AdviceReply {
    /// Revision of the scene that was looked at.
    pub revision: u64,
    /// Every check and every remark, kept or broken.
    pub advice: Vec<Advice>,
}

/// Answer to `engage`, `release`, `stop` and `reset`.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct StateReply {
    /// State of the rig after the tick.
    pub state: RigState,
    /// The tick that carried it out.
    pub tick: u64,
}

/// Answer to `status`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Status {
    /// Name and version of the server.
    pub server: String,
    /// State of the rig.
    pub state: RigState,
    /// Why it is faulted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fault: Option<String>,
    /// The last tick.
    pub tick: u64,
    /// Time since the loop began, s.
    pub uptime_s: f64,
    /// Nominal rate of the loop, Hz.
    pub rate_hz: f64,
    /// How the block is integrated: `exact`, `literal` or `literal:N`.
    pub scheme: String,
    /// How the device's velocity is estimated from its positions.
    pub velocity_estimator: String,
    /// Revision of the scene in force.
    pub revision: u64,
    /// Name of the scene in force.
    pub scene: String,
    /// Force commanded on the hand in the last tick, N.
    #[serde(rename = "command_force_N")]
    pub command_force_n: f64,
    /// Energy that the sampled loop made and the rig did not take up, J.
    #[serde(default, rename = "energy_excess_J")]
    pub energy_excess_j: f64,
    /// Position of the device in the last tick, m.
    pub device_position_m: f64,
    /// Clients connected.
    pub clients: usize,
    /// The rig.
    pub device: DeviceStatus,
    /// The real-time thread.
    pub real_time: RealTimeStatus,
}

/// The rig, as `status` shows it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DeviceStatus {
    /// What it is.
    pub description: String,
    /// Largest force that goes to it, N.
    #[serde(rename = "force_limit_N")]
    pub force_limit_n: f64,
    /// Fastest change of that force, N/s.
    #[serde(default, rename = "slew_limit_N_per_s")]
    pub slew_limit_n_per_s: f64,
    /// Speed at which the force is taken away, m/s.
    #[serde(default)]
    pub speed_limit_mps: f64,
    /// Acceleration beyond which its position has jumped, and the force is taken away, m/s^2.
    #[serde(default)]
    pub acceleration_limit_mps2: f64,
    /// The link to it; absent where the rig is in the daemon itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link: Option<LinkStatus>,
}

/// The answer to `devices`.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct DevicesReply {
    /// What is plugged in, or the one that was asked.
    pub devices: Vec<FoundDevice>,
}

/// A device that may be a rig.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct FoundDevice {
    /// How to name it, for `hapticd --device`.
    pub address: String,
    /// What it is, for people.
    pub description: String,
    /// Whether this daemon uses it now.
    pub in_use: bool,
    /// Why it cannot be used as things stand, and how to mend it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub problem: Option<Problem>,
    /// What it answered, where it was asked.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device: Option<LinkedDevice>,
}

/// The link to a rig, as `status` shows it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LinkStatus {
    /// The device that is connected.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub device: Option<LinkedDevice>,
    /// Why none is, and what would help.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub waiting: Option<String>,
    /// From the sending of a command to the arrival of the first sample that knows it, newest, us.
    pub round_trip_us: f64,
    /// The longest of those, us.
    pub round_trip_max_us: f64,
    /// How old the newest sample was when it was last used, beyond what the quickest ones take to come, us.
    pub age_us: f64,
    /// How much faster the device's clock runs than ours, parts in a million; absent until that is known.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub clock_drift_ppm: Option<f64>,
    /// Buttons pressed, one bit each.
    pub buttons: u64,
    /// What was counted since the daemon began.
    pub counts: LinkCounts,
}

/// A device at the other end of a link.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct LinkedDevice {
    /// Name and version of its firmware.
    pub firmware: String,
    /// Largest force of its motor, N.
    #[serde(rename = "force_limit_N")]
    pub force_limit_n: f64,
    /// Samples a second, Hz.
    pub sample_rate_hz: f64,
    /// Distance between two counts of its encoder, m.
    pub resolution_m: f64,
}

/// What was counted on a link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct LinkCounts {
    /// Samples taken.
    pub samples: u64,
    /// Samples that never came, or came after a newer one.
    pub lost: u64,
    /// Frames with a wrong CRC, or broken off.
    pub bad_crc: u64,
    /// Messages of another version, kind or length, or with impossible values.
    pub malformed: u64,
    /// Samples that were not newer than the newest.
    pub out_of_sequence: u64,
    /// Samples that came more than a period later than they should.
    pub late: u64,
    /// Commands that the link had no room for.
    pub not_sent: u64,
    /// Commands cut to the device's own force limit.
    pub clipped: u64,
    /// Connections made.
    pub connections: u64,
    /// Errors that the device reported.
    pub device_errors: u64,
}

/// The real-time thread, as `status` shows it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct RealTimeStatus {
    /// Its SCHED_FIFO priority, absent when it runs at an ordinary one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fifo_priority: Option<u8>,
    /// The processor that it is pinned to, absent when it is not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cpu: Option<usize>,
    /// Whether it is scheduled by SCHED_DEADLINE.
    #[serde(default)]
    pub deadline_scheduled: bool,
    /// Whether its memory is locked.
    pub memory_locked: bool,
    /// Whether the processors are kept from sleeping deeply.
    #[serde(default)]
    pub cpus_kept_awake: bool,
    /// How long before its deadline a tick wakes up to spin, us.
    #[serde(default)]
    pub spin_us: u64,
    /// Whether numbers below the normal range count as zero.
    #[serde(default)]
    pub denormals_flushed: bool,
    /// What it could not have, and how to get it.
    pub problems: Vec<Problem>,
}

impl RealTimeStatus {
    /// How it is scheduled, for people.
    #[must_use]
    pub fn scheduling(&self) -> String {
        match self.fifo_priority {
            Some(priority) => format!("SCHED_FIFO {priority}"),
            None if self.deadline_scheduled => "SCHED_DEADLINE".to_owned(),
            None => "ordinary priority".to_owned(),
        }
    }

    /// Where it runs, for people.
    #[must_use]
    pub fn place(&self) -> String {
        self.cpu
            .map_or_else(|| "not pinned".to_owned(), |cpu| format!("processor {cpu}"))
    }

    /// Whether its memory stays in place, for people.
    #[must_use]
    pub fn memory(&self) -> &'static str {
        if self.memory_locked {
            "memory locked"
        } else {
            "memory not locked"
        }
    }
}

/// Something that the real-time thread could not have.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Problem {
    /// What it is, and what the system said.
    pub what: String,
    /// How to get it.
    pub remedy: String,
}

/// Answer to `timing`, and the timing event: counts and percentiles since the loop began.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Timing {
    /// Nominal rate of the loop, Hz.
    pub rate_hz: f64,
    /// Since the loop began.
    #[serde(flatten)]
    pub since_start: TimingWindow,
    /// The same over the last ten seconds.
    pub last_10_s: TimingWindow,
    /// The link to the rig; absent where the rig is in the daemon itself.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link: Option<LinkStatus>,
}

/// How well the loop kept time over a while.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TimingWindow {
    /// Ticks done.
    pub ticks: u64,
    /// Ticks that took longer than their period.
    pub overruns: u64,
    /// Deadlines that passed without a tick.
    pub missed_periods: u64,
    /// Samples lost because the telemetry ring was full.
    pub telemetry_dropped: u64,
    /// How long after its deadline a tick began.
    pub wake_latency_ns: Percentiles,
    /// How long a tick took, the device's read and write included.
    pub tick_ns: Percentiles,
    /// How long the device's read and write took.
    pub device_round_trip_ns: Percentiles,
    /// Time from one tick to the next.
    pub period_ns: Percentiles,
    /// The same durations in buckets, each twice as wide as the one before.
    #[serde(default)]
    pub histogram: TimingHistogram,
}

/// Durations in buckets. The buckets follow one another; the first begins at 0.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TimingHistogram {
    /// How long after its deadline a tick began.
    pub wake_latency_ns: Vec<Bucket>,
    /// How long a tick took.
    pub tick_ns: Vec<Bucket>,
}

/// A bucket of a histogram.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Bucket {
    /// The durations in it are up to this, ns, and above that of the bucket before.
    pub up_to: u64,
    /// How many there were.
    pub count: u64,
}

/// Percentiles of a duration, ns.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Percentiles {
    /// Half are below.
    pub p50: u64,
    /// 99 % are below.
    pub p99: u64,
    /// 99.9 % are below.
    pub p999: u64,
    /// The largest.
    pub max: u64,
}

/// Answer to `subscribe`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SubscribeReply {
    /// What will be heard of.
    pub topics: Vec<Topic>,
    /// Samples a second: the rate asked for, or the nearest one that the loop's rate divides into.
    pub rate_hz: f64,
    /// Time between sample events, ms.
    pub batch_ms: u32,
    /// Names of a row's columns.
    pub columns: Vec<String>,
}

/// A line from the server.
#[derive(Clone, Debug, PartialEq)]
pub enum ServerLine {
    /// The greeting.
    Hello(Hello),
    /// The answer to a request; without `id` when the request's could not be read.
    Answer {
        /// Number of the request.
        id: Option<u64>,
        /// What it gave.
        result: Result<serde_json::Value, WireError>,
    },
    /// Something that was not asked for.
    Event(Event),
}

impl ServerLine {
    /// Reads a line.
    ///
    /// # Errors
    /// What is wrong with it.
    pub fn parse(line: &str) -> Result<Self, serde_json::Error> {
        #[derive(Deserialize)]
        struct Line {
            hello: Option<Hello>,
            id: Option<u64>,
            ok: Option<serde_json::Value>,
            error: Option<WireError>,
            event: Option<serde::de::IgnoredAny>,
        }
        let parsed: Line = serde_json::from_str(line)?;
        if parsed.event.is_some() {
            return Ok(Self::Event(serde_json::from_str(line)?));
        }
        match parsed {
            Line { hello: Some(hello), .. } => Ok(Self::Hello(hello)),
            Line {
                id, error: Some(error), ..
            } => Ok(Self::Answer { id, result: Err(error) }),
            Line {
                id, ok: Some(value), ..
            } => Ok(Self::Answer { id, result: Ok(value) }),
            _ => Err(serde::de::Error::custom(
                "a line from the server has one of hello, ok, error, event",
            )),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn requests_read_as_the_specification_shows_them() {
        let envelope = Envelope::parse(r#"{"id":7,"op":"set","params":{"mass":1.5,"Fs":{"positive":5,"negative":3}}}"#);
        let Ok(Envelope {
            id: 7,
            request: Request::Set { params },
        }) = envelope
        else {
            panic!("{envelope:?}");
        };
        assert_eq!(params.resolve().expect("known names").len(), 3);
        for op in OPERATIONS.split(", ") {
            let more = match op {
                "set" => r#","params":{}"#,
                "subscribe" => r#","topics":["samples"],"rate_hz":100"#,
                _ => "",
            };
            let line = format!(r#"{{"op":"{op}","id":1{more}}}"#);
            let envelope = Envelope::parse(&line).unwrap_or_else(|error| panic!("{line}: {error:?}"));
            let written = serde_json::to_string(&envelope).expect("writes");
            assert_eq!(Envelope::parse(&written).expect("reads"), envelope);
        }
    }

    #[test]
    fn every_bad_line_is_refused_by_its_own_code() {
        use ErrorCode::{BadJson, BadRequest, UnknownField, UnknownOp};
        for (line, id, code, part) in [
            ("not json", None, BadJson, "not JSON"),
            (r#"{"id":1,"op":"set","params":{"mass":NaN}}"#, None, BadJson, "NaN"),
            (
                r#"{"id":1,"op":"set","params":{"mass":1e999}}"#,
                Some(1),
                BadRequest,
                "out of range",
            ),
            (r#"{"id":1,"op":"get","colour":1}"#, Some(1), UnknownField, "colour"),
            (
                r#"{"id":1,"op":"set","params":{},"colour":1}"#,
                Some(1),
                UnknownField,
                "colour",
            ),
            (r#"{"id":1,"op":"dance"}"#, Some(1), UnknownOp, "dance"),
            (r#"{"id":1}"#, Some(1), BadRequest, "op"),
            (r#"{"op":"get"}"#, None, BadRequest, "id"),
            (r#"{"id":-1,"op":"get"}"#, None, BadRequest, "id = -1"),
            (r#"{"id":"a","op":"get"}"#, None, BadRequest, "id = \"a\""),
            (r#"{"id":1,"op":3}"#, Some(1), BadRequest, "op = 3"),
            (r#"{"id":1,"op":"set"}"#, Some(1), BadRequest, "params"),
            (
                r#"{"id":1,"op":"set","params":{"mass":"heavy"}}"#,
                Some(1),
                BadRequest,
                "mass",
            ),
            (r#"{"id":1,"op":"set","params":[1]}"#, Some(1), BadRequest, "params"),
            (
                r#"{"id":1,"op":"subscribe","topics":["weather"]}"#,
                Some(1),
                BadRequest,
                "weather",
            ),
            (r#"[1,2]"#, None, BadRequest, ""),
            ("", None, BadJson, ""),
        ] {
            let BadLine { id: got_id, error, .. } = Envelope::parse(line).expect_err(line);
            assert_eq!((got_id, error.code), (id, code), "{line}: {error}");
            assert!(error.message.contains(part), "{line}: {error} does not name {part}");
        }
    }

    #[test]
    fn a_stop_that_cannot_be_read_is_known_for_one() {
        for line in [
            r#"{"id":1,"op":"stop","why":"fire"}"#,
            r#"{"id":"x","op":"stop"}"#,
            r#"{"op":"stop"}"#,
        ] {
            assert!(Envelope::parse(line).expect_err(line).means_stop, "{line}");
        }
        assert!(
            !Envelope::parse(r#"{"id":1,"op":"engage","why":"stop"}"#)
                .expect_err("a field")
                .means_stop
        );
    }

    #[test]
    fn what_a_later_server_adds_is_passed_over() {
        let line = r#"{"event":"weather","wind":3}"#;
        assert_eq!(
            ServerLine::parse(line).expect("it reads"),
            ServerLine::Event(Event::Unknown)
        );
        let line = r#"{"id":1,"error":{"code":"brand_new","message":"no","hint":"later"}}"#;
        let ServerLine::Answer { result: Err(error), .. } = ServerLine::parse(line).expect("it reads") else {
            panic!("an error");
        };
        assert_eq!(error.code, ErrorCode::Unknown);
        let line = r#"{"id":1,"ok":{"state":"idle","tick":3,"more":1},"took_ns":5}"#;
        assert!(ServerLine::parse(line).is_ok());
    }

    #[test]
    fn a_parameter_given_twice_reaches_the_scene_twice() {
        let line = r#"{"id":1,"op":"set","params":{"Fs":5,"Fs":6}}"#;
        let Ok(Envelope {
            request: Request::Set { params },
            ..
        }) = Envelope::parse(line)
        else {
            panic!("it reads");
        };
        let refused = Scene::paper().with(&params.resolve().expect("known names"));
        assert!(refused.is_err_and(|error| error.to_string().contains("twice")));
    }

    proptest::proptest! {
        #[test]
        fn no_line_panics(line in ".{0,200}") {
            drop(Envelope::parse(&line));
            drop(ServerLine::parse(&line));
        }
    }
}
