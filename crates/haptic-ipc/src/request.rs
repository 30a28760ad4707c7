//! The grammar of the protocol: each operation with its fields, their limits, and its answer.

use crate::changes::Changes;
use crate::error::WireError;
use crate::event::Topic;
use crate::fields::fields;
use crate::object::{Limits, Object};
use crate::refusal;
use crate::scene::SceneRef;
use crate::schedule::ScheduledChange;
use serde::Serialize;

/// How long a client with a lease may be silent, ms. Below, an ordinary program would lapse
/// whenever the machine is busy.
const LEASE: Limits = Limits {
    zero: Some("to end the lease"),
    ..Limits::new(20, 60_000)
};

/// Duration of a pulse, ms.
const PULSE: Limits = Limits::new(20, 300);

/// Motors of a rig of two axes.
const MOTOR: Limits = Limits::new(1, 2);

/// Time between sample events, ms.
const BATCH: Limits = Limits::new(1, 1000);

/// What can be found of a rig for a hand: m, N, kg.
const FOUND: Limits = Limits::new(0, 1000);

/// Writes the grammar down once: each operation with the fields that it needs, those that may be
/// left out, whether it takes [`ChangeOptions`], and its answer. From that come the type, its
/// serialisation and schema, the reading of a line and every refusal.
macro_rules! operations {
    ($(
        $(#[$doc:meta])*
        $variant:ident $op:literal {$(
            $(#[$needed_doc:meta])*
            $needed:ident $(as $needed_wire:literal)?: $needed_type:ty $(where $needed_limits:ident)?,
        )*}
        $(optional {$(
            $(#[$optional_doc:meta])*
            $optional:ident $(as $optional_wire:literal)?: $optional_type:ty $(where $optional_limits:ident)?,
        )*})?
        $(with $options:ident)?
        -> $answer:ty;
    )*) => {
        /// What a client asks.
        #[derive(Clone, Debug, PartialEq, Serialize)]
        #[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
        #[serde(tag = "op")]
        pub enum Request {$(
            $(#[$doc])*
            #[serde(rename = $op)]
            $variant {
                $(
                    $(#[$needed_doc])*
                    $(#[serde(rename = $needed_wire)])?
                    $(#[cfg_attr(
                        feature = "schema",
                        schemars(range(min = $needed_limits.smallest(), max = $needed_limits.max))
                    )])?
                    $needed: $needed_type,
                )*
                $($(
                    $(#[$optional_doc])*
                    $(#[serde(rename = $optional_wire)])?
                    $(#[cfg_attr(
                        feature = "schema",
                        schemars(range(min = $optional_limits.smallest(), max = $optional_limits.max))
                    )])?
                    #[serde(default, skip_serializing_if = "crate::fields::is_default")]
                    $optional: $optional_type,
                )*)?
                $(
                    /// How the scene changes.
                    #[serde(flatten)]
                    $options: ChangeOptions,
                )?
            },
        )*}

        impl Request {
            /// The names of the operations.
            pub(crate) const OPERATIONS: &[&str] = &[$($op),*];

            /// Reads the fields of an operation, which are those of its line but for `id` and `op`.
            pub(crate) fn read(op: &str, line: &Object<'_>) -> Result<Self, WireError> {
                match op {
                    $($op => {
                        let known: Vec<&str> = fields!(@names
                            {$($needed $(as $needed_wire)?,)*}
                            {$($($optional $(as $optional_wire)?,)*)?}
                            {$($options: ChangeOptions,)?}
                        );
                        line.no_field_but(op, &known)?;
                        Ok(fields!(@read op line [Self::$variant]
                            {$($needed $(as $needed_wire)? $(where $needed_limits)?,)*}
                            {$($($optional $(as $optional_wire)? $(where $optional_limits)?,)*)?}
                            {$($options: ChangeOptions,)?}
                        ))
                    })*
                    _ => Err(refusal::unknown_operation(op, Self::OPERATIONS)),
                }
            }

            /// What `ok` holds, by operation.
            #[cfg(feature = "schema")]
            pub(crate) fn answers(
                generator: &mut schemars::SchemaGenerator,
            ) -> serde_json::Map<String, serde_json::Value> {
                [$(($op.to_owned(), generator.subschema_for::<$answer>().into())),*].into_iter().collect()
            }
        }
    };
}

operations! {
    /// The parameter table.
    Describe "describe" {} -> crate::Description;
    /// A scene.
    Get "get" {} optional {
        /// Default: the active one.
        scene: Option<SceneRef>,
    } -> crate::SceneReply;
    /// Change parameters.
    Set "set" {
        /// The changes.
        params: Changes,
    } optional {
        /// Undo it with this client's previous change of the same parameters.
        merge: bool,
    } with options -> crate::ChangeReply;
    /// Load a whole scene.
    SceneLoad "scene.load" {
        /// The scene.
        scene: SceneRef,
    } with options -> crate::ChangeReply;
    /// Save a scene in the library. One changed from another scene there gets its name as title.
    SceneSave "scene.save" {
        /// Its name there.
        name: String,
    } optional {
        /// Default: the active one.
        scene: Option<SceneRef>,
        /// Replace a scene of this name.
        replace: bool,
    } -> crate::SceneSaveReply;
    /// Delete a saved scene from the library.
    SceneDelete "scene.delete" {
        /// Its name there.
        name: String,
    } -> crate::SceneSaveReply;
    /// Rename a saved scene in the library.
    SceneRename "scene.rename" {
        /// Its name there.
        name: String,
        /// Its new name.
        to: String,
    } optional {
        /// Replace a scene of the new name.
        replace: bool,
    } -> crate::SceneSaveReply;
    /// The scenes in the library.
    SceneList "scene.list" {} -> crate::SceneListReply;
    /// The differences of two scenes.
    SceneDiff "scene.diff" {
        /// The one.
        from: SceneRef,
    } optional {
        /// The other; default the active one.
        to: Option<SceneRef>,
    } -> crate::SceneDiffReply;
    /// Undo the newest change, of any client; without `at_tick`.
    Undo "undo" {} with options -> crate::ChangeReply;
    /// Redo the change that was undone last; without `at_tick`.
    Redo "redo" {} with options -> crate::ChangeReply;
    /// Change the scene in later ticks: all changes, or none.
    Schedule "schedule" {
        /// In order of their ticks.
        changes: Vec<ScheduledChange>,
    } optional {
        /// Its name; default the daemon's choice.
        name: Option<String>,
        /// Keep it when this client's connection or lease ends.
        keep: bool,
        /// Refuse unless this is the newest revision.
        if_revision: Option<u64>,
        /// Answer, but change nothing.
        dry_run: bool,
        /// Accept scenes that would chatter.
        anyway: bool,
    } -> crate::ScheduleReply;
    /// Cancel scheduled changes, of any client.
    ScheduleCancel "schedule.cancel" {} optional {
        /// This schedule and those after it; default all.
        name: Option<String>,
    } -> crate::ScheduleCancelReply;
    /// Ramp the force up.
    Engage "engage" {} optional {
        /// Accept a scene that would chatter.
        anyway: bool,
    } -> crate::StateReply;
    /// Ramp the force down.
    Release "release" {} -> crate::StateReply;
    /// Zero force at once.
    Stop "stop" {} -> crate::StateReply;
    /// Clear a stop or a fault.
    Reset "reset" {} -> crate::StateReply;
    /// The state of the rig and of the daemon.
    Status "status" {} -> crate::Status;
    /// How well the loop keeps time.
    Timing "timing" {} -> crate::Timing;
    /// Every check of the active scene against the rig.
    Advise "advise" {} -> crate::AdviceReply;
    /// The devices that are plugged in.
    Devices "devices" {} optional {
        /// Open and identify the device at this address, which resets many boards.
        probe: Option<String>,
    } -> crate::DevicesReply;
    /// Send events from now on.
    Subscribe "subscribe" {
        /// Topics of the subscription; an empty list ends it.
        topics: Vec<Topic>,
    } optional {
        /// Samples a second; default every tick.
        rate_hz: Option<f64>,
        /// Least time between sample events, ms; default 10. They come up to 5 ms later.
        batch_ms: Option<u32> where BATCH,
    } -> crate::SubscribeReply;
    /// The journal: who changed what, and when.
    Log "log" {} optional {
        /// Only entries after this number.
        after: Option<u64>,
        /// Number of entries, the newest; default 100.
        limit: Option<usize>,
    } -> crate::LogReply;
    /// Read the configuration's limits again, and check the library. Force flows on.
    Reload "reload" {} -> crate::ReloadReply;
    /// Release the rig should this client close its connection or fall silent.
    Lease "lease" {
        /// Longest silence, ms; 0 ends the lease.
        timeout_ms: u32 where LEASE,
    } -> crate::LeaseReply;
    /// Move the hand on the fake rig of `--hand mouse`.
    Hand "hand" {
        /// Target of its arm, m, from -1 to 1.
        target_m: f64,
    } -> crate::HandReply;
    /// The rig of two axes is in its home pose now.
    Home "home" {} -> crate::StateReply;
    /// Take the rig alone, to commission it.
    CommissionBegin "commission.begin" {} optional {
        /// Motor of a rig of two axes.
        motor: Option<u32> where MOTOR,
        /// Only for `commission.confirm`: refuse a rig that was not commissioned.
        check: Option<bool>,
    } -> crate::CommissionReply;
    /// Move the handle by a pulse of force.
    CommissionPulse "commission.pulse" {
        /// Force on the hand, N, positive in the positive direction.
        force_n as "force_N": f64,
    } optional {
        /// Duration, ms; default 200.
        duration_ms: Option<f64> where PULSE,
    } -> crate::CommissionReply;
    /// The findings so far.
    CommissionStatus "commission.status" {} -> crate::CommissionReply;
    /// Store the findings: the rig then counts as commissioned.
    CommissionStore "commission.store" {} optional {
        /// Travel of the handle between its ends, m.
        range_m: Option<f64> where FOUND,
        /// Friction of the rig itself, N.
        friction_n as "friction_N": Option<f64> where FOUND,
        /// Mass of the rig's moving part, kg.
        mass_kg: Option<f64> where FOUND,
    } -> crate::CommissionReply;
    /// Give the rig back.
    CommissionEnd "commission.end" {} -> crate::CommissionReply;
    /// Confirm that the connected device is the commissioned rig.
    CommissionConfirm "commission.confirm" {} -> crate::StateReply;
    /// Take the rig alone, to identify it.
    IdentifyBegin "identify.begin" {} optional {
        /// Travel of the handle between its ends, m; default as commissioned.
        range_m: Option<f64> where FOUND,
    } -> crate::IdentificationReply;
    /// Move the handle along a course.
    IdentifyExcite "identify.excite" {
        /// The course, and bounds outside of which the force ends at once.
        excitation: haptic_core::Excitation,
    } -> crate::IdentificationReply;
    /// The state of the identification.
    IdentifyStatus "identify.status" {} -> crate::IdentificationReply;
    /// Store what was identified of the rig itself.
    IdentifyStore "identify.store" {
        /// Its friction.
        friction: haptic_core::rig_friction::RigFriction,
    } -> crate::IdentificationReply;
    /// Give the rig back.
    IdentifyEnd "identify.end" {} -> crate::IdentificationReply;
}

impl Request {
    /// The active scene.
    #[must_use]
    pub const fn get() -> Self {
        Self::Get { scene: None }
    }

    /// A change of parameters, at once and whatever the revision.
    #[must_use]
    pub fn set(params: Changes) -> Self {
        Self::Set {
            params,
            merge: false,
            options: ChangeOptions::default(),
        }
    }

    /// Force, of a scene that is calm on the rig.
    #[must_use]
    pub const fn engage() -> Self {
        Self::Engage { anyway: false }
    }

    /// The rig alone, to commission it, or this motor of two axes.
    #[must_use]
    pub const fn commission(motor: Option<u32>) -> Self {
        Self::CommissionBegin { motor, check: None }
    }

    /// Events of these topics, samples of every tick.
    #[must_use]
    pub const fn subscribe(topics: Vec<Topic>) -> Self {
        Self::Subscribe {
            topics,
            rate_hz: None,
            batch_ms: None,
        }
    }

    /// A whole scene, at once and whatever the revision.
    #[must_use]
    pub fn load(scene: SceneRef) -> Self {
        Self::SceneLoad {
            scene,
            options: ChangeOptions::default(),
        }
    }

    /// The newest change taken back, at once and whatever the revision.
    #[must_use]
    pub fn undo() -> Self {
        Self::Undo {
            options: ChangeOptions::default(),
        }
    }

    /// What was undone brought back, at once and whatever the revision.
    #[must_use]
    pub fn redo() -> Self {
        Self::Redo {
            options: ChangeOptions::default(),
        }
    }

    /// The same request, for a scene that would chatter on the rig, too.
    #[must_use]
    pub fn anyway(mut self) -> Self {
        match &mut self {
            Self::Engage { anyway } | Self::Schedule { anyway, .. } => *anyway = true,
            Self::Set { options, .. }
            | Self::SceneLoad { options, .. }
            | Self::Undo { options }
            | Self::Redo { options } => options.anyway = true,
            _ => {}
        }
        self
    }

    /// Whether a watcher may ask it: it changes nothing, or makes the rig safer.
    #[must_use]
    pub const fn is_for_watchers(&self) -> bool {
        matches!(
            self,
            Self::Describe {}
                | Self::Get { .. }
                | Self::SceneList {}
                | Self::SceneDiff { .. }
                | Self::Log { .. }
                | Self::Stop {}
                | Self::Status {}
                | Self::Timing {}
                | Self::Advise {}
                | Self::Subscribe { .. }
                | Self::Devices { probe: None }
        )
    }
}

/// Ramps, ms.
pub(crate) const RAMP: Limits = Limits::new(0, 10_000);

fields! {
    /// How a scene changes.
    #[derive(Clone, Copy, Debug, Default, PartialEq)]
    pub struct ChangeOptions {} optional {
        /// Refuse unless this is the newest revision.
        if_revision: Option<u64>,
        /// Duration, ms; default 0.
        ramp_ms: Option<f64> where RAMP,
        /// Answer, but change nothing.
        dry_run: bool,
        /// First tick with it; default the next one.
        at_tick: Option<u64>,
        /// Accept a scene that would chatter.
        anyway: bool,
    }
}
