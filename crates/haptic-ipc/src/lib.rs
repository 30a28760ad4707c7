//! The control protocol of hapticd, version 1.
//!
//! What follows is `docs/control.md`, the specification.
#![doc = include_str!("../../../docs/control.md")]

mod advice;
mod async_client;
mod changes;
mod client;
mod command_line;
mod commission;
mod describe;
mod envelope;
mod error;
mod event;
mod fields;
mod identification;
mod journal;
mod line;
mod link;
mod mirror;
mod object;
mod parameter;
pub mod quantity;
mod refusal;
pub mod regular_file;
mod reload;
mod replay;
mod request;
mod rig_friction;
mod sample;
mod sample_y;
mod scene;
mod schedule;
#[cfg(feature = "schema")]
pub mod schema;
pub mod socket_path;
pub mod socket_permission;
mod status;
mod timing;
mod values;

pub use advice::{Advice, AdviceBasis, AdviceReply, Finding, WorstPlace};
pub use async_client::AsyncClient;
pub use changes::{Changes, ParameterChange, RelativeChange};
pub use client::{Client, ClientError, Receiver, Sender};
pub use command_line::{quoted, set_command};
pub use commission::{CommissionReply, MAX_COMMISSION_LEASE_MS, PulseEnd, PulseReport, UNKNOWN_MASS_KG};
pub use describe::{Description, ParameterDescription};
pub use envelope::{BadLine, Envelope};
pub use error::{ANYWAY, ErrorCode, WireError};
pub use event::{Event, SamplesEvent, ServoEvent, SnapshotEvent, StateEvent, SubscribeReply, Topic};
pub use identification::{ExcitationEnd, ExcitationReport, IdentificationReply};
pub use journal::{JournalEntry, LeaseReply, LogReply, Peer, StateChange};
pub use line::{Hello, Rights, ServerLine};
pub use link::{DevicesReply, FoundDevice, LinkCounts, LinkErrorStatus, LinkStatus, LinkedDevice, ProbedMotors};
pub use mirror::{DaemonMirror, MirrorChange, RigChange, RigMirror, SceneMirror, SceneShape};
pub use reload::{LimitsChange, ReloadReply};
pub use replay::{SceneArrival, SceneRamp, ServoSetup, ServoSnapshot, SnapshotScene};
pub use request::{ChangeOptions, Request};
pub use rig_friction::{LossSource, RigFrictionStatus};
pub use sample::{FIRST_SAMPLE_COLUMNS, SAMPLE_COLUMNS, Sample};
pub use sample_y::{SAMPLE_Y_COLUMNS, SampleY};
pub use scene::{
    BUILT_IN_SCENES, ChangeReply, Difference, ListedScene, SceneDiffReply, SceneListReply, SceneRef, SceneReply,
    SceneSaveReply, Value, differences, params_of,
};
pub use schedule::{
    AcceptedChange, MAX_SCHEDULED_CHANGES, SceneChange, ScheduleCancelReply, ScheduleReply, ScheduleStatus,
    ScheduledChange,
};
pub use status::{
    DeviceStatus, ForceLimitBy, HandReply, LibraryScene, Problem, RealTimeStatus, RigState, StateReply, Status,
};
pub use timing::{Bucket, Percentiles, StopTimes, Timing, TimingHistogram, TimingWindow};

/// The protocol version that this crate speaks.
pub const PROTOCOL_VERSION: u32 = 1;

/// Longest line accepted, bytes, without its newline.
pub const MAX_LINE_BYTES: usize = 64 * 1024;
