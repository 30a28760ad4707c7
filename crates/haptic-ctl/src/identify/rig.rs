//! `identify --rig`: measures the rig itself with its own motor, and has the daemon store it.

use super::session::IdentifySession;
use super::{excite, report};
use crate::console::Console;
use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::output;
use haptic_core::rig_friction::Cogging;
use haptic_lab::identify::cogging::at_speed;
use haptic_lab::identify::{Identified, Interval, rig_itself};
use serde::Serialize;

/// What was found of a rig.
#[derive(Debug, Serialize)]
struct Findings {
    rig: String,
    #[serde(flatten)]
    identified: Identified,
    cogging: Option<CoggingFinding>,
    /// Where the daemon keeps it.
    path: Option<String>,
}

#[derive(Debug, Serialize)]
struct CoggingFinding {
    #[serde(flatten)]
    cogging: Cogging,
    #[serde(rename = "amplitude_N")]
    amplitude_n: f64,
    #[serde(rename = "amplitude_interval_N")]
    amplitude_interval_n: Interval,
}

pub(super) async fn run(
    daemon: &mut Daemon,
    arguments: &excite::MotionArguments,
    absolute_position: bool,
    json: bool,
) -> Result<(), Failure> {
    let console = Console::new("identify --rig", arguments.yes)?;
    let mut session = IdentifySession::begin(daemon, console, arguments.range_m(), arguments.resets).await?;
    session.say("This measures the rig itself: nothing but the handle may be fixed to it.");
    let excited = arguments.excite(&mut session, true).await?;
    let ticks = std::mem::take(&mut session.ticks);
    let (resolution_m, period_s) = (session.begun.resolution_m, session.period_s);
    let longest_delay_s = session.longest_delay_s().await?;
    let measured = session
        .compute(move || {
            let record = ticks.record(excited.first_tick, excited.last_tick, resolution_m);
            let sweep = excited
                .sweep
                .map(|(from, to)| at_speed(&ticks.sweep(from, to), period_s));
            rig_itself::measure(&record, &sweep.unwrap_or_default(), longest_delay_s)
        })
        .await?;
    let mut measured = measured.map_err(|error| Failure::BadRig(error.to_string()))?;
    if let Some(found) = &mut measured.cogging {
        found.cogging.absolute_position = absolute_position;
    }
    let friction = measured.friction();
    let mut findings = Findings {
        rig: session.begun.rig.clone(),
        cogging: measured.cogging.map(|found| CoggingFinding {
            cogging: found.cogging,
            amplitude_n: found.amplitude_n,
            amplitude_interval_n: found.amplitude_interval_n,
        }),
        identified: measured.identified,
        path: None,
    };
    if let Some(friction) = friction {
        findings.path = session.store(friction).await?;
    }
    session.end().await?;
    if json {
        output::json(&findings)?;
    } else {
        output::line(&findings.table())?;
    }
    match friction {
        Some(_) => Ok(()),
        None => Err(Failure::BadRig(
            "mass, dynamic and viscous friction are needed to store what was found of the rig; nothing is stored"
                .to_owned(),
        )),
    }
}

impl Findings {
    fn table(&self) -> String {
        let found = &self.identified;
        let mut rows = report::rows(found);
        if let Some(cogging) = &self.cogging {
            let [least, most] = cogging.amplitude_interval_n;
            let row = |what: &str, value: String, unit: &str, interval| vec![what.into(), value, unit.into(), interval];
            rows.push(row(
                "cogging",
                format!("{:.4}", cogging.amplitude_n),
                "N",
                format!("{least:.4} to {most:.4}"),
            ));
            let period_mm = 1e3 * cogging.cogging.period_m;
            rows.push(row("cogging period", format!("{period_mm:.3}"), "mm", String::new()));
        }
        let heading = format!("{} itself, {}", self.rig, found.residual());
        let mut text = report::text(heading, &rows, found, report::MovedBy::OwnMotor);
        if let Some(path) = &self.path {
            text.push_str(&format!("\nkept in {path}"));
        }
        text
    }
}
