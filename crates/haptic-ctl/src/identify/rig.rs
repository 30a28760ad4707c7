//! `identify --rig`: measures the rig itself with its own motor, and has the daemon store it.

use super::session::Session;
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
    let console = Console::new("identify --rig", !arguments.asks())?;
    let mut session = Session::begin(daemon, console, arguments.range_m(), arguments.resets()).await?;
    session.say("This measures the rig itself: nothing but the handle may be fixed to it.");
    let excited = arguments.excite(&mut session, true).await?;
    let ticks = std::mem::take(&mut session.ticks);
    let (resolution_m, period_s) = (session.begun.resolution_m, session.period_s);
    let measured = session
        .compute(move || {
            let record = ticks.record(excited.first_tick, excited.last_tick, resolution_m);
            let sweep = excited
                .sweep
                .map(|(from, to)| at_speed(&ticks.sweep(from, to), period_s));
            rig_itself::measure(&record, &sweep.unwrap_or_default())
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
    /// The values with their intervals, as columns.
    fn rows(&self) -> Vec<Vec<String>> {
        let found = &self.identified;
        let interval = |name: &str| {
            found
                .intervals
                .get(name)
                .map_or_else(String::new, |[least, most]| format!("{least:.4} to {most:.4}"))
        };
        let mut rows = vec![
            ["  quantity", "value", "unit", "95 % interval"]
                .map(str::to_owned)
                .to_vec(),
        ];
        let mut add = |name: &str, key: &str, unit: &str, value: Option<f64>| {
            if let Some(value) = value {
                rows.push(vec![
                    format!("  {name}"),
                    format!("{value:.4}"),
                    unit.to_owned(),
                    interval(key),
                ]);
            }
        };
        add("moving mass", "mass_kg", "kg", found.mass_kg);
        for (name, key, unit, value) in [
            ("dynamic friction", "dynamic_force_N", "N", found.dynamic_force_n),
            ("static friction", "static_force_N", "N", found.static_force_n),
            ("viscous friction", "viscous_Ns_per_m", "N s/m", found.viscous_ns_per_m),
        ] {
            let key_of = |direction: &str| format!("{key}.{direction}");
            add(
                &format!("{name} +"),
                &key_of("positive"),
                unit,
                value.map(|value| value.positive),
            );
            add(
                &format!("{name} -"),
                &key_of("negative"),
                unit,
                value.map(|value| value.negative),
            );
        }
        if let Some(cogging) = &self.cogging {
            let [least, most] = cogging.amplitude_interval_n;
            rows.push(vec![
                "  cogging".to_owned(),
                format!("{:.4}", cogging.amplitude_n),
                "N".to_owned(),
                format!("{least:.4} to {most:.4}"),
            ]);
            let period = vec![
                "  cogging period".to_owned(),
                format!("{:.3}", 1e3 * cogging.cogging.period_m),
                "mm".to_owned(),
            ];
            rows.push(period);
        }
        rows
    }

    fn table(&self) -> String {
        let found = &self.identified;
        let mut text = format!(
            "{} itself, residual {:.4} N rms\n{}",
            self.rig,
            found.residual_rms_n,
            output::table(&self.rows())
        );
        for (parameters, reason, instead) in report::refusals(found) {
            text.push_str(&format!("\nrefused: {parameters}: {reason}; record instead: {instead}"));
        }
        for note in &found.notes {
            text.push_str(&format!("\nnote: {note}"));
        }
        if let Some(path) = &self.path {
            text.push_str(&format!("\nkept in {path}"));
        }
        text
    }
}
