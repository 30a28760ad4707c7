//! What was computed against what was recorded.

use super::error::{ReplayError, SkipReason};
use super::stepper::{StepResult, Stepper, is_same, word};
use haptic_ipc::{RigState, Sample};
use haptic_recording::{Entry, Mark, Metadata};
use serde::Serialize;
use std::collections::BTreeMap;

/// A value of a column.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(untagged)]
pub enum Value {
    /// A number, in the column's unit.
    Number(f64),
    /// A contact: 0 stuck, +1 and -1 sliding.
    Contact(i8),
    /// A state of the rig.
    State(RigState),
}

impl std::fmt::Display for Value {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(number) => number.fmt(f),
            Self::Contact(contact) => contact.fmt(f),
            Self::State(state) => state.fmt(f),
        }
    }
}

/// The first tick whose outputs are not those that were recorded.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Difference {
    /// The tick.
    pub tick: u64,
    /// Its time on the daemon's clock, s.
    pub t_s: f64,
    /// The first column that differs; causes come before their effects.
    pub column: &'static str,
    /// Its recorded value.
    pub recorded: Value,
    /// Its computed value.
    pub computed: Value,
    /// What may be the reason, as far as the recording shows.
    pub likely: String,
}

/// Rows that were not compared for one reason.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct SkippedTicks {
    /// The reason.
    pub reason: SkipReason,
    /// How many.
    pub ticks: u64,
    /// The first of them.
    pub first_tick: u64,
}

/// Result of a replay.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Report {
    /// Rows of the recording.
    pub ticks: u64,
    /// Rows that differ from what was computed.
    pub differing: u64,
    /// The first of them.
    pub first_differing: Option<Difference>,
    /// Rows whose outputs do not follow from the recording.
    pub not_compared: u64,
    /// The same by reason.
    pub uncompared: Vec<SkippedTicks>,
    /// Rows with force that were compared.
    pub with_force: u64,
}

impl Report {
    /// Takes in the report of a later part.
    pub(super) fn append(&mut self, later: Self) {
        self.ticks += later.ticks;
        self.differing += later.differing;
        self.not_compared += later.not_compared;
        self.with_force += later.with_force;
        self.first_differing = self.first_differing.take().or(later.first_differing);
        for one in later.uncompared {
            match self.uncompared.iter_mut().find(|known| known.reason == one.reason) {
                Some(known) => known.ticks += one.ticks,
                None => self.uncompared.push(one),
            }
        }
        self.uncompared.sort_by_key(|one| one.reason);
    }

    /// Rows that were compared.
    #[must_use]
    pub const fn compared(&self) -> u64 {
        self.ticks - self.not_compared
    }

    /// Whether something was compared, and all of it is the same.
    #[must_use]
    pub const fn is_exact(&self) -> bool {
        self.differing == 0 && self.compared() > 0
    }
}

/// Compares a recording's rows, one after another.
#[derive(Debug)]
pub struct Comparison {
    stepper: Stepper,
    server: String,
    ticks: u64,
    with_force: u64,
    differing: u64,
    first_differing: Option<Difference>,
    uncompared: BTreeMap<SkipReason, (u64, u64)>,
    /// Rows that are missing so far.
    lost: u64,
    /// The last scene that arrived: its tick and revision.
    arrived: Option<(u64, u64)>,
}

impl Comparison {
    /// Begins a comparison.
    ///
    /// # Errors
    /// The recording cannot be replayed.
    pub fn new(metadata: &Metadata) -> Result<Self, ReplayError> {
        Ok(Self {
            stepper: Stepper::exact(metadata)?,
            server: metadata.server.clone(),
            ticks: 0,
            with_force: 0,
            differing: 0,
            first_differing: None,
            uncompared: BTreeMap::new(),
            lost: 0,
            arrived: None,
        })
    }

    /// One that begins where this one has come to, and knows what holds there but not the servo's state.
    pub(super) fn begin(&self) -> Self {
        Self {
            stepper: self.stepper.begin_anew(),
            server: self.server.clone(),
            ticks: 0,
            with_force: 0,
            differing: 0,
            first_differing: None,
            uncompared: BTreeMap::new(),
            ..*self
        }
    }

    /// Passes over an entry, which another one compares.
    pub(super) fn follow(&mut self, entry: &Entry) {
        match entry {
            Entry::Row(row, _) => self.arrive(row),
            Entry::Mark(mark) => {
                self.lose(mark);
                self.stepper.follow(mark);
            }
        }
    }

