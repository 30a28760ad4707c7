//! The control protocol of hapticd, version 1. This page is its specification.
//!
//! # Transport
//! A Unix stream socket ([`socket_path`] says where). Both sides send JSON objects, one a line,
//! ended by `\n`, at most [`MAX_LINE_BYTES`] long. `nc -N -U`, `jq` or ten lines of Python are
//! enough to talk to it.
//!
//! # Conversation
//! The server speaks first, with its [`Hello`]:
//!
//! ```text
//! S {"hello":{"protocol":1,"server":"hapticd 0.1.0","session":"4321-7"}}
//! ```
//!
//! Then the client asks, with an `id` of its choice (a whole number) and an operation, and each
//! request is answered once, by a line with the same `id` that holds either `ok` or `error`:
//!
//! ```text
//! C {"id":7,"op":"set","params":{"mass":1.5,"Fs":5}}
//! S {"id":7,"ok":{"revision":42,"tick":183042,"applied":{"mass":1.5,"static_force":5.0},"advice":[]}}
//! C {"id":8,"op":"set","params":{"mass":-1}}
//! S {"id":8,"error":{"code":"out_of_range","message":"mass = -1 kg is out of range:
//! ...","param":"mass","value":-1.0,"min":1e-6,"max":100.0,"unit":"kg"}}
//! ```
//!
//! A client may send further requests before it has the answers; requests are answered in order. A
//! `stop` acts as soon as it is read, ahead of up to 64 requests of the same client that wait (or
//! 256 KiB of them), and even if a field of it is wrong. A line that cannot be read is answered
//! with an error whose `id` is that of the line, or `null` where none could be found, and the
//! conversation goes on.
//!
//! # Operations
//! | `op` | fields | `ok` holds | done when |
//! |---|---|---|---|
//! | `describe` | | [`Description`]: the parameter table and the columns of a sample | |
//! | `get` | `scene` \[default: active\] | [`SceneReply`]: a scene | |
//! | `set` | `params`: names or symbols to numbers; `merge`; [`ChangeOptions`] | [`ChangeReply`] | the tick that applied all of it |
//! | `scene.load` | `scene`; [`ChangeOptions`] | [`ChangeReply`] | the tick that applied all of it |
//! | `undo`, `redo` | [`ChangeOptions`] | [`ChangeReply`] | the tick that applied all of it |
//! | `scene.save` | `name`; `scene` \[default: active\]; `replace` | [`SceneSaveReply`] | the file is written |
//! | `scene.list` | | [`SceneListReply`]: the library | |
//! | `scene.diff` | `from`; `to` \[default: active\] | [`SceneDiffReply`] | |
//! | `engage` | | [`StateReply`]: `engaging` or `engaged` | the tick that began the ramp |
//! | `release` | | [`StateReply`]: `releasing` or `idle` | the tick that began the ramp |
//! | `stop` | | [`StateReply`]: `stopped` or `faulted` | the tick whose zero force the device has taken; `no_device` without a device |
//! | `reset` | | [`StateReply`]: `idle`, or the state as it was where nothing was stopped or faulted | the tick that cleared the stop or fault |
//! | `status` | | [`Status`] | |
//! | `timing` | | [`Timing`] | |
//! | `advise` | | [`AdviceReply`]: every check of the scene against the rig | |
//! | `devices` | `probe`: an address, which is opened and identified | [`DevicesReply`] | with `probe`, up to 3 s later |
//! | `subscribe` | `topics`, `rate_hz`, `batch_ms` | [`SubscribeReply`] | |
//! | `log` | `after`, `limit` | [`LogReply`]: who changed what, and when | |
//! | `lease` | `timeout_ms` | [`LeaseReply`] | |
//! | `commission.begin` | | [`CommissionReply`] | |
//! | `commission.pulse` | `force_N`; `duration_ms` | [`CommissionReply`] | the pulse has begun; `commission.status` has its report |
//! | `commission.status` | | [`CommissionReply`] | |
//! | `commission.store` | `range_m`, `friction_N` | [`CommissionReply`] | the file is written |
//! | `commission.end` | | [`CommissionReply`] | |
//! | `identify.begin` | `range_m` | [`IdentificationReply`] | |
//! | `identify.excite` | `excitation` | [`IdentificationReply`] | it has begun; `identify.status` has its report |
//! | `identify.status` | | [`IdentificationReply`] | |
//! | `identify.store` | `friction` | [`IdentificationReply`] | the file is written |
//! | `identify.end` | | [`IdentificationReply`] | |
//!
//! In `params` a parameter goes by its name or its symbol; `Fs+` and `Fs-` (and likewise for every
//! parameter that is `directional`) set one direction. A `scene` is a number (an earlier revision),
//! a string (a name in the library) or an object (the scene itself, as its file holds it).
//!
//! ## How a scene changes
//! `set`, `scene.load`, `undo` and `redo` are all-or-nothing. A change lands between two ticks,
//! keeps the block's motion and leaves the force on the hand as it was. All four take
//! [`ChangeOptions`]:
//!
//! - `if_revision`: refuse with `conflict` unless this is the newest revision, so that no client
//!   undoes the work of another unawares;
//! - `ramp_ms`, from 0 to 10000: ramp to the change over this time. Parameters of one law move in
//!   small steps, each a change as above; between laws, the force fades from one to the other. A
//!   newer change begins where the ramp is;
//! - `dry_run`: answer with the changes and the advice, or the refusal, and change nothing.
//!
//! A client may send one `set` after another without waiting: each is answered with the tick that
//! first rendered it *or a newer one*.
//!
//! Every change gets the next revision. `undo` and `redo` get one as well, and go through the
//! changes of all clients alike. Setting the current value is a no-op: the answer has the current
//! revision and no `changes`. A change after an `undo` ends what `redo` could bring back. A `set`
//! with `merge` is undone together with the change before it, if that was the same client's and of
//! the same parameters, so that a slider that was dragged goes back in one step.
//!
//! ## Lease
//! A client with a lease is a dead man's switch: should it close its connection, or send no line
//! for `timeout_ms` (20 to 60000), the real-time thread itself releases the rig along its ramp. Any
//! request renews the lease, `lease` with 0 ends it. Every client may have one; the first to expire
//! releases. An `engage` that was still waiting when the lease of its client expired is refused.
//!
//! ## Commissioning
//! A rig that was never commissioned does not engage ([`ErrorCode::NotCommissioned`]), unless the
//! daemon was started with `--uncommissioned`: the direction of its motor is unknown. To commission
//! it, a client takes a lease of at most [`LONGEST_COMMISSION_LEASE_MS`] and asks for
//! `commission.begin`, with the rig idle. Until `commission.end` no client engages the rig or
//! changes the scene (`commissioning`, which says who commissions); every client may release and
//! stop it. A stop ends the commissioning, as does the end of the lease or of the connection.
//!
//! `commission.pulse` engages the rig without a scene, gives one pulse of force with smooth edges,
//! within all limits of the loop, and releases it again; the scene is then as it was. It is
//! answered when it has begun; ask `commission.status` until `pulsing` is false: `last` then has
//! the [`PulseReport`]. A pulse takes at most 300 ms, and half of the force limit. Its force ends
//! at once when the handle has moved 20 mm, is faster than 0.3 m/s, or moves against the force:
//! then the commissioning is over, and nothing of it can be stored.
//!
//! `commission.store` keeps what was found for this rig, by its serial number, once a positive and
//! a negative pulse have each moved the handle in their direction. `range_m` and `friction_N` are
//! kept as given.
//!
//! ## Identification
//! `identify.begin` takes a commissioned rig alone as `commission.begin` does, under the same lease,
//! and ends for the same reasons; `commissioning` in `status` names the client. The handle must be
//! in the middle of its range, which the commissioning has found or `range_m` says.
//!
//! `identify.excite` engages the rig without a scene and draws the handle along a course by a
//! virtual spring and damper ([`Excitation`](haptic_core::Excitation)): at most half of the force
//! limit, inside the range, at most 120 s. It is answered when it has begun; ask `identify.status`
//! until `moving` is false: `last` then has the [`ExcitationReport`]. Its force ends at once when
//! the handle goes beyond the bounds; when it goes against the force from the beginning on, the
//! identification is over. A client that subscribes to `samples` has every tick of it: there
//! `command_force_N` drives the handle, the block is the reference, and bit 22 of `input_flags` is
//! set.
//!
//! `identify.store` keeps what was identified of the rig itself, by its serial number.
//!
//! # Events
//! After `subscribe` the server sends lines without `id`, each with the name of its topic in
//! `event`:
//!
//! ```text
//! S {"event":"state","state":"engaged","tick":183042,"revision":42,...}         at once, and at every change
//! S {"event":"servo","tick":190000,"servo":{"settings":{...},...}}              topic `state`: the servo's settings, when they change
//! S {"event":"timing","rate_hz":1000.0,"ticks":183042,"overruns":0,...}         once a second
//! S {"event":"samples","seq":9,"dropped":0,"rows":[[183042,183.042,"engaged",...],...]}
//! S {"event":"log","seq":12,"op":"set","by":{"uid":1000,"user":"ada",...},...}  at every change, by anyone
//! ```
//!
//! `samples` holds rows of numbers in the order of [`SAMPLE_COLUMNS`], thinned to `rate_hz` (every
//! tick without it) and sent every `batch_ms`. `seq` counts the sample events of the subscription;
//! `dropped` says how many rows were lost since the event before because the client, or the
//! telemetry thread, was too slow. A client that reads nothing for two seconds is disconnected. A
//! second `subscribe` replaces the first; an empty list of topics ends it.
//!
//! # Errors
//! Every error has a `code` ([`ErrorCode`]) and a `message` for people that names the field, the
//! value, the limit and the unit; the same facts stand in `param`, `value`, `min`, `max` and `unit`
//! where they apply.
//!
//! # Compatibility
//! Additions (operations, fields in answers, columns at the end of a row, error codes) keep the
//! version. A client must ignore fields that it does not know. The server refuses fields that it
//! does not know, so that a misspelt field is never silently without effect.
//!
//! # For machines
//! `docs/control-protocol.schema.json` is a JSON Schema of all lines, generated from these types.
//!
//! # A socket for watchers
//! The daemon may have a second socket, whose clients may read everything and `stop`
//! ([`Request::is_for_watchers`]); all else is refused with `read_only`. The greeting says so by
//! `"rights":"watch"`.
//!
//! # Limits
//! 32 clients on either socket. While all places are taken further clients may `stop`, and nothing
//! else (`"rights":"stop"`).

