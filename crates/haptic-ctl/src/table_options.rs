//! How a table of another program is read, by options.

use crate::units::one_of;
use haptic_motion::table::{Columns, TableOptions};

/// The units of times, each in s.
const TIME_UNITS: [(&str, f64); 5] = [("s", 1.0), ("ms", 1e-3), ("us", 1e-6), ("ns", 1e-9), ("min", 60.0)];

/// Columns and units of a table of motion. The argument with the id `file` names it.
#[derive(Debug, clap::Args)]
#[command(next_help_heading = "Options of the table")]
pub(crate) struct Arguments {
    /// Column of times; without headings its number, from 1 [default: t_s, time, ...]
    #[arg(long, value_name = "NAME", requires = "file")]
    time_column: Option<String>,

    /// Unit of the time column [default: as its name ends, else s]
    #[arg(long, value_parser = one_of(TIME_UNITS), requires = "file")]
    time_unit: Option<f64>,

    /// Column of positions [default: block_position_m, position_m, device_position_m, ...]
    #[arg(long, value_name = "NAME", requires = "file")]
    position_column: Option<String>,

    /// Metres per unit of the position column [default: as its name ends, as in x_mm, else 1]
    #[arg(long, value_name = "M", allow_hyphen_values = true, requires = "file")]
    position_gain: Option<f64>,

    /// Column of velocities [default: velocity_mps, ...]
    #[arg(long, value_name = "NAME", requires = "file")]
    velocity_column: Option<String>,
}

impl Arguments {
    /// What they say of a table without forces.
    pub(crate) fn options(&self) -> TableOptions {
        TableOptions {
            columns: Columns {
                time: self.time_column.clone(),
                position: self.position_column.clone(),
                velocity: self.velocity_column.clone(),
                force: None,
            },
            position_gain: self.position_gain,
            time_unit_s: self.time_unit,
            ..TableOptions::default()
        }
    }
}
