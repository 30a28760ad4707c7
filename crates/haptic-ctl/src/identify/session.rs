//! An identification under way: the rig to oneself, one excitation after another, and every tick.

use super::interruption::{HandleRange, PAUSE};
use super::ticks::Ticks;
use crate::console::Console;
use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::progress;
use crate::record::{self, RecordingUnderWay};
use haptic_core::Excitation;
use haptic_core::rig_friction::RigFriction;
use haptic_ipc::{
    AdviceReply, Event, ExcitationEnd, ExcitationReport, IdentificationReply, LeaseReply, MAX_COMMISSION_LEASE_MS,
    Request, RigState, Status, Topic,
};
use indicatif::ProgressBar;
use std::path::Path;
use std::time::{Duration, Instant};

/// Time between two polls of an excitation.
const POLL_PERIOD: Duration = Duration::from_millis(50);

/// Timeout of an excitation beyond its course and the two ramps.
const EXCITATION_TIMEOUT: Duration = Duration::from_secs(15);

/// Time that the ticks of an excitation may take to arrive after its end.
const TICKS_TIMEOUT: Duration = Duration::from_secs(5);

/// Time that a device gets after a fault before the rig is reset.
const SETTLING: Duration = Duration::from_secs(1);

/// Time that a device which was silent may take to come back.
const RETURN_TIMEOUT: Duration = Duration::from_secs(10);

/// Attempts at an excitation whose ticks are not all recorded: a machine may be held up for seconds.
const ATTEMPTS: usize = 3;

/// Least travel that a motion may have, m.
const MIN_TRAVEL_M: f64 = 1e-4;

pub(super) struct IdentifySession<'a> {
    daemon: &'a mut Daemon,
    console: Console,
    recorder: Option<RecordingUnderWay>,
    range_m: Option<f64>,
    /// Why the identification has ended, where that was a fault of the time: of the machine or of the link.
    time_fault: Option<String>,
    /// How often a motion that such a fault interrupted may still be repeated without asking.
    resets_left: u32,
    /// Where the person has agreed that the handle is moved.
    place: HandleRange,
    pub(super) begun: IdentificationReply,
    pub(super) ticks: Ticks,
    /// Nominal time between two ticks, s.
    pub(super) period_s: f64,
}

impl<'a> IdentifySession<'a> {
    /// Takes the rig alone; from here on the end of the connection ends it.
    pub(super) async fn begin(
        daemon: &'a mut Daemon,
        console: Console,
        range_m: Option<f64>,
        resets: u32,
    ) -> Result<Self, Failure> {
        let begun: IdentificationReply = daemon.begin_with_lease(Request::IdentifyBegin { range_m }).await?;
        Ok(Self {
            daemon,
            console,
            recorder: None,
            range_m,
            time_fault: None,
            resets_left: resets,
            place: place(&begun),
            begun,
            ticks: Ticks::default(),
            period_s: 1e-3,
        })
    }

    /// Hears every tick from here on, and keeps them in a file where one is given.
    pub(super) async fn listen(&mut self, file: Option<&Path>, replace: bool, notes: &str) -> Result<(), Failure> {
        let subscription = Request::Subscribe {
            topics: vec![Topic::State, Topic::Samples],
            rate_hz: None,
            batch_ms: Some(20),
        };
        let (status, metadata) = record::subscribe(self.daemon, subscription, Some(notes.to_owned())).await?;
        self.period_s = 1.0 / status.rate_hz;
        let Some(file) = file else { return Ok(()) };
        self.recorder = Some(RecordingUnderWay::create(file, &metadata, replace)?);
        Ok(())
    }

    /// From a command to its force, s, at most; none of a rig in the daemon.
    pub(super) async fn longest_delay_s(&mut self) -> Result<f64, Failure> {
        let status: Status = self.daemon.ask(Request::Status {}).await?;
        if status.device.link.is_none() {
            return Ok(0.0);
        }
        let advice: AdviceReply = self.daemon.ask(Request::Advise {}).await?;
        // A tick later the newest command is in the motor.
        Ok(advice.basis.map_or(0.0, |basis| 1e-6 * basis.delay_us) + self.period_s)
    }

