//! The motions of an identification, one after another, and what the person agrees to before.

use super::session::IdentifySession;
use crate::failure::Failure;
use haptic_core::{BoundError, Course, Excitation};
use haptic_ipc::{ExcitationEnd, ExcitationReport};
use haptic_lab::identify::plan::Bounds;
use std::path::PathBuf;

/// Share of its amplitude with which a chirp is repeated that the handle could not follow, and how
/// often.
const SMALLER: f64 = 0.5;
const REPETITIONS: i32 = 3;

/// Least motion of a handle under a chirp, as a share of what it was asked for.
const MIN_SHARE: f64 = 0.2;

#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Options of --run and --rig")]
pub(crate) struct MotionArguments {
    /// Do not ask for confirmation before the rig moves
    #[arg(long, short, conflicts_with = "file")]
    pub(super) yes: bool,

    /// Largest force on the handle, N, up to half the force limit [default: two fifths of that, or four times
    /// the friction found by commissioning]
    #[arg(long, value_name = "N", allow_hyphen_values = true, conflicts_with = "file")]
    max_force_n: Option<f64>,

    /// Travel of the handle to either side, mm [default: 20, or 80 % of the room]
    #[arg(long, value_name = "MM", allow_hyphen_values = true, conflicts_with = "file")]
    travel_mm: Option<f64>,

    /// Range of the handle, mm [default: as commissioned]
    #[arg(long, value_name = "MM", allow_hyphen_values = true, value_parser = range_mm, conflicts_with = "file")]
    range_mm: Option<f64>,

    /// Duration of the chirp, s
    #[arg(
        long,
        value_name = "S",
        default_value_t = 12.0,
        allow_hyphen_values = true,
        conflicts_with = "file"
    )]
    chirp_s: f64,

    /// Slow ramps to and fro, for the static limits
    #[arg(long, value_name = "N", default_value_t = 2, conflicts_with = "file")]
    ramps: u32,

    /// Retries after a timing fault, before asking
    #[arg(
        long,
        value_name = "N",
        default_value_t = 3,
        value_parser = clap::value_parser!(u32).range(..=100),
        conflicts_with = "file"
    )]
    pub(super) resets: u32,

    /// Keep every tick in this recording
    #[arg(long, value_name = "FILE", conflicts_with = "file")]
    record: Option<PathBuf>,

    /// Replace existing files
    #[arg(long)]
    pub(super) force: bool,
}

/// The ticks of all motions.
#[derive(Clone, Copy, Debug)]
pub(super) struct MotionTicks {
    pub(super) first_tick: u64,
    pub(super) last_tick: u64,
    /// The sweep for cogging, where one was asked for.
    pub(super) sweep: Option<(u64, u64)>,
}

impl MotionArguments {
    /// Range of the handle, m.
    pub(super) fn range_m(&self) -> Option<f64> {
        self.range_mm.map(|range_mm| 1e-3 * range_mm)
    }

    /// Asks the person, and moves the rig: for what is on it, or for the rig itself with a sweep.
    pub(super) async fn excite(&self, session: &mut IdentifySession<'_>, of_rig: bool) -> Result<MotionTicks, Failure> {
        let travel_m = self.travel_mm.map(|travel_mm| 1e-3 * travel_mm);
        let bounds = Bounds::new(&session.begun, self.max_force_n, travel_m);
        self.agree(session, &bounds, of_rig).await?;
        let notes = "haptic-ctl identify moved the rig: where bit 22 of input_flags is set, command_force_N drives the \
                     handle, and the block is the reference";
        session.listen(self.record.as_deref(), self.force, notes).await?;
        let chirp = self.chirp(session, &bounds).await?;
        let ramps = session.excite("ramps", bounds.ramps(self.ramps)).await?;
        let last = if of_rig {
            session.excite("sweep", bounds.sweep()).await?
        } else {
            let strokes = bounds.strokes(ramps.largest_force_n.abs());
            session.excite("strokes", strokes).await?
        };
        Ok(MotionTicks {
            first_tick: chirp.first_tick,
            last_tick: last.last_tick,
            sweep: of_rig.then_some((last.first_tick, last.last_tick)),
        })
    }

