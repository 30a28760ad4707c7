//! Changes as commands of `haptic-ctl`, to be repeated in a shell.

use crate::quantity::number;
use crate::{Difference, JournalEntry, ListedScene, Value};
use haptic_core::Directional;
use std::ffi::OsStr;

/// The command that sets parameters to values in SI units, each under its name or symbol.
#[must_use]
pub fn set_command<'a>(values: impl IntoIterator<Item = (&'a str, Directional)>) -> String {
    let assignments = values.into_iter().map(|(name, value)| {
        if value.is_symmetric() {
            format!(" {name}={}", number(value.positive))
        } else {
            format!(" {name}+={} {name}-={}", number(value.positive), number(value.negative))
        }
    });
    format!("haptic-ctl set{}", assignments.collect::<String>())
}

impl JournalEntry {
    /// The command that does the same again, with its ramp; `None` for what the daemon did by itself. A whole scene
    /// that no name in the library, or the name of several, stands for is loaded by its revision, which the same run
    /// of the daemon remembers: so are another law, and a scene that a client sent.
    #[must_use]
    pub fn command(&self, library: &[ListedScene]) -> Option<String> {
        self.by.as_ref()?;
        let ramp = self
            .ramp_ms
            .filter(|ramp_ms| *ramp_ms > 0.0)
            .map_or_else(String::new, |ramp_ms| format!(" --ramp {}ms", number(ramp_ms)));
        let command = match self.op.as_str() {
            op @ ("engage" | "release" | "stop" | "reset") => format!("haptic-ctl {op}"),
            op @ ("undo" | "redo") => format!("haptic-ctl {op}{ramp}"),
            "set" | "scene.load" => {
                let values: Option<Vec<_>> = self.changes.iter().map(value_of).collect();
                match (values, self.loaded(library)) {
                    (Some(values), _) if values.is_empty() => return None,
                    (Some(values), _) => set_command(values) + &ramp,
                    (None, Some(name)) => format!("haptic-ctl scene load {}{ramp}", quoted(name)),
                    (None, None) => format!("haptic-ctl scene load @{}{ramp}", self.revision),
                }
            }
            _ => return None,
        };
        Some(command)
    }

    /// The name of the scene that took effect, if it is that of a single scene in the library.
    fn loaded<'a>(&self, library: &'a [ListedScene]) -> Option<&'a str> {
        let change = self.changes.iter().find(|change| change.param == "name")?;
        let Some(Value::Word(title)) = &change.after else {
            return None;
        };
        let mut named = library.iter().filter(|listed| listed.title == *title);
        let listed = named.next().filter(|_| named.next().is_none())?;
        Some(&listed.name)
    }
}

/// What a change sets; `None` for what `set` cannot change.
fn value_of(change: &Difference) -> Option<(&str, Directional)> {
    match change.after {
        Some(Value::Number(value)) => Some((&change.param, value)),
        _ => None,
    }
}

/// A word, or a path, as a shell takes it.
#[must_use]
pub fn quoted(word: impl AsRef<OsStr>) -> String {
    let word = word.as_ref().to_string_lossy();
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "-_./+".contains(letter);
    if !word.is_empty() && !word.starts_with('-') && word.chars().all(is_plain) {
        word.into_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}