    pub(super) fn say(&self, text: &str) {
        self.console.say(text);
    }

    /// Says what will be done, and asks whether to go on.
    pub(super) async fn agree(&mut self, plan: &str) -> Result<(), Failure> {
        if !self.console.asks() {
            self.console.say(plan);
            return Ok(());
        }
        if self.asked(&format!("{plan} Go on?")).await? {
            return Ok(());
        }
        self.console.say("Nothing was moved, nothing is kept.");
        Err(Failure::Interrupted)
    }

    /// Asks a question, and renews the lease meanwhile.
    async fn asked(&mut self, question: &str) -> Result<bool, Failure> {
        self.console.prompt(question, "y/N");
        loop {
            if let Some(yes) = self.console.answer(POLL_PERIOD).await {
                return Ok(yes);
            }
            self.hear_for(Duration::ZERO).await?;
            // After a fault there is no identification to ask for.
            if self.time_fault.is_none() {
                self.status().await?;
            }
        }
    }

    /// The state of the identification; every request renews the lease.
    pub(super) async fn status(&mut self) -> Result<IdentificationReply, Failure> {
        let status: IdentificationReply = self.daemon.ask(Request::IdentifyStatus {}).await?;
        match &status.ended {
            Some(why) if !status.moving => {
                let hint = hint(why);
                self.time_fault = (!hint.is_empty()).then(|| why.clone());
                Err(Failure::BadRig(format!("the identification has ended: {why}{hint}")))
            }
            _ => Ok(status),
        }
    }

    /// Moves the rig along a course, to its end or to the bound that it meets, and shows how far it
    /// is. A motion that a fault of the time interrupts is repeated after a reset.
    pub(super) async fn excite(&mut self, name: &str, excitation: Excitation) -> Result<ExcitationReport, Failure> {
        let mut attempts = 0;
        while attempts < ATTEMPTS {
            let (lost, before) = (self.ticks.lost(), self.ticks.newest());
            let report = match self.excite_once(name, excitation).await {
                Ok(report) => report,
                Err(failure) => {
                    self.resume(name, &excitation, failure).await?;
                    self.ticks.discard_after(before);
                    continue;
                }
            };
            let broken_off = report.end == ExcitationEnd::Interrupted;
            if !broken_off && report.end != ExcitationEnd::Unrecorded && self.ticks.lost() == lost {
                self.console.say(&summary(name, &report));
                return Ok(report);
            }
            let why = if broken_off { "broken off" } else { "ticks are missing" };
            self.console
                .say(&format!("   {name}: {why} after {:.1} s, once more", report.duration_s));
            self.ticks.discard_after(before);
            attempts += 1;
        }
        Err(Failure::BadRig(
            "the machine or the link does not keep time, or the daemon loses records of its ticks: `haptic-ctl timing` \
             and `haptic-ctl doctor` may say why"
                .to_owned(),
        ))
    }