    /// Says what the motor will do, and asks whether it may.
    async fn agree(&self, session: &mut IdentifySession<'_>, bounds: &Bounds, of_rig: bool) -> Result<(), Failure> {
        let begun = session.begun.clone();
        let (last, third) = if of_rig {
            (bounds.sweep(), "a slow sweep over the travel")
        } else {
            (bounds.strokes(bounds.force_n), "small strokes before sliding")
        };
        let all = [bounds.chirp(self.chirp_s, 1.0), bounds.ramps(self.ramps), last];
        for excitation in &all {
            check(excitation, begun.force_limit_n, begun.travel_limit_m)?;
        }
        let greatest = |of: fn(&Excitation) -> f64| all.iter().map(of).fold(0.0, f64::max);
        let seconds: f64 = all.iter().map(Excitation::duration_s).sum();
        session.say(&format!(
            "Identifying {} ({}) by its own motor: a chirp of 0.5 to 3 Hz, slow ramps, and {third}.\nMove the handle \
             to the middle of its range of {:.0} mm and take your hand off it. `haptic-ctl stop`, Ctrl-C and the end \
             of this program end it at once.",
            begun.rig,
            begun.firmware,
            1e3 * begun.range_m
        ));
        if self.resets > 0 {
            session.say(&format!(
                "A busy computer may interrupt a motion: the motor lets go. Up to {} times such a motion is announced \
                 and repeated by itself, if the handle lies still and has room; else you are asked.",
                self.resets
            ));
        }
        session
            .agree(&format!(
                "The motor will move the handle for about {seconds:.0} s, with at most {:.2} N, at most {:.1} mm to \
                 either side and at most {:.2} m/s.",
                bounds.force_n,
                1e3 * greatest(|excitation| excitation.travel_limit_m),
                greatest(|excitation| excitation.speed_limit_mps),
            ))
            .await
    }

    /// A chirp that the handle follows.
    async fn chirp(&self, session: &mut IdentifySession<'_>, bounds: &Bounds) -> Result<ExcitationReport, Failure> {
        let mut first = None;
        for repetition in 0..REPETITIONS {
            let chirp = bounds.chirp(self.chirp_s, SMALLER.powi(repetition));
            let mut report = session.excite("chirp", chirp).await?;
            report.first_tick = *first.get_or_insert(report.first_tick);
            if report.end == ExcitationEnd::Time {
                let moved_m = report.greatest_m - report.least_m;
                if moved_m < MIN_SHARE * chirp.course.farthest_m() {
                    return Err(Failure::BadRig(format!(
                        "the handle hardly moved ({:.2} mm) under {:.2} N: is it free, held by nobody and not at its \
                         end? --max-force-n allows up to {} N",
                        1e3 * moved_m,
                        report.largest_force_n.abs(),
                        session.begun.force_limit_n
                    )));
                }
                return Ok(report);
            }
        }
        Err(Failure::BadRig(
            "the handle did not follow: is it free, and held by nobody? --max-force-n gives the motor more force"
                .to_owned(),
        ))
    }
}

/// What the daemon would refuse, under the name of its option.
fn check(excitation: &Excitation, most_n: f64, most_m: f64) -> Result<(), Failure> {
    // NaN is in no range.
    if !(haptic_core::excitation::MIN_FORCE_N..=most_n).contains(&excitation.force_limit_n) {
        return Err(Failure::Usage(format!(
            "--max-force-n = {} N is out of range: it must be more than 0 and at most {most_n} N, half of this \
             rig's force limit",
            excitation.force_limit_n
        )));
    }
    let farthest_m = excitation.course.farthest_m();
    if !(0.0..=most_m).contains(&farthest_m) {
        return Err(Failure::Usage(format!(
            "--travel-mm = {} mm is out of range: it must be more than 0 and at most {} mm, half of the handle's \
             range",
            1e3 * farthest_m,
            1e3 * most_m
        )));
    }
    excitation
        .check()
        .map_err(|error| Failure::Usage(out_of_range(excitation, &error)))
}

/// What is out of range, under the name of its option.
fn out_of_range(excitation: &Excitation, error: &BoundError) -> String {
    let BoundError { value, min, max, .. } = error;
    match (&excitation.course, error.field) {
        (Course::Chirp { .. }, "duration_s") => {
            format!("--chirp-s = {value} s is out of range: {min} to {max} s")
        }
        (Course::Sweep { .. }, "rounds") => format!("--ramps = {value} is out of range: {min} to {max}"),
        (Course::Sweep { rounds, .. }, "duration_s") if *rounds > 1 => {
            format!("--ramps = {rounds} is out of range: they would take {value:.0} s, and may take {max} s")
        }
        _ => error.to_string(),
    }
}

/// The range of a handle, mm.
fn range_mm(text: &str) -> Result<f64, String> {
    /// The largest that the daemon takes, mm.
    const MAX_MM: f64 = 1e6;
    text.parse()
        .ok()
        .filter(|range_mm: &f64| *range_mm > 0.0 && *range_mm <= MAX_MM)
        .ok_or_else(|| format!("it must be more than 0 and at most {MAX_MM} mm"))
}
