//! Distributes the records of the ticks: to the timing histograms, the newest state, and the subscribers.

use crate::rt::outbox::{Answers, Consumer, TickRecord, TickSnapshot};
use crate::telemetry::excitation::ObservedExcitation;
use crate::telemetry::link;
use crate::telemetry::motion::HandleMotion;
use crate::telemetry::subscribers::{KnownScene, Subscribers};
use crate::telemetry::timing::TimingRecorder;
use device_io::link::LinkMonitor;
use haptic_ipc::{Event, LinkStatus, RigState, Sample, SampleY, ServoSetup, Timing, Topic};
use std::collections::VecDeque;
use std::time::{Duration, Instant};

/// Period at which the control thread processes telemetry.
pub(crate) const PUMP_PERIOD: Duration = Duration::from_millis(5);

/// The control end of the telemetry.
#[derive(Debug)]
pub(crate) struct Feed {
    consumer: Consumer,
    /// The motion of the handle, while a client has the rig to itself.
    pub(crate) motion: Option<HandleMotion>,
    /// The excitation that is under way.
    pub(crate) excitation: Option<ObservedExcitation>,
    /// The link to the rig, unless the rig is simulated in this process.
    link: Option<LinkMonitor>,
    pub(crate) timing: TimingRecorder,
    started_ns: u64,
    newest: Option<TickRecord>,
    /// What the newest record has of a second axis.
    newest_y: Option<SampleY>,
    /// Records that were taken and are not processed yet.
    taken: Vec<(TickRecord, Option<SampleY>)>,
    /// Snapshots whose ticks are not processed yet.
    snapshots: VecDeque<TickSnapshot>,
    /// Whether the loop has been asked for a snapshot that has not come.
    awaits_snapshot: bool,
    pub(crate) subscribers: Subscribers,
    /// State and revision of the newest record.
    last_state: Option<(RigState, u64)>,
    /// The first record of each state and revision since the last call of `update_subscribers`.
    changes: Vec<TickRecord>,
    /// Whether a record was lost from which on the servo has other settings.
    pub(crate) servo_is_doubtful: bool,
    timing_due: Instant,
    /// Records lost in the ring so far that subscribers know of.
    ring_dropped: u64,
}

impl Feed {
    pub(crate) fn new(consumer: Consumer, period_ns: u64, link: Option<LinkMonitor>) -> Self {
        Self {
            consumer,
            motion: None,
            excitation: None,
            link,
            timing: TimingRecorder::new(period_ns),
            started_ns: 0,
            newest: None,
            newest_y: None,
            taken: Vec::new(),
            snapshots: VecDeque::new(),
            awaits_snapshot: false,
            subscribers: Subscribers::default(),
            last_state: None,
            changes: Vec::new(),
            servo_is_doubtful: false,
            timing_due: Instant::now(),
            ring_dropped: 0,
        }
    }

    /// The timing of the loop and of its link.
    pub(crate) fn timing_report(&self) -> Timing {
        Timing {
            link: self.link(),
            ..self.timing.report()
        }
    }

    /// What the loop has answered, as far as it was taken.
    pub(crate) fn answers(&self) -> Answers {
        self.consumer.answers()
    }

    /// The status of the link to the rig, if there is one.
    pub(crate) fn link(&self) -> Option<LinkStatus> {
        self.link.as_ref().map(link::status)
    }

    /// The rig's state in the newest record; before the first one that of a rig which is waited for, or idle.
    pub(crate) fn state(&self) -> RigState {
        match self.newest() {
            Some(record) => record.state,
            None if self.link.is_some() => RigState::Disconnected,
            None => RigState::Idle,
        }
    }

    /// The newest record; `None` before the first.
    pub(crate) fn newest(&self) -> Option<&TickRecord> {
        self.newest.as_ref()
    }

    /// What the newest record has of a second axis; `None` on a rig of one.
    pub(crate) fn newest_y(&self) -> Option<SampleY> {
        self.newest_y
    }

    /// Time from the first tick to the newest, s.
    #[expect(clippy::cast_precision_loss, reason = "nanoseconds of a run are far below 2^53")]
    pub(crate) fn uptime_s(&self) -> f64 {
        self.newest
            .map_or(0.0, |record| (record.began_ns - self.started_ns) as f64 * 1e-9)
    }

    /// Takes the records and answers since the last call, and frees the scenes that were handed back.
    pub(crate) fn take_records(&mut self) {
        while let Some(record) = self.consumer.pop() {
            self.taken.push((record, self.consumer.y()));
        }
        // After the records: one that comes before a record that was taken is here, too.
        while let Some(snapshot) = self.consumer.pop_snapshot() {
            self.snapshots.push_back(snapshot);
            self.awaits_snapshot = false;
        }
        self.timing.stops.pump(self.consumer.answers());
    }

