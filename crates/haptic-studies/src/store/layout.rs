//! Names of the files of a study, and the version of their layout.

pub(super) const PLAN: &str = "plan.toml";
pub(super) const STUDY: &str = "study.json";
pub(super) const DESCRIPTION: &str = "dataset_description.json";
pub(super) const LOCK: &str = ".lock";
pub(super) const DATA: &str = "data";
pub(super) const ALL_TRIALS: &str = "trials.parquet";

/// The version of the layout.
pub(super) const VERSION: u32 = 1;
