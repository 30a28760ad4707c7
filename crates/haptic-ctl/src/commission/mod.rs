//! `commission`: finds out by small pulses whether a rig's motor pulls the right way, how far its
//! handle goes and how much it rubs, and has the daemon keep it.

mod console;
mod findings;

use crate::daemon::Daemon;
use crate::failure::Failure;
use console::Console;
use findings::{Findings, mm};
use haptic_ipc::{CommissionReply, LONGEST_COMMISSION_LEASE_MS, LeaseReply, PulseEnd, PulseReport, Request};
use std::time::{Duration, Instant};

/// For the help text.
pub(crate) const HELP: &str = "\
The rig must be idle. It is moved by pulses of at most 300 ms, 20 mm and 0.3 m/s, each within all limits of the daemon, and is released after each. No other client can engage it or \
change the scene meanwhile; everybody can stop it, which ends the commissioning, as does the end of this program. A handle that moves against the force ends it at once: the motor or \
the encoder is wired the other way, and nothing is kept.

What was found is kept by the daemon for this rig, by its serial number. A rig that was never commissioned, or has another resolution or direction than then, is \
engaged only with `hapticd --uncommissioned`.

Put the handle into the middle of its way, take your hand off it, and keep another on the switch of the motor's supply.";

/// The force with which it begins, as a share of the largest.
const FIRST_SHARE: f64 = 0.1;

/// Each pulse has so much more force than the one before, until the handle moves.
const GROWTH: f64 = 1.25;

/// Largest force unless another is named: this share of the rig's limit, and no more than so many
/// N.
const USUAL_SHARE: f64 = 0.1;
const USUAL_MOST_N: f64 = 2.0;

/// A pulse that shall move the handle for sure has so much of the force at which it first moved.
const SURELY: f64 = 1.5;

/// Pulses in each direction from which friction is averaged.
const FRICTION_PULSES: usize = 2;

/// A handle that goes no farther than that under a pulse has come to its end, m.
const AT_THE_END_M: f64 = 2e-4;

/// So many pulses in a row must find it there.
const TIMES_AT_THE_END: u32 = 2;

/// Pulses after which no end is looked for any more.
const MOST_PULSES_TO_AN_END: u32 = 80;

/// Between two looks whether a pulse has ended.
const LOOK: Duration = Duration::from_millis(20);

/// What a pulse may take beyond its two ramps.
const PATIENCE: Duration = Duration::from_secs(10);

#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Do not ask for confirmation before each step
    #[arg(long, short)]
    yes: bool,

    /// Largest force of a pulse, N, at most half of the force limit [default: a tenth of that, at
    /// most 2]
    #[arg(long, value_name = "N", allow_hyphen_values = true)]
    max_force_n: Option<f64>,

    /// Method of finding the range of the handle
    #[arg(long, value_name = "HOW", default_value = "pulses")]
    range: Range,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
enum Range {
    /// By pulses to either end
    Pulses,
    /// By a person, with the motor off
    ByHand,
    /// None
    Skip,
}

impl Arguments {
    pub(crate) fn requests() -> Vec<Request> {
        vec![
            Request::Lease {
                timeout_ms: LONGEST_COMMISSION_LEASE_MS,
            },
            Request::CommissionBegin {},
        ]
    }
}

