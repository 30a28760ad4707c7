//! The daemon's configuration: the command line, a file of the same options, and the defaults, all
//! checked.

mod checked;
mod error;
mod options;
mod resolve;
mod rig;
mod source;

pub(crate) use checked::{Config, MAX_TITLE};
pub(crate) use error::ConfigError;
pub(crate) use options::Options;
pub(crate) use resolve::ReloadedLimits;
pub(crate) use rig::{EngageRules, FrictionOptions, RigChoice};
pub(crate) use source::Configuration;
