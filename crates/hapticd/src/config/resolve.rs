//! From where the configuration comes to what the daemon runs with: at its start, and again for a reload.

use super::checked::Config;
use super::error::ConfigError;
use super::options::Options;
use super::source::Configuration;
use crate::rt::privileges::available_cpus;
use device_boards::Address;
use haptic_core::limiter::Limits;

/// The options that take effect when the configuration is read again.
const LIMITS: [&str; 4] = [
    "force-limit-n",
    "slew-limit-n-per-s",
    "speed-limit-mps",
    "acceleration-limit-mps2",
];

/// What was read again.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ReloadedLimits {
    pub(crate) limits: Limits,
    /// Options that are other than those that the daemon was started with, and take effect with a restart.
    pub(crate) needs_restart: Vec<String>,
}

impl Options {
    /// Reads the configuration file, if one is named, and checks everything.
    ///
    /// # Errors
    /// The first invalid option.
    pub(crate) fn resolve(self) -> Result<Config, ConfigError> {
        Configuration::new(self, available_cpus())?.check()
    }

    /// The device of the command line, else of the configuration file.
    ///
    /// # Errors
    /// The file cannot be read, or is not one of options; or none of both names a device.
    pub(crate) fn device(self) -> Result<Address, ConfigError> {
        let options = Configuration::new(self, Vec::new())?.begun_with;
        options.device.map(|named| named.0).ok_or(ConfigError::NoDevice)
    }
}

impl Configuration {
    /// Checks everything.
    ///
    /// # Errors
    /// The first invalid option, with its line in the file if it stands there.
    fn check(self) -> Result<Config, ConfigError> {
        let (options, text, cpus) = (self.begun_with.clone(), self.text.clone(), self.available_cpus.clone());
        options
            .check(&cpus, self)
            .map_err(|error| located(error, &options, &text))
    }

    /// Reads the file again, and checks all of it.
    ///
    /// # Errors
    /// As at the beginning.
    pub(crate) fn reload(&self) -> Result<ReloadedLimits, ConfigError> {
        let again = Self::new(self.typed.clone(), self.available_cpus.clone())?;
        let mut needs_restart = self.begun_with.changed_in(&again.begun_with);
        needs_restart.retain(|name| !LIMITS.contains(&name.as_str()));
        Ok(ReloadedLimits {
            limits: again.check()?.servo.limits,
            needs_restart,
        })
    }
}

/// The same error with the line of the file in which the option stands that it names, if it stands there.
fn located(error: ConfigError, options: &Options, text: &str) -> ConfigError {
    let message = error.to_string();
    let is_named = |line: &str| {
        let name = line.split_once('=').map(|(name, _)| name.trim());
        let stated = message.split_once(" = ").map(|(stated, _)| stated);
        name.is_some() && name == stated
    };
    match (&options.config, text.lines().position(is_named)) {
        (Some(path), Some(index)) => ConfigError::InFile {
            path: path.clone(),
            line: index + 1,
            source: Box::new(error),
        },
        _ => error,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[test]
    fn reload_gives_limits_and_names_options_that_need_a_restart() {
        let directory = tempfile::tempdir().expect("a directory");
        let path = directory.path().join("hapticd.toml");
        let write = |text: &str| std::fs::write(&path, text).expect("written");
        write("device = \"fake\"\nforce-limit-n = 12\nspeed-limit-mps = 2\n");
        let typed = Options::try_parse_from([
            "hapticd",
            "--config",
            path.to_str().expect("a path"),
            "--speed-limit-mps=3",
        ]);
        let started = typed.expect("it parses").resolve().expect("it holds").source;
        assert_eq!(started.path(), Some(&*path));

        write("device = \"fake\"\nforce-limit-n = 5\nspeed-limit-mps = 1\nrate = 2000\nstale-ms = 30\n");
        let read = started.reload().expect("it holds");
        let expected = Limits {
            force_n: 5.0,
            speed_mps: 3.0,
            ..Limits::default()
        };
        assert_eq!(read.limits, expected, "the command line wins");
        assert_eq!(read.needs_restart, ["rate", "stale-ms"]);

        for (text, parts) in [
            (
                "device = \"fake\"\n\nforce-limit-n = 5000\n",
                "line 3: force-limit-n = 5000 N is out of range: it must be from 0.1 to 1000 N",
            ),
            (
                "device = \"fake\"\nscene = \"not/here.toml\"\n",
                "line 2: scene = not/here.toml: No such file",
            ),
            (
                "force_limit_n = 5\n",
                "line 1: unknown field `force_limit_n`, did you mean `force-limit-n`?",
            ),
            ("rate = 500\nrate = 1000\n", "line 2: rate is there a second time"),
            (
                "device = fake\n",
                "device = fake: a text stands in quotes: device = \"fake\"",
            ),
            ("device = /dev/ttyACM0\n", "device = \"/dev/ttyACM0\""),
            (
                "stale-ms = 500ms\n",
                "line 1: stale-ms = 500ms: it must be a number without a unit; `hapticd --help` has the unit",
            ),
            (
                "force-limit-n = -8 N\n",
                "force-limit-n = -8 N: it must be a number without",
            ),
            ("socket = 8/x\n", "socket = 8/x: string values must be quoted"),
            (
                "device = \"fake\"\nforce-limit-n = \"5\"\n",
                "line 2: force-limit-n = \"5\": it must be a number, without quotes",
            ),
            ("device = 7\n", "device = 7: it must be a text in quotes"),
            (
                "cpu = \"x\"\n",
                "cpu = \"x\": it must be a whole number, without quotes",
            ),
            (
                "metrics = \"9664\"\n",
                "line 1: metrics = \"9664\": invalid socket address",
            ),
            (
                "late-policy = \"fault\"\n",
                "line 1: late-policy = \"fault\": there is no policy `fault`, did you mean `fault:N`?",
            ),
            ("force-limit-n = 5\n", "name the rig"),
        ] {
            write(text);
            let refused = started.reload().expect_err(text).to_string();
            assert!(refused.contains(parts), "{refused} lacks {parts}");
            assert_eq!(refused.lines().count(), 1, "{refused}");
        }
        std::fs::remove_file(&path).expect("removed");
        let refused = started.reload().expect_err("there is no file").to_string();
        assert!(refused.contains("hapticd.toml"), "{refused}");
    }
}