pub(crate) async fn run(daemon: &mut Daemon, arguments: &Arguments, json: bool) -> Result<(), Failure> {
    if arguments.yes && arguments.range == Range::ByHand {
        return Err(Failure::Usage(
            "--range by-hand needs a person to say when the handle has been moved: leave --yes out".to_owned(),
        ));
    }
    let console = Console::new(arguments.yes)?;
    let _: LeaseReply = daemon
        .ask(Request::Lease {
            timeout_ms: LONGEST_COMMISSION_LEASE_MS,
        })
        .await?;
    let begun: CommissionReply = daemon.ask(Request::CommissionBegin {}).await?;
    let largest_n = arguments
        .max_force_n
        .unwrap_or_else(|| (USUAL_SHARE * begun.rig_force_limit_n).min(USUAL_MOST_N));
    // NaN is below nothing.
    if !(largest_n > 0.0 && largest_n <= begun.force_limit_n) {
        let limit_n = begun.force_limit_n;
        return Err(Failure::Usage(format!(
            "--max-force-n = {largest_n} N is out of range: it must be more than 0 and at most {limit_n} N, half of what this rig may give"
        )));
    }
    let mut work = Work {
        daemon,
        console,
        largest_n,
        ramp: Duration::from_secs_f64(begun.ramp_ms.max(0.0) * 1e-3),
        findings: Findings::new(&begun),
    };
    // However it ends, the rig is given back: with the connection, should this not be heard.
    let done = work.steps(arguments.range).await;
    if done.is_ok() {
        let _: CommissionReply = work.daemon.ask(Request::CommissionEnd {}).await?;
        let _: LeaseReply = work.daemon.ask(Request::Lease { timeout_ms: 0 }).await?;
    }
    done?;
    work.findings.show(json)
}

/// A commissioning under way.
struct Work<'a> {
    daemon: &'a mut Daemon,
    console: Console,
    /// Of a pulse, N.
    largest_n: f64,
    ramp: Duration,
    findings: Findings,
}

