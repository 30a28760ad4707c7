//! Changes as commands of `haptic-ctl`, to be repeated in a shell.

use crate::quantity::number;
use crate::{Difference, JournalEntry, ListedScene, Value};
use haptic_core::Directional;

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
    /// The command that does the same again, with its ramp; `None` where no single command does: a whole
    /// scene whose name is that of no scene in the library, or of several, or something that the daemon did by
    /// itself.
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
            "set" | "scene.load" => match self.changes.iter().find(|change| change.param == "name") {
                Some(Difference {
                    after: Some(Value::Word(name)),
                    ..
                }) => {
                    let mut named = library.iter().filter(|listed| listed.title == *name);
                    let listed = named.next().filter(|_| named.next().is_none())?;
                    format!("haptic-ctl scene load {}{ramp}", quoted(&listed.name))
                }
                _ => {
                    let values: Option<Vec<_>> = self.changes.iter().map(value_of).collect();
                    let values = values.filter(|values| !values.is_empty())?;
                    set_command(values) + &ramp
                }
            },
            _ => return None,
        };
        Some(command)
    }
}

/// What a change sets; `None` for what `set` cannot change.
fn value_of(change: &Difference) -> Option<(&str, Directional)> {
    match change.after {
        Some(Value::Number(value)) => Some((&change.param, value)),
        _ => None,
    }
}

/// A word as a shell takes it.
fn quoted(word: &str) -> String {
    let is_plain = |letter: char| letter.is_ascii_alphanumeric() || "-_./+".contains(letter);
    if !word.is_empty() && !word.starts_with('-') && word.chars().all(is_plain) {
        word.to_owned()
    } else {
        format!("'{}'", word.replace('\'', r"'\''"))
    }
}