    fn arrive(&mut self, row: &Sample) {
        if word(row).new_scene() {
            self.arrived = Some((row.tick, row.revision));
        }
    }

    fn lose(&mut self, mark: &Mark) {
        if let Mark::Lost { rows } = mark {
            self.lost += rows;
        }
    }

    /// Takes the next entry.
    ///
    /// # Errors
    /// A scene cannot be rendered.
    pub fn entry(&mut self, entry: &Entry) -> Result<(), ReplayError> {
        match entry {
            Entry::Row(row, _) => self.row(row),
            Entry::Mark(mark) => {
                self.lose(mark);
                self.stepper.mark(mark)
            }
        }
    }

    /// What has been found.
    #[must_use]
    pub fn report(self) -> Report {
        let uncompared = self.uncompared.into_iter();
        let uncompared: Vec<SkippedTicks> = uncompared
            .map(|(reason, (ticks, first_tick))| SkippedTicks {
                reason,
                ticks,
                first_tick,
            })
            .collect();
        Report {
            ticks: self.ticks,
            differing: self.differing,
            first_differing: self.first_differing,
            not_compared: uncompared.iter().map(|one| one.ticks).sum(),
            uncompared,
            with_force: self.with_force,
        }
    }

    fn row(&mut self, row: &Sample) -> Result<(), ReplayError> {
        self.ticks += 1;
        self.arrive(row);
        match self.stepper.row(row)? {
            StepResult::Unknown(reason) => self.uncompared.entry(reason).or_insert((0, row.tick)).0 += 1,
            StepResult::Computed(computed) => {
                self.with_force += u64::from(row.command_force_n != 0.0);
                if !is_same(row, &computed) {
                    self.differing += 1;
                    if self.first_differing.is_none() {
                        self.first_differing = self.difference(row, &computed);
                    }
                }
            }
        }
        Ok(())
    }

    fn difference(&self, row: &Sample, computed: &Sample) -> Option<Difference> {
        let (column, recorded, computed) = first_column(row, computed)?;
        Some(Difference {
            tick: row.tick,
            t_s: row.t_s,
            column,
            recorded,
            computed,
            likely: self.likely(row, column),
        })
    }

    /// What may be the reason for a difference in a column.
    fn likely(&self, row: &Sample, column: &str) -> String {
        let this = format!("hapticd {}", env!("CARGO_PKG_VERSION"));
        let build = if self.server == this {
            format!("the recording is by another build of {this}, or a row was changed after it was recorded")
        } else {
            format!("the recording is by {}, and this is {this}", self.server)
        };
        let place = match self.arrived {
            _ if column.starts_with("device_") => "it begins with the estimate of the hand's motion".to_owned(),
            _ if column == "state" => "it begins with a decision of the servo".to_owned(),
            Some((tick, revision)) => {
                let law = self.stepper.scenes().law(revision).unwrap_or("an unknown law");
                let ticks = row.tick.saturating_sub(tick);
                format!("it begins {ticks} ticks after revision {revision} ({law}) arrived")
            }
            None => {
                let law = self.stepper.scenes().law(row.revision).unwrap_or("an unknown law");
                format!("it begins in revision {} ({law})", row.revision)
            }
        };
        let lost = if self.lost > 0 {
            format!("; {} rows were lost before", self.lost)
        } else {
            String::new()
        };
        format!("{place}; {build}{lost}")
    }
}

/// The first column that differs, with both values: causes come before their effects.
fn first_column(recorded: &Sample, computed: &Sample) -> Option<(&'static str, Value, Value)> {
    let number = |name, of: fn(&Sample) -> f64| {
        let (recorded, computed) = (of(recorded), of(computed));
        (recorded.to_bits() != computed.to_bits()).then_some((name, Value::Number(recorded), Value::Number(computed)))
    };
    number("device_position_m", |row| row.device_position_m)
        .or_else(|| number("device_velocity_mps", |row| row.device_velocity_mps))
        .or_else(|| {
            let states = (Value::State(recorded.state), Value::State(computed.state));
            (recorded.state != computed.state).then_some(("state", states.0, states.1))
        })
        .or_else(|| number("block_position_m", |row| row.block_position_m))
        .or_else(|| number("block_velocity_mps", |row| row.block_velocity_mps))
        .or_else(|| {
            let contacts = (Value::Contact(recorded.contact), Value::Contact(computed.contact));
            (recorded.contact != computed.contact).then_some(("contact", contacts.0, contacts.1))
        })
        .or_else(|| number("coupling_force_N", |row| row.coupling_force_n))
        .or_else(|| number("command_force_N", |row| row.command_force_n))
}