impl Work<'_> {
    async fn steps(&mut self, range: Range) -> Result<(), Failure> {
        self.console.say(&format!(
            "Commissioning {} ({}).\nPut the handle into the middle of its way and take your hand off it. A stop from anywhere ends this at once.",
            self.findings.rig, self.findings.firmware
        ));
        let largest_n = self.largest_n;
        self.agree(&format!(
            "1. Direction: pulses that grow up to {largest_n} N, until the handle moves. Go on?"
        ))
        .await?;
        self.directions().await?;
        let surely_n = [1.0, -1.0].map(|sign| self.surely_n(sign));
        self.agree(&format!(
            "2. Friction: {} pulses of {:.2} N and as many of -{:.2} N. Go on?",
            FRICTION_PULSES, surely_n[0], surely_n[1]
        ))
        .await?;
        self.friction().await?;
        match range {
            Range::Pulses => {
                self.agree("3. Range: pulses as before, to one end and then to the other. Go on?")
                    .await?;
                self.range_by_pulses().await?;
            }
            Range::ByHand => self.range_by_hand().await?,
            Range::Skip => {}
        }
        let found = self.status().await?;
        self.findings.step_m = found.step_m;
        self.findings.pulses = found.pulses;
        self.agree(&format!("Found:\n{}\nKeep this?", self.findings.table()))
            .await?;
        let stored: CommissionReply = self
            .daemon
            .ask(Request::CommissionStore {
                range_m: self.findings.range_m,
                friction_n: self.findings.mean_friction_n(),
            })
            .await?;
        self.findings.path = stored.path;
        Ok(())
    }

    /// Asks whether to go on.
    async fn agree(&mut self, question: &str) -> Result<(), Failure> {
        if self.console.asks() && !self.answer(question, "y/N").await? {
            self.console.say("Nothing is kept.");
            return Err(Failure::Interrupted);
        }
        Ok(())
    }

    /// Waits for a line, as long as the commissioning goes on; whether it says yes.
    async fn answer(&mut self, question: &str, choices: &str) -> Result<bool, Failure> {
        self.console.prompt(question, choices);
        // The lease goes on by what is said.
        let mut renewals = tokio::time::interval(Duration::from_millis(u64::from(LONGEST_COMMISSION_LEASE_MS) / 5));
        loop {
            tokio::select! {
                line = self.console.line() => {
                    let line = line.unwrap_or_default();
                    return Ok(choices.is_empty() || ["y", "yes"].contains(&line.trim().to_lowercase().as_str()));
                }
                _ = renewals.tick() => {}
            }
            self.status().await?;
        }
    }

    /// How it stands.
    async fn status(&mut self) -> Result<CommissionReply, Failure> {
        let status: CommissionReply = self.daemon.ask(Request::CommissionStatus {}).await?;
        match &status.ended {
            Some(why) => Err(Failure::BadRig(format!("the commissioning has ended: {why}"))),
            None => Ok(status),
        }
    }

    /// Gives a pulse, and waits until the rig is idle again.
    async fn pulse(&mut self, force_n: f64) -> Result<PulseReport, Failure> {
        // A machine that is held up for seconds may lose records; the pulse was none the worse for
        // it.
        for _ in 0..3 {
            let _: CommissionReply = self
                .daemon
                .ask(Request::CommissionPulse {
                    force_n,
                    duration_ms: None,
                })
                .await?;
            let began = Instant::now();
            let report = loop {
                tokio::time::sleep(LOOK).await;
                let status: CommissionReply = self.daemon.ask(Request::CommissionStatus {}).await?;
                if began.elapsed() > 2 * self.ramp + PATIENCE {
                    return Err(Failure::NoAnswer(began.elapsed()));
                }
                if status.pulsing {
                    continue;
                }
                if let Some(why) = status.ended {
                    if let Some(last) = status.last.filter(|last| last.end == PulseEnd::WrongWay) {
                        self.console.say(&told(&last));
                    }
                    return Err(Failure::BadRig(format!("the commissioning has ended: {why}")));
                }
                break status.last;
            };
            let Some(report) = report else {
                return Err(Failure::BadRig(
                    "the daemon does not say what came of the pulse".to_owned(),
                ));
            };
            if report.end != PulseEnd::Unrecorded {
                self.console.say(&told(&report));
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
                self.pulse(sign * force_n).await?;
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
                        "the handle did not move under {} N: is its motor supplied, and is the handle free and not at its end? --max-force-n allows up to {limit_n} N",
                        sign * force_n
                    )));
                }
                force_n = (force_n * GROWTH).min(self.largest_n);
            }
        }
        Ok(())
    }

    /// A force under which the handle moves for sure, N.
    fn surely_n(&self, sign: f64) -> f64 {
        let breakaway_n = self.findings.breakaway_n.of(sign);
        breakaway_n.map_or(self.largest_n, |force_n| (SURELY * force_n).min(self.largest_n))
    }

    async fn friction(&mut self) -> Result<(), Failure> {
        let mut found = [Vec::new(), Vec::new()];
        for _ in 0..FRICTION_PULSES {
            for (sign, found) in [1.0, -1.0].into_iter().zip(&mut found) {
                let report = self.pulse(sign * self.surely_n(sign)).await?;
                found.extend(report.friction_n);
            }
        }
        for (sign, found) in [1.0, -1.0].into_iter().zip(found) {
            *self.findings.friction_n.of_mut(sign) = findings::mean(&found);
        }
        Ok(())
    }

    async fn range_by_pulses(&mut self) -> Result<(), Failure> {
        for sign in [1.0, -1.0] {
            let (mut at_the_end, mut pulses) = (0, 0);
            while at_the_end < TIMES_AT_THE_END {
                if pulses == MOST_PULSES_TO_AN_END {
                    self.console.say("No end was found: the range stays unknown.");
                    return Ok(());
                }
                pulses += 1;
                let report = self.pulse(sign * self.surely_n(sign)).await?;
                at_the_end = if report.forward_m < AT_THE_END_M {
                    at_the_end + 1
                } else {
                    0
                };
            }
        }
        let found = self.status().await?;
        self.findings.range_m = Some(found.greatest_m - found.least_m);
        Ok(())
    }

    async fn range_by_hand(&mut self) -> Result<(), Failure> {
        let question = "3. Range: the motor is off. Move the handle from one end to the other, then press Enter.";
        self.answer(question, "").await?;
        let found = self.status().await?;
        self.findings.range_m = Some(found.greatest_m - found.least_m);
        Ok(())
    }
}

/// What came of a pulse, in a line.
fn told(report: &PulseReport) -> String {
    let end = match report.end {
        PulseEnd::Travel => ", as far as a pulse may",
        PulseEnd::Speed => ", as fast as a pulse may",
        PulseEnd::WrongWay => ", the wrong way",
        _ => "",
    };
    format!("   {:+.2} N: moved {:+.2} mm{end}", report.force_n, mm(report.moved_m))
}
