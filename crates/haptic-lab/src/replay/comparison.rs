//! What was computed against what was recorded.

use super::columns::{Value, first_column, is_same};
use super::error::{ReplayError, SkipReason};
use super::stepper::{StepResult, Stepping, stepper};
use crate::row::RecordedRow;
use haptic_core::planar::Plane;
use haptic_ipc::Sample;
use haptic_recording::{Entry, Mark, Metadata};
use serde::Serialize;
use std::collections::BTreeMap;

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
    stepper: Box<dyn Stepping>,
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
            stepper: stepper(metadata, None)?,
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
        if row.input_word().new_scene() {
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
            Entry::Row(sample, y) => self.row(&RecordedRow { sample: *sample, y: *y }),
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

    fn row(&mut self, row: &RecordedRow) -> Result<(), ReplayError> {
        self.ticks += 1;
        self.arrive(&row.sample);
        match self.stepper.row(row)? {
            StepResult::Unknown(reason) => self.uncompared.entry(reason).or_insert((0, row.sample.tick)).0 += 1,
            StepResult::Computed(computed) => {
                self.with_force += u64::from(row.command_force::<Plane>() != Plane::ZERO);
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

    fn difference(&self, row: &RecordedRow, computed: &RecordedRow) -> Option<Difference> {
        let (column, recorded, computed) = first_column(row, computed)?;
        Some(Difference {
            tick: row.sample.tick,
            t_s: row.sample.t_s,
            column,
            recorded,
            computed,
            likely: self.likely(&row.sample, column),
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
