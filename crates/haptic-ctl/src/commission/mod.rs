//! `commission`: finds the direction of a rig's motor, the range of its handle and its friction by
//! small pulses, and has the daemon store them.

mod findings;

use crate::console::Console;
use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::output;
use findings::{Findings, Mass, mm};
use haptic_ipc::{
    AdviceReply, ClientError, CommissionReply, ErrorCode, LeaseReply, MAX_COMMISSION_LEASE_MS, PulseEnd, PulseReport,
    Request, RigState, SceneReply, StateReply, Status, UNKNOWN_MASS_KG, WireError,
};
use std::time::{Duration, Instant};

pub(crate) const HELP: &str = "\
Keep a hand on the motor's power switch.

The rig must be idle. The force of a pulse ends after 300 ms or 20 mm, or above 0.3 m/s, and the handle coasts on. A \
stop, the end of this program, or a handle that moves against the force ends the commissioning.

The findings are kept by the rig's serial number. A rig without one needs `commission --check` or `engage --same-rig` \
at each connection; a rig with other firmware, force limit, sample rate, watchdog or buttons, once. With another \
resolution or direction it must be commissioned again.";

/// Force of the first pulse, as a share of the largest.
const FIRST_SHARE: f64 = 0.1;

/// Factor from each pulse's force to the next, until the handle moves.
const GROWTH: f64 = 1.25;

/// Default of the largest force: this share of the rig's limit, and at most this force (N).
const DEFAULT_SHARE: f64 = 0.1;
const DEFAULT_MAX_N: f64 = 2.0;

/// Force of a pulse that surely moves the handle, as a multiple of the force that first moved it.
const SURE_FACTOR: f64 = 1.5;

/// Directions of the pulses for friction, which with the first that moved the handle show its direction: in no even
/// order, as a hand may move evenly.
const FRICTION_PULSES: [f64; 6] = [1.0, -1.0, -1.0, 1.0, -1.0, 1.0];

/// Most pulses in either direction for friction: some may meet an end of the range.
const MAX_FRICTION_PULSES: usize = 12;

/// Share of the range at either end where a pulse shows no friction: the end may have taken up its energy.
const END_SHARE: f64 = 0.05;

/// Force and duration of the push of a check, N and ms.
const CHECK_N: f64 = 1.0;
const CHECK_MS: f64 = 300.0;

/// Travel of a pulse below which the handle is at its end, m.
const AT_THE_END_M: f64 = 2e-4;

/// Pulses in a row that must find the handle at its end.
const TIMES_AT_THE_END: u32 = 2;

/// Most pulses towards an end.
const MAX_PULSES_TO_AN_END: u32 = 80;

/// Time between two polls of a pulse's end.
const POLL_PERIOD: Duration = Duration::from_millis(20);

/// Time between two requests while a person is asked: each renews the lease.
const RENEWAL_PERIOD: Duration = Duration::from_millis(MAX_COMMISSION_LEASE_MS as u64 / 5);

/// Timeout of a pulse beyond its two ramps.
const PULSE_TIMEOUT: Duration = Duration::from_secs(10);

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Do not ask for confirmation before each step
    #[arg(long, short)]
    yes: bool,

    /// Only check by a push each way (1 N, 0.3 s) that this is the rig
    #[arg(long, conflicts_with_all = ["max_force_n", "range"])]
    check: bool,

    /// The motor, 1 or 2, of a rig of two axes
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=2))]
    motor: Option<u32>,

    /// Largest force of a pulse, N, up to half the force limit [default: a tenth, at most 2]
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    max_force_n: Option<f64>,

    /// Method of finding the range of the handle, of one axis [default: pulses]
    #[arg(long, value_name = "METHOD", conflicts_with = "motor")]
    range: Option<Range>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Range {
    /// By pulses towards either end
    Pulses,
    /// By hand, with the motor off
    ByHand,
    /// Do not measure it
    Skip,
}

