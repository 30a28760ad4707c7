//! Where the configuration comes from: the command line, and the file that it names.

use super::error::{ConfigError, read_text};
use super::options::Options;
use haptic_ipc::regular_file::with_short_lines;
use std::path::Path;

/// Where the configuration comes from.
#[derive(Clone, Debug, Default)]
pub(crate) struct Configuration {
    /// The command line.
    pub(super) typed: Options,
    /// The same, completed by the file as it was at the beginning.
    pub(super) begun_with: Options,
    /// Text of the file.
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

    /// Path of the file.
    pub(crate) fn path(&self) -> Option<&Path> {
        self.typed.config.as_deref()
    }
}

/// The options of a file, and its text.
fn read(path: &Path) -> Result<(Options, String), ConfigError> {
    let text = read_text(path)?;
    let options = toml::from_str(&text).map_err(|error| {
        let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or_default();
        let line = 1 + before.matches('\n').count();
        ConfigError::Parse {
            path: path.to_path_buf(),
            message: with_short_lines(&format!("line {line}: {}", error.message())),
        }
    })?;
    Ok((options, text))
}
