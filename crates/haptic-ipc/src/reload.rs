//! The answer to `reload`.

use haptic_core::limiter::Limits;
use serde::{Deserialize, Serialize};
use std::fmt;

/// Answer to `reload`: what is other than before.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct ReloadReply {
    /// The configuration file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Changed limits.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limits: Option<LimitsChange>,
    /// Changed options that wait for a restart.
    pub needs_restart: Vec<String>,
    /// The active scene's name in the library, if its file has changed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub changed_scene: Option<String>,
    /// The first twenty files of the library that hold no scene, and why.
    pub scene_problems: Vec<String>,
}

/// Limits that changed.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
pub struct LimitsChange {
    /// The limits before.
    pub before: Limits,
    /// The limits from now on.
    pub after: Limits,
    /// The first tick with them.
    pub tick: u64,
}

/// In one line.
impl fmt::Display for ReloadReply {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.file.as_deref().unwrap_or("no configuration file"))?;
        let names = |names: &[String]| {
            names
                .iter()
                .map(|name| format!("`{name}`"))
                .collect::<Vec<_>>()
                .join(", ")
        };
        match &self.limits {
            Some(change) => change.fmt(f)?,
            None => f.write_str("; the limits stay")?,
        }
        if !self.needs_restart.is_empty() {
            write!(f, "; needs a restart: {}", names(&self.needs_restart))?;
        }
        if let Some(name) = &self.changed_scene {
            write!(
                f,
                "; the scene `{name}` of the library has changed, and the active scene stays as it is"
            )?;
        }
        for problem in &self.scene_problems {
            write!(f, "; {}", problem.lines().next().unwrap_or_default())?;
        }
        Ok(())
    }
}

/// What changed, each after a semicolon.
impl fmt::Display for LimitsChange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (before, after) = (&self.before, &self.after);
        for (name, before, after, unit) in [
            ("force-limit-n", before.force_n, after.force_n, "N"),
            ("slew-limit-n-per-s", before.slew_n_per_s, after.slew_n_per_s, "N/s"),
            ("speed-limit-mps", before.speed_mps, after.speed_mps, "m/s"),
            (
                "acceleration-limit-mps2",
                before.acceleration_mps2,
                after.acceleration_mps2,
                "m/s^2",
            ),
        ] {
            if before != after {
                write!(f, "; {name} {before} -> {after} {unit}")?;
            }
        }
        write!(f, " from tick {}", self.tick)
    }
}
