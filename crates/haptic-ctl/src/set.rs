//! `set`: change parameters.

use crate::change::ChangeArguments;
use crate::failure::Failure;
use crate::{complete, output, units};
use clap::Args;
use clap_complete::engine::ArgValueCompleter;
use haptic_core::ParameterKey;
use haptic_core::parameters::TABLE;
use haptic_ipc::{Changes, ParameterChange, RelativeChange, Request};

#[derive(Debug, Args)]
pub(crate) struct Arguments {
    /// Parameters, as in mass=500g DV=2mm/s; one direction: Fs+=5; a factor: mass*=2
    #[arg(required = true, value_name = "NAME=VALUE", add = ArgValueCompleter::new(complete::assignments))]
    changes: Vec<String>,

    /// Add to the scene's values, as in --by Fs=0.5
    #[arg(long)]
    by: bool,

    #[command(flatten)]
    pub(crate) change: ChangeArguments,
}

impl Arguments {
    /// Reads the changes; the daemon checks them against the scene.
    pub(crate) fn request(&self) -> Result<Request, Failure> {
        let params: Changes = self
            .changes
            .iter()
            .map(|text| change_of(text, self.by))
            .collect::<Result<_, _>>()?;
        Ok(Request::Set {
            params,
            merge: false,
            options: self.change.options(),
        })
    }
}

/// Reads a change: a new value, a factor as in `mass*=2`, or with `by` a summand.
fn change_of(text: &str, by: bool) -> Result<(String, ParameterChange), Failure> {
    let factor = text.split_once("*=").map(|(name, factor)| (name.trim(), factor.trim()));
    if let Some((name, factor)) = factor {
        let is_number = |factor: &f64| factor.is_finite();
        let factor = factor.parse().ok().filter(is_number).ok_or_else(|| {
            Failure::Usage(format!(
                "`{text}`: `{factor}` is not a factor: write a bare number, as in mass*=2"
            ))
        })?;
        return Ok((name.to_owned(), RelativeChange::Times(factor).into()));
    }
    let (name, value) = assignment(text)?;
    let bare = name.trim_end_matches(['+', '-']);
    let one_value = bare
        .parse::<ParameterKey>()
        .is_ok_and(|key| bare != name && key.direction.is_none() && !key.parameter.info().directional);
    if one_value {
        return Err(Failure::Usage(format!(
            "`{text}`: {bare} has no directions, and `{}=` sets one of two; to add write --by {bare}=VALUE",
            &name[bare.len()..]
        )));
    }
    let change = if by {
        RelativeChange::Plus(value).into()
    } else {
        value.into()
    };
    Ok((name, change))
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
        "Examples:\n  haptic-ctl set mass=500g Fs=5 --ramp 50ms\n  haptic-ctl set --by Fs=0.5\n\n\
         Parameters, by name or symbol (`haptic-ctl describe` says what each feels like):\n{}\n\n{}",
        output::table(&rows),
        units::help()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_is_a_value_a_factor_or_a_summand() {
        let read = |text: &str, by| change_of(text, by).map_err(|failure| failure.to_string());
        for (text, by, name, change) in [
            ("mass=1.5", false, "mass", 1.5.into()),
            ("mass = 500 g", false, "mass", 0.5.into()),
            ("Fs+=5", false, "Fs+", 5.0.into()),
            ("Fs-=-3e-1", false, "Fs-", (-0.3).into()),
            ("mass*=2", false, "mass", RelativeChange::Times(2.0).into()),
            ("Fs-*=0.5", true, "Fs-", RelativeChange::Times(0.5).into()),
            ("Fs=500mN", true, "Fs", RelativeChange::Plus(0.5).into()),
        ] {
            assert_eq!(read(text, by), Ok((name.to_owned(), change)), "{text}");
        }
        for (bad, part) in [
            ("mass+=1", "--by mass=VALUE"),
            ("mass*=2kg", "bare number"),
            ("mass*=inf", "bare number"),
            ("mass", "NAME=VALUE"),
            ("mass=", "not a finite number"),
            ("mass=nan", "not a finite number"),
        ] {
            let error = read(bad, false).expect_err(bad);
            assert!(error.contains(part), "{error} lacks {part}");
        }
    }
}
