//! `set`: change parameters.

use crate::change::{ChangeArguments, ChangeView};
use crate::complete;
use crate::daemon::Daemon;
use crate::failure::Failure;
use crate::{change, output, units};
use clap::Args;
use clap_complete::engine::ArgValueCompleter;
use haptic_core::parameters::TABLE;
use haptic_ipc::{ChangeReply, Changes, Request};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Parameters: `mass=500g Fs=5 Fd=3.5N b=2 DV=2mm/s`, one direction as `Fs+=5 Fs-=3`
    #[arg(required = true, value_name = "NAME=VALUE", add = ArgValueCompleter::new(complete::assignments))]
    changes: Vec<String>,

    #[command(flatten)]
    change: ChangeArguments,
}

impl Arguments {
    /// Reads the changes; the daemon checks them against the scene.
    pub(crate) fn request(&self) -> Result<Request, Failure> {
        let params: Changes = self
            .changes
            .iter()
            .map(|text| assignment(text))
            .collect::<Result<_, _>>()?;
        Ok(Request::Set {
            params,
            merge: false,
            options: self.change.options(),
        })
    }
}

pub(crate) fn assignment(text: &str) -> Result<(String, f64), Failure> {
    let Some((name, value)) = text.split_once('=') else {
        return Err(Failure::Usage(format!(
            "`{text}` is not a change: write NAME=VALUE, as in mass=1.5"
        )));
    };
    let name = name.trim();
    let value = units::value(name, value.trim()).map_err(Failure::Usage)?;
    Ok((name.to_owned(), value))
}

/// The parameters and units, for the help text.
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
                format!("{} .. {} {}", row.min, row.max, units::shown(row.unit)),
            ]
        })
        .collect();
    format!(
        "Parameters, by name or symbol (`haptic-ctl describe` says what each feels like):\n{}\n\n{}",
        output::table(&rows),
        units::help()
    )
}

pub(crate) async fn run(daemon: &mut Daemon, request: Request, json: bool) -> Result<(), Failure> {
    let reply: ChangeReply = daemon.ask(request).await?;
    change::show(&reply, ChangeView::Applied, json)
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
        assert_eq!(read("mass = 500 g"), Ok(("mass".into(), 0.5)));
        for bad in ["mass", "mass=", "mass=heavy", "mass=nan", "mass=inf"] {
            assert!(read(bad).is_err(), "{bad}");
        }
    }
}