    /// After a fault of the time the motor is off. Resets the rig and begins the identification again: by itself,
    /// as often as was agreed to and where the handle lies still in its place, else where the person agrees. Any other
    /// failure ends the identification.
    async fn resume(&mut self, name: &str, excitation: &Excitation, failure: Failure) -> Result<(), Failure> {
        let Some(why) = self.time_fault.clone() else {
            return Err(failure);
        };
        self.console
            .say(&format!("   {name}: interrupted, the motor is off: {why}"));
        let by_itself = self.repeats_by_itself(name, excitation).await?;
        if !by_itself {
            if !self.console.asks() {
                return Err(failure);
            }
            let question = format!(
                "Move the handle to the middle of its range and take your hand off it. Reset the rig and repeat the \
                 {name}?"
            );
            if !self.asked(&question).await? {
                return Err(failure);
            }
            // The person may have answered at once, and the device may still be silent.
            self.hear_for(SETTLING).await?;
        }
        let timeout_ms = MAX_COMMISSION_LEASE_MS;
        let _: LeaseReply = self.daemon.ask(Request::Lease { timeout_ms }).await?;
        let _: serde_json::Value = self.daemon.ask(Request::Reset {}).await?;
        let reset = Instant::now();
        while reset.elapsed() < RETURN_TIMEOUT && self.is_without_device().await? {
            self.hear_for(POLL_PERIOD).await?;
        }
        let range_m = self.range_m;
        self.begun = self.daemon.ask(Request::IdentifyBegin { range_m }).await?;
        if !by_itself {
            self.place = place(&self.begun);
        }
        self.time_fault = None;
        self.hear_for(POLL_PERIOD).await
    }

    /// Whether no device is connected now.
    async fn is_without_device(&mut self) -> Result<bool, Failure> {
        let status: Status = self.daemon.ask(Request::Status {}).await?;
        Ok(status.state == RigState::Disconnected)
    }

    /// Announces that a motion will be repeated, and waits so long that the person can end it; whether it may be.
    async fn repeats_by_itself(&mut self, name: &str, excitation: &Excitation) -> Result<bool, Failure> {
        if self.resets_left > 0 {
            self.console.say(&format!(
                "   In {} s the rig is reset and the {name} repeated, if the handle lies still; Ctrl-C ends it",
                PAUSE.as_secs()
            ));
            let before = self.ticks.newest();
            self.hear_for(PAUSE).await?;
            let needed_m = excitation.course.farthest_m();
            match self.place.allows(needed_m, self.ticks.after(before), self.period_s) {
                Ok(()) => {
                    self.resets_left -= 1;
                    return Ok(true);
                }
                Err(why) => self.console.say(&format!("   Not repeated by itself: {why}")),
            }
        }
        Ok(false)
    }

    async fn excite_once(&mut self, name: &str, mut excitation: Excitation) -> Result<ExcitationReport, Failure> {
        // The motion before may have left the handle beside the middle of its range.
        let status = self.status().await?;
        let allowed_m = status.travel_limit_m.min(self.place.left_from(status.position_m));
        if allowed_m < MIN_TRAVEL_M {
            return Err(Failure::BadRig(format!(
                "the handle lies {:.1} mm beside the middle of its range, and the {name} has no room: put it in the \
                 middle, and begin again",
                1e3 * self.place.beside(status.position_m)
            )));
        }
        excitation.travel_limit_m = excitation.travel_limit_m.min(allowed_m);
        let length = Duration::from_secs_f64(excitation.duration_s());
        let bar = progress::bar(Some(length), None);
        bar.set_message(name.to_owned());
        if let Err(failure) = self
            .daemon
            .ask::<IdentificationReply>(Request::IdentifyExcite { excitation })
            .await
        {
            // The rig may have faulted since it was asked.
            self.status().await?;
            return Err(failure);
        }
        let report = self.follow(length, &bar).await;
        bar.finish_and_clear();
        let report = report?;
        let Some(report) = report else {
            return Err(Failure::BadRig("the excitation never began".to_owned()));
        };
        let ended = Instant::now();
        while self.ticks.newest().is_none_or(|tick| tick < report.last_tick) && ended.elapsed() < TICKS_TIMEOUT {
            self.hear_for(POLL_PERIOD).await?;
        }
        Ok(report)
    }

