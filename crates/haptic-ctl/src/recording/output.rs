//! Options of what is written.

use clap::ValueHint;
use std::path::PathBuf;

/// The recording that is written.
#[derive(Debug, clap::Args)]
pub(super) struct Output {
    /// Recording to write; its name ends in .mcap, .csv or .parquet
    #[arg(value_hint = ValueHint::FilePath)]
    pub(super) out: PathBuf,

    /// Replace an existing file
    #[arg(long)]
    pub(super) force: bool,
}
