//! `advise`: checks the active scene against the rig, or reckons a scene's stick-slip.

use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::{complete, output, units};
use clap::Args;
use clap_complete::engine::ArgValueCompleter;
use haptic_ipc::{AdviceBasis, AdviceReply, Request, WorstPlace};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Scene: NAME, @REVISION or FILE.toml [default: active]
    #[arg(requires = "at_speed", add = ArgValueCompleter::new(complete::scenes))]
    pub(crate) scene: Option<String>,

    /// Compute the stick-slip of a hand at this speed, as in 5mm/s
    #[arg(long, value_name = "SPEED", value_parser = |text: &str| units::value_in("speed", text, "m/s"), allow_hyphen_values = true)]
    pub(crate) at_speed: Option<f64>,

    /// Find the stiffness, or the static force, for this frequency, as in 30Hz
    #[arg(long, value_name = "FREQUENCY", value_parser = |text: &str| units::value_in("frequency", text, "1/s"), requires = "at_speed", allow_hyphen_values = true)]
    pub(crate) for_frequency: Option<f64>,
}

pub(crate) async fn run(daemon: &mut Daemon, json: bool) -> Result<(), Failure> {
    let reply: AdviceReply = daemon.ask(Request::Advise {}).await?;
    if json {
        return output::json(&reply);
    }
    let mut rows = vec![output::row(["", "check", "value", "bound", "margin", "fix"])];
    let mut remarks = Vec::new();
    for advice in &reply.advice {
        let Some(finding) = &advice.finding else {
            remarks.push(format!("note: {}", advice.message));
            continue;
        };
        let number = |value: Option<f64>| value.map_or_else(|| "inf".to_owned(), output::figure);
        let with_unit = |value| format!("{} {}", number(value), finding.unit);
        rows.push(vec![
            if finding.passes { "ok" } else { "broken" }.to_owned(),
            finding.check.clone(),
            with_unit(finding.value),
            with_unit(finding.bound),
            number(finding.margin),
            finding.mending.map_or_else(String::new, |value| {
                format!("{} = {}", advice.param, output::figure(value))
            }),
        ]);
        if !finding.passes {
            remarks.push(format!("{}: {}", finding.check, advice.message));
        }
    }
    output::line(&output::table(&rows))?;
    if let Some(basis) = &reply.basis {
        output::line(&reckoned_with(basis))?;
    }
    for remark in remarks {
        output::line(&remark)?;
    }
    Ok(())
}

/// The facts of the rig that the advice is based on.
fn reckoned_with(basis: &AdviceBasis) -> String {
    let device = basis
        .sample_period_us
        .map_or_else(String::new, |us| format!(", a device at {:.0} Hz", 1e6 / us));
    let how = if basis.delay_measured {
        ""
    } else {
        ", assumed until it is measured"
    };
    let mass = basis.mass_kg.map_or_else(
        || "an unknown mass, taken as heavy".to_owned(),
        |mass| format!("{} kg{}", output::figure(mass), at(basis.mass_at)),
    );
    let compensated = basis.compensated_share.map_or_else(String::new, |share| {
        format!(", less {} of it that is compensated", output::figure(share))
    });
    format!(
        "assumed: a loop at {:.0} Hz{device}, {:.2} ms from a sample to its force{how}; of the rig itself {mass}, {} N s/m \
         ({}) and {} N ({}{}){compensated}, {} um a count{}",
        1e6 / basis.period_us,
        basis.delay_us * 1e-3,
        output::figure(basis.damping_ns_per_m),
        basis.damping_from,
        output::figure(basis.friction_n),
        basis.friction_from,
        at(basis.friction_at),
        output::figure(basis.resolution_m * 1e6),
        at(basis.resolution_at)
    )
}

/// Where that is on a rig of two axes.
fn at(place: Option<WorstPlace>) -> String {
    place.map_or_else(String::new, |place| format!(" {place}"))
}
