//! `set`: change parameters.

use crate::failure::Failure;
use crate::{Daemon, output};
use clap::Args;
use haptic_core::ParameterKey;
use haptic_core::parameters::TABLE;
use haptic_ipc::{ChangeReply, Changes, Request};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// What to change: `mass=1.5 Fs=5 Fd=3.5 b=2 DV=0.002`, one direction as `Fs+=5 Fs-=3`; SI units
    #[arg(required = true, value_name = "NAME=VALUE")]
    changes: Vec<String>,
}

impl Arguments {
    /// Reads the changes; whether they fit the scene is for the daemon to say.
    pub(crate) fn changes(&self) -> Result<Changes, Failure> {
        self.changes.iter().map(|text| assignment(text)).collect()
    }
}

fn assignment(text: &str) -> Result<(String, f64), Failure> {
    let Some((name, value)) = text.split_once('=') else {
        return Err(Failure::Usage(format!(
            "`{text}` is no change: write NAME=VALUE, as in mass=1.5"
        )));
    };
    let (name, value) = (name.trim(), value.trim());
    match value.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok((name.to_owned(), number)),
        _ => Err(Failure::Usage(format!("{name} = `{value}` is not a finite number"))),
    }
}

/// The parameters, for the help text.
pub(crate) fn parameter_help() -> String {
    let rows: Vec<Vec<String>> = TABLE
        .iter()
        .map(|row| {
            let directions = if row.directional {
                format!(" {0}+ {0}-", row.symbol)
            } else {
                String::new()
            };
            vec![
                format!("  {}", row.name),
                format!("{}{directions}", row.symbol),
                format!("{} .. {} {}", row.min, row.max, row.unit),
            ]
        })
        .collect();
    format!(
        "Parameters, by name or symbol (`haptic-ctl describe` says what each feels like):\n{}",
        output::table(&rows)
    )
}

pub(crate) async fn run(daemon: &mut Daemon, params: Changes, json: bool) -> Result<(), Failure> {
    let reply: ChangeReply = daemon.ask(Request::set(params)).await?;
    if json {
        return output::json(&reply);
    }
    let applied: Vec<String> = reply
        .applied
        .iter()
        .map(|(name, value)| {
            let unit = name.parse::<ParameterKey>().map_or("", |key| key.parameter.info().unit);
            format!("{name} = {value} {unit}")
        })
        .collect();
    output::line(&format!(
        "revision {} from tick {}: {}",
        reply.revision,
        reply.tick.unwrap_or_default(),
        applied.join(", ")
    ))?;
    for advice in &reply.advice {
        output::line(&format!("note: {}", advice.message))?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn changes_are_read_with_their_directions() {
        let read = |text: &str| assignment(text).map_err(|failure| failure.to_string());
        assert_eq!(read("mass=1.5"), Ok(("mass".into(), 1.5)));
        assert_eq!(read("Fs+=5"), Ok(("Fs+".into(), 5.0)));
        assert_eq!(read("Fs-=-3e-1"), Ok(("Fs-".into(), -0.3)));
        for bad in ["mass", "mass=", "mass=heavy", "mass=nan", "mass=inf"] {
            assert!(read(bad).is_err(), "{bad}");
        }
    }
}