pub(crate) async fn run(daemon: &mut Daemon, arguments: &Arguments, json: bool) -> Result<(), Failure> {
    let range = arguments.range.unwrap_or(if arguments.motor.is_some() {
        Range::Skip
    } else {
        Range::Pulses
    });
    if arguments.yes && range == Range::ByHand {
        return Err(Failure::Usage(
            "--range by-hand needs a person to say when the handle has been moved: leave --yes out".to_owned(),
        ));
    }
    let console = Console::new("commission", arguments.yes)?;
    let begin = Request::CommissionBegin {
        motor: arguments.motor,
        check: arguments.check.then_some(true),
    };
    let begun: CommissionReply = daemon.begin_with_lease(begin).await?;
    if let Some(why) = begun.cannot_store.as_ref().filter(|_| !arguments.check) {
        let message = format!("nothing was moved, as what is found could not be stored: {why}");
        return Err(ClientError::Refused(WireError::new(ErrorCode::StateFile, message)).into());
    }
    let largest_n = if arguments.check {
        CHECK_N.min(begun.force_limit_n)
    } else {
        let default_n = (DEFAULT_SHARE * begun.rig_force_limit_n).min(DEFAULT_MAX_N);
        arguments.max_force_n.unwrap_or(default_n)
    };
    // NaN fails both comparisons.
    if !(largest_n > 0.0 && largest_n <= begun.force_limit_n) {
        let limit_n = begun.force_limit_n;
        return Err(Failure::Usage(format!(
            "--max-force-n = {largest_n} N is out of range: it must be more than 0 and at most {limit_n} N, half of \
             this rig's force limit"
        )));
    }
    let mut work = Work {
        daemon,
        console,
        largest_n,
        ramp: Duration::from_secs_f64(begun.ramp_ms.max(0.0) * 1e-3),
        slides: Vec::new(),
        findings: Findings::new(&begun),
    };
    // The end of the connection ends the commissioning, should these requests fail.
    let done = if arguments.check {
        work.check().await
    } else {
        work.steps(range).await
    };
    if done.is_ok() {
        work.end().await?;
    }
    done?;
    if arguments.check {
        return work.show_check(json);
    }
    work.findings.show(json)
}

struct Work<'a> {
    daemon: &'a mut Daemon,
    console: Console,
    /// Largest force of a pulse, N.
    largest_n: f64,
    ramp: Duration,
    slides: Vec<Slide>,
    findings: Findings,
}

/// What a pulse that surely moved the handle shows of its friction.
struct Slide {
    sign: f64,
    friction_n: f64,
    /// The mass, and by how much it may differ, kg.
    mass_within_kg: Option<(f64, f64)>,
    /// Where the handle came to rest, m.
    to_m: f64,
}

