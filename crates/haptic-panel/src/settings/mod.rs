//! What the panel remembers from one day to the next: a file of TOML in the user's configuration folder.
//!
//! Everything in it may be missing. A file that cannot be read is reported, set aside under another name and
//! never fatal.

mod remembered;
pub(crate) mod thread;

use clap::ValueEnum;
use serde::{Deserialize, Serialize};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::{fs, io};

/// The remembered settings. What is `None` was never set.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Settings {
    /// Colours: `system`, `dark` or `light`.
    pub theme: Option<Theme>,
    /// Width and height of the window, points.
    pub window_size: Option<[f32; 2]>,
    /// The folder of exports and recordings.
    pub folder: Option<String>,
    /// Format of a recording, by the ending of its file.
    pub recording_format: Option<String>,
    /// What stands beside the plots over time, by its name on the screen.
    pub beside: Option<String>,
    /// Whether the limits of the force are drawn.
    pub shows_limits: Option<bool>,
    /// What is shown in a window without room for two groups of plots, by its name on the screen.
    pub narrow: Option<String>,
    /// Whether the histograms are shown.
    pub shows_histograms: Option<bool>,
    /// Signal of the spectrum.
    pub spectrum_of: Option<String>,
    /// Scaling of the spectrum, by its name on the screen.
    pub spectrum_scaling: Option<String>,
    /// Time that the plots of the rig show, s.
    pub span_s: Option<f64>,
    /// The plots of the rig from top to bottom, each with the names of its signals.
    pub rig_plots: Option<Vec<Vec<String>>>,
    /// The ends of the value axis of each, where it is held; empty where it fits.
    pub rig_axes: Option<Vec<Vec<f64>>>,
    /// What is shown against what of the rig.
    pub rig_against: Option<AgainstSettings>,
    /// The plots of a recording, as those of the rig.
    pub recording_plots: Option<Vec<Vec<String>>>,
    /// The ends of their axes.
    pub recording_axes: Option<Vec<Vec<f64>>>,
    /// What is shown against what of a recording.
    pub recording_against: Option<AgainstSettings>,
}

/// The plot of one signal against another.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct AgainstSettings {
    /// The signal of the vertical axis.
    pub up: String,
    /// The signal of the horizontal axis.
    pub across: String,
    /// Which samples are drawn, by its name on the screen.
    pub extent: String,
    /// Whether the axis of velocity is that of the stick band.
    pub zooms_to_stick_band: bool,
}

/// Colours of the panel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, ValueEnum)]
#[serde(rename_all = "snake_case")]
pub enum Theme {
    /// Those of the desktop; dark without a preference.
    System,
    /// Light text on dark.
    Dark,
    /// Dark text on light.
    Light,
}

impl From<Theme> for egui::ThemePreference {
    fn from(theme: Theme) -> Self {
        match theme {
            Theme::System => Self::System,
            Theme::Dark => Self::Dark,
            Theme::Light => Self::Light,
        }
    }
}

impl From<egui::ThemePreference> for Theme {
    fn from(theme: egui::ThemePreference) -> Self {
        match theme {
            egui::ThemePreference::System => Self::System,
            egui::ThemePreference::Dark => Self::Dark,
            egui::ThemePreference::Light => Self::Light,
        }
    }
}

impl Settings {
    /// The file of this user: `haptic-gui/settings.toml` in `$XDG_CONFIG_HOME`, or else in `~/.config`. `None`
    /// without a home.
    #[must_use]
    pub fn file() -> Option<PathBuf> {
        let absolute = |name: &str| {
            std::env::var_os(name)
                .map(PathBuf::from)
                .filter(|path| path.is_absolute())
        };
        let folder = absolute("XDG_CONFIG_HOME").or_else(|| Some(absolute("HOME")?.join(".config")))?;
        Some(folder.join("haptic-gui/settings.toml"))
    }

    /// Reads the settings; without a file there are none. A file without settings is renamed, so that
    /// nothing of it is lost.
    ///
    /// # Errors
    /// Why it could not be read, and where it is now.
    pub fn read(file: &Path) -> Result<Self, String> {
        let text = match fs::read_to_string(file) {
            Ok(text) => text,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(Self::default()),
            Err(error) if error.kind() == io::ErrorKind::InvalidData => {
                return Err(set_aside(file, "it is not UTF-8 text"));
            }
            Err(error) => return Err(format!("the settings in {} cannot be read: {error}", file.display())),
        };
        toml::from_str(&text).map_err(|error| set_aside(file, error.message()))
    }

    /// Writes the settings in place of those before, whole or not at all.
    ///
    /// # Errors
    /// Why they could not be written, with the name of the file.
    pub fn write(&self, file: &Path) -> Result<(), String> {
        let write = || -> io::Result<()> {
            let folder = file.parent().unwrap_or(Path::new("."));
            fs::create_dir_all(folder)?;
            let text = toml::to_string(self).map_err(io::Error::other)?;
            // Another panel may write at the same time.
            let next = folder.join(format!("settings.{}.new", std::process::id()));
            let mut content = fs::File::create(&next)?;
            content.write_all(text.as_bytes())?;
            content.sync_all()?;
            fs::rename(&next, file)
        };
        write().map_err(|error| format!("the settings cannot be kept in {}: {error}", file.display()))
    }
}

/// Renames a broken file. Returns what to show the user.
fn set_aside(file: &Path, why: &str) -> String {
    let aside = file.with_extension("toml.broken");
    let kept = match fs::rename(file, &aside) {
        Ok(()) => format!("it is kept as {}", aside.display()),
        Err(error) => format!("it cannot be renamed either: {error}"),
    };
    format!(
        "the settings in {} are broken: {}; {kept}",
        file.display(),
        why.replace('\n', " ")
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn settings_are_read_as_they_were_written() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("not/there/yet/settings.toml");
        assert_eq!(Settings::read(&file), Ok(Settings::default()), "there are none yet");
        let settings = Settings {
            theme: Some(Theme::Light),
            window_size: Some([1400.0, 900.0]),
            folder: Some("/home/ada/pulls".to_owned()),
            span_s: Some(2.5),
            rig_plots: Some(vec![vec!["Coupling force".to_owned()], Vec::new()]),
            ..Settings::default()
        };
        settings.write(&file).expect("written");
        assert_eq!(Settings::read(&file), Ok(settings));
        let left = fs::read_dir(file.parent().expect("a folder")).expect("a folder");
        assert_eq!(left.count(), 1, "nothing else is left behind");
    }

    #[test]
    fn broken_settings_file_is_reported_and_kept() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("settings.toml");
        for broken in ["span_s = \"five\"\n", "theme = \"pink\"\n", "[[\n"] {
            fs::write(&file, broken).expect("written");
            let why = Settings::read(&file).expect_err("broken");
            assert!(why.contains("settings.toml.broken"), "{why}");
            let kept = fs::read_to_string(folder.path().join("settings.toml.broken"));
            assert_eq!(kept.expect("kept"), broken);
            assert_eq!(Settings::read(&file), Ok(Settings::default()));
        }
        fs::write(&file, "span_s = 7.0\nsmell = \"none\"\n").expect("written");
        let read = Settings::read(&file).expect("read");
        assert_eq!(read.span_s, Some(7.0));
        fs::write(&file, b"\xff\xfe").expect("written");
        assert!(Settings::read(&file).is_err_and(|why| why.contains("not UTF-8 text")));
    }
}