mod advice;
mod async_client;
mod built_in_scenes;
mod change_options;
mod changes;
mod client;
mod commission;
mod describe;
mod envelope;
mod error;
mod event;
mod identification;
mod journal;
mod line;
mod link;
mod object;
mod parameter;
mod problem;
pub mod quantity;
mod refusal;
pub mod regular_file;
mod replay;
mod request;
mod rig_friction;
mod sample;
mod scene;
mod schedule;
#[cfg(feature = "schema")]
pub mod schema;
pub mod socket_path;
mod state;
mod status;
mod timing;
mod unknown_word;
mod values;

pub use advice::{Advice, AdviceBasis, AdviceReply, Finding};
pub use async_client::AsyncClient;
pub use built_in_scenes::BUILT_IN_SCENES;
pub use change_options::ChangeOptions;
pub use changes::{Changes, ParameterChange, RelativeChange};
pub use client::{Client, ClientError, Receiver, Sender};
pub use commission::{CommissionReply, LONGEST_COMMISSION_LEASE_MS, PulseEnd, PulseReport};
pub use describe::{Description, ParameterDescription};
pub use envelope::{BadLine, Envelope};
pub use error::{ErrorCode, WireError};
pub use event::{Event, SamplesEvent, ServoEvent, StateEvent, SubscribeReply, Topic};
pub use identification::{ExcitationEnd, ExcitationReport, IdentificationReply};
pub use journal::{JournalEntry, LeaseReply, LogReply, Peer, StateChange};
pub use line::{Hello, Rights, ServerLine};
pub use link::{DevicesReply, FoundDevice, LinkCounts, LinkErrorStatus, LinkStatus, LinkedDevice};
pub use problem::Problem;
pub use replay::{SceneArrival, SceneRamp, ServoSetup};
pub use request::Request;
pub use rig_friction::{LossSource, RigFrictionStatus};
pub use sample::{FIRST_SAMPLE_COLUMNS, SAMPLE_COLUMNS, Sample};
pub use scene::{
    ChangeReply, Difference, ListedScene, SceneDiffReply, SceneListReply, SceneRef, SceneReply, SceneSaveReply, Value,
    differences, params_of,
};
pub use schedule::{
    AcceptedChange, MOST_SCHEDULED_CHANGES, SceneChange, ScheduleCancelReply, ScheduleReply, ScheduleStatus,
    ScheduledChange,
};
pub use state::{RigState, StateReply};
pub use status::{DeviceStatus, ForceLimitBy, LibraryScene, RealTimeStatus, Status};
pub use timing::{Bucket, Percentiles, StopTimes, Timing, TimingHistogram, TimingWindow};
pub use unknown_word::{meant_in, meant_or_semicolon};

/// The protocol version that this crate speaks.
pub const PROTOCOL_VERSION: u32 = 1;

/// Longest line accepted, bytes, without its newline.
pub const MAX_LINE_BYTES: usize = 64 * 1024;
