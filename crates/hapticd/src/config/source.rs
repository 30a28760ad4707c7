//! Where the configuration comes from: the command line, and the file that it names.

use super::error::{ConfigError, read_text};
use super::options::Options;
use haptic_core::nearest;
use haptic_ipc::regular_file::with_short_lines;
use std::path::Path;

/// Where the configuration comes from.
#[derive(Clone, Debug, Default)]
pub(crate) struct Configuration {
    /// The command line.
    pub(super) typed: Options,
    /// The same, completed by the file as it was at the beginning.
    pub(super) begun_with: Options,
    pub(super) text: String,
    /// Processors that the process could use at the beginning, before it left one to the loop.
    pub(super) available_cpus: Vec<usize>,
}

impl Configuration {
    /// The options of a command line, and of the file that it names.
    ///
    /// # Errors
    /// The file cannot be read, or is not one of options.
    pub(super) fn new(typed: Options, available_cpus: Vec<usize>) -> Result<Self, ConfigError> {
        let (file, text) = match &typed.config {
            Some(path) => read(path)?,
            None => Default::default(),
        };
        Ok(Self {
            begun_with: typed.clone().or(file),
            typed,
            text,
            available_cpus,
        })
    }

    pub(crate) fn path(&self) -> Option<&Path> {
        self.typed.config.as_deref()
    }
}

/// The options of a file, and its text.
fn read(path: &Path) -> Result<(Options, String), ConfigError> {
    let text = read_text(path)?;
    let options = toml::from_str(&text).map_err(|error| {
        let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
        let line = before.matches('\n').count();
        let problem = problem_of(text.lines().nth(line).unwrap_or_default(), error.message());
        ConfigError::Parse {
            path: path.to_path_buf(),
            message: with_short_lines(&format!("line {}: {problem}", line + 1)),
        }
    })?;
    Ok((options, text))
}

/// What is wrong with a line that TOML's reader refuses.
fn problem_of(line: &str, message: &str) -> String {
    let (name, value) = line.split_once('=').unwrap_or((line, ""));
    let (name, value) = (name.trim().trim_matches(&['[', ']'][..]), value.trim());
    let is_word = value.starts_with(|first: char| first.is_alphabetic() || first == '/');
    let number = value.trim_end_matches(|last: char| !last.is_ascii_digit());
    let unit = value.strip_prefix(number).unwrap_or_default().trim_start();
    let has_unit =
        unit.starts_with(|first: char| first.is_alphabetic() || first == '%') && number.parse::<f64>().is_ok();
    if message == "duplicate key" {
        format!("{name} is there a second time")
    } else if message.starts_with("unknown field") {
        let names = Options::names();
        let known: Vec<&str> = names.iter().map(String::as_str).collect();
        let meant = nearest::meant_or_semicolon(&name.replace('_', "-"), &known);
        format!("unknown field `{name}`{meant} the fields are {}", names.join(", "))
    } else if is_word && !message.starts_with("invalid type") && !["true", "false"].contains(&value) {
        format!("{name} = {value}: a text stands in quotes: {name} = \"{value}\"")
    } else if has_unit && !message.starts_with("invalid type") {
        format!("{name} = {value}: it must be a number without a unit; `hapticd --help` has the unit of {name}")
    } else if let Some((_, expected)) = message
        .split_once(", expected ")
        .filter(|(problem, _)| problem.starts_with("invalid type"))
    {
        let expected = match expected {
            "f64" => "a number, without quotes",
            "a string" => "a text in quotes",
            "a boolean" => "true or false, without quotes",
            _ if expected.starts_with(['u', 'i']) => "a whole number, without quotes",
            _ => expected,
        };
        format!("{name} = {value}: it must be {expected}")
    } else if message.starts_with(name) {
        message.to_owned()
    } else {
        format!("{name} = {value}: {message}")
    }
}