impl Work<'_> {
    async fn steps(&mut self, range: Range) -> Result<(), Failure> {
        self.console.say(&format!(
            "Commissioning {} ({}).\nMove the handle to the middle of its range and take your hand off it. Any stop \
             ends \
             this at once.",
            self.findings.rig, self.findings.firmware
        ));
        let largest_n = self.largest_n;
        self.agree(&format!(
            "1. Direction: pulses that grow up to {largest_n} N, until the handle moves. Go on?"
        ))
        .await?;
        self.directions().await?;
        let sure_force_n = [1.0, -1.0].map(|sign| self.sure_force_n(sign));
        self.agree(&format!(
            "2. Friction: {} pulses of {:.2} N and as many of -{:.2} N. Go on?",
            FRICTION_PULSES.len() / 2,
            sure_force_n[0],
            sure_force_n[1]
        ))
        .await?;
        self.friction_pulses().await?;
        match range {
            Range::Pulses => {
                self.agree(&format!(
                    "3. Range: such pulses to one end and then to the other, up to {MAX_PULSES_TO_AN_END} each way. Go \
                     on?"
                ))
                .await?;
                self.range_by_pulses().await?;
            }
            Range::ByHand => self.range_by_hand().await?,
            Range::Skip => {}
        }
        let found = self.status().await?;
        self.friction(&found);
        self.findings.step_m = found.step_m;
        self.findings.pulses = found.pulses;
        let status: Status = self.daemon.ask(Request::Status {}).await?;
        let identified = status.device.rig_friction.and_then(|friction| friction.identified);
        self.findings.identified_mass_kg = identified.map(|friction| friction.mass);
        self.agree(&format!("Found:\n{}\nKeep this?", self.findings.table()))
            .await?;
        let stored: CommissionReply = self
            .daemon
            .ask(Request::CommissionStore {
                range_m: self.findings.range_m,
                friction_n: self.findings.mean_friction_n(),
                mass_kg: self.findings.mass.map(|mass| mass.kg),
            })
            .await?;
        self.findings.path = stored.path;
        self.findings.coupling = stored.coupling;
        if stored.coupling.is_some() {
            // Its mass may be known otherwise than by these pulses.
            let advice: AdviceReply = self.daemon.ask(Request::Advise {}).await?;
            let is_unknown = advice.basis.is_some_and(|basis| basis.mass_kg.is_none());
            self.findings.coupling_masses_kg = is_unknown.then_some(UNKNOWN_MASS_KG);
        }
        Ok(())
    }

    /// Gives the rig back, and sees whether the active scene has the grip from then on.
    async fn end(&mut self) -> Result<(), Failure> {
        let before: SceneReply = self.daemon.ask(Request::Get { scene: None }).await?;
        let _: CommissionReply = self.daemon.ask(Request::CommissionEnd {}).await?;
        let after: SceneReply = self.daemon.ask(Request::Get { scene: None }).await?;
        let _: LeaseReply = self.daemon.ask(Request::Lease { timeout_ms: 0 }).await?;
        if after.revision != before.revision && after.scene.coupling == self.findings.coupling {
            self.findings.scene_revision = Some(after.revision);
        }
        Ok(())
    }

    /// Pushes until the handle has moved both ways; it may be at its end.
    async fn check(&mut self) -> Result<(), Failure> {
        let (rig, firmware) = (&self.findings.rig, &self.findings.firmware);
        let force_n = self.largest_n;
        let question = format!("Check {rig} ({firmware}): pushes of {force_n} N, with your hand off it. Go on?");
        self.agree(&question).await?;
        for sign in [1.0, -1.0, 1.0] {
            self.pulse(sign * force_n, Some(CHECK_MS)).await?;
            let status = self.status().await?;
            if status.positive_confirmed && status.negative_confirmed {
                self.daemon.ask::<StateReply>(Request::CommissionConfirm {}).await?;
                return Ok(());
            }
        }
        Err(Failure::BadRig(format!(
            "the handle did not move both ways from rest to rest under {force_n} N: is the motor supplied, and is the handle \
             free? If you see that it is the rig that was commissioned, `haptic-ctl engage --same-rig` takes your word for \
             it"
        )))
    }

    fn show_check(&self, json: bool) -> Result<(), Failure> {
        let (rig, firmware) = (&self.findings.rig, &self.findings.firmware);
        if json {
            return output::json(&serde_json::json!({ "rig": rig, "firmware": firmware }));
        }
        output::unless_quiet(&format!("{rig} ({firmware}) moves as it was commissioned"))
    }

    async fn agree(&mut self, question: &str) -> Result<(), Failure> {
        if self.console.asks() && !self.answer(question, "y/N").await? {
            self.console.say("Nothing is kept.");
            return Err(Failure::Interrupted);
        }
        Ok(())
    }

    /// Waits for a line while the commissioning is active; returns whether it says yes.
    async fn answer(&mut self, question: &str, choices: &str) -> Result<bool, Failure> {
        self.console.prompt(question, choices);
        loop {
            if let Some(yes) = self.console.answer(RENEWAL_PERIOD).await {
                return Ok(yes);
            }
            self.status().await?;
        }
    }

    async fn status(&mut self) -> Result<CommissionReply, Failure> {
        let status: CommissionReply = self.daemon.ask(Request::CommissionStatus {}).await?;
        match &status.ended {
            Some(why) => Err(self.ended(why).await),
            None => Ok(status),
        }
    }

    /// Why the commissioning has ended, and what to do where the rig takes no more commands.
    async fn ended(&mut self, why: &str) -> Failure {
        let state = self
            .daemon
            .ask::<Status>(Request::Status {})
            .await
            .map(|status| status.state);
        let remedy = match state {
            Ok(RigState::Stopped | RigState::Faulted) => "; run `haptic-ctl reset`, then commission again",
            _ => "",
        };
        Failure::BadRig(format!("the commissioning has ended: {why}{remedy}"))
    }

    /// Gives a pulse, of the daemon's duration where none (ms) is given, and waits until the rig is idle again.
    async fn pulse(&mut self, force_n: f64, duration_ms: Option<f64>) -> Result<PulseReport, Failure> {
        // A machine that is held up for seconds may lose records; the pulse itself was sound.
        for _ in 0..3 {
            let _: CommissionReply = self
                .daemon
                .ask(Request::CommissionPulse { force_n, duration_ms })
                .await?;
            let began = Instant::now();
            let report = loop {
                tokio::time::sleep(POLL_PERIOD).await;
                let status: CommissionReply = self.daemon.ask(Request::CommissionStatus {}).await?;
                if began.elapsed() > 2 * self.ramp + PULSE_TIMEOUT {
                    return Err(Failure::NoAnswer(began.elapsed()));
                }
                if status.pulsing {
                    continue;
                }
                if let Some(why) = status.ended {
                    if let Some(last) = status.last.filter(|last| last.end == PulseEnd::WrongWay) {
                        self.console.say(&summary(&last));
                    }
                    return Err(self.ended(&why).await);
                }
                break status.last;
            };
            let Some(report) = report else {
                return Err(Failure::BadRig("the daemon has no report of the pulse".to_owned()));
            };
            if report.end != PulseEnd::Unrecorded {
                self.console.say(&summary(&report));
                return Ok(report);
            }
        }
        Err(Failure::BadRig(
            "the daemon loses records of its ticks: `haptic-ctl timing` and `haptic-ctl doctor` may say why".to_owned(),
        ))
    }

    async fn directions(&mut self) -> Result<(), Failure> {
        for sign in [1.0, -1.0] {
            let mut force_n = FIRST_SHARE * self.largest_n;
            loop {
                self.pulse(sign * force_n, None).await?;
                let status = self.status().await?;
                let confirmed = if sign > 0.0 {
                    status.positive_confirmed
                } else {
                    status.negative_confirmed
                };
                if confirmed {
                    *self.findings.breakaway_n.of_mut(sign) = Some(force_n);
                    break;
                }
                if force_n >= self.largest_n {
                    let limit_n = status.force_limit_n;
                    return Err(Failure::BadRig(format!(
                        "the handle did not move under {:.2} N: is the motor supplied, and is the handle free and not at \
                         its end? --max-force-n allows up to {limit_n} N",
                        sign * force_n
                    )));
                }
                force_n = (force_n * GROWTH).min(self.largest_n);
            }
        }
        Ok(())
    }

    /// A force that surely moves the handle, N.
    fn sure_force_n(&self, sign: f64) -> f64 {
        let breakaway_n = self.findings.breakaway_n.of(sign);
        breakaway_n.map_or(self.largest_n, |force_n| (SURE_FACTOR * force_n).min(self.largest_n))
    }

    async fn sure_pulse(&mut self, sign: f64) -> Result<PulseReport, Failure> {
        let report = self.pulse(sign * self.sure_force_n(sign), None).await?;
        if let Some(friction_n) = report.friction_n {
            let to_m = self.status().await?.position_m;
            self.slides.push(Slide {
                sign,
                friction_n,
                mass_within_kg: report.mass_kg.zip(report.mass_within_kg),
                to_m,
            });
        }
        Ok(report)
    }

    async fn friction_pulses(&mut self) -> Result<(), Failure> {
        let mut moved = [0; 2];
        for sign in FRICTION_PULSES.into_iter().cycle().take(2 * MAX_FRICTION_PULSES) {
            let report = self.sure_pulse(sign).await?;
            moved[usize::from(sign < 0.0)] += usize::from(report.moved_m * sign >= AT_THE_END_M);
            if moved.iter().all(|times| *times >= FRICTION_PULSES.len() / 2) {
                break;
            }
        }
        Ok(())
    }

    /// The friction of all pulses that ended away from the ends of the range.
    fn friction(&mut self, found: &CommissionReply) {
        if let (Some(range_m), Some((least_m, greatest_m))) = (self.findings.range_m, ends(found)) {
            let margin_m = (END_SHARE * range_m).max(AT_THE_END_M);
            let inner = least_m + margin_m..=greatest_m - margin_m;
            self.slides.retain(|slide| inner.contains(&slide.to_m));
        }
        for sign in [1.0, -1.0] {
            let slides = self.slides.iter().filter(|slide| slide.sign * sign > 0.0);
            let friction_n: Vec<f64> = slides.map(|slide| slide.friction_n).collect();
            *self.findings.friction_n.of_mut(sign) = findings::mean(&friction_n);
        }
        let masses: Vec<_> = self.slides.iter().filter_map(|slide| slide.mass_within_kg).collect();
        self.findings.mass = Mass::of(&masses);
    }

    async fn range_by_pulses(&mut self) -> Result<(), Failure> {
        for sign in [1.0, -1.0] {
            let (mut at_the_end, mut pulses) = (0, 0);
            while at_the_end < TIMES_AT_THE_END {
                if pulses == MAX_PULSES_TO_AN_END {
                    self.console.say("No end was found: the range is unknown.");
                    return Ok(());
                }
                pulses += 1;
                let report = self.sure_pulse(sign).await?;
                at_the_end = if report.forward_m < AT_THE_END_M {
                    at_the_end + 1
                } else {
                    0
                };
            }
        }
        // Away from the end: that shows the friction also of a handle that was near the first end.
        self.sure_pulse(1.0).await?;
        self.take_range().await
    }

    async fn range_by_hand(&mut self) -> Result<(), Failure> {
        let question = "3. Range: the motor is off. Move the handle from one end to the other, then press Enter.";
        self.answer(question, "").await?;
        self.take_range().await
    }

    /// Takes the way between the ends where the handle was.
    async fn take_range(&mut self) -> Result<(), Failure> {
        let found = self.status().await?;
        self.findings.range_m = ends(&found).map(|(least_m, greatest_m)| greatest_m - least_m);
        Ok(())
    }
}

/// The ends between which the handle was, m, on a line.
fn ends(found: &CommissionReply) -> Option<(f64, f64)> {
    found.least_m.zip(found.greatest_m)
}

/// The report of a pulse in one line.
fn summary(report: &PulseReport) -> String {
    let end = match report.end {
        PulseEnd::Travel => ", to the limit of travel",
        PulseEnd::Speed => ", to the limit of speed",
        PulseEnd::WrongWay => ", the wrong way",
        _ => "",
    };
    format!("   {:+.2} N: moved {:+.2} mm{end}", report.force_n, mm(report.moved_m))
}