    /// Shows how far an excitation of a duration is, until it has ended.
    async fn follow(&mut self, length: Duration, bar: &ProgressBar) -> Result<Option<ExcitationReport>, Failure> {
        let began = Instant::now();
        let ramps = Duration::from_secs_f64(2e-3 * self.begun.ramp_ms.max(0.0));
        loop {
            self.hear_for(POLL_PERIOD).await?;
            let status = self.status().await?;
            bar.set_position(progress::position(status.gone_s.unwrap_or_default()));
            if !status.moving {
                return Ok(status.last);
            }
            if began.elapsed() > length.mul_f64(1.2) + ramps + EXCITATION_TIMEOUT {
                return Err(Failure::NoAnswer(began.elapsed()));
            }
        }
    }

    /// Takes what the daemon reports, for a time.
    async fn hear_for(&mut self, time: Duration) -> Result<(), Failure> {
        let until = tokio::time::Instant::now() + time;
        loop {
            let event = tokio::select! {
                biased;
                event = self.daemon.next_event() => event?,
                () = tokio::time::sleep_until(until) => return Ok(()),
            };
            if let Event::Samples(samples) = &event {
                self.ticks.take(samples);
            }
            if let Some(recorder) = &mut self.recorder {
                recorder.event(&event);
                recorder.check().map_err(|error| cannot_write(&error))?;
            }
        }
    }

    /// Computes something while the lease is renewed.
    pub(super) async fn compute<T: Send + 'static>(
        &mut self,
        work: impl FnOnce() -> T + Send + 'static,
    ) -> Result<T, Failure> {
        let mut work = tokio::task::spawn_blocking(work);
        loop {
            tokio::select! {
                done = &mut work => return done.map_err(|error| Failure::BadRig(error.to_string())),
                () = tokio::time::sleep(POLL_PERIOD) => {}
            }
            self.hear_for(Duration::ZERO).await?;
            self.status().await?;
        }
    }

    /// Has the daemon store what was found of the rig itself; returns its file.
    pub(super) async fn store(&mut self, friction: RigFriction) -> Result<Option<String>, Failure> {
        let stored: IdentificationReply = self.daemon.ask(Request::IdentifyStore { friction }).await?;
        Ok(stored.path)
    }

    /// Gives the rig back, and ends the recording.
    pub(super) async fn end(mut self) -> Result<(), Failure> {
        let _: IdentificationReply = self.daemon.ask(Request::IdentifyEnd {}).await?;
        let _: LeaseReply = self.daemon.ask(Request::Lease { timeout_ms: 0 }).await?;
        if let Some(recorder) = self.recorder.take() {
            recorder.finish().await.map_err(|error| cannot_write(&error))?;
        }
        Ok(())
    }
}

/// What to do about a fault of the time.
fn hint(why: &str) -> &'static str {
    if [
        "control_lost",
        "device_clock",
        "stalled",
        "periods were missed",
        "no new sample",
        "watchdog",
    ]
    .iter()
    .any(|fault| why.contains(fault))
    {
        "; the machine or the link did not keep time: stop other work on this computer, or give the loop a processor \
         of its own (`haptic-ctl doctor` says how, `haptic-ctl timing` by how much it is late)"
    } else {
        ""
    }
}

/// Where the handle may be moved in an identification that has just begun.
fn place(begun: &IdentificationReply) -> HandleRange {
    HandleRange {
        middle_m: begun.middle_m,
        farthest_m: begun.travel_limit_m,
    }
}

fn cannot_write(error: &std::io::Error) -> Failure {
    Failure::File(format!("the recording: {error}"))
}

/// The report of an excitation in one line.
fn summary(name: &str, report: &ExcitationReport) -> String {
    let end = match report.end {
        ExcitationEnd::Travel => ", ended at the limit of travel",
        ExcitationEnd::Speed => ", ended at the limit of speed",
        ExcitationEnd::Lag => ", ended because the handle did not follow",
        _ => "",
    };
    format!(
        "   {name}: {:.1} s, over {:.2} mm, at most {:.2} N and {:.0} mm/s{end}",
        report.duration_s,
        1e3 * (report.greatest_m - report.least_m),
        report.largest_force_n.abs(),
        1e3 * report.largest_speed_mps
    )
}