    /// Whether a subscriber waits for the state of the servo, and the loop was not asked for it.
    pub(crate) fn is_snapshot_due(&self) -> bool {
        !self.awaits_snapshot && self.subscribers.is_snapshot_due(Instant::now())
    }

    /// The loop has been asked for a snapshot.
    pub(crate) fn snapshot_asked(&mut self) {
        self.awaits_snapshot = true;
    }

    /// Processes the records that were taken, and sends the events that are due. `scenes` holds all scenes that these
    /// records may name; `servo` asks for the servo's settings, as far as they are known. Returns the first record
    /// of each state and revision.
    pub(crate) fn update_subscribers(
        &mut self,
        scenes: &VecDeque<KnownScene>,
        servo: impl Fn(&TickRecord) -> Option<ServoSetup>,
    ) -> Vec<TickRecord> {
        let mut taken = std::mem::take(&mut self.taken);
        for (record, y) in taken.drain(..) {
            self.newest_y = y;
            self.process(&record, scenes, &servo);
        }
        self.taken = taken;
        let changes = std::mem::take(&mut self.changes);
        if let Some(newest) = &self.newest {
            self.subscribers.announce(newest, scenes, true);
        }
        self.subscribers.announce_servo();
        let now = Instant::now();
        self.subscribers.flush_due(now);
        if now >= self.timing_due {
            self.timing_due = now + Duration::from_secs(1);
            self.subscribers
                .broadcast(Topic::Timing, || Event::Timing(Box::new(self.timing_report())));
        }
        changes
    }

    fn process(
        &mut self,
        record: &TickRecord,
        scenes: &VecDeque<KnownScene>,
        servo: &impl Fn(&TickRecord) -> Option<ServoSetup>,
    ) {
        if self.newest.is_none() {
            self.started_ns = record.began_ns;
        }
        self.timing.record(record);
        if let Some(motion) = &mut self.motion {
            motion.take(record, self.newest_y);
        }
        if let Some(excitation) = &mut self.excitation {
            excitation.take(record);
        }
        // The state before a row comes before all that changes with it.
        while let Some(snapshot) = self.snapshots.pop_front_if(|snapshot| snapshot.tick <= record.tick) {
            // The rows between are lost, where it is of an earlier one.
            if snapshot.tick == record.tick {
                self.subscribers.add_snapshot(&snapshot, scenes);
            }
        }
        // What a row is computed with is sent before the row: a stall of this thread may leave rows for
        // several events.
        let before = self.newest.replace(*record);
        let is_doubtful = std::mem::take(&mut self.servo_is_doubtful);
        if before.is_none_or(|before| is_doubtful || may_have_new_settings(&before, record))
            && let Some(servo) = servo(record)
        {
            self.subscribers.set_servo(record.tick, servo);
        }
        if before.is_some_and(|before| before.input_word.is_motion()) && !record.input_word.is_motion() {
            self.subscribers.need_snapshot();
        }
        let state = Some((record.state, record.revision));
        if self.last_state != state {
            self.last_state = state;
            self.changes.push(*record);
            self.subscribers.announce(record, scenes, false);
        }
        let lost = record.dropped - self.ring_dropped;
        self.ring_dropped = record.dropped;
        let sample = self.sample(record);
        self.subscribers.add_row(&sample, self.newest_y, lost);
    }

    #[expect(clippy::cast_precision_loss, reason = "nanoseconds of a run are far below 2^53")]
    fn sample(&self, record: &TickRecord) -> Sample {
        Sample {
            tick: record.tick,
            t_s: (record.began_ns - self.started_ns) as f64 * 1e-9,
            state: record.state,
            contact: record.contact,
            device_position_m: record.device_position,
            device_velocity_mps: record.device_velocity,
            block_position_m: record.block_position,
            block_velocity_mps: record.block_velocity,
            coupling_force_n: record.coupling_force,
            command_force_n: record.command_force,
            revision: record.revision,
            wake_latency_ns: record.began_ns.saturating_sub(record.deadline_ns),
            tick_ns: record.ended_ns.saturating_sub(record.began_ns),
            device_round_trip_ns: record.device_round_trip_ns,
            elapsed_ns: record.elapsed_ns,
            device_sequence: record.device_sequence,
            device_time_ns: record.device_time_ns,
            sample_position_m: record.sample_position,
            input_flags: record.input_word.flags,
            error_detail: record.input_word.detail,
        }
    }
}

/// Whether the servo may have other settings from a record on: the rig was engaged, its device answers again, or
/// other limits hold.
fn may_have_new_settings(before: &TickRecord, record: &TickRecord) -> bool {
    let answers = |record: &TickRecord| record.input_word.sample(0, 0, 0.0).is_ok();
    (record.state.is_live() && !before.state.is_live())
        || (answers(record) && !answers(before))
        || record.input_word.has_new_limits()
}

#[cfg(test)]
mod tests;
